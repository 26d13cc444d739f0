"""Few points that stand for many: the lowest and the highest of every share of the profile's length.

What is proven of some points of a scan holds for all of it: no placement passes that does not pass for them. What fits them has to
be asked of all the others, and those that contradict join the few.
"""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SHARES = 512
MANY = 4096  # points above which few stand for all


def telling_rows(station_mm: Array, deviation_mm: Array, length_mm: float) -> NDArray[np.int64]:
    """Rows (k,), in rising order, of the lowest and the highest of points (m,) in each of the shares of the length; k <= 2 * SHARES.

    station_mm, deviation_mm : (m,) at the pose of this moment, m > 0
    """
    share = np.minimum((station_mm * (SHARES / length_mm)).astype(np.int64), SHARES - 1)
    order = np.lexsort((deviation_mm, share))
    borders = np.flatnonzero(np.diff(share[order]))
    return np.unique(np.concatenate([order[[0, -1]], order[borders], order[borders + 1]]))
