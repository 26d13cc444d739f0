"""Capability against printed examples, against closed forms, and what is not stated of values that cannot carry an index."""

import numpy as np
import pytest
from scipy.stats import expon, halfnorm, norm

from cmmlink.plant import capability, individuals_charts, mean_range_charts
from cmmlink.plant.folded_normal import FoldedNormal, fit_folded_normal
from cmmlink.plant.goodness_of_fit import anderson_darling, is_normal
from tests.cmmlink.plant.published_values import AMPS, LEW, MAVRO, RINGS


def _scores(n: int) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """The n values that lie as a normal distribution of mean 0 and standard deviation 1 (n - 1) would have them."""
    z = norm.ppf((np.arange(n) + 0.5) / n)
    scores: np.ndarray[tuple[int], np.dtype[np.float64]] = np.random.default_rng(1).permutation(z / z.std(ddof=1))
    return scores


def test_capability_of_piston_rings_is_the_printed_one() -> None:
    found = capability(mean_range_charts(RINGS[:25]), 73.95, 74.05)
    assert (f"{found.cp.value:.2f}", f"{found.cpk.value:.2f}") == ("1.70", "1.66")  # qcc, processCapability


def test_limits_of_ppk_are_those_that_sas_prints() -> None:
    found = capability(individuals_charts(AMPS), 4.0, 6.0, confidence=0.90)
    assert (f"{found.ppk.value:.3f}", f"{found.ppk.lower:.3f}", f"{found.ppk.upper:.3f}") == ("0.412", "0.328", "0.496")


def test_indices_of_the_handbook_are_found() -> None:
    found = capability(individuals_charts(16 + 2 * _scores(100)), 8.0, 20.0)  # e-Handbook 6.1.6: mean 16, s 2, limits 8 and 20
    assert (f"{found.pp.value:.1f}", f"{found.ppk.value:.4f}") == ("1.0", "0.6667")


def test_limits_of_pp_hold_the_true_index_as_often_as_they_say() -> None:
    drawn = np.random.default_rng(11).normal(size=(600, 30))
    found = [capability(individuals_charts(row), -4.0, 4.0, confidence=0.9) for row in drawn]
    stated = [one for one in found if one.pp.value is not None]
    assert len(stated) > 550  # one in twenty normal samples looks as if it were not normal
    for indices in ([one.pp for one in stated], [one.cp for one in stated], [one.ppk for one in stated]):
        inside = sum(index.lower < 4 / 3 < index.upper for index in indices if index.lower is not None and index.upper is not None)
        assert 0.86 < inside / len(stated) < 0.94


@pytest.mark.parametrize(("values", "mean", "sigma"), [(MAVRO, 2.001856, 0.000429123454003053), (LEW, -177.435, 277.332168044316)])
def test_mean_and_standard_deviation_are_the_certified_ones(values: list[float], mean: float, sigma: float) -> None:
    found = capability(individuals_charts(values), None, 1e6)
    assert found.mean == pytest.approx(mean, rel=1e-14)
    assert found.overall_sigma == pytest.approx(sigma, rel=1e-12)


def test_a_large_offset_costs_no_digits_of_the_standard_deviation() -> None:
    values = [10000000.2, *[10000000.1, 10000000.3] * 500]  # NIST Statistical Reference Datasets, NumAcc4: s = 0.1 exactly
    found = capability(individuals_charts(values), None, 1e8)
    assert found.overall_sigma == pytest.approx(0.1, rel=1e-7)  # the values themselves are rounded by 1e-9


def test_values_that_are_not_normal_carry_no_index_and_the_reason_stands_there() -> None:
    found = capability(individuals_charts(LEW), -1000.0, 1000.0)  # a sine wave by origin
    assert [index.value for index in (found.cp, found.cpk, found.pp, found.ppk)] == [None] * 4
    assert "not normal" in found.ppk.reason
    assert found.distribution == "none"


def test_few_values_and_equal_values_carry_no_index() -> None:
    few = capability(individuals_charts(_scores(24)), -9.0, 9.0)
    assert few.ppk.reason == "24 values are too few: at least 25 are needed"
    equal = capability(individuals_charts([1.0] * 30), 0.0, 2.0)
    assert "all values are equal" in equal.cp.reason


def test_one_limit_gives_one_side_and_no_width() -> None:
    charts = individuals_charts(_scores(50))
    both, upper, lower = capability(charts, -4.0, 5.0), capability(charts, None, 5.0), capability(charts, -4.0, None)
    assert upper.pp.value is None
    assert "one side alone" in upper.pp.reason
    assert both.ppk.value == lower.ppk.value == pytest.approx(4 / 3)
    assert upper.ppk.value == pytest.approx(5 / 3)


def test_a_drift_is_told_beside_the_indices_and_parts_short_term_from_all() -> None:
    z = _scores(60)
    found = capability(individuals_charts(z + np.linspace(-1.5, 1.5, 60)), -6.0, 6.0)
    assert "not in control" in found.notes[0]
    assert found.cp.value is not None
    assert found.pp.value is not None
    assert found.cp.value > 1.2 * found.pp.value


