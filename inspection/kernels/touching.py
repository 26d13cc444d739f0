"""The loops by which circles are inscribed in an outline: over all pairs of circles and samples, and Newton's steps from there.

Every operation is the one that whole arrays would do, in its order, so that the values are the same to the last bit; arrays of all
pairs would be written to memory and read again a dozen times.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from inspection.kernels.compiling import kernel
from inspection.kernels.splines import Spline, derive

Array = NDArray[np.float64]
Rows = NDArray[np.int64]


def smallest_touching(places: Array, normals: Array, outline: Array) -> Rows:
    """The sample (k,) of an outline (n, 2) through which the smallest circle passes that touches each of places (k, 2).

    normals : (k, 2) unit vectors from the places towards the centres; where no sample lies on that side, it is the first one
    """
    best = np.empty(len(places), dtype=np.int64)
    _find_smallest(np.ascontiguousarray(places), np.ascontiguousarray(normals), np.ascontiguousarray(outline), best)
    return best


def settle_contacts(
    spline: Spline,
    domain: tuple[float, float],
    places: Array,
    normals: Array,
    start: Array,
    within: tuple[Array, Array],
    steps: int,
    settled: float,
) -> Array:
    """The parameters (k,) on a curve of the contacts of the smallest circles that touch it at places (k, 2) with unit normals (k, 2).

    domain  : of the curve; parameters beyond its end wrap around
    start   : (k,) parameters that Newton's method starts from
    within  : (k,), (k,) what the parameters stay between
    steps   : at most so many
    settled : the last step moves no parameter by so much
    """
    found, (low, high) = start.copy(), within
    knots, homogeneous, degree = spline
    begin, end = domain
    at, normal = np.ascontiguousarray(places), np.ascontiguousarray(normals)
    _step_to_contacts(knots, homogeneous, degree, begin, end, at, normal, low, high, found, steps, settled)
    return found


def nearest_squared(places: Array, outline: Array) -> Array:
    """The squares (k,) of the distances of places (k, 2) from the nearest of the samples of an outline (n, 2)."""
    least = np.empty(len(places))
    _find_nearest(np.ascontiguousarray(places), np.ascontiguousarray(outline), least)
    return least


@kernel
def _find_smallest(places: Any, normals: Any, outline: Any, best: Any) -> None:
    for i in range(len(places)):
        at, least = 0, np.inf
        for j in range(len(outline)):
            dx, dy = outline[j, 0] - places[i, 0], outline[j, 1] - places[i, 1]
            facing = normals[i, 0] * dx + normals[i, 1] * dy
            if facing > 0:
                radius = (dx * dx + dy * dy) / (2 * facing)
                if radius < least:
                    at, least = j, radius
        best[i] = at


@kernel
def _find_nearest(places: Any, outline: Any, least: Any) -> None:
    for i in range(len(places)):
        nearest = np.inf
        for j in range(len(outline)):
            x, y = places[i, 0] - outline[j, 0], places[i, 1] - outline[j, 1]
            square = x * x + y * y
            if not square >= nearest:  # what is no number counts as nearest, as in a minimum over arrays
                nearest = square
                if np.isnan(square):
                    break
        least[i] = nearest


@kernel
def _step_to_contacts(
    knots: Any,
    homogeneous: Any,
    degree: int,
    begin: float,
    end: float,
    places: Any,
    normals: Any,
    low: Any,
    high: Any,
    found: Any,
    steps: int,
    settled: float,
) -> None:
    at, curve = np.empty(len(found)), np.empty((3, len(found), 2))
    for _ in range(steps):
        for i in range(len(found)):
            u = found[i]
            at[i] = begin + (u - begin) % (end - begin) if u < begin or u > end else u
        derive(knots, homogeneous, degree, at, curve)
        moved = 0.0
        for i in range(len(found)):
            nx, ny, v = normals[i, 0], normals[i, 1], found[i]
            dx, dy = curve[0, i, 0] - places[i, 0], curve[0, i, 1] - places[i, 1]
            fx, fy, sx, sy = curve[1, i, 0], curve[1, i, 1], curve[2, i, 0], curve[2, i, 1]
            square, facing = dx * dx + dy * dy, nx * dx + ny * dy
            slope = 2 * (dx * fx + dy * fy) * facing - square * (nx * fx + ny * fy)
            bend = 2 * ((fx * fx + fy * fy) + (dx * sx + dy * sy)) * facing - square * (nx * sx + ny * sy)
            step = -slope / bend if bend > 0 else -np.sign(slope) * (high[i] - low[i]) / 4
            stepped = min(max(v + step, low[i]), high[i])
            if np.isnan(step):
                stepped = step
            moved = max(moved, abs(stepped - v)) if not np.isnan(stepped) else np.inf
            found[i] = stepped
        if moved < settled:
            break
