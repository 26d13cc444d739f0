import numpy as np
import pytest

from inspection import InspectionError, chord, chord_angle, evaluate_airfoil, find_airfoil, find_camber_line
from tests.inspection.characteristics.airfoils import ellipse_section, file_section, file_values, value_of
from tests.inspection.profiles import moved_curve, rotated, stadium

METHODS = ("nose-tail", "tangent", "x-extent", "minimum-circle", "maximum-distance")


@pytest.mark.parametrize("method", METHODS)
def test_every_chord_of_an_ellipse_is_its_long_axis(method: str) -> None:
    section = ellipse_section()
    assert chord(section, find_camber_line(section), method).value == pytest.approx(100.0, abs=1e-9)  # type: ignore[arg-type]


def test_a_turned_ellipse_is_as_long_but_for_its_extent_in_x() -> None:
    section = find_airfoil(moved_curve(ellipse_section().curve, 30.0, (5.0, 7.0)), leading_near_mm=(-40.0, -15.0))
    camber = find_camber_line(section)
    for method in ("nose-tail", "tangent", "minimum-circle", "maximum-distance"):
        assert chord(section, camber, method).value == pytest.approx(100.0, abs=1e-8)
    wide = 2 * np.hypot(50 * np.cos(np.pi / 6), 6 * np.sin(np.pi / 6))
    assert chord(section, camber, "x-extent").value == pytest.approx(wide, abs=1e-9)
    for angle in ("nose-tail", "maximum-distance"):
        assert chord_angle(section, camber, angle).value == pytest.approx(30.0, abs=1e-5)


@pytest.mark.parametrize("name", ["goe404", "rae2822"])
def test_no_place_of_the_section_lies_beyond_the_flat(name: str) -> None:
    found = value_of(file_values(name).values, "chord angle", "caliper")
    section = file_section(name)
    outline = section.curve.point(np.linspace(section.first, section.last, 50_001))
    along = np.array([np.cos(np.radians(found.value)), np.sin(np.radians(found.value))])
    height = (outline - found.places_mm[0]) @ np.array([-along[1], along[0]])
    assert height.min() > -1e-9
    assert abs((found.places_mm[1] - found.places_mm[0]) @ np.array([-along[1], along[0]])) < 1e-12
    assert found.places_mm[0, 0] < found.places_mm[1, 0]


def test_the_smallest_circle_holds_the_whole_section() -> None:
    section = file_section("s1223")
    found = value_of(file_values("s1223").values, "chord", "minimum-circle")
    outline = section.curve.point(np.linspace(section.first, section.last, 50_001))
    centre = found.places_mm[-1]
    assert np.hypot(*(outline - centre).T).max() <= found.value / 2 + 1e-9
    assert np.hypot(*(found.places_mm[:-1] - centre).T) == pytest.approx(found.value / 2, abs=1e-9)


def test_a_convex_section_has_no_caliper_chord_and_says_why() -> None:
    with pytest.raises(InspectionError, match="no hollow side"):
        chord(ellipse_section(), find_camber_line(ellipse_section()), "caliper")


def test_a_method_that_is_none_is_refused_by_name() -> None:
    camber = find_camber_line(ellipse_section())
    with pytest.raises(ValueError, match="nose-tail, tangent, caliper, x-extent, minimum-circle, maximum-distance, not 'longest'"):
        chord(ellipse_section(), camber, "longest")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="not 'tangent'"):
        chord_angle(ellipse_section(), camber, "tangent")  # type: ignore[arg-type]


def test_every_value_moves_with_the_section() -> None:
    """Turned by 70 degrees and moved: lengths stay, angles grow by 70, places move along."""
    still = file_values("goe404")
    moved = evaluate_airfoil(find_airfoil(moved_curve(file_section("goe404").curve, 70.0, (3.0, -8.0))), (30.0, 60.0), (1.0, 5.0))
    by_key = {value.key: value for value in moved.values}
    for value in still.values:
        if value.method == "x-extent":
            continue
        other = by_key[value.key]
        assert other.value == pytest.approx(value.value + (70.0 if value.unit == "deg" else 0.0), abs=1e-7), value.key
        assert other.places_mm == pytest.approx(rotated(value.places_mm, 70.0, (3.0, -8.0)), abs=1e-4), value.key


def test_the_extremes_of_a_round_section_may_lie_on_either_side_of_its_first_place() -> None:
    section = find_airfoil(stadium(30.0, 4.0))
    camber = find_camber_line(section)
    for method in METHODS:
        assert chord(section, camber, method).value == pytest.approx(68.0, abs=1e-9)  # type: ignore[arg-type]
