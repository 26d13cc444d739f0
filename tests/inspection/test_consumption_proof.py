"""Proofs of the least consumption over every placement: printed values of independent programs, and parts that try them."""

import numpy as np
import pytest

from inspection import NominalProfile, RigidTransform, VaryingZone, certify_consumption, deviations, discretize, fit_least_consumption
from inspection.rigid import rotation_about
from tests.inspection import profiles
from tests.inspection.profiles import Array
from tests.inspection.reference_parts import nominal_of, reference_form, scan
from tests.inspection.test_consumption import PRINTED, SMALLER, consumed, zone_of


def part(name: str, share: float = 1.0) -> Array:
    return scan(name, 500, share * reference_form(name, 500), 92, (15, -7))


@pytest.mark.parametrize("name", PRINTED)
def test_no_motion_reaches_the_least_value_less_two_thousandths(name: str) -> None:
    found = certify_consumption(part(name), nominal_of(name), zone_of(nominal_of(name)))
    assert found.proven
    assert found.fit.consumption == pytest.approx(PRINTED[name][0][2], abs=6e-10)
    assert found.bound == pytest.approx(PRINTED[name][0][2] - 0.002, abs=6e-10)
    assert found.witnesses.tolist() == PRINTED[name][2]
    assert found.boxes < 12_000
    assert f"no rigid motion brings 4 of the measured points into {found.bound:.9f} of the zone" in found.words


@pytest.mark.parametrize("name", PRINTED)
def test_a_whole_zone_is_proven_to_be_too_small_or_is_kept(name: str) -> None:
    """As a verdict asks: the reference parts consume more than all of the zone, those of 0.9 of their form less."""
    zone = zone_of(nominal_of(name))
    assert certify_consumption(part(name), nominal_of(name), zone, bound=1.0).proven
    kept = certify_consumption(part(name, 0.9), nominal_of(name), zone, bound=1.0)
    assert not kept.proven
    assert kept.fit.consumption == pytest.approx(SMALLER[name][2], abs=6e-5)


def test_no_placement_that_is_tried_contradicts_the_proof() -> None:
    points, nominal = part("mh42"), nominal_of("mh42")
    found, rng = certify_consumption(points, nominal, zone_of(nominal)), np.random.default_rng(5)
    place = found.fit.nominal_from_section.apply(found.witness_place_mm)
    scale = 10.0 ** rng.uniform(-6, 1.5, 2000)
    motions = rng.normal(0, 1, (2000, 3)) * np.column_stack([scale, scale, scale / 50])
    moved = np.vstack([rotation_about(place.mean(axis=0), turn, np.array([x, y])).apply(place) for x, y, turn in motions])
    largest = np.abs(consumed(moved, RigidTransform.identity(), nominal)).reshape(2000, -1).max(axis=1)
    assert largest.min() > found.bound
    assert largest.min() < 1.01 * found.fit.consumption  # the trials come near


