"""The closest point of one polynomial piece to a place, wherever it lies.

Where the square of the distance is certified to be convex on the piece, Newton's method held in the piece finds its only minimum. Else
the piece is halved again and again until it is convex there, or holds nothing closer than what was found by more than round-off: near a
centre of curvature a whole stretch is equally close. The answer depends on place and piece alone, never on what is known of others.
"""

from typing import Any

import numpy as np

from inspection.kernels.compiling import fma, inlined_uncounted_kernel, uncounted_kernel
from inspection.kernels.surfaces.layout import (
    COEFFICIENTS,
    HALF,
    M01,
    M02,
    M03,
    M10,
    M11,
    M12,
    M20,
    M21,
    M30,
    RECTANGLE_WIDTH,
    SCRATCH,
    WIDTH_CUBIC,
    WIDTH_QUINTIC,
)

_NEWTON_STEPS, _HALVINGS = 60, 40
_FINEST = 1e-8  # half a side of a rectangle that is taken for a point
_CONVEX = 0.02  # part of the metric that curvature must leave over
_DETERMINANT = 0.9
_AS_NEAR = 2e-10  # times the distance: what a square must be less by to be looked for; 1e-10 mm of distance
_MANY, _MORE = 4096, 128  # rectangles after which what is ten times less near will do, and again: at the middle of a sphere
_ROOM = 1.0 + 1e-9  # for the round-off of bounds
# By how much a derivative of a piece may differ from that of its face: a quintic may miss it by 0.2 grains, and its derivative, by Markov's
# inequality, by 50 times that; and of the coordinates, which are rounded, the fit makes some hundred times their round-off.
_MISSED_GRAINS, _ROUNDED = 100.0, 1e-12
_STILL_MM = 1e-12  # a step after which nothing changes; in mm, since the round-off of s and t grows as a piece gets narrower
_UPHILL, _UPHILL_MM2 = 1.0 + 1e-12, 1e-24  # by less a square of a distance grows through round-off alone


@inlined_uncounted_kernel
def _derivatives(rows: Any, first: int, width: int, s: float, t: float) -> tuple[float, ...]:
    """Value of one coordinate and its derivatives by s, t, ss, st, tt, by Horner's rule in both directions."""
    f = fs = fss = ft = fst = ftt = 0.0
    for i in range(width - 1, -1, -1):
        a = b = c = 0.0
        for j in range(width - 1, -1, -1):
            c, b, a = fma(c, t, b), fma(b, t, a), fma(a, t, rows[first + i * width + j])
        fss, fs, f = fma(fss, s, fs), fma(fs, s, f), fma(f, s, a)
        fst, ft = fma(fst, s, ft), fma(ft, s, b)
        ftt = fma(ftt, s, c)
    return f, fs, ft, 2.0 * fss, fst, 2.0 * ftt


@uncounted_kernel
def piece_at(rows: Any, row: int, width: int, s: float, t: float) -> tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]:
    """Value and derivatives by s, t, ss, st, tt of x, y and z at a place of a piece."""
    first = row + COEFFICIENTS
    if width == WIDTH_CUBIC:
        x = _derivatives(rows, first, WIDTH_CUBIC, s, t)
        y = _derivatives(rows, first + WIDTH_CUBIC * WIDTH_CUBIC, WIDTH_CUBIC, s, t)
        z = _derivatives(rows, first + 2 * WIDTH_CUBIC * WIDTH_CUBIC, WIDTH_CUBIC, s, t)
    else:
        x = _derivatives(rows, first, WIDTH_QUINTIC, s, t)
        y = _derivatives(rows, first + WIDTH_QUINTIC * WIDTH_QUINTIC, WIDTH_QUINTIC, s, t)
        z = _derivatives(rows, first + 2 * WIDTH_QUINTIC * WIDTH_QUINTIC, WIDTH_QUINTIC, s, t)
    return x, y, z


@inlined_uncounted_kernel
def piece_in_middle(rows: Any, row: int, width: int) -> tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]:
    """What `piece_at` gives at (0, 0), where the coefficients are the derivatives."""
    first, size = row + COEFFICIENTS, width * width
    return _of_middle(rows, first, width), _of_middle(rows, first + size, width), _of_middle(rows, first + 2 * size, width)


@inlined_uncounted_kernel
def _of_middle(rows: Any, first: int, width: int) -> tuple[float, ...]:
    return rows[first], rows[first + width], rows[first + 1], 2.0 * rows[first + 2 * width], rows[first + width + 1], 2.0 * rows[first + 2]


