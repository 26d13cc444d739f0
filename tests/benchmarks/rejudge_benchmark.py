"""An archive judged again: time by the number of workers, equal results whoever judges, and a killed worker.

    python -m tests.benchmarks.rejudge_benchmark [RUNS] [--cluster WORKERS] [--folder FOLDER]

RUNS (2000) recorded runs of 50,000 points of eight parts are built by recording eight and copying their records under ids of their own,
so that every hash of the chain is theirs; 1,000 need 5 GB. They are judged with a wider tolerance by this process, by one process, by
two, by two of which one is killed meanwhile, and by a Dask cluster of WORKERS (8) processes with one thread each. Of each a line is
printed, with the seconds of the processor, which a busy machine changes less, and the results are held against those of this process:
the same hash of every run, which covers every deviation.
"""

import argparse
import hashlib
import multiprocessing
import os
import shutil
import signal
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
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
    nominal, rng = write_nominal(folder / "oval.yaml"), np.random.default_rng(1)
    t = np.sort(rng.uniform(0, 2 * np.pi, POINTS))
    feet = np.column_stack([A_MM * np.cos(t), B_MM * np.sin(t)])
    normals = feet / (A_MM**2, B_MM**2)
    normals /= np.hypot(*normals.T)[:, None]
    for part in range(PARTS):
        deviation_mm = rng.normal(0, 0.002, POINTS) + 0.015 * part * np.exp(-(((t - 2) / 0.05) ** 2))
        points = write_points(folder / f"part-{part}.csv", feet + deviation_mm[:, None] * normals)
        cmmlink("inspect", points, "--nominal", nominal, "--tolerance", -0.05, 0.05, "--records", folder / "parts")
        points.unlink()
    return folder / "parts"


def build_archive(folder: Path, runs: int) -> Path:
    """An archive of so many runs: those of the eight parts over and over, each with an id of its own."""
    with Store(record_parts(folder), writing=False, epoch_s=time.time) as parts:
        originals = [str(begin.run) for begin, _ in parts.begins_and_ends()]
        with Store(folder / "archive", writing=True, epoch_s=time.time) as store:
            for number in range(runs):
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


def judged_by(file: Path, make: Callable[[], AbstractContextManager[Workers]], meanwhile: Callable[[int], None]) -> tuple[float, str, int]:
    """Seconds to judge all runs, what the workers load with their first task included; a hash of all results; how many failed."""
    with Store(file.parent, writing=False, epoch_s=time.time) as store:
        asked = [(RunAsked(str(begin.run), bytes(end.sha256).hex()), POINTS) for begin, end in store.begins_and_ends() if end is not None]
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
    assert len(found) == len(asked), (len(found), len(asked))
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


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("runs", type=int, nargs="?", default=2000)
    parser.add_argument("--cluster", type=int, default=8)
    parser.add_argument("--folder", type=Path)
    asked = parser.parse_args()
    print(machine("numpy", "scipy", "numba", "distributed"), f"Load {os.getloadavg()[0]:.1f} at the beginning.")
    folder = Path(tempfile.mkdtemp(dir=asked.folder))
    try:
        begin_s = time.perf_counter()
        file = build_archive(folder, asked.runs)
        print(f"{asked.runs} runs of {POINTS} points, {file.stat().st_size / 1e9:.2f} GB, built in {time.perf_counter() - begin_s:.0f} s")
        told = compare(file, asked.runs, asked.cluster)
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    print("all results equal" if len(told) == 1 else f"RESULTS DIFFER: {told}")


def compare(file: Path, runs: int, workers: int) -> set[str]:
    """Print a line for everybody who judges. Returns the hashes of all results that came of it."""
    ways: tuple[tuple[str, Callable[[], AbstractContextManager[Workers]], Callable[[int], None]], ...] = (
        ("this process", lambda: nullcontext(Here()), lambda _: None),
        ("1 process", lambda: Processes(1), lambda _: None),
        ("2 processes", lambda: Processes(2), lambda _: None),
        ("2 processes, one killed", lambda: Processes(2), kill_one(runs)),
        (f"Dask, {workers} processes", lambda: cluster(workers), lambda _: None),
    )
    hashes = set[str]()
    judge_runs(Task(file, SETTINGS, ()))  # what is compiled or loaded at first is there
    for name, make, meanwhile in ways:
        begin_s = _processor_s()
        seconds, told, failed = judged_by(file, make, meanwhile)
        hashes.add(told)
        spent = (
            f"{seconds:7.1f} s, {1e3 * seconds / runs:6.1f} ms a run, of the processor {1e3 * (_processor_s() - begin_s) / runs:6.1f} ms"
        )
        print(f"{name:24} {spent}; {failed} failed; results {told}", flush=True)
    return hashes


if __name__ == "__main__":
    main()
