"""Tolerance zones that vary along the profile, and how much of them a deviation consumes.

Limits stand at stations; between two of them they run linearly or smoothly, or stay as they are up to the next. Where two zones
meet, both hold, so the stricter limit counts there.
"""

from dataclasses import dataclass, field
from itertools import pairwise
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
Transition = Literal["linear", "smooth", "constant"]

_ROUNDING = 1e-12  # of the profile's length: stations nearer than this are one


class Limits(NamedTuple):
    """Limits (m,) in mm at stations, and how they change with the station (m,), mm a mm."""

    lower_mm: Array
    upper_mm: Array
    lower_slope: Array
    upper_slope: Array


class LimitRange(NamedTuple):
    """The lowest and the highest (m,) in mm that each limit has anywhere on stretches."""

    lowest_lower_mm: Array
    highest_lower_mm: Array
    lowest_upper_mm: Array
    highest_upper_mm: Array


class _Piece(NamedTuple):
    """Limits between two stations, at its start and at its end, and how far beyond them they hold as well."""

    start_mm: float
    length_mm: float
    lower_mm: tuple[float, float]
    upper_mm: tuple[float, float]
    before_mm: float
    after_mm: float


@dataclass(frozen=True, slots=True, eq=False)
class VaryingZone:
    """Deviations allowed along a profile, positive out of material.

    station_mm         : (b,) rising; the same station twice is a step
    lower_mm, upper_mm : (b,) limits there, the lower below the upper; what "constant" has at a station holds from there to the next
    between            : how the limits run from one station to the next; "smooth" leaves and reaches them without a slope
    length_mm, closed  : of the profile; on a closed one the limits run on over the seam, on an open one they stay the same to the ends
    border_mm          : within this distance of a step the limits of both its sides hold: how well a station is known

    Raises ValueError for limits that contradict themselves.
    """

    station_mm: Array
    lower_mm: Array
    upper_mm: Array
    length_mm: float
    closed: bool
    between: Transition = "linear"
    border_mm: float = 0.0
    _pieces: tuple[_Piece, ...] = field(init=False, repr=False)
    _turns: "_Turns" = field(init=False, repr=False)

    def __post_init__(self) -> None:
        for name in ("station_mm", "lower_mm", "upper_mm"):
            array = np.array(getattr(self, name), dtype=np.float64)
            array.setflags(write=False)
            object.__setattr__(self, name, array)
        _check(self)
        object.__setattr__(self, "_pieces", _pieces(self))
        object.__setattr__(self, "_turns", _Turns.of(self))
        lower, upper, _, _ = self.limits(self.station_mm)
        if not (lower < upper).all():
            at = float(self.station_mm[np.argmax(lower >= upper)])
            raise ValueError(f"the zones that meet at station {at:g} mm have no deviation in common")

    @classmethod
    def constant(cls, lower_mm: float, upper_mm: float, length_mm: float, closed: bool) -> "VaryingZone":
        """The zone that is the same everywhere."""
        return cls(np.zeros(1), np.array([lower_mm]), np.array([upper_mm]), length_mm, closed)

    @property
    def has_steps(self) -> bool:
        """Whether the limits jump anywhere."""
        behind = self._pieces[-1:] + self._pieces[:-1] if self.closed else self._pieces[:-1]
        ends = [(piece.lower_mm[1], piece.upper_mm[1]) for piece in behind]
        starts = [(piece.lower_mm[0], piece.upper_mm[0]) for piece in self._pieces[0 if self.closed else 1 :]]
        return ends != starts

    def limits(self, station_mm: ArrayLike) -> Limits:
        """Limits at stations (m,), the stricter where two zones meet. NaN at a station that is NaN."""
        s = np.asarray(station_mm, dtype=np.float64)
        found = Limits(*(np.full(len(s), fill) for fill in (-np.inf, np.inf, 0.0, 0.0)))
        for piece in self._pieces:
            along = s - piece.start_mm
            if self.closed:
                along = np.mod(along, self.length_mm)
                along = np.where(along >= self.length_mm - piece.before_mm, along - self.length_mm, along)
                here = along <= piece.length_mm + piece.after_mm  # it is not before the start, but for round-off
            else:
                here = (along >= -piece.before_mm) & (along <= piece.length_mm + piece.after_mm)
            share, rate = _shape(np.clip(along / piece.length_mm, 0.0, 1.0), self.between)
            for at, strict, (first, last) in ((0, np.greater, piece.lower_mm), (1, np.less, piece.upper_mm)):
                limit = first + share * (last - first)
                stricter = here & strict(limit, found[at])
                found[at][stricter] = limit[stricter]
                found[at + 2][stricter] = (rate * (last - first) / piece.length_mm)[stricter]
        unknown = np.isnan(s)
        found.lower_mm[unknown] = found.upper_mm[unknown] = np.nan
        return found

    def extremes(self, from_mm: Array, to_mm: Array) -> LimitRange:
        """What the limits are at most and at least anywhere between stations (m,), which on a closed profile may lie beyond its seam.

        At a step the limits of both its sides count, and not the stricter alone: a station nearby has either.
        """
        slack = 2 * _ROUNDING * self.length_mm
        low, high = from_mm - slack, to_mm + slack
        whole = high - low >= self.length_mm
        low, high = np.where(whole, 0.0, low), np.where(whole, self.length_mm, high)
        ends = [self.limits(np.clip(at, *((-np.inf, np.inf) if self.closed else (0.0, self.length_mm)))) for at in (low, high)]
        inside = self._turns.between(low, high)
        found = []
        for at in (0, 1):
            one, other = ends[0][at], ends[1][at]
            found += [np.minimum(np.minimum(one, other), inside[2 * at]), np.maximum(np.maximum(one, other), inside[2 * at + 1])]
        return LimitRange(*found)

    def consumption(self, deviation_mm: ArrayLike, station_mm: ArrayLike) -> Array:
        """Share (m,) of the zone that deviations (m,) at stations (m,) consume: 0 in its middle, -1 and 1 at its limits."""
        lower, upper, _, _ = self.limits(station_mm)
        return np.asarray((2 * np.asarray(deviation_mm, dtype=np.float64) - lower - upper) / (upper - lower))


