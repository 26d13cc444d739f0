"""The paper's methods, compiled, against the same in plain numpy."""

from collections.abc import Callable

import numpy as np
import pytest

from inspection import NominalProfile, discretize
from inspection.kernels import SAMPLE_METHODS, Feet, project, project_on_samples
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
        points = scattered(curve_of(name), np.random.default_rng(42), 150)
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
