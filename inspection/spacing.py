"""How far apart samples may lie for a method of projection to meet an accuracy.

A point's foot lies within h/2 of its nearest sample, h the spacing. With curvature k, its change k' along the profile and
the pole radius r there, the methods' errors are bounded by (METHOD; Hu & Wallner 2005 for circles)

    circle       |k'| h^3 / 48, and |jump of k| h^2 / 8 beside a knot where the curvature jumps
    chord        |k| h^2 / 8
    pcp, veaw    (3/8) |1/r - k| h^2 + (1/2) |k'| h^3, and d (1/r - k)^2 h^2 / 8 at the distance d from the profile
    hermite      |k'' - k^3| h^4 / 384, and |jump of k'| h^3 / 192 and |jump of k| h^2 / 61.9 beside a knot: the largest errors of a
                 cubic Hermite piece for a fourth derivative of 1, and for a third or second one that jumps by 1 at any place of it

They presume that the nearest sample lies on the branch of the foot. The spacing therefore stays below the smaller pole radius,
so that this holds for points nearer than half of it; a thin edge wants dense samples. `exact` and `inversion` solve on the
curve itself, so that no spacing limits their accuracy.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inspection.curve import NurbsCurve, left_limit
from inspection.methods import Method

Array = NDArray[np.float64]

_GRID_PER_SPAN = 64
_FEWEST = 64  # samples of a whole profile, however flat
_TURN = 0.25  # rad; largest turn from one sample to the next, so that the leading terms of the bounds hold
_SAFETY = 0.7  # of the accuracy; the rest is room for uneven steps and for the terms that the bounds leave out
_SLOPE = 0.15  # mm by which the step may grow per mm of arc length
_NO_JUMP = 1e-9  # of the curvature (1/mm) or of its change by arc length: round-off
_FINEST = 1e-5  # of the length; without it a sharp edge would ask for ever shorter steps


@dataclass(frozen=True, slots=True, eq=False)
class LocalPoles:
    """What a spacing must know of the poles at g places.

    radius_mm  : (g,) smaller of the two pole radii
    pole_error : (g,) error of a pole circle per h^2, in 1/mm, for points no farther off than d. With K = |1/r - k| it is
                 (3/8) K + d K^2 / 8 of the side on which that is larger
    """

    radius_mm: Array
    pole_error: Array


def space_out(
    curve: NurbsCurve, low: float, high: float, accuracy_mm: float, method: Method, poles: Callable[[Array], LocalPoles]
) -> Array:
    """The fewest rising parameters from low to high of one smooth piece that meet the accuracy.

    `poles(u)` gives the local poles at parameters u.
    """
    u = _grid(curve, low, high)
    station = np.concatenate([[0.0], np.cumsum(np.abs(_steps_mm(curve, u)))])
    limit = _largest_step_mm(curve, u, accuracy_mm, method, poles)
    for step in _steps_beside_jumps(curve, u, accuracy_mm, method):
        limit = np.minimum(limit, _near_by(step, station))
    limit = np.minimum(np.maximum(_smooth_limits(limit, station), _FINEST * curve.length_mm), curve.length_mm / _FEWEST)
    count = np.concatenate([[0.0], np.cumsum(np.diff(station) * (1 / limit[1:] + 1 / limit[:-1]) / 2)])
    steps = max(2, int(np.ceil(count[-1])))
    even = np.interp(np.linspace(0.0, count[-1], steps + 1), count, u)
    even[[0, -1]] = low, high
    return even


def _grid(curve: NurbsCurve, low: float, high: float) -> Array:
    """Parameters (g,) that resolve every knot span between low and high; high may lie past the seam."""
    start, end = curve.domain
    knots = np.unique(np.concatenate([curve.knots, curve.knots + (end - start)]))
    borders = np.concatenate([[low], knots[(knots > low) & (knots < high)], [high]])
    inner = np.linspace(borders[:-1], borders[1:], _GRID_PER_SPAN, endpoint=False).T.ravel()
    return np.append(inner, high)


def _steps_mm(curve: NurbsCurve, u: Array) -> Array:
    """Distances (g - 1,) between neighbouring places."""
    points = curve.point(np.minimum(u, curve.domain[1]) if not curve.closed else u)
    return np.asarray(np.hypot(*np.diff(points, axis=0).T))


def curvature_and_change(curve: NurbsCurve, u: Array) -> tuple[Array, Array]:
    """Signed curvature k (m,) and its derivative by arc length k' (m,)."""
    _, first, second, third = curve.derivatives(u, 3)
    speed = np.hypot(first[:, 0], first[:, 1])
    bend = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
    bend_change = first[:, 0] * third[:, 1] - first[:, 1] * third[:, 0]
    stretch = (first * second).sum(axis=1)
    return bend / speed**3, (bend_change / speed**3 - 3 * bend * stretch / speed**5) / speed


