"""The closest point of many places against the independent oracle and closed forms."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from inspection import NurbsCurve
from inspection.foot_grid import build_foot_grid
from inspection.kernels import Feet, project
from tests.inspection import profiles
from tests.inspection.kernels.places import grid_of, scattered
from tests.inspection.oracle import Closest, closest_point
from tests.inspection.profiles import Array, curve_of

FIELDS = Feet._fields


def assert_closest(feet: Feet, truth: Closest, points: Array, curve: NurbsCurve) -> None:
    """Distance to 1e-11 mm everywhere; sign, foot, gradient and curvature wherever they are determined."""
    assert np.abs(np.abs(feet.distance_mm) - np.abs(truth.left_mm)).max() < 1e-11
    determined = (np.abs(truth.left_mm) > 1e-9) & (truth.gap_mm > 1e-9) & ~truth.beyond_end
    assert np.array_equal(np.sign(feet.distance_mm[determined]), np.sign(truth.left_mm[determined]))
    flat = (truth.gap_mm > 1e-6) & (np.abs(truth.left_mm * curve.curvature(truth.parameter)) < 0.9)
    assert flat.sum() > len(points) // 2
    size = np.maximum(1.0, np.abs(truth.left_mm))
    # beside a vertex the oracle takes the vertex itself for a foot 1e-8 mm away, which is equally far to the last digit
    beside = np.isin(truth.parameter, [*curve.domain, *curve.corners]) & (feet.vertex == 0)
    assert (np.abs(feet.foot_mm - truth.foot_mm).max(axis=1) < np.where(beside, 1e-8, 1e-11 * size))[flat].all()
    assert np.abs(np.hypot(*feet.gradient.T) - 1).max() < 1e-14
    assert np.abs(feet.foot_mm + feet.distance_mm[:, None] * feet.gradient - points).max() < 1e-11
    assert np.array_equal(feet.vertex == 2, truth.beyond_end)
    inner = feet.vertex == 0
    # at the seam of a closed curve the kernel holds the parameter in its range; `deviations` tells it by where the foot lies
    bound = np.where(inner & np.isin(feet.parameter, curve.domain), 1e-9, 1e-11)
    assert (np.abs(curve.point(feet.parameter) - feet.foot_mm).max(axis=1) < bound).all()
    assert (np.abs(feet.gradient - profiles.left_normal(curve, feet.parameter)).max(axis=1) < 1e-10)[inner & flat].all()
    sharpness = np.maximum(1.0, np.abs(curve.curvature(feet.parameter)))
    jump = np.isclose(feet.parameter[:, None], np.unique(curve.knots), rtol=0, atol=1e-9).any(axis=1)
    assert (np.abs(feet.curvature - curve.curvature(feet.parameter)) < 1e-7 * sharpness)[inner & flat & ~jump].all()
    assert (feet.curvature[~inner] == 0).all()
    assert np.abs(feet.station_mm - curve.station_mm(feet.parameter)).max() < 1e-10


@pytest.mark.parametrize("name", profiles.EVERY)
def test_closest_point_of_every_profile(name: str) -> None:
    curve = curve_of(name)
    points = scattered(curve, np.random.default_rng(31), 50)
    assert_closest(project(points, grid_of(name)), closest_point(curve, points), points, curve)


@pytest.mark.parametrize("name", profiles.FILES + profiles.SECTIONS)
def test_closest_point_of_airfoils(name: str) -> None:
    curve = curve_of(name)
    points = scattered(curve, np.random.default_rng(32), 12)
    assert_closest(project(points, grid_of(name)), closest_point(curve, points), points, curve)


@pytest.mark.parametrize("degree", [1, 2, 3, 4, 5, 6, 7])
@pytest.mark.parametrize("rational", [False, True])
def test_closest_point_of_every_degree(degree: int, rational: bool) -> None:
    rng = np.random.default_rng(33)
    control = np.array(profiles.P2_POINTS, dtype=float)
    curve = profiles.clamped(degree, control, rng.uniform(0.6, 1.6, len(control)) if rational else None)
    points = scattered(curve, rng, 20)
    assert_closest(project(points, build_foot_grid(curve)), closest_point(curve, points), points, curve)


@pytest.mark.parametrize("name", ["P1", "P3", "ellipse", "square", "NACA 2412 sharp", "NACA 4412 blunt", "stadium"])
def test_no_point_of_the_curve_is_closer_among_many(name: str) -> None:
    # 60,000 places, so that cells of every kind are met: a dense sample of the curve bounds the distance from above
    curve, rng = curve_of(name), np.random.default_rng(34)
    dense = curve.point(np.linspace(*curve.domain, 40_001))
    places = np.vstack(
        [
            dense[rng.integers(0, len(dense), 45_000)] + rng.normal(0, 0.5, (45_000, 2)),
            dense[rng.integers(0, len(dense), 15_000)] + rng.normal(0, 3, (15_000, 2)),
        ]
    )
    feet = project(places, grid_of(name))
    assert (np.abs(feet.distance_mm) <= cKDTree(dense).query(places)[0] + 1e-12).all()
    assert np.abs(curve.point(feet.parameter) - feet.foot_mm).max() < 1e-11
    assert np.abs(np.hypot(*(places - feet.foot_mm).T) - np.abs(feet.distance_mm)).max() < 1e-12


def test_distance_from_a_circle() -> None:
    rng = np.random.default_rng(35)
    angle, radius = rng.uniform(0, 2 * np.pi, 4000), np.concatenate([rng.uniform(1e-3, 25, 2000), rng.uniform(25, 2500, 2000)])
    direction = np.column_stack([np.cos(angle), np.sin(angle)])
    points = radius[:, None] * direction
    radius = np.hypot(*points.T)
    for clockwise, sign in ((False, 1.0), (True, -1.0)):
        feet = project(points, build_foot_grid(profiles.circle(25.0, clockwise)))
        assert (np.abs(feet.distance_mm - sign * (25.0 - radius)) < 1e-13 * np.maximum(1, radius)).all()
        assert np.abs(feet.gradient + sign * points / radius[:, None]).max() < 1e-10
        assert np.abs(feet.curvature - sign / 25.0).max() < 5e-11


def test_distance_from_an_ellipse_of_points_on_its_normals() -> None:
    rng = np.random.default_rng(36)
    a, b = 50.0, 20.0
    angle = rng.uniform(0, 2 * np.pi, 4000)
    foot = np.column_stack([a * np.cos(angle), b * np.sin(angle)])
    outward = np.column_stack([b * np.cos(angle), a * np.sin(angle)])
    outward /= np.hypot(*outward.T)[:, None]
    distance = rng.uniform(-0.95 * b * b / a, 30.0, 4000)  # as deep as the tightest centre of curvature
    feet = project(foot + distance[:, None] * outward, build_foot_grid(profiles.ellipse(a, b)))
    assert np.abs(feet.distance_mm + distance).max() < 1e-12
    assert np.abs(feet.foot_mm - foot).max() < 2e-11
    assert np.abs(feet.gradient + outward).max() < 1e-11


def test_distance_from_a_square_is_that_from_its_sides_and_corners() -> None:
    rng = np.random.default_rng(37)
    points = rng.uniform(-30, 30, (4000, 2))
    beyond = np.maximum(np.abs(points) - 20.0, 0.0)
    outside = np.hypot(*beyond.T)
    inside = np.min(20.0 - np.abs(points), axis=1)
    feet = project(points, build_foot_grid(profiles.square(40.0)))  # counter-clockwise: left is inside
    assert np.abs(feet.distance_mm - np.where(outside > 0, -outside, inside)).max() < 1e-13
    cone = (beyond > 0).all(axis=1)
    assert np.array_equal(feet.vertex == 1, cone)
    assert np.array_equal(np.abs(feet.foot_mm[cone]), np.full((cone.sum(), 2), 20.0))
    assert np.abs(feet.gradient[cone] + np.sign(points[cone]) * beyond[cone] / outside[cone, None]).max() < 1e-14
    assert set(feet.parameter[cone]) <= {0.0, 0.25, 0.5, 0.75}
    assert (feet.curvature == 0).all()


def test_a_corner_itself_has_the_bisector_for_its_gradient() -> None:
    feet = project(np.array([(20.0, 20.0), (-20.0, -20.0)]), build_foot_grid(profiles.square(40.0)))
    assert np.abs(feet.distance_mm).max() < 1e-14
    assert np.abs(feet.gradient + np.array([(1, 1), (-1, -1)]) / np.sqrt(2)).max() < 1e-14
    assert feet.vertex.tolist() == [1, 1]


def test_points_past_an_open_end_are_signed_by_the_normal_there() -> None:
    curve = profiles.clamped(1, [(0, 0), (10, 0)])
    feet = project(
        np.array([(-3.0, 4.0), (-3.0, -4.0), (13.0, 4.0), (13.0, -4.0), (0.0, 2.0), (10.0, -2.0), (0.0, 0.0), (10.0, 0.0)]),
        build_foot_grid(curve),
    )
    assert np.abs(feet.distance_mm - [5, -5, 5, -5, 2, -2, 0, 0]).max() < 1e-14
    assert np.abs(feet.gradient[:4] - [(-0.6, 0.8), (0.6, 0.8), (0.6, 0.8), (-0.6, 0.8)]).max() < 1e-14
    assert np.abs(feet.gradient[4:] - (0.0, 1.0)).max() < 1e-14
    assert feet.vertex.tolist() == [2, 2, 2, 2, 0, 0, 0, 0]
    assert np.abs(feet.station_mm - [0, 0, 10, 10, 0, 10, 0, 10]).max() < 1e-14


@pytest.mark.parametrize("name", profiles.EVERY)
def test_points_on_the_curve_have_its_normal(name: str) -> None:
    curve = curve_of(name)
    u = profiles.inner_parameters(curve, 500, np.random.default_rng(38))
    feet = project(curve.point(u), grid_of(name))
    assert np.abs(feet.distance_mm).max() < 1e-13
    assert np.abs(feet.gradient - profiles.left_normal(curve, u)).max() < 1e-11


def test_the_centre_of_a_circle_is_a_radius_from_wherever_its_foot_is() -> None:
    feet = project(np.zeros((1, 2)), build_foot_grid(profiles.circle(25.0)))
    assert feet.distance_mm[0] == pytest.approx(25.0, abs=1e-12)
    assert np.hypot(*feet.foot_mm[0]) == pytest.approx(25.0, abs=1e-12)


@settings(max_examples=15, deadline=None)
@given(
    name=st.sampled_from(["P1", "P2", "P3", "ellipse", "NACA 2412 sharp"]),
    angle=st.floats(-180, 180),
    shift=st.tuples(st.floats(-300, 300), st.floats(-300, 300)),
)
def test_moving_curve_and_points_together_moves_the_feet(name: str, angle: float, shift: tuple[float, float]) -> None:
    curve = curve_of(name)
    points = profiles.offset_points(
        curve, profiles.inner_parameters(curve, 150, np.random.default_rng(39)), np.random.default_rng(40).uniform(-1, 1, 150)
    )
    there = profiles.moved_curve(curve, angle, shift)
    a, b = project(points, grid_of(name)), project(profiles.rotated(points, angle, shift), build_foot_grid(there))
    assert np.abs(a.distance_mm - b.distance_mm).max() < 2e-12
    assert np.abs(profiles.rotated(a.foot_mm, angle, shift) - b.foot_mm).max() < 1e-10
    assert np.abs(profiles.rotated(a.gradient, angle) - b.gradient).max() < 1e-10


@pytest.mark.parametrize("name", ["P2", "P3", "MH42 sharp", "NACA 4412 blunt", "square"])
def test_no_bit_depends_on_batch_order_or_threads(name: str) -> None:
    curve, grid, rng = curve_of(name), grid_of(name), np.random.default_rng(41)
    points = np.vstack([scattered(curve, rng, 1500), rng.uniform(-100, 150, (500, 2)), [(np.nan, 0.0), (np.inf, 1.0)]])
    whole = project(points, grid, threads=1)
    many = project(np.vstack([points] * 6), grid, threads=3)
    order = rng.permutation(len(points))
    shuffled = project(points[order], grid)
    sizes = (1, 3, 8, 100, 129, 1000)
    cuts = np.cumsum(np.resize(sizes, 200))
    pieces = [project(part, grid) for part in np.split(points, cuts[cuts < len(points)])]
    for field in FIELDS:
        wanted = getattr(whole, field)
        assert np.array_equal(getattr(many, field), np.concatenate([wanted] * 6), equal_nan=field != "vertex"), field
        assert np.array_equal(getattr(shuffled, field), wanted[order], equal_nan=field != "vertex"), field
        assert np.array_equal(np.concatenate([getattr(piece, field) for piece in pieces]), wanted, equal_nan=field != "vertex"), field


def test_points_that_are_not_finite_give_nan_and_disturb_no_other() -> None:
    grid = grid_of("P1")
    good = profiles.offset_points(curve_of("P1"), np.linspace(0.1, 0.9, 7), 0.1)
    bad = np.array([(np.nan, 1.0), (1.0, np.inf), (-np.inf, np.nan)])
    feet = project(np.vstack([good, bad]), grid)
    for field in FIELDS[:-1]:
        assert np.isnan(getattr(feet, field)[7:]).all(), field
        assert np.array_equal(getattr(feet, field)[:7], getattr(project(good, grid), field)), field
    assert project(np.empty((0, 2)), grid).foot_mm.shape == (0, 2)


def test_very_far_points_are_at_their_distance() -> None:
    points = np.array([(1e6, 0.0), (0.0, -1e9), (-1e12, 1e12)])
    feet = project(points, build_foot_grid(profiles.circle(25.0)))
    wanted = np.hypot(*points.T) - 25.0
    assert (np.abs(-feet.distance_mm - wanted) <= 1e-15 * wanted).all()
