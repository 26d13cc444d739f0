"""A nominal surface of trimmed spline faces: exact where the closest point is inside the loops of a face, else by triangles with a bound.

A foot on the whole splines is the closest point of the part where it lies inside the loops of its face: the part holds nothing more. Else
it lies where a face is cut away. Then each face is asked by itself: the nearest foot inside loops is the closest point if every face that
comes nearer beyond its loops is, by its triangles, farther all the same.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inspection.errors import NominalError
from inspection.surface.feet import FootKind, SurfaceFeet, points_in_space
from inspection.surface.patches import PatchSurface
from inspection.surface.spline_face import SplineFace
from inspection.surface.triangles import TriangleSurface
from inspection.surface.trim_loop import TrimLoop, trim_loop
from inspection.surface.welding import have_area

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Truth = NDArray[np.bool_]

_DRAWS, _MORE, _FEW = 8, 1.05, 100  # rounds in which places are drawn: so many times as many, and some, where too few lay inside loops


@dataclass(frozen=True, slots=True, eq=False)
class TrimmedFace:
    """A face of a CAD part.

    spline      : the surface under it, over a rectangle of parameters that holds its loops
    loop        : (s, 2, 5) segments along its loops, with u, v and x, y, z in mm at both ends; None where it is the whole rectangle
    loop_off_mm : how far the loops may lie off the segments
    """

    spline: SplineFace
    loop: Array | None = None
    loop_off_mm: float = 0.0


class TrimmedSurface:
    """A surface of trimmed faces; `project` gives exact closest points inside loops. It satisfies `NominalSurface`.

    faces        : None where a face is no exact spline: it is known by its triangles alone
    triangles_mm : (t, 3, 3) all faces as triangles
    owner        : (t,) the number of the face of each, from 0
    error_mm     : bound of how far the triangles lie off the faces. It is stated for feet that triangles give, whose parameter is NaN;
                   for exact ones 0 is

    Raises NominalError where no surface can be made of them.
    """

    __slots__ = (
        "_hidden",
        "_mesh",
        "_numbers",
        "_parts",
        "_splines",
        "area_mm2",
        "is_closed",
        "nominal_error_mm",
        "notes",
        "sides_known",
        "size_mm",
    )

    def __init__(self, faces: Sequence[TrimmedFace | None], triangles_mm: ArrayLike, owner: ArrayLike, error_mm: float) -> None:
        triangles, number = np.asarray(triangles_mm, dtype=np.float64), np.asarray(owner, dtype=np.int64)
        mesh = self._mesh = TriangleSurface(triangles, error_mm, number)
        self.area_mm2, self.is_closed, self.size_mm = mesh.area_mm2, mesh.is_closed, mesh.size_mm
        self.sides_known = True
        self.nominal_error_mm, self.notes = mesh.nominal_error_mm, mesh.notes
        has_area = have_area(triangles)
        flat = sorted(set(range(len(faces))) - set(number[has_area].tolist()))
        if flat:
            self.notes = (*self.notes, f"faces without area were left out: {', '.join(str(i + 1) for i in flat)}")
        self._parts = [_part(i, face, triangles[has_area & (number == i)], mesh) for i, face in enumerate(faces) if i not in flat]
        known = [part for part in self._parts if part.spline is not None]
        if not known:
            raise NominalError("no face is an exact spline")
        self._numbers = np.array([part.number for part in known], dtype=np.int32)
        self._splines = PatchSurface([part.spline.faces[0] for part in known if part.spline is not None], joined=False)
        hidden = has_area & ~np.isin(number, self._numbers)
        self._hidden = TriangleSurface(triangles[hidden]) if hidden.any() else None

    def __len__(self) -> int:
        return len(self._parts)

    def project(self, points_mm: ArrayLike, threads: int | None = None) -> SurfaceFeet:
        """Closest points of the surface to points (m, 3); see `NominalSurface`. The number of threads changes no bit."""
        points = points_in_space(points_mm)
        feet = self._splines.project(points, threads)
        feet = replace(feet, face=np.where(feet.face >= 0, self._numbers[feet.face], np.int32(-1)))
        exact = self._are_inside(feet)
        if self._hidden is not None:
            hidden = np.abs(self._hidden.project(points[exact], threads).distance_mm) - self.nominal_error_mm
            exact[exact] = np.abs(feet.distance_mm[exact]) <= hidden
        rest = np.flatnonzero(~exact)
        return _with_rows(feet, rest, self._project_apart(points[rest], threads)) if len(rest) else feet

    def sample(self, count: int) -> tuple[Array, Array]:
        """At least `count` places (n, 3) spread over the area, and the outward normals (n, 3) there: on splines inside their loops."""
        found: list[tuple[Array, Array]] = []
        hidden = 0
        if self._hidden is not None:
            found.append(self._hidden.sample(int(np.ceil(count * self._hidden.area_mm2 / self.area_mm2))))
            hidden = len(found[0][0])
        wanted = max(count - hidden, 1)
        drawn = int(np.ceil(count * self._splines.area_mm2 / self.area_mm2))
        for _ in range(_DRAWS):
            feet = self._splines.project(self._splines.sample(drawn)[0])
            inside = self._are_inside(replace(feet, face=self._numbers[feet.face]))
            kept = int(np.count_nonzero(inside))
            if kept >= wanted:
                found.append((feet.foot_mm[inside], feet.normal[inside]))
                return np.concatenate([places for places, _ in found]), np.concatenate([normals for _, normals in found])
            drawn = int(drawn * _MORE * wanted / max(kept, 1)) + _FEW
        return self._mesh.sample(count)  # loops that hold next to nothing

    def _are_inside(self, feet: SurfaceFeet) -> Truth:
        """Whether feet on the splines (m,) lie inside the loops of their faces."""
        inside = np.asarray(feet.kind == FootKind.FACE)
        for part in self._parts:
            if part.loop is not None:
                rows = np.flatnonzero(inside & (feet.face == part.number))
                inside[rows] = part.loop.holds(feet.parameter[rows], feet.foot_mm[rows])
        return inside

    def _project_apart(self, points: Array, threads: int | None) -> SurfaceFeet:
        """Feet of points (m, 3) whose closest place on the splines is cut away: every face that is near enough is asked."""
        feet = self._mesh.project(points, threads)
        feet = replace(feet, parameter=np.full((len(points), 2), np.nan))
        best, least = feet, np.full(len(points), np.inf)
        beyond: list[tuple[_Part, Index, Array]] = []
        for part in self._parts:
            rows = np.flatnonzero(_from_box(points, part.box) <= np.abs(feet.distance_mm) + self.nominal_error_mm)
            if not len(rows):
                continue
            if part.spline is None:
                beyond.append((part, rows, np.zeros(len(rows))))
                continue
            found = part.spline.project(points[rows], threads)
            found = replace(found, face=np.full(len(rows), part.number, dtype=np.int32))
            inside, distance = self._are_inside(found), np.abs(found.distance_mm)
            nearer = np.flatnonzero(inside & (distance < least[rows]))
            best, least[rows[nearer]] = _with_rows(best, rows[nearer], _rows_of(found, nearer)), distance[nearer]
            beyond.append((part, rows[~inside], distance[~inside]))
        certain = np.isfinite(least)
        for part, rows, nearest in beyond:
            asked = rows[certain[rows] & (nearest < least[rows])]
            if len(asked):
                far = np.abs(part.triangles.project(points[asked], threads).distance_mm) - self.nominal_error_mm
                certain[asked] = far >= least[asked]
        kept = np.flatnonzero(certain)
        return _with_rows(feet, kept, _rows_of(best, kept))


@dataclass(frozen=True, slots=True, eq=False)
class _Part:
    """One face by itself: its number, its spline and loop, its triangles, and the box (2, 3) that holds it."""

    number: int
    spline: PatchSurface | None
    loop: TrimLoop | None
    triangles: TriangleSurface
    box: Array


def _part(number: int, face: TrimmedFace | None, triangles: Array, mesh: TriangleSurface) -> _Part:
    """A face with its outside on the same side as that of its triangles in the whole mesh."""
    corners, off = triangles.reshape(-1, 3), mesh.nominal_error_mm
    box = np.stack([corners.min(axis=0) - off, corners.max(axis=0) + off])
    alone = TriangleSurface(triangles)
    if face is None:
        return _Part(number, None, None, alone, box)
    spline = PatchSurface([face.spline], joined=False)
    areas = np.linalg.norm(np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=1)
    middle = triangles[np.argmax(areas)].mean(axis=0)[None]
    if float((spline.project(middle).normal * mesh.project(middle).normal).sum()) < 0:
        spline = PatchSurface([replace(face.spline, reversed=not face.spline.reversed)], joined=False)
    loop = None if face.loop is None else trim_loop(face.loop, face.loop_off_mm)
    return _Part(number, spline, loop, alone, box)


def _from_box(points: Array, box: Array) -> Array:
    """Distances (m,) of points from a box."""
    return np.asarray(np.linalg.norm(np.maximum(0.0, np.maximum(box[0] - points, points - box[1])), axis=1))


_FIELDS = tuple(each.name for each in fields(SurfaceFeet))


def _rows_of(feet: SurfaceFeet, rows: Index) -> SurfaceFeet:
    return SurfaceFeet(*(getattr(feet, name)[rows] for name in _FIELDS))


def _with_rows(feet: SurfaceFeet, rows: Index, others: SurfaceFeet) -> SurfaceFeet:
    """Feet of which some rows are others."""
    arrays = []
    for name in _FIELDS:
        array = getattr(feet, name).copy()
        array[rows] = getattr(others, name)
        arrays.append(array)
    return SurfaceFeet(*arrays)
