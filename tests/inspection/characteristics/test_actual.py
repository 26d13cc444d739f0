"""Actual sections drawn from measured points, where the part is known."""

import numpy as np
import pytest

from inspection import (
    ActualSection,
    Deviations,
    InspectionError,
    NominalProfile,
    NurbsCurve,
    ProfileFilter,
    RigidTransform,
    chord,
    compare_airfoil,
    compare_values,
    deviations,
    discretize,
    draw_actual_section,
    edge_radius,
    find_airfoil,
    find_camber_line,
    maximum_camber,
    maximum_thickness,
)
from tests.cmmlink.qualification.few_cases import case_named
from tests.inspection.characteristics.airfoils import Array
from tests.inspection.profiles import ellipse, even_in_arc_length, left_normal, naca


def nominal_ellipse() -> NominalProfile:
    return discretize(ellipse(50, 6), samples=200)


def on_ellipse(count: int, a: float = 50.0, b: float = 6.0, noise_mm: float = 0.0, seed: int = 3) -> Array:
    """Points even in the arc of another ellipse, with noise along its normals."""
    curve = ellipse(a, b)
    u = even_in_arc_length(curve, count)
    return curve.point(u) + np.random.default_rng(seed).normal(0, noise_mm, count)[:, None] * left_normal(curve, u)


def drawn(points: Array, nominal: NominalProfile | None = None, **how: float) -> ActualSection:
    profile = nominal or nominal_ellipse()
    return draw_actual_section(find_airfoil(profile), deviations(points, profile), **how)  # type: ignore[arg-type]


def deviations_of(actual: ActualSection) -> dict[tuple[str, str], float]:
    """Deviation of every characteristic, by name and method."""
    compared = compare_airfoil(actual).compared
    assert all(one.deviation == pytest.approx(one.actual.value - one.nominal.value) for one in compared)
    return {(one.nominal.name, one.nominal.method): one.deviation for one in compared}


def thickening(actual: ActualSection) -> float:
    """By how much the largest inscribed circle has grown."""
    nominal, found = (maximum_thickness(one, find_camber_line(one)) for one in (actual.nominal, actual.section))
    return compare_values(nominal, found).deviation


def test_a_thicker_longer_ellipse_is_found_as_one() -> None:
    actual = drawn(on_ellipse(4000, 50.05, 6.04), knots_mm=0.1)
    found = deviations_of(actual)
    assert found["maximum thickness", "inscribed"] == pytest.approx(0.08, abs=1e-6)
    assert found["chord", "maximum-distance"] == pytest.approx(0.10, abs=2e-5)
    assert found["leading edge radius", "curvature"] == pytest.approx(6.04**2 / 50.05 - 0.72, abs=1e-3)
    assert actual.rms_mm < 1e-7
    assert actual.source == "raw"
    assert "4000 raw deviations as a cubic spline with knots every 0.1 mm" in actual.notes[0]


def test_an_even_allowance_grows_every_length_by_itself() -> None:
    """A parallel curve: twice the allowance on thickness and chord, once on the radii of its edges.

    The curvature of the spline that draws it is right to some 1e-5 of itself, its places to 1e-7 mm.
    """
    profile = nominal_ellipse()
    u = even_in_arc_length(profile.curve, 2000)
    actual = drawn(profile.curve.point(u) - 0.03 * left_normal(profile.curve, u), profile)
    found = deviations_of(actual)
    for name, method, grown in (
        ("maximum thickness", "inscribed", 0.06),
        ("chord", "nose-tail", 0.06),
        ("chord", "minimum-circle", 0.06),
        ("leading edge radius", "curvature", 0.03),
        ("trailing edge radius", "curvature", 0.03),
    ):
        assert found[name, method] == pytest.approx(grown, abs=5e-5 if method == "curvature" else 2e-6), name


@pytest.mark.parametrize("material", ["left", "right"])
def test_material_on_the_other_side_makes_the_section_grow_the_other_way(material: str) -> None:
    profile = discretize(ellipse(50, 6), samples=200, material=material)  # type: ignore[arg-type]
    actual = drawn(on_ellipse(1000, 50.0, 6.04), profile)
    assert thickening(actual) == pytest.approx(0.08, abs=1e-4)


def test_noise_is_drawn_smooth_and_its_size_is_told() -> None:
    actual = drawn(on_ellipse(4000, 50.0, 6.04, noise_mm=0.003), knots_mm=2.0)
    assert actual.rms_mm == pytest.approx(0.003, rel=0.05)
    assert thickening(actual) == pytest.approx(0.08, abs=0.003)


def test_order_changes_nothing_and_dwelling_little() -> None:
    points = on_ellipse(1500, 50.0, 6.04, noise_mm=0.002)
    shuffled = np.random.default_rng(8).permutation(points)
    dwelling = np.vstack([points, np.repeat(points[700:701], 1500, axis=0)])
    one, other, third = (drawn(p, knots_mm=2.0).section for p in (points, shuffled, dwelling))
    assert np.array_equal(one.points_mm, other.points_mm)
    u = np.linspace(*one.curve.domain, 200)
    assert third.curve.point(u) == pytest.approx(one.curve.point(u), abs=1e-8)


@pytest.mark.parametrize("sharp", [True, False], ids=["sharp", "open"])
def test_a_section_with_a_trailing_edge_is_drawn_up_to_it(sharp: bool) -> None:
    curve = naca("2412", sharp=sharp)
    profile = discretize(curve, samples=400)
    u = even_in_arc_length(curve, 2000)
    actual = drawn(curve.point(u) + 0.02 * profile.outward * left_normal(curve, u), profile)
    assert actual.section.trailing == ("sharp" if sharp else "open")
    assert thickening(actual) == pytest.approx(0.04, abs=1e-6)
    assert actual.section.ends_mm() - actual.nominal.ends_mm() == pytest.approx(
        0.02 * profile.outward * left_normal(curve, np.array([actual.nominal.first, actual.nominal.last])), abs=1e-6
    )


