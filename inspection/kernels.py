"""The compiled inner loops (numba): closest points on a curve, and the paper's projections.

Every point is worked out on its own: no result depends on the batch, the order or the thread that a point comes in.
Arithmetic is plain IEEE double precision with explicit fused multiply-adds, so results are the same bit for bit in
vectorised and scalar code. Nothing is compiled when this file is imported; `compile_kernels` does it, or the first call.
"""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
from llvmlite import ir
from numba import carray, njit, types
from numba.core import cgutils
from numba.extending import intrinsic
from numpy.typing import NDArray

from inspection.foot_grid import HEADER, LISTED, MOST_BRANCHES, PIECE_WIDTH, VERTEX_WIDTH, FootGrid

Array = NDArray[np.float64]

_BLOCK = 128  # points worked on together: their intermediate values stay in the first-level cache
_ROUNDS = 4  # tries for points whose foot lies on a neighbouring piece or on one of several stretches
_QUEUE = _BLOCK * MOST_BRANCHES
_REALS = 10 * (_BLOCK + _QUEUE)
_INTEGERS = 2 * _BLOCK + 3 * _QUEUE
_STEP = 3e-9  # largest last step, in pieces, after which the square of the error is below round-off
_CHUNK = 16_384  # points per task when several threads share a large batch
_compiled: Callable[..., Any] = njit(cache=True, nogil=True, error_model="numpy")
_inlined: Callable[..., Any] = njit(cache=True, nogil=True, error_model="numpy", forceinline=True)


@intrinsic  # type: ignore[untyped-decorator]
def _fma(typing_context: Any, a: Any, b: Any, c: Any) -> Any:
    """a b + c with one rounding."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.fma(*args)

    return types.float64(types.float64, types.float64, types.float64), generate


@intrinsic  # type: ignore[untyped-decorator]
def _stack_reals(typing_context: Any) -> Any:
    """Memory on the stack: the compiler then knows that it overlaps no table, and vectorises loops that read both."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        place = cgutils.alloca_once(builder, ir.ArrayType(ir.DoubleType(), _REALS))
        return builder.bitcast(place, ir.DoubleType().as_pointer())

    return types.CPointer(types.float64)(), generate


