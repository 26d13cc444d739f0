"""The proof beside a run: found in a thread of its own, told once, in nobody's way, and over when the run is."""

import itertools
import threading
from collections.abc import Callable, Iterator

import numpy as np
import pytest
from numpy.typing import NDArray

from cmmlink.events import Event, Judged, ProvenOut, RunFinished, RunStarted
from cmmlink.live_proof import LiveProof
from cmmlink.pipeline import RunOutcome, run_inspection
from drivers.source import Arrival, PointBatch, ScanClosed, ScanOpened
from inspection import LiveInspection, Prefix, PrefixSearch, ToleranceZone, Verdict
from tests.inspection.live_scans import ZONE, LiveScan, live_scan
from tests.inspection.reference_parts import nominal_of
from tests.inspection.test_placements import dented

PATIENCE_S = 60.0


def proof_threads() -> list[str]:
    return [thread.name for thread in threading.enumerate() if thread.name == "proof"]


def batches(points: NDArray[np.float64], size: int) -> Iterator[PointBatch]:
    for first in range(0, len(points), size):
        rows = np.arange(first, min(first + size, len(points)))
        yield PointBatch(rows, np.asarray(rows * 1e-3), np.column_stack([points[rows], np.zeros(len(rows))]))


class Waiting:
    """A source whose scan stands still after so many points, until its proof was told, or until `goes_on` is set."""

    def __init__(self, points: NDArray[np.float64], stands_at: int) -> None:
        self._points, self._stands_at = points, stands_at
        self.goes_on = threading.Event()

    def arrivals(self) -> Iterator[Arrival]:
        yield ScanOpened("list", "1", len(self._points))
        yield from batches(self._points[: self._stands_at], 20)
        assert self.goes_on.wait(PATIENCE_S)
        yield from batches(self._points[self._stands_at :], 20)
        yield ScanClosed(len(self._points))

    def stop(self) -> None:
        self.goes_on.set()


def carried_out(given: LiveScan, zone: ToleranceZone, stands_at: int, proof_opens: bool) -> tuple[RunOutcome, list[Event]]:
    """A run of a scan that stands still until its proof is told, where one is expected, and else until all points are judged."""
    source, heard = Waiting(given.points_mm, stands_at), list[Event]()

    def hear(event: Event) -> None:
        heard.append(event)
        is_awaited = isinstance(event, ProvenOut) if proof_opens else isinstance(event, Judged) and event.update.stop == stands_at
        if is_awaited:
            source.goes_on.set()

    ticks = itertools.count()
    outcome = run_inspection(
        source,
        LiveInspection(given.nominal, zone),
        [hear],
        RunStarted("blade", "1", "", "a list", False),
        buffer_points=10_000,
        clock=lambda: float(next(ticks)),
        stop=threading.Event(),
    )
    assert not proof_threads()
    return outcome, heard


@pytest.mark.parametrize("name", ["goe404", "mh42"])
def test_a_run_tells_its_proof_once_and_ends_with_the_verdict_it_has_without(name: str) -> None:
    given, zone = LiveScan(nominal_of(name), dented(name)), ToleranceZone(-0.05, 0.05)
    outcome, heard = carried_out(given, zone, stands_at=300, proof_opens=True)
    told = [event for event in heard if isinstance(event, ProvenOut)]
    assert len(told) == 1
    assert 240 <= told[0].points <= 300, "at 220 points there still is a placement"
    alone = LiveInspection(given.nominal, zone)
    alone.add(given.points_mm)
    expected = alone.finish()
    assert outcome.result is not None
    assert outcome.result.verdict == expected.verdict == Verdict.NONCONFORM
    assert np.array_equal(outcome.result.deviation_mm, expected.deviation_mm)
    assert isinstance(heard[-1], RunFinished)


def test_a_good_part_is_told_nothing_of_and_no_thread_is_begun() -> None:
    outcome, heard = carried_out(live_scan("noise only", 2), ZONE, stands_at=600, proof_opens=False)
    assert outcome.result is not None
    assert not [event for event in heard if isinstance(event, ProvenOut)]


def test_the_run_does_not_wait_for_the_search_and_the_newest_points_are_looked_at_next(monkeypatch: pytest.MonkeyPatch) -> None:
    given, looked_at = live_scan("dent", 1), list[int]()
    entered, goes_on = threading.Event(), threading.Event()

    def slow(_search: PrefixSearch, prefix: Prefix, _is_over: object) -> bool:
        looked_at.append(prefix.received)
        entered.set()
        assert goes_on.wait(PATIENCE_S)
        return len(looked_at) == 2

    monkeypatch.setattr(PrefixSearch, "refutes", slow)
    live = LiveInspection(given.nominal, ZONE)
    with LiveProof(live) as proof:
        live.add(given.points_mm[:700])
        proof.offer()
        assert entered.wait(PATIENCE_S)
        for first in range(700, 800, 25):
            live.add(given.points_mm[first : first + 25])
            proof.offer()  # returns, although the search has not
        assert (looked_at, proof.refuted) == ([700], None)
        goes_on.set()
        proof._beside.join(PATIENCE_S)
        assert looked_at == [700, 800], "what waited was replaced by what is newer"
        assert proof.refuted == 800
    assert not proof_threads()


def test_the_end_of_a_run_ends_a_search_that_does_not_know_yet(monkeypatch: pytest.MonkeyPatch) -> None:
    given, entered = live_scan("dent", 1), threading.Event()

    def endless(_search: PrefixSearch, _prefix: Prefix, is_over: Callable[[], bool]) -> bool:
        entered.set()
        while not is_over():
            threading.Event().wait(0.001)
        return False

    monkeypatch.setattr(PrefixSearch, "refutes", endless)
    live = LiveInspection(given.nominal, ZONE)
    with LiveProof(live) as proof:
        live.add(given.points_mm)
        proof.offer()
        assert entered.wait(PATIENCE_S)
    assert not proof_threads()
    assert proof.refuted is None
