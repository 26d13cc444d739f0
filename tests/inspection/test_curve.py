"""Curves against exact rational arithmetic, closed forms and independent quadrature."""

from collections.abc import Callable
from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest
from scipy.special import ellipe

from inspection import NominalError, NurbsCurve
from tests.inspection import profiles
from tests.inspection.profiles import Array

Series = list[Fraction]  # value and Taylor coefficients by a small step of the parameter

ORDER = 4


def times(p: Series, q: Series) -> Series:
    return [sum((p[i] * q[k - i] for i in range(k + 1)), Fraction(0)) for k in range(ORDER + 1)]


def divided(p: Series, q: Series) -> Series:
    out: Series = []
    for k in range(ORDER + 1):
        out.append((p[k] - sum((out[i] * q[k - i] for i in range(k)), Fraction(0))) / q[0])
    return out


def de_boor(knots: list[Fraction], control: list[Fraction], degree: int, u: Fraction) -> Series:
    """De Boor's triangle on Taylor series, in exact rational arithmetic; at a knot the span of larger u counts."""
    last = len(control) - 1
    span = max(k for k in range(degree, last + 1) if knots[k] <= u and knots[k] < knots[k + 1])
    zero = [Fraction(0)] * ORDER
    d = [[control[span - degree + j], *zero] for j in range(degree + 1)]
    for r in range(1, degree + 1):
        for j in range(degree, r - 1, -1):
            left, right = knots[span - degree + j], knots[span + 1 + j - r]
            width = right - left
            alpha = [(u - left) / width, 1 / width, *zero[1:]]
            beta = [(right - u) / width, -1 / width, *zero[1:]]
            d[j] = [a + b for a, b in zip(times(beta, d[j - 1]), times(alpha, d[j]), strict=True)]
    return d[degree]


def exact_derivatives(curve: NurbsCurve, u: float) -> Array:
    """Point and four derivatives, (5, 2), rounded once at the very end."""
    knots = [Fraction(float(k)) for k in curve.knots]
    weights = [Fraction(float(w)) for w in (np.ones(len(curve.control_points_mm)) if curve.weights is None else curve.weights)]
    bottom = de_boor(knots, weights, curve.degree, Fraction(u))
    out = np.empty((ORDER + 1, 2))
    for axis in range(2):
        control = [w * Fraction(float(c)) for w, c in zip(weights, curve.control_points_mm[:, axis], strict=True)]
        series = divided(de_boor(knots, control, curve.degree, Fraction(u)), bottom)
        out[:, axis] = [float(c * f) for c, f in zip(series, (1, 1, 2, 6, 24), strict=True)]
    return out


def random_curve(degree: int, rational: bool, rng: np.random.Generator) -> NurbsCurve:
    """Unevenly spaced knots, one of them double where the degree allows it without a corner in the first derivative."""
    k = degree + 8
    inner = np.sort(rng.uniform(0.05, 0.95, k - degree - 1))
    if degree >= 3:
        inner[3] = inner[2]
    knots = 7.0 * np.concatenate([np.zeros(degree + 1), inner, np.ones(degree + 1)]) - 2.0
    control = np.column_stack([np.arange(k) * 10.0, rng.uniform(-20, 20, k)])
    return NurbsCurve(degree, control, knots, rng.uniform(0.5, 2.0, k) if rational else None)


def assert_derivatives(curve: NurbsCurve, parameters: Array) -> None:
    found = curve.derivatives(parameters, ORDER)
    assert found.shape == (ORDER + 1, len(parameters), 2)
    truth = np.stack([exact_derivatives(curve, float(u)) for u in parameters], axis=1)
    # rounding is relative to the largest derivative so far: above the degree the truth is zero, but not the terms it is summed from
    scale = np.maximum.accumulate(np.abs(truth).max(axis=(1, 2), keepdims=True), axis=0)
    assert (np.abs(found - truth) / scale).max() < 1e-12
    for order in range(ORDER):
        assert np.array_equal(curve.derivatives(parameters, order), found[: order + 1])


@pytest.mark.parametrize("rational", [False, True])
@pytest.mark.parametrize("degree", [1, 2, 3, 4, 5])
def test_derivatives_equal_exact_rational_arithmetic(degree: int, rational: bool) -> None:
    rng = np.random.default_rng(degree + 10 * rational)
    curve = random_curve(degree, rational, rng)
    first, last = curve.domain
    assert_derivatives(curve, np.concatenate([[first], rng.uniform(first, last, 12), curve.knots[[degree + 1, degree + 3]]]))


