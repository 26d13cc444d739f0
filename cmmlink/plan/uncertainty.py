"""What a plan states about uncertainty and temperature: the budget of a deviation, and how warm the part was.

Every field says in its description what it means; docs/plan.md and docs/ct-plan.md are written from these descriptions.
"""

import re
from typing import Annotated, Any, Self

from pydantic import Field, model_validator

from cmmlink.plan.yaml_model import Positive, Settings
from inspection import Compensation, StatedUncertainty, UncertaintyBudget

NotNegative = Annotated[float, Field(ge=0)]

TEMPERATURE = "a mapping with the part's temperature and its coefficient of expansion; null: the part was at the reference temperature"
UNCERTAINTY = (
    "a budget of the uncertainty of a deviation by the GUM, from which U is worked out for every station; in place of "
    "tolerance.uncertainty_mm; null: that one counts"
)
DECISION_RULE = (
    "how U counts: iso-14253-1 (it counts against whoever has to prove), ilac-g8 (a guard band w = U on both sides of each limit), or "
    "simple (simple acceptance by ASME B89.7.3.1: it is stated, and does not count)"
)

_DATA_SHEET = re.compile(r"(?P<a>\d*\.?\d+)\s*\+\s*L\s*/\s*(?P<k>\d*\.?\d+)\s*(?P<unit>um|\N{MICRO SIGN}m|\N{GREEK SMALL LETTER MU}m)")


class Mpe(Settings):
    """The maximum permissible error of the device, A + L/K of ISO 10360-2; also as data sheets spell it, like `1.8 + L/300 um`."""

    a_mm: NotNegative = Field(description="A, in mm: 0.0018 of 1.8 + L/300 um")
    per_length: float | None = Field(
        default=None,
        gt=1,
        lt=20_000,
        description="K as data sheets have it, with L in mm and the error in um: 300 of 1.8 + L/300 um; null: the error is A alone",
    )

    @model_validator(mode="before")
    @classmethod
    def _as_in_a_data_sheet(cls, given: Any) -> Any:
        """Take the notation of a data sheet."""
        if not isinstance(given, str):
            return given
        if found := _DATA_SHEET.fullmatch(given.strip()):
            return {"a_mm": float(found["a"]) / 1000, "per_length": found["k"]}
        raise ValueError("a mapping with a_mm and per_length, or as in a data sheet: 1.8 + L/300 um")

    @property
    def share(self) -> float:
        """How much the error grows with the length, mm a mm."""
        return 0.0 if self.per_length is None else 1 / (1000 * self.per_length)


class Temperature(Settings):
    """How warm the part was when it was measured, and what is made of it."""

    part_c: float = Field(ge=-100, le=300, description="the temperature of the part, in degrees Celsius")
    reference_c: float = Field(default=20.0, description="the temperature at which the part has its nominal size; ISO 1 says 20")
    cte_per_k: Annotated[float, Field(ge=0, lt=1e-3)] = Field(
        description="the part's coefficient of thermal expansion, like 11.5e-6 of steel"
    )
    u_part_k: NotNegative = Field(default=0.0, description="the standard uncertainty of part_c")
    u_cte_per_k: NotNegative = Field(default=0.0, description="the standard uncertainty of cte_per_k, like 1.0e-6")
    compensate: bool = Field(
        description="true: the points are scaled to the reference temperature about fixed_mm before they are judged; false: the growth "
        "stays in the deviations, and a budget adds it to U in full"
    )
    fixed_mm: tuple[float, float] | None = Field(
        default=None,
        description="the place that stays where it is as the part grows, in section coordinates [x, y], such as a clamp; it must be stated "
        "where the pose is known, and does not matter after a free fit",
    )

    @property
    def growth(self) -> float:
        """How much larger the part was than at the reference temperature, mm a mm."""
        return self.cte_per_k * (self.part_c - self.reference_c)

    @property
    def place_mm(self) -> tuple[float, float]:
        """The place that stays where it is."""
        return self.fixed_mm or (0.0, 0.0)

    @property
    def compensation(self) -> Compensation | None:
        """What takes the growth out of the points; None where it stays."""
        return Compensation(self.growth, self.place_mm) if self.compensate else None

    @property
    def words(self) -> str:
        """What was made of the temperature, for the notes beside a verdict."""
        at = f"the part was measured at {self.part_c:g} C, {self.part_c - self.reference_c:+g} K from {self.reference_c:g} C"
        if not self.compensate:
            return f"{at}; it was not compensated: the deviations hold a growth of {1e3 * self.growth:+.4g} um a mm"
        about = f"about ({self.place_mm[0]:g}, {self.place_mm[1]:g}) mm of the section"
        return f"{at}: its points were scaled by {1 / (1 + self.growth):.8f} {about} before they were judged"


class Uncertainty(Settings):
    """What a measured point is uncertain by, as standard uncertainties; of the device its maximum permissible error."""

    mpe: Mpe | None = Field(default=None, description="the maximum permissible error of the device, like {a_mm: 0.0018, per_length: 300}")
    tip_radius_mm: NotNegative = Field(default=0.0, description="the standard uncertainty of the calibrated radius of the tip")
    repeatability_mm: NotNegative = Field(
        default=0.0, description="the standard deviation of one point along the normal, from point to point; scanning noise belongs here"
    )
    temperature: Temperature | None = Field(default=None, description=f"the same as the key temperature of the plan: {TEMPERATURE}")
    coverage_factor: Positive = Field(default=2.0, description="k of the expanded uncertainty U = k u; 2 covers about 95 %")

    @model_validator(mode="after")
    def _something(self) -> Self:
        if self.mpe is None and self.temperature is None and not self.tip_radius_mm and not self.repeatability_mm:
            raise ValueError("one of mpe, tip_radius_mm, repeatability_mm and temperature at least")
        return self

    def stated(self, temperature: Temperature | None) -> StatedUncertainty:
        """The budget as the inspection takes it, with what the plan says of the temperature."""
        warm = temperature or Temperature(part_c=20.0, cte_per_k=0.0, compensate=True)
        budget = UncertaintyBudget(
            repeatability_mm=self.repeatability_mm,
            mpe_mm=self.mpe.a_mm if self.mpe else 0.0,
            mpe_share=self.mpe.share if self.mpe else 0.0,
            tip_radius_mm=self.tip_radius_mm,
            temperature_k=warm.u_part_k,
            expansion_per_k=warm.cte_per_k,
            off_reference_k=warm.part_c - warm.reference_c,
            u_expansion_per_k=warm.u_cte_per_k,
            compensated=warm.compensate,
        )
        return StatedUncertainty(budget, self.coverage_factor, warm.place_mm)
