"""The closest point of a surface of triangles.

Where the cell of a place lists the clusters that may hold it, only those are looked at; elsewhere the tree over all clusters is
searched. Single precision says which triangles may be the closest, and those are worked out in double precision: both ways end with the
same one, the least in distance and then in number.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from inspection.kernels.compiling import (
    array_at,
    claim_chunk,
    inlined_uncounted_kernel,
    kernel,
    stack_integers,
    stack_reals,
    uncounted_kernel,
)
from inspection.kernels.layout import CHUNK
from inspection.kernels.surfaces.cell_grid import list_at
from inspection.kernels.surfaces.layout import FAR, IN_TRIANGLE, LANE_BITS, LANES, MOST_LISTED, ON_FACE, SCRATCH, STACK
from inspection.kernels.surfaces.space_feet import AT_ONCE, SpaceFeet, next_leaf, project_in_chunks, store_no_foot
from inspection.kernels.surfaces.triangle_bounds import NEVER, bound_of, enter_bounds, least_bound
from inspection.kernels.surfaces.triangle_feet import closest_on_triangle, foot_in_triangle, foot_on_edge

Array = NDArray[np.float64]
Index = NDArray[np.int32]

_NONE_YET: Any = np.int64(-1)  # not literals, which have types of their own
_ROOT_ALONE: Any = np.int64(1)
_BLOCK = 64  # points whose cells are looked up together


class TriangleTables(NamedTuple):
    """A surface of triangles as the loops take it.

    nodes, links   : the search tree, see `item_tree`; its leaves are the clusters
    planes         : (c * CLUSTER,) the planes of the triangles of each cluster, in single precision and in columns, see `layout`
    origins        : (c * ORIGIN_WIDTH,) what the planes are seen from
    corners        : (3 v,) the places of corners
    triangles      : (3 n,) the corners of each triangle by number; triangle i is lane i % LANES of cluster i // LANES
    beyond         : (3 n,) the triangle beyond each of the edges AB, AC, BC; NOTHING at a border
    corner_normals : (3 v,) the angle-weighted pseudonormal of each corner
    corner_is_open : (v,) whether a border runs through it
    grid           : (GRID_WIDTH,) where the blocks of cells lie
    blocks         : (3,) how many there are along x, y and z
    cells          : what each block, and each part of one that is cut, holds; see `layout`
    lists          : lists of clusters, each behind its length
    grain_mm       : a distance from an edge or a corner below which it is round-off
    """

    nodes: Array
    links: Index
    planes: NDArray[np.float32]
    origins: Array
    corners: Array
    triangles: Index
    beyond: Index
    corner_normals: Array
    corner_is_open: NDArray[np.uint8]
    grid: Array
    blocks: NDArray[np.int64]
    cells: Index
    lists: Index
    grain_mm: float


def project_on_triangles(points_mm: Array, tables: TriangleTables, threads: int | None = None) -> SpaceFeet:
    """Closest points of a surface to points (m, 3). Points that are not finite have no foot.

    threads : None chooses by the number of points; the result is the same.
    """
    return project_in_chunks(points_mm, lambda points, feet, claimed: _project_chunks(points, tables, feet, claimed), threads)


@kernel
def _project_chunks(points: Any, tables: Any, feet: Any, claimed: Any) -> None:
    m = len(feet.kind)
    waiting, squares = array_at(stack_integers(), STACK), array_at(stack_reals(), SCRATCH)
    bounds = array_at(stack_integers(), MOST_LISTED * LANES).view(np.int32)
    places, counts = array_at(stack_integers(), _BLOCK), array_at(stack_integers(), _BLOCK)
    planes, origins, corners, triangles = tables.planes, tables.origins, tables.corners, tables.triangles
    shape = (planes, origins, corners, triangles)
    tree = (tables.nodes, tables.links, waiting, squares)
    beyond, corner_normals, corner_is_open, grain_mm = tables.beyond, tables.corner_normals, tables.corner_is_open, tables.grain_mm
    foot_mm, distance_mm, normal, item, parameter, kind = feet
    grid, blocks, cells, lists = tables.grid, tables.blocks, tables.cells, tables.lists
    begin = claim_chunk(claimed) // CHUNK * AT_ONCE
    while begin < m:
        for block in range(begin, min(begin + AT_ONCE, m), _BLOCK):
            end = min(block + _BLOCK, m)
            for i in range(block, end):  # by itself, so that one point need not wait for the memory of another
                at = list_at(grid, blocks, cells, points[3 * i], points[3 * i + 1], points[3 * i + 2])
                places[i - block], counts[i - block] = at, 0 if at == FAR else np.int64(lists[at])
            for i in range(block, end):
                x, y, z = points[3 * i], points[3 * i + 1], points[3 * i + 2]
                at = places[i - block]
                if at != FAR:
                    clusters = counts[i - block]
                    triangle, _, place, p, q = closest_in_list(planes, origins, corners, triangles, lists, at, clusters, x, y, z, bounds)
                elif np.isfinite(x) and np.isfinite(y) and np.isfinite(z):
                    triangle, _, place, p, q = closest_in_tree(shape, tree, x, y, z, bounds)
                else:
                    store_no_foot(feet, i)
                    continue
                item[i], parameter[i, 0], parameter[i, 1] = triangle, p, q
                if place == IN_TRIANGLE:
                    fx, fy, fz, distance, nx, ny, nz = foot_in_triangle(corners, triangles, triangle, x, y, z)
                    what = ON_FACE
                else:
                    fx, fy, fz, distance, nx, ny, nz, what = foot_on_edge(
                        corners, triangles, beyond, corner_normals, corner_is_open, grain_mm, x, y, z, triangle, place, p, q
                    )
                foot_mm[i, 0], foot_mm[i, 1], foot_mm[i, 2], distance_mm[i], kind[i] = fx, fy, fz, distance, what
                normal[i, 0], normal[i, 1], normal[i, 2] = nx, ny, nz
        begin = claim_chunk(claimed) // CHUNK * AT_ONCE


@inlined_uncounted_kernel
def closest_in_list(
    planes: Any, origins: Any, corners: Any, triangles: Any, lists: Any, at: Any, clusters: Any, x: float, y: float, z: float, bounds: Any
) -> tuple[Any, ...]:
    """The closest triangle of the clusters of a list, square of its distance, and what `closest_on_triangle` says of it.

    The tables come one by one: taken out of a tuple they would be counted at every point.

    at, clusters : where the list begins, and how many clusters it has
    bounds       : (MOST_LISTED * LANES,) memory
    """
    for k in range(clusters):
        enter_bounds(planes, origins, np.int64(lists[at + 1 + k]), x, y, z, bounds, k * LANES)
    count = clusters * LANES
    best, square, place, p, q = _NONE_YET, np.inf, _NONE_YET, 0.0, 0.0
    nearest = least_bound(bounds, count)
    while nearest <= bound_of(square):
        lane = np.int64(nearest & LANE_BITS)
        bounds[lane] = NEVER
        other = np.int64(lists[at + 1 + lane // LANES]) * LANES + lane % LANES
        its_square, its_place, its_p, its_q = closest_on_triangle(corners, triangles, other, x, y, z)
        if its_square < square or (its_square == square and other < best):
            best, square, place, p, q = other, its_square, np.int64(its_place), its_p, its_q
        nearest = least_bound(bounds, count)
    return best, square, place, p, q


@uncounted_kernel
def closest_in_tree(shape: Any, tree: Any, x: float, y: float, z: float, bounds: Any) -> tuple[Any, ...]:
    """The same of all clusters.

    shape : planes, origins, corners and triangles of the tables
    tree  : nodes and links of the tables, and memory for what waits and its squares, see `next_leaf`
    """
    planes, origins, corners, triangles = shape
    nodes, links, waiting, squares = tree
    best, square, place, p, q = _NONE_YET, np.inf, _NONE_YET, 0.0, 0.0
    waiting[0], squares[0] = 0, 0.0
    depth = _ROOT_ALONE
    while True:
        leaf, depth = next_leaf(nodes, links, x, y, z, square, depth, waiting, squares)
        if leaf < 0:
            return best, square, place, p, q
        enter_bounds(planes, origins, leaf, x, y, z, bounds, 0)
        for lane in range(LANES):
            if bounds[lane] > bound_of(square):
                continue
            other = leaf * LANES + lane
            its_square, its_place, its_p, its_q = closest_on_triangle(corners, triangles, other, x, y, z)
            if its_square < square or (its_square == square and other < best):
                best, square, place, p, q = other, its_square, np.int64(its_place), its_p, its_q
