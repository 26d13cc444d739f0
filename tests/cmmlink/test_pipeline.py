"""One run: received = judged + rejected whatever happens, and every end of a run is a clean one."""

import itertools
import threading
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from cmmlink.events import Arrived, Counts, Event, Judged, RunFinished, RunStarted, Sink
from cmmlink.pipeline import RunOutcome, run_inspection
from drivers.errors import DeviceError, LinkError
from drivers.source import OLDER_THAN_THE_SCAN, Arrival, Damaged, Heartbeat, Lost, PointBatch, Rejected, ScanClosed, ScanOpened, WireBytes
from inspection import LiveInspection, NominalProfile, RigidTransform, ToleranceZone, Verdict
from tests.cmmlink.oval_part import oval_points, oval_profile, station_mm

STARTED = RunStarted("oval", "0012", "A. Operator", "a list", False)
PATIENCE_S = 30.0


class Listed:
    """A source that yields what it is given, raising what is an exception, until it is stopped."""

    def __init__(self, arrivals: Iterable[Arrival | BaseException]) -> None:
        self._arrivals = arrivals
        self.stopped = threading.Event()
        self.ended = threading.Event()

    def arrivals(self) -> Iterator[Arrival]:
        try:
            for arrival in self._arrivals:
                if self.stopped.is_set():
                    return
                if isinstance(arrival, BaseException):
                    raise arrival
                yield arrival
        finally:
            self.ended.set()

    def stop(self) -> None:
        self.stopped.set()


@pytest.fixture(scope="module")
def profile() -> NominalProfile:
    return oval_profile()


@pytest.fixture
def live(profile: NominalProfile) -> LiveInspection:
    return LiveInspection(profile, ToleranceZone(-0.05, 0.05), datum=RigidTransform.identity(), coverage_min=0.9)


def batches(points: NDArray[np.float64], size: int) -> list[PointBatch]:
    cuts = [np.arange(start, min(start + size, len(points))) for start in range(0, len(points), size)]
    return [PointBatch(rows, np.asarray(rows * 1e-3), np.column_stack([points[rows], np.zeros(len(rows))])) for rows in cuts]


def carried_out(
    source: Listed, live: LiveInspection, *sinks: Sink, buffer_points: int = 1000, stop: threading.Event | None = None
) -> RunOutcome:
    ticks = itertools.count()
    return run_inspection(
        source, live, sinks, STARTED, buffer_points=buffer_points, clock=lambda: float(next(ticks)), stop=stop or threading.Event()
    )


def balanced(counts: Counts) -> bool:
    return counts.received == counts.judged + counts.rejected + counts.pending and counts.rejected == sum(
        counts.rejected_by_reason.values()
    )


def test_a_whole_scan_is_judged_to_the_last_point(live: LiveInspection) -> None:
    source = Listed([ScanOpened("list", "1", 360), *batches(oval_points(0.03), 50), ScanClosed(360)])
    outcome = carried_out(source, live)
    assert (outcome.ending, outcome.failure, outcome.refusal) == ("complete", None, None)
    assert outcome.result is not None
    assert outcome.result.verdict == Verdict.CONFORM
    np.testing.assert_allclose(outcome.result.deviation_mm, 0.03, atol=1e-9)
    assert (outcome.counts.received, outcome.counts.judged, outcome.counts.rejected, outcome.counts.pending) == (360, 360, 0, 0)
    assert source.ended.is_set()


def test_the_four_numbers_add_up_whatever_arrives(profile: NominalProfile) -> None:
    points = oval_points(0.0)
    points[7] = np.nan
    off_section = batches(points, 90)
    off_section[1] = replace(off_section[1], points_mm=off_section[1].points_mm + np.array([0, 0, 5.0]))
    arrivals: list[Arrival] = [
        WireBytes(0.0, b"abc"),
        Lost(4, "gap"),
        Rejected(3, "repeated"),
        Damaged(17, "checksum"),
        Heartbeat(),
        Lost(-1, "late"),
    ]
    live = LiveInspection(profile, ToleranceZone(-0.05, 0.05), datum=RigidTransform.identity(), off_section_max_mm=1.0)
    events: list[Event] = []
    outcome = carried_out(Listed([*off_section[:2], *arrivals, *off_section[2:], ScanClosed(None)]), live, events.append)
    counts = outcome.counts
    assert (counts.received, counts.judged, counts.rejected) == (363, 269, 94)
    assert counts.rejected_by_reason == {"repeated": 3, "not finite": 1, "off section": 90}
    assert (counts.lost, counts.damaged_bytes) == (3, 17)
    assert all(balanced(event.counts) for event in events if isinstance(event, Judged | RunFinished))


