"""The keys of every JSON object that a command prints or writes: their types and what they mean.

The objects are made elsewhere (cmmlink.result_json, cmmlink.stack, cmmlink.record); the tests validate what every command prints
against these models, which know no key that is not there. docs/results.md is written from them.
"""

from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from cmmlink.events import Ending
from cmmlink.words import VerdictName

State = Literal["complete", "interrupted", "aborted", "running", "damaged"]


class _Json(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)


class Worst(_Json):
    """The point farthest from the middle of the tolerance zone."""

    station_mm: float = Field(description="arc length of its foot point from the start of the nominal")
    x_mm: float = Field(description="x of the actual point in nominal coordinates")
    y_mm: float = Field(description="y of the actual point in nominal coordinates")
    deviation_mm: float = Field(description="its deviation, positive out of material")


class Pose(_Json):
    """A motion from section coordinates to nominal coordinates."""

    rotation_deg: float = Field(description="the rotation about the section's origin, counterclockwise")
    translation_mm: list[float] = Field(min_length=2, max_length=2, description="the translation after the rotation, [x, y]")


class Registered(Pose):
    """How the section lies on the nominal."""

    iterations: int = Field(description="the steps that the fit took; 0 where nothing was fitted")
    converged: bool = Field(description="whether the fit settled")
    other_poses: list[Pose] = Field(description="poses that fit as well, for a part that is symmetric; a datum settles which one is meant")


class OutStretch(_Json):
    """A contiguous part of the profile that is out of tolerance."""

    from_mm: float = Field(description="the station at which it begins")
    to_mm: float = Field(description="the station at which it ends; below from_mm where it crosses the seam of a closed profile")
    worst_mm: float = Field(description="the deviation in it that is farthest from the middle of the zone")


class Zone(_Json):
    """The tolerance that was applied."""

    lower_mm: float = Field(description="the lower limit of the deviation")
    upper_mm: float = Field(description="the upper limit of the deviation")
    uncertainty_mm: float = Field(description="the expanded uncertainty of one deviation")
    decision_rule: str = Field(description="how the uncertainty counts, in words; simple acceptance where none was stated")


class BudgetLine(_Json):
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


class UncertaintyAt(_Json):
    """The expanded uncertainty at one place of the profile."""

    station_mm: float = Field(description="where, as arc length from the start of the nominal")
    expanded_mm: float = Field(description="U of a deviation there")


class Uncertainty(_Json):
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


class LargestGap(_Json):
    """The longest stretch of the profile without a judged point."""

    from_mm: float = Field(description="the station at which it begins")
    to_mm: float = Field(description="the station at which it ends; below from_mm where it crosses the seam of a closed profile")
    allowed_mm: float = Field(description="the longest gap that counts as measured")
    could_hide_mm: float = Field(description="how far the nominal stands off the straight line across it: so much could be missing unseen")


class VerdictReason(_Json):
    """One reason of the verdict."""

    kind: str = Field(description="what kind of reason it is, like missing or gap; these words never change")
    words: str = Field(description="the reason as a sentence")


class Region(_Json):
    """A stretch of the profile."""

    from_mm: float = Field(description="the station at which it begins")
    to_mm: float = Field(description="the station at which it ends; below from_mm where it crosses the seam of a closed profile")


class Placed(_Json):
    """A place in the nominal's coordinates, and what it is."""

    name: str = Field(description="what it is, like leading or centre")
    x_mm: float = Field(description="its x")
    y_mm: float = Field(description="its y")


class Witness(_Json):
    """A measured point that a proof needs."""

    index: int = Field(description="the number of the point in deviations.csv")
    x_mm: float = Field(description="its x in section coordinates")
    y_mm: float = Field(description="its y in section coordinates")


class Holding(Witness):
    """A measured point that holds a minimum zone."""

    deviation_mm: float | None = Field(description="its deviation from the middle of a minimum zone: half the zone, with sign")
    station_mm: float = Field(description="the arc length of its foot point")
    multiplier: float = Field(description="its share in the balance of gradients; they are positive and add up to 1")


