"""The fit that consumes least tolerance: printed values of independent programs, proofs by hand, and its relation to the minimum zone."""

import numpy as np
import pytest
from numpy.typing import NDArray

from inspection import (
    Freedoms,
    NominalProfile,
    RigidTransform,
    VaryingZone,
    deviations,
    fit_least_consumption,
    fit_minimum_zone,
    register,
)
from inspection.rigid import rotation_about
from tests.inspection.profiles import Array
from tests.inspection.reference_parts import nominal_of, reference_form, scan

Rows = NDArray[np.int64]

# At the best fit, at the minimum zone, least; x and y in mm, rotation in degrees; active points. Then the same three with 0.9 of the form.
PRINTED = {
    "goe404": ((1.673716175, 1.339170750, 1.025950758), (7.509588695, 14.772286595, -92.016381553), [4, 140, 233, 499]),
    "mh42": ((1.638985036, 1.266392585, 1.046509439), (7.504245987, 14.771407815, -92.016454788), [4, 140, 234, 499]),
    "naca65410": ((1.626971441, 1.285771980, 1.041909106), (7.485959008, 14.767041907, -92.010457301), [4, 140, 234, 499]),
}
SMALLER = {"goe404": (1.5063, 1.2653, 0.9414), "mh42": (1.4751, 1.1998, 0.9757), "naca65410": (1.4643, 1.2172, 0.9617)}


def zone_of(nominal: NominalProfile) -> VaryingZone:
    """The reference zone: tight on one side of the back, wide on the belly."""
    shares = np.array([0, 0.04, 0.06, 0.44, 0.46, 0.54, 0.56, 0.94, 0.96, 1])
    lower = np.array([-0.03, -0.03, -0.02, -0.02, -0.03, -0.03, -0.06, -0.06, -0.03, -0.03])
    upper = np.array([0.03, 0.03, 0.08, 0.08, 0.03, 0.03, 0.06, 0.06, 0.03, 0.03])
    return VaryingZone(shares * nominal.length_mm, lower, upper, nominal.length_mm, True)


def consumed(points: Array, pose: RigidTransform, nominal: NominalProfile) -> Array:
    d = deviations(pose.apply(points), nominal)
    return zone_of(nominal).consumption(d.deviation_mm, d.station_mm)


def fits(name: str, share: float) -> tuple[list[float], Array, RigidTransform]:
    """Consumption at the best fit, at the minimum zone and at least, the points and the last pose."""
    nominal, points = nominal_of(name), scan(name, 500, share * reference_form(name, 500), 92, (15, -7))
    poses = [
        register(points, nominal).nominal_from_section,
        fit_minimum_zone(points, nominal).nominal_from_section,
        fit_least_consumption(points, nominal, zone_of(nominal)).nominal_from_section,
    ]
    return [float(np.abs(consumed(points, pose, nominal)).max()) for pose in poses], points, poses[-1]


@pytest.mark.parametrize("name", PRINTED)
def test_reference_values(name: str) -> None:
    values, place, active = PRINTED[name]
    found, points, pose = fits(name, 1.0)
    np.testing.assert_allclose(found, values, rtol=0, atol=6e-10)
    np.testing.assert_allclose([*pose.translation_mm, np.degrees(pose.rotation_rad)], place, rtol=0, atol=6e-10)
    fit = fit_least_consumption(points, nominal_of(name), zone_of(nominal_of(name)))
    assert sorted(fit.active.tolist()) == active
    assert (fit.converged, fit.programs <= 4) == (True, True)
    np.testing.assert_allclose(np.abs(consumed(points, pose, nominal_of(name)))[active], fit.consumption, atol=1e-9)
    assert_balance(points, fit.nominal_from_section, fit.active, fit.multipliers, nominal_of(name))


@pytest.mark.parametrize("name", SMALLER)
def test_parts_that_pass_by_this_fit_alone(name: str) -> None:
    np.testing.assert_allclose(fits(name, 0.9)[0], SMALLER[name], rtol=0, atol=6e-5)


