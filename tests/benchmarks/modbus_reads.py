"""Reads of 125 registers a second over TCP loopback, by the source's own way of asking, from the simulated ring.

    python -m tests.benchmarks.modbus_reads

Goal: at least 3,000 reads a second. The server in Python, in a process of its own, is the limit.
"""

import math
import platform
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from drivers.codecs.register_decoder import RegisterDecoder
from drivers.links.modbus_scanner import ModbusScanner
from drivers.links.watch import Watch
from drivers.maps import shipped_map
from drivers.source import PointBatch, WireBytes
from tests.integration.simulated import simulated

READS = 10_000
WARM_UP = 500


def reads() -> None:
    with tempfile.TemporaryDirectory() as folder, simulated("modbus-ring", "127.0.0.1:0", Path(folder), rate_hz=1.0, count=10) as device:
        scanner = ModbusScanner(device.address, RegisterDecoder(shipped_map("generic-ring")))
        request = bytes.fromhex("03 0064 007D")
        watch, times_s = Watch(3.0, math.inf, time.monotonic()), []
        with scanner._open(math.inf) as client:
            for _ in range(WARM_UP + READS):
                start_s = time.perf_counter()
                answer = scanner._ask(client, request, watch)
                times_s.append(time.perf_counter() - start_s)
                assert answer is not None
                assert len(answer) == 2 + 250
    took = np.array(times_s[WARM_UP:])
    p50, p99 = np.percentile(took, [50, 99]) * 1e3
    sys.stdout.write(f"reads of 125 registers: {READS / took.sum():,.0f} a second, p50 {p50:.2f} ms, p99 {p99:.2f} ms\n")


def points() -> None:
    count = 50_000
    with tempfile.TemporaryDirectory() as folder, simulated("modbus-ring", "127.0.0.1:0", Path(folder), "--unpaced", count=count) as device:
        received, asked, start_s = 0, 0, time.perf_counter()
        for arrival in ModbusScanner(device.address, RegisterDecoder(shipped_map("generic-ring"))).arrivals():
            received += len(arrival) if isinstance(arrival, PointBatch) else 0
            asked += isinstance(arrival, WireBytes)
        took_s = time.perf_counter() - start_s
    assert received == count
    sys.stdout.write(f"whole scan of a ring: {received / took_s:,.0f} points a second in {asked / took_s:,.0f} reads a second\n")


if __name__ == "__main__":
    sys.stdout.write(f"Python {platform.python_version()}, {platform.machine()}\n")
    reads()
    points()
