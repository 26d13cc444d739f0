"""The messages between the station and its pages.

What the station says is JSON text, told apart by `type`, and two binary messages with what is drawn. What a page says is JSON
text, told apart by `do`; each gets one `Answer` with the same `number`. The first message of a page is its token alone, or the
code of a one-time address, which is answered with the token (`Admitted`).
`Hello` opens every connection: with it everything that the station said before is void, and the station says all of it again.

`declarations.py` writes this file's types and constants for the page's scripts.
"""

import json
from dataclasses import dataclass, fields
from typing import Any, Literal

from cmmlink.characteristic_rows import CharacteristicRow
from cmmlink.console.form_answers import PlanSaved, Understood
from cmmlink.console.register_words import KeepMap, LookAtRegisters, MapSaved, RegisterTable
from cmmlink.console.trend_words import TrendChoices, TrendShown
from cmmlink.run_state import RunState
from cmmlink.words import VERDICT_NAMES, VERDICT_WORDS, Shape, VerdictName

WRONG_TOKEN = 4401  # the station closes a page's socket with this code when its token is wrong, or its address was used or is too old
TOO_MANY_PAGES = 1013
LARGEST_NOMINAL = 32 << 20  # bytes of a file that a page may hand in

# A binary message begins with these fields, little-endian; then come columns, one after the other, `rows` values each.
# points : bin u32; of the lowest, then of the highest point in the bin the seven columns of `cmmlink.extremes`, f32. The time is
#          when the newest verdict was given, ms since 1970, 0 for none; the number is how many bins there are. Another generation
#          than before says that all points sent before are void.
# nominal: station, x, y, outward normal x, y, f32; NaN in every column between two pieces. The number is the length in mm.
# Of a whole surface rows come one after the other, and a row is x, y, z, deviation, f32, and the outward normal, i8 of 127, in 4 bytes.
# surface points : before each row the number of its voxel, u32, whose worst point it is. The number is the size of a voxel in mm.
# nominal surface: places of it, whose deviation is 0. The number is about how far they are apart in mm. Voids all points.
HEADER = (("kind", "<u4"), ("generation", "<u4"), ("rows", "<u4"), ("flags", "<u4"), ("time_ms", "<f8"), ("number", "<f8"))
HEADER_BYTES = 32
POINTS, NOMINAL, SURFACE_POINTS, NOMINAL_SURFACE = 1, 2, 3, 4  # kinds
CLOSED = 1  # flag of a nominal

Severity = Literal["fault", "warning"]

WORDS_OF_VERDICTS = {VERDICT_NAMES[verdict]: VERDICT_WORDS[verdict] for verdict in VERDICT_WORDS}


@dataclass(frozen=True, slots=True)
class Admitted:
    """The answer to a one-time address: the token, which the page keeps for as long as its tab is open."""

    token: str
    type: Literal["admitted"] = "admitted"


@dataclass(frozen=True, slots=True)
class Hello:
    """The first message: which version serves, which of its pages this is, and whether the network can reach it."""

    version: str
    page: int
    remote: bool
    type: Literal["hello"] = "hello"


@dataclass(frozen=True, slots=True)
class Alive:
    """A sign of life twice a second, with the station's time of day, ms since 1970."""

    now_ms: float
    type: Literal["alive"] = "alive"


@dataclass(frozen=True, slots=True)
class Answer:
    """What came of a command: its number, and words for the operator."""

    number: int | None
    do: str
    ok: bool
    message: str
    type: Literal["answer"] = "answer"


@dataclass(frozen=True, slots=True)
class Control:
    """Whether this page controls the station, whether any page does, and how many pages are open."""

    controls: bool
    taken: bool
    pages: int
    type: Literal["control"] = "control"


@dataclass(frozen=True, slots=True)
class ChosenPlan:
    """The plan chosen. `problem` is empty when it can be run, `line` the line it points at; `facts` are label and value."""

    name: str
    text: str
    problem: str
    line: int | None
    part: str
    facts: tuple[tuple[str, str], ...]
    has_address: bool


@dataclass(frozen=True, slots=True)
class DeviceTest:
    """The last test of the device."""

    state: Literal["none", "testing", "passed", "failed", "aborted"]
    message: str


@dataclass(frozen=True, slots=True)
class StationState:
    """What the operator has chosen and entered, and what may be done next. `question` waits for `start again`; empty: none."""

    plans: tuple[str, ...]
    ct_plans: tuple[str, ...]
    choice: ChosenPlan | None
    serial_number: str
    operator: str
    address: str
    test: DeviceTest
    question: str
    running: bool
    can_start: bool
    keeps_records: bool
    can_make_plans: bool
    can_run_demo: bool
    has_trends: bool
    type: Literal["station"] = "station"


@dataclass(frozen=True, slots=True)
class ResultsState:
    """Where the results of runs are pushed to, and how many runs wait since when, and why; empty address: nowhere.

    added : how many were pushed since the console was started
    """

    address: str
    waiting: int
    since: str
    problem: str
    added: int
    type: Literal["results"] = "results"


@dataclass(frozen=True, slots=True)
class AlarmRow:
    """One thing that went wrong: how often, since when, whether it still is so, whether somebody has seen it.

    since : date and time of day at this place
    run   : the serial number, or the part, of the run it belongs to; empty before the first
    current : it belongs to the run that is on, or was the last; an earlier one says nothing about the part in front
    """

    number: int
    severity: Severity
    what: str
    detail: str
    count: int
    since: str
    run: str
    current: bool
    active: bool
    acknowledged: bool


