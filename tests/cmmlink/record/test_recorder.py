"""The recorder: all of a run is kept, acknowledged means committed, and a failing disk stops the scan."""

import sqlite3
import threading
from collections.abc import Iterator, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cmmlink.errors import StoreError
from cmmlink.events import Arrived, Event, Judged, RunFinished, RunStarted
from cmmlink.record.bodies import POINT_BYTES, unpack_judged
from cmmlink.record.chain import Draft, Record
from cmmlink.record.reader import (
    arrivals_of,
    check_chain,
    describe,
    list_runs,
    open_to_read,
    points_of,
    reads_of,
    recorded_run,
    registrations_of,
)
from cmmlink.record.recorder import Acknowledged, Recorder
from cmmlink.record.run_inputs import RunInputs
from cmmlink.record.store import FILE_NAME, Store
from drivers.source import Arrival, Heartbeat, LinkDown, LinkUp, PointBatch, Rejected, WireBytes
from tests.cmmlink.recorded import Script, record, scan_arrivals, today


def with_wire(arrivals: list[Arrival]) -> list[Arrival]:
    found: list[Arrival] = []
    for index, arrival in enumerate(arrivals):
        found += [WireBytes(index / 7, bytes([index % 256]) * (index % 50)), arrival]
    return found


def test_everything_that_arrived_is_kept_as_it_was(tmp_path: Path) -> None:
    arrivals = with_wire(scan_arrivals())
    outcome, recorder = record(tmp_path, Script(*arrivals))
    with open_to_read(tmp_path, today) as store:
        reads = list(reads_of(store, recorder.run))
        batches = list(points_of(store, recorder.run))
        moments = list(arrivals_of(store, recorder.run))
        (rows,) = (unpack_judged(record.body) for record in store.records(recorder.run, "deviations"))
        told = describe(store, recorder.run)
    assert reads == [arrival for arrival in arrivals if isinstance(arrival, WireBytes)]
    sent = [arrival for arrival in arrivals if isinstance(arrival, PointBatch)]
    for name in ("sequence", "time_s", "points_mm"):
        expected = np.concatenate([getattr(batch, name) for batch in sent])
        np.testing.assert_array_equal(np.concatenate([getattr(batch, name) for batch in batches]), expected, strict=True)
    assert [moment.arrival for moment in moments] == [a for a in arrivals if not isinstance(a, WireBytes | PointBatch)]
    places = [
        (sum(isinstance(a, WireBytes) for a in before), sum(len(a) for a in before if isinstance(a, PointBatch)))
        for before in (arrivals[:index] for index, a in enumerate(arrivals) if not isinstance(a, WireBytes | PointBatch))
    ]
    assert [(moment.reads, moment.points) for moment in moments] == places
    assert outcome.result is not None
    for name in ("actual_mm", "foot_mm", "station_mm", "deviation_mm", "verdicts", "rejection"):
        np.testing.assert_array_equal(getattr(rows, name), getattr(outcome.result, name), strict=True)
    assert told["result"]["verdict"] == told["verdict"] == outcome.result.verdict.word
    assert (told["state"], told["received"]) == ("complete", outcome.counts.received)


def test_the_registrations_history_ends_at_the_settled_pose(tmp_path: Path) -> None:
    outcome, recorder = record(tmp_path, Script(*scan_arrivals(batch=600)))
    with open_to_read(tmp_path, today) as store:
        history = registrations_of(store, recorder.run)
    assert outcome.result is not None
    assert history
    assert {pose["state"] for pose in history} == {"provisional"}
    pose = outcome.result.registration.nominal_from_section
    np.testing.assert_allclose(history[-1]["translation_mm"], pose.translation_mm, atol=1e-3)
    assert [pose["points"] for pose in history] == sorted(pose["points"] for pose in history)


