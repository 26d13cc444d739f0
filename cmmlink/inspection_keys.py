"""The keys of what the inspection found of one section, piece by piece: its characteristics, pose, zone, uncertainty and gaps.

The objects are made in cmmlink.characteristics_json and cmmlink.result_json; cmmlink.result_keys has the objects that hold them.
"""

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field

from cmmlink.words import VerdictName


class JsonObject(BaseModel):
    """An object of which every key is known."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)


class QualificationNamed(JsonObject):
    """The last qualification of the installation (`cmmlink qualify`), as it was when the part was measured."""

    date: str = Field(description="when it was made, in UTC")
    result: Literal["passed", "failed"] = Field(description="what came of it")
    certificate_sha256: str = Field(description="the hash of what its certificate says")
    same_installation: bool = Field(description="whether the installation was still as it was then, to the bit")
    words: str = Field(description="the same as a sentence, with what changed since")


class Worst(JsonObject):
    """The point farthest from the middle of the tolerance zone."""

    station_mm: float = Field(description="arc length of its foot point from the start of the nominal")
    x_mm: float = Field(description="x of the actual point in nominal coordinates")
    y_mm: float = Field(description="y of the actual point in nominal coordinates")
    deviation_mm: float = Field(description="its deviation, positive out of material")


class Pose(JsonObject):
    """A motion from section coordinates to nominal coordinates."""

    rotation_deg: float = Field(description="the rotation about the section's origin, counterclockwise")
    translation_mm: list[float] = Field(min_length=2, max_length=2, description="the translation after the rotation, [x, y]")


class VerdictReason(JsonObject):
    """One reason of the verdict."""

    kind: str = Field(description="what kind of reason it is, like missing or gap; these words never change")
    words: str = Field(description="the reason as a sentence")


class Region(JsonObject):
    """A stretch of the profile."""

    from_mm: float = Field(description="the station at which it begins")
    to_mm: float = Field(description="the station at which it ends; below from_mm where it crosses the seam of a closed profile")


class Placed(JsonObject):
    """A place in the nominal's coordinates, and what it is."""

    name: str = Field(description="what it is, like leading or centre")
    x_mm: float = Field(description="its x")
    y_mm: float = Field(description="its y")


class Witness(JsonObject):
    """A measured point that a proof needs."""

    index: int = Field(description="the number of the point in deviations.csv")
    x_mm: float = Field(description="its x in section coordinates")
    y_mm: float = Field(description="its y in section coordinates")


class Holding(Witness):
    """A measured point that holds a minimum zone."""

    deviation_mm: float | None = Field(description="its deviation from the middle of a minimum zone: half the zone, with sign")
    station_mm: float = Field(description="the arc length of its foot point")
    multiplier: float = Field(description="its share in the balance of gradients; they are positive and add up to 1")


class VaryingLimits(JsonObject):
    """Limits of the deviation that vary along the profile."""

    station_mm: list[float] = Field(description="where they stand, rising; the same twice is a step")
    lower_mm: list[float] = Field(description="the lower limits there")
    upper_mm: list[float] = Field(description="the upper limits there")
    between: Literal["linear", "smooth", "constant"] = Field(description="how they run from station to station")
    border_mm: float = Field(description="within this distance of a step the limits of both its sides hold")


class Certificate(JsonObject):
    """What proves a minimum zone, or a least consumption of a zone that varies, over every placement of the part."""

    kind: Literal["minimum-zone", "consumption"] = Field(description="what is proven")
    zone_mm: float | None = Field(description="the width of the minimum zone")
    middle_mm: float | None = Field(description="the deviation in its middle")
    consumption: float | None = Field(description="of a zone that varies: the largest share of it that the points consume")
    bound: float = Field(description="the proof is of this: half a zone in mm, or a share of the zone")
    gap_mm: float | None = Field(description="by how much that is less than half the minimum zone")
    tip_radius_mm: float = Field(description="the points are centres of a ball of this radius")
    limits: VaryingLimits | None = Field(description="of a least consumption: the limits that are consumed")
    pose: Pose = Field(description="where the part lies in it")
    active: list[Holding] = Field(description="the points that hold it: no small motion makes it smaller")
    imbalance: float | None = Field(description="what is left of the sum of the points' gradients, by multiplier and sign; 0 is a proof")
    proven: bool = Field(description="whether no rigid motion brings the witnesses within the bound")
    witnesses: list[Witness] = Field(description="the points that the proof over every placement needs")
    boxes: int = Field(description="the boxes of motions that the proof looked at")
    finest_mm: float | None = Field(description="the least by which one of them moves the point that refutes it")
    words: str = Field(description="all this in three lines")


class DatumFeature(JsonObject):
    """A feature of the part that it was placed by."""

    kind: Literal["line", "edge", "point"] = Field(description="what it is")
    words: str = Field(description="the same with its place, in words")
    from_mm: float = Field(description="the station at which its points begin")
    to_mm: float = Field(description="the station at which they end; below from_mm where they cross the seam of a closed profile")
    points: int = Field(description="how many points lie on it")
    rms_mm: float = Field(description="the root mean square of their deviations where the part was placed")
    largest_gap_mm: float = Field(description="the longest stretch of it without a point")


