"""Deviations against the independent closest point, closed forms, and the published accuracy."""

from collections.abc import Callable
from itertools import pairwise
from typing import Any, get_args

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from inspection import Deviations, Material, Method, NominalProfile, NurbsCurve, deviations, discretize, profile_error_mm
from inspection.kernels import project
from inspection.kernels.layout import INSIDE, OPEN_END
from tests.inspection import profiles
from tests.inspection.oracle import Closest, closest_point
from tests.inspection.profiles import Array, curve_of, moved_curve, nominal_of

METHODS: tuple[Method, ...] = get_args(Method)
POLE_METHODS: tuple[Method, ...] = ("pcp", "veaw")


def signed(truth: Closest, nominal: NominalProfile) -> Array:
    """Deviation out of material, from the distance to the left of travel."""
    return -truth.left_mm if nominal.material == "left" else truth.left_mm


def assert_exact(found: Deviations, truth: Closest, points: Array, nominal: NominalProfile) -> None:
    """Everything that `exact` promises on each point, against the oracle."""
    wanted = signed(truth, nominal)
    assert np.abs(np.abs(found.deviation_mm) - np.abs(wanted)).max() < 1e-11
    assert np.array_equal(found.beyond_end, truth.beyond_end)
    certain = ~truth.beyond_end & (np.abs(wanted) > 1e-9)
    assert np.array_equal(np.sign(found.deviation_mm[certain]), np.sign(wanted[certain]))
    # the foot itself is as sharp as the distance bends: near a centre of curvature it is not, so look where it must be
    curve = nominal.curve
    unique = (truth.gap_mm > 1e-6) & (np.abs(wanted) * np.abs(curve.curvature(truth.parameter)) < 0.9)
    assert unique.any()
    assert np.abs(found.foot_mm - truth.foot_mm)[unique].max() < 1e-10
    first, last = curve.domain
    turn = (found.parameter - truth.parameter)[unique] / (last - first)
    assert np.abs(turn - np.round(turn) if curve.closed else turn).max() < 1e-10
    along = found.station_mm - curve.station_mm(found.parameter)
    assert np.abs(along - np.round(along / curve.length_mm) * curve.length_mm if curve.closed else along).max() < 1e-10
    assert (found.station_mm >= 0).all()
    assert (found.station_mm <= curve.length_mm * (1 + 1e-12)).all()
    assert np.abs(curve.point(found.parameter) - found.foot_mm).max() < 1e-10
    assert np.abs(np.linalg.norm(found.normal, axis=1) - 1).max() < 1e-12
    assert np.abs(((points - found.foot_mm) * found.normal).sum(axis=1) - found.deviation_mm)[certain].max() < 1e-10
    smooth = ~found.at_vertex & unique
    assert np.abs(found.curvature - curve.curvature(found.parameter))[smooth].max() < 1e-6
    assert (found.curvature[found.at_vertex] == 0).all()
    assert found.at_vertex[found.beyond_end].all()


@pytest.mark.parametrize("name", profiles.EVERY)
def test_exact_is_the_globally_closest_point_within_the_band(name: str) -> None:
    rng = np.random.default_rng(11)
    u = np.concatenate(
        [profiles.inner_parameters(curve_of(name), 100, rng, 1e-5), profiles.inner_parameters(curve_of(name), 60, rng, 1e-5)]
    )
    offset = np.concatenate([rng.normal(0, 0.05, 100), rng.uniform(-1, 1, 60)])
    points = profiles.offset_points(curve_of(name), u, offset)
    truth = closest_point(curve_of(name), points)
    for material in get_args(Material):
        nominal = nominal_of(name, material=material)
        assert_exact(deviations(points, nominal), truth, points, nominal)


@pytest.mark.parametrize("name", profiles.EVERY)
def test_exact_is_the_globally_closest_point_far_off_and_across_the_medial_axis(name: str) -> None:
    nominal, rng = nominal_of(name), np.random.default_rng(12)
    box = curve_of(name).point(np.linspace(*curve_of(name).domain, 500))
    points = rng.uniform(box.min(axis=0) - 10, box.max(axis=0) + 10, (150, 2))
    points[:5] += 500.0
    assert_exact(deviations(points, nominal), closest_point(curve_of(name), points), points, nominal)


