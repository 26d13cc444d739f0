"""The shortest tree that joins points, by Prim's method: every point joins the tree by the shortest way from it."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from inspection.kernels.compiling import kernel

Array = NDArray[np.float64]
Rows = NDArray[np.int64]

_ALIKE = 1.0 + 1e-12  # squares of lengths nearer to each other may be those of equal lengths


class GrownTree(NamedTuple):
    """A tree that was grown from point 0.

    joined : (n,) the points in the order in which they joined it
    parent : (n,) the point that each was joined to; -1 for point 0
    """

    joined: Rows
    parent: Rows


def shortest_tree(points_mm: Array) -> GrownTree | None:
    """The shortest tree over points (n, 2); None where lengths are so alike that another one may be as short. Takes n^2 steps."""
    n = len(points_mm)
    joined, parent = np.zeros(n, dtype=np.int64), np.full(n, -1)
    return GrownTree(joined, parent) if _grow_tree(np.ascontiguousarray(points_mm), joined, parent) else None


@kernel
def _grow_tree(points: Any, joined: Any, parent: Any) -> bool:
    """Fill in the tree. Returns whether it is the only one: every way that was taken is shorter than any other to the points outside."""
    n = len(points)
    outside = np.arange(1, n)
    x, y = points[1:, 0].copy(), points[1:, 1].copy()
    square, nearest = np.full(n - 1, np.inf), np.zeros(n - 1, dtype=np.int64)
    doubtful = np.zeros(n - 1, dtype=np.bool_)
    last = 0
    for left in range(n - 1, 0, -1):
        at, least, next_least = 0, np.inf, np.inf
        for i in range(left):
            dx, dy = x[i] - points[last, 0], y[i] - points[last, 1]
            here = dx * dx + dy * dy
            if here < square[i]:
                doubtful[i] = here * _ALIKE >= square[i]
                square[i], nearest[i] = here, last
            elif here <= square[i] * _ALIKE:
                doubtful[i] = True
            if square[i] < least:
                at, least, next_least = i, square[i], least
            elif square[i] < next_least:
                next_least = square[i]
        if doubtful[at] or next_least <= least * _ALIKE:
            return False
        last = outside[at]
        joined[n - left], parent[last] = last, nearest[at]
        end = left - 1
        outside[at], x[at], y[at] = outside[end], x[end], y[end]
        square[at], nearest[at], doubtful[at] = square[end], nearest[end], doubtful[end]
    return True
