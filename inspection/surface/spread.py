"""Places shared out evenly among parts of a surface."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def shares_of(area: Array, count: int) -> NDArray[np.int64]:
    """The part (n,) that each of `count` places falls to, or more: an even walk through the areas (k,) gives each part its share."""
    share = count * area / area.sum()
    before = np.floor(np.cumsum(share) - share + 0.5).astype(np.int64)
    return np.repeat(np.arange(len(area)), np.diff(np.append(before, max(count, before[-1]))))


def spread_within(owner: NDArray[np.int64]) -> tuple[Array, Array]:
    """Two coordinates (n,) within 0 and 1 that fill the square of each part evenly, for the parts (n,) of places, in their order."""
    first = np.searchsorted(owner, owner)
    many = np.searchsorted(owner, owner, side="right") - first
    within = np.arange(len(owner)) - first
    across = (within * 0.6180339887498949 + 0.5) % 1.0  # the golden section spreads them the other way
    return np.asarray((within + 0.5) / many), np.asarray(across)
