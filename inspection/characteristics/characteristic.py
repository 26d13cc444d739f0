"""What a drawing asks of a section, one characteristic after the other, and what was found of each.

A characteristic has its own tolerance and, where it is of the profile, its own region, fit and filter. What was found carries
everything that the number depends on: a value without its method is none.
"""

from dataclasses import dataclass
from typing import Literal

from inspection.characteristics.error_fields import Sensitivities
from inspection.characteristics.outline import AirfoilSection, Edge
from inspection.characteristics.section_value import SectionValue, Unit
from inspection.conclusion import Reason
from inspection.datum import DatumFeatures, FoundDatum
from inspection.filters import ProfileFilter
from inspection.first_use import OnFirstUse
from inspection.freedoms import Freedoms
from inspection.methods import RuleName
from inspection.rigid import RigidTransform
from inspection.verdict import Verdict
from inspection.zone_certificate import ConsumptionCertificate, ZoneCertificate
from inspection.zones import VaryingZone

CharacteristicFit = Literal["none", "datum", "best-fit", "minimum-zone", "tolerance"]
SectionKind = Literal[
    "chord", "chord-angle", "thickness", "edge-thickness", "edge-radius", "camber", "twist", "displacement"
]  # what is evaluated of an airfoil section beside its profile
CharacteristicKind = Literal[
    "line-profile",
    "chord",
    "chord-angle",
    "thickness",
    "edge-thickness",
    "edge-radius",
    "camber",
    "twist",
    "displacement",
    "relative-twist",
    "bow",
    "lean",
    "taper",
    "stacking-axis",
]


@dataclass(frozen=True, slots=True)
class Region:
    """A stretch of the profile by its stations in mm; `from_mm` is above `to_mm` where it crosses the seam of a closed profile."""

    from_mm: float
    to_mm: float


@dataclass(frozen=True, slots=True)
class WholeProfile:
    """The profile as the run itself judges it: its zone, its fit and its rule are those of the run."""

    name: str


@dataclass(frozen=True, slots=True, eq=False)
class LineProfile:
    """A zone around the profile or a region of it, judged at a pose of its own.

    zone        : limits of the deviation along the whole profile
    uncertainty_mm : expanded uncertainty U of one deviation; None for that of the run
    region      : None for the whole profile. Which points belong to it is decided by their stations at the pose of the run
    fit         : how the pose is found: "none" (that of the run), "datum", by least squares, by the smallest zone, or by the least
                  consumption of the zone
    freedoms    : motions that the fit may make from where it starts; None frees all
    datum       : the known pose, from section to nominal, where fits with locked or limited freedoms start; None: the pose of the run
    features    : with fit "datum", what the part is placed by where that is measured; None for a known pose
    filter      : acts on the deviations after the fit; None judges them raw
    rule        : what decides where a best fit is free: "minimum-zone" (any placement may pass), or "best-fit"
    region_words, zone_words : both as the user gave them, for reports
    """

    name: str
    zone: VaryingZone
    uncertainty_mm: float | None = None
    region: Region | None = None
    fit: CharacteristicFit = "best-fit"
    freedoms: Freedoms | None = None
    datum: RigidTransform | None = None
    features: DatumFeatures | None = None
    filter: ProfileFilter | None = None
    rule: RuleName = "minimum-zone"
    region_words: str = "whole profile"
    zone_words: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class SectionCharacteristic:
    """A number of an airfoil section, such as its chord, within limits of its deviation from the nominal one.

    type     : what it is, and `method` by which method; `edge`, `offset_mm`, `window_deg`, `axis` and `place_mm` as its method needs
    nominal_value : what the deviation is counted from: the value of the drawing; NaN for that of the nominal section
    section, nominal : the nominal section, and its value by the same method; filled in by `with_nominal`
    sensitivities : of the value to errors of the points, likewise; None where the pose of the best fit gives it
    lower, upper : limits of the deviation, in the unit of the value; infinite where there is none
    uncertainty  : expanded uncertainty U of the value
    datum    : the known pose, from section to nominal, that angles and places are counted from; None where there is none
    features : what the part is placed by, in place of a known pose
    filter   : the actual section is drawn from filtered deviations; None takes them raw
    """

    name: str
    type: SectionKind
    method: str
    lower: float
    upper: float
    nominal_value: float = float("nan")
    uncertainty: float = 0.0
    edge: Edge = "leading"
    offset_mm: float = 0.0
    window_deg: float = 30.0
    axis: Literal["total", "x", "y"] = "total"
    place_mm: tuple[float, float] = (0.0, 0.0)
    datum: RigidTransform | None = None
    features: DatumFeatures | None = None
    filter: ProfileFilter | None = None
    section: AirfoilSection | None = None
    nominal: SectionValue | None = None
    sensitivities: OnFirstUse[Sensitivities] | None = None


