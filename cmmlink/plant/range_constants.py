"""The constants of control charts for ranges, computed from the distribution of the range and taken from no table."""

import math
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

_REACH = 9.0  # standard deviations: beyond it lies less than 1e-18 of a normal distribution
_STEPS = 121  # of the trapezoidal rule, which is exact to round-off for an analytic integrand that vanishes at both ends
_NODES = 80  # of the rule by Gauss and Legendre over the range
_LARGEST_SIZE = 100


@dataclass(frozen=True, slots=True)
class RangeConstants:
    """What links the range of a subgroup of normal values to their standard deviation; names as in the literature.

    d2, d3     : mean and standard deviation of the range, in standard deviations of a value
    c4         : mean of the standard deviation of the subgroup, in the same unit
    A2, D3, D4 : the limits of means are `mean +- A2 * mean range`; those of ranges are D3 and D4 times the mean range
    """

    size: int
    d2: float
    d3: float
    c4: float
    A2: float
    D3: float
    D4: float


@cache
def range_constants(size: int) -> RangeConstants:
    """The constants of subgroups of that many values, from 2 to 100."""
    if not 2 <= size <= _LARGEST_SIZE:
        raise ValueError(f"a subgroup has from 2 to {_LARGEST_SIZE} values, and {size} were given")
    nodes, weights = np.polynomial.legendre.leggauss(_NODES)
    width = _REACH * (nodes + 1)
    beyond = (1 - _distribution_of_range(width, size)) * weights * _REACH
    d2 = float(np.sum(beyond))
    d3 = math.sqrt(2 * float(np.sum(width * beyond)) - d2 * d2)
    c4 = math.sqrt(2 / (size - 1)) * math.exp(math.lgamma(size / 2) - math.lgamma((size - 1) / 2))
    return RangeConstants(size, d2, d3, c4, 3 / (d2 * math.sqrt(size)), max(0.0, 1 - 3 * d3 / d2), 1 + 3 * d3 / d2)


def _distribution_of_range(width: NDArray[np.float64], size: int) -> NDArray[np.float64]:
    """The probability that the range of so many standard normal values is at most each width (Tippett 1925).

    It is n times the integral over x of phi(x) (Phi(x + w) - Phi(x))^(n - 1), where x is the smallest value.
    """
    smallest = np.linspace(-_REACH, _REACH, _STEPS)  # (k,)
    density = np.exp(-(smallest**2) / 2) / math.sqrt(2 * math.pi)
    between = ndtr(smallest[:, None] + width) - ndtr(smallest)[:, None]  # (k, w)
    step = smallest[1] - smallest[0]
    found: NDArray[np.float64] = size * step * (density @ between ** (size - 1))
    return found
