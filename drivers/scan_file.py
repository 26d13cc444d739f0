"""Scans of whole surfaces from files: tables of points, clouds in PLY, and the vertices of meshes, with normals where they are known.

A scanner's program often hands over a mesh in place of the points. Then its vertices are what was measured: each is taken once, in the
order in which it first stands in the file, and its normal is the file's own or that of the triangles around it, weighted by their area.
"""

from collections.abc import Collection, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from drivers.errors import MeshError, PointFileError
from drivers.files.column_choice import AxisName
from drivers.files.plain_rows import Room
from drivers.files.point_file import PointFile, read_points
from drivers.files.stated_units import UnitName, mm_per
from drivers.surface import Open3DMissing, Open3DProcess, is_ply_cloud, read_obj, read_ply_cloud, read_stl

Array = NDArray[np.float64]
Index = NDArray[np.int64]

_FEWEST = 2
MESHES = (".stl", ".obj", ".ply")
_FROM_FILE = "the normals are those of the file of the scan"
_FROM_TRIANGLES = "the normals are those of the triangles around each vertex, weighted by area"
_NONE = "the file has no normals: on which side of a wall a point lies is decided by distance alone"


def read_scan(
    path: Path,
    scale: float = 1.0,
    *,
    unit: UnitName | None = None,
    columns: Mapping[AxisName, int] | None = None,
    invalid: Collection[float] = (),
    room: Room = np.empty,
) -> PointFile:
    """Read the points of a scan in space: as `read_points` does, with normals, and from STL, OBJ and PLY as well.

    columns, invalid : for tables alone; a mesh and a PLY file name what they hold

    Raises PointFileError, which says what to do.
    """
    if path.suffix.lower() not in MESHES:
        table = read_points(path, scale, unit=unit, columns=columns, invalid=invalid, room=room, normals=True, in_space=True)
        return replace(table, notes=(*table.notes, _NONE if table.normals is None else _FROM_FILE))
    if columns or invalid:
        what = "columns" if columns else "values that mean no point"
        raise PointFileError(f"{path}: {what} are given for a table; expected none beside {path.suffix.upper()[1:]}")
    try:
        found = _read_vertices(path, mm_per(unit) if unit else scale)
    except (MeshError, Open3DMissing) as error:
        raise PointFileError(str(error)) from None
    return replace(found, notes=(_words_of_unit(found.points_mm, unit, scale), *found.notes))


def _words_of_unit(points_mm: Array, unit: UnitName | None, scale: float) -> str:
    """In what a file was read that states no unit, and how large the scan is by that: a wrong unit shows."""
    there = points_mm[np.isfinite(points_mm).all(axis=1)]
    size = " x ".join(f"{side:.4g}" for side in np.ptp(there, axis=0)) if len(there) else "0 x 0 x 0"
    taken = (
        f"read in {unit}, as asked"
        if unit
        else f"read at {scale:g} mm a unit, as asked"
        if scale != 1
        else "it states no unit, taken as mm"
    )
    return f"{taken}: the scan is {size} mm large"


def _read_vertices(path: Path, scale: float) -> PointFile:
    kind = path.suffix.lower()
    if kind == ".ply":
        return _of_ply(path, scale)
    mesh = read_stl(path, scale) if kind == ".stl" else read_obj(path, scale)
    corners = np.concatenate([piece.astype(np.float64).reshape(-1, 3) for piece in mesh.pieces()])
    vertices, of_corner = _each_once(corners)
    return _of_mesh(vertices, of_corner.reshape(-1, 3), mesh.warnings)


def _of_ply(path: Path, scale: float) -> PointFile:
    """Every vertex of a PLY file, be it in a face or not. Without faces the rows are points, and stay as they are."""
    found = read_ply_cloud(path, scale)
    if is_ply_cloud(path):
        if len(found.points_mm) < _FEWEST:
            raise MeshError(f"{path}: a scan of {len(found.points_mm)} points; expected at least {_FEWEST}")
        return PointFile(found.points_mm, (_NONE if found.normals is None else _FROM_FILE,), found.normals)
    vertices, of_row = _each_once(found.points_mm)
    if found.normals is not None:  # the faces tell nothing more
        words = f"a mesh as the scan: its {len(vertices)} vertices are judged, each once; its faces are not"
        return PointFile(vertices, (words, _FROM_FILE), _sums(of_row, found.normals, len(vertices)))
    with Open3DProcess() as process:
        faces = process.faces_of(path, len(found.points_mm))
    return _of_mesh(vertices, of_row[faces], ())


def _each_once(places: Array) -> tuple[Array, Index]:
    """Places (n, 3) without those that stood before, in their order, and which of them (n,) each one is."""
    places = places + 0.0  # -0.0 is no other place than 0.0
    order = np.lexsort(places.T[::-1])
    ahead = places[order]
    is_new = np.concatenate([[True], (ahead[1:] != ahead[:-1]).any(axis=1)])
    first = order[is_new]  # the order is a stable one: of equal places the first stands first
    rank = np.empty(len(first), dtype=np.int64)
    rank[np.argsort(first)] = np.arange(len(first))
    which = np.empty(len(places), dtype=np.int64)
    which[order] = rank[np.cumsum(is_new) - 1]
    return places[np.sort(first)], which


def _of_mesh(vertices: Array, triangles: Index, told: tuple[str, ...]) -> PointFile:
    """The vertices (n, 3) of triangles (t, 3), which are numbers of these, as a scan."""
    corners = vertices[triangles]  # (t, 3, 3)
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    words = (
        f"a mesh as the scan: its {len(vertices)} vertices are judged, each once; its {len(triangles)} triangles, whose edges are "
        f"{np.nanmedian(edges):.3g} mm long in the middle and at most {np.nanmax(edges):.3g} mm, are not"
    )
    return PointFile(vertices, (*told, words, _FROM_TRIANGLES), _around(corners, triangles, len(vertices)))


def _around(corners: Array, triangles: Index, count: int) -> Array:
    """Normals (n, 3) of vertices: those of the triangles (t, 3, 3) around each, as long as their areas; zero where there is none."""
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    whole = np.isfinite(across).all(axis=1)
    return _sums(triangles[whole].ravel(), np.repeat(across[whole], 3, axis=0), count)


def _sums(which: Index, vectors: Array, count: int) -> Array:
    """The sum (count, 3) of the vectors (k, 3) that belong to each number (k,)."""
    return np.column_stack([np.bincount(which, weights=vectors[:, axis], minlength=count) for axis in range(3)])
