"""A simulated scanner that streams lines of text with a checksum each."""

from binascii import crc_hqx
from collections.abc import Sequence

from simulators.settings import Announce, SimulatorSettings
from simulators.stream import Device, Sample, stream


class AsciiDevice(Device):
    """Lines of text with a checksum each: `P,seq,t_us,x,y,z,flags*CRC`."""

    def __init__(self) -> None:
        self._heard = b""

    def opening(self, count: int) -> bytes:
        """Say three times which device begins, so that one damaged line does not cost the scan."""
        return 3 * _line(f"S,simulated scanner,SIM-0001,mm,{count}")

    def frame(self, samples: Sequence[Sample]) -> bytes:
        """Return one P line."""
        [taken] = samples
        x, y, z = taken.point_mm
        return _line(f"P,{taken.index % 2**32},{round(taken.time_s * 1e6) % 2**32},{x:.6f},{y:.6f},{z:.6f},{int(taken.invalid)}")

    def heartbeat(self, index: int, time_s: float) -> bytes:
        """Return one H line."""
        return _line(f"H,{index % 2**32},{round(time_s * 1e6) % 2**32}")

    def closing(self, count: int) -> bytes:
        """Say three times how many points were sent."""
        return 3 * _line(f"E,{count}")

    def answer(self, command: bytes) -> bytes:
        """Listen for a line `G`."""
        self._heard = (self._heard + command)[-16:]
        return b""

    def told_to_begin(self) -> bool:
        """Tell whether the host sent `G`."""
        return b"G" in self._heard


def _line(text: str) -> bytes:
    body = text.encode("ascii")
    return b"%b*%04X\r\n" % (body, crc_hqx(body, 0xFFFF))


def serve(settings: SimulatorSettings, announce: Announce) -> None:
    """Serve one scan of the line format; `announce` gets the address, and at the end the tally as JSON."""
    stream(settings, AsciiDevice(), announce)


DEVICES = {"serial": serve}