def assert_balance(points: Array, pose: RigidTransform, active: Rows, multipliers: Array, nominal: NominalProfile) -> None:
    """The rates of the active points by every motion, found by differences, cancel when weighted by the multipliers."""
    place = pose.apply(points)
    centre, step = place.mean(axis=0), 1e-6
    sign = np.sign(consumed(points, pose, nominal)[active])
    assert multipliers.sum() == pytest.approx(1, abs=1e-9)
    for turn, shift in ((0.0, (1.0, 0.0)), (0.0, (0.0, 1.0)), (1 / 50, (0.0, 0.0))):
        ends = [rotation_about(centre, way * step * turn, way * step * np.array(shift)) for way in (-1, 1)]
        before, after = (consumed(place[active], end, nominal) for end in ends)
        assert abs((multipliers * sign * (after - before)).sum() / (2 * step)) < 2e-5  # single rates are about 30 a mm


def test_an_even_zone_is_the_minimum_zone() -> None:
    nominal, points = nominal_of("mh42"), scan("mh42", 500, reference_form("mh42", 500), 92, (15, -7))
    even = VaryingZone.constant(-0.04, 0.06, nominal.length_mm, True)
    fit, zone = fit_least_consumption(points, nominal, even), fit_minimum_zone(points, nominal, middle_mm=0.01)
    assert fit.consumption * 0.05 == pytest.approx(zone.zone_mm / 2, abs=1e-11)
    assert fit.active.tolist() == zone.active.tolist()


def test_few_of_many_points_give_the_consumption_of_all() -> None:
    nominal, points = nominal_of("goe404"), scan("goe404", 9000, reference_form("goe404", 9000), 92, (15, -7))
    fit = fit_least_consumption(points, nominal, zone_of(nominal))
    assert fit.converged
    assert np.abs(consumed(points, fit.nominal_from_section, nominal)).max() == pytest.approx(fit.consumption, abs=1e-12)
    assert fit.consumption == pytest.approx(1.025950758, abs=2e-3)  # the part of 500 points, and some on its peaks
    assert_balance(points, fit.nominal_from_section, fit.active, fit.multipliers, nominal)


@pytest.mark.parametrize("tip", [0.0, 0.4])
def test_locked_and_limited_freedoms_hold(tip: float) -> None:
    """Against a search by golden section over the one motion that is free."""
    nominal, points = nominal_of("goe404"), scan("goe404", 300, reference_form("goe404", 300) + tip, 0, (0, 0))
    start, pivot = RigidTransform.identity(), np.array([40.0, 3.0])

    def largest(turn: float) -> float:
        d = deviations(rotation_about(pivot, turn, np.zeros(2)).apply(points), nominal, tip_radius_mm=tip)
        return float(np.abs(zone_of(nominal).consumption(d.deviation_mm, d.station_mm)).max())

    locked = fit_least_consumption(
        points, nominal, zone_of(nominal), start, tip_radius_mm=tip, freedoms=Freedoms.about(pivot, ("rotation",))
    )
    turn = locked.nominal_from_section.rotation_rad
    assert locked.consumption == pytest.approx(largest(turn), abs=1e-12)
    assert all(largest(turn + away) > locked.consumption for away in (-1e-5, -1e-7, 1e-7, 1e-5))
    limited = Freedoms.about(pivot, ("rotation",), limits={"rotation": (-abs(turn) / 2, abs(turn) / 2)})
    half = fit_least_consumption(points, nominal, zone_of(nominal), start, tip_radius_mm=tip, freedoms=limited)
    assert half.nominal_from_section.rotation_rad == pytest.approx(turn / 2, abs=1e-12)
    zone = fit_minimum_zone(points, nominal, start, tip_radius_mm=tip, freedoms=Freedoms.about(pivot, ()))
    assert zone.nominal_from_section.rotation_rad == 0
    d = deviations(points, nominal, tip_radius_mm=tip)
    assert zone.zone_mm == pytest.approx(2 * np.abs(d.deviation_mm).max(), abs=1e-12)
    with pytest.raises(ValueError, match="needs the pose from which they count"):
        fit_least_consumption(points, nominal, zone_of(nominal), freedoms=limited)
