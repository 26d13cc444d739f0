"""The end of a scan: all points registered together and judged there, and why that may be refused."""

from typing import Any

import numpy as np
import pytest

from inspection import LiveInspection, NotMeasured, RegistrationError, Rejection, SectionPlane, Verdict, fit_minimum_zone, register
from tests.inspection import profiles
from tests.inspection.oracle import closest_point
from tests.inspection.profiles import curve_of, nominal_of
from tests.inspection.scans import ZONE, inspect_in_batches, surface


def test_final_result_is_the_registration_and_deviations_of_all_points_together() -> None:
    truth, _ = surface("P3", 500, 3)
    points = profiles.rotated(truth, 77.0, (1.0, 2.0))
    _, result = inspect_in_batches(nominal_of("P3"), points, 50)
    pose = result.registration.nominal_from_section
    best = register(points, nominal_of("P3"), weights="arc-length").nominal_from_section
    assert np.linalg.norm(pose.apply(points) - best.apply(points), axis=1).max() < 1e-9
    exact = closest_point(curve_of("P3"), pose.apply(points))
    assert np.abs(result.deviation_mm + exact.left_mm).max() < 1e-11
    assert result.rms_mm == pytest.approx(np.sqrt(np.mean(exact.left_mm**2)), abs=1e-11)
    assert result.max_deviation_mm == pytest.approx(-exact.left_mm.min(), abs=1e-11)
    assert result.min_deviation_mm == pytest.approx(-exact.left_mm.max(), abs=1e-11)
    assert result.profile_error_mm == pytest.approx(2 * np.abs(exact.left_mm).max(), abs=1e-11)
    assert result.worst == np.abs(exact.left_mm).argmax()
    assert result.verdict is Verdict.CONFORM
    assert result.complete
    assert result.coverage > 0.98


def test_minimum_zone_result_is_the_minimum_zone_fit() -> None:
    truth, _ = surface("P2", 400, 4)
    points = profiles.rotated(truth, 77.0, (1.0, 2.0))
    _, result = inspect_in_batches(nominal_of("P2"), points, 50, fit="minimum-zone")
    assert result.profile_error_mm == pytest.approx(fit_minimum_zone(points, nominal_of("P2")).zone_mm, abs=1e-9)


def test_a_tenth_of_gross_outliers_is_found_and_moves_nothing() -> None:
    for name in ("P3", "NACA 2412 sharp"):
        rng = np.random.default_rng(6)
        truth, _ = surface(name, 1000, 7)
        bad = np.zeros(1000, dtype=bool)
        bad[rng.choice(np.arange(5, 995), 100, replace=False)] = True
        normal = profiles.left_normal(curve_of(name), profiles.even_in_arc_length(curve_of(name), 1000))
        spoiled = truth.copy()
        spoiled[bad] += (rng.choice([-1.0, 1.0], 100) * rng.uniform(0.3, 3.0, 100))[:, None] * normal[bad]
        points = profiles.rotated(spoiled, 120.0, (15.0, -15.0))
        _, result = inspect_in_batches(nominal_of(name), points, 100, reject_outliers=True)
        flagged = result.rejection == Rejection.OUTLIER
        # at a thin edge a point thrown through the part may land on its other side, where nobody can tell
        hidden = np.abs(closest_point(curve_of(name), spoiled).left_mm) < 0.15
        assert flagged[bad & ~hidden].mean() >= 0.99, name
        assert not flagged[~bad].any(), name
        clean = register(points[~bad], nominal_of(name)).nominal_from_section
        moved = result.registration.nominal_from_section.apply(points) - clean.apply(points)
        assert np.linalg.norm(moved[~bad], axis=1).max() < 2e-3, name
        if not (bad & hidden).any():
            assert result.verdict is Verdict.UNCERTAIN, name  # what was rejected was not judged
        _, unspoiled = inspect_in_batches(nominal_of(name), profiles.rotated(truth, 120.0), 100, reject_outliers=True)
        assert unspoiled.verdict is Verdict.CONFORM, name


def test_points_within_the_zone_are_no_outliers_however_exact_the_others_are() -> None:
    curve = curve_of("P3")
    u = profiles.even_in_arc_length(curve, 2000)
    for noise_mm, bump_mm in ((0.0, 0.0), (1e-6, 0.03), (0.001, 0.03)):
        form = np.random.default_rng(8).normal(0, noise_mm, 2000)
        form[300:400] += bump_mm
        form[[700, 1500]] += (0.8, -0.8)
        _, result = inspect_in_batches(nominal_of("P3"), profiles.offset_points(curve, u, form), 250, reject_outliers=True)
        assert np.flatnonzero(result.rejection).tolist() == [700, 1500]
        assert result.verdict is Verdict.UNCERTAIN


def test_half_a_scan_is_judged_but_proves_no_conformity() -> None:
    points, _ = surface("P3", 600, 8)
    live = LiveInspection(nominal_of("P3"), ZONE, coverage_min=0.9)
    live.add(points[:300])
    result = live.finish()
    assert result.coverage == pytest.approx(0.5, abs=0.02)
    assert result.verdict is Verdict.UNCERTAIN
    cut = LiveInspection(nominal_of("P3"), ZONE)
    cut.add(points)
    assert cut.finish(complete=False).verdict is Verdict.UNCERTAIN
    bad, _ = surface("P3", 600, 8, defect_mm=0.5)
    broken = LiveInspection(nominal_of("P3"), ZONE, fit="none")
    broken.add(bad[:300])
    result = broken.finish(complete=False)
    assert result.verdict is Verdict.NONCONFORM
    assert not result.complete


def refusal(points: profiles.Array, **options: Any) -> str:
    live = LiveInspection(nominal_of("P1"), ZONE, **options)
    live.add(points)
    with pytest.raises(NotMeasured) as caught:
        live.finish()
    return str(caught.value)


def test_points_that_do_not_fit_are_refused_with_the_likely_cause() -> None:
    points, _ = surface("P1", 300, 9)
    with pytest.raises(RegistrationError, match=r"^5 points: a registration needs at least 8$"):
        inspect_in_batches(nominal_of("P1"), points[:5], 5)
    assert "fit the nominal only mirrored" in refusal(points[:, ::-1])
    assert "are the x and y columns swapped" in refusal(points[:, ::-1])
    assert "--nominal-unit inch" in refusal(25.4 * points)
    assert "the points do not fit the nominal" in refusal(np.random.default_rng(1).normal(0, 40, (300, 2)))
    plane = SectionPlane(np.zeros(3), np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]))
    off = refusal(plane.to_machine(points, 2.0), section=plane, off_section_max_mm=0.5)
    assert off.startswith("300 of 300 points lie farther than 0.5 mm from the plane of the section")


def test_a_settled_scan_can_go_on() -> None:
    points, _ = surface("P3", 400, 3)
    live = LiveInspection(nominal_of("P3"), ZONE)
    live.add(points[:300])
    half = live.finish()
    kept = half.deviation_mm.copy()
    live.add(points[300:])
    whole = live.finish()
    assert np.array_equal(half.deviation_mm, kept)
    assert whole.received == 400
    assert np.array_equal(whole.deviation_mm, inspect_in_batches(nominal_of("P3"), points, 400)[1].deviation_mm)