class Characterised(JsonObject):
    """A characteristic: its value, its tolerance, how it was found, and its verdict."""

    name: str = Field(description="its name in the plan; profile for the tolerance of a plan")
    type: str = Field(description="what it is, like line-profile or chord")
    method: str = Field(description="how the value was found, with the window that the method used")
    value: float | None = Field(description="its value in the unit; of a profile 2 * max |deviation - middle of the zone|; null: none")
    nominal: float | None = Field(description="the value that the deviation is counted from; null for a profile")
    unit: Literal["mm", "deg", "1"] = Field(description="the unit of all its numbers")
    lower: float | None = Field(description="the lower limit of the deviation, of a varying zone at the worst point; null: no limit")
    upper: float | None = Field(description="the upper limit, likewise")
    deviation: float | None = Field(description="value - nominal; of a profile the deviation of the worst point")
    consumption: float | None = Field(description="the share of the tolerance that the deviation consumes, 1 at a limit")
    uncertainty: float = Field(description="the expanded uncertainty U that the verdict takes into account, 0 where none was stated")
    rule: str = Field(description="what decided, and how U counts")
    verdict: VerdictName = Field(description="the verdict on this characteristic; the part has the worst of all")
    reasons: list[VerdictReason] = Field(description="why, the most important first; none for conform")
    worst: Worst | None = Field(description="of a profile, the point that consumes most of its zone, at the pose of the characteristic")
    fit: str = Field(description="how the pose was found, with what was locked or limited; none: that of the run")
    filter: str = Field(description="what the deviations went through; none: raw")
    weights: str = Field(description="how points counted in the fit; none where they all count alike")
    region: Region | None = Field(description="the stretch of the profile; null: the whole")
    region_words: str = Field(description="the region in words")
    zone: str = Field(description="of a profile, the tolerance in the notations of ISO 1101 (UZ) and ASME Y14.5 (circled U, here (U))")
    pose: Pose | None = Field(description="where it was judged; null where it was not")
    coverage: float | None = Field(description="the share of what it depends on that was measured, from 0 to 1")
    largest_gap_mm: float | None = Field(description="the longest stretch of that without a judged point")
    datum: list[DatumFeature] | None = Field(description="the features of the part that it was placed by; null: none were measured for it")
    places: list[Placed] = Field(description="the places that the value was found at, in the nominal's coordinates")
    notes: list[str] = Field(description="what the method had to assume")
    certificate: Certificate | None = Field(description="what proves a minimum zone; null for other fits")


class Registered(Pose):
    """How the section lies on the nominal."""

    iterations: int = Field(description="the steps that the fit took; 0 where nothing was fitted")
    converged: bool = Field(description="whether the fit settled")
    other_poses: list[Pose] = Field(description="poses that fit as well, for a part that is symmetric; a datum settles which one is meant")


class OutStretch(JsonObject):
    """A contiguous part of the profile that is out of tolerance."""

    from_mm: float = Field(description="the station at which it begins")
    to_mm: float = Field(description="the station at which it ends; below from_mm where it crosses the seam of a closed profile")
    worst_mm: float = Field(description="the deviation in it that is farthest from the middle of the zone")


class Zone(JsonObject):
    """The tolerance that was applied."""

    lower_mm: float = Field(description="the lower limit of the deviation")
    upper_mm: float = Field(description="the upper limit of the deviation")
    uncertainty_mm: float = Field(description="the expanded uncertainty of one deviation")
    decision_rule: str = Field(description="how the uncertainty counts, in words; simple acceptance where none was stated")


class BudgetLine(JsonObject):
    """One line of the budget of the uncertainty, by the GUM, at the station where U is largest."""

    name: str = Field(description="what contributes: repeatability, device, tip radius, temperature or expansion")
    value: float = Field(description="what the plan states of it; of the device its maximum permissible error over the size of the part")
    unit: str = Field(description="the unit of that value")
    distribution: str = Field(description="normal or rectangular")
    evaluated: str = Field(description="the type of its evaluation, A or B")
    standard: float = Field(description="its standard uncertainty, in the unit of the value")
    sensitivity: float = Field(description="mm of the deviation for a unit of it")
    contributed_mm: float = Field(description="what it contributes: the standard uncertainty times the sensitivity")
    share: float = Field(description="its share of u^2, from 0 to 1")


class UncertaintyAt(JsonObject):
    """The expanded uncertainty at one place of the profile."""

    station_mm: float = Field(description="where, as arc length from the start of the nominal")
    expanded_mm: float = Field(description="U of a deviation there")


class Uncertainty(JsonObject):
    """How uncertain the deviations are, where the plan states a budget."""

    basis: str = Field(description="what the deviations are counted from: the known pose, any placement of the part, or the best fit")
    coverage_factor: float = Field(description="k of U = k u; 2 covers about 95 %")
    largest_mm: float = Field(description="the largest U along the profile")
    station_mm: float = Field(description="the station where it is")
    standard_mm: float = Field(description="the combined standard uncertainty u there")
    growth_left_mm: float = Field(description="growth there that is known and was not compensated; it is added to k u in full")
    used_mm: float = Field(description="the U that judged the points; no station has a larger one")
    largest_by_noise_mm: float = Field(description="how much the stated repeatability raises the largest |deviation| on average")
    budget: list[BudgetLine] = Field(description="what contributes, at the station where U is largest")
    stations: list[UncertaintyAt] = Field(description="U along the profile, at no more than 200 stations: each the largest of its stretch")


class LargestGap(JsonObject):
    """The longest stretch of the profile without a judged point."""

    from_mm: float = Field(description="the station at which it begins")
    to_mm: float = Field(description="the station at which it ends; below from_mm where it crosses the seam of a closed profile")
    allowed_mm: float = Field(description="the longest gap that counts as measured")
    could_hide_mm: float = Field(description="how far the nominal stands off the straight line across it: so much could be missing unseen")
