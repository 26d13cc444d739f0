import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from cmmlink.extremes import DEVIATION, FOOT_X, FOOT_Y, NORMAL_X, NORMAL_Y, STATION, VERDICT, Extremes, PointsVersion

Array = NDArray[np.float64]
LENGTH = 100.0
UNSEEN = PointsVersion(-1, 0)


def scanned(count: int, seed: int) -> tuple[Array, Array, Array, Array, NDArray[np.int8]]:
    """Points on a straight line along x, deviations along y; a fifth of them without a deviation."""
    rng = np.random.default_rng(seed)
    station = rng.uniform(0, LENGTH, count)
    deviation = np.where(rng.random(count) < 0.2, np.nan, rng.normal(0, 0.02, count))
    foot = np.column_stack([station, np.zeros(count)])
    actual = foot + deviation[:, None] * [0.0, 1.0]
    return station, deviation, foot, actual, np.where(np.abs(deviation) > 0.05, 2, 0).astype(np.int8)


def taken(seed: int, count: int, cuts: list[int], bins: int) -> Extremes:
    extremes = Extremes(LENGTH, 0.0, bins=bins)
    for part in zip(*(np.split(column, sorted(cuts)) for column in scanned(count, seed)), strict=True):
        extremes.add(*part)
    return extremes


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10_000), st.integers(0, 400), st.lists(st.integers(0, 400), max_size=6), st.sampled_from([1, 7, 64]))
def test_every_bin_holds_its_lowest_and_highest_point_however_the_points_were_cut(
    seed: int, count: int, cuts: list[int], bins: int
) -> None:
    station, deviation, *_ = scanned(count, seed)
    changed = taken(seed, count, cuts, bins).changed_since(UNSEEN)
    expected: dict[int, list[float]] = {}
    for s, d in zip(station, deviation, strict=True):
        if not np.isnan(d):
            expected.setdefault(min(int(s / LENGTH * bins), bins - 1), []).append(d)
    assert changed.bins.tolist() == sorted(expected)
    for held, b in zip(changed.extremes, changed.bins, strict=True):
        assert held[:, DEVIATION].tolist() == [min(expected[b]), max(expected[b])]


def test_worst_point_is_exact_and_described() -> None:
    station, deviation, *_ = scanned(5000, 3)
    worst = taken(3, 5000, [1000, 1001, 4000], 512).worst
    assert worst is not None
    row = int(np.nanargmax(np.abs(deviation)))
    assert worst[[STATION, DEVIATION, FOOT_X, FOOT_Y]].tolist() == [station[row], deviation[row], station[row], 0.0]
    np.testing.assert_allclose(worst[[NORMAL_X, NORMAL_Y]], [0.0, 1.0], atol=1e-12)
    assert worst[VERDICT] == 2


def test_reader_is_told_only_what_changed() -> None:
    extremes = taken(1, 300, [], 64)
    before = extremes.changed_since(UNSEEN)
    assert len(extremes.changed_since(before.seen).bins) == 0
    extremes.add(np.array([50.0]), np.array([0.5]), np.array([[50.0, 0.0]]), np.array([[50.0, 0.5]]), np.array([2], dtype=np.int8))
    after = extremes.changed_since(before.seen)
    assert after.bins.tolist() == [32]
    assert after.extremes[0, 1, DEVIATION] == 0.5


def test_reader_of_another_generation_is_told_everything() -> None:
    before = taken(1, 300, [], 64).changed_since(UNSEEN)
    anew = Extremes(LENGTH, 0.0, before.seen.generation + 1, 64)
    assert anew.worst is None
    assert len(anew.stations_mm) == 0
    anew.add(*scanned(10, 2))
    after = anew.changed_since(before.seen)
    assert after.seen == anew.newest != before.seen
    assert len(after.bins) == len(anew.changed_since(UNSEEN).bins) > 0


def test_a_million_points_take_no_more_room_than_a_thousand() -> None:
    extremes = Extremes(LENGTH, 0.0, bins=256)
    sizes = set()
    for seed in range(20):
        extremes.add(*scanned(50_000, seed))
        sizes.add(extremes._extremes.nbytes + extremes._stamp.nbytes)
    assert len(sizes) == 1
    assert len(extremes.changed_since(UNSEEN).bins) == 256
