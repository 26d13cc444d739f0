import numpy as np
import pytest

from inspection import (
    RigidTransform,
    SectionValue,
    StackedSections,
    bow,
    chord_angle,
    compare_values,
    discretize,
    displacement,
    find_airfoil,
    find_camber_line,
    fit_stacking_axis,
    register_fine,
    relative_twist,
    taper,
    twist_by_chord,
    twist_by_fit,
)
from tests.inspection.characteristics.airfoils import file_section
from tests.inspection.profiles import even_in_arc_length, moved_curve, rotated

HEIGHTS = np.array([0.0, 10.0, 25.0, 40.0])


def stack(twist_deg: object = 0.0, displacement_mm: object = 0.0) -> StackedSections:
    k = len(HEIGHTS)
    moved = np.broadcast_to(np.asarray(displacement_mm, dtype=float), (k, 2)).copy()
    return StackedSections(HEIGHTS.copy(), np.broadcast_to(np.asarray(twist_deg, dtype=float), (k,)).copy(), moved, np.zeros((k, 2)))


def test_twist_by_both_methods_is_the_rotation_of_a_part_that_was_turned() -> None:
    section = file_section("goe404")
    turned = find_airfoil(moved_curve(section.curve, 1.5, (0.3, -0.2)))
    angles = [chord_angle(one, find_camber_line(one), "caliper") for one in (section, turned)]
    assert twist_by_chord(*angles).value == pytest.approx(1.5, abs=1e-7)
    assert twist_by_chord(*angles).method == "chord-angle caliper"
    points = rotated(section.curve.point(even_in_arc_length(section.curve, 200)), 1.5, (0.3, -0.2))
    fit = register_fine(points, discretize(section.curve, samples=400), RigidTransform.identity())
    assert twist_by_fit(fit).value == pytest.approx(1.5, abs=1e-7)
    along_x, along_y, in_all = displacement(fit, (40.0, 3.0))
    moved = rotated(np.array([[40.0, 3.0]]), 1.5, (0.3, -0.2))[0] - (40.0, 3.0)
    assert (along_x.value, along_y.value) == pytest.approx(tuple(moved), abs=1e-7)
    assert in_all.value == pytest.approx(np.hypot(*moved), abs=1e-7)
    assert in_all.window == (("x_mm", 40.0), ("y_mm", 3.0))


def test_angles_of_two_methods_are_no_twist() -> None:
    section = file_section("goe404")
    camber = find_camber_line(section)
    with pytest.raises(ValueError, match="one method"):
        twist_by_chord(chord_angle(section, camber, "caliper"), chord_angle(section, camber, "nose-tail"))


def test_angles_are_compared_within_half_a_turn() -> None:
    one, other = (SectionValue("chord angle", "nose-tail", angle, "deg", np.zeros((0, 2)), ()) for angle in (179.9, -179.9))
    assert compare_values(one, other).deviation == pytest.approx(0.2)
    assert compare_values(other, one).deviation == pytest.approx(-0.2)


def test_relative_twist_is_against_the_section_named() -> None:
    values = relative_twist(stack(twist_deg=[0.1, 0.2, 0.4, 15.1]), reference=1)
    assert [value.value for value in values] == pytest.approx([-0.1, 0.0, 0.2, 14.9])
    assert values[0].window == (("reference_height_mm", 10.0),)


def test_a_stack_that_leans_straight_has_no_bow_and_its_angle() -> None:
    slope = np.array([np.tan(np.radians(0.5)), -np.tan(np.radians(0.2))])
    leaning = stack(displacement_mm=0.3 + HEIGHTS[:, None] * slope)
    axis = fit_stacking_axis(leaning)
    assert axis.lean_x_deg.value == pytest.approx(0.5)
    assert axis.lean_y_deg.value == pytest.approx(-0.2)
    assert axis.origin_mm == pytest.approx([0.3, 0.3])
    assert axis.direction == pytest.approx(np.append(slope, 1) / np.linalg.norm(np.append(slope, 1)))
    assert axis.residual_mm == pytest.approx(np.zeros((4, 2)), abs=1e-12)
    assert [value.value for value in bow(leaning)] == pytest.approx([0, 0, 0, 0], abs=1e-12)


def test_bow_is_the_distance_from_the_line_between_root_and_tip() -> None:
    offsets = np.array([(0, 0), (0.03, 0.04), (0, 0.1), (0, 0)])
    values = bow(stack(displacement_mm=offsets + HEIGHTS[:, None] * [0.01, 0.02]))
    assert [value.value for value in values] == pytest.approx([0, 0.05, 0.1, 0], abs=1e-12)
    assert values[1].places_mm[0] - values[1].places_mm[1] == pytest.approx([0.03, 0.04])


def test_a_stack_that_is_curved_by_design_has_no_bow() -> None:
    designed = StackedSections(HEIGHTS.copy(), np.zeros(4), np.zeros((4, 2)), np.column_stack([HEIGHTS**2, HEIGHTS]) / 100)
    assert max(value.value for value in bow(designed)) == 0
    assert fit_stacking_axis(designed).lean_x_deg.value == pytest.approx(0, abs=1e-12)


def test_taper_is_the_slope_of_a_length_over_the_height() -> None:
    chords = tuple(
        SectionValue("chord", "tangent", 50 - 0.1 * h + e, "mm", np.zeros((0, 2)), ()) for h, e in zip(HEIGHTS, (0, 0, 0, 0), strict=True)
    )
    found = taper(HEIGHTS, chords)
    assert found.value == pytest.approx(-0.1)
    assert (found.name, found.method, found.unit) == ("taper of chord", "tangent", "1")
    other = SectionValue("chord", "caliper", 50.0, "mm", np.zeros((0, 2)), ())
    with pytest.raises(ValueError, match="one method"):
        taper(HEIGHTS, (*chords[:3], other))


def test_a_stack_that_is_not_in_order_is_refused() -> None:
    with pytest.raises(ValueError, match="rising heights"):
        StackedSections(HEIGHTS[::-1].copy(), np.zeros(4), np.zeros((4, 2)), np.zeros((4, 2)))
    with pytest.raises(ValueError, match="finite"):
        stack(twist_deg=[0, np.nan, 0, 0])
