"""Which clusters of triangles may hold the closest point of a place, for every cell of space near a surface.

A cluster is kept for a cell of centre c and radius r (half its diagonal) where both hold, each with room for round-off:

1 its box is no farther from c than the closest point of c plus 2 r: for a place of the cell that point is no farther than d + r, and
  nothing of a box beyond that is nearer than d + r.
2 its cone reaches the cell. A closest point that is not on a border lies where the way to the place leans from the mean normal by no more
  than the most that a face around its corners does: of the faces about a corner, seen along the mean normal, one lies in the direction of
  the lean, and its plane must not come nearer. So the lean is at most the height times the tangent.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from inspection.kernels.compiling import (
    array_at,
    inlined_uncounted_kernel,
    inner_kernel,
    kernel,
    stack_integers,
    stack_reals,
    uncounted_kernel,
)
from inspection.kernels.surfaces.layout import (
    FAR,
    GRID_BLOCK_MM,
    GRID_LOW,
    HULL_AXES,
    HULL_HALF,
    HULL_MIDDLE,
    HULL_OWN_TANGENT,
    HULL_TANGENT,
    HULL_WIDTH,
    LANES,
    LISTED,
    MOST_LISTED,
    SCRATCH,
    STACK,
)
from inspection.kernels.surfaces.on_triangles import TriangleTables, closest_in_tree
from inspection.kernels.surfaces.space_feet import next_leaf
from inspection.kernels.surfaces.triangle_bounds import bound_of, enter_bounds, may_be_closest
from inspection.kernels.surfaces.triangle_feet import closest_on_triangle

_MOST_OF_BLOCK = 4096  # clusters that may be closest somewhere in a block; where there are more, the tree is searched
_ROOM = 1.0 + 1e-9  # for round-off
_ROOT_3 = 1.7320508075688774
_ROOT_ALONE: Any = np.int64(1)  # not a literal, which has a type of its own
_PARTS = 8
_CENTRE, _ROW = 3, 4  # of a cell that is being cut: its centre; where its parts begin, the part that is next, how many clusters it has
_BEGIN, _NEXT, _COUNT = range(3)


class CellMemory(NamedTuple):
    """What is filled in.

    cells : (k,) what blocks and their parts hold, the blocks first
    lists : (l,) lists of clusters, each behind its length
    used  : (3,) how much of both is used, and where the last list begins
    """

    cells: NDArray[np.int32]
    lists: NDArray[np.int32]
    used: NDArray[np.int64]


@kernel
def fill_cells(tables: TriangleTables, hulls: Any, near: Any, reach_mm: float, enough: int, deepest: int, memory: CellMemory) -> None:
    """Fill in the cells of all blocks within reach of the surface, and their lists. What does not fit any more is left FAR.

    tables   : the tables of a surface whose blocks are all FAR
    hulls    : (c * HULL_WIDTH,) the boxes and cones of the clusters
    near     : (blocks,) whether a block may be within reach
    reach_mm : how far from the surface cells are made
    enough   : clusters in a list that is not worth being cut
    deepest  : how often a block is halved at most
    """
    blocks, grid = tables.blocks, tables.grid
    waiting, squares = array_at(stack_integers(), STACK), array_at(stack_reals(), SCRATCH)
    bounds = array_at(stack_integers(), MOST_LISTED * LANES).view(np.int32)
    shape = (tables.planes, tables.origins, tables.corners, tables.triangles)
    tree = (tables.nodes, tables.links, waiting, squares)
    kept, off = np.empty((deepest + 1) * _MOST_OF_BLOCK, dtype=np.int64), np.empty(_MOST_OF_BLOCK)
    half = 0.5 * grid[GRID_BLOCK_MM]
    for block in range(len(near)):
        if not near[block]:
            continue
        i, j, k = block // (blocks[1] * blocks[2]), block // blocks[2] % blocks[1], block % blocks[2]
        x, y, z = grid[GRID_LOW] + (2 * i + 1) * half, grid[GRID_LOW + 1] + (2 * j + 1) * half, grid[GRID_LOW + 2] + (2 * k + 1) * half
        distance = np.sqrt(closest_in_tree(shape, tree, x, y, z, bounds)[1])
        if distance <= (reach_mm + _ROOT_3 * half) * _ROOM:
            count = _gather(tree, distance + 2.0 * _ROOT_3 * half, x, y, z, kept)
            if count:
                _cut(shape, hulls, x, y, z, half, reach_mm, enough, deepest, block, count, kept, off, bounds, memory)


@uncounted_kernel
def _gather(tree: Any, within: float, x: float, y: float, z: float, kept: Any) -> int:
    """Enter the clusters whose boxes in the tree lie within a distance; 0 where there are too many."""
    nodes, links, waiting, squares = tree
    waiting[0], squares[0] = 0, 0.0
    depth, count = _ROOT_ALONE, 0
    while True:
        leaf, depth = next_leaf(nodes, links, x, y, z, within * within * _ROOM, depth, waiting, squares)
        if leaf < 0:
            return count
        if count == _MOST_OF_BLOCK:
            return 0
        kept[count] = leaf
        count += 1


@inner_kernel
def _cut(
    shape: Any,
    hulls: Any,
    x: float,
    y: float,
    z: float,
    half: float,
    reach_mm: float,
    enough: int,
    deepest: int,
    block: int,
    count: int,
    kept: Any,
    off: Any,
    bounds: Any,
    memory: Any,
) -> None:
    """Cut a block, and enter the lists of its parts. `kept` holds the clusters of what is cut at each depth, one row after the other."""
    centre, row = np.empty((deepest + 1, _CENTRE)), np.empty((deepest + 1, _ROW), dtype=np.int64)
    cells, used = memory.cells, memory.used
    count, _ = _keep(shape, hulls, kept, 0, count, kept, 0, x, y, z, half, off, bounds)
    if not _is_cut(cells, used, block, count, enough, 0, deepest):
        _enter_list(memory, block, kept, 0, count)
        return
    centre[0, 0], centre[0, 1], centre[0, 2] = x, y, z
    row[0, _BEGIN], row[0, _NEXT], row[0, _COUNT] = cells[block], 0, count
    depth = 0
    while depth >= 0:
        part = row[depth, _NEXT]
        if part == _PARTS:
            depth -= 1
            continue
        row[depth, _NEXT] += 1
        here = half * 0.5 ** (depth + 1)
        x = centre[depth, 0] + (here if part & 4 else -here)
        y = centre[depth, 1] + (here if part & 2 else -here)
        z = centre[depth, 2] + (here if part & 1 else -here)
        first, cell = (depth + 1) * _MOST_OF_BLOCK, row[depth, _BEGIN] + part
        count, distance = _keep(shape, hulls, kept, depth * _MOST_OF_BLOCK, row[depth, _COUNT], kept, first, x, y, z, here, off, bounds)
        if distance > (reach_mm + _ROOT_3 * here) * _ROOM:
            continue
        if _is_cut(cells, used, cell, count, enough, depth + 1, deepest):
            depth += 1
            centre[depth, 0], centre[depth, 1], centre[depth, 2] = x, y, z
            row[depth, _BEGIN], row[depth, _NEXT], row[depth, _COUNT] = cells[cell], 0, count
        else:
            _enter_list(memory, cell, kept, first, count)


@inlined_uncounted_kernel
def _is_cut(cells: Any, used: Any, cell: int, count: int, enough: int, depth: int, deepest: int) -> bool:
    """Whether a cell is cut: its parts are FAR then, and it holds where they begin."""
    if count <= enough or depth == deepest or used[0] + _PARTS > len(cells):
        return False
    cells[cell] = used[0]
    for part in range(_PARTS):
        cells[used[0] + part] = FAR
    used[0] += _PARTS
    return True


@inlined_uncounted_kernel
def _enter_list(memory: Any, cell: int, kept: Any, first: int, count: int) -> None:
    """Enter the list of a cell, unless it is the one before: neighbours often have the same."""
    cells, lists, used = memory
    if count > MOST_LISTED:
        return
    at = used[2]
    is_new = lists[at] != count
    for q in range(count):
        if not is_new:
            is_new = lists[at + 1 + q] != kept[first + q]
    if is_new:
        at = used[1]
        if at + 1 + count > len(lists):
            return
        lists[at] = count
        for q in range(count):
            lists[at + 1 + q] = kept[first + q]
        used[1], used[2] = at + 1 + count, at
    cells[cell] = LISTED - at


@uncounted_kernel
def _keep(
    shape: Any,
    hulls: Any,
    given: Any,
    begin: int,
    count: int,
    kept: Any,
    first: int,
    x: float,
    y: float,
    z: float,
    half: float,
    off: Any,
    bounds: Any,
) -> tuple[int, float]:
    """Keep those of given clusters that may hold the closest point of a place in a cell. Returns how many, and how far its centre is."""
    radius = _ROOT_3 * half * _ROOM
    reached, nearest = 0, 0
    for q in range(count):
        cluster = given[begin + q]
        square, lateral, height = _from_hull(hulls, cluster * HULL_WIDTH, x, y, z)
        at = cluster * HULL_WIDTH
        if lateral > (radius + (height + hulls[at + HULL_HALF + 2] + radius) * hulls[at + HULL_TANGENT]) * _ROOM:
            continue
        kept[first + reached], off[reached] = cluster, square
        if square < off[nearest]:
            nearest = reached
        reached += 1
    least = np.inf
    if reached:
        least = _square_of_cluster(shape, kept[first + nearest], x, y, z, least, bounds)
    for q in range(reached):
        if off[q] < least and q != nearest:
            least = _square_of_cluster(shape, kept[first + q], x, y, z, least, bounds)
    distance, found = np.sqrt(least), 0
    within = (distance + 2.0 * radius) * _ROOM
    for q in range(reached):
        cluster = kept[first + q]
        if off[q] <= within * within and may_be_closest(
            shape[0], shape[1], cluster, x, y, z, radius, hulls[cluster * HULL_WIDTH + HULL_OWN_TANGENT], within
        ):
            kept[first + found] = cluster
            found += 1
    return found, distance


@inlined_uncounted_kernel
def _from_hull(hulls: Any, row: int, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Square of the distance from a box, how much of it lies across its normal, and the height over its middle."""
    x, y, z = x - hulls[row + HULL_MIDDLE], y - hulls[row + HULL_MIDDLE + 1], z - hulls[row + HULL_MIDDLE + 2]
    first = max(abs(_along(hulls, row + HULL_AXES, x, y, z)) - hulls[row + HULL_HALF], 0.0)
    second = max(abs(_along(hulls, row + HULL_AXES + 3, x, y, z)) - hulls[row + HULL_HALF + 1], 0.0)
    height = abs(_along(hulls, row + HULL_AXES + 6, x, y, z))
    third = max(height - hulls[row + HULL_HALF + 2], 0.0)
    across = first * first + second * second
    return across + third * third, np.sqrt(across), height


@inlined_uncounted_kernel
def _along(hulls: Any, at: int, x: float, y: float, z: float) -> float:
    return float(hulls[at] * x + hulls[at + 1] * y + hulls[at + 2] * z)


@uncounted_kernel
def _square_of_cluster(shape: Any, cluster: int, x: float, y: float, z: float, least: float, bounds: Any) -> float:
    """The lesser of a square and that of the distance from the triangles of a cluster."""
    planes, origins, corners, triangles = shape
    enter_bounds(planes, origins, cluster, x, y, z, bounds, 0)
    for lane in range(LANES):
        if bounds[lane] <= bound_of(least):
            least = min(least, closest_on_triangle(corners, triangles, cluster * LANES + lane, x, y, z)[0])
    return least