def test_a_wide_stretch_that_a_pose_can_turn_to_is_found_and_not_refuted() -> None:
    """A disc with one wide sector: limits that were frozen at the points' stations would refute the part at every other angle."""
    nominal = discretize(profiles.circle(20.0), samples=500)
    length = nominal.length_mm
    s = np.array([0.0, 0.4, 0.45, 0.55, 0.6]) * length
    wide = np.array([0.02, 0.02, 0.3, 0.3, 0.02])
    zone = VaryingZone(s, -wide, wide, length, True)
    angle = np.arange(200) / 200 * 2 * np.pi
    bump = 0.25 * np.exp(-((np.angle(np.exp(1j * (angle - 1.0))) / 0.1) ** 2))  # at 57 degrees, the wide sector at 180
    points = (20 + bump)[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    here = fit_least_consumption(points, nominal, zone, RigidTransform.identity())
    assert here.consumption > 3
    found = certify_consumption(points, nominal, zone, here, bound=1.0)
    assert not found.proven
    assert found.fit.consumption < 1
    assert np.degrees(found.fit.nominal_from_section.rotation_rad) % 360 == pytest.approx(180 - 57.3, abs=25)
    dented = np.where(np.arange(200) == 120, -0.25, bump)
    assert certify_consumption((20 + dented)[:, None] * (points / np.hypot(*points.T)[:, None]), nominal, zone, here, bound=1.0).proven


@pytest.mark.parametrize("seed", range(6))
def test_a_part_inside_its_zone_is_never_refuted(seed: int) -> None:
    """Form just inside a zone with steps and transitions, in any place: the truth is a placement that passes."""
    rng = np.random.default_rng(seed)
    name = str(rng.choice(["goe404", "mh42", "naca65410"]))
    nominal, count = nominal_of(name), 160
    zone = random_zone(nominal, rng)
    s = (np.arange(count) + 0.5) / count * nominal.length_mm
    limits = zone.limits(s)
    share = rng.uniform(-0.999, 0.999, count)
    form = (limits.lower_mm + limits.upper_mm) / 2 + share * (limits.upper_mm - limits.lower_mm) / 2
    points = scan(name, count, form, rng.uniform(-180, 180), tuple(rng.uniform(-50, 50, 2)))
    found = certify_consumption(points, nominal, zone, bound=1.0, most_boxes=20_000)
    assert not found.proven


def random_zone(nominal: NominalProfile, rng: np.random.Generator) -> VaryingZone:
    s = np.sort(rng.uniform(0, nominal.length_mm, 8))
    s[3] = s[4]
    between = rng.choice(np.array(["linear", "smooth", "constant"]))
    return VaryingZone(s, -rng.uniform(0.02, 0.1, 8), rng.uniform(0.02, 0.1, 8), nominal.length_mm, True, between.item())


def test_an_even_zone_is_proven_as_the_minimum_zone_is() -> None:
    from inspection import certify_minimum_zone

    points, nominal = part("mh42"), nominal_of("mh42")
    even = VaryingZone.constant(-0.04, 0.06, nominal.length_mm, True)
    zone = certify_minimum_zone(points, nominal, middle_mm=0.01)
    for bound, proven in ((zone.zone_mm / 0.1 - 1e-3, True), (zone.zone_mm / 0.1 + 1e-6, False)):
        assert certify_consumption(points, nominal, even, bound=bound).proven is proven


def test_an_open_profile_and_a_ball_are_proven_too() -> None:
    nominal = discretize(profiles.p1(), samples=1000)
    length, tip = nominal.length_mm, 0.5
    zone = VaryingZone(np.array([0.0, length]), np.array([-0.02, -0.06]), np.array([0.02, 0.06]), length, False)
    u = profiles.even_in_arc_length(nominal.curve, 150)[2:-2]
    form = np.where(np.arange(146) % 2 == 0, 1.0, -1.0) * 0.03
    centres = nominal.curve.point(u) + (tip + form)[:, None] * nominal.outward * profiles.left_normal(nominal.curve, u)
    found = certify_consumption(centres, nominal, zone, RigidTransform.identity(), tip, bound=1.0)
    assert found.proven
    d = deviations(found.fit.nominal_from_section.apply(centres), nominal, tip_radius_mm=tip)
    assert np.abs(zone.consumption(d.deviation_mm, d.station_mm)).max() == pytest.approx(found.fit.consumption, abs=1e-9)


def test_a_search_that_may_not_go_on_proves_nothing_and_says_so() -> None:
    found = certify_consumption(part("goe404"), nominal_of("goe404"), zone_of(nominal_of("goe404")), most_boxes=300)
    assert not found.proven
    assert "no proof over every placement" in found.words
    with pytest.raises(ValueError, match="must be above zero"):
        certify_consumption(part("goe404"), nominal_of("goe404"), zone_of(nominal_of("goe404")), gap=0.0)
