"""Nominal surfaces from files: faces of STEP and IGES, exact inside their loops; triangles of STL, OBJ and PLY; clouds of points."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from drivers import CadError, MeshError, PointFileError, read_points
from drivers.cad import CadFace, CadFaces, Kind, read_cad_faces
from drivers.surface import Open3DMissing, Open3DProcess, SurfaceMesh, is_ply_cloud, read_obj, read_ply_cloud, read_stl
from inspection import NominalError
from inspection.surface import (
    CloudSurface,
    NominalSurface,
    PatchSurface,
    SingleFace,
    SplineFace,
    TriangleSurface,
    TrimmedFace,
    TrimmedSurface,
    have_area,
    words_on_odd_faces,
    words_on_odd_triangles,
)

Array = NDArray[np.float64]

CHORD_MM = 0.001  # between trimmed faces and their triangles: well below what is measured, and counted against the verdict
_CLOUDS = (".xyz", ".asc", ".npy")
SURFACE_SUFFIXES = (".stl", ".obj", ".ply", ".step", ".stp", ".p21", ".igs", ".iges", *_CLOUDS)
_CAD: dict[str, Kind] = {".step": "step", ".stp": "step", ".p21": "step", ".igs": "iges", ".iges": "iges"}


@dataclass(frozen=True, slots=True, eq=False)
class SurfaceFile:
    """A nominal surface as its file was understood.

    nominal       : in mm
    source_format : the name of the format
    faces         : how many faces, triangles, or points that have a jet
    notes         : what was assumed, and what was done to it, in sentences
    """

    nominal: NominalSurface
    source_format: str
    faces: int
    notes: tuple[str, ...]


def states_its_unit(path: Path) -> bool:
    """Whether a file is one of CAD, which states its own unit and whose faces are exact."""
    return path.suffix.lower() in _CAD


def load_surface(
    path: Path,
    scale: float = 1.0,
    nominal_error_mm: float | None = None,
    chord_mm: float = CHORD_MM,
    read_faces: Callable[[Path, Kind, float], CadFaces] = read_cad_faces,
) -> SurfaceFile:
    """Read a nominal surface. Raises NominalError, which names the file and what to do.

    scale            : mm that one unit of a mesh or a cloud is; CAD files state their own unit
    nominal_error_mm : the chord tolerance with which a mesh was exported from CAD; None takes the mesh for the nominal itself
    chord_mm         : how far triangles may lie off faces that are trimmed, or no exact splines
    """
    kind = path.suffix.lower()
    if kind in _CAD:
        return _of_cad(path, _CAD[kind], chord_mm, read_faces)
    if kind not in SURFACE_SUFFIXES:
        raise NominalError(f"{path}: not a format of surfaces; known are {', '.join(SURFACE_SUFFIXES)}")
    if kind in _CLOUDS:
        return _of_points(path, scale)
    if kind == ".ply" and _is_cloud(path):
        return _of_vertices(path, scale)
    mesh = _read_mesh(path, kind, scale)
    triangles = np.concatenate([np.array(piece, dtype=np.float64) for piece in mesh.pieces()])
    rounding = _rounding_mm(triangles, scale) if mesh.kind == "binary STL" else 0.0
    notes = list(mesh.warnings)
    if nominal_error_mm is None:
        notes.append(
            "the mesh is taken for the nominal itself: if it was exported from CAD, state the chord tolerance, or bring the STEP file"
        )
    surface = TriangleSurface(triangles, (nominal_error_mm or 0.0) + rounding)
    return SurfaceFile(surface, mesh.kind, len(surface), (*notes, *surface.notes, *words_on_odd_triangles(triangles)))


def _of_points(path: Path, scale: float) -> SurfaceFile:
    try:
        found = read_points(path, scale, normals=True, in_space=True)
        return _of_cloud(path, found.points_mm, found.normals, "points", found.notes)
    except PointFileError as error:
        raise NominalError(str(error)) from None


def _is_cloud(path: Path) -> bool:
    try:
        return is_ply_cloud(path)
    except MeshError as error:
        raise NominalError(str(error)) from None


def _of_vertices(path: Path, scale: float) -> SurfaceFile:
    try:
        found = read_ply_cloud(path, scale)
    except MeshError as error:
        raise NominalError(str(error)) from None
    return _of_cloud(path, found.points_mm, found.normals, "PLY points", ())


def _of_cloud(path: Path, points_mm: Array, normals: Array | None, source_format: str, notes: tuple[str, ...]) -> SurfaceFile:
    try:
        cloud = CloudSurface(points_mm, normals)
    except NominalError as error:
        raise NominalError(f"{path}: {error}") from None
    words = f"the nominal is a cloud of points: by how its jets disagree it lies up to {cloud.nominal_error_mm:.2g} mm off (95 %)"
    return SurfaceFile(cloud, source_format, len(cloud), (*notes, *cloud.notes, words))


def _read_mesh(path: Path, kind: str, scale: float) -> SurfaceMesh:
    try:
        if kind == ".stl":
            return read_stl(path, scale)
        if kind == ".obj":
            return read_obj(path, scale)
        with Open3DProcess() as process:
            return process.read(path, scale)
    except (MeshError, Open3DMissing) as error:
        raise NominalError(str(error)) from None


def _rounding_mm(triangles: Array, scale: float) -> float:
    """How far float32 may round a corner from where it was."""
    largest = float(np.abs(triangles).max()) / scale
    return float(np.spacing(np.float32(largest))) / 2 * scale * 3**0.5


def _of_cad(path: Path, kind: Kind, chord_mm: float, read_faces: Callable[[Path, Kind, float], CadFaces]) -> SurfaceFile:
    try:
        found = read_faces(path, kind, chord_mm)
        faces = [None if face is None else _trimmed_face(face, number) for number, face in enumerate(found.faces, 1)]
        whole = [face.spline for face in faces if face is not None and face.loop is None]
        if len(whole) == len(faces):
            patches = PatchSurface(whole)
            odd = words_on_odd_faces([SingleFace.of_spline(face) for face in whole])
            return SurfaceFile(patches, kind, len(whole), (*patches.notes, *odd))
        words = (_words_on_triangles(found), *_words_on_odd_cad(found))
        if faces.count(None) == len(faces):
            triangles = TriangleSurface(found.triangles_mm, found.error_mm, found.face)
            return SurfaceFile(triangles, kind, len(faces), (*words, *triangles.notes))
        trimmed = TrimmedSurface(faces, found.triangles_mm, found.face, found.error_mm)
    except (CadError, NominalError) as error:
        raise NominalError(f"{path}: {error}") from None
    return SurfaceFile(trimmed, kind, len(faces), (*words, *trimmed.notes))


def _words_on_odd_cad(found: CadFaces) -> tuple[str, ...]:
    """What is odd about faces that come as triangles."""
    each = [found.triangles_mm[found.face == number] for number in range(len(found.faces))]
    if not all(have_area(triangles).any() for triangles in each):
        return ()  # what is left out of the surface is said there, and numbers would not be those of the file
    odd = words_on_odd_faces([SingleFace.of_triangles(triangles) for triangles in each], found.error_mm)
    return (*odd, *words_on_odd_triangles(found.triangles_mm, found.face))


def _words_on_triangles(found: CadFaces) -> str:
    """What is exact in a part with trimmed faces, and what is not."""
    count, unknown = len(found.faces), found.faces.count(None)
    cut = sum(face is not None and face.loop is not None for face in found.faces)
    said = [f"{cut} of {count} faces are trimmed: feet are exact inside their loops"] if cut else []
    said += [f"{unknown} of {count} faces are no exact splines"] if unknown else []
    return (
        f"{'; '.join(said)}; what lies {'elsewhere' if cut else 'there'}, beside edges above all, is judged by {len(found.triangles_mm)} "
        f"triangles up to {found.error_mm:.2g} mm off the faces, which counts against the verdict there as U does"
    )


def _trimmed_face(face: CadFace, number: int) -> TrimmedFace:
    weights = face.poles[:, :, 3]
    rational = None if (weights == weights.flat[0]).all() else np.ascontiguousarray(weights)
    points = np.ascontiguousarray(face.poles[:, :, :3] / weights[:, :, None])
    spline = SplineFace(face.degree, points, face.knots_u, face.knots_v, rational, face.reversed, str(number))
    return TrimmedFace(spline, face.loop, face.loop_off_mm)
