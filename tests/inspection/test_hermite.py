"""The method `hermite`: the error that its cubic has on a circle, few samples against the published method's many, corners and seams."""

import numpy as np
import pytest

from inspection import LiveInspection, NurbsCurve, ToleranceZone, Verdict, deviations, discretize
from tests.inspection import profiles
from tests.inspection.profiles import curve_of, nominal_of


def test_on_a_circle_the_error_in_mid_piece_is_that_of_the_cubic_through_two_places_and_tangents() -> None:
    # The middle of a cubic with ends P, Q, unit tangents S, T and length h is (P + Q) / 2 + h (S - T) / 8. For an arc of the angle 2 a that
    # is r (cos a + a sin a / 2) from the centre, and by symmetry it is the foot of every point on that radius.
    radius, count, tangents = 20.0, 40, 0.3
    nominal = discretize(profiles.circle(radius), samples=count, step_min=0.4)
    angle = np.sort(np.arctan2(*nominal.points_mm.T[::-1]))
    half = np.diff(angle) / 2
    middle = angle[:-1] + half
    found = deviations((radius + tangents) * np.column_stack([np.cos(middle), np.sin(middle)]), nominal, "hermite")
    assert np.abs(found.deviation_mm - (radius + tangents - radius * (np.cos(half) + half * np.sin(half) / 2))).max() < 1e-12
    assert np.abs(found.deviation_mm - tangents).max() > 1e-6  # which the exact method does not have
    assert np.abs(np.hypot(*found.foot_mm.T) - radius * (1 - half**4 / 24)).max() < 1e-7


@pytest.mark.parametrize(("name", "times"), [("P2", 70), ("P3", 70), ("ellipse", 70), ("NACA 4412 blunt", 10), ("NACA 2412 sharp", 10)])
def test_500_samples_are_better_than_10_000_of_the_published_method(name: str, times: float) -> None:
    curve = curve_of(name)
    u = profiles.inner_parameters(curve, 3000, np.random.default_rng(18), 2e-3)
    offset = 0.05 * np.where(np.arange(len(u)) % 2, 1.0, -1.0)
    points = profiles.offset_points(curve, u, offset)
    exact = deviations(points, nominal_of(name, 10_000), "exact").deviation_mm
    veaw = np.abs(deviations(points, nominal_of(name, 10_000), "veaw").deviation_mm - exact)
    few = discretize(curve, samples=500, step_min=1 / 500)
    assert len(few) < 520
    hermite = np.abs(deviations(points, few, "hermite").deviation_mm - exact)
    assert hermite.mean() * times < veaw.mean()
    assert hermite.max() < veaw.max() / 10


def test_feet_and_parameters_belong_together_where_the_parameter_begins_between_two_corners() -> None:
    # a square that begins in the middle of its lower side: no sample lies where the parameter begins, and 0 is no corner
    side, h = 40.0, 20.0
    places = np.array([(0, -h), (h, -h), (h, h), (-h, h), (-h, -h), (0, -h)], dtype=float)
    curve = NurbsCurve(1, places, np.array([0, 0, 1, 3, 5, 7, 8, 8]) / 8, closed=True)
    nominal = discretize(curve, samples=37, step_min=0.4)
    assert not np.isclose(nominal.parameter, 0).any()
    rng = np.random.default_rng(4)
    points = rng.uniform(-1.2 * h, 1.2 * h, (400, 2))
    found, exact = (deviations(points, nominal, method) for method in ("hermite", "exact"))
    off = np.abs(points) - h
    truth = np.where((off < 0).all(axis=1), off.max(axis=1), np.linalg.norm(np.maximum(off, 0), axis=1))
    assert np.abs(found.deviation_mm - truth).max() < 1e-12
    assert np.array_equal(found.at_vertex, exact.at_vertex)
    alone = np.diff(np.sort(np.abs(off), axis=1), axis=1)[:, 0] > 1e-3  # beside a diagonal two sides are equally near
    assert np.abs(np.mod(found.station_mm - exact.station_mm + side, 4 * side) - side)[alone].max() < 1e-10
    assert np.abs(curve.point(found.parameter) - found.foot_mm)[alone].max() < 1e-10


def test_a_live_inspection_on_few_samples_has_the_verdict_of_the_exact_one() -> None:
    curve = curve_of("NACA 4412 blunt")
    few = discretize(curve, samples=250, step_min=1 / 250)
    u = profiles.even_in_arc_length(curve, 3000)
    form = 0.012 * np.sin(6 * np.pi * np.arange(3000) / 3000)
    scan = profiles.rotated(profiles.offset_points(curve, u, form), 8.0, (3.0, -2.0))
    results = {}
    for method in ("hermite", "exact"):
        live = LiveInspection(few, ToleranceZone(-0.02, 0.02), method=method, gap_max_mm=0.5)
        for block in np.array_split(scan, 7):
            live.add(block)
        results[method] = live.finish()
    ours, exact = results["hermite"], results["exact"]
    assert ours.method == "hermite"
    assert ours.verdict is exact.verdict is Verdict.CONFORM
    assert ours.coverage == pytest.approx(exact.coverage, abs=1e-6)
    assert np.nanmax(np.abs(ours.deviation_mm - exact.deviation_mm)) < 2e-4  # 0.07 um at the pose of the exact one, and the poses differ
