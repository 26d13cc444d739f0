"""The shortest tree over points, against that of the full graph."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.sparse.csgraph import minimum_spanning_tree
from scipy.spatial.distance import cdist

from inspection.kernels import shortest_tree


def edges_of(parent: NDArray[np.int64]) -> set[tuple[int, int]]:
    return {(min(i, int(p)), max(i, int(p))) for i, p in enumerate(parent) if p >= 0}


@pytest.mark.parametrize("count", [1, 2, 3, 300])
def test_the_tree_is_the_shortest_one_and_parents_come_before_children(count: int) -> None:
    points = np.random.default_rng(count).normal(size=(count, 2))
    grown = shortest_tree(points)
    assert grown is not None
    whole = minimum_spanning_tree(cdist(points, points)).tocoo()
    assert edges_of(grown.parent) == {(min(i, j), max(i, j)) for i, j in zip(whole.row.tolist(), whole.col.tolist(), strict=True)}
    place = np.argsort(grown.joined)
    assert sorted(grown.joined.tolist()) == list(range(count))
    assert all(place[parent] < place[i] for i, parent in enumerate(grown.parent) if parent >= 0)


@pytest.mark.parametrize(
    "points",
    [
        [(0, 0), (1, 0), (0, 1), (1, 1)],  # any three sides of the square
        [(0, 0), (2, 0), (1, 1.5), (1, -1.5)],  # the third point is as far from the first as from the second
        [(0, 0), (3, 0), (1, 0), (1 + 2 * (1 + 1e-14), 0), (0, 5), (0, 5), (0, 9)],  # twice the same place
    ],
)
def test_where_another_tree_may_be_as_short_there_is_none(points: list[tuple[float, float]]) -> None:
    assert shortest_tree(np.array(points, dtype=float)) is None
