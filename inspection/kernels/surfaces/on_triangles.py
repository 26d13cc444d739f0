"""The closest point of a surface of triangles, and the side by the pseudonormal of what it lies on.

A cluster of eight triangles is tried at once, without branches. The one that wins is worked out again with the foot, by the same
operations. The pseudonormal is that of Baerentzen and Aanaes, "Signed distance computation using the angle weighted pseudonormal" (2005).
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from inspection.kernels.compiling import array_at, claim_chunk, inlined_kernel, kernel, stack_integers, stack_reals
from inspection.kernels.layout import CHUNK
from inspection.kernels.surfaces.layout import (
    CLUSTER,
    CORNER_1,
    CORNER_2,
    CORNER_3,
    CORNER_A,
    EDGE_1,
    EDGE_2,
    EDGE_3,
    EDGE_AB,
    EDGE_AC,
    IN_TRIANGLE,
    NOTHING,
    ON_BORDER,
    ON_CORNER,
    ON_EDGE,
    ON_FACE,
    PER_AB,
    PER_AC,
    PER_BC,
    PER_NORMAL,
    SCRATCH,
    SQUARES_OF_EIGHT,
    STACK,
    WAYS,
)
from inspection.kernels.surfaces.space_feet import (
    AT_ONCE,
    SpaceFeet,
    next_leaf,
    project_in_chunks,
    square_from_last,
    store_no_foot,
)

Array = NDArray[np.float64]
Index = NDArray[np.int32]

_NONE_YET: Any = np.int64(-1)  # not literals, which have types of their own
_ROOT_ALONE: Any = np.int64(1)


class TriangleTables(NamedTuple):
    """A surface of triangles as the loops take it.

    nodes, links   : the search tree, see `item_tree`; its leaves are the clusters
    clusters       : (c * CLUSTER,) eight triangles each, in columns
    members        : (8 c,) their numbers; NOTHING where a cluster is not full
    triangles      : (3 n,) the corners of each triangle by number
    beyond         : (3 n,) the triangle beyond each of the edges AB, AC, BC; NOTHING at a border
    normals        : (3 n,) the unit normal of each triangle
    corner_normals : (3 v,) the angle-weighted pseudonormal of each corner
    corner_is_open : (v,) whether a border runs through it
    grain_mm       : a distance from an edge or a corner below which it is round-off
    """

    nodes: Array
    links: Index
    clusters: Array
    members: Index
    triangles: Index
    beyond: Index
    normals: Array
    corner_normals: Array
    corner_is_open: NDArray[np.uint8]
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
    nodes, links, clusters, members, foot_mm = tables.nodes, tables.links, tables.clusters, tables.members, feet.foot_mm
    sides = (tables.triangles, tables.beyond, tables.normals, tables.corner_normals, tables.corner_is_open, tables.grain_mm)
    results = (feet.foot_mm, feet.distance_mm, feet.normal, feet.item, feet.parameter, feet.kind)
    begin = claim_chunk(claimed) // CHUNK * AT_ONCE
    while begin < m:
        for i in range(begin, min(begin + AT_ONCE, m)):
            x, y, z = points[3 * i], points[3 * i + 1], points[3 * i + 2]
            if not (np.isfinite(x) and np.isfinite(y) and np.isfinite(z)):
                store_no_foot(feet, i)
                continue
            least, best, at = square_from_last(foot_mm, i, begin, x, y, z), _NONE_YET, _NONE_YET
            waiting[0], squares[0] = 0, 0.0
            depth = _ROOT_ALONE
            while True:
                leaf, depth = next_leaf(nodes, links, x, y, z, least, depth, waiting, squares)
                if leaf < 0:
                    break
                _squares_of_cluster(clusters, leaf * CLUSTER, x, y, z, squares)
                for j in range(WAYS):
                    square, member = squares[SQUARES_OF_EIGHT + j], members[leaf * WAYS + j]
                    if square < least or (square == least and member < best):
                        least, best, at = square, np.int64(member), np.int64(leaf * CLUSTER + j)
            _store_foot(x, y, z, clusters, sides, best, at, results, i)
        begin = claim_chunk(claimed) // CHUNK * AT_ONCE


@inlined_kernel
def _dot(ax: float, ay: float, az: float, bx: float, by: float, bz: float) -> float:
    return ax * bx + ay * by + az * bz


@inlined_kernel
def _held(t: float) -> float:
    return min(max(t, 0.0), 1.0)


@inlined_kernel
def _square_off(wx: float, wy: float, wz: float, t: float, ex: float, ey: float, ez: float) -> float:
    """Square of w - t e."""
    dx, dy, dz = wx - t * ex, wy - t * ey, wz - t * ez
    return dx * dx + dy * dy + dz * dz


@inlined_kernel
def _squares_of_cluster(clusters: Any, row: int, x: float, y: float, z: float, squares: Any) -> None:
    """Square of the distance from each of the eight triangles of a cluster; NaN for one that is not there."""
    for j in range(WAYS):
        at = row + j
        wx = x - clusters[at + CORNER_A * WAYS]
        wy = y - clusters[at + (CORNER_A + 1) * WAYS]
        wz = z - clusters[at + (CORNER_A + 2) * WAYS]
        ex = clusters[at + EDGE_AB * WAYS]
        ey = clusters[at + (EDGE_AB + 1) * WAYS]
        ez = clusters[at + (EDGE_AB + 2) * WAYS]
        gx = clusters[at + EDGE_AC * WAYS]
        gy = clusters[at + (EDGE_AC + 1) * WAYS]
        gz = clusters[at + (EDGE_AC + 2) * WAYS]
        bx, by, bz = gx - ex, gy - ey, gz - ez
        ux, uy, uz = wx - ex, wy - ey, wz - ez
        first = _square_off(wx, wy, wz, _held(_dot(wx, wy, wz, ex, ey, ez) * clusters[at + PER_AB * WAYS]), ex, ey, ez)
        second = _square_off(wx, wy, wz, _held(_dot(wx, wy, wz, gx, gy, gz) * clusters[at + PER_AC * WAYS]), gx, gy, gz)
        third = _square_off(ux, uy, uz, _held(_dot(ux, uy, uz, bx, by, bz) * clusters[at + PER_BC * WAYS]), bx, by, bz)
        nx, ny, nz = ey * gz - ez * gy, ez * gx - ex * gz, ex * gy - ey * gx
        per = clusters[at + PER_NORMAL * WAYS]
        s = _dot(wy * gz - wz * gy, wz * gx - wx * gz, wx * gy - wy * gx, nx, ny, nz) * per
        t = _dot(ey * wz - ez * wy, ez * wx - ex * wz, ex * wy - ey * wx, nx, ny, nz) * per
        height = _dot(wx, wy, wz, nx, ny, nz)
        inside = (s > 0.0) & (t > 0.0) & (s + t < 1.0)
        square = min(first, second, third)
        squares[SQUARES_OF_EIGHT + j] = min(square, height * height * per) if inside else square


@inlined_kernel
def _store_foot(x: float, y: float, z: float, clusters: Any, sides: Any, triangle: int, at: int, results: Any, i: int) -> None:
    """Work out the foot on the triangle that won, what it lies on, and the side."""
    foot_mm, distance_mm, normal, item, parameter, kind = results
    normals = sides[2]
    ax, ay, az = clusters[at + CORNER_A * WAYS], clusters[at + (CORNER_A + 1) * WAYS], clusters[at + (CORNER_A + 2) * WAYS]
    ex, ey, ez = clusters[at + EDGE_AB * WAYS], clusters[at + (EDGE_AB + 1) * WAYS], clusters[at + (EDGE_AB + 2) * WAYS]
    gx, gy, gz = clusters[at + EDGE_AC * WAYS], clusters[at + (EDGE_AC + 1) * WAYS], clusters[at + (EDGE_AC + 2) * WAYS]
    wx, wy, wz = x - ax, y - ay, z - az
    bx, by, bz, ux, uy, uz = gx - ex, gy - ey, gz - ez, wx - ex, wy - ey, wz - ez
    nx, ny, nz = normals[3 * triangle], normals[3 * triangle + 1], normals[3 * triangle + 2]
    mx, my, mz = ey * gz - ez * gy, ez * gx - ex * gz, ex * gy - ey * gx
    per = clusters[at + PER_NORMAL * WAYS]
    s = _dot(wy * gz - wz * gy, wz * gx - wx * gz, wx * gy - wy * gx, mx, my, mz) * per
    t = _dot(ey * wz - ez * wy, ez * wx - ex * wz, ex * wy - ey * wx, mx, my, mz) * per
    first = _held(_dot(wx, wy, wz, ex, ey, ez) * clusters[at + PER_AB * WAYS])
    second = _held(_dot(wx, wy, wz, gx, gy, gz) * clusters[at + PER_AC * WAYS])
    third = _held(_dot(ux, uy, uz, bx, by, bz) * clusters[at + PER_BC * WAYS])
    place, square, p, q = IN_TRIANGLE, np.inf, s, t
    if not (s > 0.0 and t > 0.0 and s + t < 1.0):
        square = _square_off(wx, wy, wz, first, ex, ey, ez)
        place, p, q = CORNER_1 if first == 0.0 else CORNER_2 if first == 1.0 else EDGE_1, first, 0.0
        other = _square_off(wx, wy, wz, second, gx, gy, gz)
        if other < square:
            square, place, p, q = other, CORNER_1 if second == 0.0 else CORNER_3 if second == 1.0 else EDGE_2, 0.0, second
        other = _square_off(ux, uy, uz, third, bx, by, bz)
        if other < square:
            square, place, p, q = other, CORNER_2 if third == 0.0 else CORNER_3 if third == 1.0 else EDGE_3, 1.0 - third, third
    if place == IN_TRIANGLE:
        height = _dot(wx, wy, wz, nx, ny, nz)
        foot_mm[i, 0], foot_mm[i, 1], foot_mm[i, 2] = x - height * nx, y - height * ny, z - height * nz
        distance_mm[i], kind[i] = height, ON_FACE
        normal[i, 0], normal[i, 1], normal[i, 2] = nx, ny, nz
    else:
        dx, dy, dz = wx - p * ex - q * gx, wy - p * ey - q * gy, wz - p * ez - q * gz
        foot_mm[i, 0], foot_mm[i, 1], foot_mm[i, 2] = ax + p * ex + q * gx, ay + p * ey + q * gy, az + p * ez + q * gz
        _store_side(dx, dy, dz, sides, triangle, place, distance_mm, normal, kind, i)
    item[i] = triangle
    parameter[i, 0], parameter[i, 1] = p, q


@inlined_kernel
def _store_side(
    dx: float, dy: float, dz: float, sides: Any, triangle: int, place: int, distance_mm: Any, normal: Any, kinds: Any, i: int
) -> None:
    """Sign the distance from an edge or a corner by its pseudonormal; (dx, dy, dz) leads from the foot to the point."""
    triangles, beyond, normals, corner_normals, corner_is_open, grain_mm = sides
    if place <= EDGE_3:
        neighbour = beyond[3 * triangle + place - EDGE_1]
        nx, ny, nz = normals[3 * triangle], normals[3 * triangle + 1], normals[3 * triangle + 2]
        kind = ON_BORDER if neighbour == NOTHING else ON_EDGE
        if neighbour != NOTHING:
            nx, ny, nz = nx + normals[3 * neighbour], ny + normals[3 * neighbour + 1], nz + normals[3 * neighbour + 2]
    else:
        corner = triangles[3 * triangle + place - CORNER_1]
        kind = ON_BORDER if corner_is_open[corner] else ON_CORNER
        nx, ny, nz = corner_normals[3 * corner], corner_normals[3 * corner + 1], corner_normals[3 * corner + 2]
    distance = np.sqrt(dx * dx + dy * dy + dz * dz)
    sign = 1.0 if _dot(dx, dy, dz, nx, ny, nz) >= 0.0 else -1.0
    length = np.sqrt(nx * nx + ny * ny + nz * nz)
    if distance > grain_mm:
        nx, ny, nz, length = dx, dy, dz, sign * distance
    elif length == 0.0:  # two faces back to back
        nx, ny, nz = normals[3 * triangle], normals[3 * triangle + 1], normals[3 * triangle + 2]
        length = 1.0
    distance_mm[i], kinds[i] = sign * distance, kind
    normal[i, 0], normal[i, 1], normal[i, 2] = nx / length, ny / length, nz / length
