"""Points gone through in pieces: which take part, which few stand for many, and their exact median."""

from functools import partial

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from inspection.cloud import Cloud, few_of
from inspection.medians import median_place, value_of_rank


def cloud_of(count: int, seed: int = 0) -> tuple[Cloud, np.ndarray]:
    """A cloud with a third of its points left out, and the points that take part."""
    rng = np.random.default_rng(seed)
    points, left_out = rng.normal(size=(count, 2)), (rng.random(count) < 1 / 3).astype(np.uint8)
    return Cloud(points, left_out), points[left_out == 0]


@pytest.mark.parametrize("at_once", [3, 64, 10_000])
def test_pieces_together_are_the_points_that_take_part(at_once: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("inspection.cloud.ROWS_AT_ONCE", at_once)
    cloud, points = cloud_of(500)
    assert len(cloud) == len(points)
    assert np.array_equal(np.concatenate(list(cloud.blocks())), points)
    assert np.array_equal(cloud.few(), points)
    assert np.array_equal(cloud.corners(), [points.min(axis=0), points.max(axis=0)])
    marked = np.random.default_rng(1).random(len(points)) < 0.2
    assert np.array_equal(cloud.without(marked).few(), points[~marked])
    assert cloud.without(np.zeros(len(points), dtype=bool)) is cloud
    assert np.array_equal(cloud.few(40), few_of(lambda: [points], len(points), 40))


GRID = np.stack(np.meshgrid(np.arange(150) * 0.001, np.arange(200) * 0.5), axis=-1).reshape(-1, 2)
LINE = np.column_stack([np.arange(30_000.0), np.zeros(30_000)])


def in_place_order(points: np.ndarray) -> np.ndarray:
    """The points, or numbers, by their values."""
    return np.asarray(points[np.lexsort(points.reshape(len(points), -1).T)])


RANDOM = np.random.default_rng(2).normal(size=(30_000, 2))
DWELLING = np.where((np.arange(30_000) % 10 == 0)[:, None], RANDOM, RANDOM[7])  # nine of ten points at one place


@pytest.mark.parametrize("points", [GRID, LINE, RANDOM, DWELLING, RANDOM[:, 0]], ids=["grid", "line", "random", "dwelling", "one column"])
def test_few_of_many_do_not_depend_on_the_order_of_the_points_or_on_their_pieces(points: np.ndarray) -> None:
    few = few_of(lambda: [points], len(points), 1200)
    assert len(few) == 1200
    columns = points.reshape(len(points), -1).T
    mixed = points[np.random.default_rng(3).permutation(len(points))]
    for other in (points[::-1], mixed, points[np.lexsort(columns)]):
        for pieces in (1, 7):
            again = few_of(partial(np.array_split, other, pieces), len(points), 1200)
            assert np.array_equal(in_place_order(again), in_place_order(few))


@pytest.mark.parametrize("points", [GRID, LINE, RANDOM], ids=["grid", "line", "random"])
def test_few_of_many_are_spread_over_them_and_stay_in_their_order(points: np.ndarray) -> None:
    few = Cloud(points).few(1200)
    at = np.array([np.flatnonzero((points == point).all(axis=1))[0] for point in few[:40]])
    assert (np.diff(at) > 0).all()
    for axis in (0, 1):
        assert (few[:, axis] <= np.median(points[:, axis])).mean() == pytest.approx(
            (points[:, axis] <= np.median(points[:, axis])).mean(), abs=0.06
        )
    left_out = (np.arange(len(points)) % 3 == 0).astype(np.uint8)
    some = Cloud(points, left_out).few(1200)
    assert len(some) == 1200
    assert {tuple(point) for point in some}.isdisjoint(map(tuple, points[::3]))


def test_places_that_hold_all_points_are_drawn_as_often_as_they_fit() -> None:
    points = np.repeat([[1.0, 2.0], [3.0, 4.0]], 500, axis=0)
    few = few_of(lambda: [points], 1000, 600)
    assert sorted(np.unique(few, axis=0, return_counts=True)[1].tolist()) == [100, 500]
    assert few_of(lambda: [points], 1000, 1000).tolist() == points.tolist()


@settings(deadline=None, max_examples=50)
@given(st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=60), st.integers(0, 59))
@example([0.0, 5e-324, 1.8e-304], 1)  # less apart than what one may be divided by
def test_the_value_of_a_rank_is_that_of_the_sorted_values(values: list[float], rank: int) -> None:
    array = np.array(values)
    rank = min(rank, len(values) - 1)
    assert value_of_rank(lambda: np.array_split(array, 3), rank, float(array.min()), float(array.max())) == np.sort(array)[rank]


@pytest.mark.parametrize("kind", ["even", "odd", "one place", "two places"])
def test_the_median_of_many_points_is_exact(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("inspection.medians.MANY", 20)
    points = np.random.default_rng(4).normal(size=(900 if kind == "even" else 901, 2))
    if kind == "one place":
        points[40:] = points[0]
    elif kind == "two places":
        points[:] = np.where(np.arange(len(points))[:, None] % 2, points[0], points[1])
    assert np.array_equal(median_place(Cloud(points)), np.median(points, axis=0))
