"""Closest points of spline faces: those of Open CASCADE and of closed forms, on the right side, whatever the batch."""

import json
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from inspection import NominalError, Rejection
from inspection.surface import FootKind, PatchSurface, SplineFace, rejections
from tests.inspection.surface import faces

Array = NDArray[np.float64]
ROOT = Path(__file__).resolve().parents[3]


def beside(surface: PatchSurface, count: int, seed: int, reach: float = 1.0) -> Array:
    """Places beside a surface, up to so far on either side."""
    places, normals = surface.sample(count)
    return np.asarray(places + np.random.default_rng(seed).uniform(-reach, reach, len(places))[:, None] * normals)


@pytest.mark.skipif(find_spec("OCP") is None, reason="Open CASCADE is not installed: it comes with cmmlink[cad]")
def test_distances_are_those_of_open_cascade_to_a_picometre(tmp_path: Path) -> None:
    """200 places beside each of a blade, a mould and a rational cylinder within 1e-9 mm; 6 of each also against the face with its border.

    Where Open CASCADE finds a foot that is farther, as of 2 in 500 places in the blade, ours must lie on the face: it is the closer one.
    """
    shapes = {"blade": faces.blade(), "mould": faces.mould(), "cylinder": faces.cylinder()}
    asked, ours = [], []
    for seed, (name, face) in enumerate(shapes.items()):
        surface = PatchSurface([face])
        points = np.random.default_rng(seed).permutation(beside(surface, 200, seed))
        asked.append(tmp_path / f"{name}.npz")
        weights = np.ones(face.control_points_mm.shape[:2]) if face.weights is None else face.weights
        np.savez(
            asked[-1],
            degree=face.degree,
            knots_u=face.knots_u,
            knots_v=face.knots_v,
            control_points=face.control_points_mm,
            weights=weights,
            points=points,
            whole=6,
        )
        ours.append(surface.project(points))
    out = subprocess.run(
        [sys.executable, "-m", "tests.inspection.surface.occt_surfaces", *map(str, asked)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    for face, feet, theirs in zip(shapes.values(), ours, json.loads(out.stdout), strict=True):
        distance, inner = np.abs(feet.distance_mm), feet.kind == FootKind.FACE
        assert inner.mean() > 0.95
        apart = np.where(inner, distance - theirs["inside"], 0.0)
        assert apart.max() < 1e-9
        closer = np.flatnonzero(apart < -1e-9)
        assert len(closer) <= 2
        for i in closer:
            u, v = feet.parameter[i]
            assert np.abs(face.on_grid(np.array([u]), np.array([v]), 0)[0, 0, 0, 0] - feet.foot_mm[i]).max() < 1e-10
        assert np.abs(distance[:6] - theirs["whole"]).max() < 1e-9


def test_distances_from_a_cylinder_are_those_of_its_closed_form_even_from_its_axis() -> None:
    surface = PatchSurface([faces.cylinder(30.0, 80.0)])
    rng = np.random.default_rng(3)
    angle, radius, z = rng.uniform(0, 2 * np.pi, 400), rng.uniform(0.01, 45, 400), rng.uniform(1, 79, 400)
    radius[0] = 0.0
    feet = surface.project(np.column_stack([radius * np.cos(angle), radius * np.sin(angle), z]))
    assert np.abs(feet.distance_mm - (radius - 30)).max() < 1e-10
    assert not np.isin(feet.kind, [FootKind.BORDER, FootKind.CORNER]).any()
    assert surface.area_mm2 == pytest.approx(2 * np.pi * 30 * 80, rel=1e-9)


def test_a_sphere_is_closed_and_right_at_its_poles() -> None:
    surface = PatchSurface([faces.sphere(20.0)])
    assert surface.is_closed
    direction = np.random.default_rng(4).normal(size=(300, 3))
    direction[:6] = [(0, 0, 1), (0, 0, -1), (1e-9, 0, 1), (1e-4, 1e-5, -1), (1, 0, 0), (0, -1, 0)]
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    radius = np.random.default_rng(5).uniform(14, 26, 300)
    feet = surface.project(direction * radius[:, None])
    assert np.abs(feet.distance_mm - (radius - 20)).max() < 1e-10
    assert np.abs(feet.normal - direction).max() < 1e-5
    assert (rejections(feet, 10.0) == Rejection.NONE).all()


@pytest.mark.parametrize("inside_out", [False, True])
def test_no_sign_is_wrong_beside_the_edges_and_corners_of_a_box(inside_out: bool) -> None:
    given = faces.box()
    if inside_out:
        given = [SplineFace(f.degree, f.control_points_mm, f.knots_u, f.knots_v, reversed=i != 2) for i, f in enumerate(given)]
    surface = PatchSurface(given)
    assert surface.is_closed
    assert len(surface.notes) == (2 if inside_out else 0)
    size = np.array([4.0, 3.0, 2.0])
    points = np.random.default_rng(6).uniform(-1.5, size + 1.5, (20_000, 3))
    feet = surface.project(points)
    outside = np.maximum(np.maximum(-points, points - size), 0)
    depth = np.minimum(points, size - points).min(axis=1)
    wanted = np.where(depth > 0, -depth, np.linalg.norm(outside, axis=1))
    assert np.abs(feet.distance_mm - wanted).max() < 1e-12
    beyond = (outside > 0).sum(axis=1)
    for count, kind in ((1, FootKind.FACE), (2, FootKind.EDGE), (3, FootKind.CORNER)):
        assert (feet.kind[beyond == count] == kind).all()


def test_what_lies_beyond_the_border_of_an_open_surface_is_told_and_nothing_else() -> None:
    surface = PatchSurface([faces.mould()])
    places, normals = surface.sample(3000)
    inside = surface.project(places + 0.8 * normals)
    far = np.minimum(places[:, :2], 120 - places[:, :2]).min(axis=1) > 1.5
    assert (rejections(inside, 10.0)[far] == Rejection.NONE).all()
    assert not surface.is_closed
    outside = surface.project([(-0.5, 50, 0), (60, 121, 3), (-1, -1, 0), (np.nan, 0, 0)])
    assert rejections(outside, 100.0).tolist() == [Rejection.BEYOND_EDGE] * 3 + [Rejection.NOT_FINITE]


def test_two_faces_that_adjoin_have_no_border_between_them() -> None:
    o, x, y = np.zeros(3), np.array([5.0, 0, 0]), np.array([0, 5.0, 0])
    surface = PatchSurface([faces.plane(o, x, y), faces.plane(x, x, y)])
    feet = surface.project([(5, 2.5, 1.0), (5, 2.5, -1.0), (5.0 + 1e-9, 2, 0.2), (10.3, 2, 0.1)])
    assert np.abs(feet.distance_mm[:3] - [1, -1, 0.2]).max() < 1e-12
    assert (rejections(feet, 5.0) == [Rejection.NONE] * 3 + [Rejection.BEYOND_EDGE]).all()
    gap = PatchSurface([faces.plane(o, x, y), faces.plane(x + 0.002 * x, x, y)])
    assert gap.project([(5.002, 2.5, 1.0)]).kind.tolist() == [FootKind.BORDER]


def test_no_bit_depends_on_batch_order_or_threads() -> None:
    surface = PatchSurface([faces.cylinder(3.0, 8.0)])
    points = beside(surface, 600, 8, 2.0)
    points[:4] = np.column_stack([np.zeros(4), np.zeros(4), np.linspace(-1, 9, 4)])  # the axis: a whole circle is equally near
    points[50] = np.nan
    whole = surface.project(points, threads=1)
    order = np.random.default_rng(9).permutation(len(points))
    parts = [surface.project(part, threads=2) for part in np.split(points[order], [1, 20, 333, 500])]
    for name in ("foot_mm", "distance_mm", "normal", "face", "parameter", "kind"):
        assert np.array_equal(np.concatenate([getattr(part, name) for part in parts]), getattr(whole, name)[order], equal_nan=True)


def test_feet_lie_where_their_parameters_say_and_normals_point_to_where_the_deviation_grows() -> None:
    face = faces.blade()
    surface = PatchSurface([face])
    points = beside(surface, 300, 10)
    feet = surface.project(points)
    for i in range(0, len(points), 37):
        u, v = feet.parameter[i]
        assert np.abs(face.on_grid(np.array([u]), np.array([v]), 0)[0, 0, 0, 0] - feet.foot_mm[i]).max() < 1e-10
    inner = feet.kind == FootKind.FACE
    assert np.abs(feet.foot_mm + feet.distance_mm[:, None] * feet.normal - points)[inner].max() < 1e-8
    assert np.abs(np.linalg.norm(feet.normal, axis=1) - 1).max() < 1e-12


def test_a_crease_within_a_face_is_an_edge() -> None:
    """A roof of one face: its ridge is a knot of full multiplicity."""
    line = np.array([(0.0, 0, 0), (2, 0, 1), (4, 0, 0)])
    grid = np.stack([line, line + np.array([0, 6, 0])], axis=1)
    surface = PatchSurface([SplineFace((1, 1), grid, np.array([0.0, 0, 1, 2, 2]), np.array([0.0, 0, 1, 1]))])
    feet = surface.project([(2, 3, 2.0), (2, 3, 0.9), (1, 3, 1.5)])
    assert feet.kind.tolist() == [FootKind.EDGE, FootKind.FACE, FootKind.FACE]
    assert feet.distance_mm.tolist() == pytest.approx([1.0, -0.1 * 2 / np.sqrt(5), 2 / np.sqrt(5)], abs=1e-12)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"degree": (3, 0)}, "do not fit together"),
        ({"knots_u": np.zeros(5)}, "do not fit together"),
        ({"knots_u": np.array([0.0, 0, 0, 0])}, "must span a length"),
        ({"weights": -np.ones((2, 2))}, "weights must be positive"),
        ({"control_points_mm": np.full((2, 2, 3), np.nan)}, "must be finite"),
    ],
)
def test_what_is_no_face_is_refused(change: dict[str, object], words: str) -> None:
    good = faces.plane(np.zeros(3), np.eye(3)[0], np.eye(3)[1], "lid")
    given = {name: getattr(good, name) for name in ("degree", "control_points_mm", "knots_u", "knots_v", "weights", "reversed", "name")}
    with pytest.raises(NominalError, match=f"face lid.*{words}"):
        SplineFace(**(given | change))
    with pytest.raises(NominalError, match="no face"):
        PatchSurface([])


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("along_mm", [(0.0, 1.0, 5.0, 100.0), (0.0, 100.0)])
def test_places_are_even_by_area_on_long_thin_pieces(along_mm: tuple[float, ...], turned: bool) -> None:
    """Of a strip of 100 by 1 mm that may run slowly at first: in each of its parts as many as chance allows."""
    n, ends = len(along_mm), np.array([0.0, 0.0, 1.0, 1.0])
    knots = np.concatenate([np.zeros(n), np.ones(n)])
    grid = np.stack([*np.meshgrid(along_mm, [0.0, 1.0], indexing="ij"), np.zeros((n, 2))], axis=2)
    whole = SplineFace((n - 1, 1), grid, knots, ends)
    other = SplineFace((1, n - 1), np.ascontiguousarray(grid.transpose(1, 0, 2)), ends, knots)
    places, _ = PatchSurface([other if turned else whole]).sample(4000)
    for axis, longest in ((0, 100.0), (1, 1.0)):
        counts, _ = np.histogram(places[:, axis], bins=20, range=(0.0, longest))
        assert counts.sum() == len(places) == 4000
        assert ((counts - 200.0) ** 2 / 200.0).sum() < 36.2  # chi-squared of 19 freedoms, 99 %