class Certificate(_Json):
    """What proves a minimum zone, or a least consumption of a zone that varies, over every placement of the part."""

    kind: Literal["minimum-zone", "consumption"] = Field(description="what is proven")
    zone_mm: float | None = Field(description="the width of the minimum zone")
    middle_mm: float | None = Field(description="the deviation in its middle")
    consumption: float | None = Field(description="of a zone that varies: the largest share of it that the points consume")
    bound: float = Field(description="the proof is of this: half a zone in mm, or a share of the zone")
    gap_mm: float | None = Field(description="by how much that is less than half the minimum zone")
    tip_radius_mm: float | None = Field(description="the points are centres of a ball of this radius")
    pose: Pose = Field(description="where the part lies in it")
    active: list[Holding] = Field(description="the points that hold it: no small motion makes it smaller")
    imbalance: float | None = Field(description="what is left of the sum of the points' gradients, by multiplier and sign; 0 is a proof")
    proven: bool = Field(description="whether no rigid motion brings the witnesses within the bound")
    witnesses: list[Witness] = Field(description="the points that the proof over every placement needs")
    boxes: int = Field(description="the boxes of motions that the proof looked at")
    finest_mm: float | None = Field(description="the least by which one of them moves the point that refutes it")
    words: str = Field(description="all this in three lines")


class Characterised(_Json):
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
    places: list[Placed] = Field(description="the places that the value was found at, in the nominal's coordinates")
    notes: list[str] = Field(description="what the method had to assume")
    certificate: Certificate | None = Field(description="what proves a minimum zone; null for other fits")


class Inspected(_Json):
    """What was found. Without a result (nothing could be registered) the counts stand beside nulls, and the verdict is uncertain."""

    verdict: VerdictName = Field(description="the verdict on the profile; uncertain: neither conformity nor nonconformity is proven")
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
    best_fit_error_mm: float | None = Field(description="zone_error_mm at the best fit; null where nothing was fitted so")
    minimum_zone_mm: float | None = Field(description="zone_error_mm at the minimum zone; null where it was not needed")
    worst: Worst | None = Field(description="the point farthest from the middle of the zone")
    reasons: list[VerdictReason] = Field(description="why the verdict is what it is, the most important first; none for conform")
    rule: str | None = Field(description="what decided: minimum-zone, best-fit, or datum where the pose was known")
    target_mm: float | None = Field(description="the deviation that every fit aims at: the middle of the zone")
    weights: str | None = Field(description="how points counted in the best fit: arc-length or points")
    fit: str | None = Field(description="how the pose was found: best-fit, minimum-zone, or none")
    method: str | None = Field(description="how deviations were found, like exact")
    registration: Registered | None = Field(description="how the section lies on the nominal")
    stretches: list[OutStretch] = Field(description="the contiguous stretches out of tolerance, in the order of their stations")
    coverage: float = Field(description="the share of the nominal's length that was measured, from 0 to 1")
    largest_gap_mm: float | None = Field(description="the longest stretch of the profile without a judged point")
    largest_gap: LargestGap | None = Field(description="where that stretch is, and what it could hide")
    complete: bool = Field(description="whether the scan came to its end")
    tolerance: Zone | None = Field(description="the tolerance that was applied")
    characteristics: list[Characterised] = Field(description="every characteristic of the plan, in its order")
    uncertainty: Uncertainty | None = Field(
        default=None,
        description="how uncertain the deviations are; null where the plan states no budget",
    )
    rejected_by_reason: dict[str, int] = Field(description="the number of rejected points for each reason that occurred")
    damaged_bytes: int = Field(description="the bytes on the wire that were no valid frame")


