"""The rules of Western Electric: which values of a control chart say that the process has changed.

Source: Western Electric Company, Statistical Quality Control Handbook, 1956, pages 25 to 28; also the NIST/SEMATECH e-Handbook, 6.3.2.
"""

from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

RuleNumber = Literal[1, 2, 3, 4]


@dataclass(frozen=True, slots=True)
class ControlLimits:
    """The lines of a control chart.

    sigma : standard deviation of what is plotted; of a chart of ranges the limits are not symmetric about the centre
    """

    lower: float
    centre: float
    upper: float
    sigma: float


class _Rule(NamedTuple):
    number: RuleNumber
    beyond_sigmas: float
    needed: int
    window: int
    words: str


_RULES = (
    _Rule(1, 3.0, 1, 1, "one value beyond three standard deviations"),
    _Rule(2, 2.0, 2, 3, "two of three values in a row beyond two standard deviations on one side"),
    _Rule(3, 1.0, 4, 5, "four of five values in a row beyond one standard deviation on one side"),
    _Rule(4, 0.0, 8, 8, "eight values in a row on one side of the centre line"),
)


@dataclass(frozen=True, slots=True)
class RuleViolation:
    """A rule that is broken, at the value that completes it.

    at     : index of the value with which the rule was broken, so that an alarm can be raised at that run
    points : indices of all values that count for it, the last of them `at`
    """

    rule: RuleNumber
    words: str
    at: int
    points: tuple[int, ...]
    above: bool


def rule_violations(plotted: NDArray[np.float64], limits: ControlLimits) -> tuple[RuleViolation, ...]:
    """All violations of the four rules, in the order of the values that complete them.

    plotted : (n,) values in the order of time. A value that is missing (nan) neither counts nor interrupts: the values around it are
              in a row, since a run without a value must not silence an alarm.
    A value on a line is not beyond it.
    """
    there = np.flatnonzero(~np.isnan(plotted))
    found = [
        violation
        for rule in _RULES
        for above in (True, False)
        for violation in _violations_of(rule, there, _is_beyond(rule, plotted[there], limits, above), above)
    ]
    return tuple(sorted(found, key=lambda violation: (violation.at, violation.rule)))


def limit_violations(plotted: NDArray[np.float64], limits: ControlLimits) -> tuple[RuleViolation, ...]:
    """Those values that lie outside of the limits: the only rule that is for ranges, which are not distributed symmetrically."""
    rule = _RULES[0]
    with np.errstate(invalid="ignore"):
        outside = np.flatnonzero((plotted > limits.upper) | (plotted < limits.lower)).tolist()
    return tuple(RuleViolation(1, rule.words, at, (at,), above=bool(plotted[at] > limits.upper)) for at in outside)


def _is_beyond(rule: _Rule, plotted: NDArray[np.float64], limits: ControlLimits, above: bool) -> NDArray[np.bool_]:
    """Whether each value lies beyond the line of the rule on that side."""
    away = rule.beyond_sigmas * limits.sigma
    return plotted > limits.centre + away if above else plotted < limits.centre - away


def _violations_of(rule: _Rule, there: NDArray[np.intp], beyond: NDArray[np.bool_], above: bool) -> list[RuleViolation]:
    """A violation for every value beyond the line with which enough of the last ones are beyond it."""
    found = []
    for last in np.flatnonzero(beyond):
        window = slice(max(0, last - rule.window + 1), last + 1)
        points = there[window][beyond[window]]
        if len(points) >= rule.needed:
            found.append(RuleViolation(rule.number, rule.words, int(there[last]), tuple(points.tolist()), above))
    return found
