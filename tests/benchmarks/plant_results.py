"""The results database under strain: a server that is killed while runs are pushed, and the questions that are asked of 100,000 runs.

    python -m tests.benchmarks.plant_results [RUNS STORED]

1. So many runs are measured and recorded while `cmmlink plant push --stay` pushes to a PostgreSQL server that is killed
   with -9 and started again twenty times meanwhile. In the end every run has to be in the database once, as its record has it. While every
   other run is measured the pusher is held: where it works no batch of points may wait for its verdict by 10 ms longer than where it is
   held, of all batches by their median, and by the longest of 90 and of 99 %. How long a run takes to end is told, too.
2. So many runs of ten characteristics are stored, of ten parts, the first of which has half of them; then series, strips and searches are
   asked for.
"""

import multiprocessing
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from datetime import UTC, datetime, timedelta
from itertools import pairwise
from pathlib import Path

import numpy as np

from cmmlink.events import Event, Judged
from cmmlink.plant import STRIP_PARTS, ProfileStrip, ResultsDatabase, StoredRun, StoredValue
from cmmlink.plant_push import keep_address, outbox_of, verify_plant
from tests.benchmarks.machine import machine
from tests.cmmlink.plant.postgres import PostgresServer
from tests.cmmlink.recorded import Script, record, scan_arrivals

KILLS, BATCH_S, DOWN_S = 20, 0.01, 0.3
PARTS, CHARACTERISTICS, AT_ONCE = 10, 10, 500
MOST_DELAY_S, MOST_ANSWER_S = 0.010, 0.3


class Waits:
    """A sink that notes how long the newest point of every batch had waited for its verdict."""

    def __init__(self) -> None:
        self.age_s = list[float]()
        self.end_s = list[float]()

    def __call__(self, event: Event) -> None:
        if isinstance(event, Judged):
            self.age_s.append(event.age_s)

    def measure(self, folder: Path) -> None:
        """Measure and record one run, whose points come a batch every few milliseconds."""
        last = [0.0]

        def pause() -> None:
            time.sleep(BATCH_S)
            last[0] = time.perf_counter()

        paced = [one for arrival in scan_arrivals(1200, 50) for one in (arrival, pause)]
        record(folder, Script(*paced), before=[self])
        self.end_s.append(time.perf_counter() - last[0])

    def words(self) -> str:
        ages = 1e3 * np.sort(self.age_s)
        places = ", ".join(
            f"{name} {ages[int(share * (len(ages) - 1))]:.2f}" for name, share in (("median", 0.5), ("99 %", 0.99), ("most", 1))
        )
        return f"{len(ages)} batches waited, ms: {places}; a run ended within {1e3 * statistics.median(self.end_s):.0f} ms (median)"


def killed_server(runs: int) -> bool:
    """The first part. Returns whether all went as it has to."""
    server = PostgresServer(quick=False)
    with tempfile.TemporaryDirectory() as folder:
        records, progress = Path(folder) / "records", Path(folder) / "progress"
        keep_address(records, server.address)
        progress.write_text("0")
        command = [sys.executable, "-m", "cmmlink", "plant", "push", "--stay", "--records", str(records)]
        killing = multiprocessing.get_context("fork").Process(
            target=kill_in_turn, args=(server, progress, runs)
        )  # not in the scan's process
        killing.start()
        with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as child:
            beside, held = Waits(), Waits()
            Waits().measure(Path(folder) / "before")  # whose first points wait for what has to be loaded or compiled
            for run in range(runs):
                if killing.exitcode:
                    break
                child.send_signal(signal.SIGSTOP if run % 2 else signal.SIGCONT)
                (held if run % 2 else beside).measure(records)
                progress.write_text(str(run + 1))
            child.send_signal(signal.SIGCONT)
            killing.join()
            told = until_all_is_pushed(child, records)
        found = verify_plant(records, lambda: datetime.now().astimezone())
        counted = server.query("SELECT count(*), count(DISTINCT run) FROM run")
    server.close()
    print(
        f"server killed {KILLS} times during {runs} runs: {told} answers of the pusher; rows and runs in the database {counted};", end=" "
    )
    print(f"{found.agree} of {found.runs} agree with their record")
    print(f"  while the pusher works: {beside.words()}\n  while it is held:       {held.words()}")
    delay_s = [float(np.quantile(beside.age_s, share) - np.quantile(held.age_s, share)) for share in (0.5, 0.9, 0.99)]
    print("  longer while it works, ms: " + ", ".join(f"{1e3 * one:+.2f}" for one in delay_s) + " (median, 90 %, 99 % of the batches)")
    return killing.exitcode == 0 and found.sound and counted == f"{runs}|{runs}" and max(delay_s) < MOST_DELAY_S