@pytest.mark.parametrize("degree", [1, 2, 3, 4, 5])
def test_derivatives_of_periodic_curves_equal_exact_arithmetic(degree: int) -> None:
    curve = profiles.periodic(degree, profiles.P3_POINTS)
    assert_derivatives(curve, np.concatenate([[0.0], np.random.default_rng(degree).uniform(0, 1, 10)]))


def test_last_parameter_of_a_clamped_curve_is_its_last_control_point() -> None:
    for curve in (profiles.p1(), profiles.p2(), profiles.naca(), profiles.ellipse(50, 20)):
        first, last = curve.domain
        assert np.abs(curve.point(np.array([first]))[0] - curve.control_points_mm[0]).max() < 1e-13
        assert np.abs(curve.point(np.array([last]))[0] - curve.control_points_mm[-1]).max() < 1e-13
        # the derivative at the very end is the limit from inside, where a one-sided formula would give zero
        near = curve.derivatives(np.array([last, np.nextafter(last, first)]), 2)
        assert np.allclose(near[:, 0], near[:, 1], rtol=1e-9, atol=1e-6)


@pytest.mark.parametrize("curve", [profiles.p3(), profiles.circle(30.0)], ids=["P3", "circle"])
def test_parameters_of_closed_curves_wrap_around(curve: NurbsCurve) -> None:
    u = np.linspace(0.06, 0.96, 7)
    for turn in (-1.0, 1.0):
        assert np.abs(curve.point(u + turn) - curve.point(u)).max() < 1e-12
        assert np.abs(curve.derivatives(u + turn, 2) - curve.derivatives(u, 2)).max() < 1e-8


# ---- the rational circle, in closed form


@pytest.mark.parametrize("clockwise", [False, True])
@pytest.mark.parametrize("radius", [0.5, 37.5, 4000.0])
def test_rational_circle_has_its_radius_curvature_and_length(radius: float, clockwise: bool) -> None:
    curve = profiles.circle(radius, clockwise)
    u = np.linspace(0.0, 1.0, 1001)
    assert np.abs(np.linalg.norm(curve.point(u), axis=1) / radius - 1).max() < 4e-15
    sign = -1 if clockwise else 1
    assert np.abs(curve.curvature(u) * radius * sign - 1).max() < 1e-12
    assert abs(curve.length_mm / (2 * np.pi * radius) - 1) < 1e-12
    assert len(curve.corners) == 0


def test_rational_quarter_circle_derivatives_have_their_closed_form() -> None:
    # With t = 4u on the first quarter: (x, y) = (cos a, sin a), tan(a / 2) = q t / (1 + ...) follows from the conic
    # w0 = 1, w1 = sqrt(1/2), w2 = 1; x = ((1-t)^2 + 2 s t (1-t)) / w, y = (t^2 + 2 s t (1-t)) / w, w = 1 - (2 - 2 s) t (1 - t).
    # The angle's rate is a' = 2 s / w (from x y' - y x' = a', computed by hand), hence every derivative of (cos a, sin a).
    radius, s = 37.5, np.sqrt(0.5)
    t = np.linspace(0.0, 0.99, 60)
    w = 1 - (2 - 2 * s) * t * (1 - t)
    w1, w2 = -(2 - 2 * s) * (1 - 2 * t), (2 - 2 * s) * 2
    a1 = 2 * s / w
    a2 = -2 * s * w1 / w**2
    a3 = -2 * s * (w2 / w**2 - 2 * w1**2 / w**3)
    x = ((1 - t) ** 2 + 2 * s * t * (1 - t)) / w
    y = (t**2 + 2 * s * t * (1 - t)) / w
    e, n = np.column_stack([x, y]), np.column_stack([-y, x])
    truth = radius * np.stack(
        [
            e,
            4 * a1[:, None] * n,
            16 * (a2[:, None] * n - (a1**2)[:, None] * e),
            64 * ((a3 - a1**3)[:, None] * n - (3 * a1 * a2)[:, None] * e),
        ]
    )
    found = profiles.circle(radius).derivatives(t / 4, 3)
    assert (np.abs(found - truth).max(axis=(1, 2)) / np.abs(truth).max(axis=(1, 2))).max() < 1e-13


def test_curvature_is_positive_where_the_curve_turns_left() -> None:
    left = profiles.clamped(2, [(0, 0), (10, 0), (10, 10)])
    right = profiles.clamped(2, [(0, 0), (10, 0), (10, -10)])
    u = np.linspace(0, 1, 11)
    assert (left.curvature(u) > 0).all()
    assert (right.curvature(u) < 0).all()
    straight = profiles.clamped(1, [(0, 0), (10, 5), (20, 10)])
    assert np.abs(straight.curvature(u)).max() < 1e-15


