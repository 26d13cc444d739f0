"""What a long scan takes of memory: bytes a point of a run and its end, of its check, its replay, its export, a look at it, and of a
file of as many points that is inspected, each in a process of its own.

    python -m tests.benchmarks.memory_per_point 1e6 4e6 1.6e7 3.6e7
    python -m tests.benchmarks.memory_per_point 3.6e7 inspect

A source gives batches of 1,000 points of a profile with form, noise and rows that are rejected, without a wire, as fast as they are
taken and not faster. Memory is what the process holds for itself (RssAnon of /proc/self/status, sampled every 20 ms, less what it held
before the first point); what of files is mapped into it the system may drop at any time, and is told beside it, as is the largest
resident set. On systems without /proc only the largest resident set is told.
"""

import json
import resource
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from datetime import datetime
from pathlib import Path

import numpy as np

from cmmlink.console.past_runs import PastRuns
from cmmlink.demo import plan_file
from cmmlink.devices import Connected, connect
from cmmlink.events import Arrived, Event
from cmmlink.from_plan import profile_of
from cmmlink.plan import FileDevice, Plan, load_plan
from cmmlink.record import check_chain, describe, export_run, find_run, open_to_read, recorded_run, replay_run
from cmmlink.report import write_run
from cmmlink.run import carry_out
from cmmlink.run_context import RunContext
from cmmlink.run_view import RunView
from cmmlink.scratch import Scratch
from drivers import Arrival, PointBatch, ScanClosed, ScanOpened
from inspection import NominalProfile, RigidTransform
from tests.benchmarks.machine import machine

BATCH = 1000
AHEAD = 20  # batches that wait for the run at most: a device that sends 10,000 points/s is not far ahead either
ROUND = 100_000  # points once round the profile
WAVES = ((0.006, 3), (0.004, 11))  # height in mm and number of the form's waves
STEPS = ("run", "show", "verify", "export", "replay", "inspect")


class Rounds:
    """A scan that goes round the profile again and again; every thousandth point is none."""

    def __init__(self, profile: NominalProfile, points: int, seed: int = 1) -> None:
        self._points, self._seed = points, seed
        curve = profile.curve
        u = np.linspace(*curve.domain, ROUND, endpoint=False)
        station = curve.station_mm(u) / curve.length_mm
        form = np.sum([height * np.sin(2 * np.pi * number * station) for height, number in WAVES], axis=0)
        known = profile.station_mm / curve.length_mm
        self._normal = profile.outward * np.column_stack([np.interp(station, known, n) for n in profile.normal.T])
        self._path = curve.point(u) + form[:, None] * self._normal
        self._place = RigidTransform(0.3, np.array([20.0, -7.0]))
        self._stopped, self._waiting = threading.Event(), threading.Semaphore(AHEAD)

    def take(self, event: Event) -> None:
        """Let the next batch come once one was taken: a sink of the run."""
        if isinstance(event, Arrived) and isinstance(event.arrival, PointBatch):
            self._waiting.release()

    def arrivals(self) -> Iterator[Arrival]:
        """Yield the points in batches."""
        rng = np.random.default_rng(self._seed)
        yield ScanOpened(device="rounds", serial_number="", expected=self._points)
        for first in range(0, self._points, BATCH):
            if self._stopped.is_set():
                return
            self._waiting.acquire()
            count = min(BATCH, self._points - first)
            rows = (first + np.arange(count)) % ROUND
            points = self._place.apply(self._path[rows] + rng.normal(0, 0.001, (count, 1)) * self._normal[rows])
            points[0] = np.nan
            index = np.arange(first, first + count, dtype=np.int64)
            yield PointBatch(index, index.astype(np.float64) * 1e-4, np.column_stack([points, np.zeros(count)]))
        yield ScanClosed(sent=self._points)

    def stop(self) -> None:
        """End `arrivals` before its next batch."""
        self._stopped.set()


class Memory:
    """The most that the process held for itself, and of files, while the context was entered: in each of its phases."""

    def __init__(self, phase: str) -> None:
        self.most: dict[str, tuple[int, int]] = {phase: (0, 0)}
        self.began_s = {phase: time.monotonic()}
        self._phase = phase
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._look, daemon=True)

    def begin(self, phase: str) -> None:
        """What is held from now on belongs to another phase."""
        self.most[phase], self.began_s[phase] = (0, 0), time.monotonic()
        self._phase = phase

    def __enter__(self) -> "Memory":
        self.before = held()[0]
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        self._thread.join()
        self.began_s[""] = time.monotonic()

    def _look(self) -> None:
        while not self._over.wait(0.02):
            (own, files), phase = held(), self._phase
            most = self.most[phase]
            self.most[phase] = max(most[0], own), max(most[1], files)


def held() -> tuple[int, int]:
    """Bytes of memory of the process's own, and of files that are mapped into it."""
    status = Path("/proc/self/status")
    if not status.is_file():
        return 0, 0
    lines = dict(line.split(":", 1) for line in status.read_text().splitlines())
    own, files = (int(lines[name].split()[0]) * 1024 for name in ("RssAnon", "RssFile"))
    return own, files


def now() -> datetime:
    """Date and time of day."""
    return datetime.now().astimezone()


def the_plan(records: Path) -> Plan:
    """The demonstration's plan without its ball, with its records in a folder."""
    plan = load_plan(plan_file())
    return plan.model_copy(update={"records": records, "probe": plan.probe.model_copy(update={"tip_radius_mm": 0.0})})


