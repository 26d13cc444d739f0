"""Poles against shapes whose medial axis is known in closed form."""

from itertools import pairwise

import numpy as np
import pytest

from inspection.voronoi import site_poles
from tests.inspection import profiles
from tests.inspection.profiles import Array


def closed_neighbours(n: int) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    return (np.arange(n) + 1) % n


def circle_sites(n: int, radius: float, centre: tuple[float, float] = (0.0, 0.0)) -> tuple[Array, Array]:
    angle = 2 * np.pi * np.arange(n) / n
    out = np.column_stack([np.cos(angle), np.sin(angle)])
    return radius * out + centre, -out


@pytest.mark.parametrize("n", [12, 101, 2000])
@pytest.mark.parametrize("radius", [0.3, 37.5, 900.0])
def test_every_inner_pole_of_a_circle_is_its_centre(n: int, radius: float) -> None:
    sites, normal = circle_sites(n, radius, (5.0, -3.0))
    poles = site_poles(sites, normal, closed_neighbours(n), *np.zeros((2, n), dtype=bool))
    centre = sites + poles.left / poles.left_curvature[:, None]
    assert np.abs(centre - (5.0, -3.0)).max() < 1e-9 * radius
    assert np.abs(poles.left_curvature * radius - 1).max() < 1e-9
    assert np.abs(poles.left - normal).max() < 1e-9
    # no medial axis outside: the pole there lies farther off than the part is wide, out in its box
    assert (poles.right_curvature * 2 * radius < 1).all()
    assert (poles.right_curvature >= 0).all()


def test_poles_swap_sides_with_the_direction_of_travel() -> None:
    sites, normal = circle_sites(64, 10.0)
    poles = site_poles(sites[::-1].copy(), -normal[::-1], closed_neighbours(64), *np.zeros((2, 64), dtype=bool))
    assert np.abs(poles.right_curvature * 10 - 1).max() < 1e-9
    assert np.abs(poles.right - normal[::-1]).max() < 1e-9
    assert (poles.left_curvature * 20 < 1).all()


def test_shared_edge_starts_at_the_centre_of_a_circle() -> None:
    n = 48
    sites, normal = circle_sites(n, 10.0)
    poles = site_poles(sites, normal, closed_neighbours(n), *np.zeros((2, n), dtype=bool))
    assert np.abs(poles.edge_left_mm).max() < 1e-8
    # its other end is as far from both sites of the edge, and outside
    following = np.roll(sites, -1, axis=0)
    here, there = np.linalg.norm(poles.edge_right_mm - sites, axis=1), np.linalg.norm(poles.edge_right_mm - following, axis=1)
    assert np.abs(here / there - 1).max() < 1e-9
    assert (np.linalg.norm(poles.edge_right_mm, axis=1) > 10).all()


def ellipse_poles(n: int, a: float = 50.0, b: float = 20.0) -> tuple[Array, Array, Array]:
    """Inner poles of an ellipse sampled evenly in its angle, the true centres of its medial balls, and pole angles."""
    angle = 2 * np.pi * (np.arange(n) + 0.3) / n
    sites = np.column_stack([a * np.cos(angle), b * np.sin(angle)])
    normal = -np.column_stack([b * np.cos(angle), a * np.sin(angle)])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    poles = site_poles(sites, normal, closed_neighbours(n), *np.zeros((2, n), dtype=bool))
    truth = np.column_stack([(a * a - b * b) / a * np.cos(angle), np.zeros(n)])
    return sites + poles.left / poles.left_curvature[:, None], truth, poles.angle_deg


def test_inner_poles_of_an_ellipse_tend_to_its_medial_axis() -> None:
    # The ball touching at (a cos t, b sin t) is centred at ((a^2 - b^2)/a cos t, 0): a segment that ends at the centres
    # of curvature of the two vertices. Towards those ends two touching points merge, so convergence is slower there.
    errors = []
    for n in (500, 2000, 8000):
        pole, truth, _ = ellipse_poles(n)
        away = np.abs(truth[:, 0]) < 0.95 * 42.0
        errors.append(np.linalg.norm(pole - truth, axis=1)[away].max())
        assert np.abs(pole[:, 0]).max() < 42.0 + 50 * np.pi / n
        assert np.abs(pole[:, 1]).max() < 50 * 2 * np.pi / n
    assert errors[0] / errors[1] > 3
    assert errors[1] / errors[2] > 3
    assert errors[2] < 0.05