def test_what_is_acknowledged_another_process_can_read(tmp_path: Path) -> None:
    """Looked up through a connection of its own at the moment of the acknowledgement."""
    seen: list[tuple[int, int]] = []

    def acknowledge(acknowledged: Acknowledged) -> None:
        with closing(sqlite3.connect(tmp_path / FILE_NAME)) as connection:
            (size,) = connection.execute("SELECT sum(length(body)) FROM record WHERE kind = 'points'").fetchone()
        seen.append((acknowledged.points, size // POINT_BYTES))

    record(tmp_path, Script(*scan_arrivals()), acknowledge=acknowledge, commit_s=0.001)
    assert seen
    assert all(acknowledged == readable for acknowledged, readable in seen)
    assert seen[-1][0] == 600


def test_a_slow_disk_makes_the_run_wait_and_nothing_is_dropped(tmp_path: Path) -> None:
    basis = RunInputs("plan", "nominal", b"", {})
    with (
        Store(tmp_path, writing=True, epoch_s=lambda: 0.0) as store,
        Recorder(store, basis, clock=lambda: 0.0, now=today, commit_s=0.01, queue_bytes=2000) as recorder,
    ):
        recorder(started := _started())
        for index in range(200):
            recorder(Arrived(0.0, WireBytes(float(index), bytes(500))))
    assert started.part == "part"
    with open_to_read(tmp_path, today) as store:
        assert [read.time_s for read in reads_of(store, recorder.run)] == list(range(200))


def test_what_piled_up_is_committed_some_megabytes_at_a_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Packed together it would be held two times more."""
    monkeypatch.setattr("cmmlink.record.recorder.COMMIT_BYTES", 10_000)
    acknowledged: list[int] = []
    basis = RunInputs("plan", "nominal", b"", {})
    with (
        Store(tmp_path, writing=True, epoch_s=lambda: 0.0) as store,
        Recorder(
            store, basis, clock=lambda: 0.0, now=today, commit_s=60.0, acknowledge=lambda told: acknowledged.append(told.wire_bytes)
        ) as recorder,
    ):
        recorder(_started())
        for index in range(200):
            recorder(Arrived(0.0, WireBytes(float(index), bytes(500))))
    assert acknowledged[-1] == 100_000
    assert max(np.diff([0, *acknowledged])) <= 10_000
    with open_to_read(tmp_path, today) as again:
        assert [read.time_s for read in reads_of(again, recorder.run)] == list(range(200))


def _started() -> RunStarted:
    return RunStarted("part", "1", "operator", "device", True)


class Endless:
    """A source that is alive until it is stopped; `then` is called after the first arrivals."""

    def __init__(self, *first: Arrival, then: threading.Event) -> None:
        self._first, self._then, self.stopped = first, then, threading.Event()

    def stop(self) -> None:
        self.stopped.set()

    def arrivals(self) -> Iterator[Arrival]:
        yield from self._first
        self._then.wait(30)
        while not self.stopped.is_set():
            yield Heartbeat()
            self.stopped.wait(0.001)


def test_a_record_that_cannot_be_kept_stops_the_scan(tmp_path: Path) -> None:
    acknowledged, spoiled = threading.Event(), threading.Event()

    def spoil(_: Acknowledged) -> None:
        if not acknowledged.is_set():
            acknowledged.set()
            with closing(sqlite3.connect(tmp_path / FILE_NAME)) as connection, connection:
                connection.execute("ALTER TABLE record RENAME TO taken_away")
            spoiled.set()

    source = Endless(*scan_arrivals()[:3], then=spoiled)
    with pytest.raises(StoreError, match=r"so it has no result; 50 points are safe in run .*no such table"):
        record(tmp_path, source, acknowledge=spoil, commit_s=0.01)
    assert source.stopped.is_set()


def test_a_program_that_fails_leaves_a_run_that_says_so(tmp_path: Path) -> None:
    def failing(event: Event) -> None:
        if isinstance(event, Judged):
            raise RuntimeError("a defect elsewhere")

    with pytest.raises(RuntimeError):
        record(tmp_path, Script(*scan_arrivals()[:-1]), before=[failing])
    (entry,) = list_runs(tmp_path, today)
    assert entry["state"] == "interrupted"
    with open_to_read(tmp_path, today) as store:
        told = describe(store, entry["run"])
        assert "a defect elsewhere" in told["message"]
        assert sum(len(batch) for batch in points_of(store, entry["run"])) == 600


@pytest.mark.parametrize("end_has_room", [True, False])
@pytest.mark.parametrize("batches", [1, 2, 5])
def test_a_disk_that_fills_up_leaves_the_count_of_what_is_on_record(tmp_path: Path, batches: int, end_has_room: bool) -> None:
    """So many batches find room; of what follows nothing does, or the end of the run alone."""
    reached, acknowledged = threading.Event(), [0]
    refused = "NEW.kind = 'points'" if end_has_room else "1"

    def acknowledge(told: Acknowledged) -> None:
        acknowledged.append(told.points)
        if told.points == 50 * batches and not reached.is_set():
            with closing(sqlite3.connect(tmp_path / FILE_NAME)) as connection, connection:
                connection.execute(f"CREATE TRIGGER full BEFORE INSERT ON record WHEN {refused} BEGIN SELECT RAISE(ABORT, 'full'); END")
            reached.set()

    scan, first = scan_arrivals(), 3 * batches - 1
    source = Script(*scan[:first], lambda: reached.wait(30), *scan[first:])
    with pytest.raises(StoreError, match="so it has no result") as error:
        record(tmp_path, source, acknowledge=acknowledge, commit_s=0.001)
    with closing(sqlite3.connect(tmp_path / FILE_NAME)) as connection:
        connection.execute("DROP TRIGGER full")
    (entry,) = list_runs(tmp_path, today)
    with open_to_read(tmp_path, today) as store:
        points = sum(len(batch) for batch in points_of(store, entry["run"]))
        rejected = sum(moment.arrival.count for moment in arrivals_of(store, entry["run"]) if isinstance(moment.arrival, Rejected))
    assert f"{points} points are safe" in str(error.value)
    assert points == acknowledged[-1] == 50 * batches
    assert (entry["state"], entry["received"]) == ("interrupted", points + rejected)


def test_a_result_that_cannot_be_recorded_is_not_given(tmp_path: Path) -> None:
    """The disk fails between the last point and the result."""

    def spoil(event: Event) -> None:
        if isinstance(event, RunFinished):
            with closing(sqlite3.connect(tmp_path / FILE_NAME)) as connection, connection:
                connection.execute(
                    "CREATE TRIGGER full BEFORE INSERT ON record WHEN NEW.kind = 'result' BEGIN SELECT RAISE(ABORT, 'full'); END"
                )

    with pytest.raises(StoreError, match=r"so it has no result; 600 points are safe in run .*full"):
        record(tmp_path, Script(*scan_arrivals()), before=[spoil])
    with closing(sqlite3.connect(tmp_path / FILE_NAME)) as connection:
        connection.execute("DROP TRIGGER full")
    (entry,) = list_runs(tmp_path, today)
    assert (entry["state"], entry["received"], entry["verdict"]) == ("interrupted", 612, None)


def test_a_run_killed_between_its_judged_rows_and_its_result_was_interrupted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cmmlink.record.kept_result.JUDGED_ROWS", 100)
    monkeypatch.setattr("cmmlink.record.recorder._JUDGED_BODIES", 2)
    whole, recorder = record(tmp_path / "whole", Script(*scan_arrivals()))
    assert whole.result is not None
    with open_to_read(tmp_path / "whole", today) as store:
        counts = [record.count for record in store.records(recorder.run, "deviations")]
        found = np.concatenate([unpack_judged(record.body).deviation_mm for record in store.records(recorder.run, "deviations")])
    assert counts[:-1] == [100] * (len(counts) - 1)
    assert np.array_equal(found, whole.result.deviation_mm, equal_nan=True)
    pack = Store.append

    def cut_off(store: Store, drafts: Sequence[Draft], *behind: Any) -> list[Record]:
        if any(draft.kind == "result" for draft in drafts):
            raise StoreError("the power is gone")
        return pack(store, drafts, *behind)

    monkeypatch.setattr(Store, "append", cut_off)
    with pytest.raises(StoreError, match="the power is gone"):
        record(tmp_path / "cut", Script(*scan_arrivals()))
    monkeypatch.undo()
    with open_to_read(tmp_path / "cut", today) as store:
        (begin, end) = store.begins_and_ends()[0]
        assert end is not None
        assert recorded_run(store, str(begin.run)).result is None
        assert store.totals(str(begin.run))["deviations"][1] == len(found)
        assert check_chain(store, None)["altered"] is False


@pytest.mark.parametrize("is_disk_full", [False, True])
def test_what_waits_before_the_device_is_there_stands_behind_the_head_of_the_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, is_disk_full: bool
) -> None:
    """A device that is switched on late, and a disk that takes its time for the head: nobody else writes meanwhile, nor after a failure."""
    append, others = Store.append, threading.Event()
    kinds: list[str] = []

    def slow_append(store: Store, drafts: Sequence[Draft], *behind: Any) -> list[Record]:
        kinds.extend(draft.kind for draft in drafts)
        if drafts[0].kind != "run":
            others.set()
        else:
            others.wait(0.3)
            if is_disk_full:
                raise StoreError("disk full")
        return append(store, drafts, *behind)

    monkeypatch.setattr(Store, "append", slow_append)
    script = Script(LinkDown("switched off"), LinkUp(1.0), *scan_arrivals(20))
    if is_disk_full:
        with pytest.raises(StoreError, match="disk full"):
            record(tmp_path, script, commit_s=0.01)
        assert kinds == ["run", "plan", "nominal"]
        return
    _, recorder = record(tmp_path, script, commit_s=0.01)
    assert kinds[:3] == ["run", "plan", "nominal"]
    with open_to_read(tmp_path, today) as store:
        assert not check_chain(store, None)["altered"]
        assert isinstance(next(iter(arrivals_of(store, recorder.run))).arrival, LinkDown)
