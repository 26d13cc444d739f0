"""Studies of gauges against the printed example of AIAG, against sums worked out by hand, and against variances that were put in."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from cmmlink.plant import crossed_study, station_study, type_one_study
from tests.cmmlink.plant.published_values import GAUGE

AIAG = np.array([GAUGE[appraiser] for appraiser in "ABC"]).transpose(2, 0, 1)  # (part, appraiser, trial)


def test_the_analysis_of_variance_is_the_printed_one() -> None:
    study = crossed_study(AIAG, 8.0)
    told = [(line.source, line.freedom, f"{line.sum_of_squares:.4f}", f"{line.mean_square:.4f}") for line in study.anova]
    assert told == [  # Minitab's example of a crossed study
        ("part", 9, "88.3619", "9.8180"),
        ("operator", 2, "3.1673", "1.5836"),
        ("interaction", 18, "0.3590", "0.0199"),
        ("repeatability", 60, "2.7589", "0.0460"),
    ]
    interaction = study.anova[2]
    assert f"{interaction.f:.3f}" == "0.434"
    assert f"{interaction.level:.3f}" == "0.974"
    assert study.pooled


def test_the_components_are_the_printed_ones() -> None:
    study = crossed_study(AIAG, 8.0)
    assert f"{study.line('repeatability').sigma:.6f}" == "0.199933"  # AIAG, EV
    assert f"{study.line('reproducibility').sigma:.6f}" == "0.226838"  # AV
    assert f"{study.line('gauge R&R').sigma:.5f}" == "0.30237"  # GRR; the sixth digit of the book comes from rounded variances
    assert f"{study.line('part').sigma:.6f}" == "1.042327"  # PV
    assert f"{study.line('total').sigma:.3f}" == "1.085"  # TV
    shares = [f"{100 * study.line(source).contribution:.1f}" for source in ("repeatability", "reproducibility", "gauge R&R", "part")]
    assert shares == ["3.4", "4.4", "7.8", "92.2"]
    assert f"{100 * study.line('gauge R&R').contribution:.2f}" == "7.76"  # Minitab
    assert f"{100 * study.line('part').contribution:.2f}" == "92.24"
    assert f"{100 * study.line('gauge R&R').to_total:.2f}" == "27.86"
    assert study.line("gauge R&R").to_tolerance == pytest.approx(6 * 0.3023715 / 8, rel=1e-5)
    assert study.categories == 4
    assert study.freedom == 78
    assert "was pooled with the repeatability, since its level lies above 0.25" in study.notes[0]


def test_an_interaction_that_is_kept_leaves_the_repeatability_alone() -> None:
    study = crossed_study(AIAG, alpha=0.98)
    assert not study.pooled
    assert study.freedom == 60
    assert f"{study.line('repeatability').sigma:.6f}" == "0.214435"
    assert study.line("interaction").sigma == 0
    assert "The variance of the source interaction came out negative and counts as zero." in study.notes
    assert study.line("part").to_tolerance is None


def _designed(spread: float) -> NDArray[np.float64]:
    """Parts 10, 20, 30; operators 0, 5, -5; an interaction whose rows and columns add up to zero; two repeats at -spread and spread."""
    inner = np.array([[4, -4, 0], [-4, 0, 4], [0, 4, -4]])
    cells = np.array([10.0, 20.0, 30.0])[:, None] + np.array([0.0, 5.0, -5.0]) + inner
    values: NDArray[np.float64] = cells[:, :, None] + np.array([-spread, spread])
    return values


def test_a_significant_interaction_is_kept_and_all_variances_are_those_worked_out_by_hand() -> None:
    study = crossed_study(_designed(1.0))
    assert [(line.sum_of_squares, line.freedom) for line in study.anova] == [(1200, 2), (300, 2), (192, 4), (18, 9)]
    assert [line.f for line in study.anova] == [600 / 48, 150 / 48, 24, None]
    assert not study.pooled
    variances = {line.source: round(line.sigma**2, 9) for line in study.lines}
    gauge = {"repeatability": 2, "operator": 17, "interaction": 23, "reproducibility": 40, "gauge R&R": 42}
    assert variances == {**gauge, "part": 92, "total": 134}
    assert study.categories == int(1.41 * math.sqrt(92 / 42))


def test_neither_origin_nor_order_of_parts_and_operators_changes_a_study() -> None:
    study = crossed_study(AIAG)
    other = crossed_study(1e4 + AIAG[::-1, [2, 0, 1]][:, :, ::-1])
    for line, moved in zip(study.lines, other.lines, strict=True):
        assert moved.sigma == pytest.approx(line.sigma, abs=1e-9)


def test_variances_that_were_put_in_are_found_at_every_station() -> None:
    rng = np.random.default_rng(9)
    p, o, r, s = 8, 4, 3, 3000
    put_in = {"part": 3.0, "operator": 2.0, "interaction": 1.0, "repeat": 0.5}
    values = (
        rng.normal(scale=put_in["part"], size=(p, 1, 1, s))
        + rng.normal(scale=put_in["operator"], size=(1, o, 1, s))
        + rng.normal(scale=put_in["interaction"], size=(p, o, 1, s))
        + rng.normal(scale=put_in["repeat"], size=(p, o, r, s))
    )
    found = station_study(values)
    assert np.mean(found.repeatability**2) == pytest.approx(0.25, rel=0.01)
    assert np.mean(found.reproducibility**2) == pytest.approx(5.0, rel=0.05)
    assert np.mean(found.part**2) == pytest.approx(9.0, rel=0.05)
    assert np.allclose(found.gauge**2, found.repeatability**2 + found.reproducibility**2)
    one = crossed_study(values[..., 17])
    assert one.pooled == found.pooled[17]
    assert one.line("gauge R&R").sigma == pytest.approx(found.gauge[17], rel=1e-12)


def test_every_station_pools_as_a_study_of_it_alone_would() -> None:
    values = np.random.default_rng(10).normal(size=(4, 3, 2, 60))
    pooled = station_study(values).pooled.tolist()
    assert pooled == [crossed_study(values[..., station]).pooled for station in range(60)]
    assert 0.6 < np.mean(pooled) < 0.9  # without an interaction the level is spread evenly, and three in four lie above 0.25


def test_a_gap_in_one_scan_leaves_that_station_without_a_result_and_no_other() -> None:
    values = np.random.default_rng(1).normal(size=(3, 2, 2, 5))
    whole = station_study(values)
    values[1, 0, 1, 3] = np.nan
    found = station_study(values)
    assert np.isnan(found.gauge).tolist() == [False, False, False, True, False]
    assert np.isnan([found.repeatability[3], found.reproducibility[3], found.part[3]]).all()
    assert np.array_equal(np.delete(found.gauge, 3), np.delete(whole.gauge, 3))


def test_a_crossed_study_refuses_what_would_flatter_the_gauge() -> None:
    lacking = AIAG.copy()
    lacking[4, 1, 2] = np.nan
    with pytest.raises(ValueError, match=r"lacks a value at \(4, 1, 2\)"):
        crossed_study(lacking)
    with pytest.raises(ValueError, match="2 operators and 2 repeats"):
        crossed_study(AIAG[:, :, :1])
    with pytest.raises(ValueError, match="no repeat of the study differs"):
        crossed_study(np.repeat(AIAG[:, :, :1], 3, axis=2))
    with pytest.raises(ValueError, match="tolerance has to be positive"):
        crossed_study(AIAG, 0.0)
    with pytest.raises(ValueError, match="between 0 and 1"):
        crossed_study(AIAG, alpha=25)
    with pytest.raises(ValueError, match="have 3 dimensions"):
        crossed_study(AIAG[0])


REPEATS = 20.302 + 0.001 * np.array([-1.0, 1.0] * 25)  # mean 20.302, s = 0.001 sqrt(50/49)


def test_cg_and_cgk_are_their_definition() -> None:
    sigma = 0.001 * math.sqrt(50 / 49)
    study = type_one_study(REPEATS, 20.300, 0.1)
    assert study.cg == pytest.approx(0.2 * 0.1 / (6 * sigma), rel=1e-9)
    assert study.cgk == pytest.approx((0.1 * 0.1 - 0.002) / (3 * sigma), rel=1e-9)
    assert study.bias == pytest.approx(0.002, abs=1e-12)
    assert study.level is not None
    assert study.level < 1e-10
    assert study.notes == ("Cg is 0.2 T over 6 s, and Cgk is half of each after the bias was taken off.",)
    other = type_one_study(REPEATS, 20.300, 0.1, share=0.15, spread_sigmas=4)
    assert other.cg == pytest.approx(0.15 * 0.1 / (4 * sigma), rel=1e-9)
    assert other.cgk == pytest.approx((0.075 * 0.1 - 0.002) / (2 * sigma), rel=1e-9)


def test_cgk_falls_with_the_bias_on_both_sides_and_never_exceeds_cg() -> None:
    below, none, above = (type_one_study(REPEATS, reference, 0.1) for reference in (20.304, 20.302, 20.300))
    assert none.cgk == pytest.approx(none.cg, rel=1e-9)
    assert none.level == pytest.approx(1.0, abs=1e-6)
    assert below.cgk == pytest.approx(above.cgk, rel=1e-9)
    assert above.cgk is not None
    assert above.cg is not None
    assert above.cgk < above.cg


def test_the_level_of_the_bias_is_that_of_students_test() -> None:
    study = type_one_study([1.0, 2.0, 3.0], 1.0, 10.0)  # t = 1 / (1 / sqrt 3) with two degrees of freedom
    t = math.sqrt(3)
    assert study.level == pytest.approx(1 - t / math.sqrt(2 + t * t), rel=1e-12)
    assert study.notes[1] == "The study has 3 repeats; at least 25 are usual."


def test_a_gauge_that_shows_no_spread_is_given_no_index() -> None:
    study = type_one_study([0.1] * 30, 0.1, 1.0)
    assert study.cg is study.cgk is study.level is None
    assert "too coarse" in study.reason


def test_a_type_one_study_refuses_what_it_cannot_judge() -> None:
    with pytest.raises(ValueError, match="at least 2 repeats"):
        type_one_study([1.0], 1.0, 1.0)
    with pytest.raises(ValueError, match=r"lacks a value at \(1,\)"):
        type_one_study([1.0, np.nan], 1.0, 1.0)
    with pytest.raises(ValueError, match="have to be positive"):
        type_one_study([1.0, 2.0], 1.0, -1.0)
