"""Tables that begin on a cache line, so that a row of eight numbers lies in one."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_LINE = 64  # bytes, or a part of the line on every processor


def align(numbers: Array) -> Array:
    """A copy of the numbers, of any shape, that begins on a cache line."""
    memory = np.empty(numbers.size + _LINE // 8)
    skip = (-memory.ctypes.data % _LINE) // 8
    aligned = memory[skip : skip + numbers.size].reshape(numbers.shape)
    aligned[...] = numbers
    return aligned
