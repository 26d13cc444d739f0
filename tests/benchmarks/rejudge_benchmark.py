"""An archive judged again: time by the number of workers, equal results whoever judges, and a killed worker.

    python -m tests.benchmarks.rejudge_benchmark [RUNS] [--folder FOLDER] [--ways WAY ...] [--cluster WORKERS] [--anew]

RUNS (2000) recorded runs of 50,000 points of eight parts are built by recording eight and copying their records under ids of their own,
so that every hash of the chain is theirs; 1,000 need 5 GB. They are judged with a wider tolerance by this process, by one process, by
two, by two of which one is killed meanwhile, and by a Dask cluster of WORKERS (8) processes with one thread each, or by those of them
that --ways names; `--ways none` only builds. In the end a table has a row for each, with the seconds of the processor, which a busy
machine changes less, and the results are held against one another: the same hash of every run, which covers every deviation.

FOLDER keeps the archive and what was measured, and the same command goes on where it was interrupted: runs that are there are not built
again, and ways that were measured are only printed, unless --anew is given. Without it all is in a temporary folder.
"""

import argparse
import hashlib
import json
import multiprocessing
import os
import shutil
import signal
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from distributed import LocalCluster

from cmmlink.archive import Cluster, Here, Outcome, Processes, Task, Workers, judge_all, judge_runs
from cmmlink.archive.tasks import RunAsked, tasks_of
from cmmlink.record.bodies import pack_document, unpack_document
from cmmlink.record.chain import Record
from cmmlink.record.store import Store
from tests.benchmarks.machine import machine
from tests.cmmlink.command import cmmlink
from tests.cmmlink.oval_part import A_MM, B_MM, write_nominal, write_points

POINTS = 50_000
PARTS = 8
SETTINGS = {"tolerance.upper_mm": "0.08"}


def record_parts(folder: Path) -> Path:
    """Records of eight parts of 50,000 points with a little noise, whose bumps lie on both sides of both tolerances."""
    parts = folder / "parts"
    if parts.is_dir():
        with Store(parts, writing=False, epoch_s=time.time) as store:
            if sum(end is not None for _, end in store.begins_and_ends()) == PARTS:
                return parts
        shutil.rmtree(parts)
    nominal, rng = write_nominal(folder / "oval.yaml"), np.random.default_rng(1)
    t = np.sort(rng.uniform(0, 2 * np.pi, POINTS))
    feet = np.column_stack([A_MM * np.cos(t), B_MM * np.sin(t)])
    normals = feet / (A_MM**2, B_MM**2)
    normals /= np.hypot(*normals.T)[:, None]
    for part in range(PARTS):
        deviation_mm = rng.normal(0, 0.002, POINTS) + 0.015 * part * np.exp(-(((t - 2) / 0.05) ** 2))
        points = write_points(folder / f"part-{part}.csv", feet + deviation_mm[:, None] * normals)
        cmmlink("inspect", points, "--nominal", nominal, "--tolerance", -0.05, 0.05, "--records", parts)
        points.unlink()
    return parts


def build_archive(folder: Path, runs: int) -> Path:
    """An archive of so many runs: those of the eight parts over and over, each with an id of its own; those that are there are kept."""
    with Store(record_parts(folder), writing=False, epoch_s=time.time) as parts:
        originals = [str(begin.run) for begin, _ in parts.begins_and_ends()]
        with Store(folder / "archive", writing=True, epoch_s=time.time) as store:
            for number in range(store.count_runs(), runs):
                store.adopt(_under_id(parts, originals[number % PARTS], f"20260314-150926-{number + 1:04d}"))
        return store.path


def _under_id(parts: Store, original: str, run: str) -> Iterator[Record]:
    for record in parts.records(original):
        body = record.body
        if record.kind == "signature":
            continue
        if record.kind == "run":
            body = pack_document(unpack_document(body) | {"run": run})
        yield Record(0, run, record.kind, record.time_s, record.count, body, 0, b"")


def judged_by(
    file: Path, runs: int, make: Callable[[], AbstractContextManager[Workers]], meanwhile: Callable[[int], None]
) -> tuple[float, str, int]:
    """Seconds to judge so many runs, what the workers load with their first task included; a hash of all results; how many failed."""
    with Store(file.parent, writing=False, epoch_s=time.time) as store:
        ends = ((str(begin.run), end) for begin, end in store.begins_and_ends()[:runs])
        asked = [(RunAsked(run, bytes(end.sha256).hex()), POINTS) for run, end in ends if end is not None]
    found = dict[str, str]()

    def take(outcomes: list[Outcome]) -> None:
        for one in outcomes:
            assert one.run not in found, one.run
            found[one.run] = one.judgement.result_sha256 if one.judgement is not None else f"failed {one.failure}"
        meanwhile(len(found))

    with make() as workers:
        begin_s = time.perf_counter()
        judge_all(tasks_of(file, SETTINGS, asked, workers.places), workers, take, threading.Event(), judge_runs)
        seconds = time.perf_counter() - begin_s
    assert len(found) == len(asked) == runs, (len(found), len(asked), runs)
    told = "\n".join(f"{run} {sha256}" for run, sha256 in sorted(found.items()))
    return seconds, hashlib.sha256(told.encode()).hexdigest()[:12], sum(sha256.startswith("failed") for sha256 in found.values())


