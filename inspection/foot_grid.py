"""The map from any place to the piece of curve that is closest to it, worked out once for a nominal.

A quadtree over the places where measured points can lie is refined until every cell knows, with proof, the one stretch of
curve that can hold the closest point of all its points. Cells that the medial axis crosses know several stretches. Everything
is packed into two arrays, because a compiled call costs per array.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inspection.cache_lines import align
from inspection.curve import NurbsCurve
from inspection.curve_pieces import CurvePieces, cut_into_pieces, derivative_bounds, piece_tree
from inspection.kernels.layout import (
    BLOCK_DEPTH,
    BLOCK_LEVEL,
    BLOCKS_ACROSS,
    BLOCKS_PER_MM,
    FAR,
    FIRST_PARAMETER,
    GRAIN_MM,
    HEADER,
    INTEGERS_END,
    LAST_PARAMETER,
    LEAVES,
    LENGTH_MM,
    LINKS_AT,
    LIST_WIDTH,
    LISTED,
    OPEN_END,
    ORIGIN_X,
    ORIGIN_Y,
    PIECE_FIRST,
    PIECE_LAST,
    PIECES,
    PIECES_AT,
    REALS_END,
    VERTEX_KIND,
)

Array = NDArray[np.float64]
Index = NDArray[np.int64]

_DEEPEST = 11  # smallest cells: half a thousandth of the size of the curve
_NEAR = 0.015  # band in which cells may become that small, as a fraction of the size
_BAND = 0.08  # band of the whole grid: beyond it every point is searched for along the whole curve
_STEEPEST = 0.9  # a cell is certified where curvature x signed distance stays below this; at 1 lies the centre of curvature


@dataclass(frozen=True, slots=True, eq=False)
class FootGrid:
    """Packed tables of a curve for `kernels.project`.

    reals      : header, then the pieces, their bounds, the boxes of the search tree, the vertices; see `kernels.layout`
    integers   : header, then the links of the pieces, blocks, cells, lists
    pieces     : number of polynomial pieces
    cells      : number of cells of the grid
    band_mm    : half width of the band that the grid covers
    """

    reals: Array
    integers: NDArray[np.int32]
    pieces: int
    cells: int
    band_mm: float

    def __post_init__(self) -> None:
        self.reals.setflags(write=False)
        self.integers.setflags(write=False)


def build_foot_grid(curve: NurbsCurve) -> FootGrid:
    """Tables for the closest point of `curve` to any place. Raises NominalError when the curve cannot be cut into pieces."""
    pieces = cut_into_pieces(curve)
    ends = np.vstack([pieces.start_mm, pieces.start_mm + pieces.along_mm])
    low, high = ends.min(axis=0), ends.max(axis=0)
    size = float((high - low).max())
    root = size * (1 + 2 * _BAND) * 1.02
    origin = (low + high) / 2 - root / 2
    leaves = _refine_cells(pieces, origin, root, size)
    return _pack_grid(pieces, origin, root, size, leaves, (*curve.domain, curve.length_mm))


# --- the cells --------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, eq=False)
class _Leaves:
    """Finished cells.

    level, x, y : (c,) level of the quadtree, and the index of the cell there
    content     : (c,) a piece, FAR, or LISTED - (place of its list)
    lists       : (l,) the lists of pieces, one after the other
    """

    level: Index
    x: Index
    y: Index
    content: Index
    lists: Index


@dataclass(slots=True, eq=False)
class _Pairs:
    """Cells of one level, each paired with every piece that may hold the closest point of one of its points.

    x, y        : (c,) index of the cell
    first       : (c,) its first pair
    cell, piece : (k,) the pairs, sorted by cell, then by piece
    """

    x: Index
    y: Index
    first: Index
    cell: Index
    piece: Index


def _refine_cells(pieces: CurvePieces, origin: Array, root: float, size: float) -> _Leaves:
    """Split cells until each is certified, or as small as its distance from the curve allows."""
    level = 0
    count = len(pieces)
    pairs = _Pairs(np.zeros(1, np.int64), np.zeros(1, np.int64), np.zeros(1, np.int64), np.zeros(count, np.int64), np.arange(count))
    done: list[tuple[Index, ...]] = []
    lists: list[Index] = [np.zeros(0, np.int64)]
    while len(pairs.x):
        side = root / 2**level
        radius = side * np.sqrt(0.5) * (1 + 1e-9)
        centre = origin + (np.column_stack([pairs.x, pairs.y]) + 0.5) * side
        lowest = _keep_near(pairs, pieces, centre, radius)
        view = _keep_feet(pairs, pieces, centre, radius)
        far = lowest - radius > _BAND * size
        deepest = np.where(lowest - radius > _NEAR * size, _DEEPEST - 2, _DEEPEST)
        branches, certified, fits = _certify(pairs, pieces, centre, view, radius)
        single = (branches == 1) & certified & (fits | (level >= deepest - 1))
        last = level >= deepest
        ready = ~far & (level >= BLOCK_LEVEL) & (single | last)
        content = np.where(single, pairs.piece[view.nearest], FAR)
        listed = np.flatnonzero(ready & ~single & certified)
        content[listed] = _list_stretches(pairs, pieces, centre, radius, listed, lists)
        rows = np.flatnonzero(ready)
        done.append((np.full(len(rows), level), pairs.x[rows], pairs.y[rows], content[rows]))
        pairs = _split_cells(pairs, ~far & ~ready)
        level += 1
    joined = [np.concatenate([part[i] for part in done]) for i in range(4)]
    return _Leaves(joined[0], joined[1], joined[2], joined[3], np.concatenate(lists))


def _chord_distance(pairs: _Pairs, pieces: CurvePieces, centre: Array) -> Array:
    """Distance (k,) of each pair's cell centre from the chord of its piece."""
    p, x, y = pairs.piece, centre[pairs.cell, 0], centre[pairs.cell, 1]
    x -= pieces.start_mm[p, 0]
    y -= pieces.start_mm[p, 1]
    ax, ay = pieces.along_mm[p, 0], pieces.along_mm[p, 1]
    t = np.clip((x * ax + y * ay) / (ax * ax + ay * ay), 0.0, 1.0)
    x -= t * ax
    y -= t * ay
    return np.asarray(np.sqrt(x * x + y * y))


