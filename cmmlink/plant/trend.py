"""The trend of one characteristic: its control charts and its capability over the runs of a part, and what has just changed.

A value of a run that is not proven is shown and counts, since to leave it out would make the process look better than it was. A run
without a value keeps its place in the order and is counted among the missing ones.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cmmlink.plant.capability_indices import Capability, capability
from cmmlink.plant.control_charts import ControlChart, ControlCharts, individuals_charts, mean_range_charts
from cmmlink.plant.western_electric import RuleViolation

Array = NDArray[np.float64]

FORM_TYPES = ("line-profile",)
"""Types of characteristics whose value is the width of a zone: never negative, the smaller the better."""
FEWEST_BEFORE_ALARM = 20  # limits from fewer values are trial limits, which raise no alarm
_LEAP = "the step from the run before is larger than chance allows"
_FORM_IS_NOT_NORMAL = (
    "Deviations of form are never negative and not normal: the limits of control, three standard deviations to either side, are broken "
    "above more often than one time in 370, and the lower one says little."
)


@dataclass(frozen=True, slots=True, eq=False)
class Trend:
    """The course of a characteristic over n runs in the order of time, the oldest first.

    values       : (n,) in the unit of the characteristic; nan where a run gave none
    lower, upper : (n,) the limits of each run; nan where it has none on that side
    is_form      : whether the values are deviations of form
    subgroup     : how many runs in a row make one plotted mean; 1: single values are plotted
    charts       : None where there are too few values for any; of subgroups, those that are whole
    capability   : against the limits of the newest run; None where that has none, or there are too few values
    notes        : what was assumed and what speaks against it, in whole sentences, those of charts and capability among them
    """

    values: Array
    lower: Array
    upper: Array
    is_form: bool
    subgroup: int
    charts: ControlCharts | None
    capability: Capability | None
    notes: tuple[str, ...]

    def __post_init__(self) -> None:
        if not len(self.values) == len(self.lower) == len(self.upper):
            raise ValueError(f"expected as many limits as values, got {len(self.values)}, {len(self.lower)} and {len(self.upper)}")
        for array in (self.values, self.lower, self.upper):
            array.setflags(write=False)


def trend_of(
    values: ArrayLike,
    lower: ArrayLike,
    upper: ArrayLike,
    *,
    is_form: bool = False,
    subgroup: int = 1,
    unproven: int = 0,
) -> Trend:
    """The trend of a characteristic.

    values, lower, upper : (n,) of the runs in the order of time; nan where there is none
    subgroup             : from 1 to 100 runs in a row that were made under the same conditions
    unproven             : how many of the values belong to a verdict that is not proven
    """
    measured, low, high = (np.array(given, dtype=np.float64) for given in (values, lower, upper))
    size, notes = _size_of(measured, subgroup)
    is_form = is_form and not (measured < 0).any()
    charts = _charts_of(measured, size)
    found = None if charts is None else _capability_of(charts, low, high, is_form)
    if charts is None:
        notes = (*notes, f"{int(np.isfinite(measured).sum())} values are too few for a chart of control.")
    told = (*notes, *_notes_of_limits(low, high, is_form), *(found.notes if found else ()), *(charts.notes if charts else ()))
    if is_form and charts is not None:
        told = (*told, _FORM_IS_NOT_NORMAL)
    if unproven:
        told = (*told, f"NOT PROVEN: {unproven} of the values; what was not measured there may be worse.")
    return Trend(measured, low, high, is_form, size, charts, found, tuple(dict.fromkeys(told)))


def new_violations(chart: ControlChart) -> tuple[RuleViolation, ...]:
    """The rules that the newest plotted value breaks and the one before did not: a rule that stays broken is not new a second time."""
    there = np.flatnonzero(~np.isnan(chart.plotted))
    if len(there) < 2 or there[-1] != len(chart.plotted) - 1:
        return ()
    newest, before = int(there[-1]), int(there[-2])
    known = {(violation.rule, violation.above) for violation in chart.violations if violation.at == before}
    return tuple(one for one in chart.violations if one.at == newest and (one.rule, one.above) not in known)


def alarm_words(values: ArrayLike) -> tuple[str, ...]:
    """Why the newest run should be looked at: every rule that its value breaks, held against the limits of the runs before it.

    A rule that was broken with the run before as well is none of these: that has been told.

    values : (n,) in the order of time; nan where a run gave none. With few values before there are no limits and no alarm.
    """
    return _words_of(values, new_violations)


def broken_words(values: ArrayLike) -> tuple[str, ...]:
    """The same with every rule that the value of the newest run breaks, also one that was broken before."""
    return _words_of(values, lambda chart: tuple(one for one in chart.violations if one.at == len(chart.plotted) - 1))


def _words_of(values: ArrayLike, found: Callable[[ControlChart], Sequence[RuleViolation]]) -> tuple[str, ...]:
    """The words of what is found of the newest run on the charts, whose limits are those of the runs before it."""
    measured = np.array(values, dtype=np.float64)
    if np.isfinite(measured[:-1]).sum() < FEWEST_BEFORE_ALARM or not np.isfinite(measured[-1]):
        return ()
    charts = _charts_of(measured, 1, len(measured) - 1)
    if charts is None or not charts.within_sigma:
        return ()
    told = tuple(f"{one.words}, {'upwards' if one.above else 'downwards'}" for one in found(charts.location))
    return told or (_LEAP,) * bool(found(charts.spread))


def _size_of(measured: Array, subgroup: int) -> tuple[int, tuple[str, ...]]:
    """The size of the subgroups that can be drawn, and why it is another one than was stated."""
    if subgroup == 1:
        return 1, ()
    missing = int(np.isnan(measured).sum())
    if missing:
        words = f"Single values are drawn, and no subgroups of {subgroup}: {missing} runs gave no value, and a subgroup must be whole."
        return 1, (words,)
    left = len(measured) % subgroup
    return subgroup, (f"The first {left} runs belong to no whole subgroup and are left out of the charts.",) if left else ()


def _charts_of(measured: Array, subgroup: int, limits_from: int | None = None) -> ControlCharts | None:
    """The charts of single values or of subgroups, counted from the newest run; None where there is nothing to compute limits from."""
    if subgroup > 1:
        groups = measured[len(measured) % subgroup :].reshape(-1, subgroup)
        return mean_range_charts(groups, limits_from) if len(groups) > 1 else None
    there = ~np.isnan(measured[:limits_from])
    return individuals_charts(measured, limits_from) if (there[1:] & there[:-1]).any() else None


def _capability_of(charts: ControlCharts, lower: Array, upper: Array, is_form: bool) -> Capability | None:
    """The capability against the limits of the newest run."""
    low, high = (float(limits[-1]) for limits in (lower, upper))
    below, above = None if is_form or np.isnan(low) else low, None if np.isnan(high) else high
    if below is None and above is None:
        return None
    return capability(charts, below, above, is_form=is_form)


def _notes_of_limits(lower: Array, upper: Array, is_form: bool) -> tuple[str, ...]:
    """Say that there are no limits, or that they were others before."""
    sides = (upper,) if is_form else (lower, upper)
    if not len(upper) or all(np.isnan(side[-1]) for side in sides):
        return ("The newest run has no limits of this characteristic, so that no capability is stated.",)
    if any(len(np.unique(side)) > 1 for side in sides):  # all nan are one
        return ("The limits were changed between these runs; the capability is that against the newest ones.",)
    return ()
