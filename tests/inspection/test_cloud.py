"""Points gone through in pieces: which take part, which few stand for many, and their exact median."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from inspection.cloud import Cloud, even_choice
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
    few = cloud.few(40)
    rows = np.searchsorted(np.flatnonzero(cloud.left_out == 0), np.flatnonzero((cloud.points_mm[:, None] == few).all(axis=2).any(axis=1)))
    assert rows.tolist() == even_choice(len(points), 40).tolist()


def test_few_of_many_are_one_of_every_stretch_and_in_no_rhythm() -> None:
    chosen = even_choice(1_000_000, 1000)
    assert np.array_equal(chosen // 1000, np.arange(1000))
    for rhythm in (2, 4, 7, 10, 1000):  # a scan by several heads, or with lines of so many points
        counts = np.bincount(chosen % rhythm * min(rhythm, 10) // rhythm)
        assert counts.min() > 0.7 * counts.max(), "one in step with it would see one kind alone"
    assert even_choice(5, 1000).tolist() == [0, 1, 2, 3, 4]


GRID = np.stack(np.meshgrid(np.arange(150) * 0.001, np.arange(200) * 0.5), axis=-1).reshape(-1, 2)
LINE = np.column_stack([np.arange(30_000.0), np.zeros(30_000)])


@pytest.mark.parametrize("points", [GRID, LINE, np.random.default_rng(2).normal(size=(30_000, 2))], ids=["grid", "line", "random"])
def test_a_sample_does_not_depend_on_the_order_of_the_points_and_is_spread_over_them(points: np.ndarray) -> None:
    sample = Cloud(points).sample(1200)
    assert 1000 < len(sample) < 1400
    assert np.array_equal(Cloud(points[::-1]).sample(1200)[::-1], sample)
    for axis in (0, 1):
        lower_half = sample[:, axis] <= np.median(points[:, axis])
        assert lower_half.mean() == pytest.approx((points[:, axis] <= np.median(points[:, axis])).mean(), abs=0.06)
    left_out = (np.arange(len(points)) % 3 == 0).astype(np.uint8)
    some = Cloud(points, left_out).sample(1200)
    assert 1000 < len(some) < 1400
    assert {tuple(point) for point in some}.isdisjoint(map(tuple, points[::3]))


@settings(deadline=None, max_examples=50)
@given(st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=60), st.integers(0, 59))
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