def _largest_step_mm(curve: NurbsCurve, u: Array, accuracy_mm: float, method: Method, poles: Callable[[Array], LocalPoles]) -> Array:
    """The largest step (g,) that meets the accuracy at each place by the bounds of the method, neighbours disregarded."""
    before, after = curvature_and_change(curve, left_limit(_wrap(u, curve), curve)), curvature_and_change(curve, u)
    k, change = (np.maximum(np.abs(a), np.abs(b)) for a, b in zip(before, after, strict=True))  # both sides of every knot
    tau = _SAFETY * accuracy_mm
    tiny = np.finfo(float).tiny
    limit = _TURN / np.maximum(k, tiny)
    if method in ("exact", "inversion"):
        return limit
    local = poles(u)
    limit = np.minimum(limit, local.radius_mm)
    if method == "circle":
        return np.minimum(limit, np.cbrt(48 * tau / np.maximum(change, tiny)))
    if method == "hermite":
        return np.minimum(limit, (384 * tau / np.maximum(_fourth_derivative(curve, u), tiny)) ** 0.25)
    if method == "chord":
        return np.minimum(limit, np.sqrt(8 * tau / np.maximum(k, tiny)))
    return np.minimum(limit, np.minimum(np.sqrt(tau / (2 * np.maximum(local.pole_error, tiny))), np.cbrt(tau / np.maximum(change, tiny))))


def _wrap(u: Array, curve: NurbsCurve) -> Array:
    """Parameters (g,) brought back into the domain of a closed curve."""
    start, end = curve.domain
    return np.where(u > end, u - (end - start), u) if curve.closed else u


def _fourth_derivative(curve: NurbsCurve, u: Array) -> Array:
    """|k'' - k^3| (g,): the part across the curve of its fourth derivative by arc length, the larger of both sides of a knot."""
    wrapped = _wrap(u, curve)
    sides = []
    for at in (left_limit(wrapped, curve), wrapped):
        _, first, second, third, fourth = curve.derivatives(at, 4)
        speed2 = (first * first).sum(axis=1)
        bend, bend_1 = _cross(first, second), _cross(first, third)  # with its derivatives by the parameter
        bend_2 = _cross(second, third) + _cross(first, fourth)
        stretch = (first * second).sum(axis=1)
        stretch_1 = (second * second).sum(axis=1) + (first * third).sum(axis=1)
        k_1 = bend_1 / speed2**1.5 - 3 * bend * stretch / speed2**2.5
        k_2 = bend_2 / speed2**1.5 - 3 * (2 * bend_1 * stretch + bend * stretch_1) / speed2**2.5 + 15 * bend * stretch**2 / speed2**3.5
        sides.append(np.abs((k_2 - k_1 * stretch / speed2) / speed2 - (bend / speed2**1.5) ** 3))
    return np.asarray(np.maximum(*sides))


def _cross(a: Array, b: Array) -> Array:
    """The third component (g,) of the vector product, row by row."""
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]


def _steps_beside_jumps(curve: NurbsCurve, u: Array, accuracy_mm: float, method: Method) -> list[Array]:
    """The largest steps (g,) across a knot where the curvature or its change jumps; infinite where there is none, or it does not count."""
    if method not in ("circle", "hermite"):
        return []
    wrapped, tau = _wrap(u, curve), _SAFETY * accuracy_mm
    jumps = [
        np.abs(here - before)
        for here, before in zip(curvature_and_change(curve, wrapped), curvature_and_change(curve, left_limit(wrapped, curve)), strict=True)
    ]
    for jump in jumps:
        jump[[0, -1]] = jump[[0, -1]] if curve.closed and not curve.corners.size else 0.0
    bend, change = (np.where(jump > _NO_JUMP, jump, 0.0) for jump in jumps)
    with np.errstate(divide="ignore"):
        if method == "circle":  # the circle of one side is used on the other
            return [np.sqrt(8 * tau / bend)]
        return [np.sqrt(61.9 * tau / bend), np.cbrt(192 * tau / change)]


def _near_by(step: Array, station: Array) -> Array:
    """Limits (g,): each step that is finite holds as far as a step that crosses its place can begin or end."""
    limit = np.full(len(step), np.inf)
    for index in np.flatnonzero(np.isfinite(step)):
        near = np.abs(station - station[index]) <= 1.5 * step[index]
        limit[near] = np.minimum(limit[near], step[index])
    return limit


def _smooth_limits(limit: Array, station: Array) -> Array:
    """The limits (g,), each reduced to what its neighbours allow, so that no step leaps over a place that needs a shorter one."""
    result = limit.copy()
    for index in range(1, len(result)):
        result[index] = min(result[index], result[index - 1] + _SLOPE * (station[index] - station[index - 1]))
    for index in range(len(result) - 2, -1, -1):
        result[index] = min(result[index], result[index + 1] + _SLOPE * (station[index + 1] - station[index]))
    return result
