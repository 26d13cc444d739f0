"""The keys of every JSON object that a command prints or writes: their types and what they mean.

The objects are made elsewhere (cmmlink.result_json, cmmlink.stack, cmmlink.record); the tests validate what every command prints
against these models, which know no key that is not there. docs/results.md is written from them.
"""

from typing import Any, Literal

from pydantic import ConfigDict, Field

from cmmlink.events import Ending
from cmmlink.inspection_keys import (
    Characterised,
    JsonObject,
    LargestGap,
    OutStretch,
    QualificationNamed,
    Registered,
    Uncertainty,
    VerdictReason,
    Worst,
    Zone,
)
from cmmlink.record_keys import AnchorTold, AnswerKept, JudgedAgain, RunOrigin, RunSigned
from cmmlink.run_keys import SCHEMA, OfRecord, OfReplay, OfRun
from cmmlink.version import ResultSchema
from cmmlink.words import VerdictName

State = Literal["complete", "interrupted", "aborted", "running", "damaged"]


class Inspected(JsonObject):
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


class Measured(OfRun, Inspected):
    """The result of a run that was not recorded (`--no-record`): also how the run ended, what was measured, by whom and with what."""


class Recorded(OfRecord, Measured):
    """The result of `inspect`, `run` and `demo`: also what ties it to its record."""


class Failure(JsonObject):
    """Why there is no result."""

    kind: str = Field(description="the kind of failure: unusable, not-measured, device-failed, no-record, usage, system, stopped or defect")
    message: str = Field(description="what, where, and what to do")
    exit_status: int = Field(description="the exit status")


class FileInspected(JsonObject):
    """What came of one of several files."""

    file: str = Field(description="the file, as it was named")
    exit_status: int = Field(description="the exit status that it would have by itself")
    result: dict[str, Any] | None = Field(description="its result, with the keys of `inspect` above; null where there is none")
    error: Failure | None = Field(description="why there is no result; null where there is one")


class FilesInspected(JsonObject):
    """What `inspect` prints of several files."""

    exit_status: int = Field(description="the worst of the exit statuses: 5, then 1, 4, 2, 3 and 0")
    files: list[FileInspected] = Field(description="the files, in the order in which they were named")


class Replayed(OfReplay, Inspected):
    """The result of `replay`: also how it compares with the recorded one."""


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
    chain_sha256: str | None = Field(description="the hash of that run's end")
    signature: RunSigned | None = Field(description="the signature of that run; null where it is not signed")


class ShareOfSection(JsonObject):
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


class StackInspected(JsonObject):
    """The result of `ct`: the surface, and its sections."""

    schema_urn: ResultSchema = Field(alias="schema", description=SCHEMA)
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
    qualification: QualificationNamed | None = Field(description="the last qualification of the installation; null where none was made")
    notes: list[str] = Field(description="what holds for all sections")
    anchors: list[AnchorTold] = Field(description="the places of the plan's `records.anchor`, and whether each was told of the sections")


class NominalPlane(JsonObject):
    """The plane in space that the curve of a drawing lies in, spelt as a plan spells a section."""

    origin_mm: list[float] = Field(description="a point of the plane, the origin of the curve's coordinates")
    normal: list[float] = Field(description="the direction of its normal, of length 1")
    x_axis: list[float] = Field(description="the direction of the curve's x axis, of length 1")


class Understood(JsonObject):
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


class StackPlace(JsonObject):
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


class RunLine(JsonObject):
    """One run in the list of runs."""

    run: str = Field(description="the id of the run")
    started: str | None = Field(description="date and time in UTC, with a Z; of records of earlier versions with the offset from UTC")
    part: str | None = Field(description="the name of the part")
    serial_number: str | None = Field(description="the serial number of the part, empty where none was given")
    operator: str | None = Field(description="who measured, empty where nobody said so")
    plan_file: str | None = Field(
        description="the name of the plan's file, empty where there was none; null in records of earlier versions"
    )
    state: State = Field(description="how the run ended; running: it is being recorded just now; damaged: its records were altered")
    received: int | None = Field(description="the points received; null while the run goes on")
    verdict: VerdictName | None = Field(description="the verdict; null where there is none")
    stack: StackPlace | None = Field(default=None, description="only of sections of a surface: the place in the stack")
    decided_by: str = Field(default="", description="only where some of several characteristics do not conform: what gave the verdict")


