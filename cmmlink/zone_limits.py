"""Limits that vary along a profile, as the check of a least consumption knows them: at a station, and the loosest near a place.

They share nothing with the limits of the inspection. A place that may move is asked for the loosest limits of all of the curve that its
nearest point may come to; squares of several sizes, each with the limits of the vertices in it, answer that.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_FINEST = 2.0**-13  # of the extent of the curve: the side of the smallest squares
_BESIDE_MM = 1e-5  # to either side of a station at which limits stand: far more than stations of the polygon err by


@dataclass(frozen=True, slots=True)
class StatedLimits:
    """Limits (b,) at stations (b,), rising; `between` linear, smooth or constant; within `border_mm` of a step both sides hold."""

    station_mm: Array
    lower_mm: Array
    upper_mm: Array
    between: str
    border_mm: float
    length_mm: float
    closed: bool

    @classmethod
    def of(cls, zone: Mapping[str, Any], length_mm: float, closed: bool) -> "StatedLimits":
        """Those that a zone.json states."""
        station, lower, upper = (np.array(zone[key], dtype=np.float64) for key in ("station_mm", "lower_mm", "upper_mm"))
        return cls(station, lower, upper, str(zone["between"]), float(zone["border_mm"]), length_mm, closed)

    @property
    def problem(self) -> str:
        """What tells that these are no limits; nothing where they are."""
        s, low, high = self.station_mm, self.lower_mm, self.upper_mm
        sound = s.ndim == 1 and s.shape == low.shape == high.shape and len(s) and bool((np.diff(s) >= 0).all() and (low < high).all())
        sound = sound and s[0] >= 0 and s[-1] <= self.length_mm + _BESIDE_MM and self.border_mm >= 0
        return "" if sound and self.between in ("linear", "smooth", "constant") else "the limits that are stated are none"

    def at(self, station_mm: Array) -> tuple[Array, Array]:
        """The limits (k,) at stations (k,), the stricter where several hold."""
        lower, upper = np.full(len(station_mm), -np.inf), np.full(len(station_mm), np.inf)
        for begin, end, low, high in self._stretches():
            turns = (-self.length_mm, 0.0, self.length_mm) if self.closed else (0.0,)
            for turn in turns:
                s = station_mm + turn
                here = (s >= begin - self.border_mm - 1e-9) & (s <= end + self.border_mm + 1e-9)
                share = np.clip((s - begin) / (end - begin), 0.0, 1.0)
                share = {"linear": share, "smooth": share**2 * (3 - 2 * share), "constant": 0.0 * share}[self.between]
                lower = np.where(here, np.maximum(lower, low[0] + share * (low[1] - low[0])), lower)
                upper = np.where(here, np.minimum(upper, high[0] + share * (high[1] - high[0])), upper)
        return lower, upper

    def of_share(self, station_mm: Array, share: float) -> tuple[Array, Array]:
        """The limits (k,) of what consumes no more than a share of the zone."""
        lower, upper = self.at(station_mm)
        return (lower + upper) / 2 - share * (upper - lower) / 2, (lower + upper) / 2 + share * (upper - lower) / 2

    def turns(self) -> Array:
        """Stations at which the limits may turn or jump, and others close beside them."""
        ends = np.array([[stretch[0], stretch[1]] for stretch in self._stretches()]).ravel()
        at = np.concatenate([ends, ends - self.border_mm, ends + self.border_mm])
        at = np.concatenate([at - _BESIDE_MM, at, at + _BESIDE_MM])
        return np.asarray(np.mod(at, self.length_mm) if self.closed else np.clip(at, 0.0, self.length_mm))

    def _stretches(self) -> list[tuple[float, float, tuple[float, float], tuple[float, float]]]:
        """From where to where limits hold, with the lower and the upper one at both ends."""
        rows = list(zip(self.station_mm.tolist(), self.lower_mm.tolist(), self.upper_mm.tolist(), strict=True))
        first, last = rows[0], rows[-1]
        around = [(first[0] + self.length_mm, *first[1:])] if self.closed else [(self.length_mm, *last[1:])]
        rows = [*rows, *around] if self.closed else [(0.0, *first[1:]), *rows, *around]
        held = self.between == "constant"
        return [
            (a[0], b[0], (a[1], a[1] if held else b[1]), (a[2], a[2] if held else b[2])) for a, b in pairwise(rows) if b[0] - a[0] > 1e-9
        ]


class LoosestLimits:
    """The loosest limits of a share of a zone near places, over the vertices (n, 2) of a polygon with stations (n,)."""

    def __init__(self, places: Array, station_mm: Array, limits: StatedLimits, share: float) -> None:
        lower, upper = (_beside(station_mm, values, limits, share, side) for side, values in enumerate(limits.of_share(station_mm, share)))
        self._low = places.min(axis=0)
        self._size = float(np.ptp(places, axis=0).max())
        self._sides, self._squares = list[float](), list[tuple[NDArray[np.int64], Array, Array]]()
        self._every = float(lower.min()), float(upper.max())
        side = self._size * _FINEST
        while side < 2 * self._size:
            self._sides.append(side)
            self._squares.append(_squares(self._keys(np.floor((places - self._low) / side).astype(np.int64)), lower, upper))
            side *= 2

    @property
    def farthest(self) -> float:
        """The largest deviation that is allowed anywhere, either way."""
        return max(abs(limit) for limit in self._every)

    def near(self, places: Array, radius_mm: Array) -> tuple[Array, Array]:
        """The lowest lower and the highest upper limit (k,) of all vertices within radii (k,) of places (k, 2), or a little farther."""
        lower, upper = np.full(len(places), self._every[0]), np.full(len(places), self._every[1])
        level = np.searchsorted(self._sides, radius_mm)
        for k in np.unique(level[level < len(self._sides)]).tolist():
            rows = np.flatnonzero(level == k)
            keys, low, high = self._squares[k]
            square = np.floor((places[rows] - self._low) / self._sides[k]).astype(np.int64)
            found = np.full(len(rows), np.inf), np.full(len(rows), -np.inf)
            for step in np.ndindex(3, 3):
                wanted = self._keys(square + np.array(step) - 1)
                at = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
                there = keys[at] == wanted
                found[0][there] = np.minimum(found[0], low[at])[there]
                found[1][there] = np.maximum(found[1], high[at])[there]
            lower[rows], upper[rows] = found
        return lower, upper

    def _keys(self, square: NDArray[np.int64]) -> NDArray[np.int64]:
        """One number (k,) for each square (k, 2)."""
        return np.asarray((square[:, 0] << 32) + square[:, 1])


def _beside(station_mm: Array, values: Array, limits: StatedLimits, share: float, side: int) -> Array:
    """The loosest limit (n,) of one side on the edges to both neighbours of each vertex (n,)."""
    worse = (np.minimum, np.maximum)[side]
    found = values.copy()
    turns = limits.turns()
    at_turns, behind = limits.of_share(turns, share)[side], np.searchsorted(station_mm, turns)
    for step in (-1, 0):
        worse.at(found, (behind + step) % len(found), at_turns)
    before, after = np.roll(found, 1), np.roll(found, -1)
    if not limits.closed:
        before[0], after[-1] = found[0], found[-1]
    return np.asarray(worse(found, worse(before, after)))


def _squares(keys: NDArray[np.int64], lower: Array, upper: Array) -> tuple[NDArray[np.int64], Array, Array]:
    """The squares that hold vertices, rising, with the loosest limits in each."""
    order = np.argsort(keys, kind="stable")
    found, starts = np.unique(keys[order], return_index=True)
    return found, np.minimum.reduceat(lower[order], starts), np.maximum.reduceat(upper[order], starts)
