"""The demonstration part against the closed form of the NACA four-digit sections, evaluated here on its own."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from cmmlink.demo import part_path, plan_file, write_part_path
from cmmlink.demo.section import CAP_START, nominal_csv, nominal_points, outline
from cmmlink.nominal_files import load_nominal, material_side
from cmmlink.plan.scan import load_plan
from drivers.files.point_file import read_points
from inspection import NurbsCurve, deviations, discretize

Array = NDArray[np.float64]


@pytest.fixture(scope="module")
def curve() -> NurbsCurve:
    return load_nominal(plan_file().with_name("nominal.csv")).curve


def naca_4512(x: Array, side: int) -> Array:
    """Points (k, 2) in mm for a chord of 100 mm: NACA Report 460 with the camber angle written as an angle. side: +1 above, -1 below."""
    half = 0.6 * (0.2969 * np.sqrt(x) - 0.126 * x - 0.3516 * x**2 + 0.2843 * x**3 - 0.1015 * x**4)
    camber, angle = 0.16 * (x - x**2), np.arctan(0.16 * (1 - 2 * x))
    return 100 * np.column_stack([x - side * half * np.sin(angle), camber + side * half * np.cos(angle)])


def closed_form() -> Array:
    """Both sides of the section as one polyline from the upper edge to the lower, with a sag below 1e-8 mm."""
    x = np.linspace(1, 0, 200_001) ** 2
    return np.vstack([naca_4512(x, 1), naca_4512(x[-2::-1], -1)])


def distance_to_polyline(points: Array, polyline: Array) -> Array:
    """Distance (k,) of points to the two segments beside the nearest vertex."""
    _, nearest = cKDTree(polyline).query(points)
    result = np.full(len(points), np.inf)
    for first in (nearest - 1, nearest):
        a = polyline[np.clip(first, 0, len(polyline) - 2)]
        along = polyline[np.clip(first, 0, len(polyline) - 2) + 1] - a
        share = np.clip(((points - a) * along).sum(axis=1) / (along**2).sum(axis=1), 0, 1)
        result = np.minimum(result, np.hypot(*(points - a - share[:, None] * along).T))
    return result


def curvature_of(points: Array) -> Array:
    first = np.gradient(points, axis=0)
    second = np.gradient(first, axis=0)
    return np.asarray((first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]) / np.hypot(*first.T) ** 3)


def test_shipped_nominal_is_what_the_module_computes(tmp_path: Path) -> None:
    shipped = read_points(plan_file().with_name("nominal.csv")).points_mm[:, :2]
    np.testing.assert_allclose(shipped, nominal_points(), rtol=0, atol=1e-9)  # nine decimals, and the last bits of another libm
    (tmp_path / "again.csv").write_text(nominal_csv(), encoding="utf-8")
    np.testing.assert_allclose(read_points(tmp_path / "again.csv").points_mm[:, :2], shipped, rtol=0, atol=1e-9)


def test_nominal_is_the_section_within_a_tenth_of_a_micrometre_but_for_the_cap(curve: NurbsCurve) -> None:
    points = curve.point(np.linspace(0, 1, 40_000, endpoint=False))
    on_section = points[points[:, 0] < 100 * CAP_START - 0.2]
    assert len(on_section) > 20_000
    assert distance_to_polyline(on_section, closed_form()).max() < 1e-4


def test_points_lie_on_the_section_to_the_last_decimal() -> None:
    points = nominal_points()
    on_section = points[points[:, 0] < 100 * CAP_START - 0.2]
    assert distance_to_polyline(on_section, closed_form()).max() < 2e-8


def test_nominal_has_no_corner_and_only_the_inflections_of_the_section(curve: NurbsCurve) -> None:
    """Below, the section turns from convex to hollow once, and the cap turns it back. Nothing else, so the cubic does not ring."""
    assert curve.closed
    assert curve.corners.size == 0
    u = np.linspace(0, 1, 200_001)
    changes = np.flatnonzero(np.diff(np.sign(curve.curvature(u))) != 0)
    assert len(changes) == 2
    first, second = curve.point(u[changes])
    x = np.linspace(0.05, 0.99, 20_001)
    of_section = naca_4512(x, -1)[np.flatnonzero(np.diff(np.sign(curvature_of(naca_4512(x, -1)))) != 0)]
    assert len(of_section) == 1
    np.testing.assert_allclose(first, of_section[0], atol=0.3)  # curvature is as good as flat here: it moves with the third derivative
    assert second[0] > 100 * CAP_START - 0.3
    assert second[1] < 0


def test_cap_continues_both_sides_in_position_tangent_and_curvature() -> None:
    for end in (-1.0, 1.0):
        h = 1e-4
        before, after = outline(end - h * np.arange(3)), outline(end + h * np.arange(3))
        np.testing.assert_array_equal(before[0], after[0])
        tangents = [(-3 * p[0] + 4 * p[1] - p[2]) / (2 * h) * sign for p, sign in ((before, -1), (after, 1))]
        bends = [(p[0] - 2 * p[1] + p[2]) / h**2 for p in (before, after)]
        kappa = [(t[0] * b[1] - t[1] * b[0]) / np.hypot(*t) ** 3 for t, b in zip(tangents, bends, strict=True)]
        angles = [np.arctan2(t[1], t[0]) for t in tangents]
        assert angles[0] == pytest.approx(angles[1], abs=1e-6)
        assert kappa[0] == pytest.approx(kappa[1], abs=2e-4)


def test_cap_bends_up_to_one_peak_and_down(curve: NurbsCurve) -> None:
    points = outline(np.concatenate([np.linspace(1, 2, 1001)[5:], np.linspace(-2, -1, 1001)[1:-5]]))
    kappa = curvature_of(points)[5:-5]
    assert np.count_nonzero(np.diff(np.sign(np.diff(kappa)))) == 1
    assert 7 < kappa.max() < 10
    assert curve.curvature(np.linspace(0, 1, 100_001)).max() == pytest.approx(kappa.max(), rel=1e-2)


def test_demonstration_plan_fits_its_nominal() -> None:
    plan = load_plan(plan_file())
    nominal = load_nominal(plan.nominal.file, plan.nominal.scale, plan.nominal.closed)
    assert nominal.notes[0] == "closed: the last point repeats the first, smooth there"
    assert [note.split()[1] for note in nominal.notes[1:]] == ["curvature", "tightest"]  # what every nominal is checked for
    assert material_side(nominal.curve) == "left"
    profile = discretize(nominal.curve, samples=4000, step_min=2.5e-4, material="left")
    assert plan.probe.tip_radius_mm == 1.0
    assert profile.smallest_concave_radius_mm > 100 * plan.probe.tip_radius_mm
    assert (plan.zone.lower_mm, plan.zone.upper_mm) == (-0.05, 0.05)


def test_no_half_turn_brings_the_section_onto_itself(curve: NurbsCurve) -> None:
    points = part_path(curve, 2000)[:-1]
    low, high = points.min(axis=0), points.max(axis=0)
    turned = low + high - points
    assert distance_to_polyline(turned, np.vstack([points, points[:1]])).max() > 1.0


def test_part_path_follows_the_curve(curve: NurbsCurve) -> None:
    path = part_path(curve, 5000)
    assert len(path) > 5000
    np.testing.assert_array_equal(path[0], path[-1])
    profile = discretize(curve, samples=4000, step_min=2.5e-4)
    assert np.abs(deviations(path[:-1], profile).deviation_mm).max() < 1e-12
    assert np.abs(deviations((path[1:] + path[:-1]) / 2, profile).deviation_mm).max() < 2e-5
    step = np.hypot(*np.diff(path, axis=0).T)
    assert step.max() < curve.length_mm / 5000 * 1.001
    assert step.sum() == pytest.approx(curve.length_mm, rel=1e-6)


def test_part_path_of_an_open_curve_ends_where_it_ends(tmp_path: Path) -> None:
    arc = NurbsCurve(2, np.array([[1.0, 0], [1, 1], [0, 1]]) * 30, np.array([0.0, 0, 0, 1, 1, 1]), np.array([1, np.sqrt(0.5), 1]))
    write_part_path(arc, tmp_path / "arc.csv", 100)
    points = read_points(tmp_path / "arc.csv").points_mm
    np.testing.assert_allclose(points[[0, -1]], [[30, 0, 0], [0, 30, 0]], atol=1e-9)
    np.testing.assert_allclose(np.hypot(points[:, 0], points[:, 1]), 30, atol=2e-9)
    with pytest.raises(ValueError, match="at least two points"):
        part_path(arc, 1)
