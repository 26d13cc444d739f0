"""The closest point of the whole curve to one place, wherever it lies: branch and bound over the pieces."""

from typing import Any

import numpy as np

from inspection.kernels.compiling import INTEGER_ARRAY, REAL, REAL_ARRAY, REAL_TABLE, SHORT_TABLE, call_of, fma, inner_kernel
from inspection.kernels.layout import (
    BOUND_WIDTH,
    BOUNDS_AT,
    BOX_HIGH_X,
    BOX_HIGH_Y,
    BOX_LOW_X,
    BOX_LOW_Y,
    BOX_WIDTH,
    BOXES_AT,
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
    LAST_PARAMETER,
    LEAVES,
    LENGTH_MM,
    LINKS_AT,
    PIECE_AFTER,
    PIECE_BEFORE,
    PIECE_DEGREE,
    PIECE_END,
    PIECE_FIRST,
    PIECE_LAST,
    PIECE_LINKS,
    PIECE_STATION,
    PIECE_U,
    PIECE_U_PER_T,
    PIECE_WIDTH,
    PIECE_X,
    PIECE_Y,
    PIECES_AT,
    STATION_DEGREE,
    VERTEX_KIND,
    VERTEX_NORMAL_X,
    VERTEX_NORMAL_Y,
    VERTEX_STATION,
    VERTEX_U,
    VERTEX_WIDTH,
    VERTEX_X,
    VERTEX_Y,
    VERTICES_AT,
)

_FINEST = 26  # halvings of a piece, after which an interval is a point
_FIRST: Any = np.int64(0)  # not a literal: it has a type of its own, for which what it is given to is compiled once more
SEARCH = (REAL, REAL, REAL_TABLE, SHORT_TABLE, REAL_ARRAY, INTEGER_ARRAY)  # the types that `search_curve` takes
call_search = call_of(*SEARCH)


@inner_kernel
def search_curve(x: float, y: float, reals: Any, integers: Any, foot: Any, stack: Any) -> None:
    """Find the closest point of the whole curve by branch and bound over its pieces, and write it into foot (FOOT_WIDTH,)."""
    if not (np.isfinite(x) and np.isfinite(y)):
        foot[:] = np.nan
        foot[FOOT_VERTEX] = INSIDE
        return
    count = integers[LEAVES]
    pieces, bounds, boxes = reals[integers[PIECES_AT] :], reals[integers[BOUNDS_AT] :], reals[integers[BOXES_AT] :]
    stack[0] = 1
    depth = 1
    least, piece, parameter = np.inf, _FIRST, 0.0
    while depth:
        depth -= 1
        node = stack[depth]
        if box_distance(boxes, node, x, y) > least:
            continue
        if node >= count:
            t, square = _closest_on_piece(pieces, bounds, node - count, x, y, least)
            if square < least or (square == least and node - count < piece):
                least, piece, parameter = square, node - count, t
            continue
        near = 2 * node
        if box_distance(boxes, near + 1, x, y) < box_distance(boxes, near, x, y):
            near += 1
        stack[depth], stack[depth + 1] = near ^ 1, near
        depth += 2
    _finish_foot(x, y, piece, parameter, reals, integers, foot)


@inner_kernel
def box_distance(boxes: Any, node: int, x: float, y: float) -> float:
    """Square of the distance from a box of the search tree."""
    dx = max(boxes[BOX_WIDTH * node + BOX_LOW_X] - x, 0.0, x - boxes[BOX_WIDTH * node + BOX_HIGH_X])
    dy = max(boxes[BOX_WIDTH * node + BOX_LOW_Y] - y, 0.0, y - boxes[BOX_WIDTH * node + BOX_HIGH_Y])
    return float(dx * dx + dy * dy)


@inner_kernel
def derivatives_at(pieces: Any, row: int, x: float, y: float, t: float) -> tuple[float, ...]:
    """C - M and its first three derivatives at t, C being the piece and M the place."""
    rx = vx = hx = kx = 0.0
    ry = vy = hy = ky = 0.0
    for power in range(PIECE_DEGREE, -1, -1):
        c, d = pieces[row + PIECE_X + power], pieces[row + PIECE_Y + power]
        if power == 0:
            c, d = c - x, d - y
        kx, ky = fma(kx, t, hx), fma(ky, t, hy)
        hx, hy = fma(hx, t, vx), fma(hy, t, vy)
        vx, vy = fma(vx, t, rx), fma(vy, t, ry)
        rx, ry = fma(rx, t, c), fma(ry, t, d)
    return rx, ry, vx, vy, 2.0 * hx, 2.0 * hy, 6.0 * kx, 6.0 * ky


@inner_kernel
def _closest_on_piece(pieces: Any, bounds: Any, piece: int, x: float, y: float, least: float) -> tuple[float, float]:
    """Closest t of one piece and the square of the distance, infinite when certainly above `least`.

    Intervals are halved until the tangential distance is monotone in them, or until no point of them can be closer than
    their middle by more than round-off: near a centre of curvature a whole stretch is equally close.
    """
    row, bounds_at = PIECE_WIDTH * piece, BOUND_WIDTH * piece
    fast, bend, twist, fourth = bounds[bounds_at], bounds[bounds_at + 1], bounds[bounds_at + 2], bounds[bounds_at + 3]
    closest, square_least = 0.0, np.inf
    level, place = 0, 0  # the interval of number `place` of 2 ** level
    while True:
        half = PIECE_END / (1 << level)
        middle = (2 * place + 1) * half - PIECE_END
        rx, ry, vx, vy, hx, hy, kx, ky = derivatives_at(pieces, row, x, y, middle)
        square = rx * rx + ry * ry
        if square < square_least:
            square_least, closest = square, middle
            least = min(least, square)
        distance = np.sqrt(square)
        # The tangential distance is f = (C - M) . C'. By Leibniz f' (`slope`) = |C'|^2 + (C - M) . C'', and its next derivatives are
        # 3 C' . C'' + (C - M) . C''' and 3 |C''|^2 + 4 C' . C''' + (C - M) . C'''': of the last, `bound` is one over the interval.
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


