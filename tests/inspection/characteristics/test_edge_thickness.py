"""Edge thicknesses by four methods, on a tapered section with a slanted blunt end: every value is a meeting of straight lines."""

import math
from functools import cache

import numpy as np
import pytest

from inspection import (
    AirfoilSection,
    CamberLine,
    EdgeThicknessMethod,
    InspectionError,
    NurbsCurve,
    edge_thickness,
    find_airfoil,
    find_camber_line,
)
from tests.inspection.characteristics.airfoils import bent_ellipse, ellipse_section
from tests.inspection.profiles import Array, naca

RADIUS, TAPER = 5.0, 0.03  # of the nose, and the slope by which both sides come together
ABOVE, BELOW = 76.0, 80.0  # where the flat meets the upper and the lower side
TILT = math.atan(TAPER)


def half_mm(x: float) -> float:
    """Half the thickness at x: the sides touch the nose's circle about the origin."""
    return RADIUS / math.cos(TILT) - TAPER * x


@cache
def tapered() -> tuple[AirfoilSection, CamberLine]:
    """From the upper end of the flat over the nose back to its lower end, and along the flat; with its camber line."""
    up, down = np.array([ABOVE, half_mm(ABOVE)]), np.array([BELOW, -half_mm(BELOW)])
    touch = RADIUS * np.array([math.sin(TILT), math.cos(TILT)])
    sweep = math.pi / 2 + TILT  # from a side to the foremost point
    corner = np.array([-RADIUS, RADIUS * math.tan(sweep / 2)])
    mirror = np.array([1.0, -1.0])
    control = [up, (up + touch) / 2, touch, corner, [-RADIUS, 0.0], corner * mirror, touch * mirror, (touch * mirror + down) / 2, down]
    control += [(up + down) / 2, up]
    weights = np.ones(11)
    weights[[3, 5]] = math.cos(sweep / 2)
    knots = np.array([0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5, 5]) / 5.0
    section = find_airfoil(NurbsCurve(2, np.array(control, dtype=float), knots, weights, closed=True))
    return section, find_camber_line(section)


def on_sides(x: float, across: Array) -> float:
    """The distance of both sides along a direction (2,) through (x, 0)."""
    reach = [half_mm(x) / (abs(across[1]) + way * TAPER * across[0] * np.sign(across[1])) for way in (1, -1)]
    return float(sum(reach) * np.hypot(*across))


FLAT = np.array([ABOVE - BELOW, half_mm(ABOVE) + half_mm(BELOW)])
TAIL_X = ABOVE + (BELOW - ABOVE) * half_mm(ABOVE) / (half_mm(ABOVE) + half_mm(BELOW))
UP = np.array([0.0, 1.0])


@pytest.mark.parametrize("offset_mm", [4.0, 11.0, 25.0])
@pytest.mark.parametrize("method", ["tip-arc", "tip-arc-square", "offset-flat", "offset-flat-square"])
def test_every_method_meets_the_sides_where_straight_lines_do(method: EdgeThicknessMethod, offset_mm: float) -> None:
    section, camber = tapered()
    assert section.trailing == "blunt"
    assert camber.tail_mm == pytest.approx([TAIL_X, 0.0], abs=1e-6)
    x = TAIL_X - (offset_mm if method.startswith("tip-arc") else offset_mm * np.hypot(*FLAT) / FLAT[1])
    expected = on_sides(x, FLAT if method.endswith("square") else UP)
    found = edge_thickness(section, camber, "trailing", offset_mm, method)
    assert found.value == pytest.approx(expected, abs=2e-6)
    assert found.places_mm[2] == pytest.approx([x, 0.0], abs=2e-6)
    assert (found.method, found.window) == (method, (("offset_mm", offset_mm),))


def test_the_four_methods_differ() -> None:
    section, camber = tapered()
    methods: tuple[EdgeThicknessMethod, ...] = ("tip-arc", "tip-arc-square", "offset-flat", "offset-flat-square")
    values = [edge_thickness(section, camber, "trailing", 11.0, method).value for method in methods]
    assert min(abs(a - b) for i, a in enumerate(values) for b in values[:i]) > 0.02


def test_at_a_round_edge_the_flat_is_the_tangent() -> None:
    """On an ellipse an arc and a line meet its axis at one place; on one that is bent by inversion they do not."""
    offset_mm = 3.0
    for section, alike in ((ellipse_section(), True), (bent_ellipse(), False)):
        camber = find_camber_line(section)
        for edge in ("leading", "trailing"):
            arc, flat = (edge_thickness(section, camber, edge, offset_mm, method) for method in ("tip-arc", "offset-flat"))
            assert (abs(arc.value - flat.value) < 1e-8) is alike
            tip = camber.nose_mm if edge == "leading" else camber.tail_mm
            away = flat.places_mm[2] - tip
            outline = section.point(np.linspace(section.first, section.last, 40_001))
            near = outline[np.argsort(np.hypot(*(outline - tip).T))[:9]]
            tangent = np.linalg.svd(near - near.mean(axis=0))[2][0]
            assert abs(tangent[0] * away[1] - tangent[1] * away[0]) == pytest.approx(offset_mm, abs=2e-3 * offset_mm)


def test_an_edge_without_what_a_method_asks_for_is_refused() -> None:
    section = ellipse_section()
    camber = find_camber_line(section)
    with pytest.raises(InspectionError, match=r"the leading edge is round: tip-arc-square needs one that ends in a flat; choose tip-arc$"):
        edge_thickness(section, camber, "leading", 1.0, "tip-arc-square")
    sharp = find_airfoil(naca())
    with pytest.raises(InspectionError, match="the trailing edge is sharp: the outline has no direction at its edge point; choose tip-arc"):
        edge_thickness(sharp, find_camber_line(sharp), "trailing", 1.0, "offset-flat")
    with pytest.raises(ValueError, match="must be one of tip-arc, tip-arc-square, offset-flat, offset-flat-square, not 'longest'"):
        edge_thickness(section, camber, "leading", 1.0, "longest")  # type: ignore[arg-type]
