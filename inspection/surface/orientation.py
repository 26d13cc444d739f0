"""Which parts of a surface have to be turned over so that neighbours have their outsides on the same side."""

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

Array = NDArray[np.float64]
Index = NDArray[np.int64]


def which_to_turn(area: Array, one: Index, other: Index, agrees: NDArray[np.bool_]) -> tuple[NDArray[np.bool_], Index]:
    """Whether each part (n,) is to be turned over, and those parts (k,) of which no turning makes neighbours agree.

    Of parts that hang together the side of the greater area stays. They are sought in a graph of two nodes a part, as it is and turned:
    neighbours that agree join what is alike, others what is not.

    area       : (n,)
    one, other : (e,) the parts on both sides of each edge
    agrees     : (e,) whether they have their outsides on the same side
    """
    n = len(area)
    if agrees.all():
        return np.zeros(n, dtype=bool), np.empty(0, dtype=np.int64)
    rows = np.concatenate([one, one + n])
    columns = np.concatenate([np.where(agrees, other, other + n), np.where(agrees, other + n, other)])
    _, label = connected_components(coo_array((np.ones(len(rows)), (rows, columns)), shape=(2 * n, 2 * n)), directed=False)
    weight = np.bincount(label, np.concatenate([area, -area]))  # of what hangs together as it is, less its mirror image
    turned = (weight[label[:n]] < 0) | ((weight[label[:n]] == 0) & (label[:n] > label[n:]))
    return turned, np.flatnonzero(label[:n] == label[n:])
