"""The worst point of every voxel, held against a search through all of them."""

import numpy as np
import pytest
from numpy.typing import NDArray

from cmmlink.extremes import PointsVersion
from cmmlink.worst_voxels import MOST_VOXELS, WorstVoxels

Array = NDArray[np.float64]
UNSEEN = PointsVersion(-1, 0)


def scan(count: int, seed: int = 1) -> tuple[Array, Array]:
    rng = np.random.default_rng(seed)
    return rng.uniform(-5, 5, (count, 3)), np.round(rng.normal(0, 0.02, count), 3)  # rounded, so that many are equally bad


def held(voxels: WorstVoxels) -> dict[tuple[float, ...], float]:
    """Every point held, whatever its slot."""
    return {tuple(row[:3].tolist()): float(row[3]) for row in voxels.changed_since(UNSEEN).points}


def test_every_voxel_holds_its_worst_point() -> None:
    points, deviation = scan(5000)
    voxels = WorstVoxels(1.0, 0.01)
    voxels.add(points, deviation)
    worst: dict[tuple[int, ...], float] = {}
    for place, value in zip(np.floor(points).astype(int).tolist(), np.abs(deviation - 0.01), strict=True):
        worst[tuple(place)] = max(worst.get(tuple(place), 0.0), float(value))
    found = {tuple(np.floor(place).astype(int).tolist()): abs(value - 0.01) for place, value in held(voxels).items()}
    assert found == pytest.approx(worst)
    assert voxels.worst is not None
    assert abs(voxels.worst[3] - 0.01) == np.abs(deviation - 0.01).max()


@pytest.mark.parametrize("most", [MOST_VOXELS, 60])
def test_neither_order_nor_batches_change_what_is_held(most: int) -> None:
    points, deviation = scan(3000)
    whole = WorstVoxels(1.0, 0.0, most=most)
    whole.add(points, deviation)
    rng = np.random.default_rng(2)
    order = rng.permutation(len(points))
    cut = WorstVoxels(1.0, 0.0, most=most)
    for rows in np.array_split(order, np.sort(rng.integers(0, len(points), 40))):
        cut.add(points[rows], deviation[rows])
    assert held(cut) == held(whole)
    assert len(cut) <= most
    assert cut.worst is not None
    assert whole.worst is not None
    assert cut.worst.tolist() == whole.worst.tolist()


def test_a_reader_that_asks_for_changes_holds_what_is_held() -> None:
    """The slots that a page fills in from what changed are those of the whole, through every doubling of the voxels."""
    points, deviation = scan(4000)
    voxels, seen = WorstVoxels(0.4, 0.0, most=500), UNSEEN
    page: dict[int, list[float]] = {}
    for rows in np.array_split(np.arange(len(points)), 37):
        voxels.add(points[rows], deviation[rows])
        changed = voxels.changed_since(seen)
        if changed.seen.generation != seen.generation:
            page.clear()
        page |= dict(zip(changed.slots.tolist(), changed.points.tolist(), strict=True))
        seen = changed.seen
    assert {tuple(row[:3]): row[3] for row in page.values()} == held(voxels)
    assert sorted(page) == list(range(len(voxels)))
    assert not len(voxels.changed_since(seen).slots)


def test_points_without_a_deviation_are_not_shown() -> None:
    voxels = WorstVoxels(1.0, 0.0)
    assert not len(voxels.add(np.array([[0.0, 0, 0], [np.nan, 0, 0]]), np.array([np.nan, 0.1])))
    assert (len(voxels), voxels.worst) == (0, None)
    assert voxels.add(np.array([[0.0, 0, 0], [1e12, 0, 0]]), np.array([0.1, 0.2])).shape == (2, 3)


def test_one_bad_point_among_many_is_held() -> None:
    """A sphere of 300,000 points in at most 50,000 voxels, which double until they are so few; one of the points is out."""
    k = np.arange(300_000) + 0.5
    z, angle = 1 - 2 * k / len(k), k * np.pi * (3 - np.sqrt(5))
    points = 30 * np.column_stack([np.sqrt(1 - z**2) * np.cos(angle), np.sqrt(1 - z**2) * np.sin(angle), z])
    deviation = np.zeros(len(k))
    deviation[254_321] = 0.3
    voxels = WorstVoxels(0.1, 0.0, most=50_000)
    voxels.add(points, deviation)
    assert 10_000 < len(voxels) <= 50_000
    assert np.count_nonzero(voxels.changed_since(UNSEEN).points[:, 3] == 0.3) == 1
