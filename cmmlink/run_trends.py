"""The trends that a run is the newest of: those of the characteristics that it changes, or of those that are asked for."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import datetime, timedelta

import numpy as np

from cmmlink import plant  # whose statistics are loaded when they serve
from cmmlink.errors import PlanError
from cmmlink.part_trend import PartTrend, Results, look_at_trend
from cmmlink.words import printable

_JUST_AFTER = timedelta(microseconds=1)
_RUNS = 101  # that a run is held against, itself among them, as for alarms
_MOST_BY_ITSELF = 4  # of characteristics that nobody asked for: a page each


@dataclass(frozen=True, slots=True, eq=False)
class RunTrend:
    """The trend of a characteristic up to a run.

    broken : the rules of Western Electric that this run breaks, in words; None where it has no value, or too few runs before it
    """

    found: PartTrend
    broken: tuple[str, ...] | None


def trends_of_run(
    results: Results, run: str, part: str, began: datetime, names: Sequence[str], *, last: int, asked: Sequence[str] = ()
) -> tuple[RunTrend, ...]:
    """The trends of a part that end with a run.

    names : of the run's characteristics, as the results have them
    last  : so many runs at most, this one among them
    asked : the characteristics that are wanted. None: those that do not conform in this run or break a rule with it, and the first one
            where there are none of these

    What was pushed of later runs has no part in it. Raises PlanError where the run has no such characteristic, or is not in the results.
    """
    unknown = next((name for name in asked if name not in names), None)
    if unknown is not None:
        raise PlanError(printable(f"run {run} has no characteristic {unknown!r}; it has: {', '.join(names) or 'none'}"))
    if not names:
        raise PlanError(printable(f"run {run} has no characteristics, and so no trend; leave out --trend"))
    until, broken, telling = began + _JUST_AFTER, dict[str, tuple[str, ...] | None](), list[str]()
    for name in asked or names:
        series = results.series(part, name, until=until, last=_RUNS)
        if not series.run or series.run[-1] != run:
            refused = f"run {run} is not among the results of {part} ({name}): `cmmlink plant push` sends it"
            raise PlanError(printable(f"{refused}; one that ended early has no trend"))
        measured = np.isfinite(series.value)
        is_known = measured[-1] and measured[:-1].sum() >= plant.FEWEST_BEFORE_ALARM
        broken[name] = plant.broken_words(series.value) if is_known else None
        telling += [name] if broken[name] or series.verdict[-1] != "conform" else []
    shown = list(asked) or telling[:_MOST_BY_ITSELF] or list(names[:1])
    trends = [look_at_trend(results, part, name, until=until, last=last) for name in shown]
    more = 0 if asked else len(telling) - len(shown)
    if more > 0:
        words = f"{more} more characteristics do not conform or break a rule in this run; --characteristic NAME shows them."
        trends[-1] = replace(trends[-1], notes=(words, *trends[-1].notes))
    return tuple(RunTrend(found, broken[name]) for name, found in zip(shown, trends, strict=True))