def test_events_come_in_the_order_of_things(live: LiveInspection) -> None:
    arrivals: list[Arrival] = [ScanOpened("list", "1", 360), *batches(oval_points(0.0), 100), ScanClosed(360)]
    events: list[Event] = []
    outcome = carried_out(Listed(arrivals), live, events.append)
    assert events[0] is STARTED
    assert [event.arrival for event in events if isinstance(event, Arrived)] == arrivals
    finished = events[-1]
    assert isinstance(finished, RunFinished)
    assert (finished.ending, finished.result, finished.counts, finished.message) == ("complete", outcome.result, outcome.counts, "")
    judged = [event for event in events if isinstance(event, Judged)]
    assert [0, *(event.update.stop for event in judged)] == [event.update.first for event in judged] + [360]
    assert all(event.age_s > 0 for event in judged)


def test_every_sink_hears_everything(live: LiveInspection) -> None:
    one: list[Event] = []
    two: list[Event] = []
    carried_out(Listed([*batches(oval_points(0.0), 100), ScanClosed(360)]), live, one.append, two.append)
    assert len(one) == len(two) > 4
    assert all(a is b for a, b in zip(one, two, strict=True))


def test_a_failing_source_ends_with_what_was_received_and_no_proof(live: LiveInspection) -> None:
    broken = LinkError("port: the link was lost")
    outcome = carried_out(Listed([*batches(oval_points(0.0), 60)[:3], broken]), live)
    assert (outcome.ending, outcome.failure) == ("interrupted", broken)
    assert (outcome.counts.received, outcome.counts.judged) == (180, 180)
    assert outcome.result is not None
    assert (outcome.result.verdict, outcome.result.complete) == (Verdict.UNCERTAIN, False)


def test_a_part_seen_to_be_bad_stays_bad_when_the_source_fails(live: LiveInspection) -> None:
    outcome = carried_out(Listed([*batches(oval_points(0.2), 60)[:3], LinkError("gone")]), live)
    assert outcome.result is not None
    assert outcome.result.verdict == Verdict.NONCONFORM


@pytest.mark.parametrize("defect", [KeyError("x"), ZeroDivisionError("y"), RuntimeError("z")])
def test_a_defect_in_a_driver_ends_the_run_with_a_message(live: LiveInspection, defect: Exception) -> None:
    outcome = carried_out(Listed([*batches(oval_points(0.0), 100)[:2], defect]), live)
    assert outcome.ending == "interrupted"
    assert isinstance(outcome.failure, DeviceError)
    assert str(outcome.failure) == f"the driver failed unexpectedly: {defect!r}"
    assert outcome.counts.judged == 200


def test_a_source_that_gives_nothing_gives_no_verdict(profile: NominalProfile) -> None:
    finished: list[Event] = []
    live = LiveInspection(profile, ToleranceZone(-0.05, 0.05))
    outcome = carried_out(Listed([ScanClosed(0)]), live, finished.append)
    assert outcome.result is None
    assert outcome.refusal is not None
    assert outcome.counts == Counts()
    assert isinstance(finished[-1], RunFinished)
    assert finished[-1].message == str(outcome.refusal)


def test_points_that_cannot_be_registered_are_counted_as_rejected(profile: NominalProfile) -> None:
    live = LiveInspection(profile, ToleranceZone(-0.05, 0.05))
    outcome = carried_out(Listed([*batches(np.full((100, 2), 3.0), 40), Rejected(2, "repeated"), ScanClosed(102)]), live)
    assert outcome.refusal is not None
    assert (outcome.counts.received, outcome.counts.judged, outcome.counts.rejected) == (102, 0, 102)
    assert outcome.counts.rejected_by_reason == {"repeated": 2, "not registered": 100}


def sink_that_fails_on(kind: type[Event]) -> Sink:
    def sink(event: Event) -> None:
        if isinstance(event, kind):
            raise OSError("the disk is full")

    return sink


@pytest.mark.parametrize("kind", [Arrived, Judged])
def test_a_failing_sink_stops_acquisition_and_its_error_is_passed_on(live: LiveInspection, kind: type[Event]) -> None:
    source = Listed(itertools.chain(itertools.cycle(batches(oval_points(0.0), 100))))  # a device that never ends
    others = set(threading.enumerate())
    with pytest.raises(OSError, match="the disk is full"):
        carried_out(source, live, sink_that_fails_on(kind))
    assert source.stopped.is_set()
    assert source.ended.is_set()
    assert not {thread.name for thread in set(threading.enumerate()) - others} & {"acquisition", "proof"}


