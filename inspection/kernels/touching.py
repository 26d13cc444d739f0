"""The loops over all pairs of circles and samples of an outline by which circles are inscribed in it.

Every operation is the one that whole arrays would do, in its order, so that the values are the same to the last bit; arrays of all
pairs would be written to memory and read again a dozen times.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from inspection.kernels.compiling import kernel

Array = NDArray[np.float64]
Rows = NDArray[np.int64]


def smallest_touching(places: Array, normals: Array, outline: Array) -> Rows:
    """The sample (k,) of an outline (n, 2) through which the smallest circle passes that touches each of places (k, 2).

    normals : (k, 2) unit vectors from the places towards the centres; where no sample lies on that side, it is the first one
    """
    best = np.empty(len(places), dtype=np.int64)
    _find_smallest(np.ascontiguousarray(places), np.ascontiguousarray(normals), np.ascontiguousarray(outline), best)
    return best


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
