"""The characteristics of a stack: what a CT plan asks for, the numbers of each section that they need, and what came of them."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

from cmmlink.characteristics import known_pose, pose_of
from cmmlink.characteristics_json import characteristic_json, number
from cmmlink.errors import PlanError
from cmmlink.pipeline import RunOutcome
from cmmlink.plan import AskedOfStack, CtPlan
from inspection import (
    MeasuredSection,
    NominalProfile,
    Outline,
    Reason,
    SectionCharacteristic,
    StackCharacteristic,
    StackCharacteristicResult,
    find_airfoil,
    judge_stack,
    numbers_of,
    with_nominal,
)

_SAME_HEIGHT_MM = 1e-9
_HEIGHTS = ("reference_mm", "root_mm", "tip_mm")


class JudgedSection(NamedTuple):
    """A section of a stack that was inspected: the height that was asked for, that of the cut, and its run."""

    asked_mm: float
    height_mm: float
    run: RunOutcome


class StackQuestions:
    """What a plan asks of the stack of its sections."""

    def __init__(self, plan: CtPlan) -> None:
        self._asked = plan.stack_characteristics
        self._decision = plan.decision_rule
        self._wanted = tuple(_wanted(one, plan) for one in plan.stack_characteristics)
        self._numbers: dict[int, tuple[SectionCharacteristic, ...]] = {}

    def check_heights(self, heights_mm: Sequence[float]) -> None:
        """Raise PlanError where the sections do not stand at the heights that the characteristics name, or are too few."""
        if self._asked and len(heights_mm) < 2:
            raise PlanError("stack_characteristics need sections at two heights or more")
        for asked in self._asked:
            for key in _HEIGHTS:
                at = getattr(asked, key, None)
                if at is not None and min(abs(height - at) for height in heights_mm) > _SAME_HEIGHT_MM:
                    nearest = min(heights_mm, key=lambda height: abs(height - at))
                    raise PlanError(f"stack_characteristics, {asked.name}: no section is at {key} {at:g}; the nearest is at {nearest:g} mm")

    def numbers(self, profile: NominalProfile) -> tuple[SectionCharacteristic, ...]:
        """What has to be found of a section with this nominal. Raises PlanError for what the nominal does not have."""
        if id(profile) not in self._numbers:
            drawn: list[Outline] = []

            def outline() -> Outline:
                if not drawn:
                    drawn.append(Outline(find_airfoil(profile)))
                return drawn[0]

            try:
                self._numbers[id(profile)] = tuple(with_nominal(one, outline) for one in numbers_of(self._wanted))
            except ValueError as error:
                raise PlanError(f"stack_characteristics: {error}") from None
        return self._numbers[id(profile)]

    def judge(self, sections: Sequence[JudgedSection], asked: int) -> tuple[StackCharacteristicResult, ...]:
        """What came of them, in the order of the plan; `asked` is how many sections there should be."""
        rising = sorted(sections, key=lambda section: section.height_mm)
        cut_at = {section.asked_mm: section.height_mm for section in sections}
        lost = None
        if len(sections) < asked or any(section.run.ending != "complete" for section in sections):
            done = sum(section.run.ending == "complete" for section in sections)
            lost = Reason("incomplete", f"Only {done} of {asked} sections were inspected to their end.")
        wanted, measured = [_at_cuts(one, cut_at) for one in self._wanted], [_measured(section) for section in rising]
        return judge_stack(wanted, measured, lost, self._decision)


def stack_characteristic_json(result: StackCharacteristicResult) -> dict[str, Any]:
    """A characteristic of a stack as `--json` and result.json hold it."""
    return {
        **characteristic_json(result.found),
        "height_mm": number(result.height_mm),
        "sections": [
            {
                "height_mm": share.height_mm,
                "value": number(share.value),
                "deviation": number(share.deviation),
                "verdict": share.verdict.word,
            }
            for share in result.sections
        ],
    }


def _wanted(asked: AskedOfStack, plan: CtPlan) -> StackCharacteristic:
    """A characteristic as the inspection takes it."""
    lower, upper = asked.limits_of_deviation
    told = {name: getattr(asked, name) for name in ("axis", "place_mm", "of", *_HEIGHTS) if hasattr(asked, name)}
    nominal = getattr(asked, "nominal", None)
    return StackCharacteristic(
        asked.name,
        asked.type,
        str(asked.method),
        lower,
        upper,
        asked.expanded_uncertainty,
        math.nan if nominal is None else nominal,
        datum=known_pose(pose_of(plan.registration.datum), plan.registration.fit),
        **told,
    )


def _at_cuts(wanted: StackCharacteristic, cut_at: Mapping[float, float]) -> StackCharacteristic:
    """The characteristic with the heights that it names moved to where those sections were cut."""

    def moved(height_mm: float | None) -> float | None:
        if height_mm is None:
            return None
        return next((cut for asked, cut in cut_at.items() if abs(asked - height_mm) <= _SAME_HEIGHT_MM), height_mm)

    return replace(wanted, reference_mm=moved(wanted.reference_mm), root_mm=moved(wanted.root_mm), tip_mm=moved(wanted.tip_mm))


def _measured(section: JudgedSection) -> MeasuredSection:
    """A section as the stack's characteristics see it."""
    result, refusal = section.run.result, section.run.refusal
    if result is None:
        return MeasuredSection(section.height_mm, {}, (Reason("no-value", str(refusal or "nothing of it was judged")),))
    return MeasuredSection(section.height_mm, {one.name: one for one in result.numbers})
