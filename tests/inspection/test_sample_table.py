"""The packed samples: every column where the layout says, starts near their parameters, boxes around their samples."""

import numpy as np
import pytest

from inspection.kernels import layout
from tests.inspection.profiles import nominal_of


@pytest.mark.parametrize("name", ["P1", "P3", "square", "NACA 2412 sharp"])
def test_samples_stand_where_the_layout_says(name: str) -> None:
    nominal = nominal_of(name, 500)
    table, poles = nominal.sample_table, nominal.poles
    assert table.samples.shape == (len(nominal), layout.SAMPLE_WIDTH)
    assert table.links.shape == (len(nominal), layout.LINK_WIDTH)
    pairs = {
        layout.SAMPLE_X: nominal.points_mm,
        layout.TANGENT_X: nominal.tangent,
        layout.NORMAL_X: nominal.normal,
        layout.LEFT_POLE_X: poles.left,
        layout.RIGHT_POLE_X: poles.right,
        layout.LEFT_EDGE_X: poles.edge_left_mm,
        layout.RIGHT_EDGE_X: poles.edge_right_mm,
    }
    single = {
        layout.SAMPLE_CURVATURE: nominal.curvature,
        layout.SAMPLE_U: nominal.parameter,
        layout.SAMPLE_STATION: nominal.station_mm,
        layout.SAMPLE_SPEED: nominal.speed,
        layout.LEFT_POLE_CURVATURE: poles.left_curvature,
        layout.RIGHT_POLE_CURVATURE: poles.right_curvature,
    }
    assert 2 * len(pairs) + len(single) == layout.SAMPLE_COLUMNS
    for column, values in pairs.items():
        assert np.array_equal(table.samples[:, column : column + 2], values, equal_nan=True), column
    for column, values in single.items():
        assert np.array_equal(table.samples[:, column], values), column
    links = {
        layout.NEXT_SAMPLE: nominal.next_site,
        layout.PREVIOUS_SAMPLE: nominal.previous_site,
        layout.TWIN_SAMPLE: nominal.twin,
        layout.AT_OPEN_END: nominal.is_open_end,
    }
    for column, link in links.items():
        assert np.array_equal(table.links[:, column], link), column
    assert table.domain.tolist() == [*nominal.curve.domain, nominal.length_mm, float(nominal.curve.closed)]


@pytest.mark.parametrize("name", ["P1", "P3", "NACA 2412 sharp"])
def test_starts_are_near_their_parameters_and_leaves_hold_their_samples(name: str) -> None:
    nominal = nominal_of(name, 500)
    table = nominal.sample_table
    start, end = nominal.curve.domain
    middles = start + (np.arange(len(table.starts)) + 0.5) / len(table.starts) * (end - start)
    assert np.abs(nominal.parameter[table.starts] - middles).max() <= 1.5 / 500 * (end - start)
    leaves = len(table.boxes) // 2
    for first in range(0, len(nominal), layout.LEAF):
        held = nominal.points_mm[first : first + layout.LEAF]
        assert table.boxes[leaves + first // layout.LEAF].tolist() == [*held.min(axis=0), *held.max(axis=0)]


def test_tables_cannot_be_changed() -> None:
    table = nominal_of("P3", 500).sample_table
    for array in (table.samples, table.links, table.boxes, table.starts, table.domain):
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0


@pytest.mark.parametrize("name", ["P1", "P3", "square", "NACA 2412 sharp", "MH42"])
def test_what_a_cell_proves_is_the_nearest_of_all_samples(name: str) -> None:
    nominal, rng = nominal_of(name, 300), np.random.default_rng(9)
    cells = nominal.sample_table.cells
    low, high = nominal.points_mm.min(axis=0) - 5.0, nominal.points_mm.max(axis=0) + 5.0
    points = np.vstack([rng.uniform(low, high, (2000, 2)), nominal.points_mm.repeat(3, axis=0) + rng.normal(0, 0.5, (3 * len(nominal), 2))])
    distance = np.hypot(*(points[:, None] - nominal.points_mm).transpose(2, 0, 1))
    x, y = (points[:, None] - cells[:, :2]).transpose(2, 0, 1)
    proven = np.ones(distance.shape, dtype=bool)
    for a, b, c in (cells[:, layout.CELL_LEFT :][:, :3].T, cells[:, layout.CELL_RIGHT :][:, :3].T):
        proven &= a * y - b * x < c
    for link in (nominal.next_site, nominal.previous_site):
        proven &= distance <= np.where(link >= 0, distance[:, link], np.inf)
    row, site = np.nonzero(proven)
    assert np.array_equal(distance[row, site], distance[row].min(axis=1))
    assert len(row) > 0.3 * len(points)
    assert np.isneginf(cells[(nominal.next_site < 0) | (nominal.previous_site < 0) | (nominal.twin >= 0), layout.CELL_LEFT + 2]).all()


def test_rows_lie_in_whole_cache_lines() -> None:
    table = nominal_of("P1", 500).sample_table
    for rows in (table.samples, table.cells, table.flat[0], table.flat[5]):
        assert rows.ctypes.data % 64 == 0
    assert table.samples.strides[0] % 64 == table.cells.strides[0] % 64 == 0
