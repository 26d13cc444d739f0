"""Recorded runs for the tests: of scripted arrivals, or of any source, under a small plan."""

import threading
import time
from collections.abc import Callable, Iterator, Sequence
from datetime import UTC, datetime
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cmmlink.demo import plan_file
from cmmlink.events import RunStarted, Sink
from cmmlink.from_plan import inspection_of, profile_of
from cmmlink.pipeline import RunOutcome, run_inspection
from cmmlink.plan.datum import Datum
from cmmlink.plan.scan import Plan, Registration, load_plan
from cmmlink.record.reader import open_to_record
from cmmlink.record.recorder import Acknowledged, Recorder
from cmmlink.record.run_inputs import RunInputs
from drivers.codecs.ascii_frames import AsciiDecoder
from drivers.source import Arrival, Damaged, Lost, PointBatch, Rejected, ScanClosed, ScanOpened, ScanSource
from inspection import NominalProfile

TODAY = datetime(2026, 3, 14, 15, 9, 26, tzinfo=UTC)


def today() -> datetime:
    return TODAY


@cache
def small_plan() -> Plan:
    """The demonstration's plan with few samples, so that tests are quick."""
    plan = load_plan(plan_file())
    return plan.model_copy(update={"discretisation": plan.discretisation.model_copy(update={"samples": 1000})})


@cache
def plan_with_known_pose() -> Plan:
    """No registration: points off the nominal are judged all the same, whatever they are."""
    registration = Registration(datum=Datum(), fit="none", coverage_min=0.0)
    return small_plan().model_copy(update={"registration": registration})


@cache
def small_profile() -> NominalProfile:
    return profile_of(small_plan())


def decoder_of(_: object) -> AsciiDecoder:
    return AsciiDecoder()


def no_decoder(_: object) -> None:
    return None


class Script:
    """A source that yields what it is given; callables in between are called, in the acquisition thread."""

    def __init__(self, *arrivals: Arrival | Callable[[], object]) -> None:
        self._arrivals = arrivals
        self._stopped = threading.Event()

    def stop(self) -> None:
        self._stopped.set()

    def arrivals(self) -> Iterator[Arrival]:
        for arrival in self._arrivals:
            if self._stopped.is_set():
                return
            if callable(arrival):
                arrival()
            else:
                yield arrival


def scan_arrivals(count: int = 600, batch: int = 50) -> list[Arrival]:
    """Points of the small plan's part with a little of everything that can happen, in batches."""
    profile = small_profile()
    rows = np.linspace(0, len(profile.points_mm) - 1, count).astype(int)
    centres = profile.points_mm[rows] + (small_plan().probe.tip_radius_mm * profile.outward) * profile.normal[rows]
    points: NDArray[np.float64] = np.column_stack([centres, np.zeros(count)]).astype(np.float64)
    found: list[Arrival] = [ScanOpened("scripted", "T-1", count)]
    for first in range(0, count, batch):
        index = np.arange(first, min(first + batch, count))
        found += [
            PointBatch(index, (index * 1e-3).astype(np.float64), points[index]),
            Damaged(7, "checksum wrong"),
            Rejected(1, "frame repeated"),
        ]
    return [*found, Lost(3, "gap in the sequence numbers"), ScanClosed(count)]


def record(
    folder: Path,
    source: ScanSource,
    *,
    plan: Plan | None = None,
    acknowledge: Callable[[Acknowledged], None] = lambda _: None,
    before: Sequence[Sink] = (),
    stop: threading.Event | None = None,
    commit_s: float = 0.1,
) -> tuple[RunOutcome, Recorder]:
    """Carry out and record one run; `before` are sinks that hear of every event before the recorder."""
    plan = plan or small_plan()
    started = RunStarted(plan.part.name, "T-1", "operator", "scripted", True)
    live = inspection_of(plan, small_profile())
    with (
        open_to_record(folder, today) as store,
        Recorder(store, RunInputs.of(plan), clock=time.monotonic, now=today, acknowledge=acknowledge, commit_s=commit_s) as recorder,
    ):
        outcome = run_inspection(
            source,
            live,
            [*before, recorder],
            started,
            buffer_points=plan.buffer_points,
            clock=time.monotonic,
            stop=stop or threading.Event(),
        )
    return outcome, recorder
