"""Certificates of minimum zones: printed values of independent programs, and starts, gaps and parts that try them."""

import numpy as np
import pytest

from inspection import RigidTransform, certify_minimum_zone, deviations, discretize, fit_minimum_zone
from inspection.rigid import rotation_about
from tests.inspection import profiles
from tests.inspection.oracle import closest_point
from tests.inspection.profiles import Array
from tests.inspection.reference_parts import nominal_of, reference_form, scan

# Half zone; active points and multipliers; x and y in mm, rotation in degrees; boxes that a program in long double looked at.
PRINTED = {
    "goe404": (
        (0.036958537, (141, 309, 445, 499), (0.095479, 0.071346, 0.499694, 0.333481)),
        (7.504117604, 14.751488041, -92.007380870),
        29_433,
    ),
    "mh42": (
        (0.037013398, (251, 308, 445, 499), (0.008306, 0.140272, 0.495978, 0.355444)),
        (7.542132400, 14.752549744, -92.007254092),
        33_193,
    ),
    "naca65410": (
        (0.035523921, (252, 308, 445, 499), (0.098258, 0.201201, 0.418211, 0.282330)),
        (7.540382848, 14.753915377, -92.009148232),
        4_519,
    ),
}
LEAST_SQUARES = {"goe404": (0.015419941, 0.050211485), "mh42": (0.015874253, 0.049169551), "naca65410": (0.015900222, 0.048809143)}
LENGTHS_MM = {"goe404": 207.005529761, "mh42": 202.316088242, "naca65410": 202.499165236}


def part(name: str, count: int = 500) -> Array:
    return scan(name, count, reference_form(name, count), 92, (15, -7))


@pytest.mark.parametrize("name", PRINTED)
def test_reference_values(name: str) -> None:
    (half, active, multipliers), place, boxes = PRINTED[name]
    points, nominal = part(name), nominal_of(name)
    found = certify_minimum_zone(points, nominal)
    assert nominal.length_mm == pytest.approx(LENGTHS_MM[name], abs=6e-10)
    assert found.zone_mm / 2 == pytest.approx(half, abs=6e-10)
    assert found.active.tolist() == list(active)
    np.testing.assert_allclose(found.multipliers, multipliers, rtol=0, atol=6e-7)
    pose = found.nominal_from_section
    np.testing.assert_allclose([*pose.translation_mm, np.degrees(pose.rotation_rad)], place, rtol=0, atol=6e-10)
    assert (found.proven, found.balanced, found.witnesses.tolist()) == (True, True, list(active))
    assert found.boxes <= boxes
    assert f"no rigid motion brings 4 of the measured points within {half - 1e-5:.9f} mm" in found.words
    np.testing.assert_allclose(np.abs(found.active_deviation_mm), found.zone_mm / 2, rtol=0, atol=1e-10)


@pytest.mark.parametrize("name", LEAST_SQUARES)
def test_reference_values_of_the_best_fit(name: str) -> None:
    from inspection import register

    rms, largest = LEAST_SQUARES[name]
    found = register(part(name), nominal_of(name))
    assert found.rms_mm == pytest.approx(rms, abs=6e-10)
    d = deviations(found.nominal_from_section.apply(part(name)), nominal_of(name))
    assert np.abs(d.deviation_mm).max() == pytest.approx(largest, abs=6e-10)


def test_no_placement_that_is_tried_contradicts_the_proof() -> None:
    """By the oracle's closest point alone: hundreds of motions, small and large, and none brings the witnesses within the bound."""
    points, nominal = part("goe404"), nominal_of("goe404")
    found, rng = certify_minimum_zone(points, nominal), np.random.default_rng(7)
    place = found.nominal_from_section.apply(found.witness_place_mm)
    scale = 10.0 ** rng.uniform(-6, 1.5, 400)
    motions = rng.normal(0, 1, (400, 3)) * np.column_stack([scale, scale, scale / 50])
    moved = np.vstack([rotation_about(place.mean(axis=0), turn, np.array([x, y])).apply(place) for x, y, turn in motions])
    largest = np.abs(closest_point(nominal.curve, moved).left_mm).reshape(400, -1).max(axis=1)
    assert (largest > found.zone_mm / 2 - found.gap_mm).all()
    assert largest.min() < 1.01 * found.zone_mm / 2  # the trials come near


def test_a_fit_that_began_at_the_wrong_placement_is_begun_again() -> None:
    """Head to tail, the fit stays where it is, with a zone of millimetres; the proof finds the placement that is right."""
    points, nominal = part("goe404")[::3], nominal_of("goe404")
    truth = certify_minimum_zone(points, nominal)
    centre = truth.nominal_from_section.apply(points).mean(axis=0)
    turned = rotation_about(centre, np.pi, np.zeros(2)).after(truth.nominal_from_section)
    stuck = fit_minimum_zone(points, nominal, turned)
    assert stuck.zone_mm > 10 * truth.zone_mm
    for start in (stuck, turned):
        found = certify_minimum_zone(points, nominal, start)
        assert found.proven
        assert found.zone_mm == pytest.approx(truth.zone_mm, abs=1e-11)
        assert found.active.tolist() == truth.active.tolist()


def test_a_search_that_may_not_go_on_proves_nothing_and_says_so() -> None:
    found = certify_minimum_zone(part("goe404"), nominal_of("goe404"), most_boxes=300)
    assert (found.proven, found.boxes <= 556) == (False, True)
    assert "no proof over every placement" in found.words
    with pytest.raises(ValueError, match="the gap of a proof must be above zero"):
        certify_minimum_zone(part("goe404"), nominal_of("goe404"), gap_mm=0.0)


def test_points_over_an_open_end_take_no_part_in_zone_or_proof() -> None:
    nominal = discretize(profiles.p1(), samples=1000)
    curve = nominal.curve
    u = profiles.even_in_arc_length(curve, 200)
    tangent = curve.derivatives(u[:1], 1)[1][0]
    behind = curve.point(u[:1]) - 2.0 * tangent / np.hypot(*tangent)
    inside = profiles.offset_points(curve, u, 0.02 * np.sin(np.arange(200) / 9))
    with_it, without = (
        certify_minimum_zone(points, nominal, RigidTransform.identity()) for points in (np.vstack([behind, inside]), inside)
    )
    assert with_it.proven
    assert with_it.zone_mm == pytest.approx(without.zone_mm, abs=1e-9)
    assert 0 not in with_it.witnesses
    assert with_it.active.tolist() == (without.active + 1).tolist()


def test_a_long_scan_is_proven_by_its_few_active_points() -> None:
    found = certify_minimum_zone(part("mh42", 9000), nominal_of("mh42"))
    assert found.proven
    assert len(found.witnesses) <= 8
    assert (found.zone_mm / 2) == pytest.approx(0.037, abs=5e-4)


def test_centres_of_a_ball_are_certified_about_a_middle() -> None:
    points = scan("mh42", 300, reference_form("mh42", 300) + 0.7 + 0.02, 30, (1, 2))
    found = certify_minimum_zone(points, nominal_of("mh42"), tip_radius_mm=0.7, middle_mm=0.02)
    assert (found.proven, found.balanced, found.middle_mm) == (True, True, 0.02)
    assert found.zone_mm / 2 == pytest.approx(0.037, abs=5e-4)
