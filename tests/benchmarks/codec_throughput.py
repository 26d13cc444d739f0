"""Points per second of processor time through every codec, fed in chunks of 64 bytes, 1 KB and 16 KB.

    python -m tests.benchmarks.codec_throughput

Goals: binary at least 1e6 and ASCII at least 3e5 points a second for 1 KB chunks.
"""

import platform
import struct
import sys
import time
from binascii import crc_hqx
from collections.abc import Callable

import numpy as np

from drivers.codecs.ascii_frames import AsciiDecoder
from drivers.codecs.binary_frames import FRAME, BinaryDecoder
from drivers.codecs.optoncdt_frames import OptoncdtDecoder
from drivers.codecs.riftek_frames import RiftekDecoder
from drivers.source import Decoder, PointBatch
from simulators.devices.ascii_scanner import AsciiDevice
from simulators.devices.binary_scanner import BlockDevice
from simulators.devices.optoncdt_scanner import OptoncdtDevice
from simulators.devices.riftek_scanner import RiftekDevice
from simulators.stream import Device, Sample

POINTS = 200_000
CHUNKS = (64, 1024, 16_384)
REPEATS = 3


def stream(device: Device, opening: bytes = b"") -> bytes:
    rng = np.random.default_rng(0)
    points = rng.uniform(5.0, 45.0, (POINTS, 3)).tolist()
    samples = [Sample(i, i * 1e-4, tuple(point)) for i, point in enumerate(points)]
    step = device.samples_per_frame
    frames = b"".join(device.frame(samples[i : i + step]) for i in range(0, POINTS, step))
    return opening + device.opening(POINTS) + frames


def single_frames() -> bytes:
    """Single frames, built with numpy as 200,000 calls are slow."""
    frames = np.zeros(POINTS, dtype=FRAME)
    frames["sync"], frames["type"], frames["seq"] = 0x5AA5, 1, np.arange(POINTS) % 65536
    frames["t_us"], frames["xyz"] = np.arange(POINTS) * 100, np.random.default_rng(0).integers(-(10**7), 10**7, (POINTS, 3))
    raw = frames.tobytes()
    return b"".join(raw[i : i + 22] + struct.pack("<H", crc_hqx(raw[i : i + 22], 0xFFFF)) for i in range(0, len(raw), 24))


def points_per_second(make: Callable[[], Decoder], data: bytes, chunk: int) -> float:
    pieces = [data[i : i + chunk] for i in range(0, len(data), chunk)]
    best = 0.0
    for _ in range(REPEATS):
        decoder, received = make(), 0
        start_s = time.process_time()
        for piece in pieces:
            for arrival in decoder.feed(piece):
                received += len(arrival) if isinstance(arrival, PointBatch) else 0
        took_s = time.process_time() - start_s
        assert received >= POINTS - 1, received
        best = max(best, received / took_s)
    return best


def main() -> None:
    sensor = OptoncdtDevice()
    opening = sensor.answer(OptoncdtDecoder(50.0).request())
    cases: dict[str, tuple[Callable[[], Decoder], bytes]] = {
        "ascii": (AsciiDecoder, stream(AsciiDevice())),
        "binary, single frames": (BinaryDecoder, single_frames()),
        "binary, blocks of 64": (BinaryDecoder, stream(BlockDevice())),
        "riftek binary": (lambda: RiftekDecoder(50.0, 1e4), stream(RiftekDevice())),
        "optoNCDT, 4 words a value": (lambda: OptoncdtDecoder(50.0), stream(sensor, opening)),
    }
    sys.stdout.write(f"points/s, best of {REPEATS}; Python {platform.python_version()}, {platform.machine()}, {POINTS} points\n")
    for name, (make, data) in cases.items():
        rates = "  ".join(f"{chunk:>6} B {points_per_second(make, data, chunk):>12,.0f}" for chunk in CHUNKS)
        sys.stdout.write(f"{name:<28}{rates}\n")


if __name__ == "__main__":
    main()
