"""The truth for projection: the globally closest point of a curve by branch and bound, then bracketed root finding.

It shares nothing with the inspection but `NurbsCurve.derivatives`, which test_curve holds against exact arithmetic.
Every knot span is cut into intervals; an interval is dropped only when even a straight run from its middle at 1.2 times
its largest sampled speed could not come closer than the best point seen. What is left, 2 um long, is searched for changes
of sign of the tangential component, each followed to the last digit. Interval ends, curve ends and corners are candidates too.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from inspection import NurbsCurve

Array = NDArray[np.float64]
Index = NDArray[np.int64]


@dataclass(frozen=True)
class Closest:
    """Closest points of a curve to m points.

    left_mm    : (m,) distance, positive to the left of the direction of travel
    foot_mm    : (m, 2)
    parameter  : (m,)
    beyond_end : (m,) the closest point is an end of an open curve and the point lies past it
    gap_mm     : (m,) by how much the second closest foot is farther; infinite where there is none in reach
    """

    left_mm: Array
    foot_mm: Array
    parameter: Array
    beyond_end: NDArray[np.bool_]
    gap_mm: Array


def closest_point(curve: NurbsCurve, points_mm: Array, chunk: int = 400) -> Closest:
    points = np.asarray(points_mm, dtype=float)
    start, end = _intervals(curve)
    parts = [_closest(curve, start, end, points[k : k + chunk]) for k in range(0, len(points), chunk)]
    return Closest(*(np.concatenate([getattr(p, name) for p in parts]) for name in Closest.__dataclass_fields__))


def _intervals(curve: NurbsCurve) -> tuple[Array, Array]:
    """Intervals (g,) that never straddle a knot, about 1/1500 of the length and at least eight a span."""
    first, last = curve.domain
    knots = curve.knots[(curve.knots > first) & (curve.knots < last)]
    borders = np.unique(np.concatenate([[first], knots, curve.corners, [last]]))
    grid = []
    for a, b in pairwise(borders):
        speed = np.linalg.norm(curve.derivatives(np.linspace(a, np.nextafter(b, a), 9), 1)[1], axis=1).max()
        grid.append(np.linspace(a, b, 1 + max(8, int(1500 * speed * (b - a) / curve.length_mm))))
    return np.concatenate([g[:-1] for g in grid]), np.concatenate([g[1:] for g in grid])


def _measure(curve: NurbsCurve, start: Array, end: Array) -> tuple[Array, Array]:
    """Middle points (g, 2) and a radius (g,) about each that holds its interval."""
    samples = np.concatenate([start, (start + end) / 2, np.nextafter(end, start)])
    point, velocity = curve.derivatives(samples, 1)
    speed = np.hypot(velocity[:, 0], velocity[:, 1]).reshape(3, -1).max(axis=0)
    return point[len(start) : 2 * len(start)], 1.2 * speed * (end - start) / 2


def _closest(curve: NurbsCurve, start: Array, end: Array, points: Array) -> Closest:
    middle, radius = _measure(curve, start, end)
    distance = np.hypot(points[:, 0, None] - middle[:, 0], points[:, 1, None] - middle[:, 1])
    best = distance.min(axis=1)
    row, column = np.nonzero(distance - radius <= best[:, None])
    a, b = start[column], end[column]
    while True:
        middle, radius = _measure(curve, a, b)
        distance = np.hypot(*(points[row] - middle).T)
        np.minimum.at(best, row, distance)
        keep = distance - radius <= best[row]
        row, a, b = row[keep], a[keep], b[keep]
        if radius[keep].max() < 1e-3:
            break
        cuts = a[:, None] + (b - a)[:, None] * np.linspace(0.0, 1.0, 4)
        row, a, b = np.repeat(row, 3), cuts[:, :-1].ravel(), cuts[:, 1:].ravel()
    root_row, root = _roots(curve, points, row, a, b)
    vertex = np.array([] if curve.closed else curve.domain)
    vertex = np.concatenate([vertex, curve.corners])
    every = np.arange(len(points))
    rows = np.concatenate([root_row, np.repeat(every, len(vertex)), row, row])
    parameters = np.concatenate([root, np.tile(vertex, len(points)), a, b])
    is_foot = np.arange(len(rows)) < len(rows) - 2 * len(row)
    return _choose(curve, points, rows, parameters, is_foot)


def _roots(curve: NurbsCurve, points: Array, row: Index, a: Array, b: Array) -> tuple[Index, Array]:
    """Parameters at which the tangential component turns from minus to plus: Newton kept inside a shrinking bracket."""
    row, a, b = _monotone(curve, points, row, a, b)
    inside = np.nextafter(b, a)
    at_start, at_end = _tangential(curve, points[row], a)[0], _tangential(curve, points[row], inside)[0]
    turn = (at_start <= 0) & (at_end >= 0)
    row, low, high = row[turn], a[turn].copy(), inside[turn].copy()
    u, open_ones = (low + high) / 2, np.arange(len(row))
    for _ in range(80):
        at = u[open_ones]
        value, slope = _tangential(curve, points[row[open_ones]], at)
        low[open_ones], high[open_ones] = np.where(value <= 0, at, low[open_ones]), np.where(value >= 0, at, high[open_ones])
        least, most = low[open_ones], high[open_ones]
        with np.errstate(divide="ignore", invalid="ignore"):
            step = at - value / slope
        u[open_ones] = np.where((step >= least) & (step <= most) & (slope > 0), step, (least + most) / 2)
        open_ones = open_ones[(u[open_ones] != at) & (np.nextafter(least, most) < most)]
        if not len(open_ones):
            break
    return row, u


def _monotone(curve: NurbsCurve, points: Array, row: Index, a: Array, b: Array) -> tuple[Index, Array, Array]:
    """Intervals near a centre of curvature, where one could hide two roots, cut into forty; the others as they are."""
    rising = np.minimum(_tangential(curve, points[row], a)[1], _tangential(curve, points[row], np.nextafter(b, a))[1])
    doubtful = rising <= 0.1 * np.square(curve.derivatives((a + b) / 2, 1)[1]).sum(axis=1)
    cuts = a[doubtful, None] + (b - a)[doubtful, None] * np.linspace(0.0, 1.0, 41)
    cuts[:, -1] = b[doubtful]
    plain = ~doubtful
    row = np.concatenate([row[plain], np.repeat(row[doubtful], 40)])
    return row, np.concatenate([a[plain], cuts[:, :-1].ravel()]), np.concatenate([b[plain], cuts[:, 1:].ravel()])


def _tangential(curve: NurbsCurve, points: Array, u: Array) -> tuple[Array, Array]:
    c, c1, c2 = curve.derivatives(u, 2)
    v = c - points
    return (c1 * v).sum(axis=1), (c1 * c1).sum(axis=1) + (c2 * v).sum(axis=1)


def _choose(curve: NurbsCurve, points: Array, rows: Index, parameters: Array, is_foot: NDArray[np.bool_]) -> Closest:
    feet = np.asarray(curve.derivatives(parameters, 0)[0])
    distance = np.linalg.norm(points[rows] - feet, axis=1)
    # a root beats the end of its own interval, which rounding may show as equally close
    order = np.lexsort((distance + 1e-12 * ~is_foot, rows))
    rows, parameters, feet, distance, is_foot = rows[order], parameters[order], feet[order], distance[order], is_foot[order]
    first = np.searchsorted(rows, np.arange(len(points)))
    foot, u, nearest = feet[first], parameters[first], distance[first]
    elsewhere = is_foot & (np.linalg.norm(feet - foot[rows], axis=1) > 1e-6)
    other = np.where(elsewhere, distance - nearest[rows], np.inf)
    gap = np.full(len(points), np.inf)
    np.minimum.at(gap, rows, other)
    left, beyond = _sides(curve, points, foot, u)
    return Closest(left * nearest, foot, u, beyond, gap)


def _sides(curve: NurbsCurve, points: Array, foot: Array, u: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Which side each point lies on; in the outer cone of a corner that is the side the corner points to."""
    first, last = curve.domain
    after = _unit(curve, u)
    before = _unit(curve, np.where(u > first, np.nextafter(u, first), np.nextafter(last, first)))
    is_corner = np.isin(u, curve.corners) | (curve.closed & np.isin(u, [first, last]) & np.isin(first, curve.corners))
    after = np.where((is_corner & (u == last))[:, None], _unit(curve, np.full(len(u), first)), after)
    left = np.sign(_cross(after, points - foot))
    left = np.where(is_corner, -np.sign(_cross(before, after)), left)
    if curve.closed:
        return left, np.zeros(len(u), dtype=bool)
    along = (after * (points - foot)).sum(axis=1)
    return left, ((u == first) & (along < -1e-12)) | ((u == last) & (along > 1e-12))


def _unit(curve: NurbsCurve, u: Array) -> Array:
    first, last = curve.domain
    tangent = curve.derivatives(np.minimum(u, np.nextafter(last, first)), 1)[1]
    return np.asarray(tangent / np.linalg.norm(tangent, axis=1)[:, None])


def _cross(p: Array, q: Array) -> Array:
    return np.asarray(p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0])
