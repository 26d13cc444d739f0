"""Scans of 1,000 points with numbers that no part has, from the registers of a device to the verdict: what each of them costs.

    python -m tests.integration.absurd_numbers [everywhere]

One line a scan: processor time in seconds, peak memory of the process so far in MB, points received, judged and rejected, and the scan.
"""

import re
import struct
import sys
import threading
import time
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cmmlink.events import RunStarted
from cmmlink.pipeline import run_inspection
from drivers import Arrival, RegisterDecoder, register_map
from inspection import LiveInspection, NominalProfile, NurbsCurve, ToleranceZone, discretize, rehearse

COUNT = 1000
VALUES = {
    "1e9": 1e9,
    "3.4e38": 3.4e38,
    "1e-41": 1e-41,
    "NaN": float("nan"),
    "-9999": -9999.0,
    "1e6 - 1": 1e6 - 1,
    "the least number": 1.4e-45,
}
PLACES = {"every tenth": slice(0, None, 10)}
MORE_PLACES = {
    "first": slice(0, 1),
    "all": slice(None),
    "64th": slice(63, 64),
    "65th": slice(64, 65),
    "middle": slice(500, 501),
    "last": slice(999, None),
    "every other": slice(0, None, 2),
}
LATEST = register_map(
    {
        "device": "d",
        "pattern": "latest",
        "points": {
            "at": 0,
            "fields": {"sequence": {"at": 0, "type": "uint16"}, "x": {"at": 1, "type": "float32"}, "y": {"at": 3, "type": "float32"}},
        },
    }
)


class Registers:
    """A device that shows one point after the other in its registers; where its words are swapped, they come so."""

    def __init__(self, points_mm: NDArray[np.float64], swapped: NDArray[np.bool_]) -> None:
        self._points_mm, self._swapped = points_mm, swapped

    def stop(self) -> None:
        """End nothing: the scan is short."""

    def arrivals(self) -> Iterator[Arrival]:
        """Yield what the decoder makes of the registers; what stands there at first is older than the scan."""
        decoder = RegisterDecoder(LATEST, count=COUNT)
        for number, ((x, y), swapped) in enumerate(zip([(0.0, 0.0), *self._points_mm], [False, *self._swapped], strict=True)):
            words = [struct.pack(">f", np.float32(value)) for value in (x, y)]
            data = struct.pack(">H", number) + b"".join(word[2:] + word[:2] if swapped else word for word in words)
            request = decoder.request()
            yield from decoder.feed(request + bytes([request[0], len(data)]) + data)


def scans(good_mm: NDArray[np.float64], places: Mapping[str, slice]) -> Iterator[tuple[str, Registers]]:
    """Every value at every place, in x alone and in both; swapped words, and numbers of every size up to a kilometre."""
    none = np.zeros(COUNT, dtype=np.bool_)
    yield "as it should be", Registers(good_mm, none)
    for place, rows in places.items():
        for name, value in VALUES.items():
            points_mm = good_mm.copy()
            points_mm[rows, : 1 if len(name) % 2 else 2] = value
            yield f"{name}, {place}", Registers(points_mm, none)
        swapped = none.copy()
        swapped[rows] = True
        yield f"swapped words, {place}", Registers(good_mm, swapped)
        rng = np.random.default_rng(5)
        points_mm = good_mm.copy()
        points_mm[rows] = rng.choice([-1.0, 1.0], points_mm[rows].shape) * 10.0 ** rng.uniform(-40, 6, points_mm[rows].shape)
        yield f"every size, {place}", Registers(points_mm, none)


def part() -> tuple[NominalProfile, NDArray[np.float64]]:
    """An oval that no turn takes into itself, and points on it."""
    turn = np.linspace(0, 2 * np.pi, 60, endpoint=False)
    curve = NurbsCurve.interpolate(np.column_stack([50 * np.cos(turn), 20 * np.sin(turn) + 4 * np.cos(turn) ** 2]), closed=True)
    return discretize(curve, samples=300), curve.point(np.linspace(0, 0.999, COUNT))


def peak_of_this_process_mb() -> float:
    """The most memory that this process held. Linux hands the peak of a parent on in `getrusage`, so there it is asked elsewhere."""
    status = Path("/proc/self/status")
    if status.exists():
        return float(re.findall(r"VmHWM:\s*(\d+) kB", status.read_text(encoding="ascii"))[0]) / 2**10
    import resource  # POSIX only, and other systems import this file for its scans

    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (2**20 if sys.platform == "darwin" else 2**10)


def main() -> None:
    """Carry out every scan and print what it cost."""
    nominal, good_mm = part()
    rehearse(nominal)
    for name, device in scans(good_mm, PLACES | MORE_PLACES if "everywhere" in sys.argv else PLACES):
        began_s = time.process_time()
        live = LiveInspection(nominal, ToleranceZone(-0.05, 0.05))
        started = RunStarted("part", "", "", "device", simulated=False)
        outcome = run_inspection(device, live, [], started, buffer_points=COUNT, clock=time.monotonic, stop=threading.Event())
        assert outcome.failure is None or "word_order" in str(outcome.failure), outcome.failure
        peak_mb = peak_of_this_process_mb()
        counts = outcome.counts
        told = f"{time.process_time() - began_s:.3f} {peak_mb:.0f} {counts.received} {counts.judged} {counts.rejected} {name}\n"
        sys.stdout.write(told)


if __name__ == "__main__":
    main()
