"""The station without a page: what it does with commands, runs and records."""

import dataclasses
import json
import zipfile
from datetime import datetime
from pathlib import Path
from time import monotonic

import numpy as np
import pytest

from cmmlink.console.past_runs import PastRuns
from cmmlink.console.protocol import DeviceTest
from cmmlink.console.station import Refused, Station, checked, next_serial_number
from cmmlink.errors import PlanError
from cmmlink.events import RunStarted
from cmmlink.extremes import Extremes, PointsVersion
from cmmlink.from_plan import profile_of
from cmmlink.pipeline import RunOutcome
from cmmlink.plan.scan import Plan, load_plan
from drivers.errors import LinkError
from inspection import NominalProfile

from .played import CLOSED, PLAN, Device, batches, means, measured, opened, write_plan

UNSEEN = PointsVersion(-1, 0)


class Bench:
    """A station with records in a folder."""

    def __init__(self, folder: Path) -> None:
        self.device = Device()
        plan = write_plan(folder)
        self.profile = profile_of(load_plan(plan))
        self.past = PastRuns(folder / "records", lambda _: None, monotonic, lambda: datetime.now().astimezone())
        self.station = Station(means({"blade.yaml": plan}, self.device.connect, self.past))

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
    first, second = bench.station.history[::-1]
    assert (first.verdict, second.verdict) == ("conform", "nonconform")
    assert (first.serial_number, second.serial_number) == ("B-0041", "B-0042")
    assert (second.lower_mm, second.upper_mm, second.received, second.state) == (-0.05, 0.05, 1500, "complete")
    assert second.worst_mm == pytest.approx(0.12, abs=0.02)
    recalled = bench.station.opened(second.run).state()
    for name in ("received", "judged", "rejected", "lost", "coverage", "out_of_tolerance", "worst", "verdict", "part", "zone", "simulated"):
        assert getattr(recalled, name) == getattr(live.state(), name), name
    seen, recorded = live.points_since(UNSEEN)[0], bench.station.opened(second.run).points_since(UNSEEN)[0]
    np.testing.assert_array_equal(seen.bins, recorded.bins)
    np.testing.assert_array_equal(seen.extremes, recorded.extremes)


def test_the_results_of_every_run_are_written_and_a_full_disk_is_an_alarm(bench: Bench, tmp_path: Path) -> None:
    written: list[str] = []

    def write(plan: Plan, profile: NominalProfile, outcome: RunOutcome, started: RunStarted) -> None:
        assert outcome.result is not None
        written.append(started.serial_number)
        if len(written) == 2:
            raise PlanError("results: no space left on device")

    known = means({"blade.yaml": tmp_path / "blade.yaml"}, bench.device.connect, bench.past)
    bench.station = Station(dataclasses.replace(known, write=write))
    bench.run()
    bench.run()
    assert written == ["B-0041", "B-0042"]
    assert any("no space left" in str(alarm) for alarm in bench.station.alarms.newest_first()), "told, and the run is kept all the same"
    assert bench.station.history[0].state == "complete"


def test_replay_of_a_recorded_run_is_identical_and_says_so(bench: Bench) -> None:
    bench.run(defect_mm=0.12)
    run = bench.station.history[0].run
    bench.station.replay(run)
    assert bench.station.wait(60.0)
    assert bench.station.view is not None
    told = bench.station.view.state()
    assert told.remark == f"Replay of run {run}: identical to the recorded result, to the last bit"
    assert told.verdict.word == "NOT CONFORM"
    assert len(bench.station.history) == 1, "a replay is no new run"


def test_export_is_an_archive_with_points_and_result(bench: Bench, tmp_path: Path) -> None:
    bench.run()
    archive = bench.station.exported(bench.station.history[0].run, tmp_path)
    with zipfile.ZipFile(archive) as files:
        assert {"points.csv", "deviations.csv", "result.json", "plan.yaml", "run.json"} <= set(files.namelist())
        assert json.loads(files.read("result.json"))["verdict"] == "conform"


def test_aborted_run_is_recorded_as_such(bench: Bench) -> None:
    bench.run(closed=False)
    bench.station.abort()
    assert bench.station.wait(60.0)
    assert bench.station.history[0].state == "aborted"
    assert bench.station.history[0].verdict == "uncertain"
    assert bench.station.state().serial_number == "B-0041", "the same part is measured again"


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
    assert bench.station.outcome is not None
    assert bench.station.outcome.result is not None
    assert bench.station.outcome.result.judged == 1500
    assert [alarm.what for alarm in bench.station.alarms.newest_first()] == ["The page cannot show this run"]


def test_device_test_tells_what_it_heard_and_what_went_wrong(bench: Bench) -> None:
    bench.station.choose("blade.yaml")
    bench.device.source.put(opened(300), *batches(measured(bench.profile, 300, 1), 50))
    bench.station.test_device()
    assert bench.station.wait(30.0)
    assert bench.station.state().test.state == "passed"
    assert bench.station.state().test.message.startswith("played scanner PL-7: 200 points in ")
    bench.device.renew()
    bench.device.source.put(LinkError("COM3 cannot be opened"))
    bench.station.test_device()
    assert bench.station.wait(30.0)
    assert bench.station.state().test == DeviceTest("failed", "COM3 cannot be opened")
    assert bench.station.history == (), "a test is no run"


@pytest.mark.parametrize(
    ("text", "line", "says"),
    [
        (PLAN.replace("upper_mm: 0.05", "upper_mm: 5 cm"), 4, "expected a number"),
        (PLAN + "colour: red\n", 6, "colour is not a known key"),
        (PLAN.replace("section.yaml", "missing.yaml"), None, "missing.yaml"),
        ("{", 2, "not valid YAML"),
        ("", None, "blade.yaml: the file is empty"),
    ],
)
def test_plan_that_cannot_be_run_is_told_with_its_line(tmp_path: Path, text: str, line: int | None, says: str) -> None:
    choice = checked("blade.yaml", write_plan(tmp_path, text=text))
    assert choice.plan is None
    assert choice.line == line
    assert says in choice.problem
    assert choice.text == text


def test_plan_that_is_gone_is_told(tmp_path: Path) -> None:
    assert "gone.yaml" in checked("gone.yaml", tmp_path / "gone.yaml").problem


@pytest.mark.parametrize(
    ("serial", "following"),
    [("B-0041", "B-0042"), ("B-0099", "B-0100"), ("999", "1000"), ("7a", "8a"), ("A1-09x", "A1-10x"), ("", ""), ("K", "")],
)
def test_next_serial_number_counts_the_last_number_up(serial: str, following: str) -> None:
    assert next_serial_number(serial) == following
