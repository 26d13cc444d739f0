"""How much of the profile was measured: gaps between neighbouring stations, and the coverage that follows from them.

What lies between two neighbouring points was not seen. It counts as measured where the gap is no longer than a stated length, so
only the places of the points decide, never their density: a further point never lowers the coverage, a lost one never raises it.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inspection.cloud import row_blocks
from inspection.kernels import Room
from inspection.nominal import NominalProfile
from inspection.station_order import extremes_of, in_station_order

Array = NDArray[np.float64]
Rows = NDArray[np.int64]

_UNDULATIONS = 50  # on the whole profile: the shortest form that a part is taken to have, as roundness filters have it
_ON_A_GAP = 33  # places on a gap where the curve is asked how far it stands off the line
_GAPS_A_WAVE = 2  # a gap of half a wave still has a point on every crest and in every hollow


@dataclass(frozen=True, slots=True)
class Gap:
    """The longest stretch of the profile without a judged point; `from_mm` is above `to_mm` where it crosses the seam.

    length_mm     : its length; the whole profile where nothing was judged
    could_hide_mm : how far the nominal stands off the straight line across it: so much of the part could be missing there unseen
    """

    from_mm: float
    to_mm: float
    length_mm: float
    could_hide_mm: float


def default_gap_max_mm(nominal: NominalProfile) -> float:
    """The longest gap that counts as measured where nobody says otherwise: half a wave of 50 undulations, a hundredth of the length."""
    return nominal.length_mm / (_UNDULATIONS * _GAPS_A_WAVE)


@dataclass(frozen=True, slots=True)
class Measured:
    """How much of a profile points measured: the share of its length between neighbours that are near, and the longest gap."""

    coverage: float
    gap: Gap


def coverage(station_mm: Array, nominal: NominalProfile, gap_max_mm: float | None = None) -> float:
    """Share of the nominal's length between neighbouring judged points at stations (j,) that are no more than `gap_max_mm` apart.

    gap_max_mm : None takes `default_gap_max_mm`
    """
    return measure(station_mm, nominal, gap_max_mm).coverage


def largest_gap(station_mm: Array, nominal: NominalProfile) -> Gap:
    """The longest stretch without a judged point among stations (j,)."""
    return measure(station_mm, nominal).gap


def measure(station_mm: Array, nominal: NominalProfile, gap_max_mm: float | None = None, room: Room = np.empty) -> Measured:
    """Coverage and longest gap of judged points at stations (m,); those that are NaN count for nothing.

    gap_max_mm : None takes `default_gap_max_mm`
    """
    length = nominal.length_mm
    limit = default_gap_max_mm(nominal) if gap_max_mm is None else gap_max_mm
    near = room((len(station_mm) + 1,), np.float64)  # the gaps that count, one after the other: their sum depends on its order
    count, longest, start, stop = 0, -1.0, 0.0, length
    for stations, gaps in _gaps_in_order(station_mm, nominal, room):
        counted = gaps[gaps <= limit]
        near[count : count + len(counted)] = counted
        count += len(counted)
        at = int(gaps.argmax())
        if gaps[at] > longest:
            longest, start, stop = float(gaps[at]), float(stations[at]), float(stations[at + 1])
    if longest < 0:
        return Measured(0.0, Gap(0.0, length, length, nominal.size_mm))
    gap = Gap(start, stop, longest, _off_the_line_mm(start, longest, nominal))
    return Measured(float(near[:count].sum() / length), gap)


def measure_region(
    station_mm: Array, nominal: NominalProfile, gap_max_mm: float, from_mm: float, to_mm: float, room: Room = np.empty
) -> Measured:
    """The same of one stretch of the profile: what of its gaps lies within it. `from_mm` is above `to_mm` where it crosses the seam.

    Points beside the stretch count as well: what lies between them and it was seen up to them.
    """
    length, wraps = nominal.length_mm, nominal.curve.closed
    span = (to_mm - from_mm) % length if wraps else to_mm - from_mm
    span = span or length
    near, longest, start = [], -1.0, 0.0
    for stations, gaps in _gaps_in_order(station_mm, nominal, room):
        begin = stations[:-1] - from_mm
        for low in (np.mod(begin, length), np.mod(begin, length) - length) if wraps else (begin,):
            first, last = np.clip(low, 0.0, span), np.clip(low + gaps, 0.0, span)
            inside = last - first
            near.append(inside[inside <= gap_max_mm * (1 + 1e-9)])
            at = int(inside.argmax())
            if inside[at] > longest:
                longest, start = float(inside[at]), float(from_mm + first[at])
    if longest < 0:
        return Measured(0.0, Gap(from_mm, to_mm, span, nominal.size_mm))
    first_mm, last_mm = (start % length, (start + longest) % length) if wraps else (start, start + longest)
    return Measured(math.fsum(np.concatenate(near)) / span, Gap(first_mm, last_mm, longest, _off_the_line_mm(first_mm, longest, nominal)))


def _gaps_in_order(station_mm: Array, nominal: NominalProfile, room: Room) -> Iterator[tuple[Array, Array]]:
    """Distances (k,) between neighbouring stations in rising order, piece by piece, beside the stations (k + 1,) that they lie between.

    The gap over the seam is the last; those to both ends of an open profile are the first and the last.
    """
    length, closed = nominal.length_mm, nominal.curve.closed
    low, high = extremes_of(station_mm)
    last = np.empty(0) if closed else np.zeros(1)
    for rows in in_station_order(station_mm, room):
        stations = np.concatenate([last, station_mm[rows]])
        last = stations[-1:]
        if len(stations) > 1:
            yield stations, np.diff(stations)
    if low <= high:
        yield np.array([high, low if closed else length]), np.array([(low + length if closed else length) - high])


def _off_the_line_mm(first_mm: float, length_mm: float, nominal: NominalProfile) -> float:
    """How far the nominal from a station on, over a length, stands off the straight line between its two ends.

    The curve is asked at places of its own: a short gap around an edge may hold none of the nominal's samples, and hides something.
    """
    whole, closed = nominal.length_mm, nominal.curve.closed
    ahead = np.mod(nominal.station_mm - first_mm, whole) if closed else nominal.station_mm - first_mm
    on_way = np.concatenate([np.linspace(0.0, length_mm, _ON_A_GAP), ahead[(ahead > 0) & (ahead < length_mm)]])
    station = first_mm + np.sort(on_way, kind="stable")
    station = np.mod(station, whole) if closed else np.clip(station, 0.0, whole)
    known = np.append(nominal.station_mm, whole), np.append(nominal.parameter, nominal.curve.domain[1])
    arc = nominal.curve.point(np.interp(station, *known))
    chord, arms = arc[-1] - arc[0], arc - arc[0]
    span = float(np.hypot(*chord))
    if span <= 1e-9 * length_mm:
        return float(np.hypot(*arms.T).max())
    return float(np.abs(chord[0] * arms[:, 1] - chord[1] * arms[:, 0]).max() / span)


def weigh_by_station(station_mm: Array, weights: Array, nominal: NominalProfile, room: Room = np.empty) -> None:
    """Set how much of the profile each point (m,) stands for, divided by the mean: half the distance to both neighbours in station order.

    A side counts with half the default gap at most, so that the points beside a hole do not stand for what was not measured. Points
    in one place share what that place stands for, so that neither dwelling nor a dense side draws the fit to itself. Points that
    take no part have no station, but NaN: they get weight 1 where their weight is not 0.
    """
    for part in row_blocks(len(weights)):
        weights[part] = np.where(weights[part] > 0, 1.0, 0.0)
    sides, count = room((len(station_mm),), np.float64), 0  # one after the other, for their sum depends on its order
    for rows, share in _sides_in_order(station_mm, nominal, room):
        sides[count : count + len(rows)] = weights[rows] = share
        count += len(rows)
    if count < 2:
        weights[np.isfinite(station_mm)] = 1.0
        return
    mean = sides[:count].mean()
    for part in row_blocks(len(weights)):
        weights[part] = np.where(np.isnan(station_mm[part]), weights[part], weights[part] / mean)


def _sides_in_order(station_mm: Array, nominal: NominalProfile, room: Room) -> Iterator[tuple[Rows, Array]]:
    """Rows (k,) in the order of their stations, piece by piece, with half the distances to both neighbours (k,) together."""
    closed, cap = nominal.curve.closed, default_gap_max_mm(nominal) / 2
    low, high = extremes_of(station_mm)
    seam = (low + nominal.length_mm) - high
    before = seam if closed else low
    end = 0.0 if closed else min(before, cap) - min(before / 2, cap)  # an end belongs to its point alone
    held = np.empty(0, dtype=np.int64)
    for found in in_station_order(station_mm, room):
        rows = np.concatenate([held, found])
        gaps, held = np.diff(station_mm[rows]), rows[-1:]
        if len(gaps):
            sides = np.minimum(np.append(before, gaps[:-1]) / 2, cap) + np.minimum(gaps / 2, cap)
            sides[0] += end
            before, end = float(gaps[-1]), 0.0
            yield rows[:-1], sides
    if len(held):
        after = seam if closed else nominal.length_mm - high
        sides = np.array([min(before / 2, cap) + min(after / 2, cap)])
        sides += end + (0.0 if closed else min(after, cap) - min(after / 2, cap))
        yield held, sides
