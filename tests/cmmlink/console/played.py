"""A station whose device is played by the test: a nominal, measured points with known deviations, and a source the test feeds."""

import queue
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from datetime import datetime
from pathlib import Path
from time import monotonic

import numpy as np
from numpy.typing import NDArray

from cmmlink.console.station_setup import Records, StationSetup
from cmmlink.devices import Connected
from cmmlink.plan.scan import Plan
from cmmlink.plan.whole_surface import SurfacePlan
from drivers.errors import DeviceError
from drivers.source import Arrival, PointBatch, ScanClosed, ScanOpened
from inspection import NominalProfile, RigidTransform, synthetic
from tests.cmmlink.command import cmmlink

Array = NDArray[np.float64]

UNREAD = 1 << 16  # messages that a client holds before it stops listening: a full one hears no end, and waits for ever at its own
PLAN = """part: {name: blade 7, serial_number: B-0041}
operator: Ada
nominal: {file: section.yaml}
tolerance: {lower_mm: -0.05, upper_mm: 0.05}
device: {type: serial, address: played}
"""
# A closed periodic curve of degree 4 without any symmetry: the project's test curve P3.
SECTION = """degree: 4
closed: true
control_points_mm: [[60, 0], [52, 26], [24, 34], [-4, 30], [-34, 38], [-58, 18], [-50, -8], [-28, -26], [6, -20], [38, -30],
  [60, 0], [52, 26], [24, 34], [-4, 30]]
knots: [-0.4, -0.3, -0.2, -0.1, 0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1, 1.1, 1.2, 1.3, 1.4]
"""


def write_plan(folder: Path, name: str = "blade.yaml", text: str = PLAN) -> Path:
    """Write a plan and its nominal."""
    (folder / "section.yaml").write_text(SECTION, encoding="utf-8")
    (folder / name).write_text(text, encoding="utf-8")
    return folder / name


def measured(nominal: NominalProfile, count: int, seed: int, defect_mm: float = 0.0, at_mm: float = 20.0, excess_mm: float = 0.0) -> Array:
    """Machine points (count, 3): form error of 0.015 mm, noise of 1 um, a defect 3 mm wide, excess everywhere; posed on the table."""
    rng = np.random.default_rng(seed)
    station = np.linspace(0, nominal.length_mm, count, endpoint=False)
    deviation = synthetic.form_error_mm(station, nominal.length_mm, rng, 0.015) + rng.normal(0, 0.001, count)
    deviation += excess_mm + defect_mm * np.exp(-(((station - at_mm) / 1.5) ** 2))
    pose = RigidTransform(-0.4, np.array([210.0, 145.0]))
    section = synthetic.scan(nominal, station, deviation, pose).points_mm
    return np.column_stack([section, np.zeros(count)])


def batches(points_mm: Array, size: int, first: int = 0) -> list[PointBatch]:
    """The points in batches as a driver hands them over."""
    cuts = range(0, len(points_mm), size)
    sequence = first + np.arange(len(points_mm), dtype=np.int64)
    time_s = np.asarray(sequence * 1e-3, dtype=np.float64)
    return [PointBatch(sequence[k : k + size].copy(), time_s[k : k + size].copy(), points_mm[k : k + size].copy()) for k in cuts]


def opened(expected: int) -> ScanOpened:
    return ScanOpened("played scanner", "PL-7", expected)


CLOSED = ScanClosed(None)


def made_here(command: list[str], records: Path, file: Path, options: list[str]) -> None:
    """What another process makes of records for the station, made in this one."""
    assert cmmlink(*command, "--records", records, "--out", file, "--json", *options).code == 0


class PlayedSource:
    """Hands over what the test puts in, the moment it does; a DeviceError put in is raised."""

    def __init__(self) -> None:
        self._arrivals: queue.SimpleQueue[Arrival | DeviceError | None] = queue.SimpleQueue()

    def put(self, *arrivals: Arrival | DeviceError) -> None:
        for arrival in arrivals:
            self._arrivals.put(arrival)

    def arrivals(self) -> Iterator[Arrival]:
        while (arrival := self._arrivals.get()) is not None:
            if isinstance(arrival, DeviceError):
                raise arrival
            yield arrival
            if isinstance(arrival, ScanClosed):
                return

    def stop(self) -> None:
        self._arrivals.put(None)


class Device:
    """What is connected to is played from `source`; `renew` before another run."""

    def __init__(self) -> None:
        self.source = PlayedSource()

    def renew(self) -> None:
        self.source = PlayedSource()

    def connect(self, plan: Plan | SurfacePlan) -> AbstractContextManager[Connected]:
        return nullcontext(Connected(self.source, "played scanner", True))


def setup_of(
    plans: Mapping[str, Path],
    connect: Callable[[Plan | SurfacePlan], AbstractContextManager[Connected]],
    records: Records | None = None,
    devices: Sequence[tuple[str, str]] = (("played", "the device of this test"),),
) -> StationSetup:
    """What a station needs, with the device played."""
    return StationSetup(lambda: plans, connect, lambda: devices, records, monotonic, lambda: datetime.now().astimezone())