@intrinsic  # type: ignore[untyped-decorator]
def _stack_integers(typing_context: Any) -> Any:
    """Likewise for integers."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        place = cgutils.alloca_once(builder, ir.ArrayType(ir.IntType(64), _INTEGERS))
        return builder.bitcast(place, ir.IntType(64).as_pointer())

    return types.CPointer(types.int64)(), generate


@dataclass(frozen=True, slots=True, eq=False)
class Feet:
    """Closest points on a curve of m points.

    parameter   : (m,) curve parameter
    foot_mm     : (m, 2)
    distance_mm : (m,) positive to the left of the direction of travel
    gradient    : (m, 2) unit direction in which `distance_mm` grows; on the curve its left normal
    curvature   : (m,) 1/mm at the foot, positive where the curve turns left; 0 at vertices
    vertex      : (m,) 0 a foot inside, 1 a corner, 2 an open end
    """

    parameter: Array
    foot_mm: Array
    distance_mm: Array
    gradient: Array
    curvature: Array
    vertex: NDArray[np.uint8]


def project(points_mm: Array, grid: FootGrid, threads: int | None = None) -> Feet:
    """Globally closest points of the curve of `grid` to points (m, 2). Points that are not finite give NaN.

    threads : None chooses by the number of points; the result is the same.
    """
    points = np.ascontiguousarray(points_mm, dtype=np.float64).view()
    points.flags.writeable = False  # one type for the compiler, whatever the caller's flags
    m = len(points)
    numbers = np.empty(7 * m)
    vertex = np.empty(m, dtype=np.uint8)
    if threads is None:
        threads = 1 if m < 4 * _CHUNK else os.cpu_count() or 1
    if threads == 1 or m <= _CHUNK:
        _project(points, grid.reals, grid.integers, numbers, vertex, 0, m)
    else:
        with ThreadPoolExecutor(threads) as pool:
            list(pool.map(lambda at: _project(points, grid.reals, grid.integers, numbers, vertex, at, min(at + _CHUNK, m)), range(0, m, _CHUNK)))
    return Feet(numbers[:m], numbers[m : 3 * m].reshape(m, 2), numbers[3 * m : 4 * m], numbers[4 * m : 6 * m].reshape(m, 2), numbers[6 * m :], vertex)


# Rows of the block's memory, _BLOCK or _QUEUE numbers each.
_RX, _RY, _RU, _RFX, _RFY, _RE, _RNX, _RNY, _RK, _RT = range(10)


@_compiled
def _project(points: Any, reals: Any, integers: Any, numbers: Any, vertex: Any, start: int, stop: int) -> None:
    """Closest points of points[start:stop] into numbers (7 m: parameter, foot, distance, gradient, curvature) and vertex (m,)."""
    m = len(points)
    ox, oy, per_mm = reals[0], reals[1], reals[2]
    across = integers[0]
    real_pieces, real_vertices = integers[3], integers[6]
    int_links, int_blocks, int_cells, int_lists = integers[8], integers[9], integers[10], integers[11]
    pieces = reals[real_pieces:]
    vertices = reals[real_vertices:]
    links = integers[int_links:]
    blocks = integers[int_blocks:]
    cells = integers[int_cells:]
    lists = integers[int_lists:]
    w = carray(_stack_reals(), _REALS)  # this block's points
    held = carray(_stack_integers(), _INTEGERS)  # piece (or FAR, LISTED - k) of each point; state
    best = np.empty(8)

    for block in range(start, stop, _BLOCK):
        k = min(_BLOCK, stop - block)
        for j in range(k):
            x, y = points[block + j, 0], points[block + j, 1]
            fx, fy = (x - ox) * per_mm, (y - oy) * per_mm
            inside = (fx >= 0.0) & (fx < across) & (fy >= 0.0) & (fy < across)
            fx = fx if inside else 0.0
            fy = fy if inside else 0.0
            bx, by = np.int32(fx), np.int32(fy)
            b = 2 * (by * across + bx)
            offset, depth = blocks[b], blocks[b + 1]
            count = np.int32(1) << depth
            cell = (np.int32((fy - by) * count) << depth) + np.int32((fx - bx) * count)
            known = inside & (offset >= 0)
            content = cells[offset + cell if known else 0]
            held[j] = content if known else -1
            w[_RX * _BLOCK + j] = x
            w[_RY * _BLOCK + j] = y
        for j in range(k):
            _start(w, held, pieces, j, _BLOCK)
        for j in range(k):
            _solve(w, held, pieces, j, _BLOCK, _BLOCK)
        for j in range(k):
            numbers[block + j] = w[_RU * _BLOCK + j]
        for j in range(k):
            numbers[m + 2 * (block + j)] = w[_RFX * _BLOCK + j]
            numbers[m + 2 * (block + j) + 1] = w[_RFY * _BLOCK + j]
        for j in range(k):
            numbers[3 * m + block + j] = w[_RE * _BLOCK + j]
        for j in range(k):
            numbers[4 * m + 2 * (block + j)] = w[_RNX * _BLOCK + j]
            numbers[4 * m + 2 * (block + j) + 1] = w[_RNY * _BLOCK + j]
        for j in range(k):
            numbers[6 * m + block + j] = w[_RK * _BLOCK + j]
        for j in range(k):
            vertex[block + j] = 0
        left = 0
        for j in range(k):
            left += held[_BLOCK + j]
        if left == k:
            continue
        for j in range(k):
            if held[_BLOCK + j] == 1:
                continue
            _search(points[block + j, 0], points[block + j, 1], reals, integers, best)
            i = block + j
            numbers[i] = best[0]
            numbers[m + 2 * i], numbers[m + 2 * i + 1] = best[1], best[2]
            numbers[3 * m + i] = best[3]
            numbers[4 * m + 2 * i], numbers[4 * m + 2 * i + 1] = best[4], best[5]
            numbers[6 * m + i] = best[6]
            vertex[i] = np.uint8(best[7])


@_inlined
def _start(w: Any, held: Any, pieces: Any, j: int, width: int) -> None:
    """One Halley step from the middle of the piece, where the derivatives are the coefficients."""
    row = PIECE_WIDTH * max(held[j], 0)
    rx, ry = pieces[row] - w[_RX * width + j], pieces[row + 6] - w[_RY * width + j]
    c1, d1, c2, d2 = pieces[row + 1], pieces[row + 7], pieces[row + 2], pieces[row + 8]
    c3, d3 = pieces[row + 3], pieces[row + 9]
    g = rx * c1 + ry * d1
    g1 = c1 * c1 + d1 * d1 + 2.0 * (rx * c2 + ry * d2)
    half_g2 = 3.0 * (c1 * c2 + d1 * d2 + rx * c3 + ry * d3)
    w[_RT * width + j] = -g * g1 / (g1 * g1 - g * half_g2)


@_inlined
def _solve(w: Any, held: Any, pieces: Any, j: int, width: int, states: int) -> None:
    """One Halley step from t, then a Newton step and the results; the state becomes 1 where they are proven."""
    row = PIECE_WIDTH * max(held[j], 0)
    c0, c1, c2, c3, c4, c5 = pieces[row], pieces[row + 1], pieces[row + 2], pieces[row + 3], pieces[row + 4], pieces[row + 5]
    d0, d1, d2, d3, d4, d5 = pieces[row + 6], pieces[row + 7], pieces[row + 8], pieces[row + 9], pieces[row + 10], pieces[row + 11]
    x, y = w[_RX * width + j], w[_RY * width + j]
    t = w[_RT * width + j]
    rx0, ry0 = c0 - x, d0 - y

    a4, b4 = _fma(c5, t, c4), _fma(d5, t, d4)
    a3, b3 = _fma(a4, t, c3), _fma(b4, t, d3)
    a2, b2 = _fma(a3, t, c2), _fma(b3, t, d2)
    a1, b1 = _fma(a2, t, c1), _fma(b2, t, d1)
    rx, ry = _fma(a1, t, rx0), _fma(b1, t, ry0)
    p4, q4 = _fma(c5, t, a4), _fma(d5, t, b4)
    p3, q3 = _fma(p4, t, a3), _fma(q4, t, b3)
    p2, q2 = _fma(p3, t, a2), _fma(q3, t, b2)
    vx, vy = _fma(p2, t, a1), _fma(q2, t, b1)
    s4, z4 = _fma(c5, t, p4), _fma(d5, t, q4)
    s3, z3 = _fma(s4, t, p3), _fma(z4, t, q3)
    hx, hy = _fma(s3, t, p2), _fma(z3, t, q2)  # C'' / 2
    m4, n4 = _fma(c5, t, s4), _fma(d5, t, z4)
    kx, ky = _fma(m4, t, s3), _fma(n4, t, z3)  # C''' / 6
    g = _fma(rx, vx, ry * vy)
    g1 = _fma(2.0, _fma(rx, hx, ry * hy), _fma(vx, vx, vy * vy))
    half_g2 = 3.0 * _fma(vx, hx, _fma(vy, hy, _fma(rx, kx, ry * ky)))
    t -= g * g1 / _fma(g1, g1, -g * half_g2)

    a4, b4 = _fma(c5, t, c4), _fma(d5, t, d4)
    a3, b3 = _fma(a4, t, c3), _fma(b4, t, d3)
    a2, b2 = _fma(a3, t, c2), _fma(b3, t, d2)
    a1, b1 = _fma(a2, t, c1), _fma(b2, t, d1)
    rx, ry = _fma(a1, t, rx0), _fma(b1, t, ry0)
    p4, q4 = _fma(c5, t, a4), _fma(d5, t, b4)
    p3, q3 = _fma(p4, t, a3), _fma(q4, t, b3)
    p2, q2 = _fma(p3, t, a2), _fma(q3, t, b2)
    vx, vy = _fma(p2, t, a1), _fma(q2, t, b1)
    s4, z4 = _fma(c5, t, p4), _fma(d5, t, q4)
    s3, z3 = _fma(s4, t, p3), _fma(z4, t, q3)
    hx, hy = 2.0 * _fma(s3, t, p2), 2.0 * _fma(z3, t, q2)
    g = _fma(rx, vx, ry * vy)
    g1 = _fma(rx, hx, _fma(ry, hy, _fma(vx, vx, vy * vy)))
    step = -g / g1
    t += step
    rx, ry = _fma(vx, step, rx), _fma(vy, step, ry)
    vx, vy = _fma(hx, step, vx), _fma(hy, step, vy)
    slowness = 1.0 / np.sqrt(_fma(vx, vx, vy * vy))
    nx, ny = -vy * slowness, vx * slowness
    w[_RU * width + j] = _fma(pieces[row + 13], t, pieces[row + 12])
    w[_RFX * width + j] = x + rx
    w[_RFY * width + j] = y + ry
    w[_RE * width + j] = -_fma(rx, nx, ry * ny)
    w[_RNX * width + j] = nx
    w[_RNY * width + j] = ny
    w[_RK * width + j] = (vx * hy - vy * hx) * (slowness * slowness * slowness)
    w[_RT * width + j] = t
    good = (abs(step) <= _STEP) & (g1 > 0.0) & (t >= pieces[row + 14]) & (t <= pieces[row + 15]) & (held[j] >= 0)
    held[states + j] = 1 if good else 0


# --- any place: search over the whole curve -----------------------------------------------------------------------------


@_compiled
def _search(x: float, y: float, reals: Any, integers: Any, best: Any) -> None:
    """Closest point of the whole curve by branch and bound over its pieces, into best (8,)."""
    if not (np.isfinite(x) and np.isfinite(y)):
        best[:7] = np.nan
        best[7] = 0.0
        return
    count = integers[2]
    pieces, bounds, boxes = reals[integers[3] :], reals[integers[4] :], reals[integers[5] :]
    stack = np.empty(64, dtype=np.int64)
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
            if square < least:
                least, piece, parameter = square, node - count, t
            continue
        near, far = 2 * node, 2 * node + 1
        near_distance, far_distance = _box_distance(boxes, near, x, y), _box_distance(boxes, far, x, y)
        if far_distance < near_distance:
            near, far = far, near
            far_distance = near_distance
        if far_distance <= least:
            stack[depth] = far
            depth += 1
        stack[depth] = near
        depth += 1
    _finish(x, y, piece, parameter, reals, integers, best)


@_compiled
def _box_distance(boxes: Any, node: int, x: float, y: float) -> float:
    """Square of the distance from a box of the search tree."""
    dx = max(boxes[4 * node] - x, 0.0, x - boxes[4 * node + 2])
    dy = max(boxes[4 * node + 1] - y, 0.0, y - boxes[4 * node + 3])
    return dx * dx + dy * dy


@_compiled
def _at(pieces: Any, row: int, x: float, y: float, t: float) -> tuple[float, ...]:
    """C - M, C', C'' at t."""
    rx = vx = hx = 0.0
    ry = vy = hy = 0.0
    for power in range(5, -1, -1):
        c, d = pieces[row + power], pieces[row + 6 + power]
        if power == 0:
            c, d = c - x, d - y
        hx, hy = _fma(hx, t, vx), _fma(hy, t, vy)
        vx, vy = _fma(vx, t, rx), _fma(vy, t, ry)
        rx, ry = _fma(rx, t, c), _fma(ry, t, d)
    return rx, ry, vx, vy, 2.0 * hx, 2.0 * hy


