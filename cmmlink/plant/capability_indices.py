"""Capability of a process: Cp and Cpk from the spread at short term, Pp and Ppk from that of all values, with confidence limits.

Sources: NIST/SEMATECH e-Handbook of Statistical Methods, 6.1.6; A. F. Bissell, How Reliable is Your Capability Index?, Applied
Statistics 39 (1990) 331, for the limits of Cpk and Ppk; ISO 22514-2 for the general method by percentiles, where the distance from the
median to a limit is divided by the distance from the median to the percentile of 99.865 % or 0.135 %.

A characteristic of size is taken as normal when nothing speaks against it. A deviation of form has one limit, cannot be negative, and is
not normal: a formula with three standard deviations would call it more capable than it is. A folded normal distribution is fitted to it,
and the fit is tested. Where there are enough values that some lie in the tail itself, percentiles of the values need no distribution.
"""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2, norm

from cmmlink.plant.control_charts import ControlCharts
from cmmlink.plant.folded_normal import FoldedNormal, fit_folded_normal
from cmmlink.plant.goodness_of_fit import anderson_darling, is_normal

Distribution = Literal["normal", "folded normal", "percentiles of the values", "none"]

UPPER_SHARE = float(norm.cdf(3.0))  # 99.865 %: as much of a normal distribution as lies below three standard deviations
FEWEST_VALUES = 25  # from fewer, the limits of an index lie 40 % and more apart
FEWEST_OF_FORM = 50  # a fitted tail takes more
FEWEST_IN_TAIL = math.ceil(1 / (1 - UPPER_SHARE))  # 741: from so many on, a value is expected beyond the percentile
_REPLICATES = 400
_SEED = 22514
_LEVEL = 0.05


@dataclass(frozen=True, slots=True)
class CapabilityIndex:
    """An index with its confidence limits. All three are None where it is not stated, and `reason` says why.

    lower, upper : also None where the index is stated and its limits are not; `reason` says why
    """

    value: float | None
    lower: float | None = None
    upper: float | None = None
    reason: str = ""


@dataclass(frozen=True, slots=True)
class Capability:
    """What a process can hold between its limits.

    cp, cpk       : from the spread at short term: what it could do if its location stood still
    pp, ppk       : from the spread of all values: what it did
    overall_sigma : standard deviation of all values, with n - 1
    distribution  : what the indices assume of the values
    notes         : what was assumed and what speaks against it, in whole sentences
    """

    cp: CapabilityIndex
    cpk: CapabilityIndex
    pp: CapabilityIndex
    ppk: CapabilityIndex
    mean: float
    overall_sigma: float
    values: int
    distribution: Distribution
    confidence: float
    notes: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class _Zone:
    """The limits that were asked about; None where a characteristic has none on that side."""

    lower: float | None
    upper: float | None
    confidence: float


def capability(
    charts: ControlCharts, lower: float | None, upper: float | None, *, confidence: float = 0.95, is_form: bool = False
) -> Capability:
    """The indices of the values of a control chart.

    lower, upper : limits of the characteristic in its own unit; None: it has none on that side. Zero is not a limit of a deviation of
                   form but its natural bound, so that one has an upper limit alone.
    confidence   : of the limits of the indices, two-sided
    is_form      : whether the values are deviations of form: never negative, the smaller the better
    """
    _check(charts.values, lower, upper, confidence, is_form)
    zone = _Zone(lower, upper, confidence)
    n = len(charts.values)
    fewest = FEWEST_OF_FORM if is_form else FEWEST_VALUES
    if n < fewest:
        return _unstated(charts, zone, f"{n} values are too few: at least {fewest} are needed")
    if not np.ptp(charts.values):
        return _unstated(charts, zone, "all values are equal, so that their resolution is too coarse to show a spread")
    if n >= FEWEST_IN_TAIL and (is_form or not is_normal(charts.values)):
        return _from_percentiles(charts, zone)
    if is_form and upper is not None:
        return _from_folded(charts, zone, upper)
    if not is_normal(charts.values):
        reason = f"the values are not normal (Anderson-Darling, 5 %), and {n} are too few for percentiles: at least {FEWEST_IN_TAIL}"
        return _unstated(charts, zone, reason)
    return _from_normal(charts, zone)


def _check(values: NDArray[np.float64], lower: float | None, upper: float | None, confidence: float, is_form: bool) -> None:
    """Refuse what has no meaning."""
    if lower is None and upper is None:
        raise ValueError("a capability needs a limit on at least one side")
    if lower is not None and upper is not None and not lower < upper:
        raise ValueError(f"the lower limit {lower} has to lie below the upper one {upper}")
    if not 0 < confidence < 1:
        raise ValueError(f"the confidence has to lie between 0 and 1, and is {confidence}")
    if is_form and (lower is not None or (values < 0).any()):
        raise ValueError("a deviation of form is never negative and has an upper limit alone")


def _from_normal(charts: ControlCharts, zone: _Zone) -> Capability:
    """All four indices of normal values."""
    mean, n = float(charts.values.mean()), len(charts.values)
    overall = float(charts.values.std(ddof=1))
    if charts.within_sigma:
        at_short_term = _normal_indices(zone, mean, charts.within_sigma, n, charts.degrees_of_freedom)
    else:
        at_short_term = (CapabilityIndex(None, reason="the spread at short term is zero: the resolution is too coarse"),) * 2
    notes = (*_notes(charts), "The values were taken as normal: nothing speaks against it at the level of 5 % (Anderson-Darling).")
    of_all = _normal_indices(zone, mean, overall, n, n - 1)
    return Capability(*at_short_term, *of_all, mean, overall, n, "normal", zone.confidence, notes)


