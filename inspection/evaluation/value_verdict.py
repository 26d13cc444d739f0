"""The verdict on a number of a section: by its limits, by how well it is known, and by whether what it stands on was measured."""

import math

from inspection.characteristics.actual import ActualSection
from inspection.characteristics.characteristic import SectionCharacteristic, verdict_of
from inspection.characteristics.section_value import SectionValue
from inspection.conclusion import Reason
from inspection.evaluation.basis import Basis
from inspection.gaps import Measured
from inspection.verdict import Verdict


def judge_deviation(
    asked: SectionCharacteristic,
    value: SectionValue,
    deviation: float,
    drawing: float,
    measured: Measured,
    basis: Basis,
    actual: ActualSection | None,
) -> tuple[Verdict, Reason | None]:
    """The verdict on a value, and its reason; nothing is proven of one that stands on what was not measured, or is drawn too roughly."""
    unseen = actual.unseen_place(value) if actual is not None else None
    if unseen is not None:
        return Verdict.UNCERTAIN, Reason("unseen", f"It was found where nothing was measured ({unseen}); measure that stretch.")
    guard, unit = basis.guard(asked.uncertainty), value.unit if value.unit != "1" else ""
    verdict = verdict_of(deviation, asked.lower, asked.upper, guard)
    is_doubted = verdict_of(deviation, asked.lower, asked.upper, guard + drawing) is not verdict
    if not is_doubted and _other_decides(asked, value, deviation, guard + drawing, verdict):
        words = f"To one side it is {value.value:.6g} {unit}, to the other {value.other:.6g} {unit}: which of them counts is not known"
        return Verdict.UNCERTAIN, Reason(
            "within-uncertainty", f"{words} to within {guard + drawing:.2g} {unit}, and they differ in verdict."
        )
    if verdict is Verdict.CONFORM and not is_doubted:
        return verdict, None
    limits = f"{_limit(asked.lower)} .. {_limit(asked.upper)} {unit}".rstrip()
    told = f"{value.value:.6g} {unit}, {deviation:+.4g} from the nominal {asked.nominal_value:.6g}; {limits} are allowed"
    if verdict is Verdict.UNCERTAIN:
        return verdict, Reason("within-uncertainty", f"It is {told}: nearer to a limit than U = {asked.uncertainty:g} {unit}.")
    if is_doubted:
        words = f"It is {told}: nearer to a limit than the {drawing:.2g} {unit} by which the section that was drawn may mislead".rstrip()
        return Verdict.UNCERTAIN, Reason("within-uncertainty", f"{words}; measure its edges more densely.")
    if measured.gap.length_mm > basis.terms.limits.gap_max_mm * (1 + 1e-9):
        return Verdict.UNCERTAIN, Reason("unseen", f"It is {told}; a part of what it depends on was not measured.")
    return verdict, Reason("out-of-tolerance", f"It is {told}.")


def _other_decides(asked: SectionCharacteristic, value: SectionValue, deviation: float, known_to: float, verdict: Verdict) -> bool:
    """Whether the smaller of two values may be the larger one, for all that is known, and would have another verdict.

    If it is, it is at least as large as the other one may be at its smallest, and at most as large as it may itself be.
    """
    sense, size = math.copysign(1.0, value.value), abs(value.value)
    against = -sense * value.other
    room = known_to - (size - against) / 2
    if math.isnan(value.other) or room < 0:
        return False
    middle = -sense * (size + against) / 2
    return verdict_of(deviation - value.value + middle, asked.lower, asked.upper, room) is not verdict


def _limit(limit: float) -> str:
    return f"{limit:+g}" if math.isfinite(limit) else "no limit"
