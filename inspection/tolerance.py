"""The tolerance zone, and what it proves of a deviation by ISO 14253-1."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inspection.verdict import Verdict


@dataclass(frozen=True, slots=True)
class ToleranceZone:
    """Deviations allowed: from `lower_mm` to `upper_mm`, positive out of material.

    uncertainty_mm is the expanded uncertainty U of one deviation (95 %). By ISO 14253-1 it counts against whoever has to
    prove: conformity is proven inside [lower + U, upper - U], nonconformity outside [lower - U, upper + U].
    """

    lower_mm: float
    upper_mm: float
    uncertainty_mm: float = 0.0

    def __post_init__(self) -> None:
        if not (np.isfinite(self.lower_mm) and np.isfinite(self.upper_mm) and self.lower_mm < self.upper_mm):
            raise ValueError(f"the lower limit must be below the upper one, got {self.lower_mm:g} .. {self.upper_mm:g} mm")
        if not (np.isfinite(self.uncertainty_mm) and self.uncertainty_mm >= 0):
            raise ValueError(f"the uncertainty must be zero or more, got {self.uncertainty_mm:g} mm")
        if 2 * self.uncertainty_mm >= self.upper_mm - self.lower_mm:
            raise ValueError(
                f"an uncertainty of {self.uncertainty_mm:g} mm leaves nothing provable of a zone {self.upper_mm - self.lower_mm:g} mm wide"
            )

    @property
    def middle_mm(self) -> float:
        """Deviation in the middle of the zone."""
        return (self.lower_mm + self.upper_mm) / 2

    @property
    def decision_rule(self) -> str:
        """How the uncertainty counts, in words."""
        if not self.uncertainty_mm:
            return "U not stated: simple acceptance"
        return f"ISO 14253-1: conform inside the zone less U, nonconform outside the zone plus U, U = {self.uncertainty_mm:g} mm"

    def verdicts(self, deviation_mm: ArrayLike) -> NDArray[np.int8]:
        """Verdict (m,) of each deviation (m,), as the codes of `Verdict`. A limit itself belongs to the zone; NaN is UNCERTAIN."""
        deviation = np.asarray(deviation_mm, dtype=np.float64)
        beyond = np.maximum(self.lower_mm - deviation, deviation - self.upper_mm)  # how far outside the zone, negative inside
        proven = np.where(beyond <= -self.uncertainty_mm, Verdict.CONFORM, Verdict.UNCERTAIN)
        return np.where(beyond > self.uncertainty_mm, Verdict.NONCONFORM, proven).astype(np.int8)

    def verdict(self, deviation_mm: ArrayLike) -> Verdict:
        """Verdict on the profile: that of its worst point, and UNCERTAIN where there is no point."""
        verdicts = self.verdicts(np.atleast_1d(np.asarray(deviation_mm, dtype=np.float64)))
        return Verdict(int(verdicts.max())) if verdicts.size else Verdict.UNCERTAIN
