"""One run of a plan: its record, its sinks, and what comes of it."""

import itertools
import threading
import time
from collections.abc import Callable
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cmmlink.devices import Connected
from cmmlink.errors import StoreError
from cmmlink.events import Arrived, Event, Judged, RunFinished, RunStarted, Sink
from cmmlink.from_plan import inspection_of
from cmmlink.plan import FileDevice, Plan
from cmmlink.record.reader import list_runs, open_to_read, recorded_run
from cmmlink.run import FinishedRun, carry_out
from cmmlink.words import utc_words
from drivers import LinkError
from inspection import LiveInspection
from tests.cmmlink.recorded import Script, scan_arrivals, small_plan, small_profile, today


def run(
    source: Script,
    records: Path | None,
    *sinks: Sink,
    on_ready: Callable[[], None] = lambda: None,
    plan: Plan | None = None,
    now: Callable[[], datetime] = today,
) -> FinishedRun:
    plan = (plan or small_plan()).model_copy(update={"operator": "A. Operator"})
    return carry_out(
        plan,
        small_profile(),
        Connected(source, "scripted", simulated=True),
        records=records,
        clock=time.monotonic,
        now=now,
        stop=threading.Event(),
        sinks=sinks,
        on_ready=on_ready,
    )


def test_a_finished_run_is_what_its_record_says(tmp_path: Path) -> None:
    finished = run(Script(*scan_arrivals()), tmp_path)
    assert finished.evidence is not None
    with open_to_read(tmp_path, today) as store:
        recorded = recorded_run(store, finished.evidence.run)
    assert recorded.chain_sha256 == finished.evidence.chain_sha256
    document = finished.result_json()
    assert recorded.result is not None
    assert {key: document[key] for key in recorded.result} == recorded.result
    assert (document["run"], document["operator"], document["simulated"]) == (recorded.run, "A. Operator", True)
    assert document["received"] == document["judged"] + document["rejected"] == 612
    assert finished.title == f"{small_plan().part.name} {small_plan().part.serial_number} (SIMULATED)"


def test_a_run_was_measured_at_one_moment_whoever_tells_it(tmp_path: Path) -> None:
    moments = (today() + timedelta(seconds=7 * number) for number in itertools.count())
    finished = run(Script(*scan_arrivals()), tmp_path, now=lambda: next(moments))
    assert finished.evidence is not None
    with open_to_read(tmp_path, today) as store:
        header = recorded_run(store, finished.evidence.run).header
    assert finished.result_json()["measured_at"] == header["started"] == utc_words(finished.began)
    assert finished.evidence.run.startswith(f"{finished.began:%Y%m%d-%H%M%S}")


def test_without_a_folder_nothing_is_recorded_and_the_result_is_the_same(tmp_path: Path) -> None:
    kept, unkept = run(Script(*scan_arrivals()), tmp_path), run(Script(*scan_arrivals()), None)
    assert unkept.evidence is None
    assert kept.evidence is not None
    assert unkept.result_json().items() <= kept.result_json().items()
    tied = {"run", "chain_sha256", "plan_sha256", "nominal_sha256", "software", "signature", "anchors"}
    assert set(kept.result_json()) - set(unkept.result_json()) == tied


def test_ready_is_said_before_the_device_is_asked_and_sinks_hear_after_the_recorder(tmp_path: Path) -> None:
    heard: list[str] = []

    def sink(event: Event) -> None:
        if isinstance(event, Arrived):
            with open_to_read(tmp_path, today, close_interrupted=False) as store:
                assert [begin.kind for begin, _ in store.begins_and_ends()] == ["run"]
        if isinstance(event, RunStarted | Judged | RunFinished):
            heard.append(type(event).__name__)

    run(Script(lambda: heard.append("asked"), *scan_arrivals()), tmp_path, sink, on_ready=lambda: heard.append("ready"))
    assert heard[0] == "ready"
    assert set(heard[1:3]) == {"RunStarted", "asked"}
    assert (set(heard[3:-1]), heard[-1]) == ({"Judged"}, "RunFinished")