def test_ellipse_curvature_has_its_closed_form() -> None:
    a, b = 50.0, 20.0
    u = np.linspace(0, 1, 401)
    curve = profiles.ellipse(a, b)
    x, y = curve.point(u).T
    truth = a * b / ((a * y / b) ** 2 + (b * x / a) ** 2) ** 1.5
    assert np.abs(curve.curvature(u) / truth - 1).max() < 1e-11


# ---- arc length


@pytest.mark.parametrize(("a", "b"), [(50.0, 20.0), (1.0, 0.999), (100.0, 1.0)])
def test_length_of_an_ellipse_is_its_complete_elliptic_integral(a: float, b: float) -> None:
    truth = 4 * a * ellipe(1 - (b / a) ** 2)
    assert abs(profiles.ellipse(a, b).length_mm / truth - 1) < 1e-12


def parabola_length(x: float) -> float:
    return float((np.arcsinh(2 * x) + 2 * x * np.sqrt(1 + 4 * x * x)) / 4)


@pytest.mark.parametrize("degree_raised", [False, True])
def test_length_and_station_on_a_parabola_have_their_closed_form(degree_raised: bool) -> None:
    # y = x^2 from x = -1 to 3, as a single Bezier piece, of degree 2 or raised to degree 3; x is linear in u
    control = np.array([(-1.0, 1.0), (1.0, -3.0), (3.0, 9.0)])
    if degree_raised:
        control = np.array([control[0], (control[0] + 2 * control[1]) / 3, (2 * control[1] + control[2]) / 3, control[2]])
    curve = profiles.clamped(len(control) - 1, control)
    start = -parabola_length(-1.0)
    assert abs(curve.length_mm - (start + parabola_length(3.0))) < 1e-12 * curve.length_mm
    u = np.linspace(0, 1, 33)
    truth = np.array([start + parabola_length(-1 + 4 * v) for v in u])
    assert np.abs(curve.station_mm(u) - truth).max() < 1e-11


def quadrature(curve: NurbsCurve, a: float, b: float) -> float:
    """Arc length from a to b by 40-point Gauss rules on eighths of each knot span."""
    x, w = np.polynomial.legendre.leggauss(40)
    inner = curve.knots[(curve.knots > a) & (curve.knots < b)]
    total = 0.0
    for left, right in pairwise(np.unique(np.concatenate([[a], inner, [b]]))):
        for p, q in pairwise(np.linspace(left, right, 9)):
            total += float((np.linalg.norm(curve.derivatives((p + q) / 2 + (q - p) / 2 * x, 1)[1], axis=1) * w).sum() * (q - p) / 2)
    return total


@pytest.mark.parametrize("name", profiles.EVERY)
def test_length_and_stations_equal_an_independent_quadrature(name: str) -> None:
    curve = profiles.EVERY[name]()
    first, last = curve.domain
    truth = quadrature(curve, first, last)
    assert abs(curve.length_mm / truth - 1) < 1e-12
    u = first + (last - first) * np.array([0.013, 0.31, 0.62, 0.987])
    assert np.abs(curve.station_mm(u) - np.array([quadrature(curve, first, v) for v in u])).max() < 1e-11 * truth
    every = curve.station_mm(np.linspace(first, last, 2001))
    assert (np.diff(every) > 0).all()
    assert every[0] == 0.0
    assert abs(every[-1] - curve.length_mm) < 1e-12 * truth


def test_length_of_a_nearly_cusped_curve_is_still_exact() -> None:
    # a cubic whose speed falls to 1/5000 of its mean inside the span: a fixed Gauss rule is off by far more than 1e-9
    gap = 1e-3
    control = np.array([(0.0, 0.0), (10.0 + gap, 10.0), (0.0 - gap, 10.0), (10.0, 0.0)])
    curve = profiles.clamped(3, control)
    fine, w = np.polynomial.legendre.leggauss(60)
    # intervals shrink towards the middle, where the speed is smallest
    cuts = np.concatenate([[0.0], 0.5 - 0.5 * 0.5 ** np.arange(1, 40), [0.5]])
    half = 0.0
    for p, q in pairwise(cuts):
        speed = np.linalg.norm(curve.derivatives((p + q) / 2 + (q - p) / 2 * fine, 1)[1], axis=1)
        half += float((speed * w).sum() * (q - p) / 2)
    assert abs(curve.length_mm / (2 * half) - 1) < 1e-12


# ---- interpolation


