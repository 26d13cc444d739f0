"""The station without a page: what it does with commands, runs and records."""

import dataclasses
import json
import re
import threading
import zipfile
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from datetime import datetime
from pathlib import Path
from time import monotonic

import numpy as np
import pytest

from cmmlink.console import device_test
from cmmlink.console.past_runs import PastRuns
from cmmlink.console.protocol import DeviceTest
from cmmlink.console.refused import Refused
from cmmlink.console.station import Station
from cmmlink.errors import PlanError
from cmmlink.extremes import Extremes, PointsVersion
from cmmlink.from_plan import check_plan, profile_of
from cmmlink.plan.scan import Plan, load_plan
from cmmlink.run import FinishedRun
from cmmlink.surface_run import FinishedSurface
from drivers.errors import LinkError
from inspection import NominalProfile

from .played import CLOSED, Device, batches, measured, opened, setup_of, write_plan

UNSEEN = PointsVersion(-1, 0)


class Bench:
    """A station with records in a folder."""

    def __init__(self, folder: Path) -> None:
        self.device = Device()
        plan = write_plan(folder)
        self.profile = profile_of(load_plan(plan))
        self.past = PastRuns(folder / "records", lambda _: None, monotonic, lambda: datetime.now().astimezone())
        self.station = Station(setup_of({"blade.yaml": plan}, self.device.connect, self.past))

    def run(self, count: int = 1500, defect_mm: float = 0.0, closed: bool = True, seed: int = 1) -> None:
        self.device.renew()
        self.station.choose("blade.yaml")
        self.station.start()
        points = batches(measured(self.profile, count, seed, defect_mm, at_mm=60.0), 64)
        self.device.source.put(opened(count), *points, *([CLOSED] if closed else []))
        if closed:
            assert self.station.wait(60.0)


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    return Bench(tmp_path)


def test_runs_are_recorded_listed_and_opened_as_they_were(bench: Bench) -> None:
    bench.run()
    bench.run(defect_mm=0.12, seed=2)
    live = bench.station.view
    assert live is not None
    first, second = bench.station.history.runs[::-1]
    assert (first.verdict, second.verdict) == ("conform", "nonconform")
    assert (first.serial_number, second.serial_number) == ("B-0041", "B-0042")
    assert (second.lower_mm, second.upper_mm, second.received, second.state) == (-0.05, 0.05, 1500, "complete")
    assert second.worst_mm == pytest.approx(0.12, abs=0.02)
    recalled = bench.station.open_run(second.run).state()
    for name in ("received", "judged", "rejected", "lost", "coverage", "out_of_tolerance", "worst", "verdict", "part", "zone", "simulated"):
        assert getattr(recalled, name) == getattr(live.state(), name), name
    seen, recorded = live.points_since(UNSEEN)[0], bench.station.open_run(second.run).points_since(UNSEEN)[0]
    np.testing.assert_array_equal(seen.bins, recorded.bins)
    np.testing.assert_array_equal(seen.extremes, recorded.extremes)


def test_the_results_of_every_run_are_written_and_a_full_disk_is_an_alarm(bench: Bench, tmp_path: Path) -> None:
    written: list[str] = []

    def write(run: FinishedRun | FinishedSurface) -> None:
        assert run.outcome.result is not None
        written.append(run.started.serial_number)
        if len(written) == 2:
            raise PlanError("results: no space left on device")

    known = setup_of({"blade.yaml": tmp_path / "blade.yaml"}, bench.device.connect, bench.past)
    bench.station = Station(dataclasses.replace(known, write=write))
    bench.run()
    bench.run()
    assert written == ["B-0041", "B-0042"]
    assert any("no space left" in str(alarm) for alarm in bench.station.alarms.newest_first()), "told, and the run is kept all the same"
    assert bench.station.history.runs[0].state == "complete"


