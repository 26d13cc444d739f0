"""The characteristics beside a run: told while it goes on, in nobody's way, and over when the run is."""

import itertools
import threading
from collections.abc import Callable

import numpy as np
import pytest

from cmmlink.events import Evaluated, Event, Judged, RunFinished, RunStarted
from cmmlink.live_characteristics import LiveCharacteristics
from cmmlink.pipeline import RunOutcome, run_inspection
from inspection import CharacteristicResult, EvaluationSoFar, LineProfile, LiveInspection, ScanSoFar, ToleranceZone, VaryingZone, Verdict
from tests.cmmlink.test_live_proof import PATIENCE_S, Waiting
from tests.inspection.reference_parts import nominal_of
from tests.inspection.test_placements import dented

NOMINAL, POINTS = nominal_of("goe404"), dented("goe404")
ZONE = ToleranceZone(-0.05, 0.05)


def fresh() -> LiveInspection:
    limits = VaryingZone.constant(-0.05, 0.05, NOMINAL.length_mm, NOMINAL.curve.closed)
    return LiveInspection(NOMINAL, ZONE, characteristics=[LineProfile("contour", limits), LineProfile("form", limits, fit="minimum-zone")])


def carried_out(shown: bool) -> tuple[RunOutcome, list[Event]]:
    """A run of a scan that stands still at 300 points until values were told of them, where somebody looks on."""
    source, heard, ticks = Waiting(POINTS, stands_at=300), list[Event](), itertools.count()

    def hear(event: Event) -> None:
        heard.append(event)
        told = isinstance(event, Evaluated) and all(one.value > 0 for one in event.found)
        if told or (not shown and isinstance(event, Judged) and event.update.stop == 300):
            source.goes_on.set()

    started = RunStarted("blade", "1", "", "a list", False)
    clock, stop = lambda: float(next(ticks)), threading.Event()
    outcome = run_inspection(source, fresh(), [hear], started, buffer_points=10_000, clock=clock, stop=stop, shown=shown)
    return outcome, heard


def test_a_run_that_is_shown_tells_values_so_far_and_ends_as_without() -> None:
    outcome, heard = carried_out(shown=True)
    told = [event for event in heard if isinstance(event, Evaluated)]
    assert [one.name for one in told[0].found] == ["contour", "form"]
    assert np.isnan([one.value for one in told[0].found]).all(), "what is asked for is told before the first point"
    assert {one.verdict for event in told for one in event.found} == {Verdict.UNCERTAIN}, "a fit may still take the points in"
    assert isinstance(heard[-1], RunFinished)
    alone, unheard = carried_out(shown=False)
    assert not [event for event in unheard if isinstance(event, Evaluated)]
    assert outcome.result is not None
    assert alone.result is not None
    assert [one.value for one in outcome.result.characteristics] == [one.value for one in alone.result.characteristics]
    assert not [thread for thread in threading.enumerate() if thread.name == "characteristics"]


def test_the_run_does_not_wait_and_the_newest_points_are_evaluated_next(monkeypatch: pytest.MonkeyPatch) -> None:
    looked_at, entered, goes_on = list[int](), threading.Event(), threading.Event()

    def slow(_evaluation: EvaluationSoFar, scan: ScanSoFar, is_over: Callable[[], bool]) -> tuple[CharacteristicResult, ...] | None:
        looked_at.append(scan.received)
        entered.set()
        assert goes_on.wait(PATIENCE_S)
        return None if is_over() else ()

    monkeypatch.setattr(EvaluationSoFar, "evaluate", slow)
    live = fresh()
    with LiveCharacteristics(live) as characteristics:
        assert entered.wait(PATIENCE_S)
        for first in range(0, 700, 100):
            live.add(POINTS[first : first + 100])
            characteristics.offer()  # returns, although nothing was evaluated yet
        assert (looked_at, characteristics.news()) == ([0], None)
        entered.clear()
        goes_on.set()
        assert entered.wait(PATIENCE_S)
    assert looked_at == [0, 700], "what waited was replaced by what is newer"


def test_a_defect_in_what_is_shown_does_not_end_the_run(monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture) -> None:
    def broken(*_: object) -> None:
        raise ZeroDivisionError

    monkeypatch.setattr(EvaluationSoFar, "evaluate", broken)
    with LiveCharacteristics(fresh()) as characteristics:
        characteristics._beside.join(PATIENCE_S)
        characteristics.offer()
        assert characteristics.news() is None
    assert "cannot be shown" in caplog.text