def acquire(points: int, folder: Path, profile: NominalProfile, plan: Plan, memory: Memory) -> str:
    """Measure so many points with everything that a run has: record, page's view, result files."""

    def note_end(event: Event) -> None:
        if isinstance(event, Arrived) and isinstance(event.arrival, ScanClosed):
            memory.begin("finish")

    view = RunView(RunContext.of(plan, profile, now(), "1", "memory"), time.monotonic, now)
    source = Rounds(profile, points)
    finished = carry_out(
        plan,
        profile,
        Connected(source, "rounds", simulated=True),
        records=folder,
        clock=time.monotonic,
        now=now,
        stop=threading.Event(),
        sinks=[view, source.take, note_end],
    )
    if points >= ROUND:
        write_run(folder / "out", finished)
    return f"{finished.outcome.counts.judged} judged, {finished.outcome.ending}, {finished.result_json()['verdict']}"


def replay(points: int, folder: Path, profile: NominalProfile, plan: Plan, memory: Memory) -> str:
    """Replay the run."""
    with open_to_read(folder, now) as store:
        again = replay_run(store, recorded_run(store, find_run(store, "last")), lambda _: None)
    return f"identical: {again.identical}"


def export(points: int, folder: Path, profile: NominalProfile, plan: Plan, memory: Memory) -> str:
    """Export the run."""
    with open_to_read(folder, now) as store:
        files = export_run(store, find_run(store, "last"), folder / "export")
    size = sum(file.stat().st_size for file in files)
    for file in files:
        file.unlink()
    return f"{len(files)} files, {size / 1e9:.2f} GB"


def show(points: int, folder: Path, profile: NominalProfile, plan: Plan, memory: Memory) -> str:
    """Look at the run, by command and on the page."""
    past = PastRuns(folder, lambda _: None, time.monotonic, now)
    with open_to_read(folder, now) as store:
        told = describe(store, find_run(store, "last"))
    opened = past.open_run("last")
    view = RunView(opened.context("last", "run"), time.monotonic, now)
    view.recall(opened.started, opened.ended)
    return f"{told['received']} received, {len(past.runs())} runs"


def verify(points: int, folder: Path, profile: NominalProfile, plan: Plan, memory: Memory) -> str:
    """Check the whole file of records."""
    with open_to_read(folder, now) as store:
        told = check_chain(store, None)
    return f"{told['records']} records, altered: {told['altered']}"


def inspect(points: int, folder: Path, profile: NominalProfile, plan: Plan, memory: Memory) -> str:
    """Inspect a text file of so many points, as `cmmlink inspect --out` does."""
    plan = plan.model_copy(update={"device": FileDevice(type="file", file=folder / "points.csv")})
    with connect(plan, Scratch(folder)) as device:
        finished = carry_out(plan, profile, device, records=folder / "of-file", clock=time.monotonic, now=now, stop=threading.Event())
    write_run(folder / "out", finished)
    return f"{finished.outcome.counts.judged} judged, {finished.outcome.ending}, {finished.result_json()['verdict']}"


def write_points(points: int, file: Path, profile: NominalProfile) -> None:
    """Write the points of a scan as text."""
    source = Rounds(profile, points)
    with file.open("wb") as text:
        text.write(b"x,y,z\r\n")
        for arrival in source.arrivals():
            if isinstance(arrival, PointBatch):
                text.write(b"\r\n".join(b"%.6f,%.6f,%.6f" % tuple(row) for row in arrival.points_mm.tolist()) + b"\r\n")
                source.take(Arrived(0.0, arrival))


STEP_OF: dict[str, Callable[[int, Path, NominalProfile, Plan, Memory], str]] = dict(
    zip(STEPS, (acquire, show, verify, export, replay, inspect), strict=True)
)


def measure(step: str, points: int, folder: Path) -> list[dict[str, object]]:
    """Do one step and say what its phases took."""
    plan = the_plan(folder)
    profile = profile_of(plan)
    with tempfile.TemporaryDirectory() as small:  # everything is compiled and loaded before the memory is looked at
        write_points(20_000, Path(small) / "points.csv", profile)
        for name in STEPS:
            STEP_OF[name](20_000, Path(small), profile, plan, Memory(name))
    if step == "inspect":
        write_points(points, folder / "points.csv", profile)
    with Memory(step) as memory:
        said = STEP_OF[step](points, folder, profile, plan, memory)
    phases, began_s = list(memory.most), list(memory.began_s.values())
    return [
        {
            "phase": phase,
            "own": memory.most[phase][0] - memory.before,
            "files": memory.most[phase][1],
            "resident": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024,
            "seconds": began_s[at + 1] - began_s[at],
            "said": said,
        }
        for at, phase in enumerate(phases)
    ]


def main(words: list[str]) -> None:
    """Print a table with a row for every number of points and every step, or those steps that the words name."""
    steps = [word for word in words if word in STEPS] or STEPS
    print(machine("numpy", "numba"))
    print("| points | step | own memory, MB | bytes a point | files mapped, MB | largest resident set, MB | seconds | |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- |")
    for points in (int(float(word)) for word in words if word not in STEPS):
        with tempfile.TemporaryDirectory() as folder:
            for step in steps:
                told = subprocess.run(
                    [sys.executable, "-m", __spec__.name, "--step", step, str(points), folder], check=True, capture_output=True, text=True
                )
                for found in json.loads(told.stdout.splitlines()[-1]):
                    megabytes = [f"{found[name] / 1e6:.0f}" for name in ("own", "files", "resident")]
                    a_point, told_of = found["own"] / points, f"{found['seconds']:.0f} | {found['said']}"
                    print(
                        f"| {points:,} | {found['phase']} | {megabytes[0]} | {a_point:.1f} | {' | '.join(megabytes[1:])} | {told_of} |",
                        flush=True,
                    )


if __name__ == "__main__":
    if sys.argv[1] == "--step":
        print(json.dumps(measure(sys.argv[2], int(sys.argv[3]), Path(sys.argv[4]))))
    else:
        main(sys.argv[1:])
