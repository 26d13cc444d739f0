"""Trimmed faces: exact inside their loops, by triangles with their bound elsewhere, and never exact where a face is cut away."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from inspection import NominalError
from inspection.surface import FootKind, TriangleSurface, TrimmedFace, TrimmedSurface
from inspection.surface.trim_loop import trim_loop
from tests.inspection.surface import faces, meshes

Array = NDArray[np.float64]
HEIGHT = 2.0
BOUND_MM = 0.05  # more than the triangles are off, which are exact: what is certified has to hold in spite of it


def loop_in_plane(corners: Array, z: float) -> Array:
    """Segments (s, 2, 5) of a closed loop of corners (s, 2) in a plane whose parameters are x and y."""
    nodes = np.column_stack([corners, corners, np.full(len(corners), z)])
    return np.stack([nodes, np.roll(nodes, -1, axis=0)], axis=1)


def notched(hidden: int | None = None) -> TrimmedSurface:
    """The prism over NOTCHED: two trimmed caps over the rectangle around it and six whole walls, one of which may be no spline."""
    outline, triangles = meshes.NOTCHED, meshes.prism(meshes.NOTCHED, HEIGHT)
    low, high = outline.min(axis=0), outline.max(axis=0)
    made: list[TrimmedFace | None] = []
    for z in (0.0, HEIGHT):
        corner, along = np.array([*low, z]), np.diag([*(high - low), 0.0])
        spline = faces.plane(corner, along[0], along[1])
        unit = (loop_in_plane(outline, z) - np.array([*low, 0, 0, 0])) / np.array([*(high - low), 1, 1, 1])
        made.append(TrimmedFace(spline, unit, 1e-6))
    for begin, end in zip(outline, np.roll(outline, -1, axis=0), strict=True):
        step = np.array([*(end - begin), 0.0])
        made.append(TrimmedFace(faces.plane(np.array([*begin, 0.0]), step, np.array([0.0, 0, HEIGHT]))))
    if hidden is not None:
        made[hidden] = None
    return TrimmedSurface(made, triangles, owners(triangles), BOUND_MM)


def owners(triangles: Array) -> NDArray[np.int64]:
    middle = triangles.mean(axis=1)
    walls = [np.roll(meshes.NOTCHED, -1, axis=0)[i] - begin for i, begin in enumerate(meshes.NOTCHED)]
    result = np.full(len(triangles), -1)
    for i, (begin, step) in enumerate(zip(meshes.NOTCHED, walls, strict=True)):
        off = (middle[:, 0] - begin[0]) * step[1] - (middle[:, 1] - begin[1]) * step[0]
        along = ((middle[:, :2] - begin) * step).sum(axis=1) / (step**2).sum()
        result[(np.abs(off) < 1e-9) & (along > 0) & (along < 1)] = 2 + i
    result[middle[:, 2] == 0.0], result[middle[:, 2] == HEIGHT] = 0, 1
    return result


@pytest.mark.parametrize("hidden", [None, 0, 4])
def test_exact_feet_are_those_of_the_part_and_the_rest_states_its_bound(hidden: int | None) -> None:
    surface = notched(hidden)
    truth = TriangleSurface(meshes.prism(meshes.NOTCHED, HEIGHT))
    points = np.random.default_rng(1).uniform((-1, -1, -1), (5, 4, 3), (3000, 3))
    found, wanted = surface.project(points), truth.project(points)
    exact = found.error_mm == 0.0
    assert 0.3 < exact.mean() < 0.9
    assert np.abs(found.distance_mm - wanted.distance_mm).max() < 1e-12  # of signs, too
    assert (np.isfinite(found.parameter[:, 0]) == exact).all()
    assert (found.error_mm[~exact] == BOUND_MM).all()
    assert not (found.kind == FootKind.BORDER).any()
    assert np.abs(found.foot_mm[exact] - wanted.foot_mm[exact]).max() < 1e-12
    inner = surface.project([(2.5, 0.5, 2.3), (2.5, 2.0, 2.5), (3.9, 0.5, 1.5)])  # over the cap, over its notch, within a wall
    assert inner.distance_mm == pytest.approx([0.3, 1.25**0.5, -0.1], abs=1e-12)
    if hidden is None:
        assert inner.error_mm.tolist() == [0.0, BOUND_MM, 0.0]
        assert inner.face[0] == 1


def test_no_bit_depends_on_the_batch_and_what_is_not_finite_has_no_foot() -> None:
    surface = notched()
    points = np.random.default_rng(2).uniform((-1, -1, -1), (5, 4, 3), (200, 3))
    points[7] = np.nan
    together = surface.project(points)
    apart = [surface.project(part) for part in (points[:8], points[8:99], points[99:])]
    for name in ("foot_mm", "distance_mm", "normal", "face", "parameter", "kind", "error_mm"):
        assert np.array_equal(getattr(together, name), np.concatenate([getattr(each, name) for each in apart]), equal_nan=True)
    assert together.kind[7] == FootKind.NONE
    assert (surface.is_closed, len(surface), surface.nominal_error_mm) == (True, 8, BOUND_MM)


@pytest.mark.parametrize("hidden", [None, 1])
def test_places_are_spread_evenly_within_loops(hidden: int | None) -> None:
    surface = notched(hidden)
    places, normals = surface.sample(3000)
    assert 3000 <= len(places) < 3300
    truth = TriangleSurface(meshes.prism(meshes.NOTCHED, HEIGHT))
    assert np.abs(truth.project(places).distance_mm).max() < 1e-12
    assert (truth.project(places + 1e-3 * normals).distance_mm > 5e-4).all()
    spacing = np.sqrt(surface.area_mm2 / len(places))
    everywhere, _ = truth.sample(9000)
    assert np.max(cKDTree(places).query(everywhere)[0]) < 1.8 * spacing


def test_a_loop_knows_what_lies_inside_it_by_more_than_it_may_be_off() -> None:
    angle = np.linspace(0, 2 * np.pi, 500, endpoint=False)
    circle = np.column_stack([np.cos(angle), np.sin(angle)])
    hole = 0.3 * circle + np.array([0.2, 0.1])
    loop = trim_loop(np.concatenate([loop_in_plane(circle, 0.0), loop_in_plane(hole, 0.0)[::-1]]), 0.01)
    at = np.random.default_rng(3).uniform(-1, 1, (20_000, 2))
    held = loop.holds(at, np.column_stack([at, np.zeros(len(at))]))
    inward = np.minimum(1 - np.hypot(*at.T), np.hypot(*(at - (0.2, 0.1)).T) - 0.3)
    sagitta = 1 - np.cos(np.pi / 500)
    assert held[inward > 0.01 + sagitta].all()
    assert not held[inward < 0.01 - sagitta].any()


def test_a_face_without_area_is_left_out_with_its_number() -> None:
    triangles = meshes.prism(meshes.NOTCHED, HEIGHT)
    flat = np.repeat(triangles[:1, :1], 3, axis=1)
    wall = TrimmedFace(faces.plane(np.array([0.0, 0, 0]), np.array([4.0, 0, 0]), np.array([0, 0, HEIGHT])))
    made = [*[None] * 5, wall, *[None] * 3]
    surface = TrimmedSurface(made, np.concatenate([triangles, flat]), np.append(owners(triangles), 8), BOUND_MM)
    assert surface.notes[-1] == "faces without area were left out: 9"
    assert surface.project([(2.0, 0.2, 1.0)]).error_mm.tolist() == [0.0]


def test_faces_that_are_no_splines_alone_are_refused() -> None:
    triangles = meshes.prism(meshes.NOTCHED, HEIGHT)
    with pytest.raises(NominalError, match="no face is an exact spline"):
        TrimmedSurface([None], triangles, np.zeros(len(triangles)), 0.1)
