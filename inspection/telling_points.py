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

    Of equally low points in a share it is the one with the least station, of equally high ones the one with the greatest.

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
    lowest, highest, least, greatest = (np.full(shares, fill) for fill in (_NONE, _NONE, np.inf, np.inf))
    for rows, share, deviation in pieces():
        for extreme, chosen, nearest, way in ((low, lowest, least, 1.0), (high, highest, greatest, -1.0)):
            equal = np.flatnonzero(deviation == extreme[share])
            _keep_nearest(rows[equal], share[equal], way * station_mm[rows[equal]], chosen, nearest)
    return np.setdiff1d(np.concatenate([lowest, highest]), [_NONE])


def _keep_nearest(rows: Rows, share: Rows, at: Array, chosen: Rows, nearest: Array) -> None:
    """Let each share choose the row that is least far along, the first one of several at one place, if it is nearer than its choice."""
    nearer = np.flatnonzero(at < nearest[share])
    order = nearer[np.argsort(at[nearer], kind="stable")[::-1]]  # where several rows go to one share, the last one stays
    chosen[share[order]], nearest[share[order]] = rows[order], at[order]


def _counted(deviation_mm: Array, told: Rows | None, since: int) -> Iterator[Rows]:
    """Rows of the points that count, piece by piece: those that told before, then those from `since` on."""
    if told is not None:
        yield told
    for first in range(since, len(deviation_mm), _AT_ONCE):
        yield first + np.flatnonzero(~np.isnan(deviation_mm[first : first + _AT_ONCE]))
