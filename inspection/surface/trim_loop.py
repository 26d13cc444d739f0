"""The loops that trim a face: which places of its parameters are certain to lie inside them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Truth = NDArray[np.bool_]

_FEWEST_CELLS, _MOST_CELLS = 8, 256  # in either direction of a face
_PAIRS_AT_ONCE = 1 << 20
_OUTSIDE, _INSIDE, _NEAR = range(3)


@dataclass(frozen=True, slots=True, eq=False)
class TrimLoop:
    """The loops of a face, as straight segments in its parameters.

    A grid over the parameters knows which of its cells lie inside and which outside; only near segments they are looked at one by one.

    segments : (s, 2, 5) u, v and x, y, z in mm at both ends
    off_mm   : how far the loops may lie off the segments
    low, per : (2,) where the grid begins, and cells in one unit of u and of v
    cells    : (k, k) codes of cells, by u and v
    first, members : (k + 1,) and (n,) the segments that come near each row of cells in v
    """

    segments: Array
    off_mm: float
    low: Array
    per: Array
    cells: NDArray[np.int8]
    first: Index
    members: Index

    def holds(self, parameter: Array, places_mm: Array) -> Truth:
        """Whether places (m, 3) with parameters (m, 2) lie inside the loops by more than these may be off (m,)."""
        count = len(self.cells)
        cell = np.clip(np.floor((parameter - self.low) * self.per).astype(np.int64), 0, count - 1)
        code = self.cells[cell[:, 0], cell[:, 1]]
        result = np.asarray(code == _INSIDE)
        near = np.flatnonzero(code == _NEAR)
        many = np.diff(self.first)[cell[near, 1]]
        for part in np.split(near, _cuts(many)):
            result[part] = self._hold_near(parameter[part], places_mm[part], cell[part, 1])
        return result

    def _hold_near(self, parameter: Array, places_mm: Array, row: Index) -> Truth:
        """The same for places near segments: every segment of their rows is looked at."""
        many = np.diff(self.first)[row]
        place = np.repeat(np.arange(len(row)), many)
        at = np.arange(len(place)) - np.repeat(np.cumsum(many) - many, many) + np.repeat(self.first[row], many)
        a, b = self.segments[self.members[at]].transpose(1, 0, 2)
        crosses = _passes_right_of(parameter[place], a, b)
        inside = np.bincount(place, crosses, len(row)).astype(np.int64) % 2 == 1
        close = _squares_from(places_mm[place], a[:, 2:], b[:, 2:]) <= self.off_mm**2
        return np.asarray(inside & (np.bincount(place, close, len(row)) == 0))


def trim_loop(segments: Array, off_mm: float) -> TrimLoop:
    """The loops (s, 2, 5) with their grid."""
    ends = segments[:, :, :2]
    low, high = ends.min(axis=(0, 1)), ends.max(axis=(0, 1))
    count = int(np.clip(2 * np.sqrt(len(segments)), _FEWEST_CELLS, _MOST_CELLS))
    per = count / np.maximum(high - low, 1e-300)
    near = _near_cells((ends - low) * per, count)
    cells = np.where(near, _NEAR, _inside_cells((ends - low) * per, count)).astype(np.int8)
    rows = np.floor((ends[:, :, 1] - low[1]) * per[1])
    begin, end = (np.clip(each, 0, count - 1).astype(np.int64) for each in (rows.min(axis=1) - 1, rows.max(axis=1) + 1))
    many = end - begin + 1
    member = np.repeat(np.arange(len(segments)), many)
    row = np.arange(len(member)) - np.repeat(np.cumsum(many) - many, many) + np.repeat(begin, many)
    order = np.argsort(row, kind="stable")
    first = np.searchsorted(row[order], np.arange(count + 1))
    return TrimLoop(segments, off_mm, low, per, cells, first, member[order])


def _near_cells(ends: Array, count: int) -> Truth:
    """The cells (k, k) that segments run through, by ends (s, 2, 2) in cells, and those around them."""
    a, b = ends[:, 0], ends[:, 1]
    steps = np.ceil(2 * np.abs(b - a).max(axis=1)).astype(np.int64) + 1
    segment = np.repeat(np.arange(len(a)), steps + 1)
    share = (np.arange(len(segment)) - np.repeat(np.cumsum(steps + 1) - steps - 1, steps + 1)) / steps[segment]
    cell = np.clip(np.floor(a[segment] + share[:, None] * (b - a)[segment]).astype(np.int64), 0, count - 1)
    near = np.zeros((count + 2, count + 2), dtype=bool)
    for i in range(3):
        for j in range(3):
            near[cell[:, 0] + i, cell[:, 1] + j] = True
    return near[1:-1, 1:-1]


def _inside_cells(ends: Array, count: int) -> NDArray[np.int8]:
    """Whether the middles of cells lie inside the loops (k, k): right of each an odd number of segments passes."""
    inside = np.zeros((count, count), dtype=np.int8)
    a, b = ends[:, 0], ends[:, 1]
    for row in range(count):
        v = row + 0.5
        crossing = (a[:, 1] <= v) != (b[:, 1] <= v)
        u = a[crossing, 0] + (v - a[crossing, 1]) / (b[crossing, 1] - a[crossing, 1]) * (b[crossing, 0] - a[crossing, 0])
        right = len(u) - np.searchsorted(np.sort(u), np.arange(count) + 0.5, side="right")
        inside[:, row] = right % 2
    return inside


def _passes_right_of(at: Array, a: Array, b: Array) -> Truth:
    """Whether segments from a to b (n, 5) pass places (n, 2) on the right, on their level in v."""
    crossing = (a[:, 1] <= at[:, 1]) != (b[:, 1] <= at[:, 1])
    rise = np.where(crossing, b[:, 1] - a[:, 1], 1.0)
    return np.asarray(crossing & (a[:, 0] + (at[:, 1] - a[:, 1]) / rise * (b[:, 0] - a[:, 0]) > at[:, 0]))


def _squares_from(places: Array, a: Array, b: Array) -> Array:
    """Squares of the distances (n,) of places from segments from a to b (n, 3)."""
    step, off = b - a, places - a
    length = (step**2).sum(axis=1)
    along = np.clip((off * step).sum(axis=1) / np.where(length > 0, length, 1.0), 0.0, 1.0)
    return np.asarray(((off - along[:, None] * step) ** 2).sum(axis=1))


def _cuts(many: Index) -> Index:
    """Where to cut a list so that no part has many more than `_PAIRS_AT_ONCE` of what its entries count."""
    part = np.cumsum(many) // _PAIRS_AT_ONCE
    return np.flatnonzero(np.diff(part)) + 1
