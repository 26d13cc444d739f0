"""Loose triangles to a surface: shared corners, agreeing sides, borders."""

import numpy as np
import pytest

from inspection import NominalError
from inspection.surface import TriangleSurface
from inspection.surface.welding import NOTHING, weld
from tests.inspection.surface import meshes


def test_a_closed_mesh_has_no_border_and_every_side_has_a_neighbour() -> None:
    welded = weld(meshes.prism(meshes.NOTCHED, 2.0))
    assert len(welded.corners_mm) == 12
    assert (welded.beyond != NOTHING).all()
    assert not welded.is_open.any()
    assert welded.notes == ()
    for triangle, around in enumerate(welded.beyond):
        assert all(triangle in welded.beyond[other] for other in around)


def test_corners_that_an_export_rounded_apart_are_made_one() -> None:
    loose = meshes.sphere(10)
    rounded = loose + np.random.default_rng(1).uniform(-2e-6, 2e-6, loose.shape)
    welded = weld(rounded)
    assert not welded.is_open.any()
    assert "made one" in welded.notes[0]
    far = weld(loose + np.random.default_rng(1).uniform(-2e-3, 2e-3, loose.shape))
    assert far.is_open.all()  # farther apart than a millionth of the size: nothing is guessed


def test_triangles_that_face_the_other_way_are_turned_and_that_is_told() -> None:
    loose = meshes.prism(meshes.NOTCHED, 2.0)
    mixed = loose.copy()
    mixed[[3, 7, 11]] = mixed[[3, 7, 11], ::-1]
    points = np.random.default_rng(2).uniform((-1, -1, -1), (5, 4, 3), (2000, 3))
    inside = meshes.is_inside_notched(points, 2.0)
    for triangles, word in ((mixed, "3 triangles were turned over"), (loose[:, ::-1], "faced inwards")):
        surface = TriangleSurface(triangles)
        assert any(word in note for note in surface.notes)
        assert ((surface.project(points).distance_mm < 0) == inside).all()


def test_a_surface_of_one_side_is_refused_with_its_place() -> None:
    u = np.linspace(0, 2 * np.pi, 25)
    band = np.stack(
        [np.column_stack([(20 + w * np.cos(u / 2)) * np.cos(u), (20 + w * np.cos(u / 2)) * np.sin(u), w * np.sin(u / 2)]) for w in (-3, 3)]
    )
    with pytest.raises(NominalError, match=r"no two sides.* agree near \("):
        weld(meshes.triangles_of_grid(band))


def test_edges_of_three_triangles_are_told_and_their_corners_are_borders() -> None:
    fan = np.array([[(0, 0, 0), (0, 0, 5), end] for end in ((3.0, 0, 0), (-1, 2, 0), (-1, -2, 0))])
    welded = weld(fan)
    assert "1 edges belong to more than two triangles" in welded.notes[0]
    assert welded.is_open.all()
    assert (welded.beyond == NOTHING).all()


def test_triangles_without_area_are_left_out_and_the_numbers_of_the_others_stay() -> None:
    loose = np.insert(meshes.prism(meshes.NOTCHED, 2.0), 4, np.array([(0, 0, 0), (1, 1, 1), (2, 2, 2)]), axis=0)
    welded = weld(loose)
    assert "1 triangles without area" in welded.notes[0]
    assert 4 not in welded.given
    surface = TriangleSurface(loose)
    feet = surface.project(loose[10].mean(axis=0)[None])
    assert feet.face.tolist() == [10]
