"""Clouds as nominals: the error that they state covers what it has to, with and without noise; their edges are known."""

import numpy as np
import pytest
from numpy.typing import NDArray

from inspection import NominalError, Rejection, ToleranceZone, Verdict
from inspection.surface import CloudSurface, PatchSurface, RigidMotion, rejections
from inspection.surface.judged_surface import judge_points
from tests.inspection.surface import faces

Array = NDArray[np.float64]


@pytest.mark.parametrize("noise_mm", [0.0, 0.005, 0.02])
def test_the_stated_error_covers_95_percent_of_the_points(noise_mm: float) -> None:
    truth = PatchSurface([faces.mould()])
    places, normals = truth.sample(4000)
    places = places + np.random.default_rng(1).normal(0, noise_mm, (len(places), 1)) * normals if noise_mm else places
    cloud = CloudSurface(places, normals)
    points, outward = truth.sample(1500)
    points = points + np.random.default_rng(2).uniform(-0.5, 0.5, (len(points), 1)) * outward
    feet = cloud.project(points)
    judged = rejections(feet, 5.0) == Rejection.NONE
    assert judged.mean() > 0.97
    error = np.abs(feet.distance_mm - truth.project(points).distance_mm)[judged]
    assert (error <= cloud.nominal_error_mm).mean() >= 0.95
    assert cloud.nominal_error_mm < 0.014 + 1.5 * noise_mm
    assert error.max() < 3 * cloud.nominal_error_mm


@pytest.mark.parametrize(("noise_mm", "spacing_mm"), [(0.0, 0.8), (0.005, 0.8), (0.005, 1.6), (0.02, 1.6)])
def test_the_stated_error_covers_points_that_lie_by_chance(noise_mm: float, spacing_mm: float) -> None:
    """Samples as a scanner takes them, not on a grid, of a form whose foot is known: a bent tube, concave inside and convex outside."""
    rng = np.random.default_rng(8)
    ring, tube, count = 40.0, 12.0, int(4 * np.pi**2 * 40 * 12 / 6 / spacing_mm**2)

    def places(m: int, off: Array) -> tuple[Array, Array]:
        along, about = rng.uniform(0, np.pi / 3, m), rng.uniform(0, 2 * np.pi, m)
        normal = np.column_stack([np.cos(about) * np.cos(along), np.cos(about) * np.sin(along), np.sin(about)])
        middle = ring * np.column_stack([np.cos(along), np.sin(along), np.zeros(m)])
        return middle + (tube + off)[:, None] * normal, normal

    sampled, normals = places(count, rng.normal(0, noise_mm, count))
    cloud = CloudSurface(sampled, normals)
    off = rng.uniform(-0.5, 0.5, 2000)
    points, _ = places(2000, off)
    feet = cloud.project(points)
    judged = rejections(feet, 5.0) == Rejection.NONE
    assert judged.mean() > 0.95
    error = np.abs(feet.distance_mm - off)[judged]
    assert (error <= cloud.nominal_error_mm).mean() >= 0.95
    assert error.max() < 4 * cloud.nominal_error_mm  # nor is one in a hole of the cloud far off


def test_what_a_cloud_lacks_is_said_and_what_it_has_is_used() -> None:
    """An open sheet without normals has no sure side; with normals it has, though some points lack theirs or stand twice."""
    x, y = (axis.ravel() for axis in np.meshgrid(np.arange(0.0, 30), np.arange(0.0, 20)))
    sheet = np.column_stack([x, y, 0.01 * x**2])
    blind = CloudSurface(sheet)
    assert not blind.sides_known
    assert "only their size may be judged" in blind.notes[0]
    point = [(15, 10, 2.25 + 0.1)]
    zone = ToleranceZone(-0.05, 0.3)
    verdicts = [judge_points(np.array(point), None, each, RigidMotion.identity(), zone, 5.0).verdicts for each in (blind, _seen(sheet))]
    assert [each.tolist() for each in verdicts] == [[Verdict.UNCERTAIN], [Verdict.CONFORM]]


def _seen(sheet: Array) -> CloudSurface:
    normals = np.tile((0.0, 0.0, 2.0), (len(sheet), 1))
    normals[5:40] = np.nan
    cloud = CloudSurface(np.concatenate([sheet, sheet[:9], [(np.nan, 0, 0)]]), np.concatenate([normals, normals[:9], [(0, 0, 1)]]))
    assert cloud.sides_known
    assert cloud.notes == ()
    assert (cloud.normals[:, 2] > 0).all()
    return cloud


def test_a_round_cloud_without_normals_finds_its_outside_and_has_no_edge() -> None:
    golden, k = np.pi * (3 - 5**0.5), np.arange(3000) + 0.5
    z = 1 - 2 * k / 3000
    sphere = 20 * np.column_stack([np.sqrt(1 - z * z) * np.cos(golden * k), np.sqrt(1 - z * z) * np.sin(golden * k), z])
    cloud = CloudSurface(sphere)
    assert "no normals; it is closed" in cloud.notes[0]
    assert cloud.sides_known
    direction = np.random.default_rng(3).normal(size=(400, 3))
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    radius = np.random.default_rng(4).uniform(18, 22, 400)
    feet = cloud.project(direction * radius[:, None])
    assert (rejections(feet, 5.0) == Rejection.NONE).all()
    assert (np.abs(feet.distance_mm - (radius - 20)) <= cloud.nominal_error_mm).mean() >= 0.95
    assert cloud.area_mm2 == pytest.approx(4 * np.pi * 400, rel=0.1)
    places, normals = cloud.sample(5000)
    assert len(places) >= 5000
    assert ((places * normals).sum(axis=1) > 19.9).all()


def test_beyond_the_edge_of_a_cloud_nothing_is_judged() -> None:
    x, y = np.meshgrid(np.arange(0.0, 30), np.arange(0.0, 20))
    cloud = CloudSurface(np.column_stack([x.ravel(), y.ravel(), 0.01 * x.ravel() ** 2]), np.tile((0.0, 0.0, 1.0), (600, 1)))
    feet = cloud.project([(-3, 10, 0.5), (15, 23, 1), (33, 10, 5), (15, 10, 2.25 + 0.3), (15, 10, 2.25 - 0.3)])
    assert (rejections(feet, 20.0) == [Rejection.BEYOND_EDGE] * 3 + [Rejection.NONE] * 2).all()
    assert np.sign(feet.distance_mm[3:]).tolist() == [1, -1]
    assert cloud.nominal_error_mm < 1e-3  # a parabola is its own jet, but for the tilt of the frames


def test_what_is_no_surface_is_refused() -> None:
    with pytest.raises(NominalError, match="more than 24"):
        CloudSurface(np.zeros((3, 3)))
    with pytest.raises(NominalError, match="normals must have shape"):
        CloudSurface(np.random.default_rng(5).normal(size=(50, 3)), np.zeros((2, 3)))
    apart = np.random.default_rng(6).uniform(0, 10, (200, 3)) * (1, 1, 0)
    with pytest.raises(NominalError, match="do not hang together"):
        CloudSurface(np.concatenate([apart, apart + np.array([500, 0, 0])]))