@contextmanager
def cluster(workers: int) -> Iterator[Workers]:
    """A cluster of processes with one thread each on this computer."""
    local = LocalCluster(n_workers=workers, threads_per_worker=1, dashboard_address=None)  # type: ignore[no-untyped-call]
    with local, Cluster(local.scheduler_address) as found:
        yield found


def _processor_s() -> float:
    """Seconds of the processor of this process and of those that it has ended, which have begun with it: also what they loaded."""
    return sum(os.times()[:4])


def kill_one(runs: int) -> Callable[[int], None]:
    """Kill a worker once, when a third of the runs is done."""
    killed = list[int]()

    def look(done: int) -> None:
        if not killed and done >= runs // 3:
            worker = next(child for child in multiprocessing.active_children() if child.pid)
            killed.append(worker.pid or 0)
            os.kill(killed[0], signal.SIGKILL)

    return look


WAYS: dict[str, tuple[str, Callable[[int], AbstractContextManager[Workers]], Callable[[int], Callable[[int], None]]]] = {
    "here": ("this process", lambda _: nullcontext(Here()), lambda _: lambda _: None),
    "1": ("1 process", lambda _: Processes(1), lambda _: lambda _: None),
    "2": ("2 processes", lambda _: Processes(2), lambda _: lambda _: None),
    "killed": ("2 processes, one killed", lambda _: Processes(2), kill_one),
    "dask": ("Dask, {} processes", cluster, lambda _: lambda _: None),
}
"""By its word on the command line: what a way is called, its workers by the size of a cluster, and what happens meanwhile, by the runs."""


@dataclass(frozen=True, slots=True)
class Measured:
    """What a way took for a number of runs, and a hash of all its results; the machine's load is that at its beginning."""

    way: str
    name: str
    runs: int
    when: str
    load: float
    seconds: float
    processor_s: float
    failed: int
    results: str

    def row(self) -> str:
        each = f"{1e3 * self.seconds / self.runs:.1f} | {1e3 * self.processor_s / self.runs:.1f}"
        return f"| {self.name} | {self.seconds:.1f} | {each} | {self.failed} | {self.results} | {self.when}, {self.load:.1f} |"


def measure(file: Path, way: str, runs: int, workers: int) -> Measured:
    name, make, meanwhile = WAYS[way]
    load, when, begin_s = os.getloadavg()[0], time.strftime("%Y-%m-%d %H:%M"), _processor_s()
    seconds, results, failed = judged_by(file, runs, lambda: make(workers), meanwhile(runs))
    return Measured(way, name.format(workers), runs, when, load, seconds, _processor_s() - begin_s, failed, results)


def kept(file: Path) -> list[Measured]:
    """What was measured before, a line each."""
    lines = file.read_text(encoding="utf-8").splitlines() if file.is_file() else []
    return [Measured(**json.loads(line)) for line in lines]


def compare(folder: Path, file: Path, asked: argparse.Namespace) -> list[Measured]:
    """Every way that is asked for, taken from the folder where it was measured there with as many runs."""
    notes = folder / "measured.jsonl"
    before = {one.name: one for one in kept(notes) if one.runs == asked.runs and not asked.anew}
    judge_runs(Task(file, SETTINGS, ()))  # what is compiled or loaded at first is there
    found = list[Measured]()
    for way in asked.ways:
        one = before.get(WAYS[way][0].format(asked.cluster))
        if one is None:
            print(f"{WAYS[way][0].format(asked.cluster)} ...", file=sys.stderr, flush=True)
            one = measure(file, way, asked.runs, asked.cluster)
            with notes.open("a", encoding="utf-8") as kept_in:
                kept_in.write(json.dumps(asdict(one)) + "\n")
        found.append(one)
    return found


def options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", type=int, nargs="?", default=2000)
    parser.add_argument("--folder", type=Path, help="keeps the archive and what was measured; a temporary one if not given")
    parser.add_argument("--ways", nargs="+", choices=[*WAYS, "none"], default=list(WAYS))
    parser.add_argument("--cluster", type=int, default=8, metavar="WORKERS")
    parser.add_argument("--anew", action="store_true", help="measure what was measured before")
    asked = parser.parse_args()
    asked.ways = [way for way in asked.ways if way != "none"]
    return asked


def main() -> None:
    asked = options()
    if asked.folder is not None:
        asked.folder.mkdir(parents=True, exist_ok=True)
        run(asked.folder, asked)
        return
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        run(Path(folder), asked)


def run(folder: Path, asked: argparse.Namespace) -> None:
    begin_s = time.perf_counter()
    file = build_archive(folder, asked.runs)
    built_s = time.perf_counter() - begin_s
    found = compare(folder, file, asked)
    print(machine("numpy", "scipy", "numba", "distributed"))
    print(f"{asked.runs:,} runs of {POINTS:,} points, {file.stat().st_size / 1e9:.2f} GB; built or found in {built_s:.0f} s")
    if found:
        print("\n| who judges | s | ms a run | of the processor | failed | results | begun, load |\n|---|---|---|---|---|---|---|")
        print(*(one.row() for one in found), sep="\n")
        print("\nall results equal" if len({one.results for one in found}) == 1 else "\nRESULTS DIFFER")


if __name__ == "__main__":
    main()