def test_pole_angles_tend_to_180_degrees_as_fast_as_the_samples_close_up() -> None:
    worst = [180 - ellipse_poles(n)[2].min() for n in (500, 1000, 2000, 4000)]
    assert all(1.7 < p / q < 2.4 for p, q in pairwise(worst))
    assert worst[-1] < 0.3


def test_straight_parts_of_a_stadium_have_their_poles_on_the_middle_line() -> None:
    nominal_radius, half = 12.0, 30.0
    curve = profiles.stadium(half, nominal_radius)
    u = profiles.even_in_arc_length(curve, 1200)
    sites = curve.point(u)
    straight, normal = np.abs(sites[:, 0]) < half - 1.0, profiles.left_normal(curve, u)
    poles = site_poles(sites, normal, closed_neighbours(1200), np.zeros(1200, dtype=bool), straight)
    centre = sites + poles.left / poles.left_curvature[:, None]
    assert straight.sum() > 500
    assert np.abs(centre[straight, 1]).max() < 0.17  # one sample step
    assert np.abs(poles.left_curvature[straight] * nominal_radius - 1).max() < 0.015
    round_part = np.abs(sites[:, 0]) > half + 0.5
    ends = np.sign(centre[round_part, 0])[:, None] * (half, 0.0)
    assert np.abs(centre[round_part] - ends).max() < 1e-6
    # outside there is no medial axis: at infinity beyond straight parts, out in the published box beyond round ones
    assert (poles.right_curvature[straight] == 0).all()
    assert np.array_equal(poles.right[straight], -normal[straight])
    size = np.hypot(2 * (half + nominal_radius), 2 * nominal_radius)
    assert (poles.right_curvature[round_part] * size < 1 / 4).all()
    assert (poles.right_curvature[round_part] > 0).all()


def test_coinciding_sites_share_a_cell_and_ends_keep_their_normals() -> None:
    # an open half circle whose first and last site stand at one place with a third: nothing may become NaN
    angle = np.linspace(0, np.pi, 40)
    arc = 10 * np.column_stack([np.cos(angle), np.sin(angle)])
    normal = -arc / 10
    back = np.column_stack([np.linspace(-10, 10, 40), np.zeros(40)])
    sites = np.vstack([arc, back])
    normals = np.vstack([normal, np.tile((0.0, 1.0), (40, 1))])
    following = np.arange(80) + 1
    following[[39, 79]] = -1
    is_end = np.zeros(80, dtype=bool)
    is_end[[0, 39, 40, 79]] = True
    poles = site_poles(sites, normals, following, is_end, np.zeros(80, dtype=bool))
    for name in ("left", "right", "left_curvature", "right_curvature", "angle_deg"):
        assert np.isfinite(getattr(poles, name)).all(), name
    assert np.array_equal(poles.left[is_end], normals[is_end])
    assert np.array_equal(poles.right[is_end], -normals[is_end])
    assert np.isnan(poles.edge_left_mm[[39, 79]]).all()


def test_moving_and_turning_the_sites_moves_and_turns_the_poles() -> None:
    curve = profiles.p3()
    u = np.linspace(0, 1, 400, endpoint=False)
    sites, normal = curve.point(u), profiles.left_normal(curve, u)
    ends = np.zeros(400, dtype=bool)
    here = site_poles(sites, normal, closed_neighbours(400), ends, ends)
    there = site_poles(profiles.rotated(sites, 37.0, (800.0, -300.0)), profiles.rotated(normal, 37.0), closed_neighbours(400), ends, ends)
    assert np.abs(there.left - profiles.rotated(here.left, 37.0)).max() < 1e-7
    assert np.abs(there.left_curvature - here.left_curvature).max() < 1e-8