@uncounted_kernel
def square_at(
    rows: Any, row: int, width: int, x: float, y: float, z: float, s: float, t: float
) -> tuple[float, float, float, float, float, float]:
    """Square of the distance, half its gradient (2), and half its Hessian (ss, st, tt)."""
    px, py, pz = piece_at(rows, row, width, s, t)
    return square_of(px, py, pz, x, y, z)


@inlined_uncounted_kernel
def square_of(px: Any, py: Any, pz: Any, x: float, y: float, z: float) -> tuple[float, float, float, float, float, float]:
    """The same from what `piece_at` gives."""
    rx, ry, rz = px[0] - x, py[0] - y, pz[0] - z
    g = rx * px[1] + ry * py[1] + rz * pz[1]
    h = rx * px[2] + ry * py[2] + rz * pz[2]
    a = px[1] * px[1] + py[1] * py[1] + pz[1] * pz[1] + rx * px[3] + ry * py[3] + rz * pz[3]
    b = px[1] * px[2] + py[1] * py[2] + pz[1] * pz[2] + rx * px[4] + ry * py[4] + rz * pz[4]
    c = px[2] * px[2] + py[2] * py[2] + pz[2] * pz[2] + rx * px[5] + ry * py[5] + rz * pz[5]
    return rx * rx + ry * ry + rz * rz, g, h, a, b, c


@inlined_uncounted_kernel
def dot(px: Any, py: Any, pz: Any, one: int, other: int) -> float:
    """The scalar product of two of the derivatives that `piece_at` gives."""
    return float(px[one] * px[other] + py[one] * py[other] + pz[one] * pz[other])


@inlined_uncounted_kernel
def beyond_first_order(rows: Any, row: int, hs: float, ht: float) -> tuple[float, float, float]:
    """By how much S, S_s and S_t may differ from what their derivatives in the middle of a rectangle of half sides hs and ht say."""
    ss, st, tt = 0.5 * hs * hs, hs * ht, 0.5 * ht * ht
    far = rows[row + M20] * ss + rows[row + M11] * st + rows[row + M02] * tt
    far_u = rows[row + M30] * ss + rows[row + M21] * st + rows[row + M12] * tt
    far_v = rows[row + M21] * ss + rows[row + M12] * st + rows[row + M03] * tt
    return far, far_u, far_v


@uncounted_kernel
def may_have_foot(rows: Any, row: int, width: int, x: float, y: float, z: float, radius: float, grain_mm: float) -> bool:
    """Whether the gradient of the distance may vanish on a piece for a place within a radius: no part of it keeps its sign.

    It vanishes at the closest point of the face, from which the piece differs by round-off and by what it misses: room is left for more
    than their derivatives can come to, so that the piece with the closest point of a smooth net is never told to have none.
    """
    px, py, pz = piece_in_middle(rows, row, width)
    square, g, h, a, b, c = square_of(px, py, pz, x, y, z)
    su, sv, distance = np.sqrt(dot(px, py, pz, 1, 1)), np.sqrt(dot(px, py, pz, 2, 2)), np.sqrt(square)
    far, far_u, far_v = beyond_first_order(rows, row, HALF, HALF)
    far, reach = far + radius, distance + (su + sv) * HALF
    du, dv = (rows[row + M20] + rows[row + M11]) * HALF, (rows[row + M11] + rows[row + M02]) * HALF
    st_s, st_t = abs(dot(px, py, pz, 1, 4)), abs(dot(px, py, pz, 2, 4))
    twice_s = abs(dot(px, py, pz, 1, 3)) + st_s + abs(dot(px, py, pz, 2, 3)) + st_t
    twice_t = abs(dot(px, py, pz, 2, 5)) + st_t + abs(dot(px, py, pz, 1, 5)) + st_s
    along_s = (abs(a) + abs(b)) * HALF + twice_s * HALF * HALF + reach * far_u + far * (su + du)
    along_t = (abs(b) + abs(c)) * HALF + twice_t * HALF * HALF + reach * far_v + far * (sv + dv)
    room = (reach + radius) * (_MISSED_GRAINS * grain_mm + _ROUNDED * (abs(px[0]) + abs(py[0]) + abs(pz[0])))
    return bool(abs(g) <= along_s * _ROOM + room and abs(h) <= along_t * _ROOM + room)