@pytest.mark.parametrize("name", ["NACA 2412 sharp", "NACA 4412 blunt", "GOE404", "MH42", "MH42 sharp", "SC(2)-0714"])
def test_exact_finds_the_right_branch_at_a_thin_trailing_edge(name: str) -> None:
    curve, nominal, rng = curve_of(name), nominal_of(name, 10_000), np.random.default_rng(13)
    first, last = curve.domain
    near = np.concatenate([first + 0.03 * rng.uniform(0, 1, 80) ** 2, last - 0.03 * rng.uniform(0, 1, 80) ** 2])
    points = profiles.offset_points(curve, near, rng.normal(0, 0.3, 160))
    edge = curve.point(np.array([first]))[0]
    points = np.vstack([points, edge + rng.normal(0, 0.2, (40, 2))])
    assert_exact(deviations(points, nominal), closest_point(curve, points), points, nominal)


def test_exact_needs_no_dense_samples() -> None:
    rng = np.random.default_rng(14)
    for name in ("P1", "P2", "P3", "ellipse", "NACA 2412 sharp"):
        nominal = nominal_of(name, 400)
        points = profiles.offset_points(curve_of(name), profiles.inner_parameters(curve_of(name), 200, rng), rng.uniform(-1, 1, 200))
        assert_exact(deviations(points, nominal), closest_point(curve_of(name), points), points, nominal)


@pytest.mark.parametrize("samples", [50, 300, 2000])
def test_exact_holds_where_the_curvature_jumps(samples: int) -> None:
    # Degree 2, one simple knot: tangents meet, curvatures do not. Off the knot by about the smaller radius there are two
    # local minima within a step of the samples, and the nearest sample may lead to the wrong one or to neither.
    for seed, (lift, last) in enumerate([(0.05, 4.7), (-0.12, 2.5), (0.16, 7.9), (-0.04, 3.6)]):
        curve = NurbsCurve(
            2, np.array([(0, 0), (20, 0), (20.9 + 0.3 * seed, lift), (24, last)]), np.array([0, 0, 0, 0.35 + 0.15 * seed, 1, 1, 1])
        )
        knot, rng = curve.knots[3], np.random.default_rng(seed)
        radius = 1 / np.abs(curve.curvature(np.array([np.nextafter(knot, 0), knot]))).max()
        u = np.clip(knot + rng.normal(0, 3 / samples, 150), 0.001, 0.999)
        points = profiles.offset_points(curve, u, rng.uniform(-1.3, 1.3, 150) * min(radius, 3.0))
        nominal = discretize(curve, samples=samples, step_min=1 / samples)
        assert_exact(deviations(points, nominal), closest_point(curve, points), points, nominal)


# ---- closed forms


