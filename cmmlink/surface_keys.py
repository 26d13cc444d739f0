"""The keys of every JSON object that tells of a whole surface: their types and what they mean.

The objects are made in cmmlink.surface_json; the tests validate what commands print against these models. docs/results.md is written from
them.
"""

from pydantic import Field

from cmmlink.inspection_keys import JsonObject, VerdictReason, Zone
from cmmlink.run_keys import OfRecord, OfReplay, OfRun
from cmmlink.words import VerdictName


class NominalSurfaceNamed(JsonObject):
    """The nominal surface."""

    kind: str = Field(description="what it is: patches (faces of CAD), triangles, or cloud")
    source_format: str = Field(description="the format of its file, like step or binary STL")
    faces: int | None = Field(description="how many faces a CAD file has; null of meshes and clouds")
    triangles: int | None = Field(description="how many triangles it is taken as; null of patches and clouds")
    error_mm: float = Field(description="how far it may lie off what it stands for; that counts like the uncertainty")
    area_mm2: float = Field(description="its area")


class WorstOnSurface(JsonObject):
    """The point farthest from the middle of the tolerance zone."""

    x_mm: float = Field(description="x of the measured point in nominal coordinates")
    y_mm: float = Field(description="y of the measured point")
    z_mm: float = Field(description="z of the measured point")
    foot_mm: list[float] = Field(min_length=3, max_length=3, description="its foot point on the nominal, [x, y, z]")
    deviation_mm: float = Field(description="its deviation, positive out of material")
    face: int = Field(description="the number of the face or triangle that the foot lies on, from 1")


class SurfacePlaced(JsonObject):
    """How the scan lies on the nominal: a rotation about zero, then a translation."""

    rotation: list[list[float]] = Field(min_length=3, max_length=3, description="the rotation as a matrix, row by row")
    translation_mm: list[float] = Field(min_length=3, max_length=3, description="the translation after it, [x, y, z]")
    rotation_deg: float = Field(description="the angle of the rotation")
    steps: int = Field(description="the steps that the fit took; 0 where nothing was fitted")
    converged: bool = Field(description="whether the fit settled")
    settles_within_mm: float | None = Field(
        description="how wide the circle is in which the fit goes round; it counts as uncertainty. 0: it came to rest; null: it went on"
    )
    rms_mm: float | None = Field(description="the root mean square of the deviations that the fit made least, by area")
    rivals: int = Field(description="how many other poses fit as well, as of a symmetric part")
    weakest_direction: str | None = Field(description="the motion of the part that the points determine least; null where none is weak")
    weakest_95_mm: float | None = Field(description="how far the part may lie off along it by the scatter of the points; null: any way")
    undetermined: int = Field(description="how many directions the points do not determine at all")


class OutRegion(JsonObject):
    """A part of the surface that hangs together and is out of tolerance."""

    area_mm2: float = Field(description="the area that its points stand for")
    worst_mm: float = Field(description="the deviation farthest from the middle of the zone")
    worst_at_mm: list[float] = Field(min_length=3, max_length=3, description="the place on the nominal where that is, [x, y, z]")
    centre_mm: list[float] = Field(min_length=3, max_length=3, description="the place on the nominal in the middle of it")
    face: int = Field(description="the number of the face or triangle of the worst place, from 1")
    points: int = Field(description="how many points are out of tolerance there")


class UnmeasuredPlace(JsonObject):
    """A part of the surface that hangs together and was not measured."""

    area_mm2: float = Field(description="its area")
    centre_mm: list[float] = Field(min_length=3, max_length=3, description="the place farthest from what was measured, [x, y, z]")
    face: int = Field(description="the number of the face or triangle of that place, from 1")
    width_mm: float = Field(description="the diameter of the widest place without points in it")