def _keep_near(pairs: _Pairs, pieces: CurvePieces, centre: Array, radius: float) -> Array:
    """Drop pairs whose piece is too far away to hold a closest point. Gives the least distance (c,) of every cell from the curve.

    A point of the cell is at most upper + radius from the curve, so its foot is at most upper + 2 radius from the centre.
    """
    distance = _chord_distance(pairs, pieces, centre)
    sagitta = pieces.sagitta_mm[pairs.piece]
    upper = np.minimum.reduceat(distance + sagitta, pairs.first)
    lowest = np.minimum.reduceat(distance - sagitta, pairs.first)
    _keep(pairs, distance - sagitta <= (upper + 2 * radius)[pairs.cell])
    return lowest


def _keep(pairs: _Pairs, kept: NDArray[np.bool_]) -> None:
    pairs.cell, pairs.piece = pairs.cell[kept], pairs.piece[kept]
    pairs.first = np.flatnonzero(np.diff(pairs.cell, prepend=-1))


@dataclass(frozen=True, slots=True, eq=False)
class _View:
    """Each pair's piece seen from the centre of the cell.

    along, aside : (k,) coordinates of the centre in the frame at the middle of the piece
    steepest     : (k,) upper bound of curvature x signed distance over piece and cell: below one, there is one foot at most
    nearest      : (c,) the pair of the piece nearest to the centre
    """

    along: Array
    aside: Array
    steepest: Array
    nearest: Index