class Measured(Inspected):
    """The result of a run that was not recorded (`--no-record`): also how the run ended, what was measured, by whom and with what."""

    measured_at: str = Field(description="when the run began, in UTC, like 2026-03-14T15:09:26.000Z")
    ending: Ending = Field(description="how the run ended; aborted by the operator (then the verdict is uncertain), or interrupted")
    part: str = Field(description="the name of the part")
    serial_number: str | None = Field(description="the serial number of the part")
    operator: str | None = Field(description="who measured")
    device: str = Field(description="the device or file that the points came from")
    simulated: bool = Field(description="whether the device was a simulated one: no real part was measured")
    notes: list[str] = Field(description="what was assumed about the nominal and the points: unit, columns, gaps, rows left out, density")


class Recorded(Measured):
    """The result of `inspect`, `run` and `demo`: also what ties it to its record."""

    run: str = Field(description="the id of the recorded run")
    chain_sha256: str = Field(description="the hash of the run's last record, which follows from every record before it")
    plan_sha256: str = Field(description="the hash of the effective plan")
    nominal_sha256: str = Field(description="the hash of the nominal's file")
    software: dict[str, str] = Field(description="the versions of everything that the result depends on")


class Change(_Json):
    """A value that is not as it was in the recorded run."""

    key: str = Field(description="the dotted key")
    recorded: Any = Field(description="its value in the recorded run")
    replayed: Any = Field(description="its value in the replay")


class Replayed(Inspected):
    """The result of `replay`: also how it compares with the recorded one."""

    measured_at: str = Field(description="when the recorded run began, in UTC")
    ending: Ending = Field(description="how the recorded run ended")
    replay_of: str = Field(description="the id of the recorded run")
    chain_sha256: str = Field(description="the hash of the run's last record")
    identical: bool | None = Field(description="whether the result is the recorded one to the last bit; null where none was recorded")
    changed: list[Change] = Field(description="the settings and software that are not those of the recorded run")
    differs: list[Change] = Field(description="what of the result is not as recorded")
    notes: list[str] = Field(description="what was assumed about the nominal and the points when they were recorded, and their density")


class SectionInspected(Inspected):
    """One section of a surface: also where it was cut and what was found there."""

    height_mm: float = Field(description="the height at which the section was cut, along the normal")
    asked_height_mm: float = Field(description="the height that was asked for; the cut is moved a little where facets lie in its plane")
    contours: int = Field(description="the number of contours in the section")
    holes: int = Field(description="the number of contours that are holes")
    open_contours: int = Field(description="the number of contours that do not close")
    set_aside: int = Field(description="the number of pieces that were too short to be judged")
    set_aside_longest_mm: float | None = Field(description="the length of the longest of them")
    cutter: str = Field(description="what cut the surface: open3d or numpy")
    nominal: str = Field(description="the file of the nominal of this section")
    ending: Ending = Field(description="how the inspection of this section ended")
    warnings: list[str] = Field(description="what was not as it should be in this section")
    run: str | None = Field(description="the id of the recorded run that this section is; null where nothing was recorded")
    chain_sha256: str | None = Field(description="the hash of that run's last record")


class ShareOfSection(_Json):
    """What one section has of a characteristic of its stack."""

    height_mm: float = Field(description="the height of the section")
    value: float | None = Field(description="its value; null: it has none")
    deviation: float | None = Field(description="value - nominal")
    verdict: VerdictName = Field(description="the verdict on this value")


class StackCharacterised(Characterised):
    """A characteristic of a stack: what is said of one of a section, and where in the stack it holds."""

    height_mm: float | None = Field(
        description="the height of the section whose value stands here, the worst; null: the stack has one value"
    )
    sections: list[ShareOfSection] = Field(description="the sections in rising order, where each has a value of its own")


