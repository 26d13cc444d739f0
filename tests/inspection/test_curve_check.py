"""Changes of curvature and the tightest hollow, against curves whose own are known."""

import numpy as np
import pytest
from scipy.integrate import quad

from inspection import NurbsCurve, check_curve
from tests.inspection import profiles

HEIGHT, WAVE = 2.0, 2 * np.pi / 40  # of y = HEIGHT sin(WAVE x), over two and a half waves


def wave() -> NurbsCurve:
    x = np.linspace(0, 100, 801)
    return NurbsCurve.interpolate(np.column_stack([x, HEIGHT * np.sin(WAVE * x)]))


def along_wave(x: float) -> float:
    return float(quad(lambda at: np.hypot(1, HEIGHT * WAVE * np.cos(WAVE * at)), 0, x, limit=200)[0])


def test_the_curvature_of_a_wave_changes_its_sign_at_every_zero() -> None:
    check = check_curve(wave(), None)
    np.testing.assert_allclose(check.sign_changes_mm, [along_wave(x) for x in (20, 40, 60, 80)], atol=1e-5)
    assert check.hollow is None
    assert check.crossings == ()


@pytest.mark.parametrize(("material", "places"), [("right", (30.0, 70.0)), ("left", (10.0, 50.0, 90.0))])
def test_the_tightest_hollow_of_a_wave_lies_in_a_trough(material: str, places: tuple[float, ...]) -> None:
    """Below the wave lies its right side: there the troughs are hollow, on the left the crests."""
    hollow = check_curve(wave(), "right" if material == "right" else "left").hollow
    assert hollow is not None
    assert hollow.radius_mm == pytest.approx(1 / (HEIGHT * WAVE**2), rel=1e-4)  # the spline through 320 points a wave
    assert min(abs(hollow.x_mm - x) for x in places) < 1e-3
    assert hollow.station_mm == pytest.approx(along_wave(hollow.x_mm), abs=1e-6)


@pytest.mark.parametrize(
    ("curve", "tightest_mm"), [(profiles.ellipse(60, 20), 20**2 / 60), (profiles.stadium(40, 12), 12.0)], ids=["ellipse", "stadium"]
)
def test_a_convex_curve_has_neither(curve: NurbsCurve, tightest_mm: float) -> None:
    check = check_curve(curve, "left")
    assert check.sign_changes_mm.size == 0
    assert check.hollow is None
    inside_out = check_curve(curve, "right").hollow  # a bore: hollow all round, tightest at the ends
    assert inside_out is not None
    assert inside_out.radius_mm == pytest.approx(tightest_mm, rel=1e-9)


def test_between_two_bends_the_middle_of_the_straight_stretch_counts() -> None:
    """A quarter circle of radius 10 to the left, 8 mm straight, and a quarter circle to the right."""
    control = [(0, 0), (10, 0), (10, 10), (10, 14), (10, 18), (10, 28), (20, 28)]
    weights = [1, np.sqrt(0.5), 1, 1, 1, np.sqrt(0.5), 1]
    curve = NurbsCurve(2, np.array(control, dtype=float), np.array([0, 0, 0, 1, 1, 2, 2, 3, 3, 3]) / 3, np.array(weights))
    np.testing.assert_allclose(check_curve(curve, None).sign_changes_mm, [5 * np.pi + 4], atol=1e-9)


def test_a_corner_is_no_change_of_curvature() -> None:
    """A sickle of two parabolas, y = 10 - x^2 / 250 and y = 5 - x^2 / 500: it is hollow along one side, from corner to corner."""
    control = [(50, 0), (0, 20), (-50, 0), (0, 10), (50, 0)]
    curve = NurbsCurve(2, np.array(control, dtype=float), np.array([0, 0, 0, 1, 1, 2, 2, 2]), closed=True)
    assert len(curve.corners) == 2
    check = check_curve(curve, "left")
    assert check.sign_changes_mm.size == 0
    assert check.hollow is not None
    assert check.hollow.radius_mm == pytest.approx(250.0, rel=1e-9)
    assert (check.hollow.x_mm, check.hollow.y_mm) == pytest.approx((0.0, 5.0), abs=1e-3)
