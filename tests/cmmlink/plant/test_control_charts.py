"""Control charts against printed examples and tables, and the rules of Western Electric against their definition."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from cmmlink.plant import individuals_charts, mean_range_charts
from cmmlink.plant.range_constants import range_constants
from cmmlink.plant.western_electric import ControlLimits, rule_violations
from tests.cmmlink.plant.published_values import FLOW, RINGS

# Montgomery, appendix VI (d2, d3 and c4 also in ASTM E2587). Tables that were computed from rounded d2 and d3 print D4 of three and five
# values as 2.575 and 2.115; the constants themselves are 2.5746 and 2.1145.
TABLE = {
    2: ("1.128", "0.853", "0.7979", "1.880", "0.000", "3.267"),
    3: ("1.693", "0.888", "0.8862", "1.023", "0.000", "2.575"),
    4: ("2.059", "0.880", "0.9213", "0.729", "0.000", "2.282"),
    5: ("2.326", "0.864", "0.9400", "0.577", "0.000", "2.114"),
    6: ("2.534", "0.848", "0.9515", "0.483", "0.000", "2.004"),
    7: ("2.704", "0.833", "0.9594", "0.419", "0.076", "1.924"),
    8: ("2.847", "0.820", "0.9650", "0.373", "0.136", "1.864"),
    9: ("2.970", "0.808", "0.9693", "0.337", "0.184", "1.816"),
    10: ("3.078", "0.797", "0.9727", "0.308", "0.223", "1.777"),
    25: ("3.931", "0.708", "0.9896", "0.153", "0.459", "1.541"),
}


@pytest.mark.parametrize("size", TABLE)
def test_constants_of_ranges_are_those_of_the_printed_table(size: int) -> None:
    found = range_constants(size)
    given = (found.d2, found.d3, found.c4, found.A2, found.D3, found.D4)
    digits = (3, 3, 4, 3, 3, 3)
    assert tuple(f"{value:.{places}f}" for value, places in zip(given, digits, strict=True)) == TABLE[size]


def test_constants_of_two_and_three_values_are_their_closed_forms() -> None:
    two, three = range_constants(2), range_constants(3)
    assert two.d2 == pytest.approx(2 / math.sqrt(math.pi), abs=1e-11)
    assert two.d3 == pytest.approx(math.sqrt(2 - 4 / math.pi), abs=1e-11)
    assert three.d2 == pytest.approx(3 / math.sqrt(math.pi), abs=1e-11)


@pytest.mark.parametrize("size", [1, 0, 101])
def test_a_subgroup_of_a_size_without_constants_is_refused(size: int) -> None:
    with pytest.raises(ValueError, match="from 2 to 100 values"):
        range_constants(size)


def test_individuals_are_those_of_the_handbook() -> None:
    charts = individuals_charts(FLOW)
    assert f"{charts.location.limits.centre:.2f}" == "50.81"
    assert f"{charts.spread.limits.centre:.4f}" == "1.8778"
    half = charts.location.limits.upper - 50.81
    rounded = half * range_constants(2).d2 / 1.128  # the handbook divides by d2 rounded to three places
    assert (f"{50.81 - rounded:.4f}", f"{50.81 + rounded:.4f}") == ("45.8159", "55.8041")
    assert charts.location.violations == charts.spread.violations == ()
    assert charts.notes == ("The limits come from 10 values; those from fewer than 20 are trial limits.",)


def test_means_and_ranges_are_those_that_montgomery_and_qcc_print() -> None:
    charts = mean_range_charts(RINGS, limits_from=25)
    means, ranges = charts.location.limits, charts.spread.limits
    assert (f"{means.centre:.5f}", f"{means.lower:.5f}", f"{means.upper:.4f}") == ("74.00118", "73.98805", "74.0143")
    assert (f"{ranges.centre:.5f}", ranges.lower, f"{ranges.upper:.5f}") == ("0.02276", 0.0, "0.04813")  # qcc: 0.0481253
    beyond = [violation.at + 1 for violation in charts.location.violations if violation.rule == 1]
    assert beyond == [37, 38, 39]  # the samples that the book finds out of control
    assert charts.spread.violations == ()
    assert mean_range_charts(RINGS[:25]).location.violations == ()


def test_degrees_of_freedom_say_how_much_the_spread_at_short_term_scatters() -> None:
    rng = np.random.default_rng(7)
    drawn = rng.normal(size=(20000, 30))
    moving = np.abs(np.diff(drawn, axis=1)).mean(axis=1)
    grouped = np.ptp(drawn.reshape(-1, 6, 5), axis=2).mean(axis=1)
    for scatter, charts in ((moving, individuals_charts(drawn[0])), (grouped, mean_range_charts(drawn[0].reshape(6, 5)))):
        relative = scatter.std() / scatter.mean()
        freedom = charts.degrees_of_freedom
        mean = math.sqrt(2 / freedom) * math.exp(math.lgamma((freedom + 1) / 2) - math.lgamma(freedom / 2))
        assert math.sqrt(1 - mean**2) / mean == pytest.approx(relative, rel=0.02)  # a chi of so many degrees of freedom scatters like it


def test_no_range_is_taken_across_a_run_without_a_value() -> None:
    charts = individuals_charts([1.0, 2.0, np.nan, 9.0, 10.0])
    assert charts.spread.limits.centre == 1.0
    assert charts.missing == 1
    assert charts.values.tolist() == [1.0, 2.0, 9.0, 10.0]
    assert charts.notes[-1] == "Without a value: 1 runs, of which the chart says nothing."


def test_ranges_on_both_sides_of_a_gap_share_no_value_and_are_worth_more() -> None:
    d2, d3 = 2 / math.sqrt(math.pi), math.sqrt(2 - 4 / math.pi)
    apart = d3**2 / 2 / d2**2  # relative variance of the mean of two ranges that are independent
    freedom = 1 / (2 * math.sqrt(1 + 2 * apart) - 2)
    assert individuals_charts([1.0, 2.0, np.nan, 9.0, 10.0]).degrees_of_freedom == pytest.approx(freedom, rel=1e-9)
    assert individuals_charts([1.0, 2.0, 9.0]).degrees_of_freedom < 0.9 * freedom


def test_a_range_that_is_too_small_to_be_true_is_out_of_control() -> None:
    groups = np.random.default_rng(12).normal(size=(25, 10))
    groups[20] = groups[20, 0]
    charts = mean_range_charts(groups, limits_from=20)
    assert [(violation.at, violation.above) for violation in charts.spread.violations] == [(20, False)]


def test_a_subgroup_that_lacks_a_value_is_refused() -> None:
    with pytest.raises(ValueError, match="subgroup 1 lacks a value"):
        mean_range_charts([[1.0, 2.0], [1.0, np.nan]])


@pytest.mark.parametrize("values", [[], [1.0], [1.0, np.nan, 2.0]])
def test_limits_need_two_values_that_follow_each_other(values: list[float]) -> None:
    with pytest.raises(ValueError, match="at least two values that follow each other"):
        individuals_charts(values)


def test_an_infinite_value_and_a_wrong_shape_are_refused() -> None:
    with pytest.raises(ValueError, match="finite numbers in one row"):
        individuals_charts([1.0, np.inf])
    with pytest.raises(ValueError, match="finite numbers in one row"):
        individuals_charts([[1.0, 2.0]])
    with pytest.raises(ValueError, match="between 1 and the 10"):
        individuals_charts(FLOW, limits_from=11)


def test_equal_values_have_limits_without_width_and_a_later_one_is_out_of_control() -> None:
    charts = individuals_charts([5.0, 5.0, 5.0, 5.1], limits_from=3)
    assert charts.within_sigma == 0
    assert [violation.at for violation in charts.location.violations if violation.rule == 1] == [3]
    assert "too coarse" in charts.notes[-1]


def _by_definition(z: NDArray[np.float64]) -> set[tuple[int, int]]:
    """Rule and place of every violation, from the words of the handbook: z are standard deviations from the centre."""
    found = set()
    for side in (z, -z):
        for at in range(len(z)):
            last = [side[max(0, at - count + 1) : at + 1] for count in (1, 3, 5, 8)]
            broken = (last[0][-1] > 3, (last[1] > 2).sum() >= 2, (last[2] > 1).sum() >= 4, len(last[3]) == 8 and (last[3] > 0).all())
            beyond = (side[at] > 3, side[at] > 2, side[at] > 1, side[at] > 0)
            found |= {(rule, at) for rule, (whole, now) in enumerate(zip(broken, beyond, strict=True), 1) if whole and now}
    return found


def test_rules_are_those_of_the_handbook_on_a_thousand_values() -> None:
    z = np.random.default_rng(3).normal(size=1000) * 1.3
    z[200:230] += 0.8
    found = rule_violations(10 + 2 * z, ControlLimits(4, 10, 16, 2))
    assert {(violation.rule, violation.at) for violation in found} == _by_definition(z)
    assert {violation.rule for violation in found} == {1, 2, 3, 4}
    assert [violation.at for violation in found] == sorted(violation.at for violation in found)


@pytest.mark.parametrize("sign", [1, -1])
def test_a_rule_names_the_values_that_count_for_it(sign: int) -> None:
    z = sign * np.array([0.5, -0.5, 2.1, 0.0, 2.2, -1.0, 0.0])
    (found,) = rule_violations(z, ControlLimits(-3, 0, 3, 1))
    assert (found.rule, found.at, found.points, found.above) == (2, 4, (2, 4), sign > 0)


def test_a_value_on_a_line_is_not_beyond_it_and_ends_a_run() -> None:
    z = np.array([3.0, -3.0, *[0.5] * 7, 0.0, 0.5])
    assert rule_violations(z, ControlLimits(-3, 0, 3, 1)) == ()


def test_a_run_without_a_value_silences_no_alarm() -> None:
    z = np.array([0.5, 0.5, 0.5, 0.5, np.nan, 0.5, 0.5, 0.5, 0.5])
    (found,) = rule_violations(z, ControlLimits(-3, 0, 3, 1))
    assert (found.rule, found.at, found.points) == (4, 8, (0, 1, 2, 3, 5, 6, 7, 8))
