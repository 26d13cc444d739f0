"""The minimum zone: parts built so that the answer is known, certificates checked by hand, and no better pose nearby."""

import numpy as np
import pytest

from inspection import MinimumZone, NurbsCurve, RigidTransform, chebyshev, deviations, discretize, fit_minimum_zone, register
from tests.inspection import profiles
from tests.inspection.oracle import closest_point
from tests.inspection.profiles import Array, curve_of, nominal_of

NAMES = ("P1", "P2", "P3", "NACA 2412 sharp", "GOE404", "MH42")


def gradients(normal: Array, place: Array) -> Array:
    """Rates of signed distances (a, 3) by a shift in x, a shift in y and a rotation about the origin."""
    return np.column_stack([normal, normal[:, 1] * place[:, 0] - normal[:, 0] * place[:, 1]])


def with_form(name: str, count: int, seed: int) -> Array:
    """A scan with waves and noise, in place."""
    curve, rng = curve_of(name), np.random.default_rng(seed)
    u = profiles.even_in_arc_length(curve, count)
    s = 2 * np.pi * curve.station_mm(u) / curve.length_mm
    form = 0.02 * np.sin(3 * s + 1) + 0.01 * np.cos(7 * s) + rng.normal(0, 0.004, count)
    return profiles.offset_points(curve, u, form)


def built(name: str, zone_mm: float, rng: np.random.Generator) -> tuple[Array, Array, Array]:
    """A scan whose minimum zone is known by construction: points in place, the four that hold the zone, their multipliers.

    Four points whose gradients have a null vector with no small component: given deviations of that vector's signs and half
    the zone, no small motion lowers all four at once (Kuhn and Tucker), and all other points stay well inside.
    """
    curve = curve_of(name)
    u = profiles.even_in_arc_length(curve, 400)
    normal = profiles.left_normal(curve, u)
    g = gradients(normal, curve.point(u)) / (1.0, 1.0, 30.0)
    while True:
        held = np.sort(rng.choice(np.arange(10, 390), 4, replace=False))
        null = np.linalg.svd(g[held].T)[2][3]
        weight = np.abs(null) / np.abs(null).sum()
        # clearly determined: no multiplier near zero, and the active gradients span the three motions
        if weight.min() > 0.08 and np.linalg.svd(g[held].T)[1][2] > 0.2:
            break
    offset = rng.uniform(-0.3, 0.3, 400) * zone_mm
    offset[held] = np.sign(null) * zone_mm / 2
    return profiles.offset_points(curve, u, offset), held, weight


@pytest.mark.parametrize("name", NAMES)
def test_a_zone_known_by_construction_is_found(name: str) -> None:
    rng = np.random.default_rng(1)
    for trial, (rotation, shift) in enumerate([(0.0, (0.0, 0.0)), (0.05, (0.02, -0.03)), (140.0, (30.0, 10.0))]):
        truth, held, weight = built(name, 0.08, rng)
        points = profiles.rotated(truth, rotation, shift)
        found = fit_minimum_zone(points, nominal_of(name))
        assert found.converged, trial
        assert found.zone_mm == pytest.approx(0.08, abs=1e-9), trial
        assert np.linalg.norm(found.nominal_from_section.apply(points) - truth, axis=1).max() < 1e-7, trial
        assert sorted(found.active.tolist()) == held.tolist(), trial
        assert np.abs(found.multipliers[np.argsort(found.active)] - weight).max() < 1e-5, trial


def assert_certificate(found: MinimumZone, curve: NurbsCurve, points: Array) -> None:
    """Equal and largest deviations at the active points, whose weighted gradients balance: by the oracle alone."""
    place = found.nominal_from_section.apply(points)
    closest = closest_point(curve, place)
    inside = ~closest.beyond_end
    assert 2 * np.abs(closest.left_mm[inside]).max() == pytest.approx(found.zone_mm, abs=1e-10)
    assert 2 <= len(found.active) <= 4
    assert inside[found.active].all()
    assert np.abs(2 * np.abs(closest.left_mm[found.active]) - found.zone_mm).max() < 1e-9
    assert (found.multipliers > 0).all()
    assert found.multipliers.sum() == pytest.approx(1.0, abs=1e-12)
    away = (place - closest.foot_mm)[found.active]
    unit = away / np.linalg.norm(away, axis=1)[:, None]  # |deviation| grows along it
    balance = (found.multipliers[:, None] * gradients(unit, place[found.active] - place.mean(axis=0))).sum(axis=0)
    assert np.abs(balance / (1.0, 1.0, 50.0)).max() < 1e-7


@pytest.mark.parametrize("name", NAMES)
def test_active_points_and_multipliers_certify_the_zone(name: str) -> None:
    truth = with_form(name, 500, 2)
    points = profiles.rotated(truth, 250.0, (-15.0, 40.0))
    best_fit = register(points, nominal_of(name))
    found = fit_minimum_zone(points, nominal_of(name), best_fit)
    assert found.converged
    assert_certificate(found, curve_of(name), points)
    least_squares_zone = 2 * np.abs(deviations(best_fit.nominal_from_section.apply(points), nominal_of(name)).deviation_mm).max()
    assert found.zone_mm < 0.99 * least_squares_zone


