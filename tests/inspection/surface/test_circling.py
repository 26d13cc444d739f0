"""Fits that go round in circles: told from those that go somewhere, and what they settle within counts against the verdict."""

import numpy as np
import pytest
from numpy.typing import ArrayLike
from scipy.optimize import minimize

from inspection import ToleranceZone, Verdict
from inspection.surface import RigidMotion, SurfaceResult, SurfaceTerms, TriangleSurface, judge_surface, register_surface, surface_fit
from inspection.surface.circling import PoseOnTheWay, best_of, find_circle, width_mm
from tests.inspection.surface import meshes
from tests.inspection.surface.surface_scans import MOTION, Array, kinds, scan

AT, RADIUS = np.array([5.0, 0.0, 0.0]), 30.0
AROUND = np.linspace(0, 2 * np.pi, 12, endpoint=False)
COARSE = TriangleSurface(meshes.prism(np.column_stack([30 * np.cos(AROUND), 8 * np.sin(AROUND) * (1 + 0.6 * np.cos(AROUND))]), 10.0))
POINTS = MOTION.inverse().apply(scan(COARSE, 600, seed=5, noise_mm=0.002)[2])
AIM_MM, U_MM = -0.05, 0.002  # the middle of every zone here, so that all have the same fit


def way(shifts_mm: ArrayLike, squares: ArrayLike) -> list[PoseOnTheWay]:
    """Steps that shift the points along x to these places (n,), with these mean squares (n,)."""
    return [
        PoseOnTheWay(RigidMotion.about(AT, (0, 0, 0.1), (x, 0, 0)), float(square))
        for x, square in zip(np.asarray(shifts_mm), np.asarray(squares), strict=True)
    ]


def test_a_circle_is_told_from_steps_that_go_somewhere_become_shorter_or_still_gain() -> None:
    n = np.arange(40)
    circle = find_circle(way(1e-4 * np.cos(2.4 * n), 1 + np.cos(2.4 * n) ** 2), AT, RADIUS)
    assert width_mm(circle, np.zeros((1, 3))) == pytest.approx(2e-4, rel=0.02)
    assert best_of(circle) is min(circle, key=lambda one: one.mean_square).motion
    level = np.ones(len(n))
    assert find_circle(way(1e-4 * np.cos(2.4 * n), 1 + np.cos(2.4 * n) ** 2)[:23], AT, RADIUS) == ()  # too few steps
    assert find_circle(way(1e-5 * n, level), AT, RADIUS) == ()
    assert find_circle(way(3e-6 * n + 1e-4 * (-1.0) ** n, level), AT, RADIUS) != ()  # from side to side by more than it goes on
    assert find_circle(way(3e-6 * n + 1e-4 * (-1.0) ** n, 1 - 1e-3 * n), AT, RADIUS) == ()  # unless each is better than those before
    assert find_circle(way(0.9**n * (-1.0) ** n, level), AT, RADIUS) == ()


def judged(upper_mm: float, u_mm: float = U_MM, at: RigidMotion | None = None) -> SurfaceResult:
    """The part judged by a zone about the same middle; at a known pose if there is one."""
    zone = ToleranceZone(2 * AIM_MM - upper_mm, upper_mm, u_mm)
    start, fit = (RigidMotion.identity(), "best-fit") if at is None else (at, "none")
    return judge_surface(POINTS, COARSE, SurfaceTerms(zone, fit, start, gap_max_mm=12.0))  # type: ignore[arg-type]  # one of two names


def test_the_least_squares_lie_within_what_a_fit_in_circles_settles_within() -> None:
    """They are sought without derivatives, which kinks do not trouble; the points weigh the same, as each has a cell of its own."""
    found = register_surface(POINTS, COARSE, RigidMotion.identity(), target_mm=AIM_MM)
    assert not found.converged
    within = found.settles_within_mm
    assert 1e-6 < within < 1e-3
    weights = surface_fit._weights(POINTS, 0.01 * COARSE.size_mm)

    def moved(six: Array) -> Array:
        return RigidMotion.about(found.centre_mm, six[3:] / 30.0, six[:3]).after(found.nominal_from_scan).apply(POINTS)

    def squares(six: Array) -> float:
        return float((weights * (COARSE.project(moved(six)).distance_mm - AIM_MM) ** 2).sum())

    simplex = np.concatenate([np.zeros((1, 6)), within * np.eye(6)])
    best = minimize(squares, np.zeros(6), method="Nelder-Mead", options={"initial_simplex": simplex, "maxfev": 600, "xatol": 1e-9})
    assert best.fun < squares(np.zeros(6))
    assert np.linalg.norm(moved(best.x) - moved(np.zeros(6)), axis=1).max() < within


def test_what_a_fit_settles_within_never_makes_a_verdict_better() -> None:
    """Each is held against that at the same pose, were it known."""
    first = judged(0.1)
    assert first.registration is not None
    within, highest = first.registration.settles_within_mm, first.max_deviation_mm
    assert first.zone.uncertainty_mm == U_MM + within
    assert first.notes[-1].startswith(f"the fit settles within {within:.6f}"[:-1])
    inside, outside = highest + U_MM, highest - U_MM  # limits at which the worst point is just proven
    good, bad, doubt = Verdict.CONFORM, Verdict.NONCONFORM, Verdict.UNCERTAIN
    for upper, expected in (
        (inside + 1.5 * within, (good, good)),
        (inside + 0.5 * within, (good, doubt)),
        (inside - 0.5 * within, (doubt, doubt)),
        (outside - 0.5 * within, (bad, doubt)),
        (-0.01, (bad, bad)),
    ):
        found, known = judged(upper), judged(upper, at=first.nominal_from_scan)
        assert np.array_equal(found.feet.distance_mm, known.feet.distance_mm)
        assert ((found.verdicts == known.verdicts) | (found.verdicts == doubt)).all()
        assert (known.verdict, found.verdict) == expected


def test_a_circle_wider_than_a_hundredth_of_the_zone_proves_nothing() -> None:
    found = judged(AIM_MM + 0.0012, 1e-4)
    assert found.registration is not None
    assert (found.verdict, found.registration.converged) == (Verdict.UNCERTAIN, False)
    assert kinds(found)[:2] == ["placement", "fit"]
    assert "circles" in found.reasons[1].words
    assert found.zone.uncertainty_mm == 1e-4