def centripetal(points: Array, closed: bool) -> Array:
    """Lee's parameters of the points, in [0, 1], one past the last point when the curve closes on the first."""
    loop = np.vstack([points, points[:1]]) if closed else points
    step = np.sqrt(np.linalg.norm(np.diff(loop, axis=0), axis=1))
    return np.asarray(np.concatenate([[0.0], np.cumsum(step)]) / step.sum())


@pytest.mark.parametrize("closed", [False, True])
@pytest.mark.parametrize("degree", [1, 2, 3, 4, 5])
def test_interpolation_passes_through_its_points_at_centripetal_parameters(degree: int, closed: bool) -> None:
    angle = np.linspace(0, 2 * np.pi, 24, endpoint=False) + 0.1 * np.sin(np.arange(24))
    points = np.column_stack([50 * np.cos(angle) + 3 * np.cos(3 * angle), 20 * np.sin(angle)])
    curve = NurbsCurve.interpolate(points, degree, closed)
    assert curve.degree == degree
    assert curve.closed == closed
    assert curve.domain == pytest.approx((0.0, 1.0), abs=1e-15)
    u = centripetal(points, closed)
    assert np.abs(curve.point(u[: len(points)]) - points).max() < 1e-11
    # truly a spline of that degree: smooth to order degree - 1 everywhere, the seam included
    inner = np.unique(curve.knots[(curve.knots > 0) & (curve.knots < 1)])
    joints = np.append(inner, [1.0]) if closed else inner
    before = curve.derivatives(joints - 1e-9, min(degree - 1, 3))
    after = curve.derivatives(joints % 1.0 + 1e-9, min(degree - 1, 3))
    scale = np.abs(after).max(axis=(1, 2), keepdims=True)
    assert (np.abs(before - after) / scale).max() < 1e-5


def test_interpolation_with_a_corner_at_the_seam_is_open_in_shape_and_closed_in_place() -> None:
    points = profiles.naca_points("2412", 100.0)
    sharp = NurbsCurve.interpolate(points, 3, closed=True, corner_at_seam=True)
    loose = NurbsCurve.interpolate(points, 3)
    u = np.linspace(0, 1, 301)
    assert np.abs(sharp.point(u) - loose.point(u)).max() < 1e-12
    assert sharp.closed
    assert np.array_equal(sharp.corners, [0.0])


def test_a_repeated_last_point_is_the_join_of_a_closed_curve() -> None:
    angle = np.linspace(0, 2 * np.pi, 31)[:-1]
    points = np.column_stack([30 * np.cos(angle), 10 * np.sin(angle)])
    once = NurbsCurve.interpolate(points, 3, closed=True)
    twice = NurbsCurve.interpolate(np.vstack([points, points[:1]]), 3, closed=True)
    u = np.linspace(0, 1, 101)
    assert np.array_equal(once.point(u), twice.point(u))
    assert len(once.corners) == 0


def test_interpolating_a_cubic_gives_it_back() -> None:
    # not-a-knot end conditions reproduce a cubic whose centripetal parameters are even: points even in u on a straight line
    points = np.column_stack([np.linspace(0, 30, 12), np.linspace(5, -10, 12)])
    curve = NurbsCurve.interpolate(points)
    assert np.abs(curve.curvature(np.linspace(0, 1, 50))).max() < 1e-12
    assert abs(curve.length_mm - np.hypot(30, 15)) < 1e-12


# ---- corners


def test_corners_of_a_square_are_its_four_vertices() -> None:
    curve = profiles.square(40.0)
    assert np.allclose(curve.corners, [0, 0.25, 0.5, 0.75], atol=1e-15)
    assert np.abs(np.abs(curve.point(curve.corners)) - 20).max() < 1e-13


def test_smooth_profiles_have_no_corners_though_knots_repeat() -> None:
    for name in ("P1", "P2", "P3", "ellipse", "stadium", "NACA 4412 blunt"):
        assert len(profiles.EVERY[name]().corners) == 0, name


@pytest.mark.parametrize("turn_deg", [1.0, -20.0, 90.0, 175.0])
def test_a_tangent_break_inside_a_cubic_is_a_corner(turn_deg: float) -> None:
    a = np.deg2rad(turn_deg)
    arm = np.array([(10, 0), (20, 0), (30, 0)]) @ np.array([(np.cos(a), np.sin(a)), (-np.sin(a), np.cos(a))])
    control = np.vstack([[(-30, 0), (-20, 0), (-10, 0), (0, 0)], arm])
    curve = NurbsCurve(3, control, np.array([0, 0, 0, 0, 1, 1, 1, 2, 2, 2, 2.0]))
    assert np.array_equal(curve.corners, [1.0])
    before, after = curve.derivatives(np.array([np.nextafter(1, 0), 1.0]), 1)[1]
    assert np.rad2deg(np.arctan2(before[0] * after[1] - before[1] * after[0], before @ after)) == pytest.approx(turn_deg, abs=1e-9)