class _Turns(NamedTuple):
    """The stations (t,) between which both limits run one way, and ranges of limits at runs of 1, 2, 4 ... of them, both sides of each."""

    station_mm: Array
    runs: tuple[tuple[Array, Array, Array, Array], ...]

    @classmethod
    def of(cls, zone: VaryingZone) -> "_Turns":
        """Those of a zone; of a closed profile with a turn more before and behind it."""
        nudge, length = 2 * _ROUNDING * zone.length_mm, zone.length_mm
        starts, stops = ([p.start_mm for p in zone._pieces], [p.start_mm + p.length_mm for p in zone._pieces])
        borders = [p.start_mm - p.before_mm for p in zone._pieces], [p.start_mm + p.length_mm + p.after_mm for p in zone._pieces]
        ends = np.concatenate([starts, stops, *borders])
        at = np.unique(np.mod(ends, length) if zone.closed else np.clip(ends, 0.0, length))
        sides = []
        for way in (-nudge, 0.0, nudge):
            beside = at + way if zone.closed else np.clip(at + way, 0.0, length)
            limits, back = zone.limits(beside), at - beside
            sides.append(np.stack([limits.lower_mm + back * limits.lower_slope, limits.upper_mm + back * limits.upper_slope]))
        low, high = np.min(sides, axis=0), np.max(sides, axis=0)
        values = np.stack([low[0], high[0], low[1], high[1]])
        if zone.closed:
            at, values = np.concatenate([at - length, at, at + length]), np.tile(values, 3)
        runs, step = [values], 1
        while 2 * step <= len(at):
            before, after = runs[-1][:, :-step], runs[-1][:, step:]
            runs.append(np.stack([worse(before[i], after[i]) for i, worse in enumerate(_WORSE)]))
            step *= 2
        return cls(at, tuple((run[0], run[1], run[2], run[3]) for run in runs))

    def between(self, from_mm: Array, to_mm: Array) -> list[Array]:
        """The lowest and highest lower limit, then upper limit (m,) at the turns on stretches; infinite the other way without one."""
        first, stop = np.searchsorted(self.station_mm, from_mm, "left"), np.searchsorted(self.station_mm, to_mm, "right")
        count = np.maximum(stop - first, 0)
        found = [np.full(len(count), fill) for fill in (np.inf, -np.inf, np.inf, -np.inf)]
        level = np.where(count > 0, np.frexp(np.maximum(count, 1))[1] - 1, -1)
        for k in np.unique(level[level >= 0]).tolist():
            rows = np.flatnonzero(level == k)
            for i, worse in enumerate(_WORSE):
                run = self.runs[k][i]
                found[i][rows] = worse(run[first[rows]], run[stop[rows] - (1 << k)])
        return found


