"""Simulated devices as processes of their own, for the integration tests."""

import json
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from simulators.motion import Motion, walk

PATH_MM = np.array([[0.0, 0.0], [60.0, 0.0], [60.0, 20.0], [0.0, 20.0]])
SPEED_MM_S, RATE_HZ, SEED = 1000.0, 2000.0, 5


@dataclass(frozen=True, slots=True)
class Simulated:
    """A running device. `sent_mm` holds the points of its scan, (n, 3)."""

    address: str
    process: subprocess.Popen[str]
    sent_mm: NDArray[np.float64]

    def tally(self) -> dict[str, int]:
        """Wait for the end of the scan; return the device's own account of it."""
        assert self.process.stdout is not None
        return dict(json.loads(self.process.stdout.readline()))


@contextmanager
def simulated(
    device: str,
    address: str,
    folder: Path,
    *options: str,
    count: int = 1000,
    rate_hz: float = RATE_HZ,
    speed_mm_s: float = SPEED_MM_S,
    noise_mm: float = 0.01,
    path_mm: NDArray[np.float64] = PATH_MM,
) -> Iterator[Simulated]:
    """Run the device until the end of the block."""
    path = folder / "path.csv"
    np.savetxt(path, path_mm, delimiter=",")
    motion = Motion(speed_mm_s, rate_hz, count=count, seed=SEED, noise_mm=noise_mm)
    told = ["--speed", speed_mm_s, "--rate", rate_hz, "--count", count, "--seed", SEED, "--noise-mm", noise_mm]
    command = [sys.executable, "-m", "simulators", device, "--address", address, "--path", path, *told, *options]
    root = Path(__file__).resolve().parents[2]
    with subprocess.Popen([str(word) for word in command], stdout=subprocess.PIPE, text=True, cwd=root) as process:
        try:
            assert process.stdout is not None
            served = process.stdout.readline().strip()
            assert served, "the simulated device said no address"
            yield Simulated(served, process, walk(path_mm, motion).points_mm)
        finally:
            process.kill()
            process.wait()
