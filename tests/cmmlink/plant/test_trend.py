"""What a trend says of a characteristic; the truth is hand-made courses and the charts and indices that are tested on their own."""

import numpy as np
import pytest

from cmmlink.plant import alarm_words, capability, individuals_charts, mean_range_charts, new_violations, trend_of

STEADY = 0.02 + 0.001 * np.tile([1.0, -1.0, 0.5, -0.5], 10)  # (40,) around 0.02


def limits(count: int, value: float = np.nan) -> np.ndarray:
    return np.full(count, value)


def test_single_values_are_charted_and_held_against_the_newest_limits() -> None:
    lower, upper = limits(40, 0.0), limits(40, 0.05)
    upper[:10] = 0.08
    trend = trend_of(STEADY, lower, upper)
    expected = individuals_charts(STEADY)
    assert trend.charts is not None
    assert trend.charts.location.limits == expected.location.limits
    assert trend.capability == capability(expected, 0.0, 0.05)
    assert any("limits were changed" in note for note in trend.notes)


def test_subgroups_are_counted_from_the_newest_run() -> None:
    trend = trend_of(STEADY[:38], limits(38), limits(38, 0.05), subgroup=4)
    expected = mean_range_charts(STEADY[2:38].reshape(-1, 4))
    assert trend.charts is not None
    assert np.array_equal(trend.charts.location.plotted, expected.location.plotted)
    assert any(note.startswith("The first 2 runs") for note in trend.notes)


def test_a_run_without_a_value_makes_single_values_of_subgroups_and_is_told() -> None:
    values = STEADY.copy()
    values[7] = np.nan
    trend = trend_of(values, limits(40), limits(40, 0.05), subgroup=4)
    assert trend.subgroup == 1
    assert trend.charts is not None
    assert trend.charts.missing == 1
    assert any("1 runs gave no value" in note for note in trend.notes)


def test_form_has_no_lower_limit_and_tells_that_it_is_not_normal() -> None:
    trend = trend_of(np.abs(STEADY), limits(40, -0.05), limits(40, 0.05), is_form=True)
    assert any("never negative and not normal" in note for note in trend.notes)
    assert trend.capability is not None
    assert trend.capability.cp.value is None


def test_unproven_values_are_told() -> None:
    trend = trend_of(STEADY, limits(40), limits(40, 0.05), unproven=3)
    assert any(note.startswith("NOT PROVEN: 3") for note in trend.notes)


@pytest.mark.parametrize("values", [[], [0.1], [0.1, np.nan, 0.2]])
def test_too_few_values_make_no_chart_and_say_so(values: list[float]) -> None:
    trend = trend_of(values, limits(len(values)), limits(len(values), 1.0))
    assert trend.charts is None
    assert trend.capability is None
    assert any("too few" in note for note in trend.notes)


def test_without_limits_there_is_a_chart_and_no_capability() -> None:
    trend = trend_of(STEADY, limits(40), limits(40))
    assert trend.charts is not None
    assert trend.capability is None
    assert any("no limits" in note for note in trend.notes)


def test_a_rule_that_stays_broken_is_new_once() -> None:
    rising = np.concatenate([STEADY, np.full(9, 0.0203)])  # inside of three standard deviations, on one side of the centre
    told = [alarm_words(rising[:count]) for count in range(40, len(rising) + 1)]
    assert sum(any("eight values in a row" in words for words in found) for found in told) == 1


def test_an_alarm_says_which_side_and_needs_twenty_values_before() -> None:
    assert alarm_words([*STEADY, 0.04]) == ("one value beyond three standard deviations, upwards",)
    assert alarm_words([*STEADY, 0.0]) == ("one value beyond three standard deviations, downwards",)
    assert alarm_words([*STEADY[:-1], 0.0235, 0.017]) == ("the step from the run before is larger than chance allows",)
    assert alarm_words([*STEADY[:19], 0.04]) == ()
    assert alarm_words([*STEADY, np.nan]) == ()
    assert alarm_words(np.full(30, 0.02)) == ()


def test_the_newest_value_does_not_widen_the_limits_it_is_held_against() -> None:
    sigma = individuals_charts(STEADY).within_sigma
    just_beyond = STEADY.mean() + 3.001 * sigma
    assert any("three standard deviations, upwards" in words for words in alarm_words([*STEADY, just_beyond]))


def test_new_violations_of_a_chart_are_those_of_its_newest_value() -> None:
    assert [one.at for one in new_violations(individuals_charts([*STEADY, 0.04], 40).location)] == [40]
    assert new_violations(individuals_charts([*STEADY, 0.04, 0.02], 40).location) == ()
    assert new_violations(individuals_charts([*STEADY, np.nan], 40).location) == ()
