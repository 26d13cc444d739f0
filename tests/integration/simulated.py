"""Simulated devices as processes of their own, for the integration tests."""

import json
import multiprocessing
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from simulators import known_devices, settings_from
from simulators.motion import Motion, walk
from tests.integration.split_off import split_off

PATH_MM = np.array([[0.0, 0.0], [60.0, 0.0], [60.0, 20.0], [0.0, 20.0]])
SPEED_MM_S, RATE_HZ, SEED = 1000.0, 2000.0, 5


@dataclass(frozen=True, slots=True)
class Simulated:
    """A running device. `sent_mm` holds the points of its scan, (n, 3)."""

    address: str
    process: BaseProcess
    sent_mm: NDArray[np.float64]
    said: Connection

    def tally(self) -> dict[str, int]:
        """Wait for the end of the scan; return the device's own account of it."""
        return dict(json.loads(self.said.recv()))


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
    words = ["--address", address, "--path", path, *told, *options]
    said, say = multiprocessing.Pipe(duplex=False)
    process = split_off(serve, device, [str(word) for word in words], say)
    say.close()
    with said:
        try:
            served = ""
            with suppress(EOFError):
                served = said.recv()
            assert served, "the simulated device said no address"
            yield Simulated(served, process, walk(path_mm, motion).points_mm, said)
        finally:
            process.kill()
            process.join()


def serve(device: str, words: list[str], say: Connection) -> None:
    """Serve the device as `python -m simulators` does; what it says goes down the pipe. What it refuses it does not serve."""
    with suppress(ValueError):
        known_devices()[device](settings_from(words), say.send)
