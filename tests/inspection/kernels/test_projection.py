"""Feet turned outward while they are in the cache: against the feet themselves, over the borders of the chunks and on several threads."""

import os

import numpy as np
import pytest

from inspection import discretize
from inspection.kernels import AT_ONCE, Feet, project, project_on_samples, project_outward
from inspection.kernels.layout import INSIDE, OPEN_END
from tests.inspection.kernels.places import grid_of
from tests.inspection.profiles import Array, curve_of, nominal_of

FAR_MM = 1e6


def around(name: str, count: int) -> Array:
    """Points (count, 2) near a profile and around it, beyond its ends as well."""
    rng, curve = np.random.default_rng(count), curve_of(name)
    return np.asarray(curve.point(rng.uniform(*curve.domain, count)) + rng.normal(0, 2.0, (count, 2)))


def same(first: Feet, second: Feet) -> bool:
    return all(np.array_equal(getattr(first, field), getattr(second, field), equal_nan=True) for field in Feet._fields)


@pytest.mark.parametrize(("outward", "tip_mm"), [(1.0, 0.0), (-1.0, 0.0), (1.0, 0.7), (-1.0, 0.7)])
@pytest.mark.parametrize("count", [0, 1, AT_ONCE - 1, 2 * AT_ONCE + 1])
def test_feet_are_turned_outward_whatever_chunk_they_are_in(count: int, outward: float, tip_mm: float) -> None:
    points, grid = around("NACA 2412 sharp", count), grid_of("NACA 2412 sharp")
    feet = project(points, grid)
    turned = project_outward(points, grid, None, "exact", outward, tip_mm, FAR_MM)
    distance, gradient = outward * feet.distance_mm - tip_mm, outward * feet.gradient
    assert same(turned.feet, feet._replace(distance_mm=distance, gradient=gradient))
    assert np.array_equal(turned.beyond_end, feet.vertex == OPEN_END)
    assert np.array_equal(turned.at_vertex, feet.vertex != INSIDE)
    assert not turned.is_any_far


def test_several_threads_and_methods_on_samples_give_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    points, nominal = around("P1", 3 * AT_ONCE + 5), nominal_of("P1")
    asked = (points, nominal.grid, nominal.sample_table, "veaw")
    alone = project_outward(*asked, -1.0, 0.3, FAR_MM)
    feet = project_on_samples(*asked)
    assert same(alone.feet, feet._replace(distance_mm=-feet.distance_mm - 0.3, gradient=-feet.gradient))
    monkeypatch.setattr("inspection.kernels.feet._SHARED", 1)
    monkeypatch.setattr(os, "cpu_count", lambda: 3)
    shared = project_outward(*asked, -1.0, 0.3, FAR_MM)
    assert same(alone.feet, shared.feet)
    assert alone.beyond_end.any()
    assert np.array_equal(alone.beyond_end, shared.beyond_end)
    assert np.array_equal(alone.at_vertex, shared.at_vertex)


@pytest.mark.parametrize("row", [0, AT_ONCE - 1, AT_ONCE, 2 * AT_ONCE + 6])
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1.0001 * FAR_MM, -1.0001 * FAR_MM])
def test_a_coordinate_that_is_far_off_or_no_number_is_told_wherever_it_stands(row: int, value: float) -> None:
    points = around("P1", 2 * AT_ONCE + 7)
    points[row, row % 2] = value
    assert project_outward(points, grid_of("P1"), None, "exact", 1.0, 0.0, FAR_MM).is_any_far
    points[row, row % 2] = np.clip(np.nan_to_num(value), -FAR_MM, FAR_MM)
    assert not project_outward(points, grid_of("P1"), None, "exact", 1.0, 0.0, FAR_MM).is_any_far


def test_a_foot_at_the_seam_is_told_and_others_are_not() -> None:
    nominal = discretize(curve_of("P3"), samples=500)
    inner = nominal.curve.point(np.linspace(*nominal.curve.domain, AT_ONCE + 9)[1:-1])
    asked = (nominal.grid, None, "exact", 1.0, 0.0, FAR_MM)
    assert not project_outward(inner, *asked).is_any_first_or_last
    assert project_outward(np.vstack([inner, nominal.curve.point(nominal.curve.domain[:1])]), *asked).is_any_first_or_last