def test_replay_of_a_recorded_run_is_identical_and_says_so(bench: Bench) -> None:
    bench.run(defect_mm=0.12)
    run = bench.station.history.runs[0].run
    bench.station.replay(run)
    assert bench.station.wait(60.0)
    assert bench.station.view is not None
    told = bench.station.view.state()
    assert told.remark == f"Replay of run {run}: identical to the recorded result, to the last bit"
    assert told.verdict.word == "NOT CONFORM"
    assert len(bench.station.history.runs) == 1, "a replay is no new run"


def test_export_is_an_archive_with_points_and_result(bench: Bench, tmp_path: Path) -> None:
    bench.run()
    archive = bench.station.export_run(bench.station.history.runs[0].run, tmp_path)
    with zipfile.ZipFile(archive) as files:
        assert {"points.csv", "deviations.csv", "result.json", "plan.yaml", "run.json"} <= set(files.namelist())
        assert json.loads(files.read("result.json"))["verdict"] == "conform"


def test_aborted_run_is_recorded_as_such(bench: Bench) -> None:
    bench.run(closed=False)
    bench.station.abort()
    assert bench.station.wait(60.0)
    assert bench.station.history.runs[0].state == "aborted"
    assert bench.station.history.runs[0].verdict == "uncertain"
    assert bench.station.state.serial_number == "B-0041", "the same part is measured again"


def test_while_a_run_is_on_nothing_else_can_be_started(bench: Bench) -> None:
    bench.run(closed=False)
    for command in (
        bench.station.start,
        bench.station.test_device,
        lambda: bench.station.choose("blade.yaml"),
        lambda: bench.station.enter(serial_number="X"),
        lambda: bench.station.replay("last"),
    ):
        with pytest.raises(Refused, match="a run is on"):
            command()
    bench.station.abort()
    assert bench.station.wait(60.0)


