"""The compiled inner loops (numba): closest points on a curve, and the paper's projections.

Every point is worked out on its own: no result depends on the batch, the order or the thread that a point comes in.
Arithmetic is plain IEEE double precision with explicit fused multiply-adds, so results are the same bit for bit in
vectorised and scalar code. Nothing is compiled when this file is imported; the first call does it.
"""

import os
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar, cast

import numpy as np
from llvmlite import ir
from numba import carray, njit, types
from numba.core import cgutils
from numba.core.event import Event, Listener, install_listener
from numba.extending import intrinsic
from numpy.typing import NDArray

if TYPE_CHECKING:
    from inspection.foot_grid import FootGrid
    from inspection.sample_table import SampleTable

Array = NDArray[np.float64]

# The layout of the packed tables. All that the loops are compiled from stands in this file: numba's cache looks at its age only.
FAR, LISTED = -1, -2  # what a cell holds instead of a piece: nothing, or LISTED - (place of its list)
MOST_BRANCHES = 4  # cells with more stretches than this are left to the search over the whole curve
BLOCK_LEVEL = 6  # the quadtree's root is cut into 64 x 64 blocks, found by one division
# A piece: 6 + 6 coefficients of x and y, parameter at the middle and per unit of t, valid t from and to, 8 coefficients of the arc length
PIECE_WIDTH = 24
VERTEX_WIDTH = 8  # x, y, pseudo-normal x, y, parameter, kind, arc length, 0
# A sample: place, tangent, normal (2 each), curvature, parameter, station, speed, left and right pole direction (2 each), their
# curvatures, left and right end of the Voronoi edge shared with the next sample (2 each)
SAMPLE_WIDTH = 20
LINK_WIDTH = 4  # next, previous, twin, 1 at an open end
LEAF = 16  # samples in a leaf of the search tree

_BLOCK = 128  # points worked on together: their intermediate values stay in the first-level cache
_QUEUE = _BLOCK * (MOST_BRANCHES + 1)  # a block is taken while fewer than a block's items wait
_REALS = 35 * _BLOCK + _QUEUE + 9
_INTEGERS = 6 * _BLOCK + 3 * _QUEUE + 64
_FINEST = 26  # halvings of a piece, after which an interval is a point
_ACROSS = float(1 << BLOCK_LEVEL)
_TRIES, _WALKED = 2, 4  # further steps on one piece; added to the tries once the neighbouring piece is tried
_ANY = 0x7FFFFFFF  # tells the compiler that an index is not negative
_WITHIN = 0.999  # of a Voronoi cell: its corners are known to round-off only
_STEP = 3e-9  # largest last step, in pieces, after which the square of the error is below round-off
_CHUNK = 8 * _BLOCK  # points that a thread claims at a time
_SHARED = 65_536  # points from which a batch is worth waking other threads
SAMPLE_METHODS = ("circle", "chord", "pcp", "veaw")
_CIRCLE, _CHORD, _PCP = range(3)
_HELPERS = ThreadPoolExecutor(max(1, (os.cpu_count() or 1) - 1), "projection")  # started when first needed: a start takes 0.1 ms
_Function = TypeVar("_Function", bound=Callable[..., Any])


def _compiled(function: _Function, **options: bool) -> _Function:
    """Compile on the first call and keep the result on disk; where nothing can be written, compile in every process."""
    try:
        return cast(_Function, njit(cache=True, nogil=True, error_model="numpy", **options)(function))
    except RuntimeError:
        return cast(_Function, njit(nogil=True, error_model="numpy", **options)(function))


def _inlined(function: _Function) -> _Function:
    """Likewise, and always as part of the caller, so that loops over it vectorise."""
    return _compiled(function, forceinline=True)


def _generated(function: Callable[..., Any]) -> Any:
    """Instructions written out for the compiler."""
    return intrinsic(function)


@_generated
def _fma(typing_context: Any, a: Any, b: Any, c: Any) -> Any:
    """The value a b + c with one rounding."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.fma(*args)

    return types.float64(types.float64, types.float64, types.float64), generate


@_generated
def _stack_reals(typing_context: Any) -> Any:
    """Memory on the stack: the compiler then knows that it overlaps no table, and vectorises loops that read both."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        place = cgutils.alloca_once(builder, ir.ArrayType(ir.DoubleType(), _REALS))
        place.align = 64
        return builder.bitcast(place, ir.DoubleType().as_pointer())

    return types.CPointer(types.float64)(), generate


@_generated
def _stack_integers(typing_context: Any) -> Any:
    """Likewise for integers."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        place = cgutils.alloca_once(builder, ir.ArrayType(ir.IntType(64), _INTEGERS))
        return builder.bitcast(place, ir.IntType(64).as_pointer())

    return types.CPointer(types.int64)(), generate


@_generated
def _rows_to_columns(typing_context: Any, table: Any, rows: Any, first: Any, target: Any, place: Any) -> Any:
    """Eight rows of eight numbers of a table become eight columns: target[place + q _BLOCK + i] = table[rows[first + i] + q].

    Whole rows are loaded and transposed in registers, which takes a third of the time of gathering single numbers.
    """

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        eight = ir.VectorType(ir.DoubleType(), 8)
        table_data, rows_data, target_data = (context.make_array(signature.args[i])(context, builder, args[i]).data for i in (0, 1, 3))
        word = ir.IntType(64)

        def at(data: Any, offset: Any) -> Any:
            return builder.gep(data, [offset], inbounds=True)

        lines = []
        for i in range(8):
            row = builder.load(at(rows_data, builder.add(args[2], word(i))))
            lines.append(builder.load(builder.bitcast(at(table_data, row), eight.as_pointer()), align=8))
        choice = ir.VectorType(ir.IntType(32), 8)
        for span in (4, 2, 1):
            low = ir.Constant(choice, [i + (8 - span if i & span else 0) for i in range(8)])
            high = ir.Constant(choice, [i + (8 if i & span else span) for i in range(8)])
            for i in range(8):
                if not i & span:
                    a, b = lines[i], lines[i + span]
                    lines[i], lines[i + span] = builder.shuffle_vector(a, b, low), builder.shuffle_vector(a, b, high)
        for q in range(8):
            offset = builder.add(args[4], word(q * _BLOCK))
            builder.store(lines[q], builder.bitcast(at(target_data, offset), eight.as_pointer()), align=8)
        return context.get_dummy_value()

    return types.void(table, rows, types.int64, target, types.int64), generate


@_generated
def _claim(typing_context: Any, claimed: Any) -> Any:
    """The first of the next chunk of points, which no other thread gets."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        counter = context.make_array(signature.args[0])(context, builder, args[0]).data
        return builder.atomic_rmw("add", counter, ir.Constant(ir.IntType(64), _CHUNK), "monotonic")

    return types.int64(claimed), generate


class Feet(NamedTuple):
    """Closest points on a curve of m points.

    parameter   : (m,) curve parameter
    foot_mm     : (m, 2)
    distance_mm : (m,) positive to the left of the direction of travel
    gradient    : (m, 2) unit direction in which `distance_mm` grows; on the curve its left normal
    curvature   : (m,) 1/mm at the foot, positive where the curve turns left; 0 at vertices
    station_mm  : (m,) arc length from the start of the curve
    vertex      : (m,) 0 a foot inside, 1 a corner, 2 an open end
    """

    parameter: Array
    foot_mm: Array
    distance_mm: Array
    gradient: Array
    curvature: Array
    station_mm: Array
    vertex: NDArray[np.uint8]


