"""Which blocks of a grid boxes reach."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def blocks_near(low: Array, high: Array, blocks: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Which blocks (i, j, k) boxes (c, 3) reach, in blocks from the lowest corner."""
    begin, end = np.maximum(np.floor(low - 1e-6), 0).astype(np.int64), np.floor(high + 1e-6).astype(np.int64) + 1
    steps = np.zeros(blocks + 1, dtype=np.int32)
    for corner in range(8):  # one is added where a box begins and taken away where it ends, and the sums say how many hold a block
        choice = [corner >> axis & 1 for axis in range(3)]
        at = [np.minimum((end if chosen else begin)[:, axis], blocks[axis]) for axis, chosen in enumerate(choice)]
        np.add.at(steps, tuple(at), -1 if sum(choice) % 2 else 1)
    for axis in range(3):
        np.cumsum(steps, axis=axis, out=steps)
    return np.ascontiguousarray(steps[:-1, :-1, :-1] > 0)
