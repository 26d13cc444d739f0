"""A simulated RIFTEK RF60x distance sensor, binary or ASCII, over which the part is fed.

Range 50 mm from distance 0; the path gives the distance y over x. The binary stream begins with request 7, ends with
request 8; request 1 identifies, request 6 gives one result. The ASCII sensor answers `R1` with one distance in mm.
"""

from collections.abc import Sequence

from simulators.motion import feed_under
from simulators.settings import Announce, SimulatorSettings
from simulators.stream import Device, Sample, stream

RANGE_MM = 50.0
IDENTITY = bytes([63, 0x90, 0x21, 0x43, 80, 0, 50, 0])  # device type, firmware, serial number, base distance, range


class RiftekDevice(Device):
    """Bursts of four bytes, low nibble first, counted modulo 4."""

    def __init__(self, address: int = 1) -> None:
        self._address = address
        self._heard = b""
        self._streaming = False
        self._bursts = 0
        self._last = 0

    def frame(self, samples: Sequence[Sample]) -> bytes:
        """Return one result."""
        [taken] = samples
        self._last = min(max(round(taken.point_mm[1] * 16384 / RANGE_MM), 0), 16384)
        return self._burst(self._last.to_bytes(2, "little"), renewed=not taken.invalid)

    def closing(self, count: int) -> bytes:
        """Go on streaming, as the real sensor does: one more result."""
        return self._burst(self._last.to_bytes(2, "little"), renewed=True)

    def answer(self, command: bytes) -> bytes:
        """Answer two-byte requests to this sensor."""
        reply = b""
        self._heard += command
        while len(self._heard) >= 2:
            address, code = self._heard[0], self._heard[1]
            if address & 0x80 or not code & 0x80 or address not in {0, self._address}:
                self._heard = self._heard[1:]
                continue
            self._heard = self._heard[2:]
            reply += self._obey(code & 15)
        return reply

    def told_to_begin(self) -> bool:
        """Tell whether request 7 came."""
        return self._streaming

    def _obey(self, code: int) -> bytes:
        if code in {7, 8}:
            self._streaming = code == 7
        if code == 1:
            return self._burst(IDENTITY, renewed=False)
        return self._burst(self._last.to_bytes(2, "little"), renewed=True) if code == 6 else b""

    def _burst(self, data: bytes, *, renewed: bool) -> bytes:
        self._bursts += 1
        top = 0x80 | renewed << 6 | (self._bursts & 3) << 4
        return bytes(top | nibble for byte in data for nibble in (byte & 15, byte >> 4))


class RiftekAsciiDevice(Device):
    """One line for each `R1`."""

    def __init__(self) -> None:
        self._heard = b""
        self._asked = 0

    def frame(self, samples: Sequence[Sample]) -> bytes:
        """Return one distance."""
        [taken] = samples
        self._asked -= 1
        return b"%.3f\r\n" % taken.point_mm[1]

    def answer(self, command: bytes) -> bytes:
        """Count the requests for a result; identify on `V`."""
        *lines, self._heard = (self._heard + command).split(b"\r\n")
        self._asked += lines.count(b"R1")
        return b"603\n40\n17185\n80\n50\r\n" * lines.count(b"V")

    def told_to_begin(self) -> bool:
        """Tell whether a result is asked for."""
        return self._asked > 0

    def frames_asked_for(self) -> int | None:
        """Return the number of results asked for."""
        return self._asked


def serve(settings: SimulatorSettings, announce: Announce) -> None:
    """Serve one binary stream."""
    stream(settings, RiftekDevice(), announce, move=feed_under)


def serve_ascii(settings: SimulatorSettings, announce: Announce) -> None:
    """Serve one scan of ASCII answers."""
    stream(settings, RiftekAsciiDevice(), announce, move=feed_under)


DEVICES = {"riftek": serve, "riftek-ascii": serve_ascii}
