"""Loose triangles to a surface: corners that are one become one, faces turn their outsides to the same side, and its borders are known."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from inspection.errors import NominalError
from inspection.surface.orientation import which_to_turn

Array = NDArray[np.float64]
Index = NDArray[np.int64]

WELD = 1e-6  # of the size: corners on borders that are nearer to each other are one
_FLAT = 1e-12  # of the square of its longest edge: a triangle with less area has no normal
NOTHING = -1


@dataclass(frozen=True, slots=True, eq=False)
class WeldedTriangles:
    """Triangles that share their corners, all of one orientation.

    corners_mm : (v, 3)
    triangles  : (n, 3) numbers of corners, anticlockwise as seen from out of material
    beyond     : (n, 3) the triangle beyond the edges AB, AC and BC; NOTHING where there is none, or more than one
    given      : (n,) the number of each triangle among those that were given
    is_open    : (v,) whether a border runs through the corner
    notes      : what was done to the triangles, and what is odd about them, in sentences
    """

    corners_mm: Array
    triangles: Index
    beyond: Index
    given: Index
    is_open: NDArray[np.bool_]
    notes: tuple[str, ...]


def weld(loose_mm: Array) -> WeldedTriangles:
    """Weld loose triangles (n, 3, 3). Raises NominalError where no triangle has an area, or the surface has no two sides."""
    corners, numbers = _unique_rows(loose_mm.reshape(-1, 3))
    triangles, given = numbers.reshape(-1, 3), np.arange(len(loose_mm))
    notes: list[str] = []
    triangles, given = _without_area(corners, triangles, given, notes)
    triangles = _weld_borders(corners, triangles, notes)
    triangles, given = _without_area(corners, triangles, given, notes)
    triangles = _orient(corners, triangles, notes)
    edges = _edges(triangles)
    open_edges, crowded = edges.faces == 1, edges.faces > 2
    if crowded.any():
        x, y, z = corners[edges.ends[crowded][0]].mean(axis=0)
        notes.append(
            f"{np.count_nonzero(crowded)} edges belong to more than two triangles, the first near ({x:.6g}, {y:.6g}, {z:.6g}) mm: "
            "points beside them are taken for points beyond an edge"
        )
    is_open = np.zeros(len(corners), dtype=bool)
    is_open[edges.ends[open_edges | crowded]] = True
    used, again = np.unique(triangles, return_inverse=True)
    return WeldedTriangles(corners[used], again.reshape(-1, 3), _beyond(edges, len(triangles)), given, is_open[used], tuple(notes))


@dataclass(frozen=True, slots=True, eq=False)
class _Edges:
    """The edges of triangles.

    ends    : (e, 2) numbers of the corners, the lesser first
    faces   : (e,) how many triangles have it
    of      : (n * 3,) the edge of each side AB, AC, BC of each triangle
    forward : (n * 3,) whether the triangle, anticlockwise, runs from the lesser corner to the greater
    """

    ends: Index
    faces: Index
    of: Index
    forward: NDArray[np.bool_]


def _edges(triangles: Index) -> _Edges:
    a, b, c = triangles.T
    sides = np.stack([np.column_stack([a, b]), np.column_stack([c, a]), np.column_stack([b, c])], axis=1).reshape(-1, 2)
    low, high = sides.min(axis=1), sides.max(axis=1)
    many = int(triangles.max()) + 1
    keys, of, faces = np.unique(low * many + high, return_inverse=True, return_counts=True)
    return _Edges(np.column_stack([keys // many, keys % many]), faces, of.ravel(), sides[:, 0] < sides[:, 1])


def _unique_rows(points: Array) -> tuple[Array, Index]:
    """The points (k, 3) that differ, and the number of each one (m,)."""
    plain = np.ascontiguousarray(points + 0.0)  # one zero of the two
    order = np.lexsort(plain.T)
    is_new = np.ones(len(order), dtype=bool)
    is_new[1:] = (plain[order[1:]] != plain[order[:-1]]).any(axis=1)
    number = np.empty(len(order), dtype=np.int64)
    number[order] = np.cumsum(is_new) - 1
    return plain[order[is_new]], number


def have_area(triangles: Array) -> NDArray[np.bool_]:
    """Whether triangles (n, 3, 3) have an area, and so a normal."""
    a, b, c = (triangles[:, i] for i in range(3))
    twice = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    longest = np.max([((p - q) ** 2).sum(axis=1) for p, q in ((a, b), (b, c), (c, a))], axis=0)
    return np.asarray(twice > _FLAT * longest)


def _without_area(corners: Array, triangles: Index, given: Index, notes: list[str]) -> tuple[Index, Index]:
    good = have_area(corners[triangles])
    if not good.any():
        raise NominalError("the surface has no triangle with an area: export it again")
    if not good.all():
        notes.append(f"{np.count_nonzero(~good)} triangles without area were left out")
    return triangles[good], given[good]


def _weld_borders(corners: Array, triangles: Index, notes: list[str]) -> Index:
    """Make one of corners on borders that lie nearer to each other than `WELD` of the size."""
    edges = _edges(triangles)
    border = np.unique(edges.ends[edges.faces == 1])
    if not len(border):
        return triangles
    near = float(np.ptp(corners, axis=0).max()) * WELD
    pairs = cKDTree(corners[border]).query_pairs(near, output_type="ndarray")
    if not len(pairs):
        return triangles
    links = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(border), len(border)))
    _, label = connected_components(links, directed=False)
    _, leader = np.unique(label, return_index=True)
    target = np.arange(len(corners))
    target[border] = border[leader[label]]
    notes.append(f"{len(border) - len(leader)} corners on borders, less than {near:.2g} mm from another one, were made one with it")
    return target[triangles]


def _orient(corners: Array, triangles: Index, notes: list[str]) -> Index:
    """Turn triangles so that neighbours have their outsides on the same side, and a closed surface has them outside."""
    edges = _edges(triangles)
    side_order = np.argsort(edges.of, kind="stable")
    first = np.cumsum(edges.faces) - edges.faces
    pair = edges.faces == 2
    one, other = side_order[first[pair]], side_order[first[pair] + 1]
    agrees = edges.forward[one] != edges.forward[other]
    turned, hopeless = which_to_turn(_areas(corners, triangles), one // 3, other // 3, agrees)
    if len(hopeless):
        x, y, z = corners[triangles[hopeless[0]]].mean(axis=0)
        raise NominalError(
            f"the surface has no two sides: its triangles cannot be turned to agree near ({x:.6g}, {y:.6g}, {z:.6g}) mm; mend the mesh"
        )
    if turned.any():
        triangles = np.where(turned[:, None], triangles[:, ::-1], triangles)
        notes.append(f"{np.count_nonzero(turned)} triangles were turned over, so that they agree with their neighbours")
    if (edges.faces == 2).all() and _volume(corners, triangles) < 0:
        triangles = triangles[:, ::-1]
        notes.append("the surface is closed and its triangles faced inwards: all were turned over")
    return np.ascontiguousarray(triangles)


def _areas(corners: Array, triangles: Index) -> Array:
    a, b, c = (corners[triangles[:, i]] for i in range(3))
    return np.asarray(np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2)


def _volume(corners: Array, triangles: Index) -> float:
    middle = corners.mean(axis=0)
    a, b, c = (corners[triangles[:, i]] - middle for i in range(3))
    return float((a * np.cross(b, c)).sum() / 6)


def _beyond(edges: _Edges, count: int) -> Index:
    """The triangle beyond each side (n, 3)."""
    order = np.argsort(edges.of, kind="stable")
    first = (np.cumsum(edges.faces) - edges.faces)[edges.faces == 2]
    beyond = np.full(3 * count, NOTHING)
    beyond[order[first]], beyond[order[first + 1]] = order[first + 1] // 3, order[first] // 3
    return beyond.reshape(-1, 3)