_WORSE = (np.minimum, np.maximum, np.minimum, np.maximum)


def _shape(t: Array, between: Transition) -> tuple[Array, Array]:
    """How far (m,) a transition has gone at a share t (m,) of its way, and its rate there."""
    if between == "smooth":
        return t * t * (3 - 2 * t), 6 * t * (1 - t)
    return (t, np.ones(len(t))) if between == "linear" else (np.zeros(len(t)), np.zeros(len(t)))


def _check(zone: VaryingZone) -> None:
    """Raise ValueError for arrays that describe no zone."""
    s, low, high = zone.station_mm, zone.lower_mm, zone.upper_mm
    if s.ndim != 1 or not len(s) or low.shape != s.shape or high.shape != s.shape:
        raise ValueError(f"stations and limits must have one shape (b,), got {s.shape}, {low.shape} and {high.shape}")
    if not (np.isfinite(s).all() and np.isfinite(low).all() and np.isfinite(high).all()) or not (low < high).all():
        raise ValueError("every lower limit must be below its upper one, and all must be finite numbers")
    if not (np.diff(s) >= 0).all() or s[0] < 0 or s[-1] > zone.length_mm * (1 + _ROUNDING):
        raise ValueError(f"stations must rise from 0 to {zone.length_mm:g} mm at most, got {s[0]:g} .. {s[-1]:g}")
    if len(s) > 2 and (at := s[2:][s[2:] - s[:-2] <= _ROUNDING * zone.length_mm]).size:
        raise ValueError(f"a step has two sides, so that a station stands twice at most; {at[0]:g} mm stands more often")
    if zone.between not in ("linear", "smooth", "constant") or not zone.border_mm >= 0:
        raise ValueError(
            f"transitions are linear, smooth or constant, and a border is no narrower than 0; got {zone.between}, {zone.border_mm:g}"
        )


def _pieces(zone: VaryingZone) -> tuple[_Piece, ...]:
    """The stretches between neighbouring stations that have a length, in their order around the profile."""
    values = [*zip(zone.station_mm.tolist(), zone.lower_mm.tolist(), zone.upper_mm.tolist(), strict=True)]
    first, last = values[0], values[-1]
    ends = [*values, (first[0] + zone.length_mm, *first[1:])] if zone.closed else [(0.0, *first[1:]), *values, (zone.length_mm, *last[1:])]
    least = _ROUNDING * zone.length_mm
    bare = []
    for (s0, low0, high0), (s1, low1, high1) in pairwise(ends):
        if s1 - s0 > least:
            held = zone.between == "constant"
            bare.append(_Piece(s0, s1 - s0, (low0, low0 if held else low1), (high0, high0 if held else high1), least, least))
    found = []
    for i, piece in enumerate(bare):
        behind, ahead = bare[i - 1], bare[(i + 1) % len(bare)]
        at_start = (behind.lower_mm[1], behind.upper_mm[1]) != (piece.lower_mm[0], piece.upper_mm[0]) and (zone.closed or i > 0)
        at_end = (piece.lower_mm[1], piece.upper_mm[1]) != (ahead.lower_mm[0], ahead.upper_mm[0]) and (zone.closed or i + 1 < len(bare))
        found.append(piece._replace(before_mm=max(least, zone.border_mm * at_start), after_mm=max(least, zone.border_mm * at_end)))
    return tuple(found)