def project(points_mm: Array, grid: "FootGrid", threads: int | None = None) -> Feet:
    """Globally closest points of the curve of `grid` to points (m, 2). Points that are not finite give NaN.

    threads : None chooses by the number of points; the result is the same.
    """
    points = _flat(points_mm)
    feet = _empty_feet(len(points) // 2)
    _share(lambda claimed: _project(points, grid.reals, grid.integers, feet, claimed), len(feet.vertex), threads)
    return feet


def _flat(points_mm: Array) -> Array:
    points = np.ascontiguousarray(points_mm, dtype=np.float64).reshape(-1)
    return points if points.flags.writeable else points.copy()  # one type for the compiler, whatever the caller's flags


def _empty_feet(m: int) -> Feet:
    """Arrays of their own, not parts of one: the allocator hands such sizes out again without clearing their pages."""
    return Feet(np.empty(m), np.empty((m, 2)), np.empty(m), np.empty((m, 2)), np.empty(m), np.empty(m), np.empty(m, dtype=np.uint8))


def _share(work: Callable[[NDArray[np.int64]], None], m: int, threads: int | None) -> None:
    """Let one or more threads claim chunks of m points until none are left; None chooses by their number."""
    claimed = np.zeros(1, dtype=np.int64)
    if threads is None:
        threads = (os.cpu_count() or 1) if m >= _SHARED else 1
    if threads == 1:
        work(claimed)
        return
    helping = [_HELPERS.submit(work, claimed) for _ in range(min(threads, -(-m // _CHUNK)) - 1)]
    work(claimed)
    for help_given in helping:
        if not help_given.cancel():  # one that has not begun, as in a forked process, has nothing left to do
            help_given.result()


@contextmanager
def while_compiling(tell: Callable[[], None]) -> Iterator[None]:
    """Within it, call `tell` at the first loop that has to be compiled; what comes from the cache has not."""
    with install_listener("numba:compile", _FirstOne(tell)):
        yield


class _FirstOne(Listener):  # type: ignore[misc]  # numba has no types
    def __init__(self, tell: Callable[[], None]) -> None:
        self._tell: Callable[[], None] | None = tell

    def on_start(self, event: Event) -> None:
        if self._tell is not None:
            self._tell()
            self._tell = None

    def on_end(self, event: Event) -> None:
        """Nothing to tell."""


def compile_kernels() -> None:
    """Compile the projections, or load them from the cache, for a benchmark; the application rehearses (`live.rehearse`)."""
    flat, pairs, kinds = types.Array(types.float64, 1, "C"), types.Array(types.float64, 2, "C"), types.Array(types.uint8, 1, "C")
    claimed = types.Array(types.int64, 1, "C")
    feet = types.NamedTuple([flat, pairs, flat, pairs, flat, flat, kinds], Feet)
    fixed, index32, index64 = (types.Array(kind, 1, "C", readonly=True) for kind in (types.float64, types.int32, types.int64))
    exact: Any = _project
    on_samples: Any = _project_on_samples
    exact.compile((flat, fixed, index32, feet, claimed))
    on_samples.compile((flat, types.Tuple((fixed, index64, fixed, index64, fixed, types.int64)), feet, claimed))


# Where the memory of a block keeps what, _BLOCK numbers each. Reals: the row of the piece (24 columns), then
_X, _Y, _U, _FOOT_X, _FOOT_Y, _E, _NX, _NY, _CURVATURE, _T, _STATION, _WAITING_T = (_BLOCK * i for i in range(24, 36))
# Integers: piece (or FAR, LISTED - place) of each lane, its row, whether solved, its point, its tries; unsolved lanes; the queue
_CONTENT, _ROW, _SOLVED, _POINT, _TRY, _UNSOLVED, _WAITING = (_BLOCK * i for i in range(7))


@_compiled
def _project(points: Any, reals: Any, integers: Any, feet: Any, claimed: Any) -> None:
    """Closest points of the flat points (2 m,), chunk by chunk as claimed, into feet.

    All points of a block are solved on the piece that their cell holds; those whose foot is not on that piece, or whose
    cell holds several stretches, queue until they fill a block of their own.
    """
    m = len(feet.vertex)
    pieces, blocks, cells = reals[integers[3] :], integers[integers[9] :], integers[integers[10] :]
    w = carray(_stack_reals(), _REALS)
    q = carray(_stack_integers(), _INTEGERS)
    best, stack = w[_REALS - 9 :], q[_INTEGERS - 64 :]  # results of one point; nodes of the search tree
    waiting = block = stop = 0
    while True:
        if block >= stop and stop < m:
            block = _claim(claimed)
            stop = min(block + _CHUNK, m)
        if block >= stop and waiting == 0:
            break
        fresh = block < stop and waiting < _BLOCK
        if fresh:
            lanes = min(_BLOCK, stop - block)
            here = points[2 * block : 2 * (block + lanes)]
            for j in range(lanes):
                _locate(w, q, here, blocks, cells, reals[0], reals[1], reals[2], j)
        else:
            lanes = min(_BLOCK, waiting)
            waiting -= lanes
            _take(w, q, points, lanes, waiting)
        _load_pieces(w, q, pieces, lanes)
        for j in range(lanes):
            _start(w, j)
        if not fresh:
            _resume(w, lanes, waiting)
        for j in range(lanes):
            _solve(w, q, j, _improve(w, j, w[_T + j]))
        for j in range(lanes):
            _measure(w, j, reals[4], reals[5], reals[6])
        if fresh:
            _store_block(w, feet, block, lanes)
            waiting = _queue_unsolved(w, q, reals, integers, feet, block, lanes, waiting, best, stack)
            block += lanes
        else:
            waiting = _settle(w, q, reals, integers, feet, lanes, waiting, best, stack)


@_inlined
def _locate(w: Any, q: Any, here: Any, blocks: Any, cells: Any, x0: float, y0: float, per_mm: float, j: int) -> None:
    """What the cell of point j holds."""
    x, y = here[2 * j], here[2 * j + 1]
    fx, fy = (x - x0) * per_mm, (y - y0) * per_mm
    inside = (fx >= 0.0) & (fx < _ACROSS) & (fy >= 0.0) & (fy < _ACROSS)
    fx = fx if inside else 0.0
    fy = fy if inside else 0.0
    bx, by = np.int32(fx), np.int32(fy)
    block = blocks[((by << BLOCK_LEVEL) | bx) & _ANY]
    depth = block & 15
    count = float(np.int32(1) << depth)
    cell = (block >> 4) + (np.int32((fy - by) * count) << depth) + np.int32((fx - bx) * count)
    known = inside & (block >= 0)
    content = cells[(cell if known else 0) & _ANY]
    content = content if known else FAR
    q[_CONTENT + j] = content
    q[_ROW + j] = PIECE_WIDTH * max(content, 0)
    w[_X + j] = x
    w[_Y + j] = y


@_inlined
def _load_pieces(w: Any, q: Any, pieces: Any, lanes: int) -> None:
    """The rows of all lanes' pieces, as columns; lanes that fill up the last eight take the first piece."""
    for j in range(lanes, (lanes + 7) & ~7):
        q[_ROW + j] = 0
    for j in range(0, lanes, 8):
        _rows_to_columns(pieces, q, _ROW + j, w, j)
        _rows_to_columns(pieces[8:], q, _ROW + j, w, 8 * _BLOCK + j)
        _rows_to_columns(pieces[16:], q, _ROW + j, w, 16 * _BLOCK + j)


@_inlined
def _start(w: Any, j: int) -> None:
    """One Halley step from the middle of the piece, where the derivatives are the coefficients."""
    c1, c2, c3 = w[1 * _BLOCK + j], w[2 * _BLOCK + j], w[3 * _BLOCK + j]
    d1, d2, d3 = w[7 * _BLOCK + j], w[8 * _BLOCK + j], w[9 * _BLOCK + j]
    rx, ry = w[j] - w[_X + j], w[6 * _BLOCK + j] - w[_Y + j]
    w[_T + j] = _halley(rx, ry, c1, d1, c2, d2, c3, d3)


@_inlined
def _improve(w: Any, j: int, t: float) -> float:
    """One Halley step from t, with Taylor coefficients there by repeated synthetic division."""
    c1, c2, c3, c4, c5 = w[_BLOCK + j], w[2 * _BLOCK + j], w[3 * _BLOCK + j], w[4 * _BLOCK + j], w[5 * _BLOCK + j]
    d1, d2, d3, d4, d5 = w[7 * _BLOCK + j], w[8 * _BLOCK + j], w[9 * _BLOCK + j], w[10 * _BLOCK + j], w[11 * _BLOCK + j]
    a4, b4 = _fma(c5, t, c4), _fma(d5, t, d4)
    a3, b3 = _fma(a4, t, c3), _fma(b4, t, d3)
    a2, b2 = _fma(a3, t, c2), _fma(b3, t, d2)
    a1, b1 = _fma(a2, t, c1), _fma(b2, t, d1)
    rx, ry = _fma(a1, t, w[j] - w[_X + j]), _fma(b1, t, w[6 * _BLOCK + j] - w[_Y + j])  # C - M
    a4, b4 = _fma(c5, t, a4), _fma(d5, t, b4)
    a3, b3 = _fma(a4, t, a3), _fma(b4, t, b3)
    a2, b2 = _fma(a3, t, a2), _fma(b3, t, b2)
    vx, vy = _fma(a2, t, a1), _fma(b2, t, b1)  # C'
    a4, b4 = _fma(c5, t, a4), _fma(d5, t, b4)
    a3, b3 = _fma(a4, t, a3), _fma(b4, t, b3)
    hx, hy = _fma(a3, t, a2), _fma(b3, t, b2)  # C'' / 2
    a4, b4 = _fma(c5, t, a4), _fma(d5, t, b4)
    kx, ky = _fma(a4, t, a3), _fma(b4, t, b3)  # the third derivative / 6
    return t + _halley(rx, ry, vx, vy, hx, hy, kx, ky)


@_inlined
def _halley(rx: float, ry: float, vx: float, vy: float, hx: float, hy: float, kx: float, ky: float) -> float:
    """Third-order step towards the zero of C' . (C - M), from C - M and the first three Taylor coefficients of C."""
    g = _fma(rx, vx, ry * vy)
    g1 = _fma(2.0, _fma(rx, hx, ry * hy), _fma(vx, vx, vy * vy))
    half_g2 = 3.0 * _fma(vx, hx, _fma(vy, hy, _fma(rx, kx, ry * ky)))
    return float(-g * g1 / _fma(g1, g1, -g * half_g2))


@_inlined
def _solve(w: Any, q: Any, j: int, t: float) -> None:
    """A Newton step from t and the results; solved where the step is small and t belongs to the piece."""
    c1, c2, c3, c4, c5 = w[_BLOCK + j], w[2 * _BLOCK + j], w[3 * _BLOCK + j], w[4 * _BLOCK + j], w[5 * _BLOCK + j]
    d1, d2, d3, d4, d5 = w[7 * _BLOCK + j], w[8 * _BLOCK + j], w[9 * _BLOCK + j], w[10 * _BLOCK + j], w[11 * _BLOCK + j]
    x, y = w[_X + j], w[_Y + j]
    a4, b4 = _fma(c5, t, c4), _fma(d5, t, d4)
    a3, b3 = _fma(a4, t, c3), _fma(b4, t, d3)
    a2, b2 = _fma(a3, t, c2), _fma(b3, t, d2)
    a1, b1 = _fma(a2, t, c1), _fma(b2, t, d1)
    rx, ry = _fma(a1, t, w[j] - x), _fma(b1, t, w[6 * _BLOCK + j] - y)
    a4, b4 = _fma(c5, t, a4), _fma(d5, t, b4)
    a3, b3 = _fma(a4, t, a3), _fma(b4, t, b3)
    a2, b2 = _fma(a3, t, a2), _fma(b3, t, b2)
    vx, vy = _fma(a2, t, a1), _fma(b2, t, b1)
    a4, b4 = _fma(c5, t, a4), _fma(d5, t, b4)
    a3, b3 = _fma(a4, t, a3), _fma(b4, t, b3)
    hx, hy = 2.0 * _fma(a3, t, a2), 2.0 * _fma(b3, t, b2)
    g1 = _fma(rx, hx, _fma(ry, hy, _fma(vx, vx, vy * vy)))
    step = -_fma(rx, vx, ry * vy) / g1
    t += step
    rx, ry = _fma(vx, step, rx), _fma(vy, step, ry)
    vx, vy = _fma(hx, step, vx), _fma(hy, step, vy)
    slowness = 1.0 / np.sqrt(_fma(vx, vx, vy * vy))
    nx, ny = -vy * slowness, vx * slowness
    w[_FOOT_X + j] = x + rx
    w[_FOOT_Y + j] = y + ry
    w[_E + j] = -_fma(rx, nx, ry * ny)
    w[_NX + j] = nx
    w[_NY + j] = ny
    w[_CURVATURE + j] = _fma(vx, hy, -vy * hx) * (slowness * slowness * slowness)
    w[_T + j] = t
    good = (abs(step) <= _STEP) & (g1 > 0.0) & (t >= w[14 * _BLOCK + j]) & (t <= w[15 * _BLOCK + j]) & (q[_CONTENT + j] >= 0)
    q[_SOLVED + j] = 1 if good else 0


@_inlined
def _measure(w: Any, j: int, first: float, last: float, length: float) -> None:
    """Parameter and arc length from the start of the curve; round-off at the seam leads out of neither range."""
    t = w[_T + j]
    s = _fma(w[23 * _BLOCK + j], t, w[22 * _BLOCK + j])
    s = _fma(s, t, w[21 * _BLOCK + j])
    s = _fma(s, t, w[20 * _BLOCK + j])
    s = _fma(s, t, w[19 * _BLOCK + j])
    s = _fma(s, t, w[18 * _BLOCK + j])
    s = _fma(s, t, w[17 * _BLOCK + j])
    w[_STATION + j] = min(max(_fma(s, t, w[16 * _BLOCK + j]), 0.0), length)
    w[_U + j] = min(max(_fma(w[13 * _BLOCK + j], t, w[12 * _BLOCK + j]), first), last)


@_inlined
def _store_block(w: Any, feet: Any, block: int, k: int) -> None:
    """Results of all points of a block, solved or not."""
    end = block + k
    u, e, curvature, station = feet.parameter[block:end], feet.distance_mm[block:end], feet.curvature[block:end], feet.station_mm[block:end]
    foot, gradient = feet.foot_mm.reshape(-1)[2 * block : 2 * end], feet.gradient.reshape(-1)[2 * block : 2 * end]
    kind = feet.vertex[block:end]
    for j in range(k):
        u[j] = w[_U + j]
    for j in range(k):
        foot[2 * j] = w[_FOOT_X + j]
        foot[2 * j + 1] = w[_FOOT_Y + j]
    for j in range(k):
        e[j] = w[_E + j]
    for j in range(k):
        gradient[2 * j] = w[_NX + j]
        gradient[2 * j + 1] = w[_NY + j]
    for j in range(k):
        curvature[j] = w[_CURVATURE + j]
    for j in range(k):
        station[j] = w[_STATION + j]
    for j in range(k):
        kind[j] = 0


@_compiled
def _store(best: Any, feet: Any, i: int) -> None:
    """Results of one point."""
    feet.parameter[i], feet.distance_mm[i], feet.curvature[i], feet.station_mm[i] = best[0], best[3], best[6], best[8]
    feet.foot_mm[i, 0], feet.foot_mm[i, 1] = best[1], best[2]
    feet.gradient[i, 0], feet.gradient[i, 1] = best[4], best[5]
    feet.vertex[i] = np.uint8(best[7])


# --- further tries of the few points that the first pass leaves ---------------------------------------------------------


@_compiled
def _queue_unsolved(
    w: Any, q: Any, reals: Any, integers: Any, feet: Any, block: int, lanes: int, waiting: int, best: Any, stack: Any
) -> int:
    """Queue what the first pass left, or search for it; the number of waiting items."""
    unsolved = 0
    for j in range(lanes):
        q[_UNSOLVED + unsolved] = j
        unsolved += 1 - q[_SOLVED + j]
    lists = integers[integers[11] :]
    for item in range(unsolved):
        j = q[_UNSOLVED + item]
        point, content = block + j, q[_CONTENT + j]
        feet.distance_mm[point] = np.inf
        if content >= 0:
            q[_POINT + j], q[_TRY + j] = point, 0
            waiting = _advance(w, q, reals, integers, feet, j, waiting, best, stack)
        elif content == FAR:
            _search(w[_X + j], w[_Y + j], reals, integers, best, stack)
            _store(best, feet, point)
        else:
            place = LISTED - content
            for branch in range(lists[place]):
                waiting = _push(w, q, waiting, point, lists[place + 1 + branch], 0, np.nan)
    return waiting


@_compiled
def _push(w: Any, q: Any, waiting: int, point: int, piece: int, tried: int, t: float) -> int:
    item = _WAITING + 3 * waiting
    q[item], q[item + 1], q[item + 2] = point, piece, tried
    w[_WAITING_T + waiting] = t
    return waiting + 1


@_compiled
def _take(w: Any, q: Any, points: Any, lanes: int, waiting: int) -> None:
    """Move the last items of the queue into the lanes."""
    for j in range(lanes):
        item = _WAITING + 3 * (waiting + j)
        point, piece = q[item], q[item + 1]
        q[_POINT + j], q[_CONTENT + j], q[_ROW + j], q[_TRY + j] = point, piece, PIECE_WIDTH * piece, q[item + 2]
        w[_X + j], w[_Y + j] = points[2 * point], points[2 * point + 1]


@_compiled
def _resume(w: Any, lanes: int, waiting: int) -> None:
    """Items that have not converged yet go on from where they were."""
    for j in range(lanes):
        if not np.isnan(w[_WAITING_T + waiting + j]):
            w[_T + j] = w[_WAITING_T + waiting + j]


@_compiled
def _settle(w: Any, q: Any, reals: Any, integers: Any, feet: Any, lanes: int, waiting: int, best: Any, stack: Any) -> int:
    """Offer the solved items to their points, send the others on."""
    for j in range(lanes):
        if q[_SOLVED + j] == 1:
            best[0], best[1], best[2], best[3] = w[_U + j], w[_FOOT_X + j], w[_FOOT_Y + j], w[_E + j]
            best[4], best[5], best[6], best[7], best[8] = w[_NX + j], w[_NY + j], w[_CURVATURE + j], 0.0, w[_STATION + j]
            _offer(best, feet, q[_POINT + j])
        else:
            waiting = _advance(w, q, reals, integers, feet, j, waiting, best, stack)
    return waiting


@_compiled
def _advance(w: Any, q: Any, reals: Any, integers: Any, feet: Any, j: int, waiting: int, best: Any, stack: Any) -> int:
    """The next try of an unsolved lane: once on the neighbouring piece, or the vertex there, or on from its t; else the search.

    Feet are accepted on the certified piece and its two neighbours only, so no try can end on another stretch of curve.
    """
    point, piece, tried, t = q[_POINT + j], q[_CONTENT + j], q[_TRY + j], w[_T + j]
    x, y = w[_X + j], w[_Y + j]
    after = t > w[15 * _BLOCK + j]
    if after or t < w[14 * _BLOCK + j]:
        link = integers[integers[8] + 2 * piece + (1 if after else 0)]
        if link >= 0 and tried < _WALKED:
            return _push(w, q, waiting, point, link, _WALKED, np.nan)
        if link < 0:
            rx, ry, vx, vy, _, _, _, _ = _at(reals[integers[3] :], PIECE_WIDTH * piece, x, y, 0.5 if after else -0.5)
            along = rx * vx + ry * vy
            if (along <= 0.0) if after else (along >= 0.0):
                _finish_vertex(x, y, reals[integers[6] :], VERTEX_WIDTH * (-1 - link), reals[3], best)
                _offer(best, feet, point)
                return waiting
    elif not np.isnan(t) and (tried & (_WALKED - 1)) < _TRIES:
        return _push(w, q, waiting, point, piece, tried + 1, t)
    _search(x, y, reals, integers, best, stack)
    _offer(best, feet, point)
    return waiting


@_compiled
def _offer(best: Any, feet: Any, point: int) -> None:
    """Keep the closest foot of a point, whatever their order: of equally close ones that of the smaller parameter, and so on."""
    order = abs(best[3]) - abs(feet.distance_mm[point])
    if order == 0.0:
        order = best[0] - feet.parameter[point]
    if order == 0.0:  # one foot, worked out on two pieces or by the search as well: the last bits may differ
        order = best[8] - feet.station_mm[point]
    if order == 0.0:
        order = best[6] - feet.curvature[point]
    for axis in range(2):
        if order == 0.0:
            order = best[1 + axis] - feet.foot_mm[point, axis]
        if order == 0.0:
            order = best[4 + axis] - feet.gradient[point, axis]
    if order < 0.0:
        _store(best, feet, point)


# --- any place: search over the whole curve -----------------------------------------------------------------------------


@_compiled
def _search(x: float, y: float, reals: Any, integers: Any, best: Any, stack: Any) -> None:
    """Closest point of the whole curve by branch and bound over its pieces, into best (9,)."""
    if not (np.isfinite(x) and np.isfinite(y)):
        best[:] = np.nan
        best[7] = 0.0
        return
    count = integers[2]
    pieces, bounds, boxes = reals[integers[3] :], reals[integers[4] :], reals[integers[5] :]
    stack[0] = 1
    depth = 1
    least, piece, parameter = np.inf, 0, 0.0
    while depth:
        depth -= 1
        node = stack[depth]
        if _box_distance(boxes, node, x, y) > least:
            continue
        if node >= count:
            t, square = _closest_on_piece(pieces, bounds, node - count, x, y, least)
            if square < least or (square == least and node - count < piece):
                least, piece, parameter = square, node - count, t
            continue
        near = 2 * node
        if _box_distance(boxes, near + 1, x, y) < _box_distance(boxes, near, x, y):
            near += 1
        stack[depth], stack[depth + 1] = near ^ 1, near
        depth += 2
    _finish(x, y, piece, parameter, reals, integers, best)


@_compiled
def _box_distance(boxes: Any, node: int, x: float, y: float) -> float:
    """Square of the distance from a box of the search tree."""
    dx = max(boxes[4 * node] - x, 0.0, x - boxes[4 * node + 2])
    dy = max(boxes[4 * node + 1] - y, 0.0, y - boxes[4 * node + 3])
    return float(dx * dx + dy * dy)


@_compiled
def _at(pieces: Any, row: int, x: float, y: float, t: float) -> tuple[float, ...]:
    """C - M and its first three derivatives at t."""
    rx = vx = hx = kx = 0.0
    ry = vy = hy = ky = 0.0
    for power in range(5, -1, -1):
        c, d = pieces[row + power], pieces[row + 6 + power]
        if power == 0:
            c, d = c - x, d - y
        kx, ky = _fma(kx, t, hx), _fma(ky, t, hy)
        hx, hy = _fma(hx, t, vx), _fma(hy, t, vy)
        vx, vy = _fma(vx, t, rx), _fma(vy, t, ry)
        rx, ry = _fma(rx, t, c), _fma(ry, t, d)
    return rx, ry, vx, vy, 2.0 * hx, 2.0 * hy, 6.0 * kx, 6.0 * ky


@_compiled
def _closest_on_piece(pieces: Any, bounds: Any, piece: int, x: float, y: float, least: float) -> tuple[float, float]:
    """Closest t of one piece and the square of the distance, infinite when certainly above `least`.

    Intervals are halved until the tangential distance is monotone in them, or until no point of them can be closer than
    their middle by more than round-off: near a centre of curvature a whole stretch is equally close.
    """
    row = PIECE_WIDTH * piece
    fast, bend, twist, fourth = bounds[4 * piece], bounds[4 * piece + 1], bounds[4 * piece + 2], bounds[4 * piece + 3]
    closest, square_least = 0.0, np.inf
    level, place = 0, 0  # the interval of number `place` of 2 ** level
    while True:
        half = 0.5 / (1 << level)
        middle = (2 * place + 1) * half - 0.5
        rx, ry, vx, vy, hx, hy, kx, ky = _at(pieces, row, x, y, middle)
        square = rx * rx + ry * ry
        if square < square_least:
            square_least, closest = square, middle
            least = min(least, square)
        distance = np.sqrt(square)
        slope = vx * vx + vy * vy + rx * hx + ry * hy
        bound = 3.0 * bend * bend + 4.0 * fast * twist + (distance + fast * half) * fourth
        change = half * abs(3.0 * (vx * hx + vy * hy) + rx * kx + ry * ky) + 0.5 * half * half * bound
        gain = 2.0 * half * abs(rx * vx + ry * vy) + half * half * (abs(slope) + change)
        nearer = max(distance - fast * half, 0.0)
        round_off = 1e-15 * least if slope <= change else 0.0
        if nearer * nearer <= least and square - gain <= least - round_off:
            if abs(slope) <= change and level < _FINEST:
                level, place = level + 1, 2 * place
                continue
            if slope < -change:
                t, square = _end_distance(pieces, row, x, y, middle - half)
                other, other_square = _end_distance(pieces, row, x, y, middle + half)
                if other_square < square:
                    t, square = other, other_square
            else:
                t, square = _monotone_root(pieces, row, x, y, middle - half, middle + half)
            if square <= square_least:
                square_least, closest = square, t
                least = min(least, square)
        while place & 1:
            level, place = level - 1, place >> 1
        if level <= 0:
            return closest, square_least
        place += 1


@_compiled
def _end_distance(pieces: Any, row: int, x: float, y: float, t: float) -> tuple[float, float]:
    rx, ry, _, _, _, _, _, _ = _at(pieces, row, x, y, t)
    return t, rx * rx + ry * ry


@_compiled
def _monotone_root(pieces: Any, row: int, x: float, y: float, low: float, high: float) -> tuple[float, float]:
    """Where the tangential distance changes sign in [low, high], or the nearer end; Newton held inside its bracket."""
    rx, ry, vx, vy, hx, hy, _, _ = _at(pieces, row, x, y, low)
    if rx * vx + ry * vy >= 0.0:
        return low, rx * rx + ry * ry
    rx, ry, vx, vy, hx, hy, _, _ = _at(pieces, row, x, y, high)
    if rx * vx + ry * vy <= 0.0:
        return high, rx * rx + ry * ry
    t = 0.5 * (low + high)
    for _ in range(100):
        rx, ry, vx, vy, hx, hy, _, _ = _at(pieces, row, x, y, t)
        g = rx * vx + ry * vy
        if g < 0.0:
            low = t
        else:
            high = t
        slope = vx * vx + vy * vy + rx * hx + ry * hy
        following = t - g / slope if slope > 0.0 else low
        if not (low < following < high):
            following = 0.5 * (low + high)
        if abs(following - t) <= 1e-16 or g == 0.0:
            break
        t = following
    rx, ry, vx, vy, hx, hy, _, _ = _at(pieces, row, x, y, t)
    return t, rx * rx + ry * ry


@_compiled
def _finish(x: float, y: float, piece: int, t: float, reals: Any, integers: Any, best: Any) -> None:
    """Results for the foot at t of a piece: best = parameter, foot, distance, gradient, curvature, kind of vertex, station."""
    pieces, vertices, links = reals[integers[3] :], reals[integers[6] :], integers[integers[8] :]
    row = PIECE_WIDTH * piece
    rx, ry, vx, vy, hx, hy, _, _ = _at(pieces, row, x, y, t)
    if abs(t) == 0.5:
        link = links[2 * piece + (1 if t > 0.0 else 0)]
        slope = vx * vx + vy * vy + rx * hx + ry * hy
        wanted = t - (rx * vx + ry * vy) / slope if slope > 0.0 else 2.0 * t
        if link < 0 and not (pieces[row + 14] <= wanted <= pieces[row + 15]):
            _finish_vertex(x, y, vertices, VERTEX_WIDTH * (-1 - link), reals[3], best)
            return
    slowness = 1.0 / np.sqrt(vx * vx + vy * vy)
    nx, ny = -vy * slowness, vx * slowness
    best[0] = min(max(_fma(pieces[row + 13], t, pieces[row + 12]), reals[4]), reals[5])
    best[1], best[2] = x + rx, y + ry
    best[3] = np.copysign(np.sqrt(rx * rx + ry * ry), -(rx * nx + ry * ny))
    best[4], best[5] = nx, ny
    best[6] = (vx * hy - vy * hx) * slowness * slowness * slowness
    best[7] = 0.0
    s = 0.0
    for power in range(23, 15, -1):
        s = _fma(s, t, pieces[row + power])
    best[8] = min(max(s, 0.0), reals[6])


@_compiled
def _finish_vertex(x: float, y: float, vertices: Any, row: int, grain: float, best: Any) -> None:
    """Distance from a point: signed by the side of the pseudo-normal on which it lies."""
    dx, dy = x - vertices[row], y - vertices[row + 1]
    nx, ny = vertices[row + 2], vertices[row + 3]
    distance = np.sqrt(dx * dx + dy * dy)
    sign = 1.0 if dx * nx + dy * ny >= 0.0 else -1.0
    best[0], best[1], best[2] = vertices[row + 4], vertices[row], vertices[row + 1]
    best[3] = sign * distance
    if distance > grain:
        nx, ny = sign * dx / distance, sign * dy / distance
    best[4], best[5], best[6], best[7], best[8] = nx, ny, 0.0, vertices[row + 5], vertices[row + 6]


# --- the paper's methods: projections made at the nearest sample ---------------------------------------------------------


def project_on_samples(points_mm: Array, grid: "FootGrid", table: "SampleTable", method: str, threads: int | None = None) -> Feet:
    """Feet of points (m, 2) by a method that looks at samples only: circle, chord, pcp or veaw (see profile_error).

    The grid merely says where to begin the search for the nearest sample. Points that are not finite give NaN.
    """
    points = _flat(points_mm)
    feet = _empty_feet(len(points) // 2)
    samples = (*table.flat, SAMPLE_METHODS.index(method))
    _share(lambda claimed: _project(points, grid.reals, grid.integers, feet, claimed), len(feet.vertex), threads)
    _share(lambda claimed: _project_on_samples(points, samples, feet, claimed), len(feet.vertex), threads)
    return feet


@_compiled
def _project_on_samples(points: Any, tables: Any, feet: Any, claimed: Any) -> None:
    """Projections of the points, chunk by chunk as claimed; feet hold the exact ones and take the new ones in their place."""
    samples, links, boxes, starts, domain, method = tables
    stack, best = np.empty(64, dtype=np.int64), np.empty(9)
    first = _claim(claimed)
    while first < len(feet.vertex):
        for point in range(first, min(first + _CHUNK, len(feet.vertex))):
            x, y, u = points[2 * point], points[2 * point + 1], feet.parameter[point]
            if np.isnan(u):
                continue
            place = int((u - domain[0]) / (domain[1] - domain[0]) * len(starts))
            site = _nearest_sample(x, y, starts[min(max(place, 0), len(starts) - 1)], samples, links, boxes, stack)
            site, facing = _facing_sample(x, y, site, samples, links)
            if facing:
                _on_faced_sample(x, y, site, method, samples, links, domain, best)
            else:
                _on_sample(x, y, site, samples, links, best)
            _store(best, feet, point)
        first = _claim(claimed)


@_inlined
def _on_faced_sample(x: float, y: float, site: int, method: int, samples: Any, links: Any, domain: Any, best: Any) -> None:
    if method == _CIRCLE:
        left, gx, gy = _on_osculating_circle(x, y, site, samples)
    elif method == _CHORD:
        left, gx, gy = _on_chords(x, y, site, samples, links)
    elif method == _PCP:
        left, gx, gy = _on_pole_circle(x, y, site, samples)
    else:
        left, gx, gy = _between_pole_circles(x, y, site, samples, links)
    _from_sample(x, y, site, left, gx, gy, samples, domain, best)


@_compiled
def _nearest_sample(x: float, y: float, site: int, samples: Any, links: Any, boxes: Any, stack: Any) -> int:
    """Nearest of all samples; `site` is where the search begins.

    Down along the curve; then the Voronoi cell decides whether that is the nearest of all. Where it does not, the search tree
    is climbed from that sample's leaf, and of every other subtree only what may hold a nearer one is looked at.
    """
    least = _sample_distance(samples, site, x, y)
    side = 0
    while side < 2:
        other = links[LINK_WIDTH * site + side]
        distance = _sample_distance(samples, other, x, y) if other >= 0 else np.inf
        if distance < least:
            least, site, side = distance, other, -1
        side += 1
    if _in_cell(x, y, site, samples, links):
        return site
    leaves = len(boxes) // 8
    node = leaves + site // LEAF
    least, site = _nearest_in_leaf(x, y, node - leaves, least, site, samples)
    while node > 1:
        stack[0] = node ^ 1
        node >>= 1
        depth = 1
        while depth:
            depth -= 1
            other = stack[depth]
            if _box_distance(boxes, other, x, y) > least:
                continue
            if other >= leaves:
                least, site = _nearest_in_leaf(x, y, other - leaves, least, site, samples)
            else:
                stack[depth], stack[depth + 1] = 2 * other, 2 * other + 1
                depth += 2
    return site


@_inlined
def _in_cell(x: float, y: float, site: int, samples: Any, links: Any) -> bool:
    """Whether a point between the bisectors with both neighbours is surely in the Voronoi cell of a sample.

    The cell is convex and holds the edges that it shares with the neighbours, so it holds what lies between their ends. False
    also where there is no neighbour or no such edge (NaN), where an edge does not reach to both sides of the sample, and within a
    thousandth of the cell's border.
    """
    row, before = SAMPLE_WIDTH * site, links[LINK_WIDTH * site + 1]
    if before < 0 or links[LINK_WIDTH * site] < 0:
        return False
    earlier = SAMPLE_WIDTH * before
    dx, dy = x - samples[row], y - samples[row + 1]
    inside = True
    for end in (16, 18):
        ax, ay = _WITHIN * (samples[earlier + end] - samples[row]), _WITHIN * (samples[earlier + end + 1] - samples[row + 1])
        bx, by = _WITHIN * (samples[row + end] - samples[row]), _WITHIN * (samples[row + end + 1] - samples[row + 1])
        above = min(ax * samples[row + 4] + ay * samples[row + 5], bx * samples[row + 4] + by * samples[row + 5])
        below = max(ax * samples[row + 4] + ay * samples[row + 5], bx * samples[row + 4] + by * samples[row + 5])
        side = (bx - ax) * (dy - ay) - (by - ay) * (dx - ax)
        inside = inside and (side < 0.0 and above > 0.0 if end == 16 else side > 0.0 and below < 0.0)
    return inside


@_compiled
def _nearest_in_leaf(x: float, y: float, leaf: int, least: float, site: int, samples: Any) -> tuple[float, int]:
    for i in range(leaf * LEAF, min((leaf + 1) * LEAF, len(samples) // SAMPLE_WIDTH)):
        distance = _sample_distance(samples, i, x, y)
        if distance < least or (distance == least and i < site):
            least, site = distance, i
    return least, site


@_inlined
def _sample_distance(samples: Any, site: int, x: float, y: float) -> float:
    dx, dy = x - samples[SAMPLE_WIDTH * site], y - samples[SAMPLE_WIDTH * site + 1]
    return float(dx * dx + dy * dy)


@_inlined
def _reach(x: float, y: float, site: int, samples: Any) -> tuple[float, float]:
    """Coordinates of a point along the tangent and the normal of a sample."""
    row = SAMPLE_WIDTH * site
    dx, dy = x - samples[row], y - samples[row + 1]
    return dx * samples[row + 2] + dy * samples[row + 3], dx * samples[row + 4] + dy * samples[row + 5]


@_inlined
def _facing_sample(x: float, y: float, site: int, samples: Any, links: Any) -> tuple[int, bool]:
    """The sample, or its twin on the other side of a corner, on a piece that the point faces; the nearer tangent wins."""
    ahead, off = _reach(x, y, site, samples)
    faced = _faced(ahead, site, links)
    twin = links[LINK_WIDTH * site + 2]
    if twin >= 0:
        twin_ahead, twin_off = _reach(x, y, twin, samples)
        twin_faced = _faced(twin_ahead, twin, links)
        if twin_faced and (not faced or abs(twin_off) < abs(off)):
            return twin, True
    return site, faced


@_inlined
def _faced(ahead: float, site: int, links: Any) -> bool:
    return (links[LINK_WIDTH * site + 1] >= 0 or ahead >= 0.0) and (links[LINK_WIDTH * site] >= 0 or ahead <= 0.0)


@_compiled
def _on_sample(x: float, y: float, site: int, samples: Any, links: Any, best: Any) -> None:
    """The sample itself as the foot, signed by the sum of the normals that meet there."""
    row, twin = SAMPLE_WIDTH * site, links[LINK_WIDTH * site + 2]
    other = SAMPLE_WIDTH * (twin if twin >= 0 else site)
    nx, ny = samples[row + 4] + samples[other + 4], samples[row + 5] + samples[other + 5]
    length = np.hypot(nx, ny)
    nx, ny = nx / length, ny / length
    dx, dy = x - samples[row], y - samples[row + 1]
    distance = np.hypot(dx, dy)
    side = 1.0 if dx * nx + dy * ny >= 0.0 else -1.0
    if distance > 0.0:
        nx, ny = dx * (side / distance), dy * (side / distance)
    best[0], best[1], best[2], best[3] = samples[row + 7], samples[row], samples[row + 1], side * distance
    best[4], best[5], best[6], best[8] = nx, ny, 0.0, samples[row + 8]
    best[7] = 2.0 if links[LINK_WIDTH * site + 3] else 1.0


@_inlined
def _on_circle(a: float, b: float, curvature: float) -> tuple[float, float, float]:
    """Signed distance of (a, b) to a circle through the origin with its centre on the second axis, and its gradient."""
    s = curvature * (a * a + b * b) - 2.0 * b
    root = np.sqrt(max(1.0 + curvature * s, 0.0))
    if root == 0.0:
        return -s, -curvature * a, 1.0
    return -s / (1.0 + root), -curvature * a / root, (1.0 - curvature * b) / root


@_inlined
def _on_osculating_circle(x: float, y: float, site: int, samples: Any) -> tuple[float, float, float]:
    row = SAMPLE_WIDTH * site
    a, b = _reach(x, y, site, samples)
    left, along, across = _on_circle(a, b, samples[row + 6])
    return left, along * samples[row + 2] + across * samples[row + 4], along * samples[row + 3] + across * samples[row + 5]


@_inlined
def _on_pole_circle(x: float, y: float, site: int, samples: Any) -> tuple[float, float, float]:
    """Left-signed distance to the pole circle on the point's side (equations 2 and 3, the reading `side`), and its gradient."""
    row = SAMPLE_WIDTH * site
    dx, dy = x - samples[row], y - samples[row + 1]
    if dx * samples[row + 4] + dy * samples[row + 5] >= 0.0:
        px, py, curvature, side = samples[row + 10], samples[row + 11], samples[row + 14], 1.0
    else:
        px, py, curvature, side = samples[row + 12], samples[row + 13], samples[row + 15], -1.0
    distance, along, across = _on_circle(dx * py - dy * px, dx * px + dy * py, curvature)
    return side * distance, side * (along * py + across * px), side * (across * py - along * px)


@_compiled
def _between_pole_circles(x: float, y: float, site: int, samples: Any, links: Any) -> tuple[float, float, float]:
    """Pole circles of the sample and its neighbour, blended by angles at the end of their Voronoi edge (equations 4 to 6)."""
    ahead, off = _reach(x, y, site, samples)
    left, gx, gy = _on_pole_circle(x, y, site, samples)
    other = links[LINK_WIDTH * site] if ahead >= 0.0 else links[LINK_WIDTH * site + 1]
    if other < 0:
        return left, gx, gy
    edge = SAMPLE_WIDTH * (site if ahead >= 0.0 else other) + (16 if off > 0.0 else 18)
    vx, vy = samples[edge], samples[edge + 1]
    row, other_row = SAMPLE_WIDTH * site, SAMPLE_WIDTH * other
    at_site = _angle(samples[row] - vx, samples[row + 1] - vy, x - vx, y - vy)
    at_other = _angle(x - vx, y - vy, samples[other_row] - vx, samples[other_row + 1] - vy)
    total = at_site + at_other
    if not total > 0.0:  # also where the two cells share no edge (NaN)
        return left, gx, gy
    share = at_other / total
    left_other, gx_other, gy_other = _on_pole_circle(x, y, other, samples)
    first_x, first_y = gx, gy
    gx, gy = share * gx + (1.0 - share) * gx_other, share * gy + (1.0 - share) * gy_other
    length = np.hypot(gx, gy)
    if length == 0.0:  # at a Voronoi vertex the two directions may be opposite: either is as near
        return left, first_x, first_y
    return share * left + (1.0 - share) * left_other, gx / length, gy / length


@_compiled
def _angle(ax: float, ay: float, bx: float, by: float) -> float:
    return float(abs(np.arctan2(ax * by - ay * bx, ax * bx + ay * by)))


@_compiled
def _on_chords(x: float, y: float, site: int, samples: Any, links: Any) -> tuple[float, float, float]:
    """Projection on the nearer of the two chords that meet at the sample, signed by the side of its normal."""
    row = SAMPLE_WIDTH * site
    left, gx, gy = np.inf, samples[row + 4], samples[row + 5]
    for side in range(2):
        other = links[LINK_WIDTH * site + side]
        if other < 0:
            continue
        sx, sy = samples[SAMPLE_WIDTH * other] - samples[row], samples[SAMPLE_WIDTH * other + 1] - samples[row + 1]
        dx, dy = x - samples[row], y - samples[row + 1]
        share = min(max((dx * sx + dy * sy) / (sx * sx + sy * sy), 0.0), 1.0)
        dx, dy = dx - share * sx, dy - share * sy
        distance = np.hypot(dx, dy)
        if distance < abs(left):
            sign = 1.0 if dx * samples[row + 4] + dy * samples[row + 5] >= 0.0 else -1.0
            left, gx, gy = sign * distance, samples[row + 4], samples[row + 5]
            if distance > 0.0:
                gx, gy = dx * (sign / distance), dy * (sign / distance)
    return left, gx, gy


@_inlined
def _from_sample(x: float, y: float, site: int, left: float, gx: float, gy: float, samples: Any, domain: Any, best: Any) -> None:
    """Complete a projection; the foot's arc length from the sample is that along the osculating circle."""
    row = SAMPLE_WIDTH * site
    foot_x, foot_y = x - left * gx, y - left * gy
    ahead, off = _reach(foot_x, foot_y, site, samples)
    curvature = samples[row + 6]
    turn = curvature * ahead / (1.0 - curvature * off)
    if abs(turn) < 1e-2 and curvature * off < 1.0:  # as a rule: samples lie densely; the next term of the series is below round-off
        square = turn * turn
        travel = ahead / (1.0 - curvature * off) * (1.0 - square * (1 / 3 - square * (1 / 5 - square / 7)))
    else:
        travel = np.arctan2(curvature * ahead, 1.0 - curvature * off) / curvature
    closed = domain[3] != 0.0
    best[0] = _on_curve(samples[row + 7] + travel / samples[row + 9], domain[0], domain[1], closed)
    best[1], best[2], best[3], best[4], best[5], best[6], best[7] = foot_x, foot_y, left, gx, gy, curvature, 0.0
    best[8] = _on_curve(samples[row + 8] + travel, 0.0, domain[2], closed)


@_inlined
def _on_curve(value: float, start: float, end: float, closed: bool) -> float:
    if not closed:
        return min(max(value, start), end)
    if start <= value < end:
        return value
    return start + (value - start) % (end - start)


# --- the fine registration ----------------------------------------------------------------------------------------------

# Sums over the points at a pose, e being the deviations, J their gradients by p = (shift in mm, rotation in rad about the centre):
# J e (3); J J' and e times the second derivative of e (6 each: xx, xy, xt, yy, yt, tt); e^2; the points that took part; e^2 over
# the points that took part at the pose before.
_SLOPE, _TANGENTIAL, _BENDING, _SQUARE, _COUNT, _SQUARE_BEFORE, _SUMS = 0, 3, 9, 15, 16, 17, 18
_STANDSTILL_MM = 1e-9  # Gauss-Newton ends when no point moves further
_HALVINGS = 12
_HOVERING_STEPS = 3  # after them points that come and go at an open end in small steps are left out: no pose suits both
_HOVERING_MM = 0.01
_FREE = 1e-9  # a motion whose eigenvalue is below this share of the largest changes no deviation: it is undetermined
_TRUSTED = 1e-6  # least eigenvalue of the full second derivative, as a share of the largest, for it to be used
_LEAST_REACH_MM = 1e-9
_SWEEPS = 12  # of Jacobi rotations; four or five suffice


class Fit(NamedTuple):
    """A pose of points, and how it was reached.

    pose        : rotation about the origin in rad, then shift in mm (x, y)
    steps       : Gauss-Newton steps made
    settled     : the last step moved no point by more than 1e-9 mm
    mean_square : of the deviations, mm^2, over the points that took part; infinite without any
    centre_mm   : (2,) where the pose puts the mean of the points
    covariance  : (3, 3) of shift in mm and rotation in rad about the centre, for deviations that are independent
    """

    pose: tuple[float, float, float]
    steps: int
    settled: bool
    mean_square: float
    centre_mm: Array
    covariance: Array


class OutlierLimit(NamedTuple):
    """From where on a point is an outlier.

    mads       : farther than so many median absolute deviations
    least_mm   : and farther than this, however small the deviations of the others are
    settled_mm : the fit by Tukey's weights has settled when it moves no point further
    """

    mads: float
    least_mm: float
    settled_mm: float


class PoseFit:
    """Gauss-Newton on the pose of points (m, 2), and the memory it works in.

    weights : (m,) share of each point in the sums; a settled fit has set those of points that hover at an open end to 0
    """

    def __init__(self, points_mm: Array, grid: "FootGrid", table: "SampleTable", method: str, outward: float, tip_radius_mm: float) -> None:
        m = len(points_mm)
        self.weights = np.ones(m)
        self._problem = (_flat(points_mm), self.weights, grid.reals, grid.integers, float(outward), float(tip_radius_mm))
        self._samples = (*table.flat, SAMPLE_METHODS.index(method)) if method in SAMPLE_METHODS else None
        self._memory = (np.empty(2 * m), np.ones(m), np.empty(m), _empty_feet(m))

    def settle(self, pose: tuple[float, float, float], most_steps: int) -> Fit:
        """From a pose to the least mean square of the deviations, by at most so many steps."""
        state, covariance = np.array([*pose, 0.0, 0.0, 0.0]), np.empty((3, 3))
        steps, settled = _settle_pose(self._problem, self._samples, self._memory, state, covariance, most_steps)
        angle, x, y, mean_square, _, _ = state.tolist()
        return Fit((angle, x, y), steps, settled, mean_square, state[4:], covariance)

    def outliers(self, pose: tuple[float, float, float], limit: OutlierLimit, most_steps: int) -> NDArray[np.bool_]:
        """Points (m,) beyond the limit once the fit by Tukey's weights has settled."""
        found = np.zeros(len(self.weights), dtype=np.bool_)
        _find_outliers(self._problem, self._samples, self._memory, pose, limit, most_steps, found)
        return found


@_compiled
def _settle_pose(problem: Any, samples: Any, memory: Any, state: Any, covariance: Any, most_steps: int) -> tuple[int, bool]:
    """Full Newton steps where the second derivative allows, each halved until the mean square falls."""
    points, weights, _, _, outward, tip = problem
    moved, takes_part, new_part, feet = memory
    span, pose, here, trial = _span(points), (state[0], state[1], state[2]), np.empty(_SUMS), np.empty(_SUMS)
    _evaluate(problem, samples, pose, span, moved, takes_part, takes_part, feet, here)
    steps, settled, lower = 0, False, True
    while lower and not settled and steps < most_steps:
        steps += 1
        step, next_pose, share, lower = _newton_step(here, span[2]), pose, 1.0, False
        for _ in range(_HALVINGS):
            next_pose = _moved_pose(pose, span, step, share)
            # It changes no deviation by more, so there is nothing to project again; without any point nothing was fitted.
            settled = share * step[3] <= _STANDSTILL_MM and here[_COUNT] > 0.0
            if settled:
                break
            _evaluate(problem, samples, next_pose, span, moved, takes_part, new_part, feet, trial)
            lower = trial[_SQUARE_BEFORE] <= here[_SQUARE] * (1.0 + 1e-12)
            if lower:
                break
            share *= 0.5
        if lower and steps >= _HOVERING_STEPS and share * step[3] < _HOVERING_MM and trial[_COUNT] != here[_COUNT]:
            for i in range(len(weights)):
                weights[i] *= takes_part[i] * new_part[i]
            _add_up(weights, takes_part, new_part, outward, tip, next_pose, span, moved, feet, trial)
        if lower:
            here, trial = trial, here
            takes_part, new_part = new_part, takes_part
        if lower or settled:
            pose = next_pose
    state[0], state[1], state[2] = pose
    state[3] = here[_SQUARE] / here[_COUNT] if here[_COUNT] > 0.0 else np.inf
    state[4], state[5] = _centre(pose, span)
    _covariance(here, span[2], here[_SQUARE] / max(here[_COUNT] - 3.0, 1.0), covariance)
    return steps, settled


@_compiled
def _find_outliers(problem: Any, samples: Any, memory: Any, pose: Any, wanted: Any, most_steps: int, found: Any) -> None:
    """Weighted steps; the weights follow from the deviations at every pose."""
    points, weights, _, _, outward, tip = problem
    moved, takes_part, off, feet = memory
    span, sums, m = _span(points), np.empty(_SUMS), len(weights)
    for _ in range(most_steps):
        for i in range(m):
            weights[i] = 1.0
        _evaluate(problem, samples, pose, span, moved, takes_part, takes_part, feet, sums)
        for i in range(m):
            off[i] = abs(outward * feet.distance_mm[i] - tip)
        limit = np.inf
        if sums[_COUNT] > 0.0:
            limit = max(wanted.mads * np.median(off[takes_part > 0.0]), wanted.least_mm, _STANDSTILL_MM)
        for i in range(m):
            share = off[i] / limit
            weights[i] = (1.0 - share * share) ** 2 if off[i] < limit else 0.0
            found[i] = off[i] >= limit and takes_part[i] > 0.0
        _add_up(weights, takes_part, takes_part, outward, tip, pose, span, moved, feet, sums)
        step = _newton_step(sums, span[2])
        pose = _moved_pose(pose, span, step, 1.0)
        if step[3] <= wanted.settled_mm:
            break


@_compiled
def _span(points: Any) -> tuple[float, float, float]:
    """Mean of the flat points (x, y), and the distance of the farthest from it: a motion does not change it."""
    x = y = square = 0.0
    m = len(points) // 2
    for i in range(m):
        x += points[2 * i]
        y += points[2 * i + 1]
    x, y = x / m, y / m
    for i in range(m):
        dx, dy = points[2 * i] - x, points[2 * i + 1] - y
        square = max(square, dx * dx + dy * dy)
    return x, y, max(np.sqrt(square), _LEAST_REACH_MM)


@_compiled
def _centre(pose: Any, span: Any) -> tuple[float, float]:
    """Where the pose puts the mean of the points."""
    c, s = np.cos(pose[0]), np.sin(pose[0])
    return c * span[0] - s * span[1] + pose[1], s * span[0] + c * span[1] + pose[2]


@_compiled
def _moved_pose(pose: Any, span: Any, step: Any, share: float) -> tuple[float, float, float]:
    """The pose after a share of a step: its rotation about the centre, which moves by its shift alone."""
    x, y = _centre(pose, span)
    angle = pose[0] + share * step[2]
    angle = np.arctan2(np.sin(angle), np.cos(angle))
    c, s = np.cos(angle), np.sin(angle)
    return angle, x + share * step[0] - (c * span[0] - s * span[1]), y + share * step[1] - (s * span[0] + c * span[1])


@_compiled
def _evaluate(problem: Any, samples: Any, pose: Any, span: Any, moved: Any, before: Any, takes_part: Any, feet: Any, sums: Any) -> None:
    """Points at a pose: moved there, their feet, and the sums over them.

    samples : tables and number of a method that looks at samples only, or None for the exact feet
    """
    points, weights, reals, integers, outward, tip = problem
    c, s, m = np.cos(pose[0]), np.sin(pose[0]), len(weights)
    for i in range(m):
        x, y = points[2 * i], points[2 * i + 1]
        moved[2 * i] = c * x - s * y + pose[1]
        moved[2 * i + 1] = s * x + c * y + pose[2]
    _project(moved, reals, integers, feet, np.zeros(1, dtype=np.int64))
    if samples is not None:
        _project_on_samples(moved, samples, feet, np.zeros(1, dtype=np.int64))
    _add_up(weights, before, takes_part, outward, tip, pose, span, moved, feet, sums)


@_compiled
def _add_up(
    weights: Any, before: Any, takes_part: Any, outward: float, tip: float, pose: Any, span: Any, moved: Any, feet: Any, sums: Any
) -> None:
    """The sums, in columns of their own for every place in a block, so that the loop vectorises, and always in the same order."""
    w = carray(_stack_reals(), _REALS)
    for i in range(_SUMS * _BLOCK):
        w[i] = 0.0
    x0, y0 = _centre(pose, span)
    for block in range(0, len(weights), _BLOCK):
        end = min(block + _BLOCK, len(weights))
        points, gradient = moved[2 * block : 2 * end], feet.gradient.reshape(-1)[2 * block : 2 * end]
        distance, curvature, kind = feet.distance_mm[block:end], feet.curvature[block:end], feet.vertex[block:end]
        weight, part_before, part = weights[block:end], before[block:end], takes_part[block:end]
        for j in range(end - block):
            _add_point(w, points, gradient, distance, curvature, kind, weight, part_before, part, outward, tip, x0, y0, j)
    half = _BLOCK // 2
    while half > 0:
        for column in range(0, _SUMS * _BLOCK, _BLOCK):
            for j in range(half):
                w[column + j] += w[column + half + j]
        half //= 2
    for quantity in range(_SUMS):
        sums[quantity] = w[quantity * _BLOCK]


@_inlined
def _add_point(
    w: Any,
    points: Any,
    gradient: Any,
    distance: Any,
    curvature: Any,
    kind: Any,
    weight: Any,
    before: Any,
    part: Any,
    outward: float,
    tip: float,
    x0: float,
    y0: float,
    j: int,
) -> None:
    """Tangent distance plus curvature: e(p) = e + J p + p' H p / 2, with the curvature of the distance field across its gradient."""
    field = outward * distance[j]
    e = field - tip
    gx, gy = outward * gradient[2 * j], outward * gradient[2 * j + 1]
    ax, ay = points[2 * j] - x0, points[2 * j + 1] - y0
    turn, radial = ax * gy - ay * gx, ax * gx + ay * gy
    at_corner = kind[j] == 1
    numerator = 1.0 if at_corner else -outward * curvature[j]
    denominator = field if at_corner else max(1.0 - curvature[j] * distance[j], 1e-3)
    bend = numerator / denominator if abs(denominator) > 1e-9 else 0.0
    was_part = before[j]
    u = 0.0 if kind[j] == 2 else weight[j]
    takes_part = 1.0 if u > 0.0 else 0.0
    part[j] = takes_part
    we = u * e
    across = we * bend
    w[0 * _BLOCK + j] += we * gx
    w[1 * _BLOCK + j] += we * gy
    w[2 * _BLOCK + j] += we * turn
    w[3 * _BLOCK + j] += u * gx * gx
    w[4 * _BLOCK + j] += u * gx * gy
    w[5 * _BLOCK + j] += u * gx * turn
    w[6 * _BLOCK + j] += u * gy * gy
    w[7 * _BLOCK + j] += u * gy * turn
    w[8 * _BLOCK + j] += u * turn * turn
    w[9 * _BLOCK + j] += across * gy * gy
    w[10 * _BLOCK + j] -= across * gx * gy
    w[11 * _BLOCK + j] -= across * gy * radial
    w[12 * _BLOCK + j] += across * gx * gx
    w[13 * _BLOCK + j] += across * gx * radial
    w[14 * _BLOCK + j] += across * radial * radial - we * radial
    w[15 * _BLOCK + j] += we * e
    w[16 * _BLOCK + j] += takes_part
    w[17 * _BLOCK + j] += was_part * weight[j] * e * e


@_compiled
def _newton_step(sums: Any, reach: float) -> tuple[float, float, float, float]:
    """Shift and rotation to the least (weighted) mean square of the second-order model, and how far they move the farthest point.

    Full second derivative where it is positive definite, its Gauss-Newton part otherwise; motions that the points do not
    determine (a circle's rotation) are left alone.
    """
    matrix, values, vectors = np.empty((3, 3)), np.empty(3), np.empty((3, 3))
    _scaled(sums, 1.0, reach, matrix)
    _eigen(matrix, values, vectors)
    if min(values[0], values[1], values[2]) <= _TRUSTED * max(values[0], values[1], values[2]):
        _scaled(sums, 0.0, reach, matrix)
        _eigen(matrix, values, vectors)
    x = y = turn = 0.0
    for i in range(3):
        if values[i] > _FREE * max(values[0], values[1], values[2]):
            along = vectors[0, i] * sums[_SLOPE] + vectors[1, i] * sums[_SLOPE + 1] + vectors[2, i] * (sums[_SLOPE + 2] / reach)
            x -= vectors[0, i] * (along / values[i])
            y -= vectors[1, i] * (along / values[i])
            turn -= vectors[2, i] * (along / values[i])
    return x, y, turn / reach, np.hypot(x, y) + abs(turn)


@_compiled
def _covariance(sums: Any, reach: float, scatter: float, covariance: Any) -> None:
    """Inverse of the normal matrix times the scatter; the reach as standard deviation of what is not determined."""
    matrix, values, vectors = np.empty((3, 3)), np.empty(3), np.empty((3, 3))
    _scaled(sums, 0.0, reach, matrix)
    _eigen(matrix, values, vectors)
    for k in range(3):
        for j in range(3):
            covariance[k, j] = 0.0
    for i in range(3):
        variance = scatter / values[i] if values[i] > _FREE * max(values[0], values[1], values[2]) else reach * reach
        vectors[2, i] /= reach
        for k in range(3):
            for j in range(3):
                covariance[k, j] += variance * vectors[k, i] * vectors[j, i]


@_compiled
def _scaled(sums: Any, bending: float, reach: float, matrix: Any) -> None:
    """Normal matrix (3, 3), its rotation counted in mm at the farthest point; with or without the second derivative of e."""
    place = 0
    for i in range(3):
        for j in range(i, 3):
            value = sums[_TANGENTIAL + place] + bending * sums[_BENDING + place]
            value /= (reach if i == 2 else 1.0) * (reach if j == 2 else 1.0)
            matrix[i, j] = matrix[j, i] = value
            place += 1


@_compiled
def _eigen(matrix: Any, values: Any, vectors: Any) -> None:
    """Eigenvalues (3,) and eigenvectors, in columns, of a symmetric matrix, which is used up: Jacobi's rotations.

    Written out, because libraries for matrices differ in the last bits from processor to processor.
    """
    for i in range(3):
        for j in range(3):
            vectors[i, j] = 1.0 if i == j else 0.0
    for _ in range(_SWEEPS):
        if matrix[0, 1] == 0.0 and matrix[0, 2] == 0.0 and matrix[1, 2] == 0.0:
            break
        for p in range(2):
            for q in range(p + 1, 3):
                off = matrix[p, q]
                if abs(off) <= 1e-17 * (abs(matrix[p, p]) + abs(matrix[q, q])):
                    matrix[p, q] = matrix[q, p] = 0.0
                    continue
                theta = (matrix[q, q] - matrix[p, p]) / (2.0 * off)
                t = np.copysign(1.0, theta) / (abs(theta) + np.sqrt(theta * theta + 1.0))
                c = 1.0 / np.sqrt(t * t + 1.0)
                s = t * c
                for k in range(3):
                    a, b = matrix[k, p], matrix[k, q]
                    matrix[k, p], matrix[k, q] = c * a - s * b, s * a + c * b
                for k in range(3):
                    a, b = matrix[p, k], matrix[q, k]
                    matrix[p, k], matrix[q, k] = c * a - s * b, s * a + c * b
                for k in range(3):
                    a, b = vectors[k, p], vectors[k, q]
                    vectors[k, p], vectors[k, q] = c * a - s * b, s * a + c * b
    for i in range(3):
        values[i] = matrix[i, i]


class GrowingSums:
    """Normal equations of a pose that grow point by point, about a pose fitted before.

    With p the small motion about `centre_mm` (2,) since that fit, every point adds J J' and J (e - J p): their minimum moves on
    without touching earlier points again. Besides: what the deviations change from point to point, which is noise, and which
    64ths of the profile's length hold points.
    """

    def __init__(self, centre_mm: Array, reach_mm: float, length_mm: float) -> None:
        self.motion = np.zeros(3)  # shift in mm, rotation in rad
        self._frame = (np.array([*centre_mm, reach_mm, length_mm]), self.motion)
        self._sums, self._change, self._marks = np.zeros(_SUMS), np.zeros(1), np.zeros(64)

    def add(self, foot_mm: Array, normal: Array, deviation_mm: Array, station_mm: Array, verdicts: NDArray[np.int8]) -> None:
        """Take in points (m,) judged at the motion so far; those without a verdict (negative) take no part."""
        _grow(foot_mm, normal, deviation_mm, station_mm, verdicts, *self._frame, self._sums, self._change, self._marks)

    def move(self) -> None:
        """Set the motion to the minimum."""
        _move(self._sums, *self._frame)

    @property
    def count(self) -> float:
        """Points taken in."""
        return float(self._sums[_COUNT])

    @property
    def mean_square(self) -> float:
        """Of the deviations, mm^2."""
        return float(self._sums[_SQUARE] / max(self.count, 1.0))

    @property
    def noise(self) -> float:
        """Half the mean squared change of the deviation from point to point, mm^2."""
        return float(self._change[0] / max(self.count, 1.0) / 2.0)

    @property
    def covered(self) -> float:
        """Share of the length that holds points."""
        return float(self._marks.mean())

    def spread_mm(self, places_mm: Array, normals: Array, scatter: float) -> float:
        """Largest standard deviation of the pose's effect on a deviation at any place, for independent errors of that variance."""
        return float(_spread(places_mm, normals, scatter, self._frame[0], self._sums))


@_compiled
def _grow(
    foot: Any,
    normal: Any,
    deviation: Any,
    station: Any,
    verdicts: Any,
    frame: Any,
    motion: Any,
    sums: Any,
    change: Any,
    marks: Any,
) -> None:
    previous = np.nan
    for i in range(len(verdicts)):
        if verdicts[i] < 0:
            continue
        gx, gy, e = normal[i, 0], normal[i, 1], deviation[i]
        turn = (foot[i, 0] - frame[0]) * gy - (foot[i, 1] - frame[1]) * gx
        rest = e - (gx * motion[0] + gy * motion[1] + turn * motion[2])
        sums[0] += gx * rest
        sums[1] += gy * rest
        sums[2] += turn * rest
        sums[3] += gx * gx
        sums[4] += gx * gy
        sums[5] += gx * turn
        sums[6] += gy * gy
        sums[7] += gy * turn
        sums[8] += turn * turn
        sums[_SQUARE] += e * e
        sums[_COUNT] += 1.0
        if not np.isnan(previous):
            change[0] += (e - previous) * (e - previous)
        previous = e
        marks[min(max(int(station[i] / frame[3] * len(marks)), 0), len(marks) - 1)] = 1.0


@_compiled
def _move(sums: Any, frame: Any, motion: Any) -> None:
    motion[0], motion[1], motion[2], _ = _newton_step(sums, frame[2])


@_compiled
def _spread(places: Any, normals: Any, scatter: float, frame: Any, sums: Any) -> float:
    covariance = np.empty((3, 3))
    _covariance(sums, frame[2], scatter, covariance)
    most = 0.0
    for i in range(len(places)):
        gx, gy = normals[i, 0], normals[i, 1]
        turn = (places[i, 0] - frame[0]) * gy - (places[i, 1] - frame[1]) * gx
        x = covariance[0, 0] * gx + covariance[0, 1] * gy + covariance[0, 2] * turn
        y = covariance[1, 0] * gx + covariance[1, 1] * gy + covariance[1, 2] * turn
        t = covariance[2, 0] * gx + covariance[2, 1] * gy + covariance[2, 2] * turn
        most = max(most, gx * x + gy * y + turn * t)
    return float(np.sqrt(most))


def strides(points_mm: Array, step_mm: float) -> NDArray[np.int64]:
    """Indices of points (m, 2) at which a walk along them has come at least one step from the point picked before."""
    picked = np.empty(len(points_mm), dtype=np.int64)
    return picked[: _strides(points_mm, step_mm * step_mm, picked)]


@_compiled
def _strides(points: Any, least: float, picked: Any) -> int:
    count, last = 1, 0
    picked[0] = 0
    for i in range(1, len(points)):
        dx, dy = points[i, 0] - points[last, 0], points[i, 1] - points[last, 1]
        if dx * dx + dy * dy >= least:
            picked[count] = last = i
            count += 1
    return count


# --- points of a scan, row by row ---------------------------------------------------------------------------------------


def take_in(points_mm: Array, plane: Array, off_section_max_mm: float, section_mm: Array, rejection: NDArray[np.int8], at: int) -> None:
    """Enter points (m, 2) or (m, 3) as section points from row `at` on, and why any cannot be used.

    plane : (12,) origin, x axis, y axis and normal of the section in machine coordinates
    """
    _take_in(points_mm, plane, off_section_max_mm, section_mm, rejection, at)


@_compiled
def _take_in(points: Any, plane: Any, off_section_max: float, section: Any, rejection: Any, at: int) -> None:
    flat = points.shape[1] == 2
    for i in range(len(points)):
        row = at + i
        x, y, height = points[i, 0], points[i, 1], 0.0
        if not flat:
            px, py, pz = x - plane[0], y - plane[1], points[i, 2] - plane[2]
            x = px * plane[3] + py * plane[4] + pz * plane[5]
            y = px * plane[6] + py * plane[7] + pz * plane[8]
            height = px * plane[9] + py * plane[10] + pz * plane[11]
        section[row, 0], section[row, 1] = x, y
        if not (np.isfinite(x) and np.isfinite(y) and np.isfinite(height)):
            rejection[row] = 1
        elif abs(height) > off_section_max:
            rejection[row] = 2
        else:
            rejection[row] = 0


def placed(section_mm: Array, rejection: NDArray[np.int8], first: int, stop: int, pose: tuple[float, float, float, float]) -> Array:
    """Rows first .. stop - 1 in nominal coordinates by (cos, sin, x, y); NaN where a row cannot be used."""
    moved = np.empty((stop - first, 2))
    _placed(section_mm, rejection, first, pose, moved)
    return moved


@_compiled
def _placed(section: Any, rejection: Any, first: int, pose: Any, moved: Any) -> None:
    c, s, tx, ty = pose
    for i in range(len(moved)):
        row = first + i
        if rejection[row] == 1 or rejection[row] == 2:
            moved[i, 0] = moved[i, 1] = np.nan
        else:
            x, y = section[row, 0], section[row, 1]
            moved[i, 0] = c * x - s * y + tx
            moved[i, 1] = s * x + c * y + ty


def judge(feet: Feet, judgement: tuple[float, ...], first: int, rows: tuple[Any, ...]) -> None:
    """Enter what feet say from row `first` on.

    judgement : outward, tip radius, lower and upper limit, uncertainty
    rows      : arrays actual_mm, foot_mm, gradient, station_mm, deviation_mm, verdicts, rejection
    """
    _judge(feet.foot_mm, feet.distance_mm, feet.gradient, feet.station_mm, feet.vertex, judgement, first, rows)


@_compiled
def _judge(foot: Any, distance: Any, gradient: Any, station: Any, vertex: Any, judgement: Any, first: int, rows: Any) -> None:
    outward, tip, lower, upper, uncertainty = judgement
    actual, feet, normals, stations, deviations, verdicts, rejection = rows
    for i in range(len(distance)):
        row = first + i
        if rejection[row] == 3:
            rejection[row] = 0  # beyond an end at an earlier pose
        if np.isnan(distance[i]) or vertex[i] == 2 or rejection[row] != 0:
            if rejection[row] == 0:
                rejection[row] = 3
            actual[row, 0] = actual[row, 1] = feet[row, 0] = feet[row, 1] = normals[row, 0] = normals[row, 1] = np.nan
            stations[row] = deviations[row] = np.nan
            verdicts[row] = -1
            continue
        e = outward * distance[i] - tip
        nx, ny = outward * gradient[i, 0], outward * gradient[i, 1]
        actual[row, 0], actual[row, 1] = foot[i, 0] + e * nx, foot[i, 1] + e * ny
        feet[row, 0], feet[row, 1] = foot[i, 0], foot[i, 1]
        normals[row, 0], normals[row, 1] = nx, ny
        stations[row], deviations[row] = station[i], e
        beyond = max(lower - e, e - upper)
        verdicts[row] = 2 if beyond > uncertainty else 0 if beyond <= -uncertainty else 1
