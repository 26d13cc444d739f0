"""The oracle itself, held against closed forms and against brute force, before it is trusted as the truth."""

import numpy as np
import pytest

from inspection import NurbsCurve
from tests.inspection import profiles
from tests.inspection.oracle import Array, closest_point


def ellipse_distance(a: float, b: float, point: Array) -> float:
    """Unsigned distance to an ellipse: all real roots of the quartic in t = tan(angle / 2) of the stationary feet."""
    x, y = point
    # with c = (1 - t^2)/(1 + t^2) and s = 2 t/(1 + t^2): (a^2 - b^2) c s - a x s + b y c = 0
    e = a * a - b * b
    roots = np.roots([-b * y, -2 * (e + a * x), 0.0, 2 * (e - a * x), b * y])
    t = roots[np.abs(roots.imag) < 1e-6].real
    angle = np.append(2 * np.arctan(t), np.pi)
    for _ in range(4):
        f = e * np.cos(angle) * np.sin(angle) - a * x * np.sin(angle) + b * y * np.cos(angle)
        slope = e * np.cos(2 * angle) - a * x * np.cos(angle) - b * y * np.sin(angle)
        angle = angle - f / slope
    return float(np.hypot(a * np.cos(angle) - x, b * np.sin(angle) - y).min())


def test_circle_distance_is_radius_minus_distance_to_the_centre() -> None:
    rng = np.random.default_rng(1)
    points = rng.uniform(-60, 60, (300, 2))
    truth = 37.5 - np.linalg.norm(points, axis=1)
    found = closest_point(profiles.circle(37.5), points)
    assert np.abs(found.left_mm - truth).max() < 1e-13 * 100
    assert np.abs(closest_point(profiles.circle(37.5, clockwise=True), points).left_mm + truth).max() < 1e-13 * 100


def test_ellipse_distance_is_the_smallest_root_of_its_quartic() -> None:
    rng = np.random.default_rng(2)
    points = rng.uniform((-60, -30), (60, 30), (200, 2))
    truth = np.array([ellipse_distance(50.0, 20.0, p) for p in points])
    inside = (points[:, 0] / 50) ** 2 + (points[:, 1] / 20) ** 2 < 1
    found = closest_point(profiles.ellipse(50.0, 20.0), points).left_mm
    assert np.abs(found - np.where(inside, truth, -truth)).max() < 1e-12


def test_square_distance_has_its_closed_form_inside_and_around_the_corners() -> None:
    rng = np.random.default_rng(3)
    points = rng.uniform(-40, 40, (300, 2))
    q = np.abs(points) - 20.0
    outside = np.linalg.norm(np.maximum(q, 0), axis=1)
    truth = np.where((q < 0).all(axis=1), -q.max(axis=1), -outside)
    assert np.abs(closest_point(profiles.square(40.0), points).left_mm - truth).max() < 1e-13 * 100


def test_offset_points_give_back_foot_and_distance() -> None:
    rng = np.random.default_rng(4)
    for make in profiles.SMOOTH.values():
        curve = make()
        u = profiles.inner_parameters(curve, 200, rng)
        offset = rng.normal(0, 0.05, 200)
        found = closest_point(curve, profiles.offset_points(curve, u, offset))
        assert np.abs(found.left_mm - offset).max() < 1e-12
        assert np.abs(found.parameter - u).max() < 1e-13
        assert not found.beyond_end.any()


def test_points_past_an_open_end_are_marked() -> None:
    curve = profiles.p1()
    start, end = curve.derivatives(np.array([0.0, 1.0]), 1).transpose(1, 0, 2)
    along = [v[1] / np.linalg.norm(v[1]) for v in (start, end)]
    points = np.array([start[0] - 0.3 * along[0], start[0] + 0.3 * along[0], end[0] + 0.3 * along[1], end[0] - 0.3 * along[1]])
    found = closest_point(curve, points)
    assert found.beyond_end.tolist() == [True, False, True, False]
    assert np.abs(np.abs(found.left_mm[[0, 2]]) - 0.3).max() < 1e-13


@pytest.mark.parametrize("name", profiles.EVERY)
def test_no_sample_of_the_curve_is_closer_than_the_foot(name: str) -> None:
    curve = profiles.EVERY[name]()
    rng = np.random.default_rng(5)
    near = profiles.offset_points(curve, profiles.inner_parameters(curve, 60, rng), rng.normal(0, 0.3, 60))
    box = curve.control_points_mm
    far = rng.uniform(box.min(axis=0) - 5, box.max(axis=0) + 5, (60, 2))
    points = np.vstack([near, far])
    samples = curve.point(np.linspace(*curve.domain, 20_001))
    brute = np.array([np.linalg.norm(samples - p, axis=1).min() for p in points])
    found = closest_point(curve, points)
    assert (np.abs(found.left_mm) <= brute + 1e-12).all()
    # the step of the samples bounds from below what a finer search could still find
    step = np.linalg.norm(np.diff(samples, axis=0), axis=1).max()
    assert (np.abs(found.left_mm) >= np.sqrt(np.maximum(brute**2 - brute * step - step**2, 0))).all()
    assert np.abs(np.linalg.norm(points - found.foot_mm, axis=1) - np.abs(found.left_mm)).max() < 1e-12


def test_two_minima_closer_than_an_interval_are_both_seen() -> None:
    # at a simple knot of degree 2 the curvature jumps from 5 to 103 per mm; brute force at a millionth of the range decides
    control = np.array([(0.0, 0.0), (20.0, 0.0), (20.2, 0.0), (24.0, 2.9)])
    curve = NurbsCurve(2, control, np.array([0, 0, 0, 0.459, 1, 1, 1]))
    rng = np.random.default_rng(7)
    u = 0.459 + rng.normal(0, 3e-4, 60)
    radius = 1 / np.abs(curve.curvature(np.array([0.459]))[0])
    points = profiles.offset_points(curve, u, rng.uniform(0.9, 1.2, 60) * radius)
    samples = curve.point(np.linspace(0.44, 0.48, 100_001))
    brute = np.array([np.linalg.norm(samples - p, axis=1).min() for p in points])
    found = np.abs(closest_point(curve, points).left_mm)
    assert (found <= brute + 1e-13).all()
    assert (brute - found).max() < 1e-9