@uncounted_kernel
def bent_at(
    rows: Any, row: int, width: int, x: float, y: float, z: float, s: float, t: float, hs: float, ht: float, off: float
) -> tuple[float, float, float, float, float, float, float, float, float, float, float]:
    """What `square_at` gives, bounds of half the Hessian over a rectangle of half sides hs and ht, and the squares of S_s and S_t.

    The bounds are the least of ss, the greatest size of st, and the least of tt. What changes by first order is known along each side; for
    what is of higher order the bounds of the piece are taken.

    off : by how much the place may move
    """
    px, py, pz = piece_at(rows, row, width, s, t)
    rx, ry, rz = px[0] - x, py[0] - y, pz[0] - z
    square = rx * rx + ry * ry + rz * rz
    e, k, st_s = dot(px, py, pz, 1, 1), dot(px, py, pz, 2, 2), abs(dot(px, py, pz, 1, 4))
    ss_s, ss_t, st_t = abs(dot(px, py, pz, 1, 3)), abs(dot(px, py, pz, 2, 3)), abs(dot(px, py, pz, 2, 4))
    tt_s, tt_t = abs(dot(px, py, pz, 1, 5)), abs(dot(px, py, pz, 2, 5))
    distance, su, sv = np.sqrt(square), np.sqrt(e), np.sqrt(k)
    suu, suv, svv = np.sqrt(dot(px, py, pz, 3, 3)), np.sqrt(dot(px, py, pz, 4, 4)), np.sqrt(dot(px, py, pz, 5, 5))
    far, far_u, far_v = beyond_first_order(rows, row, hs, ht)
    far += off
    du, dv = rows[row + M20] * hs + rows[row + M11] * ht, rows[row + M11] * hs + rows[row + M02] * ht
    reach = distance + rows[row + M10] * hs + rows[row + M01] * ht + off
    da, db = rows[row + M30] * hs + rows[row + M21] * ht, rows[row + M21] * hs + rows[row + M12] * ht
    dc = rows[row + M12] * hs + rows[row + M03] * ht
    stray_a = 3.0 * ss_s * hs + (2.0 * st_s + ss_t) * ht + 2.0 * su * far_u + suu * far + reach * da
    stray_b = (2.0 * st_s + ss_t) * hs + (2.0 * st_t + tt_s) * ht + su * far_v + sv * far_u + du * dv + suv * far + reach * db
    stray_c = 3.0 * tt_t * ht + (2.0 * st_t + tt_s) * hs + 2.0 * sv * far_v + svv * far + reach * dc
    g, h = rx * px[1] + ry * py[1] + rz * pz[1], rx * px[2] + ry * py[2] + rz * pz[2]
    a = e + rx * px[3] + ry * py[3] + rz * pz[3]
    b = dot(px, py, pz, 1, 2) + rx * px[4] + ry * py[4] + rz * pz[4]
    c = k + rx * px[5] + ry * py[5] + rz * pz[5]
    return square, g, h, a, b, c, a - stray_a, abs(b) + stray_b, c - stray_c, e, k


@uncounted_kernel
def closest_on_piece(rows: Any, row: int, width: int, x: float, y: float, z: float, memory: Any) -> tuple[float, float, float]:
    """Square of the distance of the closest point of a piece, and where it is, (s, t).

    memory : (PIECE_SCRATCH,) whose end holds the rectangles that wait
    """
    best, best_s, best_t = np.inf, 0.0, 0.0
    at = SCRATCH
    memory[at], memory[at + 1], memory[at + 2], memory[at + 3] = 0.0, 0.0, HALF, HALF
    waiting, looked_at, as_near = 1, 0, _AS_NEAR
    while waiting:
        waiting, looked_at = waiting - 1, looked_at + 1
        if looked_at > _MANY and looked_at % _MORE == 0:
            as_near *= 10.0
        at = SCRATCH + RECTANGLE_WIDTH * waiting
        s, t, hs, ht = memory[at], memory[at + 1], memory[at + 2], memory[at + 3]
        square, g, h, a, b, c, low_a, high_b, low_c, e, k = bent_at(rows, row, width, x, y, z, s, t, hs, ht, 0.0)
        if square < best:
            best, best_s, best_t = square, s, t
        distance = np.sqrt(square)
        wanted = best - as_near * np.sqrt(best)
        nearest = max(distance - rows[row + M10] * hs - rows[row + M01] * ht, 0.0)
        if nearest * nearest > wanted:
            continue
        if low_a > _CONVEX * e and low_c > _CONVEX * k and _DETERMINANT * low_a * low_c > high_b * high_b:
            found, fs, ft = _newton(rows, row, width, x, y, z, s, t, hs, ht, (square, g, h, a, b, c))
            if found < best:
                best, best_s, best_t = found, fs, ft
            continue
        down_s, down_t = s + _downhill(g, a, hs), t + _downhill(h, c, ht)
        lower = square_at(rows, row, width, x, y, z, down_s, down_t)[0]
        if lower < best:
            best, best_s, best_t = lower, down_s, down_t
        gain = _gain(g, low_a, hs) + _gain(h, low_c, ht) + 2.0 * high_b * hs * ht
        if square - gain > wanted or max(hs, ht) < _FINEST:
            continue
        across_s = rows[row + M10] * hs >= rows[row + M01] * ht  # the longer side: how far things stray grows with either
        waiting = _halve(memory, waiting, s, t, hs, ht, g if across_s else h, across_s)
    return best, best_s, best_t