Characteristic = WholeProfile | LineProfile | SectionCharacteristic


@dataclass(frozen=True, slots=True)
class WorstPlace:
    """The point of a characteristic that consumes most of its tolerance; x and y in the nominal's coordinates at its pose."""

    station_mm: float
    x_mm: float
    y_mm: float
    deviation_mm: float


@dataclass(frozen=True, slots=True, eq=False)
class CharacteristicResult:
    """What was found of one characteristic.

    method       : how the value was found, with the window that the method used
    value        : in `unit`; of a profile the width 2 * max |deviation - middle of the zone|; NaN where there is none
    nominal      : NaN where there is none, as of a profile
    lower, upper : limits of the deviation; infinite where there is none; of a zone that varies those at the worst point
    deviation    : value - nominal; of a profile the deviation of the worst point
    consumption  : share of the tolerance that the deviation consumes, 1 at a limit; NaN where only one side is limited
    uncertainty  : expanded uncertainty U, in the unit
    rule         : what decided, in words
    fit, filter, weights : how the pose was found, what the deviations went through, how points counted; "none" where there was none
    region       : the stretch of the profile that was judged; None for the whole, and `region_words` as the user gave it
    zone_words   : the tolerance in the notations of ISO 1101 and ASME Y14.5, or in words
    pose         : nominal from section, where it was judged; None where there was none
    coverage     : share of the region that was measured, and `gap_mm` the longest stretch of it without a point
    certificate  : what proves a minimum zone or a least consumption; None for other fits
    datum        : the features that it was placed by, where these were measured
    places_mm    : places of a number of the section, for a drawing, with their names
    notes        : what the method had to assume
    drawing      : how far the drawn section may mislead about a number of it, in the unit
    """

    name: str
    type: CharacteristicKind
    method: str
    value: float
    nominal: float
    unit: Unit
    lower: float
    upper: float
    deviation: float
    consumption: float
    uncertainty: float
    rule: str
    verdict: Verdict
    reasons: tuple[Reason, ...]
    worst: WorstPlace | None = None
    fit: str = "none"
    filter: str = "none"
    weights: str = "none"
    region: Region | None = None
    region_words: str = ""
    zone_words: str = ""
    pose: RigidTransform | None = None
    coverage: float = float("nan")
    gap_mm: float = float("nan")
    certificate: ZoneCertificate | ConsumptionCertificate | None = None
    datum: FoundDatum | None = None
    places_mm: tuple[tuple[str, float, float], ...] = ()
    notes: tuple[str, ...] = ()
    drawing: float = 0.0


def consumption_of(deviation: float, lower: float, upper: float) -> float:
    """Share of a tolerance that a deviation consumes, 1 at a limit; NaN where only one side is limited."""
    return abs(2 * deviation - lower - upper) / (upper - lower) if upper - lower < float("inf") else float("nan")


def verdict_of(deviation: float, lower: float, upper: float, guard: float) -> Verdict:
    """What is proven of one deviation that must lie by `guard` inside or outside the limits; a limit itself is inside."""
    beyond = max(lower - deviation, deviation - upper)
    if beyond > guard:
        return Verdict.NONCONFORM
    return Verdict.CONFORM if beyond <= -guard else Verdict.UNCERTAIN
