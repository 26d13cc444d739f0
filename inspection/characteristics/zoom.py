"""Maxima of smooth functions of one parameter, found by looking closer and closer.

It needs no derivative and no start, and takes ends and corners as they come. The value is right to round-off; the place is right
to the root of round-off, as for every search that compares values.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_LOOKS = 33  # values a round; a round narrows sixteenfold
_ROUNDS = 7  # sixteen to the seventh is beyond the root of round-off
_FINEST = 1e-10  # of the first range: below it a value is as good as its neighbours


def find_maximum(height: Callable[[Array], Array], low: float, high: float) -> float:
    """The parameter in [low, high] at which height (n,) -> (n,) is largest. It must rise to it and fall from it in there."""
    first, last, range_ = low, high, high - low
    for _ in range(_ROUNDS):
        looked = np.linspace(low, high, _LOOKS)
        best = int(np.argmax(height(looked)))
        low, high = max(first, looked[max(best - 1, 0)]), min(last, looked[min(best + 1, _LOOKS - 1)])
        if high - low < _FINEST * range_:
            break
    return float(looked[best])
