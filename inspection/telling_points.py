"""Few points that stand for many: the lowest and the highest of every share of the profile's length.

What is proven of some points of a scan holds for all of it: no placement passes that does not pass for them. What fits them has to
be asked of all the others, and those that contradict join the few.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Rows = NDArray[np.int64]

SHARES = 512
MANY = 4096  # points above which few stand for all
_NONE = -1  # in place of a row
_AT_ONCE = 1 << 16  # points looked at together


def telling_rows(
    station_mm: Array, deviation_mm: Array, length_mm: float, shares: int = SHARES, told: Rows | None = None, since: int = 0
) -> Rows:
    """Rows (k,), in rising order, of the lowest and the highest of points (m,) in each of the shares of the length; k <= 2 * shares.

    Of equally low points in a share it is the first, of equally high ones the last.

    station_mm, deviation_mm : (m,) at the pose of this moment; NaN for points that do not count
    told, since : rows that tell of the points before the row `since`, found earlier; only the points from there on are looked at
    """

    def pieces() -> Iterator[tuple[Rows, Rows, Array]]:
        for rows in _counted(deviation_mm, told, since):
            share = np.minimum((station_mm[rows] * (shares / length_mm)).astype(np.int64), shares - 1)
            yield rows, share, deviation_mm[rows]

    low, high = np.full(shares, np.inf), np.full(shares, -np.inf)
    for _, share, deviation in pieces():
        np.minimum.at(low, share, deviation)
        np.maximum.at(high, share, deviation)
    lowest, highest = np.full(shares, _NONE), np.full(shares, _NONE)
    for rows, share, deviation in pieces():
        found = np.flatnonzero((deviation == low[share]) & (lowest[share] == _NONE))[::-1]
        lowest[share[found]] = rows[found]  # where several rows go to one place, the last one stays
        found = np.flatnonzero(deviation == high[share])
        highest[share[found]] = rows[found]
    return np.setdiff1d(np.concatenate([lowest, highest]), [_NONE])


def _counted(deviation_mm: Array, told: Rows | None, since: int) -> Iterator[Rows]:
    """Rows of the points that count, piece by piece: those that told before, then those from `since` on."""
    if told is not None:
        yield told
    for first in range(since, len(deviation_mm), _AT_ONCE):
        yield first + np.flatnonzero(~np.isnan(deviation_mm[first : first + _AT_ONCE]))
