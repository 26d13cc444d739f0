"""Point inversion against the independent closest point, and the nearest sample that it starts from."""

import numpy as np
import pytest

from inspection.inversion import choose_feet, invert_points, nearest_sites
from inspection.kernels.layout import CORNER, OPEN_END
from tests.inspection import profiles
from tests.inspection.oracle import closest_point
from tests.inspection.profiles import curve_of, nominal_of


@pytest.mark.parametrize("name", ["P1", "P2", "P3", "ellipse"])
def test_inversion_is_exact_on_smooth_profiles(name: str) -> None:
    curve, rng = curve_of(name), np.random.default_rng(18)
    points = profiles.offset_points(curve, profiles.inner_parameters(curve, 2000, rng, 2e-3), rng.uniform(-0.5, 0.5, 2000))
    feet, truth = invert_points(points, nominal_of(name)), closest_point(curve, points)
    assert np.abs(feet.distance_mm - truth.left_mm).max() < 1e-11
    assert np.abs(feet.foot_mm - truth.foot_mm).max() < 1e-10
    assert np.abs(feet.curvature - curve.curvature(feet.parameter)).max() < 1e-12
    assert np.abs(feet.station_mm - curve.station_mm(feet.parameter)).max() < 1e-10


def test_the_nearest_site_is_the_nearest_sample_and_at_corners_that_of_a_piece_the_point_faces() -> None:
    nominal, rng = nominal_of("square", 400), np.random.default_rng(19)
    points = rng.uniform(-30, 30, (2000, 2))
    site, faces_none = nearest_sites(points, nominal)
    distance = np.linalg.norm(points[:, None] - nominal.points_mm[None], axis=2)
    assert np.abs(distance[np.arange(2000), site] - distance.min(axis=1)).max() < 1e-12
    # outside a corner of the square a point faces neither side; elsewhere it faces that of its sample
    cone = (np.abs(points) > 20.0).all(axis=1)
    assert np.array_equal(faces_none, cone)
    ahead = ((points - nominal.points_mm[site]) * nominal.tangent[site]).sum(axis=1)
    assert (ahead[~cone & (nominal.previous_site[site] < 0)] >= 0).all()
    assert (ahead[~cone & (nominal.next_site[site] < 0)] <= 0).all()
    feet = invert_points(points, nominal)
    assert np.array_equal(feet.vertex == CORNER, cone)


def test_points_past_an_open_end_have_the_end_for_their_foot() -> None:
    nominal = nominal_of("P1")
    past = np.array([nominal.points_mm[0] - 2.0 * nominal.tangent[0], nominal.points_mm[-1] + 3.0 * nominal.tangent[-1]])
    feet = invert_points(past, nominal)
    assert feet.vertex.tolist() == [OPEN_END, OPEN_END]
    assert np.abs(np.abs(feet.distance_mm) - (2.0, 3.0)).max() < 1e-12
    assert np.array_equal(feet.foot_mm, nominal.points_mm[[0, -1]])


def test_points_that_are_not_finite_give_nan_and_disturb_no_other() -> None:
    nominal = nominal_of("P3")
    good = profiles.offset_points(curve_of("P3"), np.linspace(0.1, 0.9, 7), 0.1)
    feet = invert_points(np.vstack([good[:3], [(np.nan, 1.0), (np.inf, 0.0)], good[3:]]), nominal)
    alone = invert_points(good, nominal)
    for field in feet._fields:
        both = getattr(feet, field)
        assert np.array_equal(np.delete(both, [3, 4], axis=0), getattr(alone, field)), field
        assert field == "vertex" or np.isnan(both[3:5]).all(), field


def test_feet_are_chosen_row_by_row() -> None:
    nominal = nominal_of("P3")
    a, b = (invert_points(nominal.points_mm[:4] + shift, nominal) for shift in (0.01, 0.02))
    chosen = np.array([True, False, False, True])
    mixed = choose_feet(chosen, a, b)
    for field in a._fields:
        for row, first in enumerate(chosen):
            assert np.array_equal(getattr(mixed, field)[row], getattr(a if first else b, field)[row]), field
