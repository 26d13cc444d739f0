"""The points of a scan in the order of their stations, piece by piece, so that no order of all of them is ever held.

Stations are counted in bins, neighbouring bins form shares of few points, and the points of a share are sorted together. Points at
one station stay in the order in which they came, as a stable sort of all would leave them.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from inspection.cloud import MANY, row_blocks
from inspection.kernels import Room

Array = NDArray[np.float64]
Rows = NDArray[np.int64]

_BINS = 1 << 16
_MOST_SHARES = 32  # a scan so long that a share has more than MANY points is still not gone through more often,
_MOST_IN_SHARE = 1 << 20  # until a share has so many


def in_station_order(station_mm: Array, room: Room = np.empty, most: int = MANY) -> Iterator[Rows]:
    """Rows (k,) of the stations (n,) that are not NaN, in rising order, those at one station as they stand. No piece is empty.

    most : points that may be sorted together
    """
    count = len(station_mm)
    if count <= most:
        order = np.argsort(station_mm, kind="stable")[: count - int(np.count_nonzero(np.isnan(station_mm)))]
        if len(order):
            yield order
        return
    low, high = extremes_of(station_mm)
    scale = (_BINS - 2) / (high - low) if high > low else np.inf
    if not np.isfinite(scale):
        yield from _as_they_stand(station_mm, low)
        return
    bins, counts = room((count,), np.uint16), np.zeros(_BINS, dtype=np.int64)
    for rows in row_blocks(count):
        station = station_mm[rows]
        bins[rows] = np.where(np.isnan(station), _BINS - 1, (station - low) * scale)
        counts += np.bincount(bins[rows], minlength=_BINS)
    for first, stop in _shares(counts[:-1], max(most, min(count // _MOST_SHARES, _MOST_IN_SHARE))):
        members = room((int(counts[first:stop].sum()),), np.int64)
        at = 0
        for rows in row_blocks(count):
            found = rows.start + np.flatnonzero((bins[rows] >= first) & (bins[rows] < stop))
            members[at : at + len(found)] = found
            at += len(found)
        yield from _sorted_share(station_mm, members, room, max(most, min(count // _MOST_SHARES, _MOST_IN_SHARE)))


def _sorted_share(station_mm: Array, members: Rows, room: Room, most: int) -> Iterator[Rows]:
    """The members of a share in order; a share of one bin that holds too many is shared out once more."""
    if len(members) <= most:
        yield members[np.argsort(station_mm[members], kind="stable")]
        return
    own = room((len(members),), np.float64)
    for rows in row_blocks(len(members)):
        own[rows] = station_mm[members[rows]]
    for order in in_station_order(own, room, most):
        yield members[order]


def _shares(counts: Rows, most: int) -> Iterator[tuple[int, int]]:
    """Ranges of bins that hold no more than `most` points together, or one bin that holds more; none without points."""
    before = np.concatenate([[0], np.cumsum(counts)])  # points in the bins below each
    filled = np.flatnonzero(counts)
    first, begin = 0, 0
    while begin < len(filled):
        fit = int(np.searchsorted(before[filled + 1], before[first] + most, side="right"))
        begin = max(fit, begin + 1)
        stop = int(filled[begin]) if begin < len(filled) else len(counts)
        yield first, stop
        first = stop


def extremes_of(station_mm: Array) -> tuple[float, float]:
    """The lowest and the highest of stations (n,) that are not NaN; infinity and minus infinity where there is none."""
    low, high = np.inf, -np.inf
    for rows in row_blocks(len(station_mm)):
        low, high = np.fmin.reduce(station_mm[rows], initial=low), np.fmax.reduce(station_mm[rows], initial=high)
    return float(low), float(high)


def _as_they_stand(station_mm: Array, station: float) -> Iterator[Rows]:
    """The rows at the one station that there is."""
    for rows in row_blocks(len(station_mm)):
        found = rows.start + np.flatnonzero(station_mm[rows] == station)
        if len(found):
            yield found
