"""What a drawing asks of a section: the characteristics of a plan, each with a tolerance of its own.

Every field says in its description what it means; docs/plan.md and docs/ct-plan.md are written from these descriptions.
"""

import math
import re
from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, Field, field_validator, model_validator

from cmmlink.plan.yaml_model import Positive, Settings, Text
from inspection import (
    CharacteristicFit,
    ChordAngleMethod,
    ChordMethod,
    EdgeRadiusMethod,
    EdgeThicknessMethod,
    FeatureName,
    FilterOrder,
    FreedomName,
    RuleName,
    ThicknessMethod,
    ToleranceZone,
    Transition,
)

_ISO = re.compile(r"(?P<width>\d*\.?\d+)\s*(?P<unequal>UZ\s*(?P<offset>[+-]?\d*\.?\d+)?)?", re.ASCII)
_ASME = re.compile(r"(?P<width>\d*\.?\d+)\s*\(?U\)?\s*(?P<outward>\d*\.?\d+)", re.ASCII)

_DIGITS = 12  # of a limit in mm, by which no binary fraction shows
LOWER = "the lower limit of the deviation from the nominal; null: no limit"
UPPER = "the upper limit of the deviation from the nominal; null: no limit"
U = "the expanded uncertainty U (95 %), in the unit of the value, as in ISO 14253-1"
NOMINAL = "the value of the drawing, from which the deviation is counted; null: that of the nominal section by the same method"
_FILTER = "what the deviations go through after the fit; null: they are judged raw"
_DATUM = "features of the part by which it is placed; null: the known pose, registration.datum"


def _as_list(given: object) -> object:
    """A single number as a list of one."""
    return given if isinstance(given, (list, tuple)) or given is None else [given]


Numbers = Annotated[tuple[float, ...], BeforeValidator(_as_list, json_schema_input_type=float | tuple[float, ...])]


class Place(Settings):
    """A place on the profile; one of station_mm, near and feature."""

    station_mm: float | None = Field(default=None, description="its arc length from the start of the nominal")
    near: tuple[float, float] | None = Field(default=None, description="a point [x, y]; the nominal point nearest to it is meant")
    feature: Literal["LE", "TE"] | None = Field(default=None, description="the leading or the trailing edge of an airfoil section")
    offset_mm: float = Field(default=0.0, description="how far from there along the profile, with rising stations")

    @model_validator(mode="after")
    def _one_of_three(self) -> Self:
        if sum(given is not None for given in (self.station_mm, self.near, self.feature)) != 1:
            raise ValueError("one of station_mm, near and feature")
        return self


class Stretch(Settings):
    """A stretch of the profile, with rising stations."""

    from_: Place = Field(alias="from", description="where it begins")
    to: Place = Field(description="where it ends")


class AskedDatum(Settings):
    """What places the part: measured features of its own, which together fix all three motions."""

    line: Stretch | None = Field(
        default=None, description="a stretch of least squares over a rotation and a shift across it; its nominal need not be quite straight"
    )
    edge: Literal["LE", "TE"] | None = Field(default=None, description="an edge of an airfoil section, of least squares over both shifts")
    points: tuple[Place, ...] = Field(
        default=(), description="places at each of which the deviation is zero: beside a line or an edge one, else three"
    )
    within_mm: Positive | None = Field(
        default=None,
        description="how far along the profile to either side points count for an edge and for a point, the nearer ones more for a point; "
        "null: a hundredth of the nominal's length for a point, three for an edge",
    )

    @model_validator(mode="after")
    def _fixes_three(self) -> Self:
        if 2 * (self.line is not None) + 2 * (self.edge is not None) + len(self.points) != 3:
            raise ValueError("what fixes three motions: a line and one of points, an edge and one of points, or three points")
        return self