def test_the_nominal_itself_has_no_deviation_at_all() -> None:
    curve = naca("4412", sharp=False)
    profile = discretize(curve, samples=400)
    actual = drawn(curve.point(even_in_arc_length(curve, 1000)), profile)
    worst = max(compare_airfoil(actual, offsets_mm=(1.0,)).compared, key=lambda one: abs(one.deviation))
    assert abs(worst.deviation) < 2e-5, worst.nominal.key


def test_what_lies_where_nothing_was_measured_is_left_out_with_its_reason() -> None:
    points = on_ellipse(2000, 50.0, 6.04)
    points = points[points[:, 0] > -48.0]  # the leading edge was not scanned
    result = compare_airfoil(drawn(points))
    missing = {one.name for one in result.left_out if "nothing was measured" in one.reason}
    assert {"chord (nose-tail)", "chord (maximum-distance)", "leading edge radius (circle)", "leading edge radius (curvature)"} <= missing
    given = {(one.nominal.name, one.nominal.method) for one in result.compared}
    assert ("maximum thickness", "inscribed") in given
    assert ("trailing edge radius", "circle") in given
    assert any("nothing was measured from station" in note for note in result.notes)


def test_a_gap_around_the_tip_of_a_closed_section_is_seen_from_both_ends() -> None:
    points = on_ellipse(2000, 50.0, 6.04)
    actual = drawn(points[points[:, 0] < 48.0])
    assert actual.is_unseen[0]
    assert actual.is_unseen[-1]
    assert not actual.is_unseen[actual.section.nose_sample]


def test_a_gap_inside_the_window_of_an_edge_leaves_its_circle_out() -> None:
    points = on_ellipse(6000, 50.0, 6.04)
    beside_the_tip = (points[:, 0] < -49.5) & (np.abs(points[:, 1] - 0.2) < 0.1)
    result = compare_airfoil(drawn(points[~beside_the_tip], gap_max_mm=0.15))
    (left,) = (one for one in result.left_out if one.name == "leading edge radius (circle)")
    assert "inside the window" in left.reason


def test_filtered_deviations_take_the_place_of_raw_ones_and_none_is_left_out() -> None:
    profile = nominal_ellipse()
    found = deviations(on_ellipse(2000, 50.0, 6.04), profile)
    half = np.where(np.arange(2000) % 7 == 0, np.nan, found.deviation_mm / 2)
    wanted = ProfileFilter(cutoff_mm=0.8)
    actual = draw_actual_section(find_airfoil(profile), found, half, wanted)
    assert actual.source == f"filtered ({wanted.words})"
    assert "cutoff 0.8 mm" in actual.notes[0]
    assert actual.notes[1].startswith("286 points took no part")
    assert actual.points == 2000 - 286
    assert thickening(actual) == pytest.approx(0.04, abs=1e-4)
    with pytest.raises(ValueError, match="expected 2000 filtered deviations"):
        draw_actual_section(find_airfoil(profile), found, half[:-1], wanted)
    with pytest.raises(ValueError, match="give both, or none"):
        draw_actual_section(find_airfoil(profile), found, half)


def test_points_beyond_an_end_and_at_a_corner_draw_nothing() -> None:
    curve: NurbsCurve = naca("4412", sharp=False)
    profile = discretize(curve, samples=400)
    points = curve.point(even_in_arc_length(curve, 800))
    beyond = np.vstack([points, [[101.0, 0.0], [103.0, 0.2]]])
    found: Deviations = deviations(beyond, profile)
    assert found.beyond_end.sum() == 2
    assert draw_actual_section(find_airfoil(profile), found).points == 800


def test_too_few_points_and_knots_too_far_apart_are_refused() -> None:
    with pytest.raises(InspectionError, match="only 5 points"):
        drawn(on_ellipse(2000)[:5])
    with pytest.raises(ValueError, match="below a quarter"):
        drawn(on_ellipse(200), knots_mm=80.0)


def test_a_part_beside_a_section_of_arcs_and_lines_has_its_numbers_though_the_curvature_jumps() -> None:
    """A spline across the joints would swing there: a radius by curvature was a sixth off, and a camber 4 um."""
    case = case_named("section-bent-too-large")
    given, pose = case.nominal, case.truth.pose
    assert pose is not None
    nominal = discretize(NurbsCurve(given.degree, given.control_points, given.knots, given.weights, closed=True), samples=2000)
    placed = RigidTransform(np.radians(pose.rotation_deg), np.array(pose.translation)).apply(case.points)
    section = draw_actual_section(find_airfoil(nominal), deviations(placed, nominal)).section
    camber = find_camber_line(section)
    found = {
        "leading edge radius": edge_radius(section, "leading", "circle", 60.0),
        "trailing edge radius": edge_radius(section, "trailing", "circle", 60.0),
        "leading edge radius by curvature": edge_radius(section, "leading", "curvature"),
        "chord": chord(section, camber, "maximum-distance"),
        "chord by nose and tail": chord(section, camber, "nose-tail"),
        "largest thickness": maximum_thickness(section, camber, "inscribed"),
        "largest camber": maximum_camber(section, camber),
    }
    for known in case.truth.values:
        assert found[known.name].value == pytest.approx(known.value, abs=2e-5 if "curvature" in known.name else 1e-8), known.name