def _keep_feet(pairs: _Pairs, pieces: CurvePieces, centre: Array, radius: float) -> _View:
    """Drop pairs whose piece holds the foot of no point of the cell.

    It holds none where the tangential distance keeps its sign along the piece, and where every foot would be a farthest point.
    """
    p = pairs.piece
    along, aside = _frame_coordinates(pieces, p, centre[pairs.cell])
    flattest, steepest = _steepness(pieces, p, along, aside, radius)
    change = np.maximum(np.abs(1 - flattest), np.abs(1 - steepest)) * pieces.half_mm[p] + 2e-6 * (np.abs(aside) + radius)
    kept = (np.abs(along) - radius <= change) & (flattest <= 1)
    at_vertex = np.flatnonzero((pieces.after[p] < 0) | (pieces.before[p] < 0))
    kept[at_vertex] |= _may_end_at_vertex(pieces, p[at_vertex], centre[pairs.cell[at_vertex]], radius)
    _keep(pairs, kept)
    along, aside, steepest = along[kept], aside[kept], steepest[kept]
    distance = _chord_distance(pairs, pieces, centre)
    is_least = np.flatnonzero(distance == np.minimum.reduceat(distance, pairs.first)[pairs.cell])
    nearest = is_least[np.flatnonzero(np.diff(pairs.cell[is_least], prepend=-1))]
    return _View(along, aside, steepest, nearest)


def _may_end_at_vertex(pieces: CurvePieces, p: Index, place: Array, radius: float) -> NDArray[np.bool_]:
    """Whether the vertex of each piece p (k,) can be the closest point of a point of the cell.

    The vertex of a piece is the one at its end; a piece at the start of an open curve has the one there.
    """
    is_start = (pieces.before[p] < 0) & (pieces.vertices[-1 - np.minimum(pieces.before[p], -1), VERTEX_KIND] == OPEN_END)
    vertex = np.where(pieces.after[p] < 0, -1 - pieces.after[p], np.where(is_start, -1 - pieces.before[p], -1))
    x, y = place[:, 0] - pieces.vertices[vertex, 0], place[:, 1] - pieces.vertices[vertex, 1]
    cone = pieces.cones[vertex]
    ahead = x * cone[:, 0, 0] + y * cone[:, 0, 1] >= -radius * (1 + 1e-9)
    behind = x * cone[:, 1, 0] + y * cone[:, 1, 1] <= radius * (1 + 1e-9)
    return np.asarray(ahead & behind & (vertex >= 0))


def _frame_coordinates(pieces: CurvePieces, p: Index, place: Array) -> tuple[Array, Array]:
    """Coordinates (k,) of places (k, 2) along and to the left of the tangent at the middle of the pieces p (k,)."""
    x, y = place[:, 0] - pieces.middle_mm[p, 0], place[:, 1] - pieces.middle_mm[p, 1]
    tx, ty = pieces.tangent[p, 0], pieces.tangent[p, 1]
    return x * tx + y * ty, y * tx - x * ty


def _stretch_starts(pairs: _Pairs, pieces: CurvePieces) -> NDArray[np.bool_]:
    """Whether each pair (k,) begins a new stretch of curve within its cell; the first pair of a cell always does."""
    piece = pairs.piece
    starts = np.ones(len(piece), dtype=bool)
    starts[1:] = (pieces.before[piece[1:]] != piece[:-1]) | (pairs.cell[1:] != pairs.cell[:-1])
    return starts


def _certify(
    pairs: _Pairs, pieces: CurvePieces, centre: Array, view: _View, radius: float
) -> tuple[Index, NDArray[np.bool_], NDArray[np.bool_]]:
    """What is known of every cell (c,): how many stretches of curve it has, and two proofs.

    The first says that each of its stretches has one foot at most; the second that the piece nearest to its centre covers the
    feet of all its points.
    """
    starts = _stretch_starts(pairs, pieces)
    branches = np.add.reduceat(starts.astype(np.int64), pairs.first)
    final = np.append(pairs.first[1:], len(pairs.piece)) - 1
    around_seam = pieces.before[pairs.piece[pairs.first]] == pairs.piece[final]
    branches -= around_seam & (branches > 1)
    certified = np.maximum.reduceat(view.steepest, pairs.first) < _STEEPEST
    nearest = view.nearest
    p, along, aside = pairs.piece[nearest], view.along[nearest], view.aside[nearest]
    certified &= _are_neighbours_certified(pieces, p, centre, radius)
    foot = along / np.maximum(1 - pieces.curvature[p] * aside, 0.1) / pieces.length_mm[p]
    reach = radius / np.clip(1 - view.steepest[nearest], 0.1, 1.0) / pieces.length_mm[p]
    fits = (foot - reach >= pieces.rows[p, PIECE_FIRST]) | (pieces.before[p] < 0)
    fits &= (foot + reach <= pieces.rows[p, PIECE_LAST]) | (pieces.after[p] < 0)
    return branches, certified, fits


