"""Closest points of many places, a block at a time, and the queue of those that the first pass leaves."""

from functools import cache
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from inspection.kernels.compiling import (
    INTEGER,
    INTEGER_ARRAY,
    REAL_ARRAY,
    REAL_TABLE,
    SHORT_TABLE,
    array_at,
    call_of,
    claim_chunk,
    code_of,
    inner_kernel,
    stack_integers,
    stack_reals,
    type_of,
)
from inspection.kernels.feet import empty_feet, keep_closer, store_foot
from inspection.kernels.lanes import improve, load_pieces, locate, measure, solve, start_in_middle, store_block
from inspection.kernels.layout import (
    BLOCK,
    BLOCKS_AT,
    BLOCKS_PER_MM,
    CELLS_AT,
    CHUNK,
    FAR,
    FIRST_PARAMETER,
    FOOT_CURVATURE,
    FOOT_DISTANCE,
    FOOT_GRADIENT_X,
    FOOT_GRADIENT_Y,
    FOOT_STATION,
    FOOT_U,
    FOOT_VERTEX,
    FOOT_X,
    FOOT_Y,
    GRAIN_MM,
    INSIDE,
    INTEGERS,
    ITEM_PIECE,
    ITEM_POINT,
    ITEM_TRIES,
    ITEM_WIDTH,
    LANE_CONTENT,
    LANE_CURVATURE,
    LANE_DISTANCE,
    LANE_FOOT,
    LANE_FOOT_X,
    LANE_FOOT_Y,
    LANE_NORMAL_X,
    LANE_NORMAL_Y,
    LANE_POINT,
    LANE_ROW,
    LANE_SOLVED,
    LANE_STATION,
    LANE_T,
    LANE_TRIES,
    LANE_U,
    LANE_X,
    LANE_Y,
    LAST_PARAMETER,
    LENGTH_MM,
    LINKS_AT,
    LISTED,
    LISTS_AT,
    ORIGIN_X,
    ORIGIN_Y,
    PIECE_AFTER,
    PIECE_BEFORE,
    PIECE_END,
    PIECE_FIRST,
    PIECE_LAST,
    PIECE_LINKS,
    PIECE_WIDTH,
    PIECES_AT,
    REALS,
    STACK_AT,
    UNSOLVED,
    VERTEX_WIDTH,
    VERTICES_AT,
    WAITING,
    WAITING_T,
)
from inspection.kernels.search import SEARCH, call_search, derivatives_at, finish_vertex, search_curve

Array = NDArray[np.float64]

_TRIES = 2  # further steps allowed on one piece
_UNTRIED: Any = np.int64(0)  # not a literal: it has a type of its own, for which what it is given to is compiled once more
_WALKED: Any = np.int64(4)  # flag in the count of tries: the neighbouring piece was tried
FEET = type_of(empty_feet(0))
PROJECTION = (REAL_ARRAY, REAL_TABLE, SHORT_TABLE, INTEGER, FEET, INTEGER_ARRAY)  # the types that `project_points` takes
call_projection = call_of(*PROJECTION)


class CurveTables(Protocol):
    """The foot grid of a curve: header and tables of reals, header and tables of integers."""

    @property
    def reals(self) -> Array:
        """The pieces, their bounds, the boxes of the search tree, the vertices."""
        ...

    @property
    def integers(self) -> NDArray[np.int32]:
        """The links of the pieces, blocks, cells, lists."""
        ...


@cache
def search_code() -> int:
    """Where the code of the search along the whole curve is."""
    return code_of(search_curve, *SEARCH)


def compile_projection() -> None:
    """Compile the projection, or load it, without what it calls by its place."""
    projection_code()


@cache
def projection_code() -> int:
    """Where the code of `project_points` is."""
    return code_of(project_points, *PROJECTION)


