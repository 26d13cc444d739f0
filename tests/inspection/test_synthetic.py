"""Synthetic scans: what they claim about themselves, held against the independent closest point."""

import numpy as np
import pytest

from inspection import Material, RigidTransform, discretize
from inspection.synthetic import even_stations, form_error_mm, scan, stations_even_in_parameter
from tests.inspection import profiles
from tests.inspection.oracle import closest_point

POSE = RigidTransform(0.8, np.array([12.0, -5.0]))


@pytest.mark.parametrize("material", ["left", "right"])
@pytest.mark.parametrize("name", ["P1", "P3", "NACA 2412 sharp"])
def test_claimed_stations_deviations_and_pose_are_true(name: str, material: Material) -> None:
    curve = profiles.EVERY[name]()
    nominal = discretize(curve, samples=1000, step_min=1e-3, material=material)
    station = even_stations(nominal, 300)[5:-5]
    deviation = form_error_mm(station, nominal.length_mm, np.random.default_rng(1), 0.03)
    made = scan(nominal, station, deviation, POSE)
    place = profiles.rotated(made.points_mm, np.rad2deg(0.8), (12.0, -5.0))
    truth = closest_point(curve, place)
    outward = -1.0 if material == "left" else 1.0
    assert np.abs(outward * truth.left_mm - made.deviation_mm).max() < 1e-11
    assert np.array_equal(made.deviation_mm, deviation)
    assert np.abs(curve.station_mm(truth.parameter) - made.station_mm).max() < 1e-8
    assert np.abs(made.nominal_from_section.apply(made.points_mm) - place).max() < 1e-12


def test_ball_centres_lie_a_radius_farther_out() -> None:
    curve = profiles.ellipse(50.0, 20.0)
    nominal = discretize(curve, samples=1000, step_min=1e-3)
    station = even_stations(nominal, 100)
    made = scan(nominal, station, np.full(100, 0.02), RigidTransform.identity(), tip_radius_mm=1.5)
    assert np.abs(-closest_point(curve, made.points_mm).left_mm - 1.52).max() < 1e-11


def test_stations_are_even_where_they_say() -> None:
    nominal = discretize(profiles.p2(), samples=1000, step_min=1e-3)
    step = np.diff(even_stations(nominal, 50))
    assert np.abs(step - step.mean()).max() < 1e-9
    part = even_stations(nominal, 40, start=0.25, coverage=0.5)
    assert part.min() >= 0.25 * nominal.length_mm - 1e-9
    assert part.max() <= 0.75 * nominal.length_mm + 1e-9
    assert part.max() - part.min() > 0.47 * nominal.length_mm
    u = np.interp(stations_even_in_parameter(nominal, 50), nominal.curve.station_mm(np.linspace(0, 1, 20_001)), np.linspace(0, 1, 20_001))
    assert np.abs(np.diff(u, 2)).max() < 1e-6


def test_form_error_has_the_amplitude_it_was_given() -> None:
    station = np.linspace(0, 100, 5000, endpoint=False)
    form = form_error_mm(station, 100.0, np.random.default_rng(2), 0.03, (2, 3, 5))
    spectrum = np.abs(np.fft.rfft(form)) / 2500
    assert np.sqrt((spectrum**2).sum()) == pytest.approx(0.03, rel=1e-9)
    assert set(np.flatnonzero(spectrum > 1e-6).tolist()) == {2, 3, 5}
    again = form_error_mm(station, 100.0, np.random.default_rng(2), 0.03, (2, 3, 5))
    assert np.array_equal(form, again)
