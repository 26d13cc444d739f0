"""Curves of a drawing as exact rational B-splines in space: lines, arcs of circles and ellipses, splines; nothing is flattened.

A piece is clamped: it begins at its first pole and ends at its last. It is held in homogeneous form, in which trimming, raising the
degree and joining are exact (Piegl and Tiller, The NURBS Book, chapters 5 and 7).
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inspection import NominalError

Array = NDArray[np.float64]

_GAUSS_NODES, _GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(16)
_QUARTER = np.pi / 2
_SAME_KNOT = 1e-12  # of the range of the knots
_MOST_DEGREE = 25


@dataclass(frozen=True, slots=True, eq=False)
class Piece:
    """One curve of a drawing, in the unit of the drawing.

    degree   : at least 1
    poles    : (k, 4) control points in homogeneous form: w x, w y, w z, w
    knots    : (k + degree + 1,) clamped at both ends
    layer    : the layer or level that it is drawn on; empty where the format has none
    name     : what its file calls it, like "SPLINE 2F"
    length   : the arc length, to about nine digits
    centroid : (3,) the centroid of the line
    """

    degree: int
    poles: Array
    knots: Array
    layer: str = ""
    name: str = ""
    length: float = field(init=False)
    centroid: Array = field(init=False)

    def __post_init__(self) -> None:
        length, centroid = _measures(self)
        object.__setattr__(self, "length", length)
        object.__setattr__(self, "centroid", centroid)
        for array in (self.poles, self.knots, centroid):
            array.setflags(write=False)

    @property
    def ends(self) -> Array:
        """Its first and its last point (2, 3)."""
        return self.points[[0, -1]]

    @property
    def points(self) -> Array:
        """Its control points (k, 3)."""
        return np.asarray(self.poles[:, :3] / self.poles[:, 3:])

    def derivatives(self, u: Array, order: int) -> Array:
        """Points and derivatives up to `order` (0 to 2) at the parameters u (m,): (order + 1, m, 3)."""
        from scipy.interpolate import BSpline  # noqa: PLC0415 - it takes a third of a second, and only drawings have pieces

        spline = BSpline(self.knots, self.poles, self.degree)
        given = [spline(u, nu) if nu <= self.degree else np.zeros((len(u), 4)) for nu in range(order + 1)]
        weight = given[0][:, 3:]
        told = [given[0][:, :3] / weight]
        if order > 0:
            told.append((given[1][:, :3] - given[1][:, 3:] * told[0]) / weight)
        if order > 1:
            told.append((given[2][:, :3] - 2 * given[1][:, 3:] * told[1] - given[2][:, 3:] * told[0]) / weight)
        return np.stack(told)


def polyline(points: ArrayLike) -> Piece:
    """Straight lines through points (m, 3), no two neighbours the same."""
    through = np.asarray(points, dtype=np.float64)
    at = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(through, axis=0), axis=1))])
    return Piece(1, np.column_stack([through, np.ones(len(through))]), np.concatenate([at[:1], at, at[-1:]]))


def conic_arc(center: ArrayLike, major: ArrayLike, minor: ArrayLike, start: float, end: float) -> Piece:
    """The arc center + major cos(t) + minor sin(t) for t from `start` to `end` (rad), as rational quadratics of at most 90 degrees."""
    middle, along, across = (np.asarray(vector, dtype=np.float64) for vector in (center, major, minor))
    count = max(1, int(np.ceil((end - start) / _QUARTER - 1e-9)))
    half = (end - start) / count / 2
    angle = start + half * np.arange(2 * count + 1)  # ends and middles of the quadratics in turn
    weight = np.where(np.arange(2 * count + 1) % 2, np.cos(half), 1.0)
    reach = 1 / weight[:, None]  # a middle pole lies where the tangents meet
    points = middle + reach * (np.cos(angle)[:, None] * along + np.sin(angle)[:, None] * across)
    if end - start >= 2 * np.pi - 1e-12:
        points[-1] = points[0]
    knots = np.concatenate([[start], np.repeat(angle[::2], 2), [end]])
    return Piece(2, np.column_stack([points * weight[:, None], weight]), knots)


def bulged(first: Array, last: Array, bulge: float) -> Piece:
    """The arc of a polyline from one point (3,) to another: the bulge is tan(angle / 4), positive counter-clockwise about z."""
    chord = last - first
    left = np.array([-chord[1], chord[0], 0.0])
    center = (first + last) / 2 + left * (1 - bulge * bulge) / (4 * bulge)
    out = first - center
    across = np.sign(bulge) * np.array([-out[1], out[0], 0.0])
    arc = conic_arc(center, out, across, 0.0, 4 * float(np.arctan(abs(bulge))))
    poles = arc.poles.copy()
    poles[0, :3], poles[-1, :3] = first, last
    return replace(arc, poles=poles)


def spline(
    degree: int, points: ArrayLike, knots: ArrayLike, weights: ArrayLike | None = None, trim: tuple[float, float] | None = None
) -> Piece:
    """A B-spline as files spell it: control points (k, 3), k + degree + 1 knots, weights (k,); clamped, and cut to the parameters `trim`.

    Raises NominalError for numbers that describe no curve.
    """
    at, t = np.asarray(points, dtype=np.float64), np.asarray(knots, dtype=np.float64)
    w = np.ones(len(at)) if weights is None else np.asarray(weights, dtype=np.float64)
    _require_spline(degree, at, t, w)
    first, last = (float(t[degree]), float(t[-degree - 1])) if trim is None else trim
    near = _SAME_KNOT * (t[-degree - 1] - t[degree])
    if not t[degree] - near <= first < last <= t[-degree - 1] + near:
        raise NominalError(f"the used part {first:g} .. {last:g} lies outside of the knots {t[degree]:g} .. {t[-degree - 1]:g}")
    poles = np.column_stack([at * w[:, None], w])
    poles, t = _clamp_start(degree, poles, t, max(first, float(t[degree])))
    poles, t = _turn(poles, t)
    poles, t = _clamp_start(degree, poles, t, -min(last, float(-t[degree])))
    poles, t = _turn(poles, t)
    return Piece(degree, poles, t)


def wrap(degree: int, points: Array, knots: Array, weights: Array | None) -> Piece:
    """A periodic spline spelt with a knot more than control points: its first `degree` points come again, its knots go on."""
    n, period = len(points), knots[-1] - knots[0]
    rounds = range(-(degree // n) - 1, degree // n + 2)
    every = np.concatenate([knots[:-1] + turn * period for turn in rounds])  # n knots a round
    first = -rounds[0] * n
    again = np.arange(n + degree) % n
    return spline(degree, points[again], every[first - degree : first + n + degree + 1], None if weights is None else weights[again])


def reverse(piece: Piece) -> Piece:
    """The same curve from its end to its beginning."""
    poles, knots = _turn(piece.poles, piece.knots)
    return replace(piece, poles=poles, knots=knots)


def join(pieces: Sequence[Piece], tolerance: float = 0.0) -> Piece:
    """One curve of pieces that follow one another, with the layer and the name of the first: a joint is a knot as often as the degree.

    Ends that are to meet lie as far apart as the drawing has them; the joint lies in their middle. Where the last one ends where the
    first begins, up to the tolerance, both become the same point.
    """
    degree = max(piece.degree for piece in pieces)
    poles: list[Array] = []
    knots: list[Array] = []
    at, weight = 0.0, float(pieces[0].poles[0, 3])
    for piece in pieces:
        own_poles, own_knots = _raise_degree(piece, degree)
        own_poles = own_poles * (weight / own_poles[0, 3])
        weight = float(own_poles[-1, 3])
        start, end = own_knots[0], own_knots[-1]
        own_knots = at + (own_knots - start) * (piece.length / (end - start))
        if poles:
            poles[-1] = np.vstack([poles[-1][:-1], (poles[-1][-1:] + own_poles[:1]) / 2])
            knots[-1] = knots[-1][:-1]
            own_poles, own_knots = own_poles[1:], own_knots[degree + 1 :]
        poles.append(own_poles)
        knots.append(own_knots)
        at += piece.length
    return _close(replace(pieces[0], degree=degree, poles=np.vstack(poles), knots=np.concatenate(knots)), tolerance)


def _close(piece: Piece, tolerance: float) -> Piece:
    """The piece with one point in place of its two ends, where these lie within the tolerance."""
    first, last = piece.ends
    if np.array_equal(first, last) or np.linalg.norm(last - first) > tolerance:
        return piece
    poles, middle = piece.poles.copy(), (first + last) / 2
    for end in (0, -1):
        poles[end, :3] = middle * poles[end, 3]
    return replace(piece, poles=poles)


def _require_spline(degree: int, points: Array, knots: Array, weights: Array) -> None:
    k = len(points)
    if not 1 <= degree <= _MOST_DEGREE:
        raise NominalError(f"the degree is {degree}; expected 1 to {_MOST_DEGREE}")
    if k <= degree or points.shape != (k, 3):
        raise NominalError(f"{k} control points; expected at least {degree + 1} for the degree {degree}")
    if len(knots) != k + degree + 1:
        raise NominalError(f"{len(knots)} knots; expected {k + degree + 1} for {k} control points of degree {degree}")
    if len(weights) != k:
        raise NominalError(f"{len(weights)} weights; expected {k}, one for each control point")
    if not all(np.isfinite(array).all() for array in (points, knots, weights)):
        raise NominalError("a control point, knot or weight is no finite number")
    if np.abs(points).max() > 1e12:
        raise NominalError(f"a control point lies at {np.abs(points).max():g}, beyond anything that a part can be")
    if (weights <= 0).any():
        raise NominalError(f"a weight of {weights.min():g}; expected positive weights")
    if (np.diff(knots) < 0).any() or knots[degree] >= knots[-degree - 1]:
        raise NominalError("the knots must not decrease, and must span a range")
    inside = knots[(knots > knots[degree]) & (knots < knots[-degree - 1])]
    if len(inside) and np.unique(inside, return_counts=True)[1].max() > degree:
        raise NominalError(f"an inner knot occurs more than {degree} times: the curve falls apart there")


def _clamp_start(degree: int, poles: Array, knots: Array, u: float) -> tuple[Array, Array]:
    """Cut off what lies before the parameter u, which becomes a knot of full multiplicity."""
    near = np.abs(knots - u) <= _SAME_KNOT * (knots[-1] - knots[0])
    u = float(knots[near][0]) if near.any() else u
    for _ in range(degree - int((knots == u).sum())):
        poles, knots = _insert(degree, poles, knots, u)
    last = int(np.searchsorted(knots, u, side="right")) - 1
    return poles[last - degree :], np.concatenate([[u], knots[last - degree + 1 :]])


def _insert(degree: int, poles: Array, knots: Array, u: float) -> tuple[Array, Array]:
    """Boehm's insertion of one knot; the curve stays what it is."""
    span = int(np.searchsorted(knots, u, side="right")) - 1
    i = np.arange(span - degree + 1, span + 1)
    share = ((u - knots[i]) / (knots[i + degree] - knots[i]))[:, None]
    moved = (1 - share) * poles[i - 1] + share * poles[i]
    return np.vstack([poles[: span - degree + 1], moved, poles[span:]]), np.insert(knots, span + 1, u)


