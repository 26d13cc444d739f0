"""Algorithm 1: both limits respected, every sample consistent with the curve, and the counts of the published method."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from inspection import (
    LiveInspection,
    Method,
    NominalError,
    NominalProfile,
    NurbsCurve,
    RigidTransform,
    ToleranceZone,
    Verdict,
    deviations,
    discretize,
    register,
)
from inspection.kernels import SAMPLE_METHODS
from tests.inspection import profiles


def smallest_step(nominal: NominalProfile) -> float:
    """Smallest difference of neighbouring parameters, as a fraction of the range."""
    first, last = nominal.curve.domain
    linked = nominal.next_site >= 0
    step = nominal.parameter[nominal.next_site[linked]] - nominal.parameter[linked]
    return float((np.where(step < 0, step + last - first, step) / (last - first)).min())


@pytest.mark.parametrize("name", profiles.EVERY)
def test_samples_are_the_curve_itself(name: str) -> None:
    curve = profiles.EVERY[name]()
    nominal = discretize(curve, samples=500, step_min=1e-3)
    n = len(nominal.parameter)
    assert n >= 500
    assert np.abs(nominal.points_mm - curve.point(nominal.parameter)).max() < 1e-12
    # at the end of a piece the tangent is that of the piece which ends there
    first, last = curve.domain
    inside = np.clip(np.where(nominal.next_site < 0, nominal.parameter - 1e-13, nominal.parameter), first, last)
    inside = np.where((nominal.next_site < 0) & (nominal.parameter == first), last - 1e-13, inside)
    d1, d2 = curve.derivatives(inside, 2)[1:]
    speed = np.linalg.norm(d1, axis=1)
    assert np.abs(nominal.tangent - d1 / speed[:, None]).max() < 1e-8
    assert np.abs(nominal.normal - np.column_stack([-nominal.tangent[:, 1], nominal.tangent[:, 0]])).max() < 1e-15
    curvature = (d1[:, 0] * d2[:, 1] - d1[:, 1] * d2[:, 0]) / speed**3
    assert np.abs(nominal.curvature - curvature).max() < 1e-6 * np.abs(curvature).max() + 1e-12
    assert nominal.length_mm == curve.length_mm
    for field in ("left", "right", "left_curvature", "right_curvature", "angle_deg"):
        assert np.isfinite(getattr(nominal.poles, field)).all(), field


@pytest.mark.parametrize("name", profiles.EVERY)
def test_neighbours_form_the_chains_of_the_smooth_pieces(name: str) -> None:
    curve = profiles.EVERY[name]()
    nominal = discretize(curve, samples=300, step_min=1e-3)
    n, following, before = len(nominal.parameter), nominal.next_site, nominal.previous_site
    linked = following >= 0
    assert np.array_equal(before[following[linked]], np.arange(n)[linked])
    pieces = max(1, len(curve.corners) + (0 if curve.closed else 1))
    ends = 0 if curve.closed and len(curve.corners) == 0 else pieces
    assert (following < 0).sum() == (before < 0).sum() == ends
    assert nominal.is_open_end.sum() == (0 if curve.closed else 2)
    corner = nominal.twin >= 0
    assert corner.sum() == 2 * len(curve.corners)
    assert np.array_equal(nominal.twin[nominal.twin[corner]], np.arange(n)[corner])
    assert np.abs(nominal.points_mm[corner] - nominal.points_mm[nominal.twin[corner]]).max(initial=0.0) < 1e-12
    # the steps of the chains are short everywhere: no piece is left without samples
    reach = np.linalg.norm(nominal.points_mm[following[linked]] - nominal.points_mm[linked], axis=1)
    assert reach.max() < 8 * curve.length_mm / n * (n / 300)
    assert reach.min() > 0


@pytest.mark.parametrize("step_min", [1e-3, 1e-4])
@pytest.mark.parametrize("name", ["P1", "P3", "NACA 2412 sharp", "NACA 4412 blunt", "GOE404"])
def test_refinement_stops_only_at_the_pole_angle_or_at_the_smallest_step(name: str, step_min: float) -> None:
    curve = profiles.EVERY[name]()
    nominal = discretize(curve, samples=100, pole_angle_min_deg=178.0, step_min=step_min)
    assert smallest_step(nominal) >= step_min * (1 - 1e-9)
    first, last = curve.domain
    interior = (nominal.next_site >= 0) & (nominal.previous_site >= 0)
    failing = interior & (nominal.poles.angle_deg < 178.0)
    assert failing.sum() == nominal.unmet
    # a sample that fails has no neighbouring step left that may be split
    u = nominal.parameter
    for site in np.flatnonzero(failing):
        steps = [u[nominal.next_site[site]] - u[site], u[site] - u[nominal.previous_site[site]]]
        assert max(s % (last - first) for s in steps) < 2 * step_min * (last - first) * (1 + 1e-9)


def test_a_denser_start_is_kept() -> None:
    for name in ("P1", "P3"):
        nominal = discretize(profiles.SMOOTH[name]())
        assert 10_000 <= len(nominal.parameter) <= 10_010
        assert nominal.unmet == 0


@pytest.mark.parametrize(
    ("name", "limit_deg", "count"),
    [("P1", 178, 164), ("P2", 178, 171), ("P3", 178, 185), ("P1", 179, 316), ("P2", 179, 299), ("P3", 179, 360), ("ellipse", 178, 300)],
)
def test_local_refinement_needs_about_the_samples_of_the_reference(name: str, limit_deg: float, count: int) -> None:
    # Counts measured with another implementation. They hang on the exact start, the size of the box and the conic's
    # parametrisation, none of which is published: 12 % tells the local rule from the global one, which is off by 9 % to 4,000 %.
    nominal = discretize(profiles.EVERY[name](), samples=100, pole_angle_min_deg=limit_deg, step_min=1e-4)
    assert len(nominal.parameter) == pytest.approx(count, rel=0.12)
    assert nominal.unmet == 0


@pytest.mark.parametrize(
    ("name", "limit_deg", "count"), [("GOE404", 178, 1484), ("GOE404", 179, 2609), ("MH42", 178, 2391), ("MH42", 179, 3691)]
)
def test_thin_airfoils_need_about_the_samples_of_the_reference(name: str, limit_deg: float, count: int) -> None:
    nominal = discretize(profiles.EVERY[name](), samples=100, pole_angle_min_deg=limit_deg, step_min=1e-4)
    assert len(nominal.parameter) == pytest.approx(count, rel=0.12)
    assert nominal.unmet > 0


def test_pole_angles_meet_the_limit_on_a_smooth_closed_profile() -> None:
    for limit in (176.0, 178.0, 179.5):
        nominal = discretize(profiles.p3(), samples=60, pole_angle_min_deg=limit)
        assert nominal.poles.angle_deg.min() >= limit


def test_coinciding_ends_of_an_open_curve_leave_no_gap_in_the_numbers() -> None:
    # the trap of a sharp trailing edge read as an open curve: its first and last samples are one place
    points = profiles.naca_points("2412", 100.0)
    nominal = discretize(NurbsCurve.interpolate(points, 3), samples=400)
    for field in ("left", "right", "left_curvature", "right_curvature", "angle_deg"):
        assert np.isfinite(getattr(nominal.poles, field)).all(), field
    assert np.isfinite(nominal.normal).all()
    assert nominal.is_open_end.sum() == 2


def refuse_diagrams(*_: Any) -> Any:
    """Stand in for the making of poles where none may be made."""
    raise AssertionError("a Voronoi diagram was built")


def test_the_exact_method_builds_no_voronoi_diagram(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("inspection.nominal.site_poles", refuse_diagrams)
    nominal = discretize(profiles.p3())
    points = nominal.points_mm[::20] + 0.01 * nominal.normal[::20]
    for method in ("exact", "inversion"):
        assert deviations(points, nominal, method=method).deviation_mm == pytest.approx(-0.01)
    moved = RigidTransform(0.3, np.array([5.0, 6.0])).apply(points)
    assert register(moved, nominal).converged
    live = LiveInspection(nominal, ToleranceZone(-0.1, 0.1))
    live.add(moved)
    assert live.finish().verdict == Verdict.CONFORM
    assert len(discretize(profiles.p3(), accuracy_mm=0.01, method="exact")) > 8


@pytest.mark.parametrize("method", SAMPLE_METHODS)
def test_methods_that_look_at_samples_have_their_diagram_before_the_first_point(method: Method, monkeypatch: pytest.MonkeyPatch) -> None:
    nominal = discretize(profiles.p3(), samples=500, step_min=1 / 500)
    live = LiveInspection(nominal, ToleranceZone(-0.1, 0.1), method=method)
    monkeypatch.setattr("inspection.nominal.site_poles", refuse_diagrams)
    live.add(nominal.points_mm)
    assert live.finish().verdict == Verdict.CONFORM


def test_poles_are_those_of_the_samples_whenever_they_are_asked_for() -> None:
    early, late = (discretize(profiles.p1(), samples=500, step_min=1 / 500) for _ in range(2))
    assert early.poles.angle_deg.min() > 0
    deviations(late.points_mm, late)  # other work in between
    for poles in (late.poles, replace(late, material="right").poles):
        assert poles.edge_left_mm.tobytes() == early.poles.edge_left_mm.tobytes()
        assert not poles.left.flags.writeable
    assert late.poles is late.poles


def test_outward_follows_the_side_of_the_material() -> None:
    curve = profiles.circle(10.0)
    assert discretize(curve, samples=64).outward == -1
    assert discretize(curve, samples=64, material="right").outward == 1


def test_smallest_concave_radius_has_its_closed_form() -> None:
    a, b = 50.0, 20.0
    assert discretize(profiles.ellipse(a, b), samples=400).smallest_concave_radius_mm == np.inf
    hole = discretize(profiles.ellipse(a, b), samples=400, material="right")
    assert hole.smallest_concave_radius_mm == pytest.approx(b * b / a, rel=1e-3)
    hole = discretize(profiles.ellipse(a, b, clockwise=True), samples=400, material="left")
    assert hole.smallest_concave_radius_mm == pytest.approx(b * b / a, rel=1e-3)
    assert discretize(profiles.circle(7.0), samples=64, material="right").smallest_concave_radius_mm == pytest.approx(7.0, rel=1e-9)
    # P3 turns both ways: the tightest of its hollows, from a dense evaluation of the curvature
    u = np.linspace(0, 1, 200_001)
    curvature = profiles.p3().curvature(u)
    assert curvature.min() < 0
    assert discretize(profiles.p3()).smallest_concave_radius_mm == pytest.approx(-1 / curvature.min(), rel=1e-4)


@pytest.mark.parametrize(
    "wrong",
    [
        {"samples": 7},
        {"samples": 0},
        {"samples": -5},
        {"pole_angle_min_deg": 180.0},
        {"pole_angle_min_deg": -1.0},
        {"pole_angle_min_deg": float("nan")},
        {"step_min": 0.0},
        {"step_min": -1e-4},
        {"step_min": float("nan")},
        {"material": "inside"},
    ],
    ids=str,
)
def test_limits_that_cannot_be_are_refused(wrong: dict[str, Any]) -> None:
    got = {"samples": 10_000, "pole_angle_min_deg": 178.0, "step_min": 1e-4, "material": "left"} | wrong
    with pytest.raises(NominalError) as caught:
        discretize(profiles.p1(), **wrong)
    assert str(caught.value) == (
        "need samples >= 8, 0 < pole_angle_min_deg < 180, 0 < step_min < 1, material left or right; "
        f"got {got['samples']}, {got['pole_angle_min_deg']}, {got['step_min']}, {got['material']}"
    )
