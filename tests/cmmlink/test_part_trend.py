"""The trend of a part: what is looked at, how a heat strip is coloured, where the profile drifts, and the keys of its JSON."""

import json
from dataclasses import replace

import numpy as np
import pytest

from cmmlink.part_trend import MOST_STRIPS, heat_strip_of, levels_of, look_at_trend
from cmmlink.trend_json import trend_json
from cmmlink.trend_keys import PlantTrend
from tests.cmmlink.plant.trending import BEGAN, DRIFT_MM, LENGTH_MM, Remembered, drifting_runs, drifting_trend


def test_the_drift_is_found_where_it_was_made_and_told_in_words() -> None:
    found = drifting_trend(40)
    assert found.strip is not None
    [stretch] = found.strip.drift.stretches
    assert abs(stretch.at_share - 0.3) < 0.02
    assert 0.2 < stretch.from_share < 0.3 < stretch.to_share < 0.4
    assert stretch.steepest == pytest.approx(DRIFT_MM, rel=0.1)
    assert found.drifts[0].startswith(f"The profile drifts from station {stretch.from_share * LENGTH_MM:.2f} to ")


def test_a_steady_profile_is_said_to_be_steady() -> None:
    found = look_at_trend(Remembered(drifting_runs(40, drift_mm=0.0)), "blade", "contour")
    assert found.drifts == ("No place along the profile drifts significantly over the last 40 runs.",)


def test_levels_show_which_part_of_the_zone_is_used_up() -> None:
    worst = np.array([[0.0, 0.019, 0.021, 0.061, 0.0999, 0.1001, -0.1, -0.11, np.nan]], dtype=np.float32)
    levels = levels_of(worst, np.array([-0.1]), np.array([0.1]))
    assert np.array_equal(levels, [[0, 0, 1, 2, 2, 3, -2, -3, np.nan]], equal_nan=True)
    above = levels_of(np.array([[0.0, 0.05, 0.1, 0.11]], dtype=np.float32), np.array([0.0]), np.array([0.1]))  # the zone lies outside
    assert np.array_equal(above, [[-2, 0, 2, 3]])


def test_runs_with_another_nominal_or_without_a_zone_are_told() -> None:
    strips = Remembered(drifting_runs(12)).strips("blade")
    length, lower = strips.length_mm.copy(), strips.lower_mm.copy()
    length[0], lower[5] = 99.0, np.nan
    found, notes = heat_strip_of(replace(strips, length_mm=length, lower_mm=lower))
    assert found.levels.shape == (11, 120)
    assert np.isnan(found.levels[4]).all()
    assert any("1 runs whose nominal has another length" in note for note in notes)
    assert any("without a zone" in note for note in notes)


def test_runs_are_chosen_by_station_day_and_number() -> None:
    results = Remembered(drifting_runs(80))
    assert len(look_at_trend(results, "blade", "contour", last=70).series.run) == 70
    of_station = look_at_trend(results, "blade", "contour", station="hall-2")
    assert set(of_station.series.station) == {"hall-2"}
    since = look_at_trend(results, "blade", "contour", since=BEGAN.replace(hour=18))
    assert since.strip is not None
    assert since.strip.strips.run == since.series.run
    everything = look_at_trend(results, "blade", "contour").strip
    assert everything is not None
    assert len(everything.strips.run) == MOST_STRIPS


def test_a_characteristic_of_a_section_has_the_profiles_of_its_section() -> None:
    runs = [
        replace(run, section=f"{height}.000", values=tuple(replace(value, name=f"contour at {height}.000") for value in run.values[:1]))
        for height in (5, 15)
        for run in drifting_runs(12, drift_mm=0.0 if height == 5 else DRIFT_MM)
    ]
    upper = [run for run in runs if run.section == "15.000"]
    strips = Remembered(runs).strips("blade", section="15.000")
    assert strips.run == tuple(run.run for run in upper)
    found = look_at_trend(Remembered(upper), "blade", "contour at 15.000")
    assert found.strip is not None
    assert np.array_equal(found.strip.strips.mean_mm, strips.mean_mm, equal_nan=True)


def test_the_json_has_the_keys_that_are_written_down_and_survives_being_written() -> None:
    found = drifting_trend(42, subgroup=4)
    document = json.loads(json.dumps(trend_json(found), allow_nan=False))
    told = PlantTrend(**document, file=None)
    assert told.location is not None
    assert len(told.runs) == 42
    assert len(told.location.plotted) == 10
    assert told.location.violations[-1].run == "20260302-0041"
    assert told.drift is not None
    assert told.drift.words[0].startswith("The profile drifts")
    assert document["runs"][0]["measured_at"] == BEGAN.isoformat()
    assert sum(run.verdict == "uncertain" for run in told.runs) == 3
    assert any(note.startswith("NOT PROVEN: 3") for note in told.notes)
