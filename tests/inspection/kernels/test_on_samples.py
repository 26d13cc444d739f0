"""The paper's methods, compiled, against the same in plain numpy."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from inspection import NominalProfile, discretize
from inspection.kernels import SAMPLE_METHODS, Feet, project, project_on_samples
from inspection.kernels.layout import CELL_LEFT, CELL_RIGHT, CELL_WIDTH, LEFT_POLE_X
from inspection.sample_table import SampleTable
from tests.inspection import profiles
from tests.inspection import projections_reference as reference
from tests.inspection.kernels.places import grid_of, scattered
from tests.inspection.profiles import Array, curve_of

FIELDS = Feet._fields


@pytest.mark.parametrize("method", SAMPLE_METHODS)
@pytest.mark.parametrize("name", ["P1", "P2", "P3", "ellipse", "stadium", "square", "NACA 2412 sharp", "NACA 4412 blunt", "MH42"])
def test_compiled_method_is_the_plain_one(name: str, method: str) -> None:
    plain: dict[str, Callable[[Array, NominalProfile], Feet]] = {
        "circle": reference.circle,
        "chord": reference.chord,
        "pcp": reference.pcp,
        "veaw": reference.veaw,
    }
    for samples in (60, 1000):
        nominal = discretize(curve_of(name), samples=samples, step_min=0.9 / samples, pole_angle_min_deg=90.0)
        points = scattered(curve_of(name), np.random.default_rng(42), 50)
        wanted = plain[method](points, nominal)
        found = project_on_samples(points, grid_of(name), nominal.sample_table, method)
        for field in FIELDS:
            assert np.abs(getattr(found, field) - getattr(wanted, field)).max() < 1e-11, (samples, field)
        assert np.array_equal(found.vertex, wanted.vertex)


@pytest.mark.parametrize("method", SAMPLE_METHODS)
def test_no_bit_of_a_compiled_method_depends_on_the_batch(method: str) -> None:
    table = discretize(curve_of("P3"), samples=500, step_min=1e-3).sample_table
    points = scattered(curve_of("P3"), np.random.default_rng(43), 400)
    whole = project_on_samples(points, grid_of("P3"), table, method)
    cut = [project_on_samples(part, grid_of("P3"), table, method) for part in np.array_split(points, 37)]
    many = project_on_samples(np.vstack([points] * 20), grid_of("P3"), table, method, threads=2)
    for field in FIELDS:
        wanted = getattr(whole, field)
        assert np.array_equal(np.concatenate([getattr(part, field) for part in cut]), wanted), field
        assert np.array_equal(getattr(many, field), np.concatenate([wanted] * 20)), field


@pytest.mark.parametrize("method", SAMPLE_METHODS)
@pytest.mark.parametrize("name", ["P1", "P3", "stadium", "square", "NACA 2412 sharp", "MH42"])
def test_points_worked_on_together_get_the_bits_that_each_gets_alone(name: str, method: str) -> None:
    nominal = discretize(curve_of(name), samples=700, step_min=1e-3)
    table = nominal.sample_table
    proof = np.arange(CELL_WIDTH) >= CELL_LEFT
    never = replace(table, cells=np.where(proof, -np.inf, table.cells))  # proves nothing: every point goes alone
    rng = np.random.default_rng(44)
    points = np.vstack([scattered(curve_of(name), rng, 200), table.samples[:, LEFT_POLE_X : LEFT_POLE_X + 2]])
    nearest, next_to_it = np.asarray(nominal.tree.query(points, k=2)[0]).T
    points = np.vstack([points[next_to_it > nearest * (1 + 1e-9)], [[np.nan, 0.0], [0.0, np.inf]]])  # of equally near ones either will do
    alone, together = (project_on_samples(points, grid_of(name), each, method) for each in (never, table))
    for field in FIELDS:
        assert np.array_equal(getattr(alone, field), getattr(together, field), equal_nan=True), field
    proven = cells_hold(table, points[: len(points) - 2])
    assert proven.mean() > 0.5


def cells_hold(table: SampleTable, points: Array) -> NDArray[np.bool_]:
    """Whether the numbers of its cell prove the nearest sample of each point, which is looked for among all."""
    site = np.hypot(*(points[:, None] - table.cells[:, :CELL_LEFT]).transpose(2, 0, 1)).argmin(axis=1)
    x, y = (points - table.cells[site, :CELL_LEFT]).T
    sides = [table.cells[site, column : column + 3].T for column in (CELL_LEFT, CELL_RIGHT)]
    return np.asarray(np.all([a * y - b * x < c for a, b, c in sides], axis=0))


def test_veaw_at_the_ends_of_voronoi_edges_gives_a_distance_between_the_curve_and_the_nearest_sample() -> None:
    # at an end the two angles may be nothing and the two directions opposite; several ends are poles: centres of pole circles
    square = discretize(profiles.square(40.0), samples=400, step_min=0.5)
    ends = np.vstack([square.poles.edge_left_mm, square.poles.edge_right_mm])
    ends = ends[np.isfinite(ends).all(axis=1)]
    assert len(ends) == 800
    feet = project_on_samples(ends, square.grid, square.sample_table, "veaw")
    for field in FIELDS:
        assert np.isfinite(getattr(feet, field)).all(), field
    distance, half_step = np.abs(feet.distance_mm), 160.0 / 400 / 2
    assert (distance <= square.tree.query(ends)[0] + 1e-12).all()
    assert (distance >= np.abs(project(ends, square.grid).distance_mm) - half_step).all()
    assert np.abs(feet.foot_mm + feet.distance_mm[:, None] * feet.gradient - ends).max() < 1e-12 * np.abs(ends).max()
