"""Camber line and thickness against sections whose medial axis is known in closed form."""

import numpy as np
import pytest

from inspection import InspectionError, NurbsCurve, edge_thickness, find_airfoil, find_camber_line, maximum_camber, maximum_thickness
from inspection.characteristics.inscribed import inscribe_circles
from tests.inspection.characteristics.airfoils import bent_ellipse, ellipse_circles, ellipse_section, file_section, invert, invert_circles
from tests.inspection.profiles import circle, moved_curve, naca, stadium


def test_the_circles_of_an_ellipse_are_those_of_the_closed_form() -> None:
    circles = find_camber_line(ellipse_section()).circles
    centre, radius = ellipse_circles(circles.centre_mm[:, 0])
    assert circles.is_whole.all()
    assert circles.centre_mm == pytest.approx(centre, abs=1e-9)
    assert circles.radius_mm == pytest.approx(radius, abs=1e-9)
    assert circles.centre_mm[0, 0] < -48  # of -49.28, at which the medial axis ends


def test_the_camber_line_of_a_bent_ellipse_is_the_image_of_its_axis() -> None:
    circles = find_camber_line(bent_ellipse()).circles
    centre, radius = invert_circles(circles.centre_mm, circles.radius_mm)  # an inversion undoes itself
    on_axis, expected = ellipse_circles(centre[:, 0])
    assert centre == pytest.approx(on_axis, abs=1e-6)  # how well the spline follows the ellipse, where contacts are 30 degrees apart
    assert radius == pytest.approx(expected, abs=1e-6)
    assert np.ptp(circles.centre_mm[:, 1]) > 5  # it is bent


def test_the_largest_camber_and_thickness_of_a_bent_ellipse_are_those_of_the_closed_form() -> None:
    section = bent_ellipse()
    camber = find_camber_line(section)
    x = np.linspace(-20.0, 20.0, 100_001)
    centre, radius = invert_circles(*ellipse_circles(x))
    chord = (camber.tail_mm - camber.nose_mm) / np.hypot(*(camber.tail_mm - camber.nose_mm))
    height = (centre - camber.nose_mm) @ np.array([-chord[1], chord[0]])
    found = maximum_camber(section, camber)
    assert abs(found.value) == pytest.approx(np.abs(height).max(), abs=2e-7)  # how well the spline follows the ellipse
    assert maximum_thickness(section, camber).value == pytest.approx(2 * radius.max(), abs=2e-7)
    assert np.hypot(*(found.places_mm[0] - centre[int(np.argmax(np.abs(height)))])) < 1e-2  # flat there: the place is blunt


def test_nose_and_tail_of_a_bent_ellipse_lie_near_the_images_of_its_tips() -> None:
    camber = find_camber_line(bent_ellipse())
    tips = invert(np.array([[-50.0, 0.0], [50.0, 0.0]]))
    assert np.vstack([camber.nose_mm, camber.tail_mm]) == pytest.approx(tips, abs=0.02)
    assert camber.continued_mm[0] > 0.5
    assert "straight over the last" in camber.notes[0]


def test_a_symmetric_section_has_no_camber_and_a_thickness_of_closed_form() -> None:
    section = find_airfoil(naca("0012"))
    camber = find_camber_line(section)
    assert maximum_camber(section, camber).value == pytest.approx(0.0, abs=1e-7)
    x = np.linspace(0.29, 0.31, 200_001)
    y = 0.6 * (0.2969 * np.sqrt(x) - 0.1260 * x - 0.3516 * x**2 + 0.2843 * x**3 - 0.1036 * x**4)
    for method in ("inscribed", "two-point"):
        assert maximum_thickness(section, camber, method).value == pytest.approx(200 * y.max(), abs=1e-5)  # spline through 80 points a side


