"""The plans of a station: what its folder holds now, and the demonstration once it was asked for."""

from dataclasses import replace
from pathlib import Path

import pytest

from cmmlink.commands.console import or_demo
from cmmlink.console.plan_shelf import DEMO, PlanShelf
from cmmlink.console.refused import Refused
from cmmlink.console.station import Station
from cmmlink.demo import plan_file
from inspection import Verdict

from .played import CLOSED, Device, opened, setup_of, write_plan


def test_a_station_without_a_folder_makes_no_plans_and_without_a_demonstration_runs_none(tmp_path: Path) -> None:
    shelf = PlanShelf(setup_of({"blade.yaml": write_plan(tmp_path)}, Device().connect))
    assert (shelf.can_make_plans, shelf.can_run_demo) == (False, False)
    for refused in (shelf.show_demo, lambda: shelf.save({}, b""), lambda: shelf.understand({}, b"")):
        with pytest.raises(Refused):
            refused()


def test_the_demonstration_is_a_plan_once_it_was_asked_for_and_measures_on_its_simulated_device() -> None:
    real = Device()
    station = Station(replace(setup_of({}, or_demo(real.connect)), demo=plan_file()))
    with pytest.raises(Refused):
        station.choose(DEMO)
    assert not station.state.plans
    station.run_demo()
    assert station.state.plans == (DEMO,)
    assert station.wait(30.0)
    assert station.job is not None
    assert station.job.finished is not None
    assert station.job.finished.outcome.result is not None
    assert station.job.finished.outcome.result.verdict is Verdict.CONFORM
    assert station.view is not None
    assert station.view.state().simulated
    station.enter(address="COM3")  # a device of one's own is no demonstration
    real.source.put(opened(0), CLOSED)
    station.start()
    assert station.wait(10.0)
    assert station.view.state().received == 0, "nothing was simulated"
