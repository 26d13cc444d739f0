"""What the results database takes and gives, free of any database: runs with their values, events, series and strips."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime

import numpy as np
from numpy.typing import NDArray

from cmmlink.plant.profile_strip import STRIP_PARTS, ProfileStrip


@dataclass(frozen=True, slots=True)
class StoredValue:
    """What was found of one characteristic.

    value, lower, upper, uncertainty : in `unit`, None where there is none. The limits are those of the value itself, not of its deviation
    from the nominal; a form deviation has no lower one, and its upper one is the width of the zone
    """

    name: str
    type: str
    unit: str
    value: float | None
    lower: float | None
    upper: float | None
    uncertainty: float | None
    verdict: str


@dataclass(frozen=True, slots=True, eq=False)
class StoredRun:
    """A run that has ended, as its record tells it.

    section      : of a section of a surface its height, mm; empty for every other run
    verdict      : conform, uncertain or nonconform; None where the run gave none
    chain_sha256 : the hash of its end at the station that measured it
    counts       : received, judged, rejected, lost, damaged_bytes; None where the record does not tell
    strip        : None where nothing was judged
    """

    station: str
    run: str
    part: str
    section: str
    serial_number: str
    operator: str
    started: datetime
    state: str
    verdict: str | None
    software: str
    chain_sha256: str
    plan_sha256: str
    nominal_sha256: str
    received: int | None
    judged: int | None
    rejected: int | None
    lost: int | None
    damaged_bytes: int | None
    simulated: bool
    values: tuple[StoredValue, ...] = ()
    strip: ProfileStrip | None = None


@dataclass(frozen=True, slots=True)
class StoredEvent:
    """Something that happened: an alarm, an entry of a study, a run judged again.

    key : what makes it the same event when it is added twice
    """

    key: str
    at: datetime
    kind: str
    words: str
    station: str = ""
    part: str = ""
    characteristic: str = ""
    run: str = ""
    who: str = ""


@dataclass(frozen=True, slots=True)
class PartCharacteristic:
    """A characteristic that a part has."""

    name: str
    type: str
    unit: str


@dataclass(frozen=True, slots=True)
class RunFound:
    """A run that was looked for."""

    station: str
    run: str
    part: str
    section: str
    serial_number: str
    operator: str
    started: datetime
    state: str
    verdict: str | None
    chain_sha256: str


@dataclass(frozen=True, slots=True, eq=False)
class ResultSeries:
    """The values of one characteristic of a part, oldest first, of k runs that came to their end.

    value, lower, upper : (k,) in `unit`, NaN where there is none; see StoredValue
    started_s           : (k,) seconds since 1970 UTC
    verdict, run, station, serial_number : of each
    left_out            : how many values of another type or unit have the same name; they are not in the series
    """

    part: str
    name: str
    type: str
    unit: str
    value: NDArray[np.float64]
    lower: NDArray[np.float64]
    upper: NDArray[np.float64]
    started_s: NDArray[np.float64]
    verdict: tuple[str, ...]
    run: tuple[str, ...]
    station: tuple[str, ...]
    serial_number: tuple[str, ...]
    left_out: int = 0

    def __post_init__(self) -> None:
        k = len(self.run)
        for array in (self.value, self.lower, self.upper, self.started_s):
            if array.shape != (k,):
                raise ValueError(f"expected ({k},) for each, got {array.shape}")
            array.setflags(write=False)


@dataclass(frozen=True, slots=True, eq=False)
class ProfileStrips:
    """The strips of k runs of a part that came to their end, oldest first.

    mean_mm, worst_mm  : (k, 120) float32, NaN where nothing was judged; see ProfileStrip
    length_mm          : (k,) of the nominal of each run
    lower_mm, upper_mm : (k,) the zone of each run, NaN where there is no such limit
    started_s          : (k,) seconds since 1970 UTC
    """

    mean_mm: NDArray[np.float32]
    worst_mm: NDArray[np.float32]
    length_mm: NDArray[np.float64]
    lower_mm: NDArray[np.float64]
    upper_mm: NDArray[np.float64]
    started_s: NDArray[np.float64]
    verdict: tuple[str | None, ...]
    run: tuple[str, ...]
    station: tuple[str, ...]
    serial_number: tuple[str, ...]

    def __post_init__(self) -> None:
        k = len(self.run)
        for array in (self.mean_mm, self.worst_mm):
            if array.shape != (k, STRIP_PARTS):
                raise ValueError(f"expected ({k}, {STRIP_PARTS}) for each, got {array.shape}")
            array.setflags(write=False)


def numbers(values: Sequence[float | None]) -> NDArray[np.float64]:
    """A column of the database as an array, NaN where there is no number."""
    return np.array(values, dtype=np.float64)
