"""For every cell of space near spline faces the piece from which Newton's method finds the closest point of all of them, if it is certain.

A cell of centre c and radius r (half its diagonal) is certified where all of this holds, with bounds over whole pieces:

1 Pieces are kept that may hold the closest point of a place of the cell: their boxes are no farther from c than a point of the surface
  plus 2 r; and on those that touch no border the gradient of the distance may vanish.
2 The pieces kept, and those around the one that the cell names, lie in a rectangle of one net, within which the face is smooth.
3 On every piece of the rectangle the square of the distance is strictly convex for every place of the cell. It is so on the rectangle
  then, for the net is smooth: where its gradient vanishes in there, that is the closest point of the surface.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from inspection.kernels.compiling import (
    array_at,
    inlined_uncounted_kernel,
    kernel,
    stack_integers,
    stack_reals,
    uncounted_kernel,
)
from inspection.kernels.surfaces.layout import (
    CERTAIN,
    COEFFICIENTS,
    FAR,
    GRID_BLOCK_MM,
    GRID_LOW,
    GUESSED,
    HALF,
    INNER,
    LINKS,
    LISTED,
    NAMED,
    PIECE_STRIDE,
    SCRATCH,
    STACK,
)
from inspection.kernels.surfaces.on_patches import PatchTables, is_inner, square_from_box
from inspection.kernels.surfaces.patch_walk import walk_to_foot
from inspection.kernels.surfaces.piece_minimum import bent_at, may_have_foot, square_at
from inspection.kernels.surfaces.space_feet import next_leaf

Index = NDArray[np.int32]

_MOST_OF_BLOCK = 2048  # pieces that may be closest somewhere in a block; where there are more, the tree is searched
_MOST_OF_SHEET = 100  # pieces of a rectangle that is looked at
_ROOM = 1.0 + 1e-9  # for round-off
_ROOT_3 = 1.7320508075688774
_CONVEX, _DETERMINANT = 0.1, 0.9  # what curvature must leave over of the metric
_WALK = 6  # pieces that the foot of the centre of a cell is looked for from the nearest middle
_ROOT_ALONE: Any = np.int64(1)  # not a literal, which has a type of its own
_PARTS = 8
_CENTRE, _ROW = 3, 3  # of a cell that is being cut: its centre; where its parts begin, the part that is next, how many pieces it has
_BEGIN, _NEXT, _COUNT = range(3)


class PatchNets(NamedTuple):
    """Where pieces (p,) lie: the number of their net, and the column and the line of pieces on their face."""

    net: Index
    column: Index
    line: Index


@kernel
def fill_patch_cells(tables: PatchTables, nets: PatchNets, near: Any, reach_mm: float, deepest: int, cells: Any, used: Any) -> None:
    """Fill in the cells of all blocks within reach of the surface. What does not fit any more, or is not certified, is left FAR.

    near    : (blocks,) whether a block may be within reach
    deepest : how often a block is halved at most
    cells   : (k,) what blocks and their parts hold, the blocks first, which are all FAR
    used    : (1,) how many of them are used
    """
    blocks, grid = tables.blocks, tables.grid
    waiting, squares = array_at(stack_integers(), STACK), array_at(stack_reals(), SCRATCH)
    kept = np.empty((deepest + 2) * _MOST_OF_BLOCK, dtype=np.int64)
    centre, row = np.empty((deepest + 1, _CENTRE)), np.empty((deepest + 1, _ROW), dtype=np.int64)
    half = 0.5 * grid[GRID_BLOCK_MM]
    for block in range(len(near)):
        if not near[block]:
            continue
        i, j, k = block // (blocks[1] * blocks[2]), block // blocks[2] % blocks[1], block % blocks[2]
        x, y, z = grid[GRID_LOW] + (2 * i + 1) * half, grid[GRID_LOW + 1] + (2 * j + 1) * half, grid[GRID_LOW + 2] + (2 * k + 1) * half
        count = _gather(tables, x, y, z, 2.0 * _ROOT_3 * half, waiting, squares, kept)
        if not count:
            continue
        depth = _enter(tables, nets, x, y, z, half, reach_mm, block, 0, count, 0, deepest, kept, centre, row, cells, used)
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
            cell, given = row[depth, _BEGIN] + part, (depth + 1) * _MOST_OF_BLOCK
            depth = _enter(
                tables, nets, x, y, z, here, reach_mm, cell, given, row[depth, _COUNT], depth + 1, deepest, kept, centre, row, cells, used
            )


@uncounted_kernel
def _gather(tables: Any, x: float, y: float, z: float, across: float, waiting: Any, squares: Any, kept: Any) -> int:
    """Enter the pieces whose boxes are no farther than the nearest middle of a piece and `across`; 0 where there are too many."""
    rows, row_width = tables.rows, tables.row_width
    waiting[0], squares[0] = 0, 0.0
    depth, least = _ROOT_ALONE, np.inf
    while True:
        leaf, depth = next_leaf(tables.nodes, tables.links, x, y, z, least, depth, waiting, squares)
        if leaf < 0:
            break
        least = min(least, _square_from_middle(rows, np.int64(tables.members[leaf]) * row_width, tables.width, x, y, z))
    within = (np.sqrt(least) + across) * _ROOM
    waiting[0], squares[0] = 0, 0.0
    depth, count = _ROOT_ALONE, 0
    while True:
        leaf, depth = next_leaf(tables.nodes, tables.links, x, y, z, within * within, depth, waiting, squares)
        if leaf < 0:
            return count
        if count == _MOST_OF_BLOCK:
            return 0
        kept[count] = tables.members[leaf]
        count += 1


@inlined_uncounted_kernel
def _square_from_middle(rows: Any, row: int, width: int, x: float, y: float, z: float) -> float:
    """Square of the distance from the middle of a piece."""
    first, size = row + COEFFICIENTS, width * width
    dx, dy, dz = x - rows[first], y - rows[first + size], z - rows[first + 2 * size]
    return float(dx * dx + dy * dy + dz * dz)


@uncounted_kernel
def _enter(
    tables: Any,
    nets: Any,
    x: float,
    y: float,
    z: float,
    half: float,
    reach_mm: float,
    cell: int,
    given: int,
    count: int,
    depth: int,
    deepest: int,
    kept: Any,
    centre: Any,
    row: Any,
    cells: Any,
    used: Any,
) -> int:
    """Fill in one cell, or cut it; returns the depth of what is being cut then: its own, or one less.

    given, count : where in `kept` the pieces begin that may hold its closest points, and how many there are; its own ones go behind
    """
    radius = _ROOT_3 * half * _ROOM
    own = (depth + 1) * _MOST_OF_BLOCK
    start, distance = _foot_of_centre(tables, kept, given, count, x, y, z)
    if distance > reach_mm + radius:
        return depth - 1
    found = _keep(tables, kept, given, count, own, x, y, z, radius, (distance + 2.0 * radius) * _ROOM)
    if _is_certified(tables, nets, kept, own, found, start, x, y, z, radius):
        cells[cell] = LISTED - (NAMED * start + CERTAIN)
        return depth - 1
    if depth == deepest or used[0] + _PARTS > len(cells):
        cells[cell] = LISTED - (NAMED * start + GUESSED)
        return depth - 1
    cells[cell] = used[0]
    for part in range(_PARTS):
        cells[used[0] + part] = FAR
    centre[depth, 0], centre[depth, 1], centre[depth, 2] = x, y, z
    row[depth, _BEGIN], row[depth, _NEXT], row[depth, _COUNT] = used[0], 0, found
    used[0] += _PARTS
    return depth


@uncounted_kernel
def _foot_of_centre(tables: Any, kept: Any, given: int, count: int, x: float, y: float, z: float) -> tuple[int, float]:
    """A piece that probably holds the closest point of a place, and the distance from a point of the surface, probably that one."""
    rows, row_width, width = tables.rows, tables.row_width, tables.width
    least, nearest = np.inf, kept[given]
    for q in range(count):
        square = _square_from_middle(rows, kept[given + q] * row_width, width, x, y, z)
        if square < least:
            least, nearest = square, kept[given + q]
    _, piece, s, t, _, _, _ = walk_to_foot(rows, tables.beyond, width, row_width, nearest, x, y, z, _WALK)
    square = square_at(rows, piece * row_width, width, x, y, z, s, t)[0]
    return (piece, np.sqrt(square)) if square < least else (nearest, np.sqrt(least))


@uncounted_kernel
def _keep(tables: Any, kept: Any, given: int, count: int, own: int, x: float, y: float, z: float, radius: float, within: float) -> int:
    """Keep those of given pieces that may hold the closest point of a place within a radius; returns how many."""
    rows, beyond, found = tables.rows, tables.beyond, 0
    for q in range(count):
        piece = kept[given + q]
        row = piece * tables.row_width
        if square_from_box(rows, row, x, y, z) > within * within:
            continue
        if is_inner(beyond, piece) and not may_have_foot(rows, row, tables.width, x, y, z, radius, tables.grain_mm):
            continue
        kept[own + found] = piece
        found += 1
    return found


@uncounted_kernel
def _is_certified(tables: Any, nets: Any, kept: Any, own: int, count: int, start: int, x: float, y: float, z: float, radius: float) -> bool:
    """Whether the pieces kept lie in one smooth rectangle, on which the square of the distance is convex for the whole cell."""
    net, column, line, beyond = nets.net, nets.column, nets.line, tables.beyond
    at = LINKS * start
    low_i, high_i = column[start] - (beyond[at] == INNER), column[start] + (beyond[at + 1] == INNER)
    low_j, high_j = line[start] - (beyond[at + 2] == INNER), line[start] + (beyond[at + 3] == INNER)
    for q in range(count):
        piece = kept[own + q]
        if net[piece] != net[start]:
            return False
        low_i, high_i = min(low_i, column[piece]), max(high_i, column[piece])
        low_j, high_j = min(low_j, line[piece]), max(high_j, line[piece])
    if (high_i - low_i + 1) * (high_j - low_j + 1) > _MOST_OF_SHEET:
        return False
    stride = np.int64(tables.rows[start * tables.row_width + PIECE_STRIDE])
    for j in range(low_j, high_j + 1):
        for i in range(low_i, high_i + 1):
            piece = start + (i - column[start]) + (j - line[start]) * stride
            if not _is_convex(tables.rows, piece * tables.row_width, tables.width, x, y, z, radius):
                return False
    return True


@uncounted_kernel
def _is_convex(rows: Any, row: int, width: int, x: float, y: float, z: float, radius: float) -> bool:
    """Whether the square of the distance is convex on a piece for every place within a radius."""
    _, _, _, _, _, _, low_a, high_b, low_c, e, k = bent_at(rows, row, width, x, y, z, 0.0, 0.0, HALF, HALF, radius)
    return bool(low_a > _CONVEX * e and low_c > _CONVEX * k and _DETERMINANT * low_a * low_c > high_b * high_b)