class SurfaceInspected(JsonObject):
    """What was found of a surface. Without a result the counts stand beside nulls, and the verdict is uncertain."""

    verdict: VerdictName = Field(description="the verdict on the surface; uncertain: neither conformity nor nonconformity is proven")
    received: int = Field(description="the points that came through the link whole; always judged + rejected")
    judged: int = Field(description="the points with a verdict")
    rejected: int = Field(description="the points that cannot be judged")
    lost: int = Field(description="the points that are missing by the device's own counters")
    out_of_tolerance: int = Field(description="the points whose verdict is nonconform")
    max_deviation_mm: float | None = Field(description="the largest deviation")
    min_deviation_mm: float | None = Field(description="the smallest deviation")
    rms_mm: float | None = Field(description="the root mean square of the deviations")
    profile_error_mm: float | None = Field(description="2 * max |deviation|; not the range from smallest to largest")
    zone_error_mm: float | None = Field(description="2 * max |deviation - middle of the zone|; inside the zone up to the zone's width")
    worst: WorstOnSurface | None = Field(description="the point farthest from the middle of the zone")
    reasons: list[VerdictReason] = Field(description="why the verdict is what it is, the most important first; none for conform")
    assumed: list[str] = Field(description="what was assumed when the points were judged; it stands among the notes, too")
    rule: str | None = Field(description="what decided: best-fit, or datum where the pose was known")
    fit: str | None = Field(description="how the pose was found: best-fit or none")
    target_mm: float | None = Field(description="the deviation that the fit aims at: the middle of the zone")
    registration: SurfacePlaced | None = Field(description="how the scan lies on the nominal")
    regions: list[OutRegion] = Field(description="the parts of the surface out of tolerance, the largest excess first")
    coverage: float = Field(description="the share of the nominal's area that was measured, from 0 to 1")
    area_covered: float = Field(description="the same, by the name that only surfaces have")
    unmeasured: list[UnmeasuredPlace] = Field(description="the parts of the surface that were not measured, the largest first")
    widest_gap_mm: float | None = Field(description="the diameter of the widest place without points")
    gap_max_mm: float | None = Field(description="up to which diameter a place without points counts as measured")
    beyond_edge: int = Field(description="the points beyond the border of an open surface, which are rejected")
    beyond_edge_mm: float | None = Field(description="how far the farthest of them lies off it")
    complete: bool = Field(description="whether the scan came to its end")
    tolerance: Zone | None = Field(description="the tolerance that was applied; the error of the nominal is part of its uncertainty")
    nominal: NominalSurfaceNamed | None = Field(description="the nominal; null of a run on record that has no result")
    rejected_by_reason: dict[str, int] = Field(description="the number of rejected points for each reason that occurred")
    damaged_bytes: int = Field(description="the bytes on the wire that were no valid frame")


class SurfaceMeasured(OfRun, SurfaceInspected):
    """The result of a run of a surface that was not recorded (`--no-record`): also how the run ended."""


class SurfaceRecorded(OfRecord, SurfaceMeasured):
    """The result of `surface`, and of `run` with the plan of a surface: also what ties it to its record."""


class SurfaceReplayed(OfReplay, SurfaceInspected):
    """The result of `replay` of a run of a surface: also how it compares with the recorded one."""


class ComparedRun(JsonObject):
    """One of two runs of a surface."""

    run: str = Field(description="its id")
    part: str = Field(description="the name of its part")
    serial_number: str | None = Field(description="the serial number of its part")
    measured_at: str = Field(description="when it began, in UTC")
    judged: int = Field(description="its points with a verdict")
    verdict: VerdictName = Field(description="its verdict")
    fit: str = Field(description="how its pose was found")
    rule: str = Field(description="what decided: best-fit, or datum where the pose was known")
    coverage: float = Field(description="the share of the area that it measured")
    max_deviation_mm: float | None = Field(description="its largest deviation")
    min_deviation_mm: float | None = Field(description="its smallest deviation")
    rms_mm: float | None = Field(description="the root mean square of its deviations")


class PlaceCompared(JsonObject):
    """A place of the surface, and what both runs have there."""

    place_mm: list[float] = Field(min_length=3, max_length=3, description="the place on the nominal, [x, y, z]")
    face: int = Field(description="the number of the face or triangle there, from 1")
    first_mm: float = Field(description="the deviation of the first run")
    second_mm: float = Field(description="the deviation of the second run")
    difference_mm: float = Field(description="the second less the first")


class SurfacesCompared(JsonObject):
    """The answer of `compare` for two runs of a surface. Differences are the second run less the first."""

    first: ComparedRun = Field(description="the run that the other one is held against")
    second: ComparedRun = Field(description="the other run")
    nominal: str = Field(description="the name of the nominal's file")
    area_mm2: float = Field(description="the area of the nominal")
    compared: float = Field(description="the share of that area that both measured")
    largest: PlaceCompared = Field(description="where the two differ most, whatever the sign")
    mean_mm: float | None = Field(description="the mean difference over that area, whatever the density of points")
    rms_mm: float | None = Field(description="the root mean square of the difference, likewise")
    places: list[PlaceCompared] = Field(description="places far from each other where the two differ most, up to ten")
    notes: list[str] = Field(description="how the poses were found")