def test_runs_without_a_value_stand_beside_the_indices() -> None:
    found = capability(individuals_charts([*_scores(40), np.nan, np.nan]), -4.0, 4.0)
    assert "Without a value: 2 runs, for which no index speaks." in found.notes


@pytest.mark.parametrize("mean", [0.0, 0.7, 2.0, 6.0])
def test_the_folded_distribution_is_found_again(mean: float) -> None:
    drawn = FoldedNormal(mean, 0.5).draw(np.random.default_rng(4), (200000,))
    found = fit_folded_normal(drawn)
    assert found.quantile(0.99865) == pytest.approx(float(np.quantile(drawn, 0.99865)), rel=0.01)
    assert found.share_below(np.array([found.quantile(0.3)]))[0] == pytest.approx(0.3, abs=1e-12)


def test_form_deviations_of_a_half_normal_process_have_the_index_of_the_closed_form() -> None:
    values = np.random.default_rng(2).permutation(halfnorm.ppf((np.arange(400) + 0.5) / 400))
    found = capability(individuals_charts(0.01 * values), None, 0.05, is_form=True)
    median, high = float(halfnorm.ppf(0.5)), float(halfnorm.ppf(norm.cdf(3)))
    assert found.distribution == "folded normal"
    assert found.ppk.value is not None
    assert found.ppk.value == pytest.approx((5 - median) / (high - median), rel=0.01)
    assert found.ppk.lower is not None
    assert found.ppk.upper is not None
    assert found.ppk.lower < found.ppk.value < found.ppk.upper
    by_three_sigmas = (5 - values.mean()) / (3 * values.std(ddof=1))
    assert by_three_sigmas > 1.2 * found.ppk.value  # what the formula for normal values would promise
    assert found.cpk.value is found.pp.value is None


def test_form_deviations_with_a_heavy_tail_carry_no_index_until_the_tail_is_seen() -> None:
    rng = np.random.default_rng(8)
    heavy = np.abs(rng.standard_cauchy(2000))
    few = capability(individuals_charts(heavy[:200]), None, 50.0, is_form=True)
    assert few.ppk.value is None
    assert "do not follow a folded normal distribution" in few.ppk.reason
    many = capability(individuals_charts(heavy), None, 50.0, is_form=True)
    assert many.distribution == "percentiles of the values"
    median, high = np.quantile(heavy, [0.5, float(norm.cdf(3))])
    assert many.ppk.value == pytest.approx((50 - median) / (high - median), rel=1e-12)


def test_two_sided_values_that_are_not_normal_take_their_percentiles_when_there_are_enough() -> None:
    values = np.random.default_rng(6).permutation(np.linspace(-1, 1, 1001))
    found = capability(individuals_charts(values), -2.0, 1.5)
    assert found.pp.value == pytest.approx(3.5 / (2 * 0.9973), rel=1e-4)
    assert found.ppk.value == pytest.approx(1.5 / 0.9973, rel=1e-4)


def test_each_side_is_held_against_its_own_tail() -> None:
    skew = np.random.default_rng(6).permutation(expon.ppf((np.arange(2000) + 0.5) / 2000))
    median, low, high = (float(np.quantile(skew, share)) for share in (0.5, 1 - norm.cdf(3), norm.cdf(3)))
    below, above = capability(individuals_charts(skew), -0.1, 99.0), capability(individuals_charts(skew), -99.0, 7.0)
    assert below.ppk.value == pytest.approx((median + 0.1) / (median - low), rel=1e-9)
    assert above.ppk.value == pytest.approx((7 - median) / (high - median), rel=1e-9)


def test_the_test_of_normality_refuses_one_normal_sample_in_twenty() -> None:
    drawn = np.random.default_rng(5).normal(3.0, 0.2, size=(4000, 40))
    refused = np.mean([not is_normal(row) for row in drawn])
    assert 0.04 < refused < 0.06


def test_the_distance_is_that_of_its_definition() -> None:
    below = np.array([0.9, 0.2, 0.4])
    terms = [1 * np.log(0.2 * 0.1), 3 * np.log(0.4 * 0.6), 5 * np.log(0.9 * 0.8)]
    assert anderson_darling(below) == pytest.approx(-3 - sum(terms) / 3, rel=1e-12)


def test_limits_that_mean_nothing_are_refused() -> None:
    charts = individuals_charts(_scores(30))
    with pytest.raises(ValueError, match="at least one side"):
        capability(charts, None, None)
    with pytest.raises(ValueError, match="has to lie below"):
        capability(charts, 2.0, 1.0)
    with pytest.raises(ValueError, match="between 0 and 1"):
        capability(charts, 1.0, 2.0, confidence=95)
    with pytest.raises(ValueError, match="never negative"):
        capability(charts, None, 2.0, is_form=True)
