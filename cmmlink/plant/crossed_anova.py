"""The analysis of variance of parts crossed with operators, both drawn at random, for any number of characteristics at once.

Source: AIAG, Measurement Systems Analysis, 4th edition 2010, appendix A; the expected mean squares are those of the two-way model with
random effects.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Source = Literal["part", "operator", "interaction", "repeatability"]


@dataclass(frozen=True, slots=True, eq=False)
class CrossedSums:
    """Sums of squares of (p, o, r, ...) values by their source; each has the shape of the trailing dimensions.

    freedom : degrees of freedom by source
    shape   : p, o and r
    """

    squares: dict[Source, NDArray[np.float64]]
    freedom: dict[Source, int]
    shape: tuple[int, int, int]

    def mean_square(self, source: Source) -> NDArray[np.float64]:
        """Sum of squares over degrees of freedom."""
        return self.squares[source] / self.freedom[source]


@dataclass(frozen=True, slots=True, eq=False)
class VarianceComponents:
    """Variances by their source, none negative; each has the shape of the trailing dimensions of the values.

    cut : sources whose estimate was negative somewhere and was cut to zero
    """

    repeatability: NDArray[np.float64]
    operator: NDArray[np.float64]
    interaction: NDArray[np.float64]
    part: NDArray[np.float64]
    reproducibility: NDArray[np.float64]
    gauge: NDArray[np.float64]
    total: NDArray[np.float64]
    cut: tuple[str, ...]


def sums_of_squares(values: NDArray[np.float64]) -> CrossedSums:
    """The sums of squares, from deviations and not from differences of large sums.

    values : (p, o, r, ...) p parts, o operators, r repeats
    """
    p, o, r = values.shape[:3]
    whole = values.mean(axis=(0, 1, 2), keepdims=True)
    part = values.mean(axis=(1, 2), keepdims=True) - whole
    operator = values.mean(axis=(0, 2), keepdims=True) - whole
    cell = values.mean(axis=2, keepdims=True)
    inner = cell - whole - part - operator

    def squared(deviation: NDArray[np.float64], times: int) -> NDArray[np.float64]:
        found: NDArray[np.float64] = np.asarray(times * np.sum(deviation**2, axis=(0, 1, 2)))
        return found

    squares: dict[Source, NDArray[np.float64]] = {
        "part": squared(part, o * r),
        "operator": squared(operator, p * r),
        "interaction": squared(inner, r),
        "repeatability": squared(values - cell, 1),
    }
    freedom: dict[Source, int] = {
        "part": p - 1,
        "operator": o - 1,
        "interaction": (p - 1) * (o - 1),
        "repeatability": p * o * (r - 1),
    }
    return CrossedSums(squares, freedom, (p, o, r))


def components_of(sums: CrossedSums, pooled: NDArray[np.bool_]) -> VarianceComponents:
    """The variances that the sums of squares stand for.

    pooled : whether the interaction counts as repeatability; of the shape of the sums
    """
    p, o, r = sums.shape
    kept = sums.mean_square("interaction"), sums.mean_square("repeatability")
    both = sums.squares["interaction"] + sums.squares["repeatability"]
    noise = both / (sums.freedom["interaction"] + sums.freedom["repeatability"])
    against, repeatability = np.where(pooled, noise, kept[0]), np.where(pooled, noise, kept[1])
    estimates = {
        "operator": (sums.mean_square("operator") - against) / (p * r),
        "interaction": (against - repeatability) / r,
        "part": (sums.mean_square("part") - against) / (o * r),
    }
    cut = tuple(source for source, estimate in estimates.items() if (estimate < 0).any())
    operator, interaction, part = (np.maximum(estimate, 0) for estimate in estimates.values())
    reproducibility = operator + interaction
    gauge = repeatability + reproducibility
    return VarianceComponents(repeatability, operator, interaction, part, reproducibility, gauge, gauge + part, cut)
