"""Centres of a probe's ball against the nominal that the ball touched."""

import numpy as np
import pytest

from inspection import NominalError
from inspection.surface.ball_centres import BallCentres
from inspection.surface.cloud_surface import CloudSurface
from inspection.surface.triangles import TriangleSurface

RADIUS_MM = 0.75
CORNERS = np.array([[x, y, z] for x in (0.0, 10.0) for y in (0.0, 10.0) for z in (0.0, 10.0)])
QUADS = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
CUBE = np.array([CORNERS[[quad[0], *pair]] for quad in QUADS for pair in (quad[1:3], quad[2:4])])


def test_a_ball_that_touches_a_face_an_edge_or_a_corner_deviates_by_nothing() -> None:
    cube = BallCentres(TriangleSurface(CUBE), RADIUS_MM)
    along = RADIUS_MM / np.sqrt(2), RADIUS_MM / np.sqrt(3)
    face, edge, corner = [4.0, 3.0, 10.0 + RADIUS_MM], [10.0 + along[0], 5.0, 10.0 + along[0]], [-along[1], -along[1], 10.0 + along[1]]
    feet = cube.project([face, edge, corner, [4.0, 3.0, 10.0 + RADIUS_MM + 0.2], [4.0, 3.0, 10.0 + RADIUS_MM - 0.2]])
    np.testing.assert_allclose(feet.distance_mm, [0.0, 0.0, 0.0, 0.2, -0.2], atol=1e-12)
    np.testing.assert_allclose(feet.foot_mm[:3], [[4.0, 3.0, 10.0], [10.0, 5.0, 10.0], [0.0, 0.0, 10.0]], atol=1e-12)


def test_what_is_said_of_the_nominal_is_said_of_it() -> None:
    nominal = TriangleSurface(CUBE, 0.01)
    centres = BallCentres(nominal, RADIUS_MM)
    assert (centres.area_mm2, centres.size_mm, centres.nominal_error_mm) == (600.0, 10.0, 0.01)
    assert centres.notes == nominal.notes
    np.testing.assert_array_equal(centres.sample(100)[0], nominal.sample(100)[0])


def test_a_nominal_without_sides_is_refused() -> None:
    places = np.random.default_rng(1).normal(size=(400, 3))
    places /= np.linalg.norm(places, axis=1)[:, None]
    cloud = CloudSurface(10.0 * places)
    if cloud.sides_known:  # a closed cloud is turned outward by itself
        assert BallCentres(cloud, 0.5).sides_known
    sheet = np.column_stack([np.indices((20, 20)).reshape(2, -1).T, np.zeros(400)]).astype(np.float64)
    with pytest.raises(NominalError, match="sides are known"):
        BallCentres(CloudSurface(sheet), 0.5)