class ProfileZone(Settings):
    """The deviations allowed, positive out of material: by limits, by width and offset (ISO UZ, ASME circled U), or along stations."""

    lower_mm: Numbers | None = Field(default=None, description="the lower limit; with stations_mm a list of them")
    upper_mm: Numbers | None = Field(default=None, description="the upper limit; with stations_mm a list of them")
    width_mm: Positive | None = Field(default=None, description="the width of the zone, in place of limits")
    offset_mm: float | None = Field(default=None, description="with width_mm, how far its middle lies out of material: UZ of ISO 1101")
    outward_mm: float | None = Field(default=None, description="with width_mm, how much lies out of material: circled U of ASME Y14.5")
    stations_mm: tuple[float, ...] | None = Field(default=None, description="where the limits stand, rising; the same twice is a step")
    between: Transition = Field(default="linear", description="how the limits run from station to station")
    border_mm: float = Field(default=0.0, ge=0, description="within this distance of a step the limits of both its sides hold")

    @model_validator(mode="before")
    @classmethod
    def _as_on_a_drawing(cls, given: Any) -> Any:
        """Take a notation of a drawing, like `0.06 UZ +0.01` or `0.06 (U) 0.04`."""
        if not isinstance(given, str):
            return given
        if iso := _ISO.fullmatch(given.strip()):
            if iso["unequal"] and iso["offset"] is None:
                raise ValueError("how far the middle lies out of material, signed, after UZ, as in 0.06 UZ +0.01: ISO 1101 wants it there")
            return {"width_mm": iso["width"], "offset_mm": iso["offset"] or "0"}
        if asme := _ASME.fullmatch(given.strip()):
            return {"width_mm": asme["width"], "outward_mm": asme["outward"]}
        raise ValueError("a mapping, or a notation like 0.06 UZ +0.01 or 0.06 (U) 0.04")

    @model_validator(mode="after")
    def _one_form(self) -> Self:
        limits = (self.lower_mm, self.upper_mm)
        if self.width_mm is not None:
            if limits != (None, None) or self.stations_mm is not None or (self.offset_mm is not None and self.outward_mm is not None):
                raise ValueError("width_mm with offset_mm or outward_mm, and no limits beside it")
            return self
        if self.lower_mm is None or self.upper_mm is None or self.offset_mm is not None or self.outward_mm is not None:
            raise ValueError("lower_mm and upper_mm, or width_mm with offset_mm or outward_mm")
        count = len(self.stations_mm) if self.stations_mm is not None else 1
        if len(self.lower_mm) != count or len(self.upper_mm) != count or not count:
            raise ValueError("one lower_mm and one upper_mm for each of stations_mm, or one of each without stations_mm")
        if any(low >= high for low, high in zip(self.lower_mm, self.upper_mm, strict=True)):
            raise ValueError("limits of which every lower one is below its upper one")
        return self

    @property
    def limits(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """The lower and the upper limits, one for each station."""
        if self.width_mm is None:
            assert self.lower_mm is not None
            assert self.upper_mm is not None
            return self.lower_mm, self.upper_mm
        upper = self.outward_mm if self.outward_mm is not None else self.width_mm / 2 + (self.offset_mm or 0.0)
        return (round(upper - self.width_mm, _DIGITS),), (round(upper, _DIGITS),)  # 0.04 - 0.06 is -0.019999999999999997


class Freed(Settings):
    """How far a fit may go from where it starts, of the freedoms that are free; zero must be allowed."""

    x_mm: tuple[float, float] | None = Field(default=None, description="the lowest and the highest shift along x; null: no limit")
    y_mm: tuple[float, float] | None = Field(default=None, description="the same along y")
    rotation_deg: tuple[float, float] | None = Field(default=None, description="the same of the rotation, counterclockwise")


class AskedFilter(Settings):
    """A Gaussian regression filter along the arc length (ISO 16610-21, -28 and -31)."""

    cutoff_mm: Positive = Field(description="the wavelength of which half the amplitude passes")
    order: FilterOrder = Field(default=2, description="the order of the polynomial; 2 follows curvature up to the ends")
    robust: bool = Field(default=False, description="weight spikes down")

    @field_validator("order", mode="before")
    @classmethod
    def _number(cls, order: object) -> object:
        return int(order) if isinstance(order, str) and order in ("0", "2") else order


class _Named(Settings):
    name: Text = Field(description="the name of the characteristic, which no other one of the plan has")
    uncertainty_from: Text | None = Field(
        default=None,
        description="where its U comes from, such as the study of a measuring system whose report spells this key; a note tells it",
    )


class AskedProfile(_Named):
    """A zone around the profile or a region of it, with a fit and a filter of its own."""

    type: Literal["line-profile"] = Field(description="profile of a line (ISO 1101, ASME Y14.5)")
    zone: ProfileZone = Field(description="a mapping with lower_mm and upper_mm, or a notation of a drawing like 0.06 UZ +0.01")
    from_: Place | None = Field(default=None, alias="from", description="where its region begins; it runs with rising stations")
    to: Place | None = Field(default=None, description="where its region ends")
    region: FeatureName | None = Field(default=None, description="its region by name, in place of from and to: a side or an edge")
    within_mm: Positive | None = Field(default=None, description="with region LE or TE, how far along the profile to either side")
    fit: CharacteristicFit = Field(
        default="best-fit",
        description="where it is judged: none (where the run judges its points), datum, or at a fit of its region: best-fit, minimum-zone, "
        "or tolerance (the least consumption of its zone)",
    )
    datum: AskedDatum | None = Field(
        default=None, description="with fit datum, the features of the part by which it is placed; null: the known pose, registration.datum"
    )
    free: tuple[FreedomName, ...] = Field(default=("x", "y", "rotation"), description="the motions that the fit may make")
    limits: Freed = Field(default=Freed(), description="how far the free motions may go from the datum")
    pivot_mm: tuple[float, float] = Field(default=(0.0, 0.0), description="what a rotation turns about, in the nominal's coordinates")
    x_axis_deg: float = Field(default=0.0, description="the direction of x in the nominal's coordinates, for free and limits")
    filter: AskedFilter | None = Field(default=None, description=_FILTER)
    rule: RuleName | None = Field(default=None, description="what decides at a free best fit; null: the rule of the plan")
    uncertainty_mm: float | None = Field(
        default=None,
        ge=0,
        description="the expanded uncertainty U (95 %) of one deviation, with that of a measured datum; null: that of the run, by "
        "tolerance or by the budget",
    )

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        if (self.from_ is None) != (self.to is None):
            raise ValueError("both from and to, or neither")
        if self.region is not None and self.to is not None:
            raise ValueError("either region, or from and to")
        if (self.within_mm is not None) != (self.region in ("LE", "TE")):
            raise ValueError("within_mm with region LE or TE, and with nothing else")
        if self.datum is not None and self.fit != "datum":
            raise ValueError(f"fit datum beside a datum, not fit {self.fit}")
        if self.uncertainty_from is not None and self.uncertainty_mm is None:
            raise ValueError("uncertainty_mm beside uncertainty_from, which says where it comes from")
        if self.zone.stations_mm is not None and self.fit == "minimum-zone":
            raise ValueError("fit tolerance for a zone that varies along the profile: a minimum zone has one width")
        return self

    @property
    def is_whole(self) -> bool:
        """Whether it is of the whole profile."""
        return self.from_ is None and self.region is None

    @property
    def is_all_free(self) -> bool:
        """Whether its fit may make every motion."""
        return set(self.free) == {"x", "y", "rotation"} and self.limits == Freed()

    def envelope(self, uncertainty_mm: float) -> ToleranceZone:
        """The zone from its smallest lower to its largest upper limit. Raises ValueError where U leaves nothing provable."""
        lower, upper = self.zone.limits
        return ToleranceZone(min(lower), max(upper), uncertainty_mm)


class Limited(_Named):
    """What has limits of its deviation."""

    @model_validator(mode="after")
    def _some_limit(self) -> Self:
        low, high = self.limits_of_deviation
        if math.isinf(low) and math.isinf(high):
            raise ValueError("a lower limit, an upper one, or both")
        if not low < high:
            raise ValueError(f"an upper limit above the lower one, {low:g}")
        if self.uncertainty_from is not None and not self.expanded_uncertainty:
            raise ValueError("an uncertainty beside uncertainty_from, which says where it comes from")
        if 2 * self.expanded_uncertainty >= high - low:
            raise ValueError(f"an uncertainty of less than half the {high - low:g} between the limits: more leaves nothing provable")
        return self

    @property
    def limits_of_deviation(self) -> tuple[float, float]:
        """Lower and upper limit of the deviation, infinite where there is none."""
        raise NotImplementedError

    @property
    def expanded_uncertainty(self) -> float:
        """U, in the unit of the value."""
        raise NotImplementedError


class InMm(Limited):
    """What is a length."""

    nominal_mm: float | None = Field(default=None, description=NOMINAL)
    lower_mm: float | None = Field(default=None, description=LOWER)
    upper_mm: float | None = Field(default=None, description=UPPER)
    uncertainty_mm: float = Field(default=0.0, ge=0, description=U)

    @property
    def limits_of_deviation(self) -> tuple[float, float]:
        """Lower and upper limit of the deviation, infinite where there is none."""
        return limits_of(self.lower_mm, self.upper_mm)

    @property
    def expanded_uncertainty(self) -> float:
        """U, in mm."""
        return self.uncertainty_mm

    @property
    def nominal(self) -> float | None:
        """The value of the drawing."""
        return self.nominal_mm


class InDeg(Limited):
    """What is an angle."""

    nominal_deg: float | None = Field(default=None, description=NOMINAL)
    lower_deg: float | None = Field(default=None, description=LOWER)
    upper_deg: float | None = Field(default=None, description=UPPER)
    uncertainty_deg: float = Field(default=0.0, ge=0, description=U)

    @property
    def limits_of_deviation(self) -> tuple[float, float]:
        """Lower and upper limit of the deviation, infinite where there is none."""
        return limits_of(self.lower_deg, self.upper_deg)

    @property
    def expanded_uncertainty(self) -> float:
        """U, in degrees."""
        return self.uncertainty_deg

    @property
    def nominal(self) -> float | None:
        """The value of the drawing."""
        return self.nominal_deg


class _OfOutline(_Named):
    filter: AskedFilter | None = Field(default=None, description="what the actual section is drawn from went through; null: raw deviations")


class Chord(_OfOutline, InMm):
    """The length of the chord."""

    type: Literal["chord"] = Field(description="the length of the chord")
    method: ChordMethod = Field(default="tangent", description="how it is measured; the methods differ by up to half a percent")


class ChordAngle(_OfOutline, InDeg):
    """The angle of the chord, counted from the datum."""

    type: Literal["chord-angle"] = Field(description="the angle of the chord from the x axis, from leading to trailing edge; needs a datum")
    method: ChordAngleMethod = Field(default="nose-tail", description="by nose and tail, by the flat, or by the farthest two places")
    datum: AskedDatum | None = Field(default=None, description=_DATUM)


class Thickness(_OfOutline, InMm):
    """The largest thickness."""

    type: Literal["thickness"] = Field(description="the largest thickness")
    method: ThicknessMethod = Field(default="inscribed", description="by the largest inscribed circle, or square to the camber line")


class EdgeThickness(_OfOutline, InMm):
    """The thickness at a stated way in from an edge, square to the camber line or, for a blunt edge, along its flat."""

    type: Literal["edge-thickness"] = Field(description="the thickness at a stated way in from an edge")
    method: EdgeThicknessMethod = Field(
        default="tip-arc",
        description="where an arc about the edge point meets the camber line, or (offset-flat) a line parallel to the outline there; "
        "square to the camber line, or (-square) along the flat of a blunt edge",
    )
    edge: Literal["leading", "trailing"] = Field(description="which edge")
    offset_mm: Positive = Field(description="how far in from the edge point")


class EdgeRadius(_OfOutline, InMm):
    """The radius of an edge."""

    type: Literal["edge-radius"] = Field(description="the radius of an edge")
    method: EdgeRadiusMethod = Field(default="circle", description="by a circle through a window around the tip, or by the curvature there")
    edge: Literal["leading", "trailing"] = Field(default="leading", description="which edge; only a round trailing edge has one")
    window_deg: float = Field(default=30.0, gt=0, le=180, description="how far the tangent turns from the tip to either end of the window")


class Camber(_OfOutline, InMm):
    """The largest camber."""

    type: Literal["camber"] = Field(description="how far the camber line bulges from the line between its ends, positive upwards")
    method: Literal["inscribed"] = Field(default="inscribed", description="the camber line is that of the centres of inscribed circles")


class Twist(_OfOutline, InDeg):
    """How the section is turned against its nominal, counted from the datum, positive counterclockwise."""

    type: Literal["twist"] = Field(description="how the section is turned against its nominal; needs a datum")
    method: Literal["best-fit", "nose-tail", "caliper", "maximum-distance"] = Field(
        default="best-fit", description="by the best fit of the whole outline, or by the chord angle of that name"
    )
    datum: AskedDatum | None = Field(default=None, description=_DATUM)


class Displacement(InMm):
    """How far the section lies from its nominal, counted from the datum."""

    type: Literal["displacement"] = Field(description="how far the section lies from its nominal; needs a datum")
    method: Literal["best-fit"] = Field(default="best-fit", description="by the best fit of the whole outline")
    axis: Literal["total", "x", "y"] = Field(default="total", description="along x, along y, or in all")
    place_mm: tuple[float, float] = Field(
        default=(0.0, 0.0), description="the place of the nominal that is looked at, like a stacking point"
    )
    datum: AskedDatum | None = Field(default=None, description=_DATUM)


AskedCharacteristic = Annotated[
    AskedProfile | Chord | ChordAngle | Thickness | EdgeThickness | EdgeRadius | Camber | Twist | Displacement, Field(discriminator="type")
]


def limits_of(lower: float | None, upper: float | None) -> tuple[float, float]:
    """Limits as numbers, infinite where there is none."""
    return -math.inf if lower is None else lower, math.inf if upper is None else upper
