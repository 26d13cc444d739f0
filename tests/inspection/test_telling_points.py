"""The few points that tell: against a sort of all of them."""

import numpy as np
import pytest
from numpy.typing import NDArray

from inspection import telling_rows

Array = NDArray[np.float64]


def sorted_extremes(station_mm: Array, deviation_mm: Array, length_mm: float, shares: int) -> list[int]:
    """The first and the last point of each share, sorted by deviation and, where that is equal, by station."""
    counted = np.flatnonzero(~np.isnan(deviation_mm))
    share = np.minimum((station_mm[counted] * (shares / length_mm)).astype(int), shares - 1)
    found: set[int] = set()
    for each in np.unique(share):
        members = counted[share == each]
        order = members[np.lexsort([station_mm[members], deviation_mm[members]])]
        found |= {int(order[0]), int(order[-1])}
    return sorted(found)


@pytest.mark.parametrize(
    ("count", "shares", "steps"), [(0, 8, 1), (1, 8, 1), (300, 8, 2), (70_000, 16, 3), (200_000, 64, 10**6), (50_000, 512, 1)]
)
def test_the_lowest_and_the_highest_of_each_share_tell_and_of_equal_ones_the_first_and_the_last_along_the_profile(
    count: int, shares: int, steps: int
) -> None:
    rng = np.random.default_rng(count)
    station, deviation = rng.uniform(0, 50, count), rng.integers(-steps, steps, count) / steps
    station[:1], deviation[rng.uniform(size=count) < 0.1] = 50.0, np.nan
    rows = telling_rows(station, deviation, 50.0, shares)
    assert rows.tolist() == sorted_extremes(station, deviation, 50.0, shares)
    assert len(rows) <= 2 * shares
    mixed = rng.permutation(count)
    assert np.sort(mixed[telling_rows(station[mixed], deviation[mixed], 50.0, shares)]).tolist() == rows.tolist()
    before = count // 3
    told = telling_rows(station[:before], deviation[:before], 50.0, shares)
    assert telling_rows(station, deviation, 50.0, shares, told, before).tolist() == rows.tolist()
