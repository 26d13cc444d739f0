"""What is odd about a nominal is said with the number of the face; nothing is said of what is in order."""

import numpy as np
import pytest

from inspection.surface import SingleFace, SplineFace, words_on_odd_faces, words_on_odd_triangles
from inspection.surface.odd_faces import cutting_pairs
from tests.inspection.surface import faces, meshes


def words(made: list[SplineFace]) -> tuple[str, ...]:
    return words_on_odd_faces([SingleFace.of_spline(face) for face in made])


def test_faces_that_lie_on_each_other_are_named_with_how_they_do() -> None:
    box = faces.box((4.0, 3.0, 2.0))
    x, y, z = np.diag((4.0, 3.0, 2.0))
    assert words(box) == ()
    assert words([*box, faces.plane(z, x, y)]) == ("faces 2, 7 lie on each other, and one of them stands twice",)
    turned = words([*box, faces.plane(z + x / 4 + y / 4, y / 2, x / 2)])  # within the second one, and facing down
    assert turned == ("faces 2, 7 lie on each other, and their outsides are opposite: the side of a point there is by lot",)
    by_triangles = [SingleFace.of_triangles(meshes.sphere(8)) for _ in range(2)]
    assert words_on_odd_faces(by_triangles)[0].startswith("faces 1, 2 lie on each other")
    assert words([faces.mould(), faces.blade(24, 4), faces.sphere()]) == ()


def test_a_sliver_is_named() -> None:
    x, y, z = np.diag((4.0, 3.0, 2.0))
    assert words([*faces.box(), faces.plane(3 * z, x, 1e-4 * y)]) == ("face 7 is a sliver, a thousand times as long as wide",)


@pytest.mark.parametrize("triangles", [meshes.sphere(20), meshes.prism(meshes.NOTCHED, 2.0), meshes.wave(20)])
def test_nothing_is_said_of_meshes_in_order(triangles: np.ndarray) -> None:
    assert words_on_odd_triangles(triangles) == ()


def test_surfaces_that_cut_themselves_are_named_with_the_place() -> None:
    one = meshes.sphere(16, 30.0)
    other = one + np.array([40.0, 0.3, 0.2])
    both = np.concatenate([one, other])
    (said,) = words_on_odd_triangles(both, np.repeat([4, 6], len(one)))
    assert said.startswith("the surface cuts through itself at ")
    assert "the first of faces 5, 7 near (" in said
    _, corners = np.unique(both.reshape(-1, 3), axis=0, return_inverse=True)
    pairs = cutting_pairs(both, corners.reshape(-1, 3))
    assert pairs is not None
    assert (pairs[0] < len(one)).all()
    assert (pairs[1] >= len(one)).all()
    middles = both[np.concatenate(pairs)].mean(axis=1)
    assert np.abs(middles[:, 0] - 20).max() < 6  # the circle in which both meet lies at x = 20
    assert np.abs(np.hypot(middles[:, 1], middles[:, 2]) - np.sqrt(900 - 400)).max() < 6


def test_triangles_that_stand_twice_are_named() -> None:
    mesh = meshes.wave(6)
    assert words_on_odd_triangles(np.concatenate([mesh, mesh[4:5, ::-1]])) == ("triangle 73 has the corners of another one",)
