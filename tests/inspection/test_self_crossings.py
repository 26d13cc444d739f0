"""Crossings of a curve with itself: closed forms, loops of a micrometre, sides that touch, and curves that nearly do."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.integrate import quad
from scipy.optimize import brentq

from inspection import NurbsCurve, find_crossings
from tests.inspection import profiles

Array = NDArray[np.float64]


def polygon(corners: list[tuple[float, float]], closed: bool = True) -> NurbsCurve:
    points = np.array([*corners, corners[0]] if closed else corners, dtype=float)
    count = len(points)
    return NurbsCurve(1, points, np.concatenate([[0.0], np.arange(count), [count - 1.0]]), closed=closed)


def test_a_bow_tie_crosses_in_its_middle() -> None:
    (crossing,) = find_crossings(polygon([(0, 0), (4, 3), (4, 0), (0, 3)]))
    assert (crossing.x_mm, crossing.y_mm) == pytest.approx((2.0, 1.5), abs=1e-12)
    assert (crossing.first_mm, crossing.second_mm) == pytest.approx((2.5, 10.5), abs=1e-12)


@pytest.mark.parametrize(("half_loop", "within"), [(1.0, 1e-12), (1e-1, 1e-12), (1e-2, 1e-12), (1e-3, 1e-6)])
def test_the_loop_of_a_nodal_cubic_is_found_however_small(half_loop: float, within: float) -> None:
    """x = t^2 - e^2, y = t (t^2 - e^2) passes the origin at t = e and t = -e.

    The loop between is e^2 long and 0.8 e^3 wide: a micrometre by less than a nanometre at last, and then named as a whole.
    """
    e = half_loop
    # Of t and its powers the Bezier points over [-2, 2] are the polar forms at (-2, -2, -2), (-2, -2, 2), (-2, 2, 2), (2, 2, 2).
    places = [(-2.0, -2.0, -2.0), (-2.0, -2.0, 2.0), (-2.0, 2.0, 2.0), (2.0, 2.0, 2.0)]
    control = [((a * b + b * c + c * a) / 3 - e * e, a * b * c - e * e * (a + b + c) / 3) for a, b, c in places]
    curve = NurbsCurve(3, np.array(control), np.repeat([-2.0, 2.0], 4))
    (crossing,) = find_crossings(curve)
    assert (crossing.x_mm, crossing.y_mm) == pytest.approx((0.0, 0.0), abs=within)
    stations = [quad(lambda t: np.hypot(2 * t, 3 * t * t - e * e), -2, end, points=[0, -e, e], limit=500)[0] for end in (-e, e)]
    assert (crossing.first_mm, crossing.second_mm) == pytest.approx(tuple(stations), abs=max(1e-9, within))


def test_every_loop_of_a_rosette_is_found() -> None:
    """z = 40 exp(it) + 12 exp(5it) has a loop about each odd multiple of 45 deg; it crosses where 40 sin d = 12 sin 5d."""
    t = np.linspace(0, 2 * np.pi, 801)
    z = 40 * np.exp(1j * t) + 12 * np.exp(5j * t)
    found = find_crossings(NurbsCurve.interpolate(np.column_stack([z.real, z.imag]), closed=True))
    d = brentq(lambda d: 40 * np.sin(d) - 12 * np.sin(5 * d), 0.1, 0.6)
    radius = 40 * np.cos(d) - 12 * np.cos(5 * d)
    assert len(found) == 4
    for crossing, turn in zip(found, (45, 135, 225, 315), strict=True):
        place = radius * np.exp(1j * np.radians(turn))
        assert (crossing.x_mm, crossing.y_mm) == pytest.approx((place.real, place.imag), abs=1e-5)


@pytest.mark.parametrize(
    "curve",
    [
        profiles.p1(),
        profiles.p2(),
        profiles.p3(),
        profiles.ellipse(60, 25),
        profiles.ellipse(60, 0.001),
        profiles.stadium(50, 0.01),
        polygon([(0, 0), (100, 0), (100, 1e-4)]),
        polygon([(0, 0), (100, 0), (100, 1e-4)], closed=False),
    ],
    ids=["P1", "P2", "P3", "ellipse", "thin ellipse", "thin stadium", "needle", "open needle"],
)
def test_a_curve_that_keeps_apart_from_itself_has_none(curve: NurbsCurve) -> None:
    assert find_crossings(curve) == ()


def test_an_open_curve_may_end_on_its_own_beginning() -> None:
    turn = np.linspace(0, 2 * np.pi, 60)
    points = np.column_stack([30 * np.cos(turn), 20 * np.sin(turn)])
    points[-1] = points[0]
    assert find_crossings(NurbsCurve.interpolate(points)) == ()


def test_sides_that_lie_upon_each_other_are_one_place() -> None:
    (spike,) = find_crossings(polygon([(0, 0), (10, 0), (10, 5), (5, 5), (5, 8), (5, 5), (0, 5)]))
    assert spike.x_mm == pytest.approx(5.0, abs=1e-3)
    assert 20 - 1e-3 <= spike.first_mm <= spike.second_mm <= 26 + 1e-3  # from the foot of the spike and back to it


def test_touching_sides_are_found() -> None:
    """Two parabolas y = 1 + x^2 and y = 1 - x^2, from -3 to 3, joined outside: they touch at (0, 1)."""
    upper = [(-3.0, 10.0), (0.0, -8.0), (3.0, 10.0)]  # the Bezier points of 1 + x^2 over [-3, 3]
    lower = [(3.0, -8.0), (0.0, 10.0), (-3.0, -8.0)]
    control = [*upper, (6.0, 1.0), *lower, (-6.0, 1.0), upper[0]]
    curve = NurbsCurve(2, np.array(control), np.array([0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4]) / 4, closed=True)
    (touch,) = find_crossings(curve)
    assert (touch.x_mm, touch.y_mm) == pytest.approx((0.0, 1.0), abs=1e-2)
    moved = curve.control_points_mm.copy()
    moved[[0, 1, 2, 8], 1] += 1e-6  # a nanometre apart
    assert find_crossings(NurbsCurve(2, moved, curve.knots, closed=True)) == ()


def crosses_brute_force(points: Array) -> int:
    """Proper crossings of the segments of a closed polygon, each pair by its four orientations."""
    a, b = points, np.roll(points, -1, axis=0)

    def side(p: Array, q: Array, r: Array) -> Array:
        return np.asarray(np.sign((q[..., 0] - p[..., 0]) * (r[..., 1] - p[..., 1]) - (q[..., 1] - p[..., 1]) * (r[..., 0] - p[..., 0])))

    one, other = (a[:, None], b[:, None]), (a[None], b[None])
    proper = (side(*one, other[0]) * side(*one, other[1]) < 0) & (side(*other, one[0]) * side(*other, one[1]) < 0)
    return int(np.triu(proper, 2).sum())


@settings(max_examples=60, deadline=None)
@given(st.lists(st.tuples(st.floats(0, 100), st.floats(0, 100)), min_size=4, max_size=12, unique=True))
def test_random_polygons_cross_as_often_as_their_segments(corners: list[tuple[float, float]]) -> None:
    points = np.round(np.array(corners), 2) + 1e-3 * np.random.default_rng(len(corners)).random((len(corners), 2))
    assert len(find_crossings(polygon([(float(x), float(y)) for x, y in points]))) == crosses_brute_force(points)