def test_a_device_that_fails_ends_the_run_and_does_not_raise(tmp_path: Path) -> None:
    def unplug() -> None:
        raise LinkError("unplugged")

    finished = run(Script(*scan_arrivals()[:9], unplug), tmp_path)
    assert finished.outcome.ending == "interrupted"
    assert str(finished.outcome.failure) == "unplugged"
    assert finished.result_json()["verdict"] == "uncertain"
    assert list_runs(tmp_path, today)[0]["state"] == "interrupted"


def test_a_record_that_cannot_be_kept_is_no_run(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("", encoding="utf-8")
    asked: list[bool] = []
    with pytest.raises(StoreError, match="choose another folder with --records"):
        run(Script(lambda: asked.append(True)), tmp_path / "file")
    assert asked == []


def test_a_device_that_never_opened_gives_no_run_and_no_result(tmp_path: Path) -> None:
    def absent() -> None:
        raise LinkError("there is no such port")

    finished = run(Script(absent), tmp_path)
    assert not finished.outcome.measured
    assert finished.evidence is None
    assert list_runs(tmp_path, today) == []


def test_a_run_ends_with_a_result_when_the_disk_has_no_room_for_more(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cmmlink.pipeline._ROOM_EVERY", 100)

    def refuse(_: object, received: int, announced: int | None) -> str:
        return "the disk is full" if received > 300 else ""

    monkeypatch.setattr("cmmlink.scratch.Scratch.refusal", refuse)
    source: Script = Script(*scan_arrivals(2000)[:20], lambda: source._stopped.wait(30), *scan_arrivals(2000))
    finished = run(source, tmp_path)
    assert finished.outcome.ending == "interrupted"
    assert isinstance(finished.outcome.failure, StoreError)
    assert str(finished.outcome.failure) == "the disk is full"
    document = finished.result_json()
    assert 300 < document["received"] < 2000
    assert document["verdict"] == "uncertain"
    (entry,) = list_runs(tmp_path, today)
    assert (entry["state"], entry["received"]) == ("interrupted", document["received"])


def test_no_more_of_a_file_waits_than_keeps_a_run_busy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cmmlink.conduct._FILE_POINTS", 100)
    monkeypatch.setattr("cmmlink.conduct._FILE_BYTES", 3000)
    plan = small_plan().model_copy(update={"device": FileDevice(type="file", file=tmp_path / "points.csv")})
    alone, followed = run(Script(*scan_arrivals()), tmp_path, plan=plan), run(Script(*scan_arrivals()), tmp_path, lambda _: None, plan=plan)
    assert alone.outcome.counts.buffer_peak <= 100
    assert alone.outcome.counts.received == followed.outcome.counts.received == 612
    with open_to_read(tmp_path, today) as store:
        assert [store.totals(str(begin.run))["points"][1] for begin, _ in store.begins_and_ends()] == [600, 600]


def test_a_file_that_nobody_follows_is_judged_at_its_end_alone_and_the_same(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    lives: list[LiveInspection] = []

    def kept(*args: Any, **settings: Any) -> LiveInspection:
        lives.append(inspection_of(*args, **settings))
        return lives[-1]

    monkeypatch.setattr("cmmlink.run.inspection_of", kept)
    plan = small_plan().model_copy(update={"device": FileDevice(type="file", file=tmp_path / "points.csv")})
    judged: list[Judged] = []
    alone = run(Script(*scan_arrivals()), None, plan=plan)
    followed = run(Script(*scan_arrivals()), None, lambda event: judged.append(event) if isinstance(event, Judged) else None, plan=plan)
    assert [live.state for live in lives] == ["seeking", "provisional"]
    assert judged[-1].counts.judged > 0
    assert alone.result_json() | {"measured_at": ""} == followed.result_json() | {"measured_at": ""}
    assert alone.outcome.result is not None
    assert followed.outcome.result is not None
    np.testing.assert_array_equal(alone.outcome.result.deviation_mm, followed.outcome.result.deviation_mm, strict=True)
