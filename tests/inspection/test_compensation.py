"""A warm part, compensated, is the cold part: by closed form, live and at the end, in the plane and in space, with and without a ball."""

import numpy as np
import pytest

from inspection import Compensation, LiveInspection, RigidTransform, SectionPlane, ToleranceZone
from inspection.methods import FitName
from tests.inspection.profiles import Array
from tests.inspection.reference_parts import nominal_of, reference_form, scan

GROWTH = 11.5e-6 * 13.0
FIXED = (30.0, -20.0)
PLANE = SectionPlane(np.array([5.0, -3.0, 40.0]), np.array([1.0, 0.4, 0.1]), np.array([0.2, -0.1, 1.0]))


def warm(cold_mm: Array, fixed_mm: tuple[float, float] = FIXED) -> Array:
    return np.asarray(fixed_mm + (1 + GROWTH) * (cold_mm - fixed_mm))


def cold_scan(count: int = 300, ball_mm: float = 0.0) -> Array:
    return scan("goe404", count, reference_form("goe404", count) + ball_mm, 0, (0, 0))


def test_points_go_back_to_where_they_were() -> None:
    cold, taken_out = cold_scan(), Compensation(GROWTH, FIXED)
    np.testing.assert_allclose(taken_out.apply(warm(cold), PLANE), cold, atol=1e-12)
    heights = np.linspace(-2, 2, len(cold))[:, None] * PLANE.normal
    in_space = PLANE.to_machine(warm(cold)) + heights
    np.testing.assert_allclose(taken_out.apply(in_space, PLANE), PLANE.to_machine(cold) + heights, atol=1e-12)
    assert np.abs(warm(cold) - cold).max() > 0.01  # and that was more than nothing


@pytest.mark.parametrize("in_space", [False, True])
@pytest.mark.parametrize("ball_mm", [0.0, 0.5])
@pytest.mark.parametrize("datum", [None, RigidTransform.identity()])
def test_a_warm_part_is_judged_as_the_cold_one_on_the_way_and_at_the_end(
    in_space: bool, ball_mm: float, datum: RigidTransform | None
) -> None:
    surface = cold_scan()
    ball = cold_scan(ball_mm=ball_mm) - surface  # the ball itself does not grow with the part
    given, expected = warm(surface) + (1 + GROWTH) * ball, surface + ball
    updates, results = [], []
    for points, compensation in ((given, Compensation(GROWTH, FIXED)), (expected, None)):
        tip_mm = ball_mm * (1 + GROWTH if compensation else 1)
        live = LiveInspection(
            nominal_of("goe404"),
            ToleranceZone(-0.05, 0.05),
            datum=datum,
            fit="none" if datum else "best-fit",
            tip_radius_mm=tip_mm,
            section=PLANE,
            compensation=compensation,
        )
        updates.append(live.add(PLANE.to_machine(points) if in_space else points))
        results.append(live.finish())
    np.testing.assert_allclose(updates[0].deviation_mm, updates[1].deviation_mm, atol=1e-9)
    np.testing.assert_allclose(results[0].deviation_mm, results[1].deviation_mm, atol=1e-9)
    assert results[0].verdict == results[1].verdict
    np.testing.assert_array_equal(results[0].verdicts, results[1].verdicts)


def test_after_a_free_fit_the_fixed_place_does_not_matter_and_at_a_datum_it_does() -> None:
    given = warm(cold_scan())
    cases: list[tuple[FitName, bool]] = [("best-fit", False), ("none", True)]
    for fit, matters in cases:
        found = []
        for fixed in (FIXED, (0.0, 0.0)):
            live = LiveInspection(nominal_of("goe404"), ToleranceZone(-0.05, 0.05), fit=fit, compensation=Compensation(GROWTH, fixed))
            live.add(given)
            found.append(live.finish().deviation_mm)
        assert (np.abs(found[0] - found[1]).max() > 1e-3) == matters


def test_a_point_does_not_depend_on_its_batch_and_what_is_no_point_stays_none() -> None:
    points = PLANE.to_machine(cold_scan(101))
    points[7], points[9] = np.nan, 1e308
    whole = Compensation(GROWTH, FIXED).apply(points, PLANE)
    single = np.concatenate([Compensation(GROWTH, FIXED).apply(points[i : i + 1], PLANE) for i in range(101)])
    np.testing.assert_array_equal(whole, single)
    assert not np.isfinite(whole[7]).any()


def test_a_growth_that_no_part_can_have_is_refused() -> None:
    for growth, fixed in ((-1.0, FIXED), (float("nan"), FIXED), (0.0, (0.0, float("inf")))):
        with pytest.raises(ValueError, match="growth"):
            Compensation(growth, fixed)
