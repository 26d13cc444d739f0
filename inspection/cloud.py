"""Points that a fit is made to, where they lie: rows of a long scan are gone through in pieces instead of being copied."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from inspection.kernels import NONE_LEFT_OUT, Marks, Room

Array = NDArray[np.float64]

ROWS_AT_ONCE = 1 << 16  # rows gone through together: what is worked out of them takes a few megabytes
MANY = 1 << 18  # points of which what costs memory is asked of a choice of them
_GOLDEN = 0.6180339887498949
_LARGEST_WORD = 2.0**64 * (1.0 - 2.0**-53)
_ODD = np.array([0x9E3779B97F4A7C15, 0xBF58476D1CE4E5B9], dtype=np.uint64)  # the steps and a factor of SplitMix64 (Steele et al. 2014)


@dataclass(frozen=True, slots=True, eq=False)
class Cloud:
    """Section points of a scan that take part in a fit.

    points_mm : (n, 2) contiguous, all rows
    left_out  : (n,) 1 for rows that take no part; (0,) where all do
    room      : gives arrays as long as the scan
    count     : how many take part
    """

    points_mm: Array
    left_out: Marks = field(default_factory=lambda: NONE_LEFT_OUT)
    room: Room = np.empty
    count: int = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "count", len(self.points_mm) - int(np.count_nonzero(self.left_out)))

    def __len__(self) -> int:
        return self.count

    def blocks(self) -> Iterator[Array]:
        """The points that take part (k, 2), in their order, piece by piece."""
        for rows in row_blocks(len(self.points_mm)):
            points = self.points_mm[rows]
            yield points[self.left_out[rows] == 0] if len(self.left_out) else points

    def without(self, marked: NDArray[np.bool_]) -> "Cloud":
        """The cloud without marked ones of its points (m,)."""
        if not marked.any():
            return self
        left_out = self.room((len(self.points_mm),), np.uint8)
        left_out[:] = self.left_out if len(self.left_out) else 0
        at = 0
        for rows in row_blocks(len(left_out)):
            inside = np.flatnonzero(left_out[rows] == 0)
            left_out[rows.start + inside] = marked[at : at + len(inside)]
            at += len(inside)
        return Cloud(self.points_mm, left_out, self.room)

    def few(self, most: int = MANY) -> Array:
        """At most so many of the points (k, 2), in their order: all, or one of every stretch of the scan."""
        if self.count <= most:
            return np.concatenate([np.empty((0, 2)), *self.blocks()]) if len(self.left_out) else self.points_mm
        return few_of(self.blocks(), self.count, most)

    def sample(self, about: int) -> Array:
        """About so many of the points (k, 2), in their order: drawn by their coordinates, so the same ones in whatever order they came."""
        below = np.uint64(min(about / max(self.count, 1), 1.0) * _LARGEST_WORD)
        return np.concatenate([np.empty((0, 2)), *(points[_scattered(points) <= below] for points in self.blocks())])

    def corners(self) -> Array:
        """The lowest and the highest x and y (2, 2)."""
        low, high = np.full(2, np.inf), np.full(2, -np.inf)
        for points in self.blocks():
            if len(points):
                lowest, highest = corners_of(points)
                low, high = np.minimum(low, lowest), np.maximum(high, highest)
        return np.array([low, high])


def corners_of(points: Array) -> Array:
    """The lowest and the highest x and y (2, 2) of at least one point (k, 2). Numpy goes along columns ten times as fast as over pairs."""
    x, y = points.T
    return np.array([[x.min(), y.min()], [x.max(), y.max()]])


def _scattered(points: Array) -> NDArray[np.uint64]:
    """A number for each of the points (k, 2) that follows from its coordinates, and is spread evenly over all numbers of 64 bits."""
    bits = np.ascontiguousarray(points).view(np.uint64)
    words = bits[:, 0] * _ODD[0] + bits[:, 1] * _ODD[1]
    for odd in _ODD:
        words ^= words >> np.uint64(32)
        words *= odd
    return np.asarray(words ^ (words >> np.uint64(32)))


def few_of(blocks: Iterable[Array], count: int, most: int = MANY) -> Array:
    """At most so many of `count` rows that come piece by piece (k, c): all, or one of every stretch of them."""
    wanted, chosen, at = even_choice(count, most), [], 0
    for block in blocks:
        inside = wanted[np.searchsorted(wanted, at) : np.searchsorted(wanted, at + len(block))]
        chosen.append(block[inside - at])
        at += len(block)
    return np.concatenate(chosen)


def row_blocks(count: int, at_once: int | None = None) -> Iterator[slice]:
    """The rows 0 .. count - 1, piece by piece: `at_once` together, or ROWS_AT_ONCE."""
    at_once = at_once or ROWS_AT_ONCE
    for first in range(0, count, at_once):
        yield slice(first, min(first + at_once, count))


def even_choice(count: int, most: int) -> NDArray[np.int64]:
    """At most so many of the numbers 0 .. count - 1, rising, one of every stretch; in no rhythm, since a scan may have one."""
    if count <= most:
        return np.arange(count)
    k = np.arange(most)
    return np.asarray((k + np.mod(k * k * _GOLDEN, 1.0)) * (count / most), dtype=np.int64)
