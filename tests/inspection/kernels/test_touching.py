"""Circles and samples in a compiled loop, against whole arrays of all pairs, to the last bit."""

import numpy as np

from inspection.kernels import nearest_squared, smallest_touching
from tests.inspection.profiles import Array


def by_arrays(places: Array, normals: Array, outline: Array) -> Array:
    """Radii (k, n) of the circles that touch each place and pass through each sample; infinite on the other side of the place."""
    dx, dy = outline[:, 0] - places[:, :1], outline[:, 1] - places[:, 1:]
    facing = normals[:, :1] * dx + normals[:, 1:] * dy
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(facing > 0, (dx * dx + dy * dy) / (2 * facing), np.inf)


def test_the_smallest_touching_circle_is_that_of_whole_arrays_ties_and_outlines_behind_included() -> None:
    rng = np.random.default_rng(1)
    places, outline = rng.normal(size=(40, 2)), rng.normal(size=(200, 2))
    angle = rng.uniform(0, 2 * np.pi, 40)
    normals = np.column_stack([np.cos(angle), np.sin(angle)])
    outline[100:] = outline[:100]  # of two that are as small, the first counts
    places[0] = outline[7]
    places[1], normals[1] = (50.0, 50.0), (1.0, 0.0)  # nothing lies on that side
    outline.setflags(write=False)
    radius = by_arrays(places, normals, outline)
    found = smallest_touching(places, normals, outline)
    np.testing.assert_array_equal(found, radius.argmin(axis=1))
    assert np.isinf(radius[1]).all()
    assert found[1] == 0
    assert (found < 100).all()


def test_the_nearest_sample_is_that_of_whole_arrays_and_of_a_place_that_is_no_number_it_is_none() -> None:
    rng = np.random.default_rng(2)
    places, outline = rng.normal(size=(40, 2)), rng.normal(size=(200, 2))
    places[3, 1] = np.nan
    outline.setflags(write=False)
    x, y = places[:, :1] - outline[:, 0], places[:, 1:] - outline[:, 1]
    np.testing.assert_array_equal(nearest_squared(places, outline), (x * x + y * y).min(axis=1))
