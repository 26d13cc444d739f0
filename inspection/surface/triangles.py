"""A nominal surface of triangles, exact as it is given: closest points with the right sign."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inspection.errors import NominalError
from inspection.kernels.surfaces import TriangleTables, project_on_triangles
from inspection.kernels.surfaces.layout import CLUSTER_ROWS, CORNER_A, EDGE_AB, EDGE_AC, PER_AB, PER_AC, PER_BC, PER_NORMAL, WAYS
from inspection.surface.feet import KILOMETRE_MM, SurfaceFeet, points_in_space, surface_feet
from inspection.surface.item_tree import item_tree
from inspection.surface.spread import shares_of, spread_within
from inspection.surface.welding import WeldedTriangles, weld

Array = NDArray[np.float64]

_APART = 0.01  # of the size: how far along its normal a triangle is moved before near ones are gathered, so that thin walls come apart
_GRAIN = 1e-14  # of the farthest coordinate: a distance that is round-off


class TriangleSurface:
    """A surface of triangles; `project` gives their exact closest points. It satisfies `NominalSurface`.

    nominal_error_mm : bound of how far the triangles lie off the surface that they stand for, such as the chord tolerance of an export;
                       0 for triangles that are the nominal themselves
    is_closed        : whether it has no border
    face             : (n,) the face that each triangle belongs to; None for the number of the triangle itself

    Raises NominalError for triangles (n, 3, 3) of which no surface can be made.
    """

    __slots__ = ("_corners_mm", "_face", "_tables", "area_mm2", "is_closed", "nominal_error_mm", "notes", "sides_known", "size_mm")

    def __init__(self, triangles_mm: ArrayLike, nominal_error_mm: float = 0.0, face: ArrayLike | None = None) -> None:
        loose = np.asarray(triangles_mm, dtype=np.float64)
        if loose.ndim != 3 or loose.shape[1:] != (3, 3) or not len(loose):
            raise NominalError(f"triangles must have shape (n, 3, 3), got {loose.shape}")
        if not (np.abs(loose) <= KILOMETRE_MM).all():
            raise NominalError("a corner of a triangle is not finite, or farther than a kilometre from zero")
        if not 0 <= nominal_error_mm < np.inf:
            raise NominalError(f"the error of the nominal must be a finite number, zero or more, got {nominal_error_mm:g} mm")
        welded = weld(loose)
        self._corners_mm = welded.corners_mm
        self.is_closed = not welded.is_open.any()
        self.nominal_error_mm = float(nominal_error_mm)
        self.notes = welded.notes
        self.sides_known = True
        self.size_mm = float(np.ptp(welded.corners_mm, axis=0).max())
        given = welded.given
        self._face = (given if face is None else np.asarray(face)[given]).astype(np.int32)
        self._tables, area = _tables_of(welded, self.size_mm)
        self.area_mm2 = float(area.sum())

    def __len__(self) -> int:
        return len(self._face)

    def project(self, points_mm: ArrayLike, threads: int | None = None) -> SurfaceFeet:
        """Closest points of the surface to points (m, 3); see `NominalSurface`. The number of threads changes no bit."""
        return surface_feet(project_on_triangles(points_in_space(points_mm), self._tables, threads), self.nominal_error_mm, self._face)

    def sample(self, count: int) -> tuple[Array, Array]:
        """At least `count` places (n, 3) spread over the area, and the normals (n, 3) there: each triangle is cut into like ones."""
        corners = self._corners_mm[self._tables.triangles.reshape(-1, 3)]
        a, e, g = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        owner = shares_of(np.linalg.norm(np.cross(e, g), axis=1), count)
        first, second = spread_within(owner)
        root = np.sqrt(first)
        places = a[owner] + (root * (1 - second))[:, None] * e[owner] + (root * second)[:, None] * g[owner]
        return places, self._tables.normals.reshape(-1, 3)[owner]


def _tables_of(welded: WeldedTriangles, size_mm: float) -> tuple[TriangleTables, Array]:
    """The tables for the loops, and the area (n,) of each triangle."""
    corners = welded.corners_mm[welded.triangles]
    a, e, g = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    cross = np.cross(e, g)
    twice = np.linalg.norm(cross, axis=1)
    normals = cross / twice[:, None]
    tree = item_tree(corners.mean(axis=1) + _APART * size_mm * normals, corners.min(axis=1), corners.max(axis=1), WAYS)
    rows = np.empty((len(a), CLUSTER_ROWS))
    rows[:, CORNER_A:EDGE_AB], rows[:, EDGE_AB:EDGE_AC], rows[:, EDGE_AC:PER_AB] = a, e, g
    for column, vector in ((PER_AB, e), (PER_AC, g), (PER_BC, g - e)):
        rows[:, column] = 1 / (vector**2).sum(axis=1)
    rows[:, PER_NORMAL] = 1 / (cross**2).sum(axis=1)
    clusters = np.where((tree.members >= 0)[:, :, None], rows[tree.members], np.nan).transpose(0, 2, 1)
    tables = TriangleTables(
        nodes=tree.nodes,
        links=tree.links,
        clusters=np.ascontiguousarray(clusters).ravel(),
        members=tree.members.ravel().astype(np.int32),
        triangles=welded.triangles.ravel().astype(np.int32),
        beyond=welded.beyond.ravel().astype(np.int32),
        normals=np.ascontiguousarray(normals).ravel(),
        corner_normals=_corner_normals(welded, corners, normals).ravel(),
        corner_is_open=welded.is_open.astype(np.uint8),
        grain_mm=_GRAIN * float(np.abs(welded.corners_mm).max()),
    )
    return tables, twice / 2


def _corner_normals(welded: WeldedTriangles, corners: Array, normals: Array) -> Array:
    """Pseudonormals (v, 3): the normals of the triangles around each corner, weighted by their angles there."""
    sums = np.zeros((len(welded.corners_mm), 3))
    for i in range(3):
        one, other = corners[:, (i + 1) % 3] - corners[:, i], corners[:, (i + 2) % 3] - corners[:, i]
        angle = np.arctan2(np.linalg.norm(np.cross(one, other), axis=1), (one * other).sum(axis=1))
        for axis in range(3):
            sums[:, axis] += np.bincount(welded.triangles[:, i], angle * normals[:, axis], len(sums))
    length = np.linalg.norm(sums, axis=1)
    return np.asarray(sums / np.where(length > 0, length, 1.0)[:, None])
