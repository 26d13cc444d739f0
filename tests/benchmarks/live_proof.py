"""The proof in mid-scan over many simulated scans: false proofs, proofs found, how long one look takes, and what it costs the run.

    python -m tests.benchmarks.live_proof [SEEDS]

A look works in slices, between which whoever shares the interpreter with it is let through; their times are processor times.

Good scans are never proven out, or this fails. Scans with a dent, a step or late form are proven out where their result is NOT
CONFORM, sooner or later; where the part passes in the end they never are. Last comes a run at 10,000 points/s whose scan has a
step and no datum, with the search beside it and without: from the moment a batch is read to its verdict event.
"""

import sys
import threading
import time
from collections.abc import Iterator
from unittest.mock import patch

import numpy as np

from cmmlink.events import Event, Judged, ProvenOut, RunStarted
from cmmlink.live_proof import LiveProof
from cmmlink.pipeline import run_inspection
from drivers import Arrival, PointBatch
from inspection import LiveInspection, Verdict
from tests.inspection.live_scans import KINDS, ZONE, Kind, LiveScan, live_scan

EVERY = 25
RATE_HZ, POINTS, BATCH = 10_000, 30_000, 50


class Slices:
    """The milliseconds of processor time between two questions of a search whether it shall end."""

    def __init__(self) -> None:
        self.took_ms: list[float] = []
        self.begin()

    def begin(self) -> None:
        self._since_s = time.thread_time()

    def is_over(self) -> bool:
        now_s = time.thread_time()
        self.took_ms.append(1e3 * (now_s - self._since_s))
        self._since_s = now_s
        return False


def ask(given: LiveScan, slices: Slices) -> tuple[int | None, Verdict, list[float]]:
    """After how many points a scan is proven out, its verdict, and the milliseconds of every look."""
    live = LiveInspection(given.nominal, ZONE)
    search, proven, looks = live.prefix_search(), None, []
    for first in range(0, len(given.points_mm), EVERY):
        live.add(given.points_mm[first : first + EVERY])
        prefix = live.prefix() if proven is None else None
        if prefix is not None:
            began = time.perf_counter()
            slices.begin()
            proven = prefix.received if search.refutes(prefix, slices.is_over) else None
            looks.append(1e3 * (time.perf_counter() - began))
    return proven, live.finish().verdict, looks


def report_kind(kind: Kind, seeds: int, slices: Slices) -> list[float]:
    """Print the counts of one kind and return the milliseconds of its looks. Raises AssertionError for a false proof."""
    outcomes = [ask(live_scan(kind, seed), slices) for seed in range(seeds)]
    false = [proven for proven, verdict, _ in outcomes if proven is not None and verdict != Verdict.NONCONFORM]
    failed = sum(verdict == Verdict.NONCONFORM for _, verdict, _ in outcomes)
    found = sorted(proven for proven, _, _ in outcomes if proven is not None)
    at = f", after {np.median(found):.0f} points (median)" if found else ""
    sys.stdout.write(f"{kind:11} {seeds} scans, {failed} NOT CONFORM, {len(found)} of them proven on the way{at}; {len(false)} false\n")
    assert not false, f"{kind}: proven out, and not NOT CONFORM in the end"
    return [look for _, _, looks in outcomes for look in looks]


class Paced:
    """A source that gives the points of a scan when they are due."""

    def __init__(self, given: LiveScan) -> None:
        self._given, self._stopped = given, threading.Event()

    def arrivals(self) -> Iterator[Arrival]:
        began = time.monotonic()
        for first in range(0, POINTS, BATCH):
            rows = np.arange(first, first + BATCH)
            time.sleep(max(0.0, began + first / RATE_HZ - time.monotonic()))
            yield PointBatch(rows, np.asarray(rows / RATE_HZ), np.column_stack([self._given.points_mm[rows], np.zeros(BATCH)]))

    def stop(self) -> None:
        self._stopped.set()


def ages_ms(given: LiveScan) -> tuple[list[float], int | None]:
    """How long the newest point of every batch waited for its verdict, and after how many points the proof came."""
    ages, proven = list[float](), list[int]()

    def note(event: Event) -> None:
        if isinstance(event, Judged):
            ages.append(1e3 * event.age_s)
        elif isinstance(event, ProvenOut):
            proven.append(event.points)

    live, started = LiveInspection(given.nominal, ZONE), RunStarted("benchmark", "", "", "list", simulated=True)
    run_inspection(Paced(given), live, [note], started, buffer_points=500_000, clock=time.monotonic, stop=threading.Event())
    return ages[len(ages) // 10 :], proven[0] if proven else None


def main(seeds: int) -> None:
    slices = Slices()
    looks = [look for kind in KINDS for look in report_kind(kind, seeds, slices)]
    for what, took_ms in (("look", looks), ("slice", slices.took_ms)):
        p50, p99, most = np.percentile(took_ms, [50, 99, 100])
        sys.stdout.write(f"one {what}: median {p50:.1f} ms, p99 {p99:.1f} ms, at most {most:.1f} ms; {len(took_ms)}\n")
    for words, patched in (("with the search", LiveProof.offer), ("without", lambda _: None)):
        with patch.object(LiveProof, "offer", patched):
            ages, proven = ages_ms(live_scan("step", 1, POINTS))
        p50, p99, most = np.percentile(ages, [50, 99, 100])
        sys.stdout.write(f"{words:16} {RATE_HZ} points/s   p50 {p50:7.2f}   p99 {p99:7.2f}   largest {most:7.2f} ms; proven: {proven}\n")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 200)
