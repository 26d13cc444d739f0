"""Curves whose control points are numbers of a file, evaluated with 50 digits: where a point of them lies, and where its normal points."""

from dataclasses import dataclass, field
from decimal import Decimal
from itertools import pairwise
from typing import Literal, NamedTuple

from cmmlink.reference.case import ReferenceNominal
from cmmlink.reference.exact_numbers import Number, Pair, as_array, as_pairs, rounded

Row = tuple[Decimal, Decimal, Decimal]  # a control point in homogeneous coordinates

_STEPS = 48  # of a span: polygons whose lengths stand for arc lengths where points are spread


class Foot(NamedTuple):
    """A place of a curve, and the unit vector that points from there out of the material."""

    x: Decimal
    y: Decimal
    nx: Decimal
    ny: Decimal

    @property
    def gradient(self) -> tuple[Decimal, Decimal, Decimal]:
        """How fast the deviation of a point above this foot grows by a shift along x, one along y, and a rotation about the origin."""
        return self.nx, self.ny, self.x * self.ny - self.y * self.nx


@dataclass(frozen=True)
class ExactCurve:
    """A NURBS curve by the numbers that its files hold.

    knots, places, weights : of the control points, 15 digits at most
    material               : the side on which the material lies, seen along the curve
    """

    degree: int
    knots: tuple[Decimal, ...]
    places: tuple[Pair, ...]
    weights: tuple[Decimal, ...]
    closed: bool
    material: Literal["left", "right"] = "left"
    _lengths: list[tuple[Decimal, Decimal]] = field(default_factory=list, repr=False, compare=False)

    @property
    def nominal(self) -> ReferenceNominal:
        """The curve as its files hold it."""
        weights = None if all(weight == 1 for weight in self.weights) else as_array(self.weights)
        return ReferenceNominal(self.degree, as_array(self.knots), as_pairs(self.places), weights, self.closed, self.material)

    def scaled(self, factor: Number) -> "ExactCurve":
        """The same curve in another size."""
        places = tuple((x * Decimal(factor), y * Decimal(factor)) for x, y in self.places)
        return ExactCurve(self.degree, self.knots, places, self.weights, self.closed, self.material)

    def reversed(self) -> "ExactCurve":
        """The same curve from its end to its beginning, the material on the other side of it."""
        knots = tuple(self.knots[0] + self.knots[-1] - knot for knot in self.knots[::-1])
        side: Literal["left", "right"] = "right" if self.material == "left" else "left"
        return ExactCurve(self.degree, knots, self.places[::-1], self.weights[::-1], self.closed, side)

    @property
    def arm(self) -> Decimal:
        """Half the largest distance of a control point from the origin: a lever by which rotations are counted."""
        return max((x * x + y * y).sqrt() for x, y in self.places) / 2

    @property
    def domain(self) -> Pair:
        """The first and the last parameter."""
        return self.knots[self.degree], self.knots[-self.degree - 1]

    def foot(self, u: Decimal) -> Foot:
        """The place at a parameter, with its outward normal."""
        (x, y), (dx, dy) = self.place_and_rate(u)
        size = (dx * dx + dy * dy).sqrt()
        side = 1 if self.material == "left" else -1
        return Foot(x, y, side * dy / size, -side * dx / size)

    def place_and_rate(self, u: Decimal) -> tuple[Pair, Pair]:
        """The place at a parameter and its derivative, by de Boor's algorithm on homogeneous coordinates."""
        p, knots = self.degree, self.knots
        span = next((i for i in range(p, len(self.places)) if knots[i] <= u < knots[i + 1]), None)
        if span is None:  # the last parameter belongs to the last span that has a length
            span = max(i for i in range(p, len(self.places)) if knots[i] < knots[i + 1])
        rows = [
            (weight * x, weight * y, weight)
            for (x, y), weight in zip(self.places[span - p : span + 1], self.weights[span - p : span + 1], strict=True)
        ]
        for level in range(1, p):
            rows = [
                _between(rows[j - 1], rows[j], (u - knots[low]) / (knots[low + p - level + 1] - knots[low]))
                for j in range(1, len(rows))
                for low in (span - p + level + j - 1,)
            ]
        start, length = knots[span], knots[span + 1] - knots[span]
        a, b, w = _between(rows[0], rows[1], (u - start) / length)
        da, db, dw = ((late - early) * p / length for early, late in zip(rows[0], rows[1], strict=True))
        x, y = a / w, b / w
        return (x, y), ((da - dw * x) / w, (db - dw * y) / w)

    def spread(self, count: int, first: Number = 0, last: Number = 1) -> list[Decimal]:
        """Parameters (count,) at the middles of shares of the length between two shares of it, even to a few per mille."""
        if not self._lengths:
            self._lengths.extend(self._measured())
        lengths, total = self._lengths, self._lengths[-1][0]
        begin, share = Decimal(first) * total, (Decimal(last) - Decimal(first)) * total / count
        found, at = [], 0
        for i in range(count):
            wanted = begin + share * (2 * i + 1) / 2
            while lengths[at + 1][0] < wanted:
                at += 1
            (s0, u0), (s1, u1) = lengths[at], lengths[at + 1]
            found.append(rounded(u0 + (u1 - u0) * (wanted - s0) / (s1 - s0)))
        return found

    def _measured(self) -> list[tuple[Decimal, Decimal]]:
        """The length of a polygon up to each of its corners, and the parameter there."""
        ends = sorted({knot for knot in self.knots if self.domain[0] <= knot <= self.domain[1]})
        grid = [low + (high - low) * i / _STEPS for low, high in pairwise(ends) for i in range(_STEPS)]
        found: list[tuple[Decimal, Decimal]] = []
        travelled, before = Decimal(0), self.place_and_rate(ends[0])[0]
        for u in [*grid, ends[-1]]:
            x, y = self.place_and_rate(u)[0]
            travelled += ((x - before[0]) ** 2 + (y - before[1]) ** 2).sqrt()
            before = (x, y)
            found.append((travelled, u))
        return found


def _between(a: Row, b: Row, share: Decimal) -> Row:
    return a[0] + (b[0] - a[0]) * share, a[1] + (b[1] - a[1]) * share, a[2] + (b[2] - a[2]) * share