def _are_neighbours_certified(pieces: CurvePieces, p: Index, centre: Array, radius: float) -> NDArray[np.bool_]:
    """Whether the pieces before and after p (c,) have one foot at most as well, for points within radius of centre (c, 2)."""
    certified = np.ones(len(p), dtype=bool)
    for link in (pieces.before[p], pieces.after[p]):
        neighbour = np.where(link >= 0, link, p)
        along, aside = _frame_coordinates(pieces, neighbour, centre)
        certified &= _steepness(pieces, neighbour, along, aside, radius)[1] < _STEEPEST
    return certified


def _steepness(pieces: CurvePieces, p: Index, along: Array, aside: Array, radius: float) -> tuple[Array, Array]:
    """Lower and upper bound (k,) of curvature x signed distance over a piece, its overlap, and all points of the cell.

    The tangential distance changes by 1 - curvature x signed distance per millimetre of the curve.
    """
    least, most, reach = pieces.least[p], pieces.most[p], pieces.reach_mm[p]
    sharpest = np.maximum(np.abs(least), np.abs(most))
    drift = sharpest * (np.abs(along) + 2 * reach * np.maximum(1.0, sharpest * np.abs(aside))) * reach + radius
    low, high = aside - drift, aside + drift
    corners = least * low, least * high, most * low, most * high
    flattest = np.minimum(np.minimum(corners[0], corners[1]), np.minimum(corners[2], corners[3]))
    return flattest, np.maximum(np.maximum(corners[0], corners[1]), np.maximum(corners[2], corners[3]))


def _list_stretches(pairs: _Pairs, pieces: CurvePieces, centre: Array, radius: float, cells: Index, lists: list[Index]) -> Index:
    """Append the nearest piece of each stretch of the cells to `lists`, and give what the cells hold (n,).

    A list is a row of LIST_WIDTH: how many pieces, then the pieces. A cell holds LISTED - (place of its list), or FAR where it
    has more stretches than a list can take, or where one of them is not certified.
    """
    if not cells.size:
        return cells
    starts = np.flatnonzero(_stretch_starts(pairs, pieces))  # (s,) first pair of each stretch
    distance = _chord_distance(pairs, pieces, centre)
    stretch = np.zeros(len(pairs.cell), dtype=np.int64)
    stretch[starts[1:]] = 1
    is_least = np.flatnonzero(distance == np.minimum.reduceat(distance, starts)[np.cumsum(stretch)])
    chosen = pairs.piece[is_least[np.searchsorted(is_least, starts)]]  # (s,)
    certified = _are_neighbours_certified(pieces, chosen, centre[pairs.cell[starts]], radius)
    first = np.searchsorted(starts, pairs.first[cells])
    count = np.searchsorted(starts, np.append(pairs.first, len(pairs.cell))[cells + 1]) - first
    rows = np.zeros((len(cells), LIST_WIDTH), dtype=np.int64)
    rows[:, 0] = count
    good = count < LIST_WIDTH
    for branch in range(LIST_WIDTH - 1):
        has = good & (branch < count)
        rows[has, 1 + branch] = chosen[first[has] + branch]
        good[has] &= certified[first[has] + branch]
    place = sum(map(len, lists))
    distinct, which = np.unique(rows[good], axis=0, return_inverse=True)
    lists.append(distinct.ravel())
    content = np.full(len(cells), FAR)
    content[good] = LISTED - (place + LIST_WIDTH * which.ravel())
    return content