@inner_kernel
def project_points(points: Any, reals: Any, integers: Any, search: int, feet: Any, claimed: Any) -> None:
    """Project the flat points (2 m,), chunk by chunk as they are claimed, and write the results into feet.

    search : `search_code()`

    All points of a block are solved on the piece that their cell holds; those whose foot is not on that piece, or whose
    cell holds several stretches, queue until they fill a block of their own.
    """
    m = len(feet.vertex)
    pieces, blocks, cells = reals[integers[PIECES_AT] :], integers[integers[BLOCKS_AT] :], integers[integers[CELLS_AT] :]
    values = array_at(stack_reals(), REALS)
    slots = array_at(stack_integers(), INTEGERS)
    foot, stack = values[LANE_FOOT:], slots[STACK_AT:]
    waiting = block = stop = 0
    while True:
        if block >= stop and stop < m:
            block = claim_chunk(claimed)
            stop = min(block + CHUNK, m)
        if block >= stop and waiting == 0:
            break
        fresh = block < stop and waiting < BLOCK
        if fresh:
            lanes = min(BLOCK, stop - block)
            here = points[2 * block : 2 * (block + lanes)]
            for j in range(lanes):
                locate(values, slots, here, blocks, cells, reals[ORIGIN_X], reals[ORIGIN_Y], reals[BLOCKS_PER_MM], j)
        else:
            lanes = min(BLOCK, waiting)
            waiting -= lanes
            _take(values, slots, points, lanes, waiting)
        load_pieces(values, slots, pieces, lanes)
        for j in range(lanes):
            start_in_middle(values, j)
        if not fresh:
            _resume(values, lanes, waiting)
        for j in range(lanes):
            solve(values, slots, j, improve(values, j, values[LANE_T + j]))
        for j in range(lanes):
            measure(values, j, reals[FIRST_PARAMETER], reals[LAST_PARAMETER], reals[LENGTH_MM])
        if fresh:
            store_block(values, feet, block, lanes)
            waiting = _queue_unsolved(values, slots, reals, integers, search, feet, block, lanes, waiting, foot, stack)
            block += lanes
        else:
            waiting = _settle(values, slots, reals, integers, search, feet, lanes, waiting, foot, stack)


@inner_kernel
def _queue_unsolved(
    values: Any, slots: Any, reals: Any, integers: Any, search: int, feet: Any, block: int, lanes: int, waiting: int, foot: Any, stack: Any
) -> int:
    """Queue or search for what the first pass left. Returns the number of items that wait."""
    unsolved = 0
    for j in range(lanes):
        slots[UNSOLVED + unsolved] = j
        unsolved += 1 - slots[LANE_SOLVED + j]
    lists = integers[integers[LISTS_AT] :]
    for item in range(unsolved):
        j = slots[UNSOLVED + item]
        point, content = block + j, slots[LANE_CONTENT + j]
        feet.distance_mm[point] = np.inf
        if content >= 0:
            slots[LANE_POINT + j], slots[LANE_TRIES + j] = point, 0
            waiting = _advance(values, slots, reals, integers, search, feet, j, waiting, foot, stack)
        elif content == FAR:
            call_search(search, (values[LANE_X + j], values[LANE_Y + j], reals, integers, foot, stack))
            store_foot(foot, feet, point)
        else:
            place = LISTED - content
            for branch in range(lists[place]):
                waiting = _push(values, slots, waiting, point, int(lists[place + 1 + branch]), _UNTRIED, np.nan)
    return waiting


@inner_kernel
def _push(values: Any, slots: Any, waiting: int, point: int, piece: int, tries: int, t: float) -> int:
    """Put an item at the end of the queue: a point to be solved on a piece, from t on or, where that is NaN, from its middle."""
    item = WAITING + ITEM_WIDTH * waiting
    slots[item + ITEM_POINT], slots[item + ITEM_PIECE], slots[item + ITEM_TRIES] = point, piece, tries
    values[WAITING_T + waiting] = t
    return waiting + 1


