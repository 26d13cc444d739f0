"""A run that changes the trend of its part raises an alarm once, in words that name the characteristic."""

from dataclasses import replace
from pathlib import Path
from typing import Any

from cmmlink.plant import ResultsDatabase, StoredRun
from cmmlink.trend_alarms import trend_alarms
from tests.cmmlink.plant.results import a_run

STEADY_MM = (0.021, 0.019, 0.0205, 0.0195)


def measured(k: int, value: float, station: str = "hall-1", **others: Any) -> StoredRun:
    """The k-th run of a station, with this value of its profile."""
    run = a_run(k, station=station, **others)
    return replace(run, values=(replace(run.values[0], value=value),))


def test_a_leap_is_told_of_its_own_run_and_not_of_the_next(tmp_path: Path) -> None:
    runs = [measured(k, STEADY_MM[k % 4]) for k in range(24)]
    leap, after = measured(24, 0.04), measured(25, 0.04)
    with ResultsDatabase(tmp_path / "plant.sqlite") as results:
        results.add_runs([*runs, leap, after])
        [told] = trend_alarms(results, leap)
        assert list(trend_alarms(results, runs[-1])) == []
        assert [one.words for one in trend_alarms(results, after)] == [
            "profile: two of three values in a row beyond two standard deviations on one side, upwards"
        ]
        for _ in range(2):
            results.add_event(told)
        assert [event.words for event in results.events(kind="trend alarm")] == [
            "profile: one value beyond three standard deviations, upwards"
        ]
    assert (told.station, told.part, told.run, told.characteristic) == ("hall-1", "blade", leap.run, "profile")


def test_runs_of_other_stations_and_runs_that_ended_early_say_nothing(tmp_path: Path) -> None:
    elsewhere = [measured(k, STEADY_MM[k % 4], "hall-2") for k in range(24)]
    lonely, early = measured(30, 0.04), measured(31, 0.04, "hall-2", state="aborted")
    with ResultsDatabase(tmp_path / "plant.sqlite") as results:
        results.add_runs([*elsewhere, lonely, early])
        assert list(trend_alarms(results, lonely)) == []
        assert list(trend_alarms(results, early)) == []
