"""What recording costs: share of a core and commit times, at 10,000 and 100,000 points/s with their wire bytes.

`python -m tests.benchmarks.record_benchmark [SECONDS] [FOLDER]`. A run of SECONDS is handed to the recorder at the pace of a
scan, in reads of a millisecond; the processor time of the same paced loop with a sink that does nothing is taken off. Both
numbers of processor time are those of the whole process, writer thread included. The folder should be on the disk that will
keep the records: commits wait for it.
"""

import platform
import sqlite3
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from cmmlink.events import Arrived, Counts, Event, RunFinished, RunStarted
from cmmlink.record.chain import Draft, Record
from cmmlink.record.reader import open_to_record
from cmmlink.record.recorder import Recorder
from cmmlink.record.run_inputs import RunInputs
from cmmlink.record.store import Store
from drivers.source import PointBatch, WireBytes
from tests.cmmlink.recorded import today

TICK_S = 0.001
LINE_BYTES = 54  # of one point in the ASCII line format


class TimedStore:
    """A store that notes how long every commit took."""

    def __init__(self, store: Store) -> None:
        self._store, self.commits_s = store, list[float]()

    def append(self, drafts: list[Draft], *behind: Callable[[Record], Sequence[Draft]]) -> list[Record]:
        begin = time.perf_counter()
        try:
            return self._store.append(drafts, *behind)
        finally:
            self.commits_s.append(time.perf_counter() - begin)

    def begins_and_ends(self) -> list[tuple[Record, Record | None]]:
        return self._store.begins_and_ends()


def paced(sink: Callable[[Event], None], rate_hz: float, seconds: float) -> float:
    """Hand a scan to a sink at its pace; gives the processor seconds of the process."""
    count = round(rate_hz * TICK_S)
    index = np.arange(count)
    points = np.random.default_rng(1).normal(size=(count, 3))
    data = np.random.default_rng(1).bytes(count * LINE_BYTES)
    begin_s, begin_cpu_s = time.perf_counter(), time.process_time()
    for tick in range(round(seconds / TICK_S)):
        due_s = begin_s + tick * TICK_S
        while time.perf_counter() < due_s:
            time.sleep(TICK_S / 4)
        now_s = time.perf_counter()
        sink(Arrived(now_s, WireBytes(now_s, data)))
        sink(Arrived(now_s, PointBatch(index + tick * count, (index + tick * count) / rate_hz, points.copy())))
    return time.process_time() - begin_cpu_s


def measure(rate_hz: float, seconds: float, folder: Path) -> None:
    """Print what recording at this rate costs."""
    with open_to_record(folder, today) as store:
        timed = TimedStore(store)
        basis = RunInputs("plan", "nominal", b"", {})
        recorder = Recorder(timed, basis, clock=time.perf_counter, now=today)  # type: ignore[arg-type]
        recorder(RunStarted("part", "", "", "benchmark", True))
        timed.commits_s.clear()
        begin_cpu_s = time.process_time()
        paced(recorder, rate_hz, seconds)
        commits_ms = 1e3 * np.array(timed.commits_s)
        recorder(RunFinished("complete", None, Counts(), ""))
        used_s = time.process_time() - begin_cpu_s
        totals = store.totals(recorder.run)
    idle_s = paced(lambda _: None, rate_hz, seconds)
    assert totals["points"][1] == round(rate_hz * seconds), "points were dropped"
    size = (folder / "station.sqlite").stat().st_size
    p50, p99, worst = np.percentile(commits_ms, [50, 99, 100])
    print(
        f"{rate_hz:9,.0f} points/s for {seconds:g} s: {100 * (used_s - idle_s) / seconds:5.2f} % of a core; "
        f"{len(commits_ms)} commits, p50 {p50:.2f} ms, p99 {p99:.2f} ms, longest {worst:.2f} ms; file {size / 1e6:.1f} MB"
    )


def main() -> None:
    """Measure at both rates."""
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 10.0
    print(f"{platform.machine()}, {platform.system()}, Python {platform.python_version()}, SQLite {sqlite3.sqlite_version}")
    for rate_hz in (10_000.0, 100_000.0):
        with tempfile.TemporaryDirectory(dir=sys.argv[2] if len(sys.argv) > 2 else None) as folder:
            measure(rate_hz, seconds, Path(folder))


if __name__ == "__main__":
    main()
