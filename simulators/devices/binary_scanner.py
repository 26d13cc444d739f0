"""A simulated scanner that streams counted binary frames, one a point or many in a block."""

import struct
from binascii import crc32, crc_hqx
from collections.abc import Sequence

from simulators.settings import Announce, SimulatorSettings
from simulators.stream import Device, Sample, stream

SERIAL_NUMBER = 4711


class BinaryDevice(Device):
    """One 24-byte frame a point."""

    def __init__(self) -> None:
        self._heard = False

    def opening(self, count: int) -> bytes:
        """Say three times which device begins."""
        return 3 * _frame(0, 0, 0, 0, struct.pack("<IQ", SERIAL_NUMBER, count))

    def frame(self, samples: Sequence[Sample]) -> bytes:
        """Return one point."""
        [taken] = samples
        return _frame(1, int(taken.invalid), taken.index, round(taken.time_s * 1e6), struct.pack("<3i", *_units(taken)))

    def heartbeat(self, index: int, time_s: float) -> bytes:
        """Say how many points were sent."""
        return _frame(2, 0, index, round(time_s * 1e6), struct.pack("<QI", index, 0))

    def closing(self, count: int) -> bytes:
        """Say three times how many points were sent."""
        return 3 * _frame(3, 0, count, 0, struct.pack("<QI", count, 0))

    def answer(self, command: bytes) -> bytes:
        """Listen for `G`."""
        self._heard |= b"G" in command
        return b""

    def told_to_begin(self) -> bool:
        """Tell whether the host sent `G`."""
        return self._heard


class BlockDevice(BinaryDevice):
    """Points in blocks of up to 64."""

    samples_per_frame = 64

    def frame(self, samples: Sequence[Sample]) -> bytes:
        """Return one block."""
        first_us = round(samples[0].time_s * 1e6)
        head = struct.pack("<2sHIQ", b"\xa5\x5b", len(samples), samples[0].index % 2**32, first_us)
        body = b"".join(struct.pack("<I3iH", round(taken.time_s * 1e6) - first_us, *_units(taken), int(taken.invalid)) for taken in samples)
        data = head + struct.pack("<H", crc_hqx(head, 0xFFFF)) + body
        return data + struct.pack("<I", crc32(data))


def _units(taken: Sample) -> list[int]:
    return [round(value * 1e5) for value in taken.point_mm]


def _frame(kind: int, flags: int, index: int, time_us: int, body: bytes) -> bytes:
    data = struct.pack("<2sBBHI12s", b"\xa5\x5a", kind, flags, index % 2**16, time_us % 2**32, body)
    return data + struct.pack("<H", crc_hqx(data, 0xFFFF))


def serve(settings: SimulatorSettings, announce: Announce) -> None:
    """Serve one scan of single frames."""
    stream(settings, BinaryDevice(), announce)


def serve_blocks(settings: SimulatorSettings, announce: Announce) -> None:
    """Serve one scan of blocks."""
    stream(settings, BlockDevice(), announce)


DEVICES = {"binary": serve, "binary-block": serve_blocks}