@inner_kernel
def _end_distance(pieces: Any, row: int, x: float, y: float, t: float) -> tuple[float, float]:
    rx, ry, _, _, _, _, _, _ = derivatives_at(pieces, row, x, y, t)
    return t, rx * rx + ry * ry


@inner_kernel
def _monotone_root(pieces: Any, row: int, x: float, y: float, low: float, high: float) -> tuple[float, float]:
    """Where the tangential distance changes sign in [low, high], or the nearer end; Newton held inside its bracket."""
    rx, ry, vx, vy, hx, hy, _, _ = derivatives_at(pieces, row, x, y, low)
    if rx * vx + ry * vy >= 0.0:
        return low, rx * rx + ry * ry
    rx, ry, vx, vy, hx, hy, _, _ = derivatives_at(pieces, row, x, y, high)
    if rx * vx + ry * vy <= 0.0:
        return high, rx * rx + ry * ry
    t = 0.5 * (low + high)
    for _ in range(100):
        rx, ry, vx, vy, hx, hy, _, _ = derivatives_at(pieces, row, x, y, t)
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
    rx, ry, vx, vy, hx, hy, _, _ = derivatives_at(pieces, row, x, y, t)
    return t, rx * rx + ry * ry


@inner_kernel
def _finish_foot(x: float, y: float, piece: int, t: float, reals: Any, integers: Any, foot: Any) -> None:
    """Fill in the results for the foot at t of a piece, or for the vertex at its end."""
    pieces, vertices, links = reals[integers[PIECES_AT] :], reals[integers[VERTICES_AT] :], integers[integers[LINKS_AT] :]
    row = PIECE_WIDTH * piece
    rx, ry, vx, vy, hx, hy, _, _ = derivatives_at(pieces, row, x, y, t)
    if abs(t) == PIECE_END:
        link = links[PIECE_LINKS * piece + (PIECE_AFTER if t > 0.0 else PIECE_BEFORE)]
        slope = vx * vx + vy * vy + rx * hx + ry * hy
        wanted = t - (rx * vx + ry * vy) / slope if slope > 0.0 else 2.0 * t
        if link < 0 and not (pieces[row + PIECE_FIRST] <= wanted <= pieces[row + PIECE_LAST]):
            finish_vertex(x, y, vertices, VERTEX_WIDTH * (-1 - link), reals[GRAIN_MM], foot)
            return
    slowness = 1.0 / np.sqrt(vx * vx + vy * vy)
    nx, ny = -vy * slowness, vx * slowness
    foot[FOOT_U] = min(max(fma(pieces[row + PIECE_U_PER_T], t, pieces[row + PIECE_U]), reals[FIRST_PARAMETER]), reals[LAST_PARAMETER])
    foot[FOOT_X], foot[FOOT_Y] = x + rx, y + ry
    foot[FOOT_DISTANCE] = np.copysign(np.sqrt(rx * rx + ry * ry), -(rx * nx + ry * ny))
    foot[FOOT_GRADIENT_X], foot[FOOT_GRADIENT_Y] = nx, ny
    foot[FOOT_CURVATURE] = (vx * hy - vy * hx) * slowness * slowness * slowness
    foot[FOOT_VERTEX] = INSIDE
    s = 0.0
    for power in range(STATION_DEGREE, -1, -1):
        s = fma(s, t, pieces[row + PIECE_STATION + power])
    foot[FOOT_STATION] = min(max(s, 0.0), reals[LENGTH_MM])


@inner_kernel
def finish_vertex(x: float, y: float, vertices: Any, row: int, grain: float, foot: Any) -> None:
    """Fill in the results for a vertex as the foot. The distance is signed by the side of its pseudo-normal on which the place lies."""
    dx, dy = x - vertices[row + VERTEX_X], y - vertices[row + VERTEX_Y]
    nx, ny = vertices[row + VERTEX_NORMAL_X], vertices[row + VERTEX_NORMAL_Y]
    distance = np.sqrt(dx * dx + dy * dy)
    sign = 1.0 if dx * nx + dy * ny >= 0.0 else -1.0
    foot[FOOT_U], foot[FOOT_X], foot[FOOT_Y] = vertices[row + VERTEX_U], vertices[row + VERTEX_X], vertices[row + VERTEX_Y]
    foot[FOOT_DISTANCE] = sign * distance
    if distance > grain:
        nx, ny = sign * dx / distance, sign * dy / distance
    foot[FOOT_GRADIENT_X], foot[FOOT_GRADIENT_Y], foot[FOOT_CURVATURE] = nx, ny, 0.0
    foot[FOOT_VERTEX], foot[FOOT_STATION] = vertices[row + VERTEX_KIND], vertices[row + VERTEX_STATION]
