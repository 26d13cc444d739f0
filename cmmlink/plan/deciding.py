"""What every plan says of how a part is judged: the tolerance, the characteristics, and what the verdict rests on."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from typing import Annotated, Protocol

from pydantic import Field, ValidationInfo, field_validator
from pydantic_core import PydanticCustomError

from cmmlink.plan.characteristics import AskedCharacteristic, AskedProfile
from cmmlink.plan.spelled import Spelled
from cmmlink.plan.uncertainty import DECISION_RULE, TEMPERATURE, UNCERTAINTY, Temperature, Uncertainty
from cmmlink.plan.yaml_model import Positive, Settings
from inspection import DecisionRule, RuleName, ToleranceZone, WeightName

PROFILE = "profile"  # the characteristic that a tolerance is the short form of
TOLERANCE = (
    "a mapping with lower_mm and upper_mm: the characteristic called profile, of the whole profile. It may be left out where the "
    "characteristics have a line-profile, the first of which is of the whole profile: then that one judges the points as they arrive"
)


class Tolerance(Settings):
    """Limits of the deviation, positive out of material, and its expanded uncertainty."""

    lower_mm: float = Field(description="the lower limit of the deviation in mm, like -0.05")
    upper_mm: float = Field(description="the upper limit of the deviation in mm, like 0.05")
    uncertainty_mm: float = Field(default=0.0, description="the expanded uncertainty U (95 %) of one deviation, as in ISO 14253-1")

    @field_validator("upper_mm")
    @classmethod
    def _above_lower(cls, upper_mm: float, info: ValidationInfo) -> float:
        lower_mm = info.data.get("lower_mm")
        if lower_mm is not None and upper_mm <= lower_mm:
            raise ValueError(f"a number above the lower limit, {lower_mm:g}")
        return upper_mm

    @field_validator("uncertainty_mm")
    @classmethod
    def _provable(cls, uncertainty_mm: float, info: ValidationInfo) -> float:
        if "lower_mm" in info.data and "upper_mm" in info.data:
            width = info.data["upper_mm"] - info.data["lower_mm"]
            if not 0 <= 2 * uncertainty_mm < width:
                raise ValueError(f"zero or more, and less than half the zone of {width:g} mm: more leaves nothing provable")
        return uncertainty_mm

    @property
    def zone(self) -> ToleranceZone:
        """The tolerance as the inspection takes it."""
        return ToleranceZone(self.lower_mm, self.upper_mm, self.uncertainty_mm)


class Allow(Settings):
    """What may be missing although conformity is to be proven."""

    unseen_mm: float | None = Field(
        default=None,
        ge=0,
        description="the longest stretch of the profile that may be unseen where points were lost, damaged or rejected; null: none may be",
    )


class _HasName(Protocol):
    @property
    def name(self) -> str: ...


def check_names(asked: Sequence[_HasName]) -> None:
    """Raise ValueError where two characteristics have one name."""
    names = Counter(one.name for one in asked)
    if twice := next((name for name, count in names.items() if count > 1), None):
        raise ValueError(f"characteristics with names of their own; '{twice}' is given {names[twice]} times")


def _first_profile(asked: tuple[AskedCharacteristic, ...]) -> AskedProfile | None:
    """The first line-profile, if it is one of the whole profile."""
    first = next((one for one in asked if isinstance(one, AskedProfile)), None)
    return first if first is not None and first.is_whole else None


class Deciding(Spelled):
    """How the verdict on the part is reached: what every plan of sections may say."""

    rule: RuleName = Field(
        default="minimum-zone",
        description="what decides without a datum: minimum-zone (a part conforms when any placement passes, ISO 1101), or best-fit",
    )
    weights: WeightName = Field(
        default="arc-length", description="how points count in the best fit: by the length of profile that each stands for, or all alike"
    )
    gap_max_mm: Positive | None = Field(
        default=None, description="the longest stretch without a point that counts as measured; null: a hundredth of the nominal's length"
    )
    end_allowance_mm: Annotated[float, Field(ge=0)] | None = Field(
        default=None, description="how far points may lie beyond an end of an open profile; null: half the width of the zone"
    )
    allow: Allow = Field(default=Allow(), description="what may be missing although conformity is to be proven")
    characteristics: tuple[AskedCharacteristic, ...] = Field(
        default=(), description="what is evaluated of a section, each with a verdict of its own; the part has the worst of them"
    )
    tolerance: Tolerance | None = Field(default=None, validate_default=True, description=TOLERANCE)
    decision_rule: DecisionRule = Field(default="iso-14253-1", description=DECISION_RULE)
    uncertainty: Uncertainty | None = Field(default=None, description=UNCERTAINTY)
    temperature: Temperature | None = Field(default=None, description=TEMPERATURE)

    @field_validator("characteristics")
    @classmethod
    def _names_of_their_own(cls, asked: tuple[AskedCharacteristic, ...]) -> tuple[AskedCharacteristic, ...]:
        check_names(asked)
        return asked

    @field_validator("tolerance")
    @classmethod
    def _some_zone(cls, tolerance: Tolerance | None, info: ValidationInfo) -> Tolerance | None:
        asked: tuple[AskedCharacteristic, ...] | None = info.data.get("characteristics")
        if asked is None:
            return tolerance
        if tolerance is None and _first_profile(asked) is None:
            raise PydanticCustomError("missing", "missing")
        if tolerance is not None and any(one.name == PROFILE for one in asked):
            raise ValueError(f"no tolerance beside a characteristic called {PROFILE}: that is what it is the short form of")
        return tolerance

    @field_validator("uncertainty")
    @classmethod
    def _one_uncertainty(cls, uncertainty: Uncertainty | None, info: ValidationInfo) -> Uncertainty | None:
        tolerance: Tolerance | None = info.data.get("tolerance")
        if uncertainty is not None and tolerance is not None and tolerance.uncertainty_mm:
            raise ValueError(f"either uncertainty or tolerance.uncertainty_mm, which is {tolerance.uncertainty_mm:g}: U has one source")
        return uncertainty

    @field_validator("temperature")
    @classmethod
    def _one_temperature(cls, temperature: Temperature | None, info: ValidationInfo) -> Temperature | None:
        budget: Uncertainty | None = info.data.get("uncertainty")
        if temperature is None or "uncertainty" not in info.data:
            return temperature
        if budget is not None and budget.temperature is not None:
            raise ValueError("either temperature or uncertainty.temperature: the part has one")
        if budget is None and (temperature.u_part_k or temperature.u_cte_per_k):
            raise ValueError("no u_part_k and u_cte_per_k without a budget under uncertainty: they count in nothing else")
        return temperature

    @property
    def warmth(self) -> Temperature | None:
        """How warm the part was, wherever the plan says it."""
        return self.temperature or (self.uncertainty.temperature if self.uncertainty else None)

    @property
    def first_profile(self) -> AskedProfile:
        """The line-profile whose zone judges the points as they arrive, in a plan without a tolerance."""
        first = _first_profile(self.characteristics)
        assert first is not None
        return first

    @property
    def zone(self) -> ToleranceZone:
        """The zone that judges the points as they arrive: the tolerance, or the envelope of the first line-profile's zone.

        Without the U of a budget, which depends on the nominal.
        """
        own_mm = 0.0 if self.uncertainty or self.tolerance else self.first_profile.uncertainty_mm or 0.0
        zone = self.tolerance.zone if self.tolerance else self.first_profile.envelope(own_mm)
        return replace(zone, rule=self.decision_rule)
