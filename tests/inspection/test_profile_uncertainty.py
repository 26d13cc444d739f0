"""U along a profile and the U that judges: closed forms on a circle, drawn errors, and laws over ways to fit and to measure."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from inspection import (
    InspectionResult,
    LiveInspection,
    NominalProfile,
    NurbsCurve,
    RigidTransform,
    StatedUncertainty,
    ToleranceZone,
    UncertaintyBudget,
    Verdict,
    deviation_uncertainty,
    discretize,
    largest_by_noise_mm,
    uncertainty_along,
)
from inspection.methods import FitName, RuleName, WeightName
from tests.inspection.profiles import Array
from tests.inspection.reference_parts import nominal_of, reference_form, scan

Rows = NDArray[np.int64]

SOME = UncertaintyBudget(0.0009, 0.0018, 1 / 300e3, 0.0003, 0.5, 11.5e-6, 3.0, 1e-6)
HERE = RigidTransform.identity()


@cache
def circle(radius_mm: float = 50.0) -> NominalProfile:
    angle = np.linspace(0, 2 * np.pi, 240, endpoint=False)
    points = radius_mm * np.column_stack([np.cos(angle), np.sin(angle)])
    return discretize(NurbsCurve.interpolate(np.vstack([points, points[:1]]), closed=True), samples=600)


@pytest.mark.parametrize("pose", [None, HERE])
def test_a_circle_keeps_its_size_whatever_is_fitted(pose: RigidTransform | None) -> None:
    """Neither the tip nor growth about the middle looks like a motion: closed forms u(r), and R by the strain."""
    stated = StatedUncertainty(UncertaintyBudget(0, 0, 0, 0.0007, 0.5, 11.5e-6, -3.0, 1e-6), coverage_factor=3.0)
    found = uncertainty_along(circle(), stated, pose)
    np.testing.assert_allclose(found.parts_mm["tip radius"], 0.0007, rtol=1e-4)
    np.testing.assert_allclose(found.lever_mm, 50.0, rtol=1e-6)
    np.testing.assert_allclose(found.parts_mm["temperature"], 11.5e-6 * 0.5 * 50, rtol=1e-6)
    np.testing.assert_allclose(found.parts_mm["expansion"], 1e-6 * 3 * 50, rtol=1e-6)
    by_hand = 3 * np.sqrt(0.0007**2 + (11.5e-6 * 0.5 * 50) ** 2 + (1e-6 * 3 * 50) ** 2)
    assert found.largest_mm == pytest.approx(by_hand, rel=1e-6)


def test_about_a_fixed_place_a_circle_grows_away_from_it_and_known_growth_that_was_left_is_added_in_full() -> None:
    """Fixed at its rightmost point, which the datum brings to (50, 0), a circle grows by R (1 - cos phi) to a side."""
    left = UncertaintyBudget(temperature_k=0.5, expansion_per_k=11.5e-6, off_reference_k=10.0, compensated=False)
    datum = RigidTransform(np.pi / 2, np.array([3.0, 0.0]))
    found = uncertainty_along(circle(), StatedUncertainty(left, fixed_mm=(0.0, -47.0)), datum)
    phi = found.station_mm / 50.0
    np.testing.assert_allclose(found.lever_mm, 50 * (1 - np.cos(phi)), atol=1e-3)
    np.testing.assert_allclose(found.left_mm, 11.5e-5 * found.lever_mm)
    by_hand = 2 * 11.5e-6 * 0.5 * np.abs(found.lever_mm) + 11.5e-5 * np.abs(found.lever_mm)
    np.testing.assert_allclose(found.expanded_mm, by_hand, rtol=1e-12)


def test_the_device_is_what_is_stated_over_the_size_of_the_part_at_a_datum() -> None:
    found = uncertainty_along(circle(), StatedUncertainty(UncertaintyBudget(mpe_mm=0.002, mpe_share=1e-5)), HERE)
    np.testing.assert_allclose(found.standard_mm, (0.002 + 1e-5 * found.size_mm) / np.sqrt(3), rtol=1e-12)
    assert found.size_mm == pytest.approx(100 * np.sqrt(2), rel=1e-4)  # the box around the circle


def test_lines_of_the_budget_are_value_sensitivity_and_share() -> None:
    found = uncertainty_along(nominal_of("goe404"), StatedUncertainty(SOME), None)
    lines, at = {line.name: line for line in found.contributions()}, found.worst
    assert list(lines) == ["repeatability", "device", "tip radius", "temperature", "expansion"]
    assert [line.evaluated for line in lines.values()] == ["A", "B", "B", "B", "B"]
    assert sum(line.share for line in lines.values()) == pytest.approx(1)
    for line in lines.values():
        assert line.standard * line.sensitivity == pytest.approx(line.contributed_mm, rel=1e-12)
        assert line.contributed_mm == pytest.approx(found.parts_mm[line.name][at], rel=1e-9)
    assert lines["device"].value == pytest.approx(0.0018 + found.size_mm / 300e3)
    assert lines["device"].standard == pytest.approx(lines["device"].value / np.sqrt(3))
    assert sum(line.contributed_mm**2 for line in lines.values()) == pytest.approx((found.largest_mm / 2) ** 2)
    only = uncertainty_along(nominal_of("goe404"), StatedUncertainty(UncertaintyBudget(tip_radius_mm=0.001)), None)
    assert [line.name for line in only.contributions()] == ["tip radius"]


def test_a_short_table_tells_the_largest_of_every_stretch() -> None:
    found = uncertainty_along(nominal_of("goe404"), StatedUncertainty(SOME), HERE)
    rows = found.telling_places(50)
    assert len(rows) == 50
    assert found.worst in rows
    assert (np.diff(found.station_mm[rows]) > 0).all()
    stretch = np.minimum((found.station_mm / nominal_of("goe404").length_mm * 50).astype(int), 49)
    for k in range(50):
        assert found.expanded_mm[rows[k]] == found.expanded_mm[stretch == k].max()


def test_what_is_known_before_a_whole_scan_is_what_the_scan_gives() -> None:
    """A scan of 500 points all round, drawn with the reference form: the two ways agree as closely as the noise of a fit is small."""
    points = scan("goe404", 500, np.zeros(500), 0, (0, 0))
    before = uncertainty_along(nominal_of("goe404"), StatedUncertainty(SOME), None)
    after = deviation_uncertainty(points, nominal_of("goe404"), SOME)
    np.testing.assert_allclose(before.at(after.station_mm), after.expanded_mm(), rtol=0.05)
    assert before.largest_mm >= 0.999 * after.expanded_mm().max()


def shares_of(measured: str, count: int = 400) -> Rows:
    """Which of so many points are measured, and how often: the whole, a part of it, or one side far denser."""
    every = np.arange(count)
    kept: dict[str, Rows] = {"whole": every, "60 %": every[: count * 6 // 10], "40 %": every[: count * 4 // 10]}
    return kept[measured] if measured in kept else np.asarray(np.repeat(every, np.where(every < count // 4, 6, 1)))


def judge(
    measured: str, budget: UncertaintyBudget, fit: FitName, rule: RuleName, weights: WeightName, scale: float = 1.0
) -> InspectionResult:
    rows = shares_of(measured)
    points = scan("goe404", 400, scale * reference_form("goe404", 400), 0 if fit == "none" else 31, (0, 0))[rows]
    zone, stated = ToleranceZone(-0.06, 0.06), StatedUncertainty(budget)
    live = LiveInspection(nominal_of("goe404"), zone, fit=fit, rule=rule, weights=weights, uncertainty=stated, provisional=False)
    live.add(points)
    return live.finish()


WAYS: list[tuple[FitName, RuleName, WeightName]] = [
    ("best-fit", "minimum-zone", "arc-length"),
    ("best-fit", "best-fit", "arc-length"),
    ("best-fit", "best-fit", "points"),
    ("minimum-zone", "minimum-zone", "arc-length"),
    ("none", "minimum-zone", "arc-length"),
]


@pytest.mark.parametrize("measured", ["whole", "60 %", "40 %", "dense side"])
@pytest.mark.parametrize("way", WAYS)
def test_no_station_is_less_certain_than_the_u_that_judged(way: tuple[FitName, RuleName, WeightName], measured: str) -> None:
    result = judge(measured, SOME, *way)
    assert result.uncertainty is not None
    used = result.zone.uncertainty_mm
    assert result.uncertainty.expanded_mm.max() <= used
    if way[:2] == ("best-fit", "best-fit"):  # what it depends on which points came
        at_fit = deviation_uncertainty(result.actual_mm, nominal_of("goe404"), SOME, weights=way[2])
        np.testing.assert_allclose(np.sort(result.uncertainty.expanded_mm), np.sort(at_fit.expanded_mm()), rtol=1e-9)
    by_used = ToleranceZone(-0.06, 0.06, used, provable=False).verdicts(result.deviation_mm)
    np.testing.assert_array_equal(result.verdicts, by_used)
    own = np.stack([result.uncertainty.at(result.station_mm), np.full(result.received, used)])
    beyond = np.abs(result.deviation_mm) - 0.06
    told = result.verdicts != Verdict.UNCERTAIN
    assert (np.abs(beyond[told]) >= own[:, told].max(axis=0) - 1e-12).all()


@pytest.mark.parametrize("measured", ["whole", "dense side"])
@pytest.mark.parametrize("way", WAYS[1:])
def test_a_larger_uncertainty_never_makes_a_verdict_more_certain(way: tuple[FitName, RuleName, WeightName], measured: str) -> None:
    for scale in (0.9, 1.25):
        before: InspectionResult | None = None
        for factor in (0.0, 1.0, 9.0):
            budget = replace(SOME, **{name: factor * getattr(SOME, name) for name in ("repeatability_mm", "mpe_mm", "tip_radius_mm")})
            found = judge(measured, budget, *way, scale)
            if before is not None:
                assert found.zone.uncertainty_mm >= before.zone.uncertainty_mm
                assert found.verdict in (before.verdict, Verdict.UNCERTAIN)
                if np.array_equal(found.deviation_mm, before.deviation_mm):  # at the same pose
                    assert np.isin(found.verdicts, (Verdict.UNCERTAIN,)).sum() >= np.isin(before.verdicts, (Verdict.UNCERTAIN,)).sum()
                    assert ((found.verdicts == before.verdicts) | (found.verdicts == Verdict.UNCERTAIN)).all()
            before = found


UNLIKE_A_WHOLE = (200 + np.arange(320)) % 400  # measured of 400: without a stretch of one flank the fit takes the ball's radius for a shift
TIP = StatedUncertainty(UncertaintyBudget(tip_radius_mm=0.004))


def judge_a_part_of_it(zone: ToleranceZone, form: Array) -> InspectionResult:
    live = LiveInspection(nominal_of("goe404"), zone, rule="best-fit", weights="points", uncertainty=TIP, provisional=False)
    live.add(scan("goe404", 400, form, 0, (0, 0))[UNLIKE_A_WHOLE])
    return live.finish()


def test_the_best_fit_of_a_part_of_the_profile_is_judged_by_what_it_is_worth() -> None:
    before, result = uncertainty_along(nominal_of("goe404"), TIP, None), judge_a_part_of_it(ToleranceZone(-0.06, 0.06), np.zeros(400))
    assert result.uncertainty is not None
    assert result.zone.uncertainty_mm == result.uncertainty.largest_mm > 2.5 * before.largest_mm
    assert f"U = {result.zone.uncertainty_mm:g} mm" in result.zone.decision_rule


def test_the_order_of_the_points_does_not_change_u() -> None:
    rng, points = np.random.default_rng(3), scan("goe404", 400, reference_form("goe404", 400), 0, (0, 0))[UNLIKE_A_WHOLE]
    found = []
    for rows in (np.arange(320), rng.permutation(320)):
        live = LiveInspection(nominal_of("goe404"), ToleranceZone(-0.09, 0.09), rule="best-fit", uncertainty=TIP, fit="best-fit")
        live.add(points[rows])
        found.append(live.finish())
    assert found[0].zone == found[1].zone or found[0].zone.uncertainty_mm == pytest.approx(found[1].zone.uncertainty_mm, rel=1e-9)
    assert found[0].verdict == found[1].verdict


def test_nothing_is_proven_to_conform_where_u_came_out_larger_than_the_zone_allows() -> None:
    """The zone leaves room for what was known before, and not for what the best fit of a part of the profile is worth."""
    for dent, verdict in ((0.0, Verdict.UNCERTAIN), (0.5, Verdict.NONCONFORM)):
        result = judge_a_part_of_it(ToleranceZone(-0.016, 0.016), np.where(np.arange(400) == 300, -dent, 0.0))
        assert result.zone.uncertainty_mm > 0.016
        assert result.verdict is verdict
        assert not (result.verdicts == Verdict.CONFORM).any()


def test_where_the_u_that_judges_is_not_known_yet_no_proof_is_sought_on_the_way() -> None:
    form = np.where(np.arange(400) < 40, 0.5, 0.0)
    cases: list[tuple[RuleName, bool]] = [("minimum-zone", True), ("best-fit", False)]
    for rule, sought in cases:
        live = LiveInspection(nominal_of("goe404"), ToleranceZone(-0.06, 0.06), rule=rule, uncertainty=StatedUncertainty(SOME))
        live.add(scan("goe404", 400, form, 0, (0, 0)))
        assert (live.prefix() is not None) is sought


def test_with_a_datum_the_live_verdict_is_the_final_one_by_a_budget_as_well() -> None:
    live = LiveInspection(nominal_of("goe404"), ToleranceZone(-0.05, 0.05), fit="none", uncertainty=StatedUncertainty(SOME))
    update = live.add(scan("goe404", 400, 1.5 * reference_form("goe404", 400), 0, (0, 0)))
    assert set(np.unique(update.verdicts)) == {Verdict.CONFORM, Verdict.UNCERTAIN, Verdict.NONCONFORM}
    np.testing.assert_array_equal(live.finish().verdicts, update.verdicts)


def test_a_budget_and_an_uncertainty_of_the_zone_are_one_too_many() -> None:
    with pytest.raises(ValueError, match=r"either a zone with an uncertainty \(0.004 mm\) or a budget of it"):
        LiveInspection(nominal_of("goe404"), ToleranceZone(-0.05, 0.05, 0.004), uncertainty=StatedUncertainty(SOME))
    with pytest.raises(ValueError, match="leaves nothing provable"):
        LiveInspection(nominal_of("goe404"), ToleranceZone(-0.002, 0.002), uncertainty=StatedUncertainty(SOME))
    for wrong in (0.0, float("nan")):
        with pytest.raises(ValueError, match="coverage factor"):
            StatedUncertainty(SOME, wrong)
    with pytest.raises(ValueError, match="fixed place"):
        StatedUncertainty(SOME, fixed_mm=(0.0, float("inf")))


def test_of_points_exactly_at_the_limit_no_more_are_told_wrong_than_the_coverage_factor_says() -> None:
    """A point whose true deviation is a hair out conforms by mistake in 2.3 % of draws by k = 2, and one a hair in is out as rarely."""
    rng, found = np.random.default_rng(21), uncertainty_along(nominal_of("goe404"), StatedUncertainty(SOME), HERE)
    zone, at = ToleranceZone(-0.05, 0.05, found.largest_mm), found.worst
    drawn = 0.05 + found.standard_mm[at] * rng.normal(0, 1, 40_000)
    told = zone.verdicts(drawn)
    for wrong in (Verdict.CONFORM, Verdict.NONCONFORM):
        assert (told == wrong).mean() == pytest.approx(0.02275, abs=4 * np.sqrt(0.02275 / 40_000))


def test_the_result_says_how_much_noise_raises_the_largest_deviation() -> None:
    """By the printed case, noise of 0.003 mm, against the sum over all points one by one; with 50,000 points it takes no longer."""
    stated = StatedUncertainty(UncertaintyBudget(repeatability_mm=0.003))
    found = {}
    for count in (500, 50_000):
        live = LiveInspection(nominal_of("goe404"), ToleranceZone(-0.06, 0.06), fit="none", uncertainty=stated, provisional=False)
        live.add(scan("goe404", count, reference_form("goe404", count), 0, (0, 0)))
        found[count] = live.finish()
    one_by_one = largest_by_noise_mm(found[500].deviation_mm, 0.003)
    assert found[500].largest_by_noise_mm == pytest.approx(one_by_one, abs=3e-5)
    assert one_by_one > 0.002
    assert found[50_000].largest_by_noise_mm > found[500].largest_by_noise_mm + 0.002
    by_counts = largest_by_noise_mm([0.01, 0.02, 0.03], 0.003, [1, 5, 3])
    assert by_counts == pytest.approx(largest_by_noise_mm([0.01] + [0.02] * 5 + [0.03] * 3, 0.003))