class StackInspected(_Json):
    """The result of `ct`: the surface, and its sections."""

    verdict: VerdictName = Field(
        description="the verdict of the worst section or characteristic of the stack; at best uncertain where sections are missing"
    )
    complete: bool = Field(description="whether every section that was asked for was inspected to its end")
    ending: Ending = Field(description="how the inspection ended: aborted where sections are missing")
    measured_at: str = Field(description="when the inspection began, in UTC")
    mesh: str = Field(description="the file of the surface")
    mesh_kind: str = Field(description="the format of that file, like binary STL")
    triangles: int = Field(description="the number of triangles of the surface")
    received: int = Field(description="the sum over the sections")
    judged: int = Field(description="the sum over the sections")
    rejected: int = Field(description="the sum over the sections")
    lost: int = Field(description="the sum over the sections")
    out_of_tolerance: int = Field(description="the sum over the sections")
    slices: list[SectionInspected] = Field(description="the sections in the order of the plan")
    characteristics: list[StackCharacterised] = Field(description="every characteristic of the stack, in the order of the plan")
    notes: list[str] = Field(description="what holds for all sections")


class NominalPlane(_Json):
    """The plane in space that the curve of a drawing lies in, spelt as a plan spells a section."""

    origin_mm: list[float] = Field(description="a point of the plane, the origin of the curve's coordinates")
    normal: list[float] = Field(description="the direction of its normal, of length 1")
    x_axis: list[float] = Field(description="the direction of the curve's x axis, of length 1")


class Understood(_Json):
    """The answer of `nominal`: what was understood of a file."""

    degree: int = Field(description="the degree of the curve")
    knots: list[float] = Field(description="its knots: as many as control points, plus degree, plus 1")
    control_points_mm: list[list[float]] = Field(description="its control points [x, y]")
    weights: list[float] = Field(description="the weights of the control points")
    closed: bool = Field(description="whether the profile is closed")
    length_mm: float = Field(description="its length")
    source_format: str = Field(description="the format that the file was read as")
    corners: int = Field(description="the number of its corners")
    material: Literal["left", "right"] | None = Field(description="the side of the material, where the curve shows it")
    layers: list[str] = Field(description="the layers of a drawing that it is drawn on")
    plane: NominalPlane | None = Field(description="the plane of a curve that a drawing has in space; null: it is drawn in x and y")
    notes: list[str] = Field(description="what was assumed or mended in reading the file")


class StackPlace(_Json):
    """Of a run that is a section of a surface: its place in its stack, and what the stack rests on."""

    stack: str = Field(description="the name of the stack, the same for all its sections")
    section: int = Field(description="the number of the section, from 1, in the order of the plan")
    sections: int = Field(description="how many sections the plan asked for")
    height_mm: float = Field(description="the height at which it was cut")
    asked_height_mm: float = Field(description="the height that was asked for")
    surface: str = Field(description="the name of the surface file")
    surface_sha256: str = Field(description="the hash of the surface file")
    triangles: int = Field(description="the number of triangles of the surface")
    cutter: str = Field(description="what cut it: open3d or numpy")
    doubt: str | None = Field(description="why it is not known which contour of the section is the part; null where it is")


class StackRecorded(StackPlace):
    """The same with the plan of the stack."""

    plan: str = Field(description="the plan of the whole stack as YAML, every default filled in")


class RunLine(_Json):
    """One run in the list of runs."""

    run: str = Field(description="the id of the run")
    started: str | None = Field(description="date and time in UTC, with a Z; of records of earlier versions with the offset from UTC")
    part: str | None = Field(description="the name of the part")
    serial_number: str | None = Field(description="the serial number of the part, empty where none was given")
    state: State = Field(description="how the run ended; running: it is being recorded just now; damaged: its records were altered")
    received: int | None = Field(description="the points received; null while the run goes on")
    verdict: VerdictName | None = Field(description="the verdict; null where there is none")
    stack: StackPlace | None = Field(default=None, description="only of sections of a surface: the place in the stack")


class Runs(_Json):
    """The answer of `runs`."""

    runs: list[RunLine] = Field(description="every recorded run, oldest first")


class Kept(_Json):
    """How much was recorded of a run."""

    wire_bytes: int = Field(description="the bytes from the wire")
    reads: int = Field(description="the reads in which they arrived")
    points: int = Field(description="the points")
    events: dict[str, int] = Field(description="the other arrivals by their kind")
    records: int = Field(description="the records in the chain")


