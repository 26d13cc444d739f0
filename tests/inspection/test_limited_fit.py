"""Fits with locked and limited freedoms: printed values of an independent program, and limits held against locks."""

from functools import cache
from typing import get_args

import numpy as np
import pytest

from inspection import Freedoms, RigidTransform, WeightName, deviations, discretize, register_fine, register_within
from inspection.freedoms import FreedomName
from inspection.rigid import rotation_about
from tests.inspection import profiles
from tests.inspection.profiles import Array
from tests.inspection.reference_parts import nominal_of, reference_form, scan

PIVOT = np.array([40.0, 3.0])
START = RigidTransform.identity()
# Free motions, direction of x in degrees; x, y in mm and rotation in degrees about the pivot; rms and largest deviation.
PRINTED: list[tuple[tuple[FreedomName, ...], float, tuple[float, ...], float, float]] = [
    ((), 0, (0, 0, 0), 0.048226555, 0.090839323),
    (("x", "y", "rotation"), 0, (-0.051616874, 0.034256837, -0.072943424), 0.015419941, 0.050211485),
    (("x", "y"), 0, (-0.113133050, 0.021311842, 0), 0.035522126, 0.065880484),
    (("rotation",), 0, (0, 0, -0.059140583), 0.037494745, 0.071607420),
    (("x",), 0, (-0.109380708, 0, 0), 0.041124623, 0.085171728),
    (("y",), 0, (0, 0.020205077, 0), 0.044043165, 0.086135719),
    (("y", "rotation"), 0, (0, 0.035603938, -0.082971751), 0.018833554, 0.067137563),
    (("x",), 30, (0.013754344, 0.007941074, 0), 0.047473363, 0.098396475),
]


@cache
def part() -> Array:
    """The reference part of 500 points, a little turned about the pivot and shifted."""
    points = scan("goe404", 500, reference_form("goe404", 500), 0, (0, 0))
    return rotation_about(PIVOT, np.radians(0.05), np.array([0.05, -0.03])).apply(points)


@pytest.mark.parametrize(("free", "x_axis_deg", "motion", "rms", "largest"), PRINTED)
def test_reference_values(free: tuple[FreedomName, ...], x_axis_deg: float, motion: tuple[float, ...], rms: float, largest: float) -> None:
    freedoms = Freedoms.about(PIVOT, free, np.radians(x_axis_deg))
    found = register_within(part(), nominal_of("goe404"), START, freedoms)
    x, y, turn = found.amounts @ freedoms.directions
    np.testing.assert_allclose((x, y, np.degrees(turn)), motion, rtol=0, atol=6e-10)
    d = deviations(found.registration.nominal_from_section.apply(part()), nominal_of("goe404"))
    assert found.registration.rms_mm == pytest.approx(rms, abs=6e-10)
    assert np.abs(d.deviation_mm).max() == pytest.approx(largest, abs=6e-10)
    assert (found.registration.converged, found.at_limit) == (True, ())


@pytest.mark.parametrize("weights", get_args(WeightName))
def test_all_freedoms_together_are_the_best_fit(weights: WeightName) -> None:
    points, nominal = part()[np.r_[0:300, 300:500:3]], nominal_of("goe404")
    best = register_fine(points, nominal, START, weights=weights, target_mm=0.01)
    found = register_within(points, nominal, START, Freedoms.about(points.mean(axis=0)), weights=weights, target_mm=0.01).registration
    assert found.rms_mm == pytest.approx(best.rms_mm, abs=1e-12)
    moved = [fit.nominal_from_section.apply(points) for fit in (found, best)]
    np.testing.assert_allclose(moved[0], moved[1], rtol=0, atol=1e-9)
    np.testing.assert_allclose(found.covariance, best.covariance, rtol=1e-4, atol=1e-12)


def test_a_limit_that_binds_is_a_lock_there_and_one_that_does_not_is_none() -> None:
    points, nominal, limit = part(), nominal_of("goe404"), np.radians(0.03)
    within = Freedoms.about(PIVOT, limits={"rotation": (-limit, limit), "x": (-1.0, 1.0)})
    found = register_within(points, nominal, START, within)
    assert (found.at_limit, found.amounts[2]) == (("rotation",), -limit)
    locked = register_within(points, nominal, rotation_about(PIVOT, -limit, np.zeros(2)), Freedoms.about(PIVOT, ("x", "y")))
    np.testing.assert_allclose(found.amounts[:2], locked.amounts, rtol=0, atol=1e-8)
    assert found.registration.rms_mm == pytest.approx(locked.registration.rms_mm, abs=1e-12)
    np.testing.assert_allclose(found.registration.covariance, locked.registration.covariance, rtol=1e-6, atol=1e-15)
    assert (found.registration.covariance[2] == 0).all()
    wide = register_within(points, nominal, START, Freedoms.about(PIVOT, limits={"rotation": (-0.1, 0.1), "y": (-1.0, 1.0)}))
    np.testing.assert_allclose(wide.amounts, register_within(points, nominal, START, Freedoms.about(PIVOT)).amounts, atol=1e-8)
    corner = register_within(
        points, nominal, START, Freedoms.about(PIVOT, limits={"x": (-0.02, 0.0), "y": (0.0, 0.01), "rotation": (0, 0)})
    )
    assert corner.at_limit == ("x", "y", "rotation")
    np.testing.assert_allclose(corner.amounts, [-0.02, 0.01, 0.0], atol=1e-15)


def test_the_covariance_is_that_of_many_noisy_fits() -> None:
    rng, nominal = np.random.default_rng(6), nominal_of("goe404")
    freedoms, sigma = Freedoms.about(PIVOT, ("y", "rotation")), 0.003
    clean = scan("goe404", 200, np.zeros(200), 0, (0, 0))
    normal = deviations(clean, nominal).normal
    fits = [register_within(clean + rng.normal(0, sigma, (200, 1)) * normal, nominal, START, freedoms) for _ in range(300)]
    spread = np.cov(np.array([fit.amounts for fit in fits]).T)
    stated = np.mean([fit.registration.covariance[1:, 1:] for fit in fits], axis=0)
    scale = np.sqrt(np.outer(np.diag(stated), np.diag(stated)))
    assert np.abs((spread - stated) / scale).max() < 0.25  # 300 trials: four standard deviations of a variance are a third


def test_a_rotation_that_changes_nothing_is_left_alone() -> None:
    nominal = discretize(profiles.circle(25.0), samples=1000)
    angle = np.linspace(0, 2 * np.pi, 60, endpoint=False)
    points = 25.02 * np.column_stack([np.cos(angle), np.sin(angle)]) + (0.01, 0.0)
    found = register_within(points, nominal, START, Freedoms.about((0.01, 0), ("x", "rotation")))
    np.testing.assert_allclose(found.amounts, [-0.01, 0.0], atol=1e-9)
    assert np.sqrt(found.registration.covariance[2, 2]) * 25 == pytest.approx(25, rel=0.01)


def test_freedoms_that_contradict_themselves_are_refused() -> None:
    with pytest.raises(ValueError, match="must include zero"):
        Freedoms.about(PIVOT, limits={"x": (0.1, 0.2)})
    with pytest.raises(ValueError, match="only free ones have limits"):
        Freedoms.about(PIVOT, ("x",), limits={"y": (-0.1, 0.2)})
    with pytest.raises(ValueError, match="each once"):
        Freedoms.about(PIVOT, ("x", "x"))
    with pytest.raises(ValueError, match="the pivot must be a point"):
        Freedoms.about((1.0, np.nan))
