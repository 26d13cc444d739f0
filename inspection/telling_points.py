"""Few points that stand for many: the lowest and the highest of every share of the profile's length.

What is proven of some points of a scan holds for all of it: no placement passes that does not pass for them. What fits them has to
be asked of all the others, and those that contradict join the few.
"""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SHARES = 512
MANY = 4096  # points above which few stand for all
_AT_ONCE = 1 << 16  # points looked at together; the others join the few of those before


def telling_rows(
    station_mm: Array, deviation_mm: Array, length_mm: float, shares: int = SHARES, told: NDArray[np.int64] | None = None, since: int = 0
) -> NDArray[np.int64]:
    """Rows (k,), in rising order, of the lowest and the highest of points (m,) in each of the shares of the length; k <= 2 * shares.

    station_mm, deviation_mm : (m,) at the pose of this moment; NaN for points that do not count
    told, since : rows that tell of the points before the row `since`, found earlier; only the points from there on are looked at
    """
    kept = np.empty(0, dtype=np.int64) if told is None else told
    for first in range(since, len(station_mm), _AT_ONCE):
        kept = np.concatenate([kept, first + np.flatnonzero(~np.isnan(deviation_mm[first : first + _AT_ONCE]))])
        if len(kept):
            kept = kept[_extremes(station_mm[kept], deviation_mm[kept], length_mm, shares)]
    return kept


def _extremes(station_mm: Array, deviation_mm: Array, length_mm: float, shares: int) -> NDArray[np.int64]:
    share = np.minimum((station_mm * (shares / length_mm)).astype(np.int64), shares - 1)
    order = np.lexsort((deviation_mm, share))
    borders = np.flatnonzero(np.diff(share[order]))
    return np.unique(np.concatenate([order[[0, -1]], order[borders], order[borders + 1]]))