class RecordedEvent(_Json):
    """Something that happened on the link; further keys say what, like `reason`, `count`, `expected` or `gap_s`."""

    model_config = ConfigDict(extra="allow")

    event: str = Field(description="its kind, like ScanOpened, Lost or LinkDown")
    time_s: float = Field(description="when, by the clock of the run")
    after_points: int = Field(description="the number of points that had arrived before it")


class RecordedPose(_Json):
    """Where the registration stood at one moment of the run."""

    time_s: float = Field(description="when, by the clock of the run")
    points: int = Field(description="the number of points that had been taken in")
    state: str = Field(description="seeking, provisional or settled")
    rotation_rad: float = Field(description="the rotation about the section's origin, counterclockwise")
    translation_mm: list[float] = Field(description="the translation after the rotation, [x, y]")
    rms_mm: float | None = Field(description="the root mean square of the deviations at this pose")
    can_move_mm: float | None = Field(
        description="by how much a deviation can still move at most: 0 at a pose known beforehand, else null, since no bound is known"
    )
    iterations: int = Field(description="the steps that the fit took")
    converged: bool = Field(description="whether the fit settled")


class Shown(_Json):
    """The answer of `show`, and `run.json` of `export`: all that is known of a run but its points."""

    run: str = Field(description="the id of the run")
    started: str = Field(description="date and time in UTC, with a Z; of records of earlier versions with the offset from UTC")
    clock_s: float = Field(description="the reading of the run's clock at its start")
    part: str = Field(description="the name of the part")
    serial_number: str = Field(description="the serial number of the part, empty where none was given")
    operator: str = Field(description="who measured, empty where nobody was named")
    device: str = Field(description="the device that the points came from")
    simulated: bool = Field(description="whether the device was a simulated one")
    notes: list[str] = Field(
        default=[], description="what was assumed about the nominal and the points; records of earlier versions have none"
    )
    software: dict[str, str] = Field(description="the versions of everything that the result depends on")
    plan_sha256: str = Field(description="the hash of the effective plan")
    nominal: str = Field(description="the name of the nominal's file")
    nominal_sha256: str = Field(description="the hash of the nominal's file")
    state: State = Field(description="how the run ended")
    ended: str | None = Field(description="date and time of the end; null while the run goes on")
    message: str | None = Field(description="what ended the run early, empty where nothing did")
    received: int | None = Field(description="the points received; null while the run goes on")
    verdict: VerdictName | None = Field(description="the verdict; null where there is none")
    coverage: float | None = Field(description="the share of the profile that was measured; null where no part was found")
    result: Inspected | None = Field(description="the recorded result; null where the run gave none")
    chain_sha256: str = Field(description="the hash of the run's last record; empty while the run goes on")
    recorded: Kept = Field(description="how much was recorded")
    events: list[RecordedEvent] = Field(description="what happened on the link; damaged frames and heartbeats are counted only")
    registrations: list[RecordedPose] = Field(description="the history of the registration")
    stack: StackRecorded | None = Field(default=None, description="only of sections of a surface: the place in the stack")
    plan: str = Field(description="the effective plan as YAML, every default filled in")


class Exported(_Json):
    """The answer of `export`."""

    run: str = Field(description="the id of the run")
    files: list[str] = Field(
        description="the files that were written; result.json of a run that did not come to its end has the key `ending` as well"
    )


class Reported(_Json):
    """The answer of `report`."""

    run: str = Field(description="the id of the run")
    file: str = Field(description="the PDF file that was written")


