"""From judged points to the verdict on the part, with the reasons in the order of their weight.

CONFORM is said only where every point is proven inside the zone and nothing is known that could hide a defect: points that are
missing, stretches that were not measured, points beyond an end, an end that never came. NONCONFORM is said only where it is
proven. Everything between is UNCERTAIN. Whatever is missing can only lower a verdict.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from inspection.gaps import Gap
from inspection.tolerance import ToleranceZone
from inspection.verdict import Verdict

ReasonKind = Literal[
    "out-of-tolerance",
    "within-uncertainty",
    "placement",
    "nothing-judged",
    "aborted",
    "proven-out",
    "incomplete",
    "begun-anew",
    "missing",
    "announced",
    "rejected",
    "ends",
    "coverage",
    "gap",
    "fit",
    "outline",
    "shift",
    "unseen",
    "no-value",
    "datum",
    "nominal",
    "pose",
]


@dataclass(frozen=True, slots=True)
class Reason:
    """One reason of a verdict: its kind, which never changes, and a sentence for people."""

    kind: ReasonKind
    words: str


@dataclass(frozen=True, slots=True)
class Conclusion:
    """The verdict on a part and its reasons, the most important first; a part that conforms has none."""

    verdict: Verdict
    reasons: tuple[Reason, ...]


@dataclass(frozen=True, slots=True)
class Missing:
    """Points of the scan that are known to be missing before the inspection saw them.

    lost          : by the device's own counters
    damaged_bytes : bytes on the wire that were no valid frame; how many points they held is not known
    rejected      : points that arrived whole and could not be used, by reason
    announced     : points that the device announced, or said to have sent; None where it said nothing
    arrived       : points that arrived, used or not
    begun         : scans that the device began within the run; the points of a second one may be of another part
    """

    lost: int = 0
    damaged_bytes: int = 0
    rejected: Mapping[str, int] = field(default_factory=dict)
    announced: int | None = None
    arrived: int = 0
    begun: int = 1


@dataclass(frozen=True, slots=True)
class Findings:
    """What was found of a scan, as far as the verdict depends on it.

    points          : the verdict on the judged points alone; NONCONFORM only where that is proven
    why             : the reason of that verdict, where it is not CONFORM
    judged          : points with a verdict
    rejected        : points that the inspection itself rejected, by reason, those beyond an end left out
    beyond_end_mm   : how far the farthest of the points beyond an open end lies off it, 0 where there is none; `beyond_end_count` how
                      many do
    coverage, gap   : how much was measured, and the longest stretch that was not
    converged       : the fit settled
    """

    points: Verdict
    why: Reason | None
    judged: int
    rejected: Mapping[str, int]
    beyond_end_mm: float
    beyond_end_count: int
    coverage: float
    gap: Gap
    converged: bool


@dataclass(frozen=True, slots=True)
class Limits:
    """What may be missing before conformity is not proven any more.

    gap_max_mm      : the longest gap that counts as measured, and that conformity allows
    allow_unseen_mm : the longest stretch that may be unseen where points are known to be missing; None allows none
    """

    coverage_min: float
    gap_max_mm: float
    end_allowance_mm: float
    allow_unseen_mm: float | None


def conclude(found: Findings, missing: Missing, limits: Limits, complete: bool) -> Conclusion:
    """Say the verdict on the part.

    complete : the scan came to its end
    """
    reasons = [found.why] if found.why is not None else []
    if not found.judged:
        reasons.append(Reason("nothing-judged", "No point was judged."))
    if not complete:
        reasons.append(Reason("incomplete", "The scan did not come to its end."))
    if missing.begun > 1:
        reasons.append(Reason("begun-anew", f"The device began anew: points of {missing.begun} scans were judged together."))
    if limits.allow_unseen_mm is None or found.gap.length_mm > limits.allow_unseen_mm:
        allowed = "none" if limits.allow_unseen_mm is None else f"{limits.allow_unseen_mm:g} mm"
        unseen = f"up to {found.gap.length_mm:.4g} mm of the profile are unseen, {allowed} allowed"
        reasons += reasons_of_missing(found.rejected, missing, unseen)
    reasons += _unmeasured(found, limits)
    if not found.converged:
        reasons.append(Reason("fit", "The fit did not settle: the pose is not the best one."))
    doubtful = Verdict.UNCERTAIN if reasons else Verdict.CONFORM
    return Conclusion(max(found.points, doubtful), tuple(reasons))


def reasons_of_abort(proven_out: bool) -> tuple[Reason, ...]:
    """The first reasons of a run that the operator aborted, which has no verdict, whatever was found until then.

    proven_out : the points received until then prove that the part fails
    """
    before = "The points received until then prove that the part fails."
    told = Reason("aborted", "The operator aborted the run, so there is no verdict.")
    return (told, *([Reason("proven-out", before)] if proven_out else []))


def word_points(zone: ToleranceZone, beyond: int, within_uncertainty: int) -> Reason | None:
    """The reason that the points themselves give: some beyond a limit, or too near to one to be told; None where all are proven."""
    if beyond:
        limit = f"beyond the limits {zone.lower_mm:g} .. {zone.upper_mm:g} mm"
        by = f" by more than U = {zone.uncertainty_mm:g} mm" if zone.guard_mm else ""
        return Reason("out-of-tolerance", f"{of_many(beyond, 'point')} {verb_of(beyond, 'lies', 'lie')} {limit}{by}.")
    if within_uncertainty:
        lies = verb_of(within_uncertainty, "lies", "lie")
        return Reason(
            "within-uncertainty",
            f"{of_many(within_uncertainty, 'point')} {lies} nearer to a limit than U = {zone.uncertainty_mm:g} mm: neither side is proven.",
        )
    return None


def reasons_of_missing(rejected_here: Mapping[str, int], missing: Missing, unseen: str) -> list[Reason]:
    """Points that are known to be missing; they may hide a defect.

    rejected_here : points that the inspection itself rejected, by reason
    unseen        : how much is unseen and how much may be, as the end of a sentence
    """
    reasons = []
    lost = [of_many(missing.lost, "point") + verb_of(missing.lost, " was lost", " were lost")] if missing.lost > 0 else []
    if missing.damaged_bytes:
        lost.append(f"{missing.damaged_bytes} bytes were damaged")
    if lost:
        reasons.append(Reason("missing", f"{' and '.join(lost)} on the line: {unseen}."))
    short = 0 if missing.announced is None else missing.announced - missing.arrived - max(missing.lost, 0)
    if missing.announced is not None and short > 0:
        reasons.append(Reason("announced", f"The device announced {missing.announced} points and {missing.arrived} arrived: {unseen}."))
    rejected = {**missing.rejected, **rejected_here}
    if rejected:
        which = ", ".join(f"{number} {reason}" for reason, number in rejected.items())
        reasons.append(Reason("rejected", f"Points were rejected ({which}): {unseen}."))
    return reasons


def _unmeasured(found: Findings, limits: Limits) -> list[Reason]:
    """Stretches of the profile, and of the part beyond it, of which nothing is known."""
    reasons = []
    if found.beyond_end_mm > limits.end_allowance_mm:
        number = found.beyond_end_count
        reasons.append(
            Reason(
                "ends",
                f"{of_many(number, 'point')} beyond an end of the open profile {verb_of(number, 'lies', 'lie')} up to "
                f"{found.beyond_end_mm:.4g} mm off it; {limits.end_allowance_mm:.4g} mm are allowed.",
            )
        )
    if found.coverage < limits.coverage_min:
        reasons.append(
            Reason("coverage", f"{found.coverage:.1%} of the profile was measured; {limits.coverage_min:.1%} are needed."),
        )
    gap = found.gap
    if gap.length_mm > limits.gap_max_mm * (1 + 1e-9):
        reasons.append(
            Reason(
                "gap",
                f"The largest gap is {gap.length_mm:.4g} mm, from station {gap.from_mm:.4g} to {gap.to_mm:.4g} mm; "
                f"{limits.gap_max_mm:.4g} mm are allowed.",
            )
        )
    return reasons


def of_many(number: int, noun: str) -> str:
    """A number with its noun: 1 point, 2 points."""
    return f"{number} {noun}{'' if number == 1 else 's'}"


def verb_of(number: int, one: str, many: str) -> str:
    """The verb that goes with a number."""
    return one if number == 1 else many
