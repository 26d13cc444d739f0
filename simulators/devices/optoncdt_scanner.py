"""A simulated Micro-Epsilon optoNCDT 1420 on RS422, over which the part is fed.

Range 50 mm; the path gives the distance y over x. It answers ASCII commands with a prompt while it streams three-byte
words, and adds the values asked for with OUTADD_RS422 to every distance.
"""

from collections.abc import Sequence

from simulators.motion import feed_under
from simulators.settings import Announce, SimulatorSettings
from simulators.stream import Device, Sample, stream

RANGE_MM = 50.0
FIRST_COUNT = 262_000  # so that the 18-bit counter soon wraps
ADDITIONAL = {"SHUTTER": ("SHUTTER",), "COUNTER": ("COUNTER",), "TIMESTAMP": ("TIMESTAMPLO", "TIMESTAMPHI"), "INTENSITY": ("INTENSITY",)}
NO_PEAK = 262076


class OptoncdtDevice(Device):
    """Words of three bytes, and ASCII replies between them."""

    def __init__(self) -> None:
        self._heard = b""
        self._streaming = False
        self._added: list[str] = []

    def frame(self, samples: Sequence[Sample]) -> bytes:
        """Return one block: the distance and the values added to it."""
        [taken] = samples
        ticks = round(taken.time_s * 1e5)
        values = {
            "SHUTTER": 1234,
            "COUNTER": (FIRST_COUNT + taken.index) % (1 << 18),
            "TIMESTAMPLO": ticks & 0xFFFF,
            "TIMESTAMPHI": ticks >> 16 & 0xFFFF,
            "INTENSITY": 32768,
        }
        distance = NO_PEAK if taken.invalid else round((taken.point_mm[1] * 100 / RANGE_MM + 1) * 65520 / 102)
        names = [part for name in ADDITIONAL if name in self._added for part in ADDITIONAL[name]]
        return _word(distance, first=True) + b"".join(_word(values[name], first=False) for name in names)

    def answer(self, command: bytes) -> bytes:
        """Answer whole command lines."""
        *lines, self._heard = (self._heard + command).split(b"\n")
        return b"".join(self._obey(line.decode("ascii", "replace").split()) for line in lines)

    def told_to_begin(self) -> bool:
        """Tell whether the output was switched on."""
        return self._streaming

    def _obey(self, words: list[str]) -> bytes:
        if words[:1] == ["OUTPUT"] and words[1:] in (["RS422"], ["NONE"]):
            self._streaming = words[1] == "RS422"
        elif words[:1] == ["OUTADD_RS422"] and set(words[1:]) <= set(ADDITIONAL):
            self._added = words[1:]
        elif words == ["GETOUTINFO_RS422"]:
            names = [part for name in ADDITIONAL if name in self._added for part in ADDITIONAL[name]]
            return f"GETOUTINFO_RS422 DIST1 {' '.join(names)}\r\n->".encode()
        else:
            return b"E01 unknown command\r\n->"
        return b"\r\n->"


def _word(value: int, *, first: bool) -> bytes:
    return bytes([value & 63, 0x40 | value >> 6 & 63, 0x80 | (not first) << 6 | value >> 12 & 63])


def serve(settings: SimulatorSettings, announce: Announce) -> None:
    """Serve one scan."""
    stream(settings, OptoncdtDevice(), announce, move=feed_under)


DEVICES = {"optoncdt": serve}