@pytest.mark.parametrize("name", ["P2", "P3", "MH42"])
def test_no_nearby_pose_has_a_smaller_zone(name: str) -> None:
    points = with_form(name, 300, 3)
    found = fit_minimum_zone(points, nominal_of(name))
    place = found.nominal_from_section.apply(points)
    # a motion is beaten already when it is on the points that are nearly active
    near = np.abs(closest_point(curve_of(name), place).left_mm) > 0.35 * found.zone_mm
    centre, rng = place.mean(axis=0), np.random.default_rng(4)
    steps = rng.normal(0, 1, (1500, 3)) * (1.0, 1.0, 1 / 50) * 10.0 ** -rng.uniform(1.5, 6, (1500, 1))
    moved = np.vstack([profiles.rotated(place[near] - centre, np.rad2deg(p[2])) + centre + p[:2] for p in steps])
    inside = deviations(moved, nominal_of(name))
    size = np.where(inside.beyond_end, 0.0, np.abs(inside.deviation_mm)).reshape(1500, -1).max(axis=1)
    assert (2 * size >= found.zone_mm - 1e-11).all()


@pytest.mark.parametrize("lobes", [2, 3, 5, 8])
def test_a_lobed_circle_has_twice_its_amplitude(lobes: int) -> None:
    # a cos(k t) reaches +a and -a alternately at 2k places around: the shift that lowers one raises another
    angle = 2 * np.pi * np.arange(240) / 240
    radius = 25.0 + 0.03 * np.cos(lobes * angle)
    points = radius[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    nominal = discretize(profiles.circle(25.0), samples=1000)
    found = fit_minimum_zone(points + np.array([0.02, -0.01]), nominal, RigidTransform.identity())
    assert found.zone_mm == pytest.approx(0.06, abs=1e-10)
    assert np.abs(found.nominal_from_section.apply([[0.02, -0.01]])).max() < 1e-6


def test_a_middle_off_zero_is_the_middle_of_the_zone() -> None:
    # all material 0.05 too much: about zero the zone is wide, about its own middle it is the form error alone
    angle = 2 * np.pi * np.arange(240) / 240
    points = (25.05 + 0.03 * np.cos(3 * angle))[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    nominal = discretize(profiles.circle(25.0), samples=1000)
    about_zero = fit_minimum_zone(points, nominal, RigidTransform.identity())
    about_middle = fit_minimum_zone(points, nominal, RigidTransform.identity(), middle_mm=0.05)
    assert about_zero.zone_mm == pytest.approx(0.16, abs=1e-10)
    assert about_middle.zone_mm == pytest.approx(0.06, abs=1e-10)
    assert about_middle.middle_mm == 0.05


def test_the_side_of_the_material_does_not_matter_to_the_width() -> None:
    points = with_form("P3", 300, 5)
    right = discretize(curve_of("P3"), samples=2000, step_min=5e-4, material="right")
    assert fit_minimum_zone(points, right).zone_mm == pytest.approx(fit_minimum_zone(points, nominal_of("P3")).zone_mm, abs=1e-10)


def test_ball_centres_are_fitted_by_the_surface_they_touched() -> None:
    curve, tip = curve_of("P3"), 1.0
    u = profiles.even_in_arc_length(curve, 300)
    form = 0.02 * np.sin(6 * np.pi * u) + 0.01 * np.cos(10 * np.pi * u)
    surface, centres = profiles.offset_points(curve, u, form), profiles.offset_points(curve, u, form - tip)
    plain = fit_minimum_zone(surface, nominal_of("P3"))
    ball = fit_minimum_zone(centres, nominal_of("P3"), tip_radius_mm=tip)
    # at the true pose the two zones are one and the same; moving the part couples to the tip radius only at second order
    assert ball.converged
    assert ball.zone_mm == pytest.approx(plain.zone_mm, rel=2e-3)


def test_no_worse_than_the_start_even_from_far_off() -> None:
    points = with_form("P2", 300, 6)
    best = fit_minimum_zone(points, nominal_of("P2")).zone_mm
    start = RigidTransform(0.01, np.array([0.5, -0.3]))
    found = fit_minimum_zone(points, nominal_of("P2"), start)
    assert found.zone_mm == pytest.approx(best, abs=1e-9)


def test_points_without_form_error_have_no_zone() -> None:
    points = profiles.rotated(curve_of("P3").point(profiles.even_in_arc_length(curve_of("P3"), 200)), 33.0, (5.0, 5.0))
    assert fit_minimum_zone(points, nominal_of("P3")).zone_mm < 1e-9


@pytest.mark.parametrize("name", ["P1", "GOE404"])
def test_few_of_many_points_give_the_zone_of_all(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    points = profiles.rotated(with_form(name, 6000, 4), 30.0, (5.0, -2.0))
    few = fit_minimum_zone(points, nominal_of(name))
    monkeypatch.setattr(chebyshev, "MANY", 10_000)
    every = fit_minimum_zone(points, nominal_of(name))
    assert few.converged
    assert few.zone_mm == pytest.approx(every.zone_mm, abs=1e-11)
    assert sorted(few.active.tolist()) == sorted(every.active.tolist())
    np.testing.assert_allclose(few.multipliers.sum(), 1.0)