@inlined_uncounted_kernel
def _downhill(gradient: float, bend: float, half: float) -> float:
    """The step to where g x + b x^2 / 2 is least within half a side."""
    if bend * half > abs(gradient):
        return -gradient / bend
    return -half if gradient > 0.0 else half


@inlined_uncounted_kernel
def _gain(gradient: float, bend: float, half: float) -> float:
    """By how much g x + b x^2 / 2 can fall, doubled, within half a side of its middle, for a gradient g and a bend that is b at least."""
    if bend * half > abs(gradient):
        return gradient * gradient / bend
    return 2.0 * abs(gradient) * half - bend * half * half


@inlined_uncounted_kernel
def _halve(memory: Any, waiting: int, s: float, t: float, hs: float, ht: float, gradient: float, across_s: bool) -> int:
    """Put the halves of a rectangle on the stack, on top the one that lies downhill. Each halving adds one, and there are few."""
    half_s, half_t = (0.5 * hs, ht) if across_s else (hs, 0.5 * ht)
    step_s, step_t = (half_s, 0.0) if across_s else (0.0, half_t)
    down = -1.0 if gradient > 0.0 else 1.0
    for i in range(2):
        at = SCRATCH + RECTANGLE_WIDTH * (waiting + i)
        towards = down if i else -down
        memory[at], memory[at + 1] = s + towards * step_s, t + towards * step_t
        memory[at + 2], memory[at + 3] = half_s, half_t
    return waiting + 2


@uncounted_kernel
def _newton(
    rows: Any,
    row: int,
    width: int,
    x: float,
    y: float,
    z: float,
    middle_s: float,
    middle_t: float,
    hs: float,
    ht: float,
    there: tuple[float, float, float, float, float, float],
) -> tuple[float, float, float]:
    """The minimum over a rectangle on which the square of the distance is convex, by Newton's method with the sides as walls.

    A side holds while the gradient pushes against it. A step that leads uphill is halved.

    there : what `square_at` gives in the middle, the first six of it
    """
    low_s, high_s, low_t, high_t = middle_s - hs, middle_s + hs, middle_t - ht, middle_t + ht
    s, t = middle_s, middle_t
    square, g, h, a, b, c = there
    for _ in range(_NEWTON_STEPS):
        held_s = (s <= low_s and g > 0.0) or (s >= high_s and g < 0.0)
        held_t = (t <= low_t and h > 0.0) or (t >= high_t and h < 0.0)
        if held_s and held_t:
            break
        if held_s:
            ds, dt = 0.0, -h / c
        elif held_t:
            ds, dt = -g / a, 0.0
        else:
            per = 1.0 / (a * c - b * b)
            ds, dt = (b * h - c * g) * per, (b * g - a * h) * per
            if not (low_s <= s + ds <= high_s):  # stop at the wall, and go on along it
                ds = min(max(s + ds, low_s), high_s) - s
                dt = -(h + b * ds) / c
            if not (low_t <= t + dt <= high_t):
                dt = min(max(t + dt, low_t), high_t) - t
                ds = -(g + b * dt) / a
        following_s, following_t = min(max(s + ds, low_s), high_s), min(max(t + dt, low_t), high_t)
        if abs(following_s - s) * rows[row + M10] <= _STILL_MM and abs(following_t - t) * rows[row + M01] <= _STILL_MM:
            break
        found, g_there, h_there, a_there, b_there, c_there = square_at(rows, row, width, x, y, z, following_s, following_t)
        halvings = 0
        while found > square * _UPHILL + _UPHILL_MM2 and halvings < _HALVINGS:
            following_s, following_t = 0.5 * (s + following_s), 0.5 * (t + following_t)
            found, g_there, h_there, a_there, b_there, c_there = square_at(rows, row, width, x, y, z, following_s, following_t)
            halvings += 1
        s, t, square, g, h, a, b, c = following_s, following_t, found, g_there, h_there, a_there, b_there, c_there
    return square, s, t
