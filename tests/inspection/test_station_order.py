"""Stations in order, piece by piece: the very order of a stable sort, whatever the pieces."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from inspection.gaps import largest_gap, measure, weigh_by_station
from inspection.station_order import in_station_order
from tests.inspection.profiles import Array, nominal_of


def stations(seed: int, count: int, kind: str, length: float) -> Array:
    """Stations of a scan: spread, dwelling in one place, all in one place, on a few places; some are NaN."""
    rng = np.random.default_rng(seed)
    found = rng.uniform(0, length, count)
    if kind == "dwelling":
        found[count // 5 :] = length / 3 + rng.normal(0, 1e-7, count - count // 5)
    elif kind == "one place":
        found[:] = length / 7
    elif kind == "few places":
        found = np.round(found / length * 3) / 3 * length
    found[rng.random(count) < 0.1] = np.nan
    return found


KINDS = ("spread", "dwelling", "one place", "few places")


@settings(deadline=None, max_examples=60)
@given(st.integers(0, 99), st.integers(0, 400), st.sampled_from(KINDS), st.sampled_from([1, 7, 50, 1000]))
def test_the_order_is_that_of_a_stable_sort(seed: int, count: int, kind: str, most: int) -> None:
    station = stations(seed, count, kind, 100.0)
    pieces = list(in_station_order(station, most=most))
    assert all(len(piece) for piece in pieces)
    found = np.concatenate([np.empty(0, dtype=np.int64), *pieces])
    expected = np.argsort(station, kind="stable")[: np.count_nonzero(~np.isnan(station))]
    assert found.tolist() == expected.tolist()


def test_no_more_is_sorted_together_than_was_allowed_unless_it_lies_in_one_place() -> None:
    station = stations(1, 5000, "dwelling", 100.0)
    pieces = list(in_station_order(station, most=160))
    assert max(len(piece) for piece in pieces) <= 160
    assert len(pieces) > 20


@pytest.mark.parametrize("name", ["P1", "P3"])
@pytest.mark.parametrize("kind", KINDS)
def test_gaps_and_weights_do_not_depend_on_the_pieces(name: str, kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    nominal = nominal_of(name)
    station = stations(3, 900, kind, nominal.length_mm)
    expected, weights = measure(station, nominal), np.where(np.arange(900) % 50 == 3, 0.0, 2.0)
    weigh_by_station(station, weights, nominal)
    for most, at_once in ((1, 64), (40, 1000), (300, 7)):
        monkeypatch.setattr("inspection.cloud.ROWS_AT_ONCE", at_once)
        monkeypatch.setattr(in_station_order, "__defaults__", (np.empty, most))
        again = np.where(np.arange(900) % 50 == 3, 0.0, 2.0)
        weigh_by_station(station, again, nominal)
        assert measure(station, nominal) == expected
        assert np.array_equal(again, weights)


@pytest.mark.parametrize("name", ["P1", "P3"])
def test_gaps_and_weights_are_what_their_words_say(name: str) -> None:
    nominal = nominal_of(name)
    length, closed = nominal.length_mm, nominal.curve.closed
    place = np.array([0.5, np.nan, 0.1, 0.100001, 0.3, 0.504]) * length
    gap = largest_gap(place, nominal)
    assert gap.from_mm == pytest.approx(0.504 * length)
    assert gap.to_mm == pytest.approx(0.1 * length if closed else length)
    weights = np.ones(6)
    weigh_by_station(place, weights, nominal)
    cap = 0.01 / 2  # of the length: a side counts with half the default gap at most
    tight = 1e-6 / 2
    sides = np.array([0.504 - 0.5, tight, tight, 0.2, 0.2, 0.004])
    ends = cap if closed else 2 * cap / 2
    before = {0: cap, 2: ends, 3: tight, 4: cap, 5: 0.002}
    after = {0: 0.002, 2: tight, 3: cap, 4: cap, 5: ends}
    expected = np.array([before[row] + after[row] for row in (0, 2, 3, 4, 5)])
    assert sides[1] == tight
    assert weights[1] == 1.0
    assert weights[[0, 2, 3, 4, 5]] == pytest.approx(expected / expected.mean(), rel=1e-6)
