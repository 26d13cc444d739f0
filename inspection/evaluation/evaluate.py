"""All characteristics of a run, and the verdict on the part: that of the worst of them, with its reasons first."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from typing import Protocol

from inspection.characteristics.characteristic import (
    Characteristic,
    CharacteristicResult,
    LineProfile,
    SectionCharacteristic,
    WholeProfile,
)
from inspection.conclusion import Missing, Reason
from inspection.evaluation.basis import Basis
from inspection.evaluation.line_profile import judge_profile, judge_whole
from inspection.evaluation.section_value import ActualOutlines, judge_value
from inspection.result import InspectionResult
from inspection.terms import Terms
from inspection.verdict import Verdict

PROFILE = WholeProfile("profile")
"""What a plan without characteristics asks for."""


class Evaluation(Protocol):
    """How the characteristics of a run are found: as `evaluate` finds them, with its arguments."""

    def __call__(
        self,
        asked: Sequence[Characteristic],
        result: InspectionResult,
        terms: Terms,
        missing: Missing,
        complete: bool,
        numbers: Sequence[SectionCharacteristic],
        /,
    ) -> InspectionResult:
        """The result of a run with its characteristics."""


def evaluate(
    asked: Sequence[Characteristic],
    result: InspectionResult,
    terms: Terms,
    missing: Missing,
    complete: bool,
    numbers: Sequence[SectionCharacteristic] = (),
) -> InspectionResult:
    """The result of a run with its characteristics, and with the verdict on the part that follows from them.

    asked   : in the order of the plan; none asks for the profile alone
    result  : the profile as the run judged it on its terms
    numbers : what is found as well, without a part in the verdict, for what stands on several runs
    """
    basis = Basis(result, terms, missing, complete)
    outlines = ActualOutlines(basis)
    found = tuple(_judge(one, basis, outlines) for one in asked or (PROFILE,))
    return with_found(result, found, tuple(judge_value(one, basis, outlines) for one in numbers))


def with_found(
    result: InspectionResult, found: tuple[CharacteristicResult, ...], beside: tuple[CharacteristicResult, ...]
) -> InspectionResult:
    """The result of a run with what was found of its characteristics, and with the verdict on the part that follows from them."""
    verdict, reasons = max(one.verdict for one in found), _reasons_of_part(found)
    return replace(result, characteristics=found, numbers=beside, verdict=verdict, reasons=reasons)


def doubt_part(result: InspectionResult, reasons: tuple[Reason, ...]) -> InspectionResult:
    """The result where nothing of the part is proven, whatever was found, for reasons that stand before all others."""
    found, beside = (
        tuple(replace(one, verdict=Verdict.UNCERTAIN, reasons=(*reasons, *one.reasons)) for one in every)
        for every in (result.characteristics, result.numbers)
    )
    return replace(result, verdict=Verdict.UNCERTAIN, reasons=(*reasons, *result.reasons), characteristics=found, numbers=beside)


def _judge(asked: Characteristic, basis: Basis, outlines: ActualOutlines) -> CharacteristicResult:
    if isinstance(asked, WholeProfile):
        return judge_whole(asked, basis)
    return judge_profile(asked, basis) if isinstance(asked, LineProfile) else judge_value(asked, basis, outlines)


def _reasons_of_part(found: Sequence[CharacteristicResult]) -> tuple[Reason, ...]:
    """The reasons of all characteristics, those of the worst first; each begins with the name, but for those that several share."""
    shared = Counter(reason for one in found for reason in set(one.reasons))
    told: dict[Reason, None] = {}
    for one in sorted(found, key=lambda one: -one.verdict):
        for reason in one.reasons:
            alone = len(found) == 1 or shared[reason] > 1
            told[reason if alone else Reason(reason.kind, f"{one.name}: {reason.words}")] = None
    return tuple(told)
