"""Everything that is shown of one run, as it was at one moment: immutable, and ready for the page and the terminal."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from cmmlink.events import Ending
from cmmlink.words import Shape, VerdictName

Phase = Literal["preparing", "starting", "measuring", "ending", "finished"]
RunKind = Literal["run", "replay", "recorded", "section"]
LinkPhase = Literal["connecting", "up", "down", "closed"]


@dataclass(frozen=True, slots=True)
class RegistrationState:
    """How far the registration is, how far values can still move (mm; null: no bound is known), and how many other poses fit."""

    state: Literal["seeking", "provisional", "settled"]
    can_move_mm: float | None
    other_poses: int


@dataclass(frozen=True, slots=True)
class WorstPoint:
    """The point farthest from the middle of the zone; its place in the coordinates of the nominal. Of a surface the station is 0."""

    station_mm: float
    deviation_mm: float
    x_mm: float
    y_mm: float
    verdict: VerdictName
    z_mm: float | None = None


@dataclass(frozen=True, slots=True)
class VerdictState:
    """The verdict, or how the run ended, in words; its sign; whether it is final; why it is so, and every further reason.

    of : which of several characteristics gave the part its verdict
    """

    word: str
    shape: Shape
    final: bool
    why: str
    of: str = ""
    reasons: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class ZoneLimits:
    """The tolerance zone and the expanded uncertainty of one deviation, mm; how that uncertainty counts, in words."""

    lower_mm: float
    upper_mm: float
    uncertainty_mm: float
    decision_rule: str


@dataclass(frozen=True, slots=True)
class SurfaceRegion:
    """A region of a surface that is out of tolerance: its number, from 1, its worst deviation and where on the nominal that is."""

    number: int
    worst_mm: float
    area_mm2: float
    points: int
    x_mm: float
    y_mm: float
    z_mm: float


@dataclass(frozen=True, slots=True)
class WholeSurface:
    """What is known of a whole surface beside its points: nothing before its end.

    gap_max_mm : the diameter of the widest place without a point that counts as measured
    regions    : those out of tolerance, the worst first; `more` there are besides
    unmeasured : how many places were not measured, and their area together
    """

    gap_max_mm: float
    regions: tuple[SurfaceRegion, ...] = ()
    more: int = 0
    unmeasured: int = 0
    unmeasured_mm2: float = 0.0


@dataclass(frozen=True, slots=True)
class AnswerState:
    """Whether the machine that waits for the verdict was told it: when, ms since 1970, to which of its requests, and why not.

    told : the verdict in words that it was told; empty where it was told nothing
    """

    state: Literal["awaited", "sent", "not sent"]
    at_ms: float | None = None
    request: int | None = None
    problem: str = ""
    told: str = ""


@dataclass(frozen=True, slots=True)
class RunState:
    """Everything that is shown of a run in numbers and words, as it was at one moment.

    run           : its id in the records; empty where it is not kept there, or is not over
    kind          : a run that is measured, or what poses as none: a replay, a run from the records, a section of a surface
    notes         : what was assumed about the nominal and the points
    began         : when the points were measured: date, time of day and offset from UTC
    ending        : null while the run is on; message says why a run has no result, or what failed
    link_detail   : why the link was lost, or how long it was away; empty while it never was
    streaming     : whether the device shows itself alive now
    expected      : number of points the device announced
    latency_s     : how long the newest judged point waited for its verdict
    verdict_at_ms : when the newest verdict was given, ms since 1970
    answer        : null where no machine waits for the verdict
    surface       : of a run of a whole surface, which has no stations; null of a section
    """

    number: str
    run: str
    kind: RunKind
    plan: str
    part: str
    serial_number: str
    operator: str
    device: str
    address: str
    simulated: bool
    notes: tuple[str, ...]
    began: str
    phase: Phase
    ending: Ending | Literal["failed", "running"] | None
    message: str
    remark: str
    link: LinkPhase
    link_detail: str
    streaming: bool
    received: int
    judged: int
    rejected: int
    pending: int
    lost: int
    damaged_bytes: int
    rejected_by_reason: Mapping[str, int]
    expected: int | None
    rate_per_s: float
    buffered: int
    buffer_peak: int
    buffer_capacity: int
    stalls: int
    latency_s: float | None
    verdict_at_ms: float | None
    registration: RegistrationState
    coverage: float
    coverage_min: float
    out_of_tolerance: int
    worst: WorstPoint | None
    verdict: VerdictState
    answer: AnswerState | None
    length_mm: float
    zone: ZoneLimits
    surface: WholeSurface | None
