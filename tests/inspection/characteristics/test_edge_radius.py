"""Radii of edges: closed forms, an independent fit, and what has none.

The published least-squares data of NIST (StRD) hold no circles, and no public set of circles or lines was found to take instead: so arcs,
ellipses and a library's minimiser are the truth here.
"""

import numpy as np
import pytest
from scipy.optimize import least_squares

from inspection import InspectionError, edge_radius, find_airfoil
from tests.inspection.characteristics.airfoils import Array, ellipse_section, file_section
from tests.inspection.profiles import naca, stadium


def ellipse_arc(window_deg: float, count: int, a: float = 50.0, b: float = 6.0) -> Array:
    """Places (count, 2) at the left tip of an ellipse, the middles of equal arcs of the window; written out, with no spline."""
    t = np.arctan(b / a * np.tan(np.radians(window_deg)))  # where the tangent (a sin t, b cos t) has turned by the window
    fine = np.linspace(-t, t, 200_001)
    x, y = -a * np.cos(fine), b * np.sin(fine)
    travelled = np.concatenate([[0], np.cumsum(np.hypot(np.diff(x), np.diff(y)))])
    at = np.interp((np.arange(count) + 0.5) / count * travelled[-1], travelled, fine)
    return np.column_stack([-a * np.cos(at), b * np.sin(at)])


def fit_circle(points: Array, weight: Array, start: Array) -> Array:
    """x, y and radius of the circle of least weighted squares, by a library."""

    def rest(circle: Array) -> Array:
        return np.asarray(np.sqrt(weight) * (np.hypot(*(points - circle[:2]).T) - circle[2]))

    return np.asarray(least_squares(rest, start, xtol=1e-14, ftol=1e-14, gtol=1e-14).x)


def circle_through(points: Array) -> Array:
    """x, y and radius of the circle of least squares, by a library."""
    start = np.array([*points.mean(axis=0), 1.0])
    return fit_circle(points, np.ones(len(points)), start)


def test_the_radius_of_curvature_of_an_ellipse_is_that_of_the_closed_form() -> None:
    for edge in ("leading", "trailing"):
        found = edge_radius(ellipse_section(), edge, "curvature")
        assert found.value == pytest.approx(6**2 / 50, rel=1e-9)
        assert np.abs(found.places_mm[1]) == pytest.approx([50 - 0.72, 0], abs=1e-5)


@pytest.mark.parametrize("window_deg", [20.0, 60.0])
def test_the_circle_of_a_window_is_that_of_an_independent_fit(window_deg: float) -> None:
    arc = ellipse_arc(window_deg, 20_000)
    x, y, radius = circle_through(arc)
    found = edge_radius(ellipse_section(), "leading", "circle", window_deg)
    assert found.value == pytest.approx(radius, rel=2e-6)
    assert found.places_mm[1] == pytest.approx([x, y], abs=1e-5)
    assert found.residual_mm == pytest.approx(np.abs(np.hypot(*(arc - (x, y)).T) - radius).max(), rel=1e-3)
    assert np.abs(found.places_mm[2:, 1]) == pytest.approx(np.abs(arc[[0, -1], 1]), rel=1e-3)


@pytest.mark.parametrize(("name", "window_deg"), [("goe404", 30.0), ("e387", 60.0)])
def test_the_circle_of_an_airfoil_does_not_depend_on_a_number_of_points(name: str, window_deg: float) -> None:
    section = file_section(name)
    found = edge_radius(section, "leading", "circle", window_deg)
    u = np.linspace(section.first, section.last, 200_001)
    points, first = section.curve.derivatives(u, 1)
    heading = np.unwrap(np.arctan2(first[:, 1], first[:, 0]))
    tip = int(np.searchsorted(u, section.nose))
    turned = heading - np.interp(section.nose, u, heading)  # 0.06 degrees beside the tip change the circle of e387 by 1.4 %
    inside = np.abs(turned) <= np.radians(window_deg)
    low, high = tip - np.argmin(inside[tip::-1]) + 1, tip + np.argmin(inside[tip:])
    weight = np.hypot(*first[low:high].T)  # of equal steps of the parameter: the integral over the arc
    points = points[low:high]
    start = [*points.mean(axis=0), found.value]
    assert found.value == pytest.approx(
        fit_circle(points, weight, np.array(start))[2], rel=2e-4 if window_deg > 30 else 5e-5
    )  # a window cut at a sample


def test_the_end_of_a_stadium_has_the_radius_of_its_arc_for_every_window() -> None:
    section = find_airfoil(stadium(30.0, 4.0))
    for edge, sign in (("leading", -1), ("trailing", 1)):
        for found in (edge_radius(section, edge, "curvature"), *(edge_radius(section, edge, "circle", window) for window in (20.0, 80.0))):  # type: ignore[arg-type]
            assert found.value == pytest.approx(4.0, abs=1e-9)
            assert found.places_mm[:2] == pytest.approx(np.array([[sign * 34.0, 0.0], [sign * 30.0, 0.0]]), abs=1e-2)


def test_a_window_that_the_outline_does_not_fill_says_so() -> None:
    found = edge_radius(file_section("n0012"), "leading", "circle", 120.0)
    assert len(found.notes) == 2
    assert "where the outline does" in found.notes[0]


def test_a_trailing_edge_that_is_not_round_has_no_radius() -> None:
    with pytest.raises(InspectionError, match="the trailing edge is sharp"):
        edge_radius(find_airfoil(naca()), "trailing")
    with pytest.raises(ValueError, match="up to 180 degrees"):
        edge_radius(ellipse_section(), "leading", "circle", 0.0)