def _normal_indices(zone: _Zone, mean: float, sigma: float, n: int, freedom: float) -> tuple[CapabilityIndex, CapabilityIndex]:
    """Both indices from one standard deviation of so many degrees of freedom: spread alone, and with location.

    The limits of the first are exact by chi-square where the standard deviation is that of all values; those of the second are
    Bissell's: index +- z sqrt(1 / (9 n) + index^2 / (2 freedom)).
    """
    sides = [(zone.upper - mean) / (3 * sigma)] if zone.upper is not None else []
    sides += [(mean - zone.lower) / (3 * sigma)] if zone.lower is not None else []
    worse, tail = min(sides), (1 - zone.confidence) / 2
    half = float(norm.ppf(1 - tail)) * math.sqrt(1 / (9 * n) + worse**2 / (2 * freedom))
    with_location = CapabilityIndex(worse, worse - half, worse + half)
    if zone.lower is None or zone.upper is None:
        return _one_sided(), with_location
    spread = (zone.upper - zone.lower) / (6 * sigma)
    low, high = (spread * math.sqrt(float(chi2.ppf(share, freedom)) / freedom) for share in (tail, 1 - tail))
    return CapabilityIndex(spread, low, high), with_location


def _from_folded(charts: ControlCharts, zone: _Zone, upper: float) -> Capability:
    """Ppk of deviations of form from a folded normal distribution, or nothing where the values do not follow one.

    The same samples drawn from the fitted distribution, each fitted anew, give the level of the test and the confidence limits.
    """
    values, fitted = charts.values, fit_folded_normal(charts.values)
    drawn = fitted.draw(np.random.default_rng(_SEED), (_REPLICATES, len(values)))
    fits = [fit_folded_normal(sample) for sample in drawn]
    distance = anderson_darling(fitted.share_below(values))
    distances = [anderson_darling(fit.share_below(sample)) for fit, sample in zip(fits, drawn, strict=True)]
    level = (1 + sum(other >= distance for other in distances)) / (1 + _REPLICATES)
    if level < _LEVEL:
        reason = f"the values do not follow a folded normal distribution (level {level:.3f} of the test by Anderson and Darling)"
        return _unstated(charts, zone, f"{reason}, and {len(values)} are too few for percentiles: at least {FEWEST_IN_TAIL}")
    others, tail = [_upper_index(upper, fit) for fit in fits], (1 - zone.confidence) / 2
    low, high = np.quantile(others, [tail, 1 - tail]).tolist()
    ppk = CapabilityIndex(_upper_index(upper, fitted), low, high)
    note = (
        f"A folded normal distribution was fitted to the deviations of form and not refused (level {level:.3f}, Anderson-Darling); "
        f"{len(values)} values do not exclude a longer tail."
    )
    return _of_form(charts, zone, ppk, "folded normal", note)


def _upper_index(upper: float, fit: FoldedNormal) -> float:
    """Distance from the median to the upper limit over that to the percentile of 99.865 %."""
    median = fit.quantile(0.5)
    return (upper - median) / (fit.quantile(UPPER_SHARE) - median)


def _from_percentiles(charts: ControlCharts, zone: _Zone) -> Capability:
    """Pp and Ppk from percentiles of the values themselves."""
    low, median, high = (float(np.quantile(charts.values, share)) for share in (1 - UPPER_SHARE, 0.5, UPPER_SHARE))
    unbounded = "the limits of an index from percentiles of the values are not stated: they hang on a few values in the tail"
    sides = [(zone.upper - median) / (high - median)] if zone.upper is not None else []
    sides += [(median - zone.lower) / (median - low)] if zone.lower is not None else []
    pp = _one_sided()
    if zone.lower is not None and zone.upper is not None:
        pp = CapabilityIndex((zone.upper - zone.lower) / (high - low), reason=unbounded)
    note = "The indices come from percentiles of the values (0.135 %, 50 %, 99.865 %; ISO 22514-2), which assume no distribution."
    return _of_form(charts, zone, CapabilityIndex(min(sides), reason=unbounded), "percentiles of the values", note, pp)


def _of_form(
    charts: ControlCharts, zone: _Zone, ppk: CapabilityIndex, distribution: Distribution, note: str, pp: CapabilityIndex | None = None
) -> Capability:
    """A capability of values that are not normal: the spread at short term says nothing of their tail."""
    no_short_term = CapabilityIndex(None, reason="the values are not normal, so that the mean range says nothing of their tail")
    mean, overall = float(charts.values.mean()), float(charts.values.std(ddof=1))
    notes = (*_notes(charts), note)
    both = (pp or _one_sided(), ppk)
    return Capability(no_short_term, no_short_term, *both, mean, overall, len(charts.values), distribution, zone.confidence, notes)


def _one_sided() -> CapabilityIndex:
    """What stands for the width of the zone over the spread where there is no width."""
    return CapabilityIndex(None, reason="the characteristic has a limit on one side alone, so that its zone has no width")


def _unstated(charts: ControlCharts, zone: _Zone, reason: str) -> Capability:
    """A capability that states nothing but why."""
    none, n = CapabilityIndex(None, reason=reason), len(charts.values)
    mean, overall = float(charts.values.mean()), float(charts.values.std(ddof=1))
    notes = (*_notes(charts), f"No capability is stated: {reason}.")
    return Capability(none, none, none, none, mean, overall, n, "none", zone.confidence, notes)


def _notes(charts: ControlCharts) -> tuple[str, ...]:
    """What speaks against any index of these values."""
    broken = {violation.at for chart in (charts.location, charts.spread) for violation in chart.violations}
    notes = []
    if broken:
        notes.append(f"The process is not in control at {len(broken)} of the plotted points: an index of it foretells nothing.")
    if charts.missing:
        notes.append(f"Without a value: {charts.missing} runs, for which no index speaks.")
    return tuple(notes)
