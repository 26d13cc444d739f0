"""A nominal surface of triangles, exact as it is given: closest points with the right sign."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inspection.errors import NominalError
from inspection.kernels.surfaces import TriangleTables, project_on_triangles
from inspection.kernels.surfaces.layout import GRID_WIDTH, LANES, NOTHING
from inspection.surface.clusters import cluster_hulls, cluster_planes
from inspection.surface.feet import KILOMETRE_MM, SurfaceFeet, points_in_space, surface_feet
from inspection.surface.item_tree import ItemTree, item_tree
from inspection.surface.spread import shares_of, spread_within
from inspection.surface.triangle_cells import with_cells
from inspection.surface.welding import WeldedTriangles, weld

Array = NDArray[np.float64]
Index = NDArray[np.int64]

_APART = 0.01  # of the size: how far along its normal a triangle is moved before near ones are gathered, so that thin walls come apart
_SLENDER, _GOLDEN = 0.2, 0.6180339887498949  # of the square of its longest side: twice the area of a slender triangle
_GRAIN = 1e-14  # of the farthest coordinate: a distance that is round-off


class TriangleSurface:
    """A surface of triangles; `project` gives their exact closest points. It satisfies `NominalSurface`.

    nominal_error_mm : bound of how far the triangles lie off the surface that they stand for, such as the chord tolerance of an export;
                       0 for triangles that are the nominal themselves
    is_closed        : whether it has no border
    face             : (n,) the face that each triangle belongs to; None for the number of the triangle itself

    Raises NominalError for triangles (n, 3, 3) of which no surface can be made.
    """

    __slots__ = ("_face", "_tables", "area_mm2", "is_closed", "nominal_error_mm", "notes", "sides_known", "size_mm")

    def __init__(self, triangles_mm: ArrayLike, nominal_error_mm: float = 0.0, face: ArrayLike | None = None) -> None:
        loose = np.asarray(triangles_mm, dtype=np.float64)
        if loose.ndim != 3 or loose.shape[1:] != (3, 3) or not len(loose):
            raise NominalError(f"triangles must have shape (n, 3, 3), got {loose.shape}")
        if not (np.abs(loose) <= KILOMETRE_MM).all():
            raise NominalError("a corner of a triangle is not finite, or farther than a kilometre from zero")
        if not 0 <= nominal_error_mm < np.inf:
            raise NominalError(f"the error of the nominal must be a finite number, zero or more, got {nominal_error_mm:g} mm")
        welded = weld(loose)
        self.is_closed = not welded.is_open.any()
        self.nominal_error_mm = float(nominal_error_mm)
        self.notes = welded.notes
        self.sides_known = True
        self.size_mm = float(np.ptp(welded.corners_mm, axis=0).max())
        corners = welded.corners_mm[welded.triangles]
        cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        twice = np.linalg.norm(cross, axis=1)
        normals = cross / twice[:, None]
        self.area_mm2 = float(twice.sum()) / 2
        places = corners.mean(axis=1) + _APART * self.size_mm * normals
        tree = item_tree(places, corners.min(axis=1), corners.max(axis=1), LANES)
        order = tree.members[tree.members >= 0]
        given = welded.given[order]
        self._face = (given if face is None else np.asarray(face)[given]).astype(np.int32)
        self._tables = _tables_of(welded, order, tree, normals, self.area_mm2, self.size_mm)

    def __len__(self) -> int:
        return len(self._face)

    def project(self, points_mm: ArrayLike, threads: int | None = None) -> SurfaceFeet:
        """Closest points of the surface to points (m, 3); see `NominalSurface`. The number of threads changes no bit."""
        return surface_feet(project_on_triangles(points_in_space(points_mm), self._tables, threads), self.nominal_error_mm, self._face)

    def sample(self, count: int) -> tuple[Array, Array]:
        """At least `count` places (n, 3) spread over the area, and the normals (n, 3) there: each triangle is cut into like ones."""
        numbers = self._tables.triangles.reshape(-1, 3)
        corners = self._tables.corners.reshape(-1, 3)[numbers]
        a, e, g = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        cross = np.cross(e, g)
        twice = np.linalg.norm(cross, axis=1)
        twice = np.linalg.norm(np.cross(e, g), axis=1)
        owner = shares_of(twice, count)
        first, second = spread_within(owner)
        longest = np.maximum((e**2).sum(axis=1), np.maximum((g**2).sum(axis=1), ((g - e) ** 2).sum(axis=1)))
        phase = np.where(twice < _SLENDER * longest, np.arange(len(twice)) * _GOLDEN % 1.0, 0.0)  # or a fan of slivers shows rings
        first = (first + phase[owner]) % 1.0
        root = np.sqrt(first)
        places = a[owner] + (root * (1 - second))[:, None] * e[owner] + (root * second)[:, None] * g[owner]
        return places, (cross / twice[:, None])[owner]


def _tables_of(welded: WeldedTriangles, order: Index, tree: ItemTree, normals: Array, area_mm2: float, size_mm: float) -> TriangleTables:
    """The tables for the loops, of triangles in the order of their clusters."""
    place = np.full(len(order) + 1, NOTHING, dtype=np.int32)  # the last one stands for no triangle
    place[order] = np.arange(len(order))
    triangles = welded.triangles[order].astype(np.int32)
    planes, origins = cluster_planes(welded.corners_mm[triangles])
    tables = TriangleTables(
        nodes=tree.nodes,
        links=tree.links,
        planes=planes,
        origins=origins,
        corners=np.ascontiguousarray(welded.corners_mm).ravel(),
        triangles=triangles.ravel(),
        beyond=place[welded.beyond[order]].ravel(),
        corner_normals=_corner_normals(welded, normals).ravel(),
        corner_is_open=welded.is_open.astype(np.uint8),
        grid=np.zeros(GRID_WIDTH),
        blocks=np.zeros(3, dtype=np.int64),
        cells=np.empty(0, dtype=np.int32),
        lists=np.empty(0, dtype=np.int32),
        grain_mm=_GRAIN * float(np.abs(welded.corners_mm).max()),
    )
    return with_cells(tables, cluster_hulls(welded.corners_mm, triangles, welded.is_open), area_mm2, size_mm)


def _corner_normals(welded: WeldedTriangles, normals: Array) -> Array:
    """Pseudonormals (v, 3): the normals of the triangles around each corner, weighted by their angles there."""
    sums = np.zeros((len(welded.corners_mm), 3))
    corners = welded.corners_mm[welded.triangles]
    for i in range(3):
        one, other = corners[:, (i + 1) % 3] - corners[:, i], corners[:, (i + 2) % 3] - corners[:, i]
        angle = np.arctan2(np.linalg.norm(np.cross(one, other), axis=1), (one * other).sum(axis=1))
        for axis in range(3):
            sums[:, axis] += np.bincount(welded.triangles[:, i], angle * normals[:, axis], len(sums))
    length = np.linalg.norm(sums, axis=1)
    return np.asarray(sums / np.where(length > 0, length, 1.0)[:, None])