def test_ends_of_open_curves_are_not_corners_and_a_closed_clamped_curve_may_have_a_smooth_seam() -> None:
    assert len(profiles.clamped(3, [(0, 0), (5, 9), (10, -9), (15, 0)]).corners) == 0
    teardrop = profiles.clamped(3, [(0, 0), (30, 20), (30, -20), (0, 0)])
    closed = NurbsCurve(3, teardrop.control_points_mm.copy(), teardrop.knots.copy(), closed=True)
    assert np.array_equal(closed.corners, [0.0])


# ---- what cannot be a curve

LINE = np.array([(0.0, 0.0), (10.0, 0.0), (20.0, 5.0), (30.0, 0.0)])
KNOTS = np.array([0.0, 0, 0, 0, 1, 1, 1, 1])

BAD: dict[str, Callable[[], object]] = {
    "degree 0": lambda: NurbsCurve(0, LINE, np.linspace(0, 1, 5)),
    "too few control points": lambda: NurbsCurve(3, LINE[:3], np.array([0.0, 0, 0, 1, 1, 1, 1])),
    "one knot too few": lambda: NurbsCurve(3, LINE, KNOTS[:-1]),
    "one knot too many": lambda: NurbsCurve(3, LINE, np.append(KNOTS, 1.0)),
    "falling knots": lambda: NurbsCurve(3, LINE, KNOTS[::-1].copy()),
    "knots all equal": lambda: NurbsCurve(3, LINE, np.zeros(8)),
    "a knot that is not a number": lambda: NurbsCurve(3, LINE, np.array([0.0, 0, 0, 0, 1, 1, 1, np.nan])),
    "control points in space": lambda: NurbsCurve(3, np.column_stack([LINE, LINE[:, 0]]), KNOTS),
    "a control point that is not a number": lambda: NurbsCurve(3, np.where(LINE == 5.0, np.nan, LINE), KNOTS),
    "an infinite control point": lambda: NurbsCurve(3, np.where(LINE == 5.0, np.inf, LINE), KNOTS),
    "a weight too few": lambda: NurbsCurve(3, LINE, KNOTS, np.ones(3)),
    "a weight of zero": lambda: NurbsCurve(3, LINE, KNOTS, np.array([1.0, 0.0, 1.0, 1.0])),
    "a negative weight": lambda: NurbsCurve(3, LINE, KNOTS, np.array([1.0, -1.0, 1.0, 1.0])),
    "a weight that is not a number": lambda: NurbsCurve(3, LINE, KNOTS, np.array([1.0, np.nan, 1.0, 1.0])),
    "no length": lambda: NurbsCurve(3, np.full((4, 2), 7.0), KNOTS),
    "closed, but the ends do not meet": lambda: NurbsCurve(3, LINE, KNOTS, closed=True),
    "a knot that tears the curve": lambda: NurbsCurve(1, LINE, np.array([0.0, 0, 0.5, 0.5, 1, 1])),
    "interpolation through one point": lambda: NurbsCurve.interpolate(LINE[:1]),
    "interpolation through none": lambda: NurbsCurve.interpolate(np.empty((0, 2))),
    "fewer points than the degree needs": lambda: NurbsCurve.interpolate(LINE[:3], 3),
    "coinciding neighbours": lambda: NurbsCurve.interpolate(LINE[[0, 1, 1, 2, 3]], 3),
    "points that are not numbers": lambda: NurbsCurve.interpolate(np.where(LINE == 5.0, np.nan, LINE), 3),
    "points in space": lambda: NurbsCurve.interpolate(np.column_stack([LINE, LINE[:, 0]]), 3),
    "interpolation of degree 0": lambda: NurbsCurve.interpolate(LINE, 0),
}


@pytest.mark.parametrize("what", BAD)
def test_bad_input_is_one_clear_error(what: str) -> None:
    with pytest.raises(NominalError) as caught:
        BAD[what]()
    message = str(caught.value)
    assert len(message) > 15
    assert "\n" not in message


def test_fields_cannot_be_changed_afterwards() -> None:
    curve = profiles.p2()
    with pytest.raises(ValueError, match="read-only"):
        curve.control_points_mm[0, 0] = 1.0
    with pytest.raises(AttributeError):
        curve.closed = True  # type: ignore[misc]
