"""What a run says while it goes on: immutable events, in the order in which things happened.

`RunStarted` comes first and `RunFinished` last; between them every arrival from the source, and after points their verdicts.
Once it is proven in mid-scan that the part will fail, `ProvenOut` says so; a run that somebody looks at tells its characteristics so
far by `Evaluated`. When these come depends on how busy the machine is.
Where a machine tool waits for the verdict, `Answered` says behind the end of the run whether it was told.
A sink is any function that takes an event; it is called in the thread of the run and may stop the run by raising.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, replace
from datetime import datetime
from typing import TYPE_CHECKING, Any, Literal

from drivers import Arrival

if TYPE_CHECKING:
    from inspection import CharacteristicResult, InspectionResult, LiveUpdate, ProfileUncertainty, Verdict
    from inspection.surface import SurfaceResult, SurfaceUpdate

Ending = Literal["complete", "aborted", "interrupted"]


@dataclass(frozen=True, slots=True)
class Counts:
    """The numbers of a run so far. received = judged + rejected + pending, and at the end of the run pending is 0.

    received : points that came through the link whole
    judged   : points with a verdict
    rejected : points that cannot be judged, `rejected_by_reason` says why
    pending  : points received before the registration was found
    lost     : points missing by the device's own counters
    damaged_bytes : bytes on the wire that were no valid frame
    buffered, buffer_peak : points waiting for their verdict, now and at most; stalls : times a full buffer held the source up
    """

    received: int = 0
    judged: int = 0
    rejected: int = 0
    pending: int = 0
    lost: int = 0
    damaged_bytes: int = 0
    buffered: int = 0
    buffer_peak: int = 0
    stalls: int = 0
    rejected_by_reason: Mapping[str, int] = field(default_factory=dict)

    def broken_off(self, arrived: int) -> "Counts":
        """The counts of a run that broke off after so many arrived: every point is accounted for, and none waits any more."""
        received = max(self.received, arrived)
        left = received - self.judged - self.rejected
        reasons = {**self.rejected_by_reason, **({"not judged": left} if left else {})}
        return replace(self, received=received, rejected=self.rejected + left, pending=0, rejected_by_reason=reasons)


@dataclass(frozen=True, slots=True)
class RunStarted:
    """A run begins.

    simulated     : no real device is measured
    notes         : what was assumed about nominal and points
    qualification : the last one of the installation, as results name it; None where none was made
    """

    part: str
    serial_number: str
    operator: str
    device: str
    simulated: bool
    notes: tuple[str, ...] = ()
    qualification: Mapping[str, Any] | None = None

    @classmethod
    def from_header(cls, header: Mapping[str, Any]) -> "RunStarted":
        """The same from the header of a recorded run, which holds it among other things."""
        told = {field.name: header[field.name] for field in fields(cls) if field.name in header}  # older records hold no notes
        return cls(**told | {"notes": tuple(told.get("notes", ()))})


@dataclass(frozen=True, slots=True)
class Arrived:
    """Something came from the source, at `time_s` by the run's clock."""

    time_s: float
    arrival: Arrival


@dataclass(frozen=True, slots=True, eq=False)
class Judged:
    """Points were judged (or, while the registration is sought, taken in). `age_s` is how long the newest had waited."""

    time_s: float
    age_s: float
    update: "LiveUpdate | SurfaceUpdate"
    counts: Counts


@dataclass(frozen=True, slots=True)
class ProvenOut:
    """No placement of the first `points` received passes, whatever comes: for display; the final verdict does not rest on it."""

    time_s: float
    points: int


@dataclass(frozen=True, slots=True, eq=False)
class Evaluated:
    """The characteristics over the points so far: NONCONFORM where that is proven whatever comes, else UNCERTAIN. For display.

    uncertainty : of the deviations along the profile, None where no budget was stated
    """

    time_s: float
    found: "tuple[CharacteristicResult, ...]"
    uncertainty: "ProfileUncertainty | None"


@dataclass(frozen=True, slots=True, eq=False)
class RunFinished:
    """The run is over. Without a result, `message` says why there is none; after a failure it says what failed."""

    ending: Ending
    result: "InspectionResult | SurfaceResult | None"
    counts: Counts
    message: str


@dataclass(frozen=True, slots=True)
class Answered:
    """Whether a machine was told the verdict that it asked for, when, and why not; or that an earlier answer still stands as a run begins.

    request : the number of its request; None where it told none
    verdict : what it was told; None where it was told nothing
    text    : the whole answer as it was written, or was to be; empty where nothing was to be written
    unrecorded : why the records of the run do not hold it; empty where they do
    """

    state: Literal["sent", "not sent", "not withdrawn"]
    request: int | None
    at: datetime
    problem: str
    verdict: "Verdict | None" = None
    text: str = field(default="", repr=False)
    unrecorded: str = ""


Event = RunStarted | Arrived | Judged | ProvenOut | Evaluated | RunFinished | Answered
Sink = Callable[[Event], None]
