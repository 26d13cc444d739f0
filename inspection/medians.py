"""The median of the points of a long scan, to the last bit, without holding or sorting them: it does not depend on their order."""

from collections.abc import Callable, Iterable, Iterator
from functools import partial

import numpy as np
from numpy.typing import NDArray

from inspection.cloud import MANY, Cloud

Array = NDArray[np.float64]

_BINS = 1 << 16


def median_place(points: Cloud) -> Array:
    """The medians (2,) of x and y."""
    if len(points) <= MANY:
        return np.asarray(np.median(points.few(), axis=0))
    low, high = points.corners()
    return np.array([_median(partial(_coordinates, points, axis), len(points), low[axis], high[axis]) for axis in (0, 1)])


def _coordinates(points: Cloud, axis: int) -> Iterator[Array]:
    return (block[:, axis] for block in points.blocks())


def _median(blocks: Callable[[], Iterable[Array]], count: int, low: float, high: float) -> float:
    ranks = sorted({(count - 1) // 2, count // 2})
    return float(np.mean([value_of_rank(blocks, rank, low, high) for rank in ranks]))


def value_of_rank(blocks: Callable[[], Iterable[Array]], rank: int, low: float, high: float) -> float:
    """The value with so many smaller or equal ones before it, of all between `low` and `high`, the extremes.

    The values are counted in bins, and those of the bin that holds the rank are looked at once more.
    """
    while True:
        if not high > low:
            return float(low)
        counts = np.zeros(_BINS, dtype=np.int64)
        for block in blocks():
            counts += np.bincount(_bins(block[(block >= low) & (block <= high)], low, high), minlength=_BINS)
        before = np.cumsum(counts)
        wanted = int(np.searchsorted(before, rank, side="right"))
        rank -= int(before[wanted] - counts[wanted])
        if counts[wanted] <= MANY:
            found = [_inside(block, low, high, wanted) for block in blocks()]
            return float(np.partition(np.concatenate(found), rank)[rank])
        extremes = [(inside.min(), inside.max()) for block in blocks() if len(inside := _inside(block, low, high, wanted))]
        low, high = min(least for least, _ in extremes), max(most for _, most in extremes)


def _bins(values: Array, low: float, high: float) -> NDArray[np.int64]:
    with np.errstate(over="ignore"):
        scale = np.float64(_BINS - 1) / (high - low)
    places = (values - low) * scale if np.isfinite(scale) else (values - low) / (high - low) * (_BINS - 1)
    return np.asarray(places.astype(np.int64))


def _inside(block: Array, low: float, high: float, wanted: int) -> Array:
    """The values of a block that lie in the wanted bin."""
    values = block[(block >= low) & (block <= high)]
    inside: Array = values[_bins(values, low, high) == wanted]
    return inside