@_compiled
def _closest_on_piece(pieces: Any, bounds: Any, piece: int, x: float, y: float, least: float) -> tuple[float, float]:
    """Closest t of one piece and the square of the distance; intervals are halved until the tangential distance is monotone."""
    row = PIECE_WIDTH * piece
    fast, bend, twist = bounds[4 * piece], bounds[4 * piece + 1], bounds[4 * piece + 2]
    middles, halves = np.empty(64), np.empty(64)
    middles[0], halves[0] = 0.0, 0.5
    depth = 1
    closest = 0.0
    while depth:
        depth -= 1
        middle, half = middles[depth], halves[depth]
        rx, ry, vx, vy, hx, hy = _at(pieces, row, x, y, middle)
        distance = np.sqrt(rx * rx + ry * ry)
        nearer = distance - fast * half
        if nearer > 0.0 and nearer * nearer > least:
            continue
        slope = vx * vx + vy * vy + rx * hx + ry * hy
        change = half * (3.0 * fast * bend + (distance + fast * half) * twist)
        if slope > change or half < 1e-8:
            t, square = _monotone_root(pieces, row, x, y, middle - half, middle + half)
            if square < least:
                least, closest = square, t
        elif slope < -change:
            for t in (middle - half, middle + half):
                rx, ry, vx, vy, hx, hy = _at(pieces, row, x, y, t)
                if rx * rx + ry * ry < least:
                    least, closest = rx * rx + ry * ry, t
        else:
            for side in (-0.5, 0.5):
                middles[depth], halves[depth] = middle + side * half, 0.5 * half
                depth += 1
    return closest, least


