"""Points that a fit is made to, where they lie: rows of a long scan are gone through in pieces instead of being copied."""

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from inspection.kernels import NONE_LEFT_OUT, Marks, Room

Array = NDArray[np.float64]

ROWS_AT_ONCE = 1 << 16  # rows gone through together: what is worked out of them takes a few megabytes
MANY = 1 << 18  # points of which what costs memory is asked of a choice of them
_MARGIN = 6.0  # standard deviations of the number of lots within a share of all
_HELD = 3  # times as many rows as are drawn are held before they are sifted
_LOTS = 2**64
_MIXED_BY = np.array([0x9E3779B97F4A7C15, 0xBF58476D1CE4E5B9], dtype=np.uint64)  # step and factor of SplitMix64 (Steele et al. 2014)
_COLUMN_BY = np.array([*_MIXED_BY, 0x94D049BB133111EB], dtype=np.uint64)  # and its other factor


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
        """At most so many of the points (k, 2), in their order: all, or those that are drawn by their coordinates (see `few_of`)."""
        if self.count <= most and not len(self.left_out):
            return self.points_mm
        return few_of(self.blocks, self.count, most)

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


def few_of(blocks: Callable[[], Iterable[Array]], count: int, most: int = MANY) -> Array:
    """At most so many of `count` rows of numbers that come piece by piece (k, c), in their order: all, or so many that are drawn.

    Rows are drawn by their numbers, so that the same ones are drawn in whatever order and pieces they come. Equal rows draw the same
    lot; where only some of them are wanted, any will do.
    """
    if count <= most:
        return np.concatenate(list(blocks()))
    drawn = _drawn(blocks(), most, (most + _MARGIN * math.sqrt(most)) / count)
    return drawn if len(drawn) == most else _drawn(blocks(), most, 1.0)  # of many equal rows fewer than expected have low lots


def _drawn(blocks: Iterable[Array], most: int, share: float) -> Array:
    """The rows with the lowest lots, at most so many, of those whose lots are within a share of all lots."""
    highest = np.uint64(share * _LOTS if share < 1.0 else _LOTS - 1)
    rows: list[Array] = []
    lots: list[NDArray[np.uint64]] = []
    for block in blocks:
        own = _lots(block)
        low = np.flatnonzero(own <= highest)  # of rows that are told by number, numpy takes a few much faster than of marked ones
        rows.append(block[low])
        lots.append(own[low])
        if sum(map(len, lots)) > _HELD * most:
            rows, lots = _lowest(rows, lots, most)
            highest = lots[0].max(initial=np.uint64(0))
    return _lowest(rows, lots, most)[0][0]


def _lowest(rows: list[Array], lots: list[NDArray[np.uint64]], most: int) -> tuple[list[Array], list[NDArray[np.uint64]]]:
    """The rows with the lowest lots, and these, as one piece each."""
    every, lot = np.concatenate(rows), np.concatenate(lots)
    if len(lot) <= most:
        return [every], [lot]
    last = np.partition(lot, most - 1)[most - 1]
    drawn = lot < last
    drawn[np.flatnonzero(lot == last)[: most - np.count_nonzero(drawn)]] = True
    return [every[drawn]], [lot[drawn]]


def drawn_rows(blocks: Iterable[Array], most: int = MANY) -> NDArray[np.int64]:
    """The numbers, rising, of at most so many rows that come piece by piece (k, c), drawn as `few_of` draws them."""
    lots = np.concatenate([_lots(block) for block in blocks])
    if len(lots) <= most:
        return np.arange(len(lots))
    return np.sort(np.argpartition(lots, most - 1)[:most])


def _lots(rows: Array) -> NDArray[np.uint64]:
    """A number for each of the rows (k,) or (k, c) that follows from its values, and is spread evenly over all numbers of 64 bits."""
    columns = np.atleast_2d(rows.view(np.uint64).T)
    lots = columns[0] * _COLUMN_BY[0]
    for column, factor in zip(columns[1:], _COLUMN_BY[1:], strict=False):
        lots += column * factor
    for factor in _MIXED_BY:  # after a last step the higher half, which nearly always decides, would be the same
        lots ^= lots >> np.uint64(32)
        lots *= factor
    return np.asarray(lots)


def row_blocks(count: int, at_once: int | None = None) -> Iterator[slice]:
    """The rows 0 .. count - 1, piece by piece: `at_once` together, or ROWS_AT_ONCE."""
    at_once = at_once or ROWS_AT_ONCE
    for first in range(0, count, at_once):
        yield slice(first, min(first + at_once, count))
