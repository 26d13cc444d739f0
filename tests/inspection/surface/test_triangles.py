"""Closest points of meshes: those of an exhaustive search in extended precision, on the right side, whatever the batch."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from inspection import NominalError, Rejection
from inspection.kernels.surfaces.space_feet import nearby_first
from inspection.surface import FootKind, SurfaceFeet, TriangleSurface, rejections
from tests.inspection.surface import meshes

Array = NDArray[np.float64]


def around(triangles: Array, count: int, reach: float, seed: int) -> Array:
    """Places near corners, edges and faces of a mesh, beside them, far off, and exactly on them."""
    rng = np.random.default_rng(seed)
    weights = rng.dirichlet((0.3, 0.3, 0.3), count)
    weights[: count // 8] = np.eye(3)[rng.integers(0, 3, count // 8)]
    on = np.einsum("mk,mkd->md", weights, triangles[rng.integers(0, len(triangles), count)])
    reaches = reach * 10.0 ** rng.uniform(-6, 0.5, count)
    reaches[count // 4 : count // 3] = 0.0
    return np.asarray(on + rng.normal(size=(count, 3)) * reaches[:, None])


@pytest.mark.parametrize(
    "triangles",
    [meshes.sphere(12), meshes.prism(meshes.NOTCHED, 0.05), meshes.wave(20), meshes.wave(3, 1000.0)[:1]],
    ids=["sphere", "thin notched plate", "wave", "one triangle"],
)
def test_distances_are_those_of_an_exhaustive_search(triangles: Array) -> None:
    points = around(triangles, 160, 0.1 * float(np.ptp(triangles)), 1)
    feet = TriangleSurface(triangles).project(points)
    wanted = meshes.exhaustive(points, triangles)
    assert np.abs(np.abs(feet.distance_mm) - wanted).max() < 1e-12
    apart = np.linalg.norm(feet.foot_mm - points, axis=1)
    assert np.abs(apart - np.abs(feet.distance_mm)).max() < 1e-12
    assert meshes.exhaustive(feet.foot_mm, triangles).max() < 1e-12  # feet lie on the surface


def test_slivers_of_a_thousand_to_one_are_as_exact() -> None:
    grid = np.stack([*np.meshgrid(np.linspace(0, 20, 3), np.linspace(0, 0.2, 11), indexing="ij"), np.zeros((3, 11))], axis=-1)
    grid[..., 2] = 0.03 * np.sin(grid[..., 1] * 40) + 0.01 * grid[..., 0]
    triangles = meshes.triangles_of_grid(grid)[:, ::-1]
    points = around(triangles, 400, 0.2, 2)
    assert np.abs(np.abs(TriangleSurface(triangles).project(points).distance_mm) - meshes.exhaustive(points, triangles)).max() < 1e-12


def test_no_sign_is_wrong_inside_and_outside_a_part_with_edges_hollows_and_saddle_corners() -> None:
    height = 2.0
    triangles = meshes.prism(meshes.NOTCHED, height)
    points = np.random.default_rng(3).uniform((-1, -1, -1), (5, 4, 3), (100_000, 3))
    feet = TriangleSurface(triangles).project(points)
    assert ((feet.distance_mm < 0) == meshes.is_inside_notched(points, height)).all()
    assert set(np.unique(feet.kind)) == {FootKind.FACE, FootKind.EDGE, FootKind.CORNER}
    assert (rejections(feet, 10.0) == Rejection.NONE).all()


def test_no_sign_is_wrong_on_a_sphere_of_a_mesh_with_its_poles() -> None:
    surface = TriangleSurface(meshes.sphere(24))
    d = np.random.default_rng(4).normal(size=(100_000, 3))
    radius = np.random.default_rng(5).uniform(20, 40, 100_000)
    inner = 30 * np.cos(np.pi / 24) ** 2  # the mesh lies between this radius and 30
    points = d / np.linalg.norm(d, axis=1)[:, None] * radius[:, None]
    sign = np.sign(surface.project(points).distance_mm)
    assert (sign[radius > 30] == 1).all()
    assert (sign[radius < inner] == -1).all()
    assert surface.is_closed


def test_on_an_open_sheet_signs_are_right_away_from_borders_and_what_lies_beyond_them_is_told() -> None:
    surface = TriangleSurface(meshes.wave(60))
    rng = np.random.default_rng(6)
    x, y = rng.uniform(-3, 63, (2, 100_000))
    lift = rng.uniform(-1.5, 1.5, len(x))
    points = np.column_stack([x, y, 4 * np.sin(x / 7) * np.cos(y / 9) + lift])
    feet = surface.project(points)
    judged = rejections(feet, 10.0) == Rejection.NONE
    sure = judged & (np.abs(lift) > 0.05)  # the triangles lie off the wave by less
    assert (np.sign(feet.distance_mm[sure]) == np.sign(lift[sure])).all()
    beside = np.maximum(np.maximum(-x, x - 60), np.maximum(-y, y - 60))
    assert not judged[beside > 1.5].any()
    assert judged[beside < -1.5].all()
    assert (rejections(feet, 10.0)[~judged] == Rejection.BEYOND_EDGE).all()


def test_normals_point_to_where_the_deviation_grows() -> None:
    triangles = meshes.prism(meshes.NOTCHED, 2.0)
    surface = TriangleSurface(triangles)
    points = around(triangles, 2000, 0.3, 7)
    feet = surface.project(points)
    assert np.abs(np.linalg.norm(feet.normal, axis=1) - 1).max() < 1e-14
    far = np.abs(feet.distance_mm) > 1e-3
    moved = surface.project(points[far] + 1e-7 * feet.normal[far])
    assert np.abs(moved.distance_mm - feet.distance_mm[far] - 1e-7).max() < 1e-12
    assert np.abs(feet.foot_mm + feet.distance_mm[:, None] * feet.normal - points).max() < 1e-12


def rows(feet: SurfaceFeet) -> tuple[NDArray[Any], ...]:
    return feet.foot_mm, feet.distance_mm, feet.normal, feet.face, feet.parameter, feet.kind


def test_no_bit_depends_on_batch_order_or_threads() -> None:
    triangles = meshes.sphere(20)
    surface = TriangleSurface(triangles)
    points = around(triangles, 5000, 3.0, 8)
    points[17], points[18] = np.nan, (0.0, 0.0, 0.0)  # the middle: everything is equally near
    whole = rows(surface.project(points))
    shuffled = np.random.default_rng(9).permutation(len(points))
    parts = np.split(points[shuffled], [1, 3, 700, 4000])
    pieces = [np.concatenate(column) for column in zip(*(rows(surface.project(part, threads=2)) for part in parts), strict=True)]
    for one, other in zip(whole, pieces, strict=True):
        assert np.array_equal(one[shuffled], other, equal_nan=True)
    assert np.array_equal(whole[1], surface.project(points, threads=3).distance_mm, equal_nan=True)


def test_scattered_points_are_looked_at_in_order_and_come_back_in_theirs() -> None:
    surface = TriangleSurface(meshes.sphere(20))
    scattered = np.random.default_rng(10).uniform(-35, 35, (3000, 3))
    scattered[100] = np.nan
    order = nearby_first(scattered)
    assert order is not None
    assert sorted(order.tolist()) == list(range(3000))
    steps = [float(np.nanmedian(np.abs(np.diff(points, axis=0)))) for points in (scattered, scattered[order])]
    assert steps[1] < steps[0] / 3
    assert nearby_first(scattered[order]) is None
    whole = rows(surface.project(scattered))
    parts = [rows(surface.project(part)) for part in np.split(scattered, 5)]  # too few to be ordered
    for one, other in zip(whole, (np.concatenate(column) for column in zip(*parts, strict=True)), strict=True):
        assert np.array_equal(one, other, equal_nan=True)


def test_points_that_are_no_place_have_no_foot() -> None:
    feet = TriangleSurface(meshes.sphere(6)).project([(np.nan, 0, 0), (0, np.inf, 0), (0, 0, 2e6), (0, 0, 31)])
    assert feet.kind.tolist()[:3] == [FootKind.NONE] * 3
    assert feet.face.tolist()[:3] == [-1] * 3
    assert rejections(feet, 5.0).tolist() == [Rejection.NOT_FINITE] * 3 + [Rejection.NONE]
    assert rejections(feet, 0.5).tolist()[3] == Rejection.OFF_SURFACE


def test_a_point_of_the_other_side_of_a_thin_wall_is_told_by_the_normals_of_the_scan() -> None:
    surface = TriangleSurface(meshes.prism(meshes.NOTCHED, 0.05))
    points = np.array([(0.5, 0.5, 0.04), (0.5, 0.5, 0.04), (0.5, 0.5, 0.04), (0.5, 0.5, 0.04)])
    feet = surface.project(points)
    found = rejections(feet, 1.0, [(0, 0, 3.0), (0, 0, -1.0), (0, 0, 0), (0.8, 0, 0.6)])
    assert found.tolist() == [Rejection.NONE, Rejection.OPPOSITE_FACE, Rejection.NONE, Rejection.NONE]
    with pytest.raises(ValueError, match="scan normals"):
        rejections(feet, 1.0, [(0, 0, 1.0)])


def test_samples_lie_on_the_surface_evenly_by_area() -> None:
    surface = TriangleSurface(meshes.prism(meshes.NOTCHED, 2.0))
    places, normals = surface.sample(5000)
    assert len(places) >= 5000
    feet = surface.project(places)
    assert np.abs(feet.distance_mm).max() < 1e-14
    top = (normals[:, 2] > 0.5).mean()
    assert top == pytest.approx(6.0 / surface.area_mm2, rel=2e-3)
    assert surface.area_mm2 == pytest.approx(2 * 6 + 14 * 2, rel=1e-12)
    assert surface.size_mm == 4.0


def test_what_makes_no_surface_is_refused() -> None:
    with pytest.raises(NominalError, match="shape"):
        TriangleSurface(np.zeros((4, 3)))
    with pytest.raises(NominalError, match="not finite"):
        TriangleSurface(np.full((1, 3, 3), np.nan))
    with pytest.raises(NominalError, match="no triangle with an area"):
        TriangleSurface(np.zeros((5, 3, 3)))
    with pytest.raises(NominalError, match="error of the nominal"):
        TriangleSurface(meshes.sphere(4), nominal_error_mm=-1.0)


def test_places_on_a_fan_of_slivers_are_spread_evenly() -> None:
    """Slivers from one corner to a far rim, as CAD systems cut a plane: rows of places in step would leave rings free."""
    angle = np.linspace(0, 0.5, 400)
    rim = np.column_stack([50 * np.cos(angle), 50 * np.sin(angle), np.zeros(400)])
    surface = TriangleSurface(np.stack([np.zeros((399, 3)), rim[:-1], rim[1:]], axis=1))
    places, _ = surface.sample(3000)
    spacing = np.sqrt(surface.area_mm2 / len(places))
    at, turn = 50 * np.sqrt(np.linspace(0.001, 0.999, 80)), np.linspace(0.01, 0.49, 60)
    everywhere = np.stack([np.outer(at, np.cos(turn)), np.outer(at, np.sin(turn)), np.zeros((80, 60))], axis=-1).reshape(-1, 3)
    assert np.max(cKDTree(places).query(everywhere)[0]) < 3 * spacing