def test_fault_in_drawing_is_an_alarm_and_loses_no_measurement(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(self: Extremes, *_: object) -> None:
        raise RuntimeError("drawing failed")

    bench.station.choose("blade.yaml")
    monkeypatch.setattr(Extremes, "add", broken)
    bench.run()
    job = bench.station.job
    assert job is not None
    assert job.finished is not None
    assert job.finished.outcome.result is not None
    assert job.finished.outcome.result.judged == 1500
    assert [alarm.what for alarm in bench.station.alarms.newest_first()] == ["The page cannot show this run"]


def test_device_test_tells_what_it_heard_and_what_went_wrong(bench: Bench) -> None:
    bench.station.choose("blade.yaml")
    bench.device.source.put(opened(300), *batches(measured(bench.profile, 300, 1), 50))
    bench.station.test_device()
    assert bench.station.wait(30.0)
    assert bench.station.state.test.state == "passed"
    assert bench.station.state.test.message.startswith("played scanner PL-7: 200 points in ")
    assert "The test took them out of the device's stream: they are in no run" in bench.station.state.test.message
    bench.device.renew()
    bench.device.source.put(LinkError("COM3 cannot be opened"))
    bench.station.test_device()
    assert bench.station.wait(30.0)
    assert bench.station.state.test == DeviceTest("failed", "COM3 cannot be opened")
    assert bench.station.history.runs == (), "a test is no run"


def test_device_test_that_is_aborted_ends_at_once(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(device_test, "_LONGEST_S", 3600.0)  # nothing but the abort can end it
    bench.station.choose("blade.yaml")
    bench.station.test_device()
    assert bench.station.state.test == DeviceTest("testing", "listening")
    assert bench.station.state.running
    assert bench.station.abort() == "aborting"
    assert bench.station.wait(30.0)
    assert bench.station.state.test == DeviceTest("aborted", "aborted")
    assert not bench.station.state.running
    bench.run()
    assert bench.station.history.runs[0].state == "complete", "the next run is not aborted with it"


class SlowNominal:
    """A nominal that takes as long as the test wants: `begun` says that somebody waits for it."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.begun, self.released = threading.Event(), threading.Event()
        monkeypatch.setattr("cmmlink.console.choice.check_plan", self.build)

    def build(self, plan: Plan, plan_file: Path) -> NominalProfile:
        self.begun.set()
        assert self.released.wait(60.0)
        return check_plan(plan, plan_file)


def test_nobody_waits_for_a_nominal_that_another_builds(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    """While `start` builds a nominal, the state is there and every command is answered: neither needs a lock that `start` holds."""
    bench.station.choose("blade.yaml")
    slow = SlowNominal(monkeypatch)
    with ThreadPoolExecutor(1) as pool:
        started = pool.submit(bench.station.start)
        assert slow.begun.wait(30.0)
        assert bench.station.state.running
        assert bench.station.acknowledge() == "0 alarms acknowledged"
        bench.station.list_plans()
        for command in (bench.station.start, bench.station.test_device, lambda: bench.station.choose("blade.yaml"), bench.station.enter):
            with pytest.raises(Refused, match="a run is on"):
                command()
        with pytest.raises(Refused, match="nothing is being measured"):
            bench.station.end_scan()
        bench.station.abort()
        slow.released.set()
        with pytest.raises(Refused, match="aborted before it began"):
            started.result(30.0)
    assert not bench.station.state.running
    assert bench.station.state.can_start
    assert bench.station.history.runs == ()


def test_plan_that_is_checked_while_a_run_begins_does_not_replace_that_of_the_run(
    bench: Bench, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plans = {name: write_plan(tmp_path, name) for name in ("blade.yaml", "other.yaml")}
    bench.station = Station(setup_of(plans, bench.device.connect))
    bench.station.choose("blade.yaml")
    slow = SlowNominal(monkeypatch)
    with ThreadPoolExecutor(2) as pool:
        chosen = pool.submit(bench.station.choose, "other.yaml")
        assert slow.begun.wait(30.0)
        slow.begun.clear()
        started = pool.submit(bench.station.start)
        assert slow.begun.wait(30.0)
        slow.released.set()
        with pytest.raises(Refused, match="a run is on"):
            chosen.result(30.0)
        assert started.result(30.0) == "started"
    shown = bench.station.state.choice
    assert shown is not None
    assert shown.name == "blade.yaml"
    bench.station.abort()
    assert bench.station.wait(60.0)


def test_folder_of_plans_that_cannot_be_read_is_an_alarm_once(bench: Bench, tmp_path: Path) -> None:
    problem: list[OSError] = []

    def plans() -> Mapping[str, Path]:
        if problem:
            raise problem[0]
        return {"blade.yaml": tmp_path / "blade.yaml"}

    setup = setup_of({}, bench.device.connect)
    station = Station(dataclasses.replace(setup, plans=plans))
    assert station.state.plans == ("blade.yaml",)
    problem.append(OSError("the share is gone"))
    station.list_plans()
    station.list_plans()
    assert not station.state.plans
    assert [(alarm.detail, alarm.count) for alarm in station.alarms.newest_first()] == [("the share is gone", 1)]
    with pytest.raises(Refused, match="the share is gone"):
        station.choose("blade.yaml")
    problem.clear()
    station.list_plans()
    assert station.state.plans == ("blade.yaml",)


def test_a_part_that_was_measured_before_is_asked_for_once_and_said_beside_its_verdict(bench: Bench) -> None:
    bench.run()
    first = bench.station.history.runs[0].run
    bench.device.renew()
    bench.station.enter(serial_number="B-0041")
    told = f"the serial number B-0041 of this part was measured before: run {first}"
    with pytest.raises(Refused, match=re.escape(told)):
        bench.station.start()
    assert (bench.station.state.question, bench.station.running) == (told, False)
    bench.station.enter(serial_number="B-0042")
    assert bench.station.state.question == "", "of another part it is not asked"
    bench.station.enter(serial_number="B-0041")
    with pytest.raises(Refused, match="measured before"):
        bench.station.start()
    bench.station.start(again=True)
    assert bench.station.state.question == ""
    bench.station.abort()
    assert bench.station.wait(60.0)
    assert bench.station.view is not None
    assert told in bench.station.view.state().notes