class Runs(JsonObject):
    """The answer of `runs`."""

    runs: list[RunLine] = Field(description="every recorded run, oldest first")


class Kept(JsonObject):
    """How much was recorded of a run."""

    wire_bytes: int = Field(description="the bytes from the wire")
    reads: int = Field(description="the reads in which they arrived")
    points: int = Field(description="the points")
    events: dict[str, int] = Field(description="the other arrivals by their kind")
    records: int = Field(description="the records in the chain")


class RecordedEvent(JsonObject):
    """Something that happened on the link; further keys say what, like `reason`, `count`, `expected` or `gap_s`."""

    model_config = ConfigDict(extra="allow")

    event: str = Field(description="its kind, like ScanOpened, Lost or LinkDown")
    time_s: float = Field(description="when, by the clock of the run")
    after_points: int = Field(description="the number of points that had arrived before it")


class RecordedPose(JsonObject):
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


class Shown(JsonObject):
    """The answer of `show`, and `run.json` of `export`: all that is known of a run but its points."""

    run: str = Field(description="the id of the run")
    started: str = Field(description="date and time in UTC, with a Z; of records of earlier versions with the offset from UTC")
    clock_s: float = Field(description="the reading of the run's clock at its start")
    part: str = Field(description="the name of the part")
    serial_number: str = Field(description="the serial number of the part, empty where none was given")
    operator: str = Field(description="who measured, empty where nobody was named")
    plan_file: str | None = Field(default=None, description="the name of the plan's file; records of earlier versions have none")
    station: str | None = Field(default=None, description="the name of the station; records of earlier versions have none")
    device: str = Field(description="the device that the points came from")
    simulated: bool = Field(description="whether the device was a simulated one")
    qualification: QualificationNamed | None = Field(
        default=None, description="the last qualification of the installation; null where none was made, and in records of earlier versions"
    )
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
    chain_sha256: str = Field(description="the hash of the run's end; empty while the run goes on")
    signature: RunSigned | None = Field(description="the signature of the run; null where it is not signed")
    answer: AnswerKept | None = Field(
        default=None,
        description="what came of the answer to the machine; null where the plan asks for none, where the program was killed before "
        "it was on record, and in records of earlier versions: nothing is claimed then",
    )
    anchors: list[AnchorTold] = Field(description="the places that were to be told how the run ended")
    origin: RunOrigin | None = Field(default=None, description="where the run was taken over from; null: it was recorded here")
    derived: list[JudgedAgain] = Field(default=[], description="what it was found to be when it was judged again, oldest first")
    recorded: Kept = Field(description="how much was recorded")
    events: list[RecordedEvent] = Field(description="what happened on the link; damaged frames and heartbeats are counted only")
    registrations: list[RecordedPose] = Field(description="the history of the registration")
    stack: StackRecorded | None = Field(default=None, description="only of sections of a surface: the place in the stack")
    plan: str = Field(description="the effective plan as YAML, every default filled in")


class Exported(JsonObject):
    """The answer of `export`."""

    run: str = Field(description="the id of the run, of several the first")
    runs: list[str] = Field(description="the ids of all runs that were exported")
    files: list[str] = Field(
        description="the files that were written; result.json of a run that did not come to its end has the key `ending` as well"
    )


class Reported(JsonObject):
    """The answer of `report`."""

    run: str = Field(description="the id of the run, or that of the stack")
    file: str = Field(description="the PDF file that was written")
    trends: list[str] = Field(description="the characteristics that have a page with their trend, as --trend asks for it")


class ZoneVerified(JsonObject):
    """The check of one minimum zone, or of one least consumption."""

    name: str = Field(description="the name of the characteristic")
    verified: bool = Field(description="whether everything that was stated is so")
    problem: str = Field(description="what is not, empty where all is")
    boxes: int = Field(description="the boxes of motions that the check looked at")


class ZonesVerified(JsonObject):
    """The answer of `verify-zone`."""

    verified: bool = Field(description="whether all zones of the file were verified")
    zones: list[ZoneVerified] = Field(description="every zone of the file")
