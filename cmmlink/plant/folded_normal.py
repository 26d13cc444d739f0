"""The folded normal distribution: that of |x| when x is normal, which ISO 22514-2 proposes for deviations of form.

Source of the fit by moments: F. C. Leone, L. S. Nelson, R. B. Nottingham, The Folded Normal Distribution, Technometrics 3 (1961) 543.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.special import ndtr

_LEAST_RATIO = math.sqrt(2 / math.pi)  # of the mean to the root mean square, of a half-normal distribution
_FAR = 30.0  # standard deviations from zero: beyond, the fold is not seen and the distribution is normal


@dataclass(frozen=True, slots=True)
class FoldedNormal:
    """The distribution of |x| with x normal of that mean and standard deviation."""

    mean: float
    sigma: float

    def quantile(self, share: float) -> float:
        """The value below which that share of all values lies."""
        ratio = self.mean / self.sigma
        farthest = ratio + _FAR
        return self.sigma * float(brentq(lambda value: _share_below(value, ratio) - share, 0.0, farthest, xtol=1e-13))

    def share_below(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """The share of all values that lies below each one."""
        found: NDArray[np.float64] = ndtr((values - self.mean) / self.sigma) - ndtr((-values - self.mean) / self.sigma)
        return found

    def draw(self, rng: np.random.Generator, shape: tuple[int, ...]) -> NDArray[np.float64]:
        """Values drawn from it."""
        return np.abs(rng.normal(self.mean, self.sigma, shape))


def fit_folded_normal(values: NDArray[np.float64]) -> FoldedNormal:
    """The folded normal distribution with the mean and the mean square of the values, which are not negative and not all equal.

    Values that spread more than a half-normal distribution can are given that one: a test of the fit has to tell.
    """
    root = math.sqrt(float(np.mean(values**2)))
    ratio = float(values.mean()) / root
    if ratio <= _LEAST_RATIO:
        return FoldedNormal(0.0, root)
    if ratio >= _ratio_of(_FAR):
        return FoldedNormal(float(values.mean()), float(values.std()))
    theta = float(brentq(lambda theta: _ratio_of(theta) - ratio, 0.0, _FAR, xtol=1e-12))
    sigma = root / math.sqrt(1 + theta * theta)
    return FoldedNormal(theta * sigma, sigma)


def _share_below(value: float, ratio: float) -> float:
    """The share below a value, of a distribution whose normal one lies so far from zero; both in standard deviations."""
    return (math.erf((value - ratio) / math.sqrt(2)) + math.erf((value + ratio) / math.sqrt(2))) / 2


def _ratio_of(theta: float) -> float:
    """Mean over root mean square of the folded distribution whose normal one lies theta standard deviations from zero."""
    mean = _LEAST_RATIO * math.exp(-theta * theta / 2) + theta * math.erf(theta / math.sqrt(2))
    return mean / math.sqrt(1 + theta * theta)
