"""The two laws above every feature, and the reasons of a verdict."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from inspection import InspectionResult, LiveInspection, Missing, ToleranceZone, Verdict
from tests.inspection import profiles
from tests.inspection.profiles import Array, curve_of, nominal_of

NAMES = ("GOE404", "MH42", "P3", "P1")
ZONE = ToleranceZone(-0.05, 0.05)
COUNT = 1500


def scan(name: str, seed: int, defect_mm: float = 0.0, width_mm: float = 1.7, count: int = COUNT) -> tuple[Array, Array]:
    """A scan of a part somewhere in the plane, and the stations of its points; the defect is a step about station 60."""
    curve, nominal, rng = curve_of(name), nominal_of(name), np.random.default_rng(seed)
    u = profiles.even_in_arc_length(curve, count)
    s = curve.station_mm(u)
    form = 0.012 * np.sin(6 * np.pi * s / curve.length_mm + seed) + rng.normal(0, 0.002, count)
    form += defect_mm * (np.abs(s - 60.0) < width_mm)
    points = profiles.offset_points(curve, u, nominal.outward * form)
    return profiles.rotated(points, float(rng.uniform(-180, 180)), rng.uniform(-50, 50, 2)), s


def inspect(name: str, points: Array, missing: Missing | None = None, complete: bool = True, **options: Any) -> InspectionResult:
    live = LiveInspection(nominal_of(name), ZONE, coverage_min=0.95, provisional=False, **options)
    live.add(points)
    return live.finish(complete, missing)


def kinds(result: InspectionResult) -> list[str]:
    return [reason.kind for reason in result.reasons]


@pytest.mark.parametrize("name", NAMES)
def test_a_good_part_conforms_and_a_step_of_half_a_millimetre_does_not(name: str) -> None:
    good = inspect(name, scan(name, 1)[0])
    assert (good.verdict, good.reasons) == (Verdict.CONFORM, ())
    bad = inspect(name, scan(name, 1, 0.5)[0])
    assert bad.verdict is Verdict.NONCONFORM
    assert kinds(bad)[0] == "out-of-tolerance"


# ---- law I: what is missing never improves a verdict

LOSSES = {
    "lost": lambda number: Missing(lost=number),
    "damaged": lambda number: Missing(damaged_bytes=30 * number),
    "rejected": lambda number: Missing(rejected={"marked invalid by the device": number}),
    "announced": lambda number: Missing(announced=COUNT, arrived=COUNT - number),
}


@pytest.mark.parametrize("loss", LOSSES)
@pytest.mark.parametrize("name", ["GOE404", "P3"])
def test_a_defect_whose_points_are_missing_never_conforms(name: str, loss: str) -> None:
    points, s = scan(name, 2, 0.5)
    seen = np.abs(s - 60.0) >= 1.7
    missing = LOSSES[loss](int((~seen).sum()))
    assert inspect(name, points[seen], missing).verdict is Verdict.UNCERTAIN
    # a step that is narrower than the largest gap allowed is hidden only because somebody allows it
    narrow, s = scan(name, 2, 0.5, width_mm=0.6)
    seen = np.abs(s - 60.0) >= 0.6
    missing = LOSSES[loss](int((~seen).sum()))
    result = inspect(name, narrow[seen], missing)
    assert result.verdict is Verdict.UNCERTAIN
    assert len(kinds(result)) == 1
    assert inspect(name, narrow[seen], missing, allow_unseen_mm=2.0).verdict is Verdict.CONFORM
    assert inspect(name, narrow[seen], missing, allow_unseen_mm=0.5).verdict is Verdict.UNCERTAIN


@settings(max_examples=20, deadline=None)
@given(
    name=st.sampled_from(NAMES),
    seed=st.integers(0, 5),
    defect=st.sampled_from([0.0, 0.02, 0.045, 0.3]),
    lost=st.integers(0, 300),
    damaged=st.integers(0, 3),
    rejected=st.integers(0, 3),
    complete=st.booleans(),
)
def test_what_is_said_to_be_missing_never_improves_a_verdict(
    name: str, seed: int, defect: float, lost: int, damaged: int, rejected: int, complete: bool
) -> None:
    points, _ = scan(name, seed, defect, count=600)
    missing = Missing(lost, damaged, {"marked invalid by the device": rejected} if rejected else {})
    without, with_them = inspect(name, points), inspect(name, points, missing, complete)
    assert with_them.verdict >= without.verdict
    if lost or damaged or rejected or not complete:
        assert with_them.verdict is not Verdict.CONFORM


@settings(max_examples=20, deadline=None)
@given(name=st.sampled_from(NAMES), seed=st.integers(0, 5), kept=st.integers(8, 600), first=st.integers(0, 599))
def test_silently_absent_points_hide_at_most_the_gap_that_is_stated(name: str, seed: int, kept: int, first: int) -> None:
    points, _ = scan(name, seed, count=600)
    rng = np.random.default_rng(first)
    rows = np.sort(rng.permutation(600)[:kept]) if first % 2 else (first + np.arange(kept)) % 600
    result = inspect(name, points[rows])
    if result.verdict is Verdict.CONFORM:
        assert result.gap.length_mm <= result.gap_max_mm * (1 + 1e-9)
        assert result.gap_max_mm == pytest.approx(nominal_of(name).length_mm / 100)


# ---- law II: order, density and batches change nothing


@settings(max_examples=15, deadline=None)
@given(
    name=st.sampled_from(NAMES),
    seed=st.integers(0, 5),
    defect=st.sampled_from([0.0, 0.0, 0.2, 0.5]),
    dwell=st.integers(0, 599),
    batch=st.integers(1, 700),
)
def test_order_density_and_batches_never_change_the_verdict(name: str, seed: int, defect: float, dwell: int, batch: int) -> None:
    points, _ = scan(name, seed, defect, count=600)
    expected = inspect(name, points)
    rng = np.random.default_rng(dwell)
    repeated = np.concatenate([points, np.repeat(points[dwell : dwell + 1], 500, axis=0), points[rng.integers(0, 600, 300)]])
    live = LiveInspection(nominal_of(name), ZONE, coverage_min=0.95)
    mixed = rng.permutation(repeated)
    for start in range(0, len(mixed), batch):
        live.add(mixed[start : start + batch])
    found = live.finish()
    assert found.verdict is expected.verdict
    assert found.coverage == pytest.approx(expected.coverage, abs=1e-3)
    assert found.max_deviation_mm == pytest.approx(expected.max_deviation_mm, abs=1e-4)
    assert found.min_deviation_mm == pytest.approx(expected.min_deviation_mm, abs=1e-4)


# ---- what was not measured


def test_coverage_does_not_depend_on_density() -> None:
    points, _ = scan("GOE404", 3, count=45)
    even = inspect("GOE404", points)
    dwelt = inspect("GOE404", np.concatenate([points, np.repeat(points[7:8], 46, axis=0)]))
    assert dwelt.coverage == pytest.approx(even.coverage, abs=1e-9)
    assert dwelt.verdict is even.verdict
    stated = inspect("GOE404", np.concatenate([points, np.repeat(points[7:8], 46, axis=0)]), gap_max_mm=6.0)
    assert stated.verdict is Verdict.CONFORM
    assert stated.coverage == pytest.approx(1.0)


def test_few_points_and_many_holes_are_no_whole_measurement() -> None:
    twelve, _ = scan("GOE404", 4, count=12)
    assert inspect("GOE404", twelve).verdict is Verdict.UNCERTAIN
    assert inspect("GOE404", twelve).coverage < 0.2
    points, s = scan("GOE404", 4, count=4000)
    length = nominal_of("GOE404").length_mm
    holes = inspect("GOE404", points[(s % (length / 10)) >= 0.019 * length])
    assert holes.verdict is Verdict.UNCERTAIN
    assert holes.coverage == pytest.approx(0.81, abs=0.01)
    assert kinds(holes) == ["coverage", "gap"]
    assert holes.gap.length_mm == pytest.approx(0.019 * length, abs=0.2)


def test_points_beyond_an_end_keep_a_part_from_conforming() -> None:
    points, _ = scan("P1", 5)
    curve = curve_of("P1")
    u = profiles.even_in_arc_length(curve, COUNT)
    tangent = curve.derivatives(u[-1:], 1)[1][0] / np.hypot(*curve.derivatives(u[-1:], 1)[1][0])
    good = curve.point(u)
    for reach, expected in ((0.03, Verdict.CONFORM), (2.0, Verdict.UNCERTAIN)):
        burr = good[-1] + np.linspace(0.01, reach, 60)[:, None] * tangent
        result = inspect("P1", np.vstack([good, burr]))
        assert result.verdict is expected
        assert kinds(result) == ([] if expected is Verdict.CONFORM else ["ends"])
        assert inspect("P1", np.vstack([good, burr]), end_allowance_mm=2.5).verdict is Verdict.CONFORM
    assert len(points) == COUNT


# ---- the rule


def test_the_fit_aims_at_the_middle_of_the_zone() -> None:
    """Zone 0 .. 0.1 and true deviations of 0.02 .. 0.08: inside, though the best fit about zero puts half of the points out."""
    nominal, curve = nominal_of("GOE404"), curve_of("GOE404")
    u = profiles.even_in_arc_length(curve, 800)
    form = 0.05 + 0.03 * np.sin(8 * np.pi * curve.station_mm(u) / curve.length_mm)
    live = LiveInspection(nominal, ToleranceZone(0.0, 0.1), coverage_min=0.95)
    live.add(profiles.rotated(profiles.offset_points(curve, u, nominal.outward * form), 40.0, (3.0, 4.0)))
    result = live.finish()
    assert result.verdict is Verdict.CONFORM
    assert result.fit == "best-fit"
    assert result.zone_error_mm <= 0.1 < result.profile_error_mm
    # least squares about the middle: nowhere worse than the true placement, whose deviations are a wave of 0.03 about it
    assert np.sqrt(np.mean((result.deviation_mm - 0.05) ** 2)) <= 0.03 / np.sqrt(2) + 1e-4


def test_a_part_that_fails_at_best_fit_is_judged_at_the_minimum_zone() -> None:
    """A sharp crest on one side: least squares leaves it out of the zone, another placement takes it in."""
    nominal, curve = nominal_of("GOE404"), curve_of("GOE404")
    u = profiles.even_in_arc_length(curve, 1000)
    s = curve.station_mm(u)
    form = 0.075 * np.exp(-(((s - 60.0) / 6.0) ** 2)) + 0.075 * np.exp(-(((s - 75.0) / 6.0) ** 2))
    points = profiles.rotated(profiles.offset_points(curve, u, nominal.outward * form), 40.0, (3.0, 4.0))
    results = {}
    for rule in ("minimum-zone", "best-fit"):
        live = LiveInspection(nominal, ZONE, coverage_min=0.95, rule=rule)
        live.add(points)
        results[rule] = live.finish()
    assert results["best-fit"].verdict is Verdict.NONCONFORM
    assert results["minimum-zone"].verdict is Verdict.CONFORM
    assert results["minimum-zone"].fit == "minimum-zone"
    assert results["minimum-zone"].minimum_zone_mm <= 0.1 < results["minimum-zone"].best_fit_error_mm


def test_dwelling_does_not_move_the_pose() -> None:
    points, _ = scan("MH42", 6)
    dwelt = np.concatenate([points, np.repeat(points[700:701], 3000, axis=0)])
    poses = [inspect("MH42", p).registration.nominal_from_section.apply(points) for p in (points, dwelt)]
    assert np.abs(poses[0] - poses[1]).max() < 1e-4


def test_the_reasons_are_in_the_order_of_their_weight_and_whole_sentences() -> None:
    points, s = scan("P3", 7)
    result = inspect("P3", points[s > 20.0], Missing(lost=12, damaged_bytes=5), complete=False)
    assert kinds(result) == ["incomplete", "missing", "coverage", "gap"]
    assert all(reason.words[0].isupper() or reason.words[0].isdigit() for reason in result.reasons)
    assert all(reason.words.endswith(".") for reason in result.reasons)
    assert "12 points were lost and 5 bytes were damaged on the line" in result.reasons[1].words