@dataclass(frozen=True, slots=True)
class AlarmList:
    """The newest alarms, newest first, and whether a fault of the current run is there that is active or unseen."""

    fault: bool
    alarms: tuple[AlarmRow, ...]
    type: Literal["alarms"] = "alarms"


@dataclass(frozen=True, slots=True)
class ShownRun:
    """The run the page looks at, null before the first; `recorded` when the page opened a run, or a section, itself."""

    run: RunState | None
    recorded: bool
    type: Literal["run"] = "run"


@dataclass(frozen=True, slots=True)
class CharacteristicList:
    """The characteristics of the run that the page looks at, and U along its profile: pairs of station and U, mm.

    more  : how many there are besides; a page is told of a hundred at most, those with the worst verdicts
    final : they have their verdicts; before that every value is one so far
    """

    rows: tuple[CharacteristicRow, ...]
    more: int
    uncertainty: tuple[tuple[float, float], ...]
    final: bool
    type: Literal["characteristics"] = "characteristics"


@dataclass(frozen=True, slots=True)
class RunRow:
    """One line of the station's history. `worst_mm` is the deviation farthest from the middle of the zone.

    judged      : every judgement of it that was made later, in words, oldest first
    section     : which section of a surface it is, in words; empty for a run of a device
    word, shape : the verdict, or how early the run ended, and its sign; `counted`: the scan came to its end with a verdict
    of          : of several characteristics, which gave a verdict that is not conform, by name; else empty
    """

    run: str
    began: str
    part: str
    serial_number: str
    operator: str
    plan: str
    section: str
    simulated: bool
    state: str
    received: int
    verdict: VerdictName | None
    word: str
    shape: Shape
    counted: bool
    of: str
    worst_mm: float | None
    worst_station_mm: float | None
    worst_x_mm: float | None
    worst_y_mm: float | None
    lower_mm: float | None
    upper_mm: float | None
    judged: tuple[str, ...] = ()
    worst_z_mm: float | None = None


@dataclass(frozen=True, slots=True)
class History:
    """The newest runs on record, newest first."""

    runs: tuple[RunRow, ...]
    type: Literal["history"] = "history"


@dataclass(frozen=True, slots=True)
class FoundRuns:
    """The newest of the runs that the page looks for, newest first, and how many there are; null where it looks for none."""

    runs: tuple[RunRow, ...] | None
    total: int
    type: Literal["found"] = "found"


@dataclass(frozen=True, slots=True)
class SectionRow:
    """One judged section of a CT surface."""

    height_mm: float
    verdict: VerdictName
    received: int
    coverage: float
    worst_mm: float | None
    worst_station_mm: float | None
    lower_mm: float
    upper_mm: float
    warnings: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class SurfaceState:
    """The CT surface that is inspected, or was inspected last.

    `word` and `shape` are those of its worst section, or say how early it ended;
    `message` says what came of it, `notes` what was assumed about the surface and its nominals.
    """

    plan: str
    word: str
    shape: Shape
    state: Literal["none", "reading", "inspecting", "done", "failed"]
    message: str
    notes: tuple[str, ...]
    done: int
    total: int
    remaining_s: float | None
    sections: tuple[SectionRow, ...]
    type: Literal["ct"] = "ct"


@dataclass(frozen=True, slots=True)
class Device:
    """A device that can be seen now. The answer to `devices` is a JSON list of them."""

    address: str
    description: str


@dataclass(frozen=True, slots=True)
class Choose:
    """Choose a plan and have it checked."""

    plan: str
    do: Literal["choose"] = "choose"


@dataclass(frozen=True, slots=True)
class Enter:
    """Enter what belongs to the next part; null leaves a value as it is."""

    serial_number: str | None = None
    operator: str | None = None
    address: str | None = None
    do: Literal["enter"] = "enter"


@dataclass(frozen=True, slots=True)
class Acknowledge:
    """Mark one alarm as seen, or all."""

    alarm: int | None = None
    do: Literal["acknowledge"] = "acknowledge"


@dataclass(frozen=True, slots=True)
class OfRun:
    """Look at a recorded run, or measure it again."""

    run: str
    do: Literal["open", "replay"]


@dataclass(frozen=True, slots=True)
class Search:
    """Look for runs; what is empty asks for nothing. Days are written 2026-03-31; the verdict is a name of one, or none."""

    part: str
    serial_number: str
    operator: str
    plan: str
    verdict: str
    since: str
    until: str
    do: Literal["search"] = "search"


@dataclass(frozen=True, slots=True)
class OpenSection:
    """Look at one section of the CT surface."""

    section: int
    do: Literal["section"] = "section"


@dataclass(frozen=True, slots=True)
class ImportSurface:
    """Inspect the CT surface of a plan."""

    plan: str
    do: Literal["import"] = "import"


@dataclass(frozen=True, slots=True)
class Plain:
    """A command that needs no more words. The answer to `another page` is the code of a one-time address."""

    do: Literal["start", "start again", "end", "abort", "test", "demo", "take control", "live", "devices", "another page"]


Message = (
    Admitted
    | Hello
    | Alive
    | Answer
    | Control
    | StationState
    | ResultsState
    | AlarmList
    | ShownRun
    | CharacteristicList
    | History
    | FoundRuns
    | SurfaceState
    | RegisterTable
)
Command = Choose | Enter | Acknowledge | OfRun | Search | OpenSection | ImportSurface | LookAtRegisters | KeepMap | Plain


def json_of(message: Message | Understood | PlanSaved | MapSaved | TrendChoices | TrendShown) -> str:
    """The message as it is sent."""
    return json.dumps(message, default=_values_by_name, separators=(",", ":"))


def _values_by_name(record: Any) -> dict[str, Any]:
    return {field.name: getattr(record, field.name) for field in fields(record)}
