"""The distance by Anderson and Darling between values and a distribution, which looks hardest at the tails."""

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

# 5 % of normal samples whose mean and standard deviation are estimated lie beyond it (D'Agostino, Stephens, Goodness-of-Fit Techniques,
# 1986, table 4.7), for the distance times 1 + 0.75/n + 2.25/n^2.
_NORMAL_LIMIT = 0.752
_LEAST_SHARE = 1e-300


def anderson_darling(shares: NDArray[np.float64]) -> float:
    """The distance A^2 of n values from a distribution.

    shares : (n,) the share of the distribution that lies below each value, in any order
    """
    below = np.clip(np.sort(shares), _LEAST_SHARE, 1 - 2**-53)
    n = len(below)
    weights = 2 * np.arange(1, n + 1) - 1
    return float(-n - np.mean(weights * (np.log(below) + np.log1p(-below[::-1]))))


def normal_distance(values: NDArray[np.float64]) -> float:
    """The distance from the normal distribution with mean and standard deviation of the values, corrected for their number."""
    n = len(values)
    shares: NDArray[np.float64] = ndtr((values - values.mean()) / values.std(ddof=1))
    return anderson_darling(shares) * (1 + 0.75 / n + 2.25 / n**2)


def is_normal(values: NDArray[np.float64]) -> bool:
    """Whether nothing at the level of 5 % speaks against a normal distribution; not a proof that it is one."""
    return normal_distance(values) <= _NORMAL_LIMIT