def kill_in_turn(server: PostgresServer, progress: Path, runs: int) -> None:
    """Kill the server twenty times while runs are measured, and start it again a moment later."""
    for kill in range(KILLS):
        while int(progress.read_text() or 0) < (kill + 0.5) * runs / KILLS:
            time.sleep(0.05)
        server.kill()
        time.sleep(DOWN_S)
        server.start()


def until_all_is_pushed(child: "subprocess.Popen[str]", records: Path) -> int:
    """Wait until nothing waits to be pushed any more, and end the pusher. Returns how often it told something."""
    assert child.stdout is not None
    assert child.stdin is not None
    while outbox_of(records, lambda: datetime.now().astimezone()).waiting:
        time.sleep(0.5)
    child.stdin.close()
    return len(child.stdout.readlines())


def stored_runs(count: int) -> Iterator[StoredRun]:
    """Runs of ten characteristics, made up, one a minute."""
    rng = np.random.default_rng(11)
    began = datetime(2026, 1, 1, tzinfo=UTC)
    zone = np.linspace(-0.02, 0.02, STRIP_PARTS, dtype=np.float32)
    for k in range(count):
        number = k // 2 % (PARTS - 1) + 1 if k % 2 else 0
        values = tuple(
            StoredValue(f"characteristic {place}", "chord", "mm", value, 59.9 + place, 60.1 + place, 0.004, "conform")
            for place, value in enumerate(rng.normal(np.arange(60, 60 + CHARACTERISTICS), 0.01).tolist())
        )
        strip = ProfileStrip(205.0, -0.05, 0.05, zone + np.float32(rng.normal(0, 0.005)), zone)
        yield StoredRun(
            f"hall-{k % 40}", f"20260101-{k:06d}", f"part {number}", "", f"SN-{k}", "Ada", began + timedelta(minutes=k), "complete",
            "conform", "cmmlink", f"{k:064x}", "1" * 64, "2" * 64, 50_000, 50_000, 0, 0, 0, False, values, strip,
        )  # fmt: skip


def questions(count: int) -> bool:
    """The second part. Returns whether every answer came in time."""
    server = PostgresServer(quick=False)
    began_s, waiting = time.perf_counter(), list[StoredRun]()
    with ResultsDatabase(server.address) as database:
        for run in stored_runs(count):
            waiting.append(run)
            if len(waiting) == AT_ONCE:
                database.add_runs(waiting)
                waiting.clear()
        if waiting:
            database.add_runs(waiting)
    print(f"{count} runs of {CHARACTERISTICS} characteristics stored in {time.perf_counter() - began_s:.0f} s, {AT_ONCE} a transaction")
    server.query("ANALYZE")
    asked: dict[str, Callable[[ResultsDatabase], object]] = {
        "parts": lambda one: one.parts(),
        "characteristics of a part": lambda one: one.characteristics("part 1"),
        "series of one characteristic, the last 500": lambda one: one.series("part 0", "characteristic 3", last=500),
        f"series of one characteristic, all {count // 2 // (PARTS - 1)} of a part": lambda one: one.series("part 1", "characteristic 3"),
        f"series of one characteristic, all {count // 2} of a part": lambda one: one.series("part 0", "characteristic 3"),
        "strips of the last 60": lambda one: one.strips("part 0"),
        "search by part and month, the newest 1,000": lambda one: one.search(part="part 0", month="2026-02"),
        "search by serial number": lambda one: one.search(serial_number="SN-4711"),
    }
    most_s = 0.0
    with ResultsDatabase(server.address) as database:
        for what, ask in asked.items():
            moments = [time.perf_counter()]
            for _ in range(7):
                ask(database)
                moments.append(time.perf_counter())
            took_s = [after - before for before, after in pairwise(moments)]
            most_s = max(most_s, statistics.median(took_s) if ", all " not in what else 0.0)  # the page draws 500 at most
            print(f"  {what}: {statistics.median(took_s):.4f} s (first {took_s[0]:.4f}, most {max(took_s):.4f})")
    began_s = time.perf_counter()
    with ResultsDatabase(server.address) as database:
        database.series("part 0", "characteristic 3", last=500)
    print(f"  the same series with a connection of its own: {time.perf_counter() - began_s:.4f} s")
    server.close()
    return most_s < MOST_ANSWER_S


if __name__ == "__main__":
    print(machine("sqlalchemy", "psycopg", "numpy"))
    runs, stored = [int(word) for word in sys.argv[1:]] or (200, 100_000)
    sound = [part(count) for part, count in ((killed_server, runs), (questions, stored)) if count]
    sys.exit(not all(sound))