def test_the_camber_line_ends_in_the_corner_of_a_sharp_trailing_edge() -> None:
    camber = find_camber_line(find_airfoil(naca("2412")))
    assert camber.tail_mm == pytest.approx([100.0, 0.0], abs=1e-9)
    assert camber.continued_mm[1] < 0.1


def test_no_circle_of_a_camber_line_holds_a_place_of_the_outline() -> None:
    section = file_section("goe404")
    circles = find_camber_line(section).circles
    outline = section.curve.point(np.linspace(section.first, section.last, 20_001))
    depth = [radius - np.hypot(*(outline - centre).T).min() for centre, radius in zip(circles.centre_mm, circles.radius_mm, strict=True)]
    assert max(depth) < 1e-6
    assert np.hypot(*(circles.contact_u - circles.centre_mm).T) == pytest.approx(circles.radius_mm, abs=1e-12)
    assert np.hypot(*(circles.contact_v - circles.centre_mm).T) == pytest.approx(circles.radius_mm, abs=1e-10)


def test_a_circle_that_would_cross_the_other_side_is_not_whole() -> None:
    section = ellipse_section()
    assert not inscribe_circles(section, np.array([section.first, section.nose])).is_whole.any()


@pytest.mark.parametrize("offset_mm", [0.2, 1.0, 5.0, 30.0])
def test_the_edge_thickness_of_an_ellipse_is_its_ordinate(offset_mm: float) -> None:
    section = ellipse_section()
    camber = find_camber_line(section)
    for edge in ("leading", "trailing"):
        found = edge_thickness(section, camber, edge, offset_mm)
        assert found.value == pytest.approx(12 * np.sqrt(1 - ((50 - offset_mm) / 50) ** 2), abs=1e-8)
        assert found.window == (("offset_mm", offset_mm),)
        assert bool(found.notes) == (offset_mm < camber.continued_mm[0])


def test_an_offset_that_leaves_the_section_is_refused() -> None:
    camber = find_camber_line(ellipse_section())
    with pytest.raises(InspectionError, match="beyond the other edge"):
        edge_thickness(ellipse_section(), camber, "leading", 120.0)
    with pytest.raises(ValueError, match="positive length"):
        edge_thickness(ellipse_section(), camber, "leading", 0.0)


def test_camber_and_thickness_do_not_change_when_the_section_is_turned_and_moved() -> None:
    still = file_section("s1223")
    moved = find_airfoil(moved_curve(still.curve, 137.0, (400.0, -90.0)))
    values = [(maximum_camber(s, c).value, maximum_thickness(s, c).value) for s in (still, moved) for c in (find_camber_line(s),)]
    assert values[0] == pytest.approx(values[1], abs=1e-9)


def test_an_outline_without_two_sides_has_no_camber_line() -> None:
    with pytest.raises(InspectionError, match="no airfoil section"):
        find_camber_line(find_airfoil(circle(10.0)))


def test_camber_is_positive_towards_the_upper_side() -> None:
    for designation, sign in (("4412", 1), ("2412", 1)):
        section = find_airfoil(naca(designation))
        assert maximum_camber(section, find_camber_line(section)).value * sign > 1
    curve = naca("4412")
    mirrored = NurbsCurve(3, curve.control_points_mm * (1, -1), curve.knots, closed=True)
    upright, hanging = (maximum_camber(one, find_camber_line(one)).value for one in map(find_airfoil, (curve, mirrored)))
    assert hanging == pytest.approx(-upright)


def test_parallel_sides_with_round_ends_have_a_straight_camber_line() -> None:
    section = find_airfoil(stadium(30.0, 4.0))
    camber = find_camber_line(section)
    assert maximum_thickness(section, camber).value == pytest.approx(8.0, abs=1e-9)
    assert maximum_camber(section, camber).value == pytest.approx(0.0, abs=1e-6)
    assert np.vstack([camber.nose_mm, camber.tail_mm]) == pytest.approx(np.array([[-34.0, 0.0], [34.0, 0.0]]), abs=1e-3)