def test_a_sink_that_fails_at_the_start_leaves_the_device_alone(live: LiveInspection) -> None:
    source = Listed([])
    with pytest.raises(OSError, match="the disk is full"):
        carried_out(source, live, sink_that_fails_on(RunStarted))
    assert not source.ended.is_set()


def stopping_after(points: int, stop: threading.Event) -> Callable[[Event], None]:
    def sink(event: Event) -> None:
        if isinstance(event, Judged) and event.counts.received >= points:
            stop.set()

    return sink


def test_a_stop_ends_an_endless_scan_and_judges_all_that_was_received(live: LiveInspection) -> None:
    stop = threading.Event()
    source = Listed(itertools.cycle(batches(oval_points(0.0), 20)))
    outcome = carried_out(source, live, stopping_after(200, stop), buffer_points=40, stop=stop)
    assert (outcome.ending, outcome.failure) == ("aborted", None)
    assert outcome.result is not None
    assert not outcome.result.complete
    assert outcome.result.verdict == Verdict.UNCERTAIN
    assert outcome.counts.received == outcome.counts.judged >= 200


def test_an_aborted_scan_has_no_verdict_whatever_was_out(live: LiveInspection) -> None:
    stop = threading.Event()
    source = Listed(itertools.cycle(batches(oval_points(np.where(np.arange(360) < 40, 0.4, 0.0)), 20)))
    outcome = carried_out(source, live, stopping_after(200, stop), buffer_points=40, stop=stop)
    assert (outcome.ending, outcome.measured) == ("aborted", True)
    assert outcome.result is not None
    assert outcome.result.out_of_tolerance > 0
    assert outcome.result.verdict == Verdict.UNCERTAIN
    assert [reason.kind for reason in outcome.result.reasons][:3] == ["aborted", "proven-out", "out-of-tolerance"]


def test_an_aborted_scan_that_was_not_proven_out_does_not_say_so(live: LiveInspection) -> None:
    stop = threading.Event()
    source = Listed(itertools.cycle(batches(oval_points(0.0), 20)))
    outcome = carried_out(source, live, stopping_after(200, stop), buffer_points=40, stop=stop)
    assert outcome.result is not None
    assert [reason.kind for reason in outcome.result.reasons][:2] == ["aborted", "incomplete"]


def test_a_device_that_begins_anew_within_a_run_gives_no_proof(live: LiveInspection) -> None:
    """The second scan may be of the next part."""
    first, second = batches(oval_points(0.01), 90)[:2], batches(oval_points(0.01), 90)
    outcome = carried_out(Listed([ScanOpened("list", "1", 360), *first, ScanOpened("list", "1", 360), *second, ScanClosed(360)]), live)
    assert outcome.result is not None
    assert (outcome.result.verdict, [reason.kind for reason in outcome.result.reasons]) == (Verdict.UNCERTAIN, ["begun-anew"])
    older = Rejected(4, OLDER_THAN_THE_SCAN)
    said_again: list[Arrival] = [ScanOpened("list", "1", None), older, ScanOpened("list", "1", 360), *second, ScanClosed(360)]
    live = LiveInspection(oval_profile(), ToleranceZone(-0.05, 0.05), datum=RigidTransform.identity())
    again = carried_out(Listed(said_again), live).result
    assert again is not None
    assert again.verdict == Verdict.CONFORM


def test_a_slow_consumer_holds_the_source_up_and_loses_nothing(live: LiveInspection) -> None:
    produced = 0
    further = threading.Condition()

    def counted() -> Iterator[Arrival]:
        nonlocal produced
        for batch in batches(oval_points(0.01), 5):
            with further:
                produced += 1
                further.notify_all()
            yield batch

    def slow_at_first(event: Event) -> None:
        """Wait until two batches fill the buffer and the source has come with a third."""
        if isinstance(event, Judged) and event.update.first == 0:
            with further:
                assert further.wait_for(lambda: produced >= event.update.stop // 5 + 3, PATIENCE_S)

    outcome = carried_out(Listed(counted()), live, slow_at_first, buffer_points=10)
    assert outcome.result is not None
    assert outcome.counts.buffer_peak == 10
    assert outcome.counts.received == outcome.counts.judged == 360
    np.testing.assert_allclose(outcome.result.station_mm, [station_mm(i) for i in range(360)], atol=1e-6)


def test_a_buffer_that_holds_nothing_is_refused_before_anything_starts(live: LiveInspection) -> None:
    source = Listed([])
    with pytest.raises(ValueError, match="at least one point"):
        carried_out(source, live, buffer_points=0)
    assert not source.ended.is_set()
