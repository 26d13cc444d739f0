"""Characteristics of a stack judged: worked out of the numbers of its sections, and never better than these.

A section without a result, or one of whose numbers something is in doubt, proves nothing, and neither does a value that needs it. What
sound sections prove to be out of tolerance stays proven, whatever the others are.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from inspection.characteristics.characteristic import CharacteristicResult, consumption_of, verdict_of
from inspection.characteristics.section_value import SectionValue, Unit, angle_within_half_a_turn, no_places
from inspection.characteristics.stack import StackedSections, bow, fit_stacking_axis, relative_twist, taper
from inspection.characteristics.stack_characteristic import (
    MeasuredSection,
    SectionShare,
    StackCharacteristic,
    StackCharacteristicResult,
)
from inspection.conclusion import Reason
from inspection.evaluation.stack_uncertainty import ADDED, drawing_of_stack, uncertainty_of_stack
from inspection.rigid import RigidTransform
from inspection.tolerance import DecisionRule, decision_words
from inspection.verdict import Verdict

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_SAME_HEIGHT_MM = 1e-9
_FEWEST_OFF_A_LINE = 3
_MOST_DOUBTS = 3  # that are told
_MOST_HEIGHTS = 6  # that are named
_TURNED_MEAN = "its directions are those of the nominals, turned by the mean twist of the sections: the plan has no datum"
_ALONG_NORMAL = "it is counted from the direction in which the surface was cut"


class _Values(NamedTuple):
    """Values (k,) or (1,), which sections (k or 1, k) each of them needs, the value of the nominal, and what was assumed."""

    value: Array
    needs: Flags
    nominal: float
    unit: Unit
    method: str
    notes: tuple[str, ...] = ()


def judge_stack(
    asked: Sequence[StackCharacteristic],
    sections: Sequence[MeasuredSection],
    lost: Reason | None = None,
    decision: DecisionRule = "iso-14253-1",
) -> tuple[StackCharacteristicResult, ...]:
    """Every characteristic of a stack whose sections stand at rising heights.

    lost     : why sections that were asked for are missing; nothing conforms then
    decision : how U counts
    """
    if any(one.height_mm >= other.height_mm for one, other in pairwise(sections)):
        raise ValueError("the sections of a stack stand at rising heights")
    return tuple(_judge(one, sections, lost, decision) for one in asked)


def _judge(
    asked: StackCharacteristic, sections: Sequence[MeasuredSection], lost: Reason | None, decision: DecisionRule
) -> StackCharacteristicResult:
    doubts = [_doubts(asked, section) for section in sections]
    sound = np.array([not doubt for doubt in doubts], dtype=bool)
    values = _evaluate(asked, sections)
    nominal = values.nominal if math.isnan(asked.nominal_value) else asked.nominal_value
    deviation = values.value - nominal
    if values.unit == "deg":
        deviation = np.array([angle_within_half_a_turn(one) if math.isfinite(one) else math.nan for one in deviation.tolist()])
    proven = np.isfinite(deviation) & (sound | ~values.needs).all(axis=1)
    uncertainty = _uncertainty(asked, sections, len(deviation))
    guards = np.zeros(len(deviation)) if decision == "simple" else uncertainty
    verdicts = [
        verdict_of(one, asked.lower, asked.upper, guard) if is_proven else Verdict.UNCERTAIN
        for one, is_proven, guard in zip(deviation.tolist(), proven.tolist(), guards.tolist(), strict=True)
    ]
    drawing = drawing_of_stack(asked, sections)
    misled = [
        verdict is not Verdict.UNCERTAIN and verdict_of(one, asked.lower, asked.upper, guard + drawing) is not verdict
        for verdict, one, guard in zip(verdicts, deviation.tolist(), guards.tolist(), strict=True)
    ]
    verdicts = [Verdict.UNCERTAIN if doubted else verdict for verdict, doubted in zip(verdicts, misled, strict=True)]
    verdict = max(verdicts) if lost is None else max(*verdicts, Verdict.UNCERTAIN)
    worst = _worst(deviation, uncertainty, verdicts, asked)
    asked, added = replace(asked, uncertainty=float(np.nan_to_num(uncertainty[worst]))), not asked.uncertainty and uncertainty[worst] > 0
    heights = [section.height_mm for section in sections] if len(verdicts) == len(sections) else []
    at = heights[worst] if heights else math.nan
    told = [] if lost is None else [lost]
    if _lies_straight(asked, len(sections)):
        told.append(Reason("no-value", "Two sections lie on a straight line whatever the part is; cut a third one."))
    if misled[worst]:
        words = f"It is nearer to a limit than the {drawing:.2g} by which the sections that were drawn may mislead"
        told.insert(0, Reason("within-uncertainty", f"{words}; measure their edges more densely."))
    elif verdicts[worst] is not Verdict.CONFORM and proven[worst]:
        told.insert(0, _limit_reason(asked, values, (nominal, float(deviation[worst]), float(values.value[worst])), verdicts[worst], at))
    reasons = (*told, *_told_doubts(sections, doubts)) if verdict is not Verdict.CONFORM else ()
    found = CharacteristicResult(
        name=asked.name,
        type=asked.type,
        method=values.method,
        value=float(values.value[worst]),
        nominal=nominal,
        unit=values.unit,
        lower=asked.lower,
        upper=asked.upper,
        deviation=float(deviation[worst]),
        consumption=consumption_of(float(deviation[worst]), asked.lower, asked.upper),
        uncertainty=asked.uncertainty,
        rule=decision_words(decision, asked.uncertainty, asked.upper - asked.lower, values.unit),
        verdict=verdict,
        reasons=reasons,
        fit="none" if asked.type == "taper" else "datum" if asked.datum is not None else "best fit of each section",
        region_words="stack" if not heights else "each section",
        notes=(*values.notes, *([f"the drawn sections may mislead by {drawing:.2g}"] if drawing else []), *([ADDED] if added else [])),
        drawing=drawing,
    )
    rows = zip(heights, values.value.tolist(), deviation.tolist(), verdicts, strict=True) if heights else ()
    return StackCharacteristicResult(found, at, tuple(SectionShare(*row) for row in rows))


def _uncertainty(asked: StackCharacteristic, sections: Sequence[MeasuredSection], count: int) -> Array:
    """U of each of so many values: its own where the characteristic states one, else what follows from that of the sections."""
    if asked.uncertainty:
        return np.full(count, asked.uncertainty)
    heights = np.array([section.height_mm for section in sections])
    root, tip = _section_at(heights, asked.root_mm, 0), _section_at(heights, asked.tip_mm, -1)
    reference = _section_at(heights, asked.reference_mm, 0)
    if root is None or tip is None or reference is None:
        return np.full(count, np.nan)
    return uncertainty_of_stack(asked, sections, root, tip, reference)


def _doubts(asked: StackCharacteristic, section: MeasuredSection) -> tuple[Reason, ...]:
    """Why nothing is proven of the numbers of a section; none where they are sound."""
    if not section.numbers:
        return section.reasons or (Reason("no-value", "It has no result."),)
    found = [section.numbers[number.name] for number in asked.numbers]
    told = [reason for one in found if one.verdict is not Verdict.CONFORM for reason in one.reasons]
    return tuple(dict.fromkeys(told))


def _told_doubts(sections: Sequence[MeasuredSection], doubts: Sequence[tuple[Reason, ...]]) -> tuple[Reason, ...]:
    """The first doubt of each section in words, with the heights of those that share it; of many doubts the first few."""
    shared: dict[Reason, list[str]] = {}
    for section, doubt in zip(sections, doubts, strict=True):
        if doubt:
            shared.setdefault(doubt[0], []).append(f"{section.height_mm:g}")
    told = []
    for reason, heights in list(shared.items())[:_MOST_DOUBTS]:
        which = "Every section" if len(heights) == len(sections) > 1 else f"The section{'s' * (len(heights) > 1)} at {_listed(heights)} mm"
        told.append(Reason(reason.kind, f"{which}: {reason.words}"))
    if len(shared) > _MOST_DOUBTS:
        rest = sum(len(heights) for heights in list(shared.values())[_MOST_DOUBTS:])
        told.append(Reason("no-value", f"{rest} more section{'s' * (rest > 1)}: nothing is proven there either."))
    return tuple(told)


def _listed(heights: Sequence[str]) -> str:
    """Heights in words; of many the first few."""
    if len(heights) <= _MOST_HEIGHTS:
        return ", ".join(heights)
    return f"{', '.join(heights[:_MOST_HEIGHTS])} and {len(heights) - _MOST_HEIGHTS} more heights, in"


def _limit_reason(
    asked: StackCharacteristic, values: _Values, numbers: tuple[float, float, float], verdict: Verdict, height_mm: float
) -> Reason:
    """Why a value that is proven is not conform."""
    nominal, deviation, value = numbers
    unit = values.unit if values.unit != "1" else ""
    low, high = (f"{limit:+g}" if math.isfinite(limit) else "no limit" for limit in (asked.lower, asked.upper))
    where = f"At height {height_mm:g} mm it is" if math.isfinite(height_mm) else "It is"
    told = f"{where} {value:.6g} {unit}, {deviation:+.4g} from the nominal {nominal:.6g}; {low} .. {high} {unit}".rstrip() + " are allowed"
    if verdict is Verdict.UNCERTAIN:
        return Reason("within-uncertainty", f"{told}: nearer to a limit than U = {asked.uncertainty:g} {unit}".rstrip() + ".")
    return Reason("out-of-tolerance", f"{told}.")


def _worst(deviation: Array, uncertainty: Array, verdicts: Sequence[Verdict], asked: StackCharacteristic) -> int:
    """Which value is shown: the one that may go farthest, of those with the worst verdict if they have one."""
    beyond = np.nan_to_num(uncertainty) + np.nan_to_num(
        np.maximum(asked.lower - deviation, deviation - asked.upper), nan=-np.inf, neginf=-1e300
    )
    worst = np.array([verdict == max(verdicts) for verdict in verdicts]) & np.isfinite(deviation)
    return int(np.where(worst if worst.any() else np.isfinite(deviation), beyond, -np.inf).argmax())


def _evaluate(asked: StackCharacteristic, sections: Sequence[MeasuredSection]) -> _Values:
    """The values, NaN where what they need has no number."""
    k, every = len(sections), np.ones((1, len(sections)), dtype=bool)
    heights = np.array([section.height_mm for section in sections])
    numbers = np.array([[_value(section, number.name) for number in asked.numbers] for section in sections])
    if _lies_straight(asked, k):
        numbers[:] = np.nan
    known = np.isfinite(numbers).all(axis=1)
    if asked.type == "taper":
        return _taper(asked, sections, known)
    if asked.type == "twist":
        return _Values(numbers[:, 0], np.eye(k, dtype=bool), 0.0, "deg", asked.method)
    if asked.type == "relative-twist":
        return _relative_twist(asked, heights, numbers[:, 0])
    if asked.type == "displacement":
        value = {"x": numbers[:, 0], "y": numbers[:, 1], "total": np.hypot(numbers[:, 0], numbers[:, 1])}[asked.axis]
        along = "" if asked.axis == "total" else f" along {asked.axis}"
        return _Values(value, np.eye(k, dtype=bool), 0.0, "mm", f"best-fit{along} at {_place(asked)}")
    stack = _stacked(asked, heights, numbers, known)
    if asked.type == "bow":
        return _bow(asked, heights, stack, known)
    unit: Unit = "deg" if asked.type == "lean" else "mm"
    along = f" towards {asked.axis}" if asked.type == "lean" and asked.axis != "total" else ""
    method = f"{asked.method}{along} at {_place(asked)}"
    notes = (_ALONG_NORMAL,) if asked.type == "lean" else ()
    if asked.datum is None and not asked.counts_from_datum and asked.type == "lean":
        notes = (*notes, _TURNED_MEAN)
    value = math.nan if stack is None else _of_axis(asked, stack)
    return _Values(np.array([value]), every, 0.0, unit, method, notes)


def _lies_straight(asked: StackCharacteristic, sections: int) -> bool:
    """Whether so few sections leave nothing to find: two always lie on the line that bow and straightness are counted from."""
    return sections < _FEWEST_OFF_A_LINE and (asked.type, asked.method) in (("bow", asked.method), ("stacking-axis", "straightness"))


def _value(section: MeasuredSection, name: str) -> float:
    return section.numbers[name].value if section.numbers else math.nan


def _place(asked: StackCharacteristic) -> str:
    return f"({asked.place_mm[0]:g}, {asked.place_mm[1]:g}) mm"


def _section_at(heights: Array, wanted_mm: float | None, otherwise: int) -> int | None:
    """The number of the section at a height; None where there is none, because the stack was cut short."""
    if wanted_mm is None:
        return otherwise % len(heights)
    nearest = int(np.abs(heights - wanted_mm).argmin())
    return nearest if abs(heights[nearest] - wanted_mm) <= _SAME_HEIGHT_MM else None


def _relative_twist(asked: StackCharacteristic, heights: Array, twist_deg: Array) -> _Values:
    """How every section is turned against one of them."""
    reference, k = _section_at(heights, asked.reference_mm, 0), len(heights)
    needs = np.eye(k, dtype=bool)
    value, known = np.full(k, np.nan), np.isfinite(twist_deg)
    if reference is None:
        return _Values(value, needs, 0.0, "deg", asked.method)
    needs[:, reference] = True
    if known[reference] and known.sum() > 1:
        rows = np.flatnonzero(known)
        zero = np.zeros((len(rows), 2))
        found = relative_twist(
            StackedSections(heights[rows], twist_deg[rows].copy(), zero, zero.copy()), int(np.searchsorted(rows, reference))
        )
        value[rows] = [one.value for one in found]
    note = f"counted from the section at {heights[reference]:g} mm"
    return _Values(value, needs, 0.0, "deg", asked.method, (note,))


def _stacked(asked: StackCharacteristic, heights: Array, numbers: Array, known: Flags) -> StackedSections | None:
    """The sections with a number, in the nominal's directions; None of fewer than two.

    Where no pose is known, they are brought there together, by the mean of their rotations and of their places: what follows from
    where they lie to each other does not depend on it.
    """
    rows = np.flatnonzero(known)
    if len(rows) < 2:
        return None
    place = np.tile(np.array(asked.place_mm), (len(rows), 1))
    moved, twist = numbers[rows, :2], numbers[rows, 2]
    if asked.datum is None:
        turned = twist[0] + np.mean([angle_within_half_a_turn(one - twist[0]) for one in twist.tolist()])
        actual = RigidTransform(-math.radians(turned), np.zeros(2)).apply(place + moved)
        moved = actual - actual.mean(axis=0)
        twist = np.array([angle_within_half_a_turn(one - turned) for one in twist.tolist()])
    return StackedSections(heights[rows], np.array(twist), np.array(moved), place)


def _bow(asked: StackCharacteristic, heights: Array, stack: StackedSections | None, known: Flags) -> _Values:
    """How far every section lies from the line between root and tip."""
    root, tip = _section_at(heights, asked.root_mm, 0), _section_at(heights, asked.tip_mm, -1)
    needs, method = np.eye(len(heights), dtype=bool), f"root-tip at {_place(asked)}"
    value, rows = np.full(len(heights), np.nan), np.flatnonzero(known)
    if root is None or tip is None:
        return _Values(value, needs, 0.0, "mm", method)
    needs[:, [root, tip]] = True
    if stack is not None and known[root] and known[tip] and root != tip:
        value[rows] = [one.value for one in bow(stack, int(np.searchsorted(rows, root)), int(np.searchsorted(rows, tip)))]
    note = f"counted from the line between the sections at {heights[root]:g} and {heights[tip]:g} mm"
    return _Values(value, needs, 0.0, "mm", method, (note,))


def _of_axis(asked: StackCharacteristic, stack: StackedSections) -> float:
    """The lean of the axis through the stacking points, its straightness, or how far it lies from the nominal one between its ends."""
    axis = fit_stacking_axis(stack)
    if asked.type == "lean":
        in_all = math.degrees(math.atan2(math.hypot(axis.direction[0], axis.direction[1]), axis.direction[2]))
        return {"x": axis.lean_x_deg.value, "y": axis.lean_y_deg.value, "total": in_all}[asked.axis]
    if asked.method == "straightness":
        return float(np.hypot(*axis.residual_mm.T).max())
    ends = axis.origin_mm + (stack.height_mm[[0, -1]] - stack.height_mm[0])[:, None] * axis.direction[:2] / axis.direction[2]
    return float(np.hypot(*(ends - stack.stacking_mm[[0, -1]]).T).max())


def _taper(asked: StackCharacteristic, sections: Sequence[MeasuredSection], known: Flags) -> _Values:
    """How a length changes with the height, and how it does on the nominal sections."""
    (number,) = asked.numbers
    rows = np.flatnonzero(known).tolist()
    heights = np.array([sections[k].height_mm for k in rows])
    slopes = [math.nan, math.nan]
    if len(rows) > 1:
        found = [sections[k].numbers[number.name] for k in rows]
        for at, lengths in enumerate(([one.value for one in found], [one.nominal for one in found])):
            values = tuple(SectionValue(asked.of, asked.method, length, "mm", no_places(), ()) for length in lengths)
            slopes[at] = taper(heights, values).value
    every = np.ones((1, len(sections)), dtype=bool)
    return _Values(np.array(slopes[:1]), every, slopes[1], "1", f"{asked.of} {asked.method}, least squares over the height")
