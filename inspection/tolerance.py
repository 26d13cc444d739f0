"""The tolerance zone, and what it proves of a deviation by ISO 14253-1."""

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inspection.verdict import Verdict

DecisionRule = Literal["iso-14253-1", "ilac-g8", "simple"]

_WORDS: dict[DecisionRule, str] = {
    "iso-14253-1": "ISO 14253-1: conform inside the zone less U, nonconform outside the zone plus U, U = {U:g} {unit}",
    "ilac-g8": "ILAC-G8:09/2019, guard band w = U on both sides: pass inside the zone less w, fail outside it plus w, U = {U:g} {unit}",
    "simple": "simple acceptance (ASME B89.7.3.1): U does not count, U = {U:g} {unit}, the zone is {ratio:.3g} : 1 wide to U on both sides",
}


@dataclass(frozen=True, slots=True)
class ToleranceZone:
    """Deviations allowed: from `lower_mm` to `upper_mm`, positive out of material.

    uncertainty_mm is the expanded uncertainty U of one deviation (95 %). By ISO 14253-1 it counts against whoever has to
    prove: conformity is proven inside [lower + U, upper - U], nonconformity outside [lower - U, upper + U].

    rule     : how U counts. "ilac-g8" is the guard band of ILAC-G8:09/2019 with w = U and a statement of more than pass and fail: what
               it calls a conditional pass or fail is UNCERTAIN, so that its verdicts are those of "iso-14253-1". By "simple", the simple
               acceptance of ASME B89.7.3.1, U does not count
    provable : False for a U that is known only after the scan, and may leave nothing that can be proven to conform
    """

    lower_mm: float
    upper_mm: float
    uncertainty_mm: float = 0.0
    rule: DecisionRule = "iso-14253-1"
    provable: bool = True

    def __post_init__(self) -> None:
        if not (np.isfinite(self.lower_mm) and np.isfinite(self.upper_mm) and self.lower_mm < self.upper_mm):
            raise ValueError(f"the lower limit must be below the upper one, got {self.lower_mm:g} .. {self.upper_mm:g} mm")
        if not (np.isfinite(self.uncertainty_mm) and self.uncertainty_mm >= 0):
            raise ValueError(f"the uncertainty must be zero or more, got {self.uncertainty_mm:g} mm")
        if self.rule not in get_args(DecisionRule):
            raise ValueError(f"the decision rule must be one of {', '.join(get_args(DecisionRule))}, not {self.rule!r}")
        if self.provable and 2 * self.uncertainty_mm >= self.upper_mm - self.lower_mm:
            raise ValueError(
                f"an uncertainty of {self.uncertainty_mm:g} mm leaves nothing provable of a zone {self.upper_mm - self.lower_mm:g} mm wide"
            )

    @property
    def middle_mm(self) -> float:
        """Deviation in the middle of the zone."""
        return (self.lower_mm + self.upper_mm) / 2

    @property
    def guard_mm(self) -> float:
        """How far inside or outside the limits a deviation must lie for that to be proven."""
        return 0.0 if self.rule == "simple" else self.uncertainty_mm

    @property
    def decision_rule(self) -> str:
        """How the uncertainty counts, in words."""
        return decision_words(self.rule, self.uncertainty_mm, self.upper_mm - self.lower_mm)

    def verdicts(self, deviation_mm: ArrayLike, error_mm: ArrayLike = 0.0) -> NDArray[np.int8]:
        """Verdict (m,) of each deviation (m,), as the codes of `Verdict`. A limit itself belongs to the zone; NaN is UNCERTAIN.

        error_mm : (m,) what counts beside U, by whatever rule: how far the nominal may lie off what it stands for
        """
        deviation, guard = np.asarray(deviation_mm, dtype=np.float64), self.guard_mm + np.asarray(error_mm, dtype=np.float64)
        beyond = np.maximum(self.lower_mm - deviation, deviation - self.upper_mm)  # how far outside the zone, negative inside
        proven = np.where(beyond <= -guard, Verdict.CONFORM, Verdict.UNCERTAIN)
        return np.where(beyond > guard, Verdict.NONCONFORM, proven).astype(np.int8)

    def verdict(self, deviation_mm: ArrayLike) -> Verdict:
        """Verdict on the profile: that of its worst point, and UNCERTAIN where there is no point."""
        verdicts = self.verdicts(np.atleast_1d(np.asarray(deviation_mm, dtype=np.float64)))
        return Verdict(int(verdicts.max())) if verdicts.size else Verdict.UNCERTAIN


def decision_words(rule: DecisionRule, uncertainty: float, width: float, unit: str = "mm") -> str:
    """How an expanded uncertainty counts beside limits that are so far apart, in words; the width may be infinite."""
    if not uncertainty:
        return "U not stated: simple acceptance"
    return _WORDS[rule].format(U=uncertainty, ratio=width / (2 * uncertainty), unit=unit)
