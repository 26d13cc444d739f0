"""Which stations the foot of a point may have while the point moves a little: what a search over motions may say of varying limits.

All feet of a point that stays within rho of a place x lie on the curve within d + 2 rho of x, where d is the distance of x. A table
tells how far the curve stays away from each of its nodes beyond so many cells along it, so the stretch of those feet is known however
the curve comes back to itself. Where that stretch is smooth and so short that a point near it has one foot on it only, the foot moves
no faster than 1 / (1 - curvature times distance), which is far less than the stretch where limits change along the profile.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from inspection.curve import NurbsCurve, left_limit
from inspection.kernels import Feet

Array = NDArray[np.float64]
Rows = NDArray[np.int64]

_CELLS = 768  # a third of them even in arc length, a third in turning, a third crowded where both sides of a thin end are near each other
_SCOUTS, _FEW_SCOUTS = 8192, 512
_NARROWEST = 1e-3  # of the length: ends thinner than this are not cut finer
_ROUNDING = 1e-9  # of the length: far above what stations err by


class Stretches(NamedTuple):
    """From which station to which (m,), beyond both ends of a closed profile where they reach over its seam."""

    from_mm: Array
    to_mm: Array


class StationReach:
    """The reach of feet along one curve. Its tables are made at once, and are some megabytes."""

    def __init__(self, curve: NurbsCurve) -> None:
        self._length, self._closed = curve.length_mm, curve.closed
        u = _nodes(curve)
        self._nodes = curve.station_mm(u)
        self._nodes[-1] = curve.length_mm  # of a closed curve the end is the start again
        lengths, self._points = np.diff(self._nodes), curve.point(u)
        low, high = _curvatures(curve, u)
        self._count = len(lengths)
        most = self._count // 2 if curve.closed else self._count
        around = np.arange(self._count + 1)[:, None] + np.concatenate([np.arange(-most, 0)[::-1], np.arange(most)])[None, :]
        cell = np.mod(around, self._count) if curve.closed else np.clip(around, 0, self._count - 1)
        missing = np.zeros(cell.shape, dtype=bool) if curve.closed else (around < 0) | (around >= self._count)
        away = _distance_to_cells(self._points, lengths, cell)
        away[missing] = np.inf
        one, other = away[:, :most], away[:, most:]  # the k-th cell before a node, the k-th behind it
        beyond = np.minimum.accumulate(np.minimum(one, other)[:, ::-1], axis=1)[:, ::-1]
        self._clear = np.column_stack([beyond, np.full(len(beyond), np.inf)])  # (nodes, k): nearest of the cells from the k-th on
        for name, values, worse in (("_lowest", low, np.minimum), ("_highest", high, np.maximum)):
            each = np.where(missing, 0.0, values[cell])
            held = worse.accumulate(worse(each[:, :most], each[:, most:]), axis=1)
            setattr(self, name, np.column_stack([np.zeros(len(held)), held]))  # over the k cells to either side

    _lowest: Array
    _highest: Array

    def stretches(self, places: Array, feet: Feet, moves_mm: Array) -> Stretches:
        """Where the feet (m,) of places (m, 2) may be while these move by up to `moves_mm` (m,)."""
        station = feet.station_mm
        after = np.clip(np.searchsorted(self._nodes, station), 1, self._count)
        node = after - (station - self._nodes[after - 1] < self._nodes[after] - station)
        to_node = np.hypot(*(places - self._points[node]).T)
        k = self._cells_within(node, np.abs(feet.distance_mm) + 2 * moves_mm + to_node)
        low, high = self._station(node - k), self._station(node + k)
        slide = self._slide(feet.distance_mm, moves_mm, high - low, self._lowest[node, k], self._highest[node, k])
        slack = _ROUNDING * self._length
        return Stretches(np.maximum(low, station - slide) - slack, np.minimum(high, station + slide) + slack)

    def _cells_within(self, node: Rows, radius_mm: Array) -> Rows:
        """The fewest cells (m,) to either side of nodes (m,) beyond which the curve stays farther than a radius (m,) from them."""
        least, most = np.zeros(len(node), dtype=np.int64), np.full(len(node), self._clear.shape[1] - 1)
        while (least < most).any():
            middle = (least + most) // 2
            clear = self._clear[node, middle] > radius_mm
            least, most = np.where(clear, least, middle + 1), np.where(clear, middle, most)
        return np.maximum(least, 1)

    def _station(self, node: Rows) -> Array:
        """Stations (m,) of nodes (m,), which may lie a turn before the first or behind the last one of a closed curve."""
        if not self._closed:
            return self._nodes[np.clip(node, 0, self._count)]
        turn, inside = np.divmod(node, self._count)
        return self._nodes[inside] + turn * self._length

    def _slide(self, distance_mm: Array, moves_mm: Array, stretch_mm: Array, lowest: Array, highest: Array) -> Array:
        """How far (m,) feet may slide on smooth stretches (m,) with curvatures between bounds (m,); infinite where that is not known.

        Seen from the point, a place of the curve lies at p along its tangent and at q across it; p' = 1 - k q and q' = k p. While k q
        stays below 1, p rises along the stretch and is zero once, so the point has one foot there. From the foot on, over a length n,
        q changes by at most K n^2 / 2 times the largest p'.
        """
        bend = stretch_mm * np.maximum(-lowest, highest)
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            reach = np.abs(distance_mm) + moves_mm
            drift = np.where(bend < 1, bend * (stretch_mm + bend * reach) / (2 - bend * bend), np.inf)
            q = np.stack([distance_mm - moves_mm, distance_mm + moves_mm])
            one_foot = np.max([k * (side + way * drift) for k in (lowest, highest) for side in q for way in (-1, 1)], axis=0) < 1
            least = 1 - np.max([k * side for k in (lowest, highest) for side in q], axis=0)
            return np.where(one_foot & (least > 0), moves_mm / least, np.inf)


def _nodes(curve: NurbsCurve) -> Array:
    """Parameters, rising from one end to the other, corners among them, that cut the curve into cells."""
    u = np.linspace(*curve.domain, _SCOUTS)
    station = curve.station_mm(u)
    station[-1] = curve.length_mm
    steps = np.diff(station)
    turning = np.abs(curve.curvature((u[1:] + u[:-1]) / 2)) * steps
    closeness = steps / np.interp((station[1:] + station[:-1]) / 2, *_widths(curve))
    shares = [part / max(float(part.sum()), 1e-300) for part in (steps, turning, closeness)]
    passed = np.concatenate([[0.0], np.cumsum(np.sum(shares, axis=0))])
    return np.unique(np.concatenate([curve.domain, curve.corners, np.interp(np.linspace(0, passed[-1], _CELLS + 1), passed, u)]))


def _widths(curve: NurbsCurve) -> tuple[Array, Array]:
    """How near the curve comes to itself at stations (k,): distances (k,) to its nearest place that is twice as far along the curve."""
    u = np.linspace(*curve.domain, _FEW_SCOUTS)
    station, (x, y) = curve.station_mm(u), curve.point(u).T
    station[-1] = curve.length_mm
    along = np.abs(station[:, None] - station[None, :])
    if curve.closed:
        along = np.minimum(along, curve.length_mm - along)
    straight = np.hypot(x[:, None] - x[None, :], y[:, None] - y[None, :])
    nearest = np.where(along >= 2 * straight, straight, np.inf).min(axis=1, where=along > 0, initial=np.inf)
    return station, np.clip(nearest, _NARROWEST * curve.length_mm, curve.length_mm)


def _curvatures(curve: NurbsCurve, u: Array) -> tuple[Array, Array]:
    """Bounds (k,) of the curvature in cells between parameters u (k + 1,): of five places, and by as much again as these differ.

    Cells beside a corner or an open end have none: the bounds are infinite.
    """
    inside = u[:-1, None] + np.diff(u)[:, None] * np.array([0.25, 0.5, 0.75])
    ends = [curve.curvature(u[:-1]), curve.curvature(left_limit(u[1:], curve))]
    every = np.column_stack([*ends, curve.curvature(inside.reshape(-1)).reshape(inside.shape)])
    low, high = every.min(axis=1), every.max(axis=1)
    spread = high - low
    corner = np.isin(u, curve.corners)
    corner[[0, -1]] = corner[0] if curve.closed else True
    beside = corner[1:] | corner[:-1]
    return np.where(beside, -np.inf, low - spread), np.where(beside, np.inf, high + spread)


def _distance_to_cells(points: Array, lengths: Array, cell: Rows) -> Array:
    """How far nodes (k + 1, 2) are, at least, from all of a cell (k + 1, c).

    It is the distance to the chord of the cell, less by how much a curve of the cell's length can leave its chord: half the minor axis
    of the ellipse with the chord's ends as foci.
    """
    chords = np.diff(points, axis=0)
    square = np.maximum((chords * chords).sum(axis=1), 1e-300)
    leave = np.sqrt(np.maximum(lengths * lengths - square, 0.0)) / 2
    to_start = points[:, None, :] - points[None, :-1, :]
    share = np.clip((to_start * chords).sum(axis=2) / square, 0.0, 1.0)
    to_chord = np.hypot(*(to_start - share[:, :, None] * chords).transpose(2, 0, 1)) - leave
    return np.asarray(to_chord[np.arange(len(points))[:, None], cell])
