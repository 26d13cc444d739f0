"""A walk along points in steps of a least length."""

import numpy as np

from inspection.kernels import strides
from tests.inspection.profiles import Array


def walked(points: Array, step: float) -> list[int]:
    """The same in plain Python."""
    picked = [0]
    for i in range(1, len(points)):
        if np.hypot(*(points[i] - points[picked[-1]])) >= step:
            picked.append(i)
    return picked


def test_points_are_picked_a_step_apart() -> None:
    line = np.column_stack([np.arange(11.0), np.zeros(11)])
    assert strides(line, 3.0).tolist() == [0, 3, 6, 9]
    assert strides(line, 100.0).tolist() == [0]
    assert strides(line[:1], 1.0).tolist() == [0]
    random = np.random.default_rng(5).normal(0, 1, (500, 2)).cumsum(axis=0)
    assert strides(random, 4.0).tolist() == walked(random, 4.0)