class ComparedScan(_Json):
    """One of two scans that were compared."""

    kind: Literal["run", "file"] = Field(description="a recorded run, or a file of points that was judged for the comparison")
    name: str = Field(description="the id of the run, or the name of the file without its suffix")
    part: str | None = Field(description="the name of the part; of a file that of the file")
    serial_number: str | None = Field(description="the serial number of the part")
    measured_at: str | None = Field(description="when it was measured, in UTC; null for a file")
    verdict: VerdictName | None = Field(description="the recorded verdict; null for a file")
    judged: int = Field(description="the points judged")
    fit: str = Field(description="how it came onto the nominal")
    rule: str = Field(description="what decided its verdict; of a file best-fit")
    target_mm: float = Field(description="the deviation that the fit aims at: the middle of the zone")
    method: str = Field(description="how its deviations were found")
    coverage: float = Field(description="the share of the profile that it measured")
    max_deviation_mm: float | None = Field(description="its largest deviation")
    min_deviation_mm: float | None = Field(description="its smallest deviation")
    rms_mm: float | None = Field(description="the root mean square of its deviations, a point as much as any other")
    rotation_deg: float = Field(description="the rotation of its pose about the section's origin, counterclockwise")
    translation_mm: list[float] = Field(description="the translation of its pose after the rotation, [x, y]")


class ComparedPlace(_Json):
    """A place of the profile, and what both scans have there."""

    station_mm: float = Field(description="its station")
    x_mm: float = Field(description="x of the nominal there")
    y_mm: float = Field(description="y of the nominal there")
    first_mm: float = Field(description="the deviation of the first scan")
    second_mm: float = Field(description="the deviation of the second scan")
    difference_mm: float = Field(description="the second less the first")


class ComparedStretch(_Json):
    """One of twelve equal stretches of the profile."""

    from_mm: float = Field(description="the station that it begins at")
    to_mm: float = Field(description="the station that it ends at")
    largest: ComparedPlace | None = Field(description="where the two differ most; null where nothing was measured by both")


class Compared(_Json):
    """The answer of `compare`. Differences are the second scan less the first."""

    first: ComparedScan = Field(description="the scan that the other one is held against")
    second: ComparedScan = Field(description="the other scan")
    nominal: str = Field(description="the name of the nominal's file")
    length_mm: float = Field(description="the length of the nominal")
    compared: float = Field(description="the share of that length that both measured")
    largest: ComparedPlace = Field(description="where the two differ most, whatever the sign")
    mean_mm: float = Field(description="the mean difference along the profile, whatever the density of points")
    rms_mm: float = Field(description="the root mean square of the difference, likewise")
    stretches: list[ComparedStretch] = Field(description="the largest difference in each of twelve stretches")
    notes: list[str] = Field(description="how the poses were found, and what else a reader has to know")
    file: str | None = Field(description="the drawing that was written; null where none was asked for")


class Alteration(_Json):
    """The first record that is not as it was written."""

    number: int = Field(description="its number in the chain")
    run: str = Field(description="the run that it belongs to, empty where that is not known")
    kind: str = Field(description="what it holds, like points or result")
    problem: str = Field(description="what is wrong with it")
    message: str = Field(description="all of this in one sentence")


class Against(_Json):
    """What came of holding a result file against the records."""

    run: str = Field(description="the run that the result file names")
    disagreements: list[str] = Field(description="what the two say differently, in words; empty where they agree")


class Verified(_Json):
    """The answer of `verify`."""

    altered: bool = Field(description="whether anything was altered")
    run: str | None = Field(description="the run that was asked for; null: all records")
    records: int = Field(description="the number of sound records")
    chain_sha256: str = Field(description="the hash of the last sound record")
    first: Alteration | None = Field(description="the first record that was altered")
    against: Against | None = Field(default=None, description="with `--against`: whether the result file and the records agree")


class ZoneVerified(_Json):
    """The check of one minimum zone."""

    name: str = Field(description="the name of the characteristic")
    verified: bool = Field(description="whether everything that was stated is so")
    problem: str = Field(description="what is not, empty where all is")
    boxes: int = Field(description="the boxes of motions that the check looked at")


class ZonesVerified(_Json):
    """The answer of `verify-zone`."""

    verified: bool = Field(description="whether all zones of the file were verified")
    zones: list[ZoneVerified] = Field(description="every zone of the file")
