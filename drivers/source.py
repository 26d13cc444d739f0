"""What a source of points hands to the application, and the contract every source keeps.

A source is iterated once, in the acquisition thread. It yields arrivals in the order in which things happened:
the raw bytes first, then everything decoded from them. Nothing is dropped in silence: every point is a row of a
`PointBatch` or counted by a `Rejected`; every gap in the device's own counter is a `Lost`; every byte that is no
valid frame is counted by a `Damaged`.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

FRAME_REPEATED = "frame repeated"
POINT_REPEATED = "point repeated"
VALUE_REPEATED = "value repeated"
ANOTHER_CONTENT = "number of an earlier point, but not known to be the same point"
OLDER_THAN_THE_SCAN = "older than the scan"
HARMLESS_REASONS = frozenset({FRAME_REPEATED, POINT_REPEATED, VALUE_REPEATED, OLDER_THAN_THE_SCAN})
"""Reasons of `Rejected` by which no point of this scan is missing: exact repetitions, and what was provably taken before it."""


@dataclass(frozen=True, slots=True)
class WireBytes:
    """Raw bytes as they came off the link, for the record; `time_s` by the clock handed to the source."""

    time_s: float
    data: bytes


@dataclass(frozen=True, slots=True)
class ScanOpened:
    """The device opened a scan. `expected` is its announced number of points, if it announces one.

    request : the number by which the device asks for a verdict on this scan, if it told one
    """

    device: str
    serial_number: str
    expected: int | None
    request: int | None = None


@dataclass(frozen=True, slots=True, eq=False)
class PointBatch:
    """Consecutive points of one device.

    sequence  : (m,) int64, the device's counter, unwrapped
    time_s    : (m,) by the device's own clock, from its arbitrary zero
    points_mm : (m, 3) in machine coordinates; surface points or ball centres, as the plan says
    normals   : (m, 3) outward directions of the measured surface, of any length, zero or NaN where not known; None where the device
                gives none
    """

    sequence: NDArray[np.int64]
    time_s: NDArray[np.float64]
    points_mm: NDArray[np.float64]
    normals: NDArray[np.float64] | None = None

    def __post_init__(self) -> None:
        m = len(self.sequence)
        if self.time_s.shape != (m,) or self.points_mm.shape != (m, 3):
            raise ValueError(f"expected ({m},) and ({m}, 3), got {self.time_s.shape} and {self.points_mm.shape}")
        if self.normals is not None and self.normals.shape != (m, 3):
            raise ValueError(f"expected normals ({m}, 3), got {self.normals.shape}")
        for array in (self.sequence, self.time_s, self.points_mm, self.normals):
            if array is not None:
                array.setflags(write=False)

    def __len__(self) -> int:
        return len(self.sequence)


@dataclass(frozen=True, slots=True)
class Damaged:
    """Bytes that are no valid frame: how many, and why."""

    byte_count: int
    reason: str


@dataclass(frozen=True, slots=True)
class Rejected:
    """Points that arrived whole but cannot be used (repeated, out of range, marked invalid by the device)."""

    count: int
    reason: str


@dataclass(frozen=True, slots=True)
class Lost:
    """Points that the device's own counters say were sent and that never arrived.

    `count` is negative when points counted as lost arrive late after all.
    """

    count: int
    reason: str


@dataclass(frozen=True, slots=True)
class Heartbeat:
    """The device is alive though it has no point to send: a slow scan, not a silent device."""


@dataclass(frozen=True, slots=True)
class LinkDown:
    """The link was lost; the source goes on trying."""

    reason: str


@dataclass(frozen=True, slots=True)
class LinkUp:
    """The link is there again, after `gap_s` seconds."""

    gap_s: float


@dataclass(frozen=True, slots=True)
class ScanClosed:
    """The device closed the scan. `sent` is its own count of the points it sent, if it tells."""

    sent: int | None


Arrival = WireBytes | ScanOpened | PointBatch | Damaged | Rejected | Lost | Heartbeat | LinkDown | LinkUp | ScanClosed


class Decoder(Protocol):
    """A wire format, without any input or output: bytes in, arrivals out.

    The points and counts do not depend on how the bytes were cut. A decoder serves one scan of one device.
    """

    def request(self) -> bytes:
        """Return what the host has to send now; called when the link opens and after every read, be it empty."""

    def feed(self, data: bytes) -> list[Arrival]:
        """Decode the next bytes; raise `ProtocolError` only when no point of this device could ever be used."""

    def break_off(self) -> list[Arrival]:
        """Account for a frame that the end of the link cut off."""


class ScanSource(Protocol):
    """One scan, from the first byte to the last."""

    def arrivals(self) -> Iterator[Arrival]:
        """Open the link, yield what arrives, end after `ScanClosed`; raise a `DeviceError` when the link cannot go on.

        Blocks for at most a fraction of a second before it looks whether `stop` was called.
        """

    def stop(self) -> None:
        """End `arrivals` soon (within half a second); may be called from any thread, any number of times."""