@pytest.mark.parametrize("clockwise", [False, True])
@pytest.mark.parametrize("material", ["left", "right"])
def test_deviation_from_a_circle_is_radius_minus_radius(material: Material, clockwise: bool) -> None:
    nominal = discretize(profiles.circle(25.0, clockwise), samples=1000, material=material)
    rng = np.random.default_rng(15)
    angle, radius = rng.uniform(0, 2 * np.pi, 500), rng.uniform(20, 30, 500)
    points = radius[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    solid = (material == "left") != clockwise  # material inside the circle, so that a larger radius is out of it
    truth = radius - 25.0 if solid else 25.0 - radius
    for method in ("exact", "circle", "inversion"):
        found = deviations(points, nominal, method)
        assert np.abs(found.deviation_mm - truth).max() < 1e-12, method
        assert np.abs(found.foot_mm - 25.0 * points / radius[:, None]).max() < 1e-11, method
    inside = radius < 25.0
    for method in POLE_METHODS:  # the inner poles are the centre itself
        found = deviations(points, nominal, method)
        assert np.abs(found.deviation_mm - truth)[inside].max() < 1e-9, method
        assert np.array_equal(np.sign(found.deviation_mm), np.sign(truth)), method


def test_chord_on_a_circle_is_off_by_the_sagitta() -> None:
    nominal = discretize(profiles.circle(25.0), samples=16, pole_angle_min_deg=1.0)
    angle = np.arctan2(nominal.points_mm[:, 1], nominal.points_mm[:, 0])
    half = np.diff(angle % (2 * np.pi)).max() / 2
    middle = (angle[0] + angle[nominal.next_site[0]]) / 2
    point = 25.0 * np.array([[np.cos(middle), np.sin(middle)]])
    step = np.linalg.norm(nominal.points_mm[nominal.next_site[0]] - nominal.points_mm[0])
    assert deviations(point, nominal, "chord").deviation_mm[0] == pytest.approx(25.0 - np.sqrt(625.0 - step**2 / 4), abs=1e-12)
    assert half < np.pi / 15


def test_the_centre_of_a_circle_is_a_radius_inside_whatever_its_foot() -> None:
    found = deviations(np.zeros((1, 2)), discretize(profiles.circle(25.0), samples=500))
    assert found.deviation_mm[0] == pytest.approx(-25.0, abs=1e-11)
    assert np.isfinite(found.normal).all()


@pytest.mark.parametrize("method", METHODS)
def test_around_a_square_corner_the_deviation_is_the_distance_to_the_corner(method: Method) -> None:
    nominal = discretize(profiles.square(40.0), samples=400)
    rng = np.random.default_rng(16)
    points = np.sign(rng.uniform(-1, 1, (200, 2))) * np.vstack(
        [rng.uniform((18.5, 0.0), 21.5, (100, 2)), rng.uniform(18.5, 21.5, (100, 2))]
    )
    q = np.abs(points) - 20.0
    truth = np.where((q < 0).all(axis=1), q.max(axis=1), np.linalg.norm(np.maximum(q, 0), axis=1))
    found = deviations(points, nominal, method)
    cone = (q > 0).all(axis=1)
    assert cone.sum() >= 30
    # a straight line is known as such by all but the pole circles, whose radius is the distance to the corner (leading terms, hence 5 %)
    limit = np.full(len(points), 1e-12)
    if method in ("pcp", "veaw"):
        step = 160.0 / 400
        radius = np.maximum(20.0 - np.abs(points).min(axis=1) - step / 2, step / 2)
        limit += np.where(cone, 0.0, 1.05 * (0.375 * step**2 / radius + np.abs(truth) * (step / radius) ** 2 / 8))
    assert (np.abs(found.deviation_mm - truth) <= limit).all()
    assert np.array_equal(found.at_vertex, cone)
    assert not found.beyond_end.any()


@pytest.mark.parametrize("method", METHODS)
def test_deviation_is_zero_on_the_nominal(method: Method) -> None:
    for name in ("P2", "P3", "NACA 2412 sharp"):
        nominal = nominal_of(name, 10_000)
        u = profiles.inner_parameters(curve_of(name), 200, np.random.default_rng(17), 0.02)
        found = deviations(curve_of(name).point(u), nominal, method)
        limit = {"exact": 1e-13, "inversion": 1e-13, "circle": 1e-8}.get(method, 2e-4)
        assert np.abs(found.deviation_mm).max() < limit
        samples = nominal.points_mm[100:-100:37]
        at_samples = deviations(samples, nominal, method)
        assert np.abs(at_samples.deviation_mm).max() < 1e-12


# ---- the published methods, and what they promise


def errors_um(
    name: str, method: Method, samples: int = 10_000, offset_mm: float = 0.05, count: int = 6000
) -> tuple[Array, Array, NominalProfile]:
    """Errors of a method at points alternately `offset_mm` to either side, and the points."""
    curve, nominal = curve_of(name), nominal_of(name, samples)
    u = profiles.inner_parameters(curve, count, np.random.default_rng(18), 2e-3)
    points = profiles.offset_points(curve, u, offset_mm * np.where(np.arange(len(u)) % 2, 1.0, -1.0))
    truth = deviations(points, nominal, "exact").deviation_mm
    found = deviations(points, nominal, method).deviation_mm
    return 1e3 * np.abs(found - truth), points, nominal


REFERENCE_MEAN_UM: dict[str, dict[Method, float]] = {
    "ellipse": {"pcp": 0.0025, "veaw": 0.0017, "chord": 0.0010},
    "P1": {"pcp": 0.0013, "veaw": 0.0009, "chord": 0.0008},
    "P2": {"pcp": 0.0015, "veaw": 0.0009, "chord": 0.0008},
    "P3": {"pcp": 0.0021, "veaw": 0.0014, "chord": 0.0014},
    "GOE404": {"pcp": 0.0107, "veaw": 0.0067, "chord": 0.0004},
    "MH42": {"pcp": 0.036, "veaw": 0.027, "chord": 0.0003},
}


@pytest.mark.parametrize("name", REFERENCE_MEAN_UM)
def test_mean_error_at_ten_thousand_samples_is_that_of_the_reference(name: str) -> None:
    # Reference figures of another implementation at its own random points: smooth profiles agree to the second digit, airfoils
    # vary by 30 % between random sets, and the mean there hangs on a few points at the thin edge.
    factor = 1.35 if name in ("ellipse", "P1", "P2", "P3") else 2.0
    for method, reference in REFERENCE_MEAN_UM[name].items():
        mean = float(errors_um(name, method)[0].mean())
        assert reference / factor < mean + 0.00005, (method, mean)
        assert mean - 0.00005 < reference * factor, (method, mean)


@pytest.mark.parametrize("name", ["P1", "P2", "P3"])
def test_published_accuracy_on_the_three_profiles(name: str) -> None:
    pcp, veaw, circle = (errors_um(name, method)[0] for method in ("pcp", "veaw", "circle"))
    assert pcp.mean() < 0.005
    assert veaw.mean() <= 0.75 * pcp.mean()
    assert circle.max() <= 0.001


@pytest.mark.parametrize("name", ["GOE404", "MH42", "NACA 4412 blunt"])
def test_published_accuracy_on_airfoils(name: str) -> None:
    pcp, veaw, circle = (errors_um(name, method)[0] for method in ("pcp", "veaw", "circle"))
    assert pcp.mean() < 0.05
    assert veaw.mean() < pcp.mean()
    assert circle.max() <= 0.001


@pytest.mark.parametrize(("method", "order"), [("pcp", 2), ("veaw", 2), ("chord", 2), ("circle", 3), ("hermite", 4)])
def test_orders_of_convergence(method: Method, order: int) -> None:
    for name in ("P2", "P3", "ellipse"):
        mean = [errors_um(name, method, samples, count=1500)[0].mean() for samples in (400, 800, 1600)]
        for coarse, fine in pairwise(mean):
            assert np.log2(coarse / fine) == pytest.approx(order, abs=0.35), (name, mean)


def steps(nominal: NominalProfile, points: Array) -> tuple[np.ndarray[tuple[int], np.dtype[np.int64]], Array]:
    """Nearest sample of each point and the longer of the two chords that meet there."""
    site = np.linalg.norm(points[:, None] - nominal.points_mm[None], axis=2).argmin(axis=1)
    here = nominal.points_mm[site]
    longer = [np.linalg.norm(nominal.points_mm[other[site]] - here, axis=1) for other in (nominal.next_site, nominal.previous_site)]
    return site, np.maximum(*longer)


@pytest.mark.parametrize("name", ["P2", "P3", "ellipse"])
def test_stated_error_bounds_hold_point_by_point(name: str) -> None:
    curve = curve_of(name)
    change = np.gradient(curve.curvature(np.linspace(*curve.domain, 100_001)), curve.station_mm(np.linspace(*curve.domain, 100_001)))
    largest_change = float(np.abs(change).max())
    circle, points, nominal = errors_um(name, "circle", 1000, 0.01, 800)
    site, h = steps(nominal, points)
    kappa = curve.curvature(np.array(deviations(points, nominal).parameter))
    assert (circle <= 1e3 * 1.05 * largest_change * h**3 / 48).all()
    chord = errors_um(name, "chord", 1000, 0.01, 800)[0]
    assert (chord <= 1e3 * (1.02 * np.abs(kappa) * h**2 / 8 + largest_change * h**3 / 8)).all()
    pcp = errors_um(name, "pcp", 1000, 0.01, 800)[0]
    left = ((points - nominal.points_mm[site]) * nominal.normal[site]).sum(axis=1) > 0
    towards = np.where(
        left, nominal.poles.left_curvature[site] - nominal.curvature[site], nominal.poles.right_curvature[site] + nominal.curvature[site]
    )
    assert (pcp <= 1e3 * (1.05 * 0.375 * np.abs(towards) * h**2 + 0.5 * largest_change * h**3)).all()
    # and they are not idle: some point comes near them
    assert (chord / (1e3 * np.abs(kappa) * h**2 / 8 + 1e-12)).max() > 0.5
    assert (pcp / (1e3 * 0.375 * np.abs(towards) * h**2 + 1e-12)).max() > 0.5


# ---- ends, corners, signs, probe ball


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", ["P1", "P2", "NACA 4412 blunt"])
def test_points_beyond_the_ends_get_the_distance_to_the_end_and_are_marked(name: str, method: Method) -> None:
    curve, nominal = curve_of(name), nominal_of(name, 10_000)
    for u, outward in zip(curve.domain, (-1.0, 1.0), strict=True):
        place, tangent = curve.derivatives(np.array([u]), 1)[:, 0]
        t = outward * tangent / np.linalg.norm(tangent)
        n = np.array([-t[1], t[0]])
        away = np.array([(0.2, 0.05), (0.05, -0.02), (0.5, 0.3), (1e-3, 0.0)]) * (1 if name != "NACA 4412 blunt" else 0.2)
        points = place + away[:, :1] * t + away[:, 1:] * n
        found = deviations(points, nominal, method)
        assert found.beyond_end.all()
        assert np.abs(np.abs(found.deviation_mm) - np.linalg.norm(away, axis=1)).max() < 1e-11
        assert np.abs(found.foot_mm - place).max() < 1e-11
        back = place - 0.05 * t + np.array([[0.01], [-0.01]]) * n
        assert not deviations(back, nominal, method).beyond_end.any()


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", ["P1", "P3", "ellipse", "NACA 2412 sharp"])
def test_material_on_the_other_side_turns_every_sign(name: str, method: Method) -> None:
    u = profiles.inner_parameters(curve_of(name), 200, np.random.default_rng(19), 0.01)
    offset = np.where(np.arange(200) % 2, 0.03, -0.04)
    points = profiles.offset_points(curve_of(name), u, offset)
    left = deviations(points, nominal_of(name, 10_000), method)
    right = deviations(points, nominal_of(name, 10_000, "right"), method)
    assert np.array_equal(left.deviation_mm, -right.deviation_mm)
    assert np.array_equal(np.sign(right.deviation_mm), np.sign(offset))
    assert np.array_equal(left.normal, -right.normal)


@pytest.mark.parametrize("method", ["exact", "circle", "inversion"])
def test_ball_centres_are_judged_by_their_distance_less_the_radius(method: Method) -> None:
    for name in ("P3", "ellipse"):
        curve, nominal = curve_of(name), nominal_of(name, 10_000)
        u = profiles.inner_parameters(curve, 300, np.random.default_rng(20))
        form = 0.05 * np.sin(40 * u)
        centres = profiles.offset_points(curve, u, -(form + 1.5))  # material left: out of it is to the right
        found = deviations(centres, nominal, method, tip_radius_mm=1.5)
        # the ball rides 1.5 mm off, where nearest sample and osculating circle are a little less sharp
        assert np.abs(found.deviation_mm - form).max() < (1e-11 if method != "circle" else 1e-8)
        assert np.abs(found.foot_mm - curve.point(u)).max() < (1e-9 if method != "circle" else 1e-5)


def test_a_ball_inside_a_hole_rides_on_the_other_side() -> None:
    nominal = discretize(profiles.circle(10.0), samples=500, material="right")
    angle = np.linspace(0, 6, 50)
    centres = (10.0 - 2.0 - 0.03) * np.column_stack([np.cos(angle), np.sin(angle)])
    found = deviations(centres, nominal, tip_radius_mm=2.0)
    assert np.abs(found.deviation_mm - 0.03).max() < 1e-12
    assert np.abs(found.foot_mm - centres / (10.0 - 2.03) * 10).max() < 1e-11


def test_a_ball_that_fits_nowhere_is_refused() -> None:
    nominal = discretize(profiles.circle(10.0), samples=200, material="right")
    for radius in (10.5, 1000.0):
        with pytest.raises(ValueError, match="radius"):
            deviations(np.zeros((1, 2)), nominal, tip_radius_mm=radius)
    for radius in (-1.0, float("nan"), float("inf")):
        with pytest.raises(ValueError, match="radius"):
            deviations(np.ones((1, 2)), nominal_of("ellipse", 10_000), tip_radius_mm=radius)
    deviations(np.array([[60.0, 0.0]]), nominal_of("ellipse", 10_000), tip_radius_mm=1000.0)  # convex from outside: any ball touches it


# ---- invariance


@settings(max_examples=12, deadline=None)
@given(
    name=st.sampled_from(["P1", "P2", "P3", "NACA 2412 sharp"]),
    rotation_deg=st.floats(-180, 180),
    shift=st.tuples(st.floats(-300, 300), st.floats(-300, 300)),
)
def test_moving_part_and_points_together_changes_no_deviation(name: str, rotation_deg: float, shift: tuple[float, float]) -> None:
    curve = curve_of(name)
    u = profiles.inner_parameters(curve, 100, np.random.default_rng(21), 0.01)
    points = profiles.offset_points(curve, u, np.random.default_rng(22).normal(0, 0.05, 100))
    here = discretize(curve, samples=500, step_min=2e-3)
    there = discretize(moved_curve(curve, rotation_deg, shift), samples=500, step_min=2e-3)
    moved = profiles.rotated(points, rotation_deg, shift)
    # with the same samples every method is rigidly invariant; poles by Qhull are so only to some 1e-7 mm
    limits: dict[Method, float] = {"exact": 1e-11, "circle": 1e-9, "chord": 1e-9, "inversion": 1e-11}
    for method, limit in limits.items():
        a = deviations(points, here, method)
        b = deviations(moved, there, method)
        assert np.abs(a.deviation_mm - b.deviation_mm).max() < limit, method
        assert np.abs(profiles.rotated(a.foot_mm, rotation_deg, shift) - b.foot_mm).max() < 100 * limit, method
        assert np.abs(a.station_mm - b.station_mm).max() < 100 * limit, method


@pytest.mark.parametrize("method", METHODS)
def test_each_point_is_judged_alike_alone_in_any_batch_and_in_any_order(method: Method) -> None:
    for name in ("P1", "P3", "NACA 2412 sharp"):
        nominal, rng = nominal_of(name, 10_000), np.random.default_rng(23)
        points = profiles.offset_points(curve_of(name), profiles.inner_parameters(curve_of(name), 300, rng), rng.normal(0, 0.2, 300))
        whole = deviations(points, nominal, method)
        for size in (1, 7, 64):
            cut = [deviations(points[k : k + size], nominal, method) for k in range(0, 300 if size > 1 else 60, size)]
            for field in ("deviation_mm", "foot_mm", "parameter", "station_mm", "normal", "curvature", "beyond_end", "at_vertex"):
                joined = np.concatenate([getattr(c, field) for c in cut])
                assert np.array_equal(joined, getattr(whole, field)[: len(joined)]), (name, size, field)
        order = rng.permutation(300)
        assert np.array_equal(deviations(points[order], nominal, method).deviation_mm, whole.deviation_mm[order])


# ---- results and bad input


def test_profile_error_is_twice_the_largest_deviation_without_points_beyond_the_ends() -> None:
    nominal = nominal_of("P1", 10_000)
    start = nominal.points_mm[0] - 3.0 * nominal.tangent[0]
    points = np.vstack([profiles.offset_points(curve_of("P1"), np.array([0.3, 0.6]), np.array([0.02, -0.05])), start])
    found = deviations(points, nominal)
    assert found.beyond_end.tolist() == [False, False, True]
    assert profile_error_mm(found) == pytest.approx(0.1, abs=1e-11)


def test_results_cannot_be_changed_and_inputs_are_left_alone() -> None:
    points = np.array([[10.0, 20.0], [30.0, 40.0]])
    kept = points.copy()
    found = deviations(points, nominal_of("P1", 10_000))
    points += 0.0
    assert np.array_equal(points, kept)
    with pytest.raises(ValueError, match="read-only"):
        found.deviation_mm[0] = 0.0


@pytest.mark.parametrize("name", [name for name in profiles.EVERY if curve_of(name).closed])
def test_a_parameter_and_its_point_agree_at_the_seam(name: str) -> None:
    curve, nominal = curve_of(name), nominal_of(name)
    (start, end), off_mm = curve.domain, np.array([0.0, 1e-15, 2e-13, 5e-11, 3e-8, 1e-4])
    place, after = curve.derivatives(start, 1)[:, 0]
    before = curve.derivatives(end, 1)[1, 0]
    points = np.concatenate([place + np.outer(off_mm, after / np.hypot(*after)), place - np.outer(off_mm, before / np.hypot(*before))])
    found = deviations(points, nominal)
    assert np.abs(curve.point(found.parameter) - found.foot_mm).max() <= 1e-12
    around = np.abs(found.station_mm - curve.station_mm(found.parameter))
    assert np.minimum(around, curve.length_mm - around).max() <= 1e-9


BAD: dict[str, tuple[Callable[[], Any], str]] = {
    "three columns": (lambda: np.zeros((4, 3)), r"shape \(m, 2\), got \(4, 3\)"),
    "one row of numbers": (lambda: np.zeros(4), r"shape \(m, 2\), got \(4,\)"),
    "not a number in row 3": (lambda: np.array([[0.0, 0], [1, 1], [np.nan, 2], [3, 3]]), "point 3 is not finite"),
    "beyond a kilometre in row 2": (lambda: np.array([[0.0, 0], [1, -1.1e6], [2, 2]]), r"point 2 lies beyond 1e\+06 mm, where no part is"),
    "infinite in row 2": (lambda: np.array([[0.0, 0], [np.inf, 1], [2, 2]]), "point 2 is not finite"),
    "text": (lambda: [["a", "b"]], "could not convert string to float: 'a'"),
}


@pytest.mark.parametrize("what", BAD)
def test_bad_points_are_one_clear_error(what: str) -> None:
    make, pattern = BAD[what]
    with pytest.raises(ValueError, match=pattern):
        deviations(make(), nominal_of("P1", 10_000))


def test_an_unknown_method_is_refused_by_name() -> None:
    unknown: Any = "spline"
    with pytest.raises(ValueError, match="method must be one of exact, circle, chord, pcp, veaw, hermite, inversion, not 'spline'"):
        deviations(np.zeros((1, 2)), nominal_of("P1", 10_000), unknown)


def test_no_points_give_no_deviations() -> None:
    for method in METHODS:
        found = deviations(np.empty((0, 2)), nominal_of("P1", 10_000), method)
        assert found.deviation_mm.shape == (0,)
        assert found.foot_mm.shape == (0, 2)


@pytest.mark.parametrize("material", get_args(Material))
def test_deviations_are_those_of_the_feet_whatever_thread_turns_them(material: Material) -> None:
    name, tip_mm = "NACA 2412 sharp", 0.25
    nominal, rng = nominal_of(name, material=material), np.random.default_rng(21)
    points = curve_of(name).point(rng.uniform(0, 1, 70_000)) + rng.normal(0, 1.0, (70_000, 2))  # shared out among all threads
    found, feet = deviations(points, nominal, tip_radius_mm=tip_mm), project(points, nominal.grid, threads=1)
    assert np.array_equal(found.deviation_mm, nominal.outward * feet.distance_mm - tip_mm)
    assert np.array_equal(found.normal, nominal.outward * feet.gradient)
    assert np.array_equal(found.beyond_end, feet.vertex == OPEN_END)
    assert np.array_equal(found.at_vertex, feet.vertex != INSIDE)
    points[[7, 69_999]] = np.nan, 1.0
    with pytest.raises(ValueError, match=r"point 8 is not finite"):
        deviations(points, nominal)
