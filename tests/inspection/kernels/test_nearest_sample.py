"""The nearest sample against a search through all of them."""

import numpy as np

from inspection import discretize
from inspection.kernels import project
from inspection.kernels.layout import STACK
from inspection.kernels.nearest_sample import nearest_sample
from tests.inspection import profiles


def test_the_nearest_sample_is_the_nearest_of_coarse_ones_as_well() -> None:
    rng = np.random.default_rng(1)
    for trial in range(25):
        curve = profiles.periodic(int(rng.integers(2, 5)), rng.normal(0, 30, (int(rng.integers(5, 14)), 2)))
        nominal = discretize(curve, samples=int(rng.integers(8, 40)), step_min=0.5)
        centre, size = nominal.points_mm.mean(axis=0), np.hypot(*np.ptp(nominal.points_mm, axis=0))
        points = centre + rng.uniform(-1, 1, (1500, 2)) * size
        table, u = nominal.sample_table, project(points, nominal.grid).parameter
        begin = np.clip((u - table.domain[0]) / (table.domain[1] - table.domain[0]) * len(table.starts), 0, len(table.starts) - 1)
        _, links, boxes, starts, _, cells, _ = table.flat
        stack = np.empty(STACK, dtype=np.int64)
        found = [
            nearest_sample(x, y, starts[k], cells, links, boxes, stack)
            for (x, y), k in zip(points.tolist(), begin.astype(int).tolist(), strict=True)
        ]
        distance = np.hypot(*(points - nominal.points_mm[found]).T)
        assert np.abs(distance - nominal.tree.query(points)[0]).max() < 1e-12 * size, trial
