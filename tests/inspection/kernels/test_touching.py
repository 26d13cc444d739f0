"""Circles and samples in a compiled loop, against whole arrays of all pairs, to the last bit."""

import numpy as np
import pytest

from inspection import NurbsCurve
from inspection.kernels import nearest_squared, settle_contacts, smallest_touching
from tests.inspection import profiles
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


def settled_by_arrays(curve: NurbsCurve, places: Array, normals: Array, v: Array, within: tuple[Array, Array], steps: int) -> Array:
    """Newton's steps over whole arrays."""

    def dot(one: Array, other: Array) -> Array:
        return one[:, 0] * other[:, 0] + one[:, 1] * other[:, 1]

    low, high = within
    for _ in range(steps):
        contact, first, second = curve.derivatives(v, 2)
        d = contact - places
        slope = 2 * dot(d, first) * dot(normals, d) - dot(d, d) * dot(normals, first)
        bend = 2 * (dot(first, first) + dot(d, second)) * dot(normals, d) - dot(d, d) * dot(normals, second)
        with np.errstate(divide="ignore", invalid="ignore"):
            step = np.where(bend > 0, -slope / bend, -np.sign(slope) * (high - low) / 4)
        stepped = np.minimum(np.maximum(v + step, low), high)
        moved, v = np.abs(stepped - v).max(), stepped
        if moved < 1e-14:
            break
    return v


@pytest.mark.parametrize("curve", [profiles.naca("2412", 60.0), profiles.naca("4412", 60.0, sharp=False), profiles.p3()])
@pytest.mark.parametrize("steps", [1, 12])
def test_contacts_settle_where_whole_arrays_let_them(curve: NurbsCurve, steps: int) -> None:
    """On open and closed curves, beyond the seam, where they are held at an end of their range, and of a place that is no number."""
    begin, end = curve.domain
    period = end - begin
    v = begin + np.linspace(0.55, 1.45 if curve.closed else 0.99, 60) * period
    _, along, _ = curve.derivatives(begin + np.linspace(0.45, 0.02, 60) * period, 2)
    places = curve.point(begin + np.linspace(0.45, 0.02, 60) * period)
    normals = np.column_stack([-along[:, 1], along[:, 0]]) / np.hypot(*along.T)[:, None]
    if curve.closed:
        places[5] = np.nan
    within = v - 0.01 * period, np.minimum(v + 0.01 * period, end if not curve.closed else np.inf)
    expected = settled_by_arrays(curve, places, normals, v, within, steps)
    np.testing.assert_array_equal(settle_contacts(curve.spline, curve.domain, places, normals, v, within, steps, 1e-14), expected)
