"""Where a profile drifts: closed forms of Kendall's test, all arrangements counted, and slopes by another program."""

import math
from itertools import combinations

import numpy as np
import pytest
from scipy.special import ndtr
from scipy.stats import theilslopes

from cmmlink.plant import drift_of


def test_a_rising_place_has_the_slope_and_the_level_of_the_closed_form() -> None:
    values = np.outer(np.arange(12.0), [0.001, 0.0])  # the second place never changes
    drift = drift_of(values)
    n = 12
    variance = n * (n - 1) * (2 * n + 5) / 18
    alone = 2 * ndtr(-(n * (n - 1) / 2 - 1) / math.sqrt(variance))
    assert drift.slope == pytest.approx([0.001, 0.0], abs=1e-15)
    assert drift.level == pytest.approx([2 * alone, 1.0])  # two places are asked about
    [stretch] = drift.stretches
    assert (stretch.from_share, stretch.to_share, stretch.at_share) == (0.0, 0.5, 0.25)
    assert stretch.change == pytest.approx(0.011)


def test_ties_count_as_in_all_arrangements_of_the_values() -> None:
    ups = [0.0] * 10
    scores = []
    for ones in combinations(range(10), 4):
        row = np.array([1.0 if place in ones else 0.0 for place in range(10)])
        scores.append(sum(np.sign(row[j] - row[i]) for i in range(10) for j in range(i + 1, 10)))
    ups[6:] = [1.0] * 4
    expected = 2 * ndtr(-(24 - 1) / math.sqrt(np.mean(np.square(scores))))
    assert drift_of(np.array(ups)[:, None]).level == pytest.approx([expected])


def test_slopes_are_those_of_another_program_also_with_gaps() -> None:
    rng = np.random.default_rng(7)
    values = rng.normal(size=(30, 5)) + 0.05 * np.arange(30)[:, None]
    values[rng.random(values.shape) < 0.2] = np.nan
    slope = drift_of(values).slope
    for place, column in enumerate(values.T):
        at = np.flatnonzero(~np.isnan(column))
        assert slope[place] == pytest.approx(theilslopes(column[at], at).slope, rel=1e-12)


def test_steady_processes_are_seldom_said_to_drift() -> None:
    rng = np.random.default_rng(11)
    named = sum(bool(drift_of(rng.normal(size=(20, 40))).stretches) for _ in range(60))
    assert named <= 6  # 5 % at most are expected, 3 of 60


def test_places_that_were_not_measured_are_counted_and_never_named() -> None:
    values = np.outer(np.arange(15.0), np.ones(4))
    values[:6, 1] = np.nan
    drift = drift_of(values)
    assert drift.unmeasured == 1
    assert np.isnan(drift.level[1])
    assert [(one.from_share, one.to_share) for one in drift.stretches] == [(0.0, 0.25), (0.5, 1.0)]
    assert "1 places" in drift.notes[0]


def test_places_side_by_side_are_a_stretch_and_the_steepest_stands_first() -> None:
    slopes = np.array([0.01, 0.005, 0, -0.02, -0.04, 0, 0.03, -0.03])
    found = drift_of(np.outer(np.arange(16.0), slopes)).stretches
    assert [(one.from_share * 8, one.to_share * 8, round(one.steepest, 9)) for one in found] == [
        (3, 5, -0.04),
        (6, 7, 0.03),
        (7, 8, -0.03),
        (0, 2, 0.01),
    ]


def test_few_runs_say_nothing() -> None:
    drift = drift_of(np.outer(np.arange(9.0), [1.0, 2.0]))
    assert drift.stretches == ()
    assert "too few" in drift.notes[0]


def test_one_bad_part_is_no_drift() -> None:
    values = np.zeros((20, 3)) + 1e-4 * np.tile([1.0, -1.0], 10)[:, None]
    values[-1] = 5.0
    drift = drift_of(values)
    assert drift.stretches == ()
    assert np.abs(drift.slope).max() < 1e-5
