"""Control charts by Shewhart: individuals with moving ranges, and means with ranges; their limits come from the spread at short term.

Sources: NIST/SEMATECH e-Handbook of Statistical Methods, 6.3.2; D. C. Montgomery, Introduction to Statistical Quality Control, chapter 6.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cmmlink.plant.range_constants import RangeConstants, range_constants
from cmmlink.plant.western_electric import ControlLimits, RuleViolation, limit_violations, rule_violations

_FEW = 20  # limits from fewer points are called trial limits by the e-Handbook and by Montgomery
# Covariance of two moving ranges that share a value, over the variance of a value: E|X1 - X2||X2 - X3| less the square of d2.
_SHARED = 4 / math.pi * (math.sqrt(3) / 2 + math.pi / 12 - 1)


@dataclass(frozen=True, slots=True, eq=False)
class ControlChart:
    """One line of a control chart: what is plotted, its limits and the rules that it breaks.

    plotted : (n,) nan where there is nothing to plot
    """

    plotted: NDArray[np.float64]
    limits: ControlLimits
    violations: tuple[RuleViolation, ...]


@dataclass(frozen=True, slots=True, eq=False)
class ControlCharts:
    """The chart of the location of a process and that of its spread.

    values             : (m,) all single values in the order of time, without the missing ones
    missing            : how many runs gave no value
    within_sigma       : standard deviation at short term, from the mean range; not that of all values
    degrees_of_freedom : how many within_sigma is worth, which is fewer than the values
    notes              : what was assumed, in whole sentences
    """

    location: ControlChart
    spread: ControlChart
    values: NDArray[np.float64]
    missing: int
    within_sigma: float
    degrees_of_freedom: float
    notes: tuple[str, ...]

    def __post_init__(self) -> None:
        self.values.setflags(write=False)
        self.location.plotted.setflags(write=False)
        self.spread.plotted.setflags(write=False)


def individuals_charts(values: ArrayLike, limits_from: int | None = None) -> ControlCharts:
    """Charts of single values and of the moving ranges of two neighbours.

    values      : (n,) in the order of time; nan where a run gave no value. No range is taken across such a gap.
    limits_from : how many of the first runs the limits are computed from; the later ones are held against them. None: all.
    """
    plotted = np.array(values, dtype=np.float64)
    if plotted.ndim != 1 or np.isinf(plotted).any():
        raise ValueError(f"a chart of individuals takes finite numbers in one row, and nan for a run without a value; got {plotted.shape}")
    ranges = np.concatenate([[np.nan], np.abs(np.diff(plotted))]) if len(plotted) else plotted.copy()
    first = _first(len(plotted), limits_from)
    counted = ~np.isnan(ranges[:first])
    if not counted.any():
        raise ValueError("the limits of a chart of individuals need at least two values that follow each other, and there are none")
    constants = range_constants(2)
    mean_range = float(ranges[:first][counted].mean())
    centre = float(np.nanmean(plotted[:first]))
    sigma = mean_range / constants.d2
    neighbours = int(np.count_nonzero(counted[1:] & counted[:-1]))
    variance = (int(counted.sum()) * constants.d3**2 + 2 * neighbours * _SHARED) / int(counted.sum()) ** 2
    there = ~np.isnan(plotted)
    notes = _notes(int(there[:first].sum()), "values", int((~there).sum()), sigma)
    return _charts((plotted, ranges, plotted[there]), (centre, sigma, mean_range), constants, variance, notes)


def mean_range_charts(subgroups: ArrayLike, limits_from: int | None = None) -> ControlCharts:
    """Charts of the means and of the ranges of subgroups that were taken together.

    subgroups   : (k, n) k subgroups in the order of time, each of n values from 2 to 100. A subgroup with a missing value is refused:
                  its range is smaller for what it lacks, so that it would narrow the limits.
    limits_from : how many of the first subgroups the limits are computed from. None: all.
    """
    groups = np.array(subgroups, dtype=np.float64)
    if groups.ndim != 2 or not len(groups):
        raise ValueError(f"a chart of means takes subgroups of equal size, (k, n), and got {groups.shape}")
    if not np.isfinite(groups).all():
        broken = int(np.flatnonzero(~np.isfinite(groups).all(axis=1))[0])
        raise ValueError(f"subgroup {broken} lacks a value: a chart of means and ranges takes whole subgroups; draw one of individuals")
    size = groups.shape[1]
    constants = range_constants(size)
    means, ranges = groups.mean(axis=1), np.ptp(groups, axis=1)
    first = _first(len(groups), limits_from)
    mean_range, centre = float(ranges[:first].mean()), float(means[:first].mean())
    sigma = mean_range / constants.d2
    notes = _notes(first, "subgroups", 0, sigma)
    drawn = (centre, sigma, mean_range)
    return _charts((means, ranges, groups.ravel()), drawn, constants, constants.d3**2 / first, notes, mean_of=size)


def _charts(
    drawn: tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]],
    found: tuple[float, float, float],
    constants: RangeConstants,
    variance: float,
    notes: tuple[str, ...],
    mean_of: int = 1,
) -> ControlCharts:
    """Both charts of what is plotted.

    drawn    : location, ranges and single values
    found    : centre, standard deviation at short term and mean range
    variance : that of the mean range, over the variance of a value
    """
    location, ranges, values = drawn
    centre, sigma, mean_range = found
    of_mean = sigma / math.sqrt(mean_of)
    limits = ControlLimits(centre - 3 * of_mean, centre, centre + 3 * of_mean, of_mean)
    of_range = ControlLimits(constants.D3 * mean_range, mean_range, constants.D4 * mean_range, constants.d3 * sigma)
    return ControlCharts(
        ControlChart(location, limits, rule_violations(location, limits)),
        ControlChart(ranges, of_range, limit_violations(ranges, of_range)),
        values,
        int(np.isnan(location).sum()),
        sigma,
        _worth(variance / constants.d2**2),
        notes,
    )


def _worth(relative_variance: float) -> float:
    """Degrees of freedom of a standard deviation from ranges whose relative variance is that (P. B. Patnaik, Biometrika 37, 1950)."""
    return 1 / (2 * math.sqrt(1 + 2 * relative_variance) - 2)


def _first(there: int, limits_from: int | None) -> int:
    """How many runs the limits are computed from."""
    if limits_from is not None and not 1 <= limits_from <= there:
        raise ValueError(f"limits_from has to lie between 1 and the {there} that are there, and is {limits_from}")
    return there if limits_from is None else limits_from


def _notes(counted: int, kind: str, missing: int, sigma: float) -> tuple[str, ...]:
    """What stands beside the charts."""
    notes = []
    if counted < _FEW:
        notes.append(f"The limits come from {counted} {kind}; those from fewer than {_FEW} are trial limits.")
    if missing:
        notes.append(f"Without a value: {missing} runs, of which the chart says nothing.")
    if not sigma:
        notes.append("The limits have no width: all values inside of the ranges are equal, so that their resolution is too coarse.")
    return tuple(notes)