def _turn(poles: Array, knots: Array) -> tuple[Array, Array]:
    return poles[::-1].copy(), -knots[::-1]


def _raise_degree(piece: Piece, degree: int) -> tuple[Array, Array]:
    """Poles and knots of the same curve at a higher degree; every knot then is as often there as the degree."""
    if degree == piece.degree:
        return piece.poles, piece.knots
    own, poles, knots = piece.degree, piece.poles, piece.knots
    borders = np.unique(knots)
    for u in borders[1:-1]:
        for _ in range(own - int((knots == u).sum())):
            poles, knots = _insert(own, poles, knots, float(u))
    beziers = [poles[i * own : (i + 1) * own + 1] for i in range(len(borders) - 1)]
    for now in range(own, degree):
        share = (np.arange(now + 2) / (now + 1))[:, None]
        beziers = [share * np.vstack([bezier[:1], bezier]) + (1 - share) * np.vstack([bezier, bezier[-1:]]) for bezier in beziers]
    raised = np.vstack([beziers[0], *(bezier[1:] for bezier in beziers[1:])])
    return raised, np.concatenate([borders[:1], np.repeat(borders, degree), borders[-1:]])


def _measures(piece: Piece) -> tuple[float, Array]:
    """Arc length and centroid, by sixteen nodes of Gauss and Legendre in each span of the knots."""
    borders = np.unique(piece.knots)
    if piece.degree == 1 and np.ptp(piece.poles[:, 3]) == 0:
        points = piece.points
        steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
        length = float(steps.sum())
        return length, (steps[:, None] * (points[1:] + points[:-1]) / 2).sum(axis=0) / length if length else points[0].copy()
    half = np.diff(borders) / 2
    u = (borders[:-1, None] + half[:, None] * (1 + _GAUSS_NODES)).ravel()
    points, first = piece.derivatives(u, 1)
    share = (half[:, None] * _GAUSS_WEIGHTS).ravel() * np.linalg.norm(first, axis=1)
    length = float(share.sum())
    return length, (share[:, None] * points).sum(axis=0) / length if length else points[0].copy()


def through_vertices(vertices: Array, bulges: Sequence[float]) -> Piece | None:
    """A polyline through vertices (m, 3) in its own plane, z constant, with the bulge behind each but the last; None without length."""
    parts: list[Piece] = []
    run = [vertices[0]]
    for (first, last), bulge in zip(pairwise(vertices), bulges, strict=True):
        if np.array_equal(first, last):
            continue
        if bulge == 0.0:
            run.append(last)
            continue
        parts += [polyline(run)] if len(run) > 1 else []
        parts.append(bulged(first, last, bulge))
        run = [last]
    parts += [polyline(run)] if len(run) > 1 else []
    return join(parts) if parts else None