@inner_kernel
def _take(values: Any, slots: Any, points: Any, lanes: int, waiting: int) -> None:
    """Move the last items of the queue into the lanes."""
    for j in range(lanes):
        item = WAITING + ITEM_WIDTH * (waiting + j)
        point, piece = slots[item + ITEM_POINT], slots[item + ITEM_PIECE]
        slots[LANE_POINT + j], slots[LANE_TRIES + j] = point, slots[item + ITEM_TRIES]
        slots[LANE_CONTENT + j], slots[LANE_ROW + j] = piece, PIECE_WIDTH * piece
        values[LANE_X + j], values[LANE_Y + j] = points[2 * point], points[2 * point + 1]


@inner_kernel
def _resume(values: Any, lanes: int, waiting: int) -> None:
    """Let items that have not converged yet go on from where they were."""
    for j in range(lanes):
        if not np.isnan(values[WAITING_T + waiting + j]):
            values[LANE_T + j] = values[WAITING_T + waiting + j]


@inner_kernel
def _settle(
    values: Any, slots: Any, reals: Any, integers: Any, search: int, feet: Any, lanes: int, waiting: int, foot: Any, stack: Any
) -> int:
    """Offer the solved items to their points and send the others on. Returns the number of items that wait."""
    for j in range(lanes):
        if slots[LANE_SOLVED + j] == 1:
            foot[FOOT_U], foot[FOOT_X], foot[FOOT_Y] = values[LANE_U + j], values[LANE_FOOT_X + j], values[LANE_FOOT_Y + j]
            foot[FOOT_DISTANCE], foot[FOOT_CURVATURE] = values[LANE_DISTANCE + j], values[LANE_CURVATURE + j]
            foot[FOOT_GRADIENT_X], foot[FOOT_GRADIENT_Y] = values[LANE_NORMAL_X + j], values[LANE_NORMAL_Y + j]
            foot[FOOT_VERTEX], foot[FOOT_STATION] = INSIDE, values[LANE_STATION + j]
            keep_closer(foot, feet, slots[LANE_POINT + j])
        else:
            waiting = _advance(values, slots, reals, integers, search, feet, j, waiting, foot, stack)
    return waiting


@inner_kernel
def _advance(
    values: Any, slots: Any, reals: Any, integers: Any, search: int, feet: Any, j: int, waiting: int, foot: Any, stack: Any
) -> int:
    """Choose the next try of an unsolved lane. Returns the number of items that wait.

    A foot beyond the piece is sought once on the neighbouring piece, or is the vertex there; one on the piece goes on from its t
    for a few steps. Whatever is left then is searched for along the whole curve.

    Feet are accepted on the certified piece and its two neighbours only, so no try can end on another stretch of curve.
    """
    point, piece, tries, t = slots[LANE_POINT + j], slots[LANE_CONTENT + j], slots[LANE_TRIES + j], values[LANE_T + j]
    x, y = values[LANE_X + j], values[LANE_Y + j]
    after = t > values[BLOCK * PIECE_LAST + j]
    if after or t < values[BLOCK * PIECE_FIRST + j]:
        link = int(integers[integers[LINKS_AT] + PIECE_LINKS * piece + (PIECE_AFTER if after else PIECE_BEFORE)])
        if link >= 0 and tries < _WALKED:
            return _push(values, slots, waiting, point, link, _WALKED, np.nan)
        if link < 0:
            end = PIECE_END if after else -PIECE_END
            rx, ry, vx, vy, _, _, _, _ = derivatives_at(reals[integers[PIECES_AT] :], PIECE_WIDTH * piece, x, y, end)
            along = rx * vx + ry * vy
            if (along <= 0.0) if after else (along >= 0.0):
                finish_vertex(x, y, reals[integers[VERTICES_AT] :], VERTEX_WIDTH * (-1 - link), reals[GRAIN_MM], foot)
                keep_closer(foot, feet, point)
                return waiting
    elif not np.isnan(t) and (tries & (_WALKED - 1)) < _TRIES:
        return _push(values, slots, waiting, point, piece, tries + 1, t)
    call_search(search, (x, y, reals, integers, foot, stack))
    keep_closer(foot, feet, point)
    return waiting
