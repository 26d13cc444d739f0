"""The cut of a plane and a surface, and points that are brought into it."""

import numpy as np
import pytest

from inspection import NominalError
from inspection.surface.section_course import course_of_section, into_plane
from inspection.surface.triangles import TriangleSurface
from tests.cmmlink.egg import egg_triangles
from tests.inspection.surface.test_ball_centres import CUBE

UP = np.array([0.0, 0.0, 1.0])
HEIGHT = np.array([0.0, 0.0, 4.0])


def test_the_cut_of_a_cube_is_a_square_with_its_material_on_the_left() -> None:
    course = course_of_section(TriangleSurface(CUBE), np.array([10.0, 3.0, 4.0]), UP, 1e-3)
    x, y, z = course.places_mm.T
    assert course.closed
    np.testing.assert_allclose(z, 4.0, atol=1e-9)
    assert (np.minimum(np.abs(x * (x - 10)), np.abs(y * (y - 10))) < 1e-8).all()
    assert np.linalg.norm(np.diff(course.places_mm, axis=0, append=course.places_mm[:1]), axis=1).sum() == pytest.approx(40.0, abs=0.01)
    assert course.error_mm < 2e-3
    area = (x * np.roll(y, -1) - np.roll(x, -1) * y).sum() / 2
    assert area == pytest.approx(100.0, abs=0.05)  # counterclockwise: what lies on the left is inside


def test_the_cut_of_an_open_sheet_ends_at_its_borders() -> None:
    corners = np.array([[0.0, 0.0, 0.0], [10.0, 0.0, 0.0], [10.0, 10.0, 8.0], [0.0, 10.0, 8.0]])
    course = course_of_section(TriangleSurface(corners[[[0, 1, 2], [0, 2, 3]]]), np.array([5.0, 5.0, 4.0]), UP, 1e-3)
    assert not course.closed
    np.testing.assert_allclose(course.places_mm[:, 1:], np.broadcast_to([5.0, 4.0], (len(course.places_mm), 2)), atol=1e-8)
    assert sorted(course.places_mm[[0, -1], 0].tolist()) == pytest.approx([0.0, 10.0], abs=0.02)


def test_every_place_of_an_oblique_cut_lies_on_the_surface_and_in_the_plane() -> None:
    egg, normal = TriangleSurface(egg_triangles()), np.array([2.0, 1.0, 2.0]) / 3.0
    course = course_of_section(egg, np.zeros(3), normal, 1e-3)
    assert course.closed
    assert np.abs(course.places_mm @ normal).max() < 1e-6
    assert np.abs(egg.project(course.places_mm).distance_mm).max() < 1e-7


def test_a_plane_that_misses_the_part_is_refused() -> None:
    with pytest.raises(NominalError, match="does not cut"):
        course_of_section(TriangleSurface(CUBE), np.array([0.0, 0.0, 40.0]), UP, 1e-3)


def test_points_keep_their_deviation_on_the_way_into_the_plane() -> None:
    slope = np.array([[-50.0, -50.0, -40.0], [50.0, -50.0, -40.0], [50.0, 50.0, 40.0], [-50.0, 50.0, 40.0]])
    sheet = TriangleSurface(slope[[[0, 1, 2], [0, 2, 3]]])
    rng = np.random.default_rng(7)
    along, deviation = rng.uniform(-20.0, 20.0, (400, 2)), rng.normal(0.0, 0.05, 400)
    outward = np.array([0.0, -0.8, 1.0]) / np.hypot(0.8, 1.0)
    points = np.column_stack([along, 0.8 * along[:, 1]]) + deviation[:, None] * outward
    near = np.abs(points[:, 2] - 4.0) <= 0.5
    moved, error_mm = into_plane(points, sheet, HEIGHT, UP, 0.5)
    assert len(moved) == near.sum() > 5
    np.testing.assert_allclose(moved[:, 2], 4.0, atol=1e-12)
    np.testing.assert_allclose(sheet.project(moved).distance_mm, deviation[near], atol=1e-12)
    np.testing.assert_allclose(moved[:, 0], points[near, 0], atol=1e-12)  # up the slope and no way aside
    assert error_mm < 1e-12


def test_where_the_surface_runs_along_the_plane_points_are_left_out() -> None:
    top = TriangleSurface(CUBE)
    points = np.array([[5.0, 5.0, 10.01], [10.01, 5.0, 9.9]])
    moved, _ = into_plane(points, top, np.array([0.0, 0.0, 10.0]), UP, 0.5)
    assert len(moved) == 0 or np.allclose(moved[:, 0], 10.01)
