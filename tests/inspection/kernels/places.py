"""Places in every relation to a curve, and the grids of curves by name."""

from functools import cache

import numpy as np

from inspection import NurbsCurve
from inspection.foot_grid import FootGrid, build_foot_grid
from tests.inspection import profiles
from tests.inspection.profiles import Array, curve_of


@cache
def grid_of(name: str) -> FootGrid:
    return build_foot_grid(curve_of(name))


def scattered(curve: NurbsCurve, rng: np.random.Generator, count: int) -> Array:
    """Points on the curve, near it, in its band, at its ends or trailing edge, and anywhere."""
    first, last = curve.domain
    u = rng.uniform(first, last, 3 * count)
    offset = np.concatenate([np.zeros(count // 4), rng.normal(0, 0.05, count), rng.uniform(-1, 1, 2 * count - count // 4)])
    near_ends = np.concatenate(
        [first + 0.05 * (last - first) * rng.uniform(0, 1, count) ** 3, last - 0.05 * (last - first) * rng.uniform(0, 1, count) ** 3]
    )
    box = curve.point(np.linspace(first, last, 300))
    return np.vstack(
        [
            profiles.offset_points(curve, u, offset),
            profiles.offset_points(curve, near_ends, rng.normal(0, 0.2, 2 * count)),
            curve.point(np.array([first, last])).repeat(count // 4, axis=0) + rng.normal(0, 0.3, (2 * (count // 4), 2)),
            rng.uniform(box.min(axis=0) - 15, box.max(axis=0) + 15, (count, 2)),
            box[0] + rng.normal(0, 1000.0, (3, 2)),
        ]
    )