@_compiled
def _monotone_root(pieces: Any, row: int, x: float, y: float, low: float, high: float) -> tuple[float, float]:
    """Where the tangential distance changes sign in [low, high], or the nearer end; Newton held inside its bracket."""
    rx, ry, vx, vy, hx, hy = _at(pieces, row, x, y, low)
    if rx * vx + ry * vy >= 0.0:
        return low, rx * rx + ry * ry
    rx, ry, vx, vy, hx, hy = _at(pieces, row, x, y, high)
    if rx * vx + ry * vy <= 0.0:
        return high, rx * rx + ry * ry
    t = 0.5 * (low + high)
    for _ in range(100):
        rx, ry, vx, vy, hx, hy = _at(pieces, row, x, y, t)
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
    rx, ry, vx, vy, hx, hy = _at(pieces, row, x, y, t)
    return t, rx * rx + ry * ry


@_compiled
def _finish(x: float, y: float, piece: int, t: float, reals: Any, integers: Any, best: Any) -> None:
    """Results for the foot at t of a piece: best = parameter, foot, distance, gradient, curvature, kind of vertex."""
    pieces, vertices, links = reals[integers[3] :], reals[integers[6] :], integers[integers[8] :]
    row = PIECE_WIDTH * piece
    link = 0
    if t > pieces[row + 15]:
        link = links[2 * piece + 1]
    elif t < pieces[row + 14]:
        link = links[2 * piece]
    elif t == 0.5:
        link = links[2 * piece + 1]
    elif t == -0.5:
        link = links[2 * piece]
    if link < 0:
        _finish_vertex(x, y, vertices, VERTEX_WIDTH * (-1 - link), reals[4], best)
        return
    rx, ry, vx, vy, hx, hy = _at(pieces, row, x, y, t)
    slowness = 1.0 / np.sqrt(vx * vx + vy * vy)
    nx, ny = -vy * slowness, vx * slowness
    best[0] = pieces[row + 12] + t * pieces[row + 13]
    best[1], best[2] = x + rx, y + ry
    best[3] = -(rx * nx + ry * ny)
    best[4], best[5] = nx, ny
    best[6] = (vx * hy - vy * hx) * slowness * slowness * slowness
    best[7] = 0.0


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
    best[4], best[5], best[6], best[7] = nx, ny, 0.0, vertices[row + 5]