def _split_cells(pairs: _Pairs, chosen: NDArray[np.bool_]) -> _Pairs:
    """The four quarters of every chosen cell, each with its parent's pairs."""
    new = np.cumsum(chosen) - 1
    kept = chosen[pairs.cell]
    cell, piece = new[pairs.cell[kept]], pairs.piece[kept]
    count = int(chosen.sum())
    x, y = 2 * pairs.x[chosen], 2 * pairs.y[chosen]
    cells = np.concatenate([cell + quarter * count for quarter in range(4)])
    first = np.flatnonzero(np.diff(cells, prepend=-1))
    return _Pairs(np.concatenate([x, x + 1, x, x + 1]), np.concatenate([y, y, y + 1, y + 1]), first, cells, np.tile(piece, 4))


# --- packing ----------------------------------------------------------------------------------------------------------


def _pack_grid(pieces: CurvePieces, origin: Array, root: float, size: float, leaves: _Leaves, ends: tuple[float, float, float]) -> FootGrid:
    """The tables, each header in front; ends are the first and last parameter of the curve and its length."""
    across = 2**BLOCK_LEVEL
    blocks, cells = _pack_cells(leaves)
    boxes = piece_tree(pieces)
    bounds = derivative_bounds(pieces)
    tables = [np.zeros(HEADER), pieces.rows.ravel(), bounds.ravel(), boxes.ravel(), pieces.vertices.ravel()]
    links = np.column_stack([pieces.before, pieces.after])
    index_tables = [np.zeros(HEADER, np.int64), links.ravel(), blocks.ravel(), cells, leaves.lists]
    real_at = np.cumsum([len(table) for table in tables])
    index_at = np.cumsum([len(table) for table in index_tables])
    header, index_header = tables[0], index_tables[0]
    header[ORIGIN_X], header[ORIGIN_Y] = origin
    header[BLOCKS_PER_MM], header[GRAIN_MM] = across / root, 16 * np.finfo(float).eps * (size + np.abs(origin).max())
    header[FIRST_PARAMETER], header[LAST_PARAMETER], header[LENGTH_MM] = ends
    index_header[BLOCKS_ACROSS], index_header[PIECES], index_header[LEAVES] = across, len(pieces), len(boxes) // 2
    index_header[PIECES_AT : REALS_END + 1], index_header[LINKS_AT : INTEGERS_END + 1] = real_at, index_at
    return FootGrid(align(np.concatenate(tables)), np.concatenate(index_tables).astype(np.int32), len(pieces), len(cells), _BAND * size)


def _pack_cells(leaves: _Leaves) -> tuple[Index, Index]:
    """Blocks (across x across,) and the content of all cells.

    A block is 16 x (place of its first cell) + (depth of its cells), or FAR where it has none.
    """
    across = 2**BLOCK_LEVEL
    depth = leaves.level - BLOCK_LEVEL
    block = (leaves.y >> depth) * across + (leaves.x >> depth)
    deepest = np.full(across * across, -1)
    np.maximum.at(deepest, block, depth)
    offset = np.concatenate([[0], np.cumsum(np.where(deepest < 0, 0, 4 ** np.maximum(deepest, 0)))])
    cells = np.full(offset[-1], FAR)
    finer = deepest[block] - depth
    for fine in np.unique(finer):
        rows = np.flatnonzero(finer == fine)
        row_depth = deepest[block[rows]]
        step = np.arange(2**fine)
        x = ((leaves.x[rows] << fine) & ((1 << row_depth) - 1))[:, None, None] + step[None, None, :]
        y = ((leaves.y[rows] << fine) & ((1 << row_depth) - 1))[:, None, None] + step[None, :, None]
        place = offset[block[rows]][:, None, None] + (y << row_depth[:, None, None]) + x
        cells[place] = leaves.content[rows][:, None, None]
    return np.where(deepest < 0, FAR, (offset[:-1] << BLOCK_DEPTH) + deepest), cells
