"""The nominals of the reference set: curves by numbers of few digits, which every format holds as they are."""

from collections.abc import Sequence
from decimal import Decimal
from functools import cache
from typing import Literal

from cmmlink.reference.exact_curve import ExactCurve
from cmmlink.reference.exact_numbers import Number, Pair, rounded, total

Places = Sequence[tuple[Number, Number]]


def _pairs(places: Places) -> tuple[Pair, ...]:
    return tuple((Decimal(x), Decimal(y)) for x, y in places)


def clamped(degree: int, places: Places, weights: Sequence[Number] = (), closed: bool = False) -> ExactCurve:
    """A curve on even whole-numbered knots, clamped at its ends."""
    spans = len(places) - degree
    knots = [0] * degree + list(range(spans + 1)) + [spans] * degree
    ones = weights or [1] * len(places)
    return ExactCurve(degree, tuple(map(Decimal, knots)), _pairs(places), tuple(map(Decimal, ones)), closed)


def pieces(places: Places, weights: Sequence[Number] = (), closed: bool = True, material: Literal["left", "right"] = "left") -> ExactCurve:
    """A curve of rational parabolas, each from one control point to the next but one: lines, arcs, and corners between them."""
    count = (len(places) - 1) // 2
    knots = [0] + [i for i in range(count + 1) for _ in range(2)] + [count]
    ones = weights or [1] * len(places)
    return ExactCurve(2, tuple(map(Decimal, knots)), _pairs(places), tuple(map(Decimal, ones)), closed, material)


def closed_cubic(places: Places) -> ExactCurve:
    """A smooth closed cubic by its periodic control points: multiples of 0.6, so that the clamped ones are decimal numbers of few digits.

    In blossoms, the periodic points are f(i - 1, i, i + 1); those of the clamped form are f(0, 0, 0), f(0, 0, 1), f(0, 1, 2), and so on.
    """
    ring = _pairs(places)
    k = len(ring)

    def mixed(*shares: int) -> Pair:
        """The points before, at and behind the seam, by shares."""
        x, y = (total(share * ring[i - 1][axis] for i, share in enumerate(shares)) for axis in (0, 1))
        return x / sum(shares), y / sum(shares)

    seam = mixed(1, 4, 1)
    points = (seam, mixed(0, 2, 1), *ring[1:], mixed(1, 2, 0), seam)
    knots = [0] * 4 + list(range(1, k)) + [k] * 4
    return ExactCurve(3, tuple(map(Decimal, knots)), points, (Decimal(1),) * len(points), True)


QUARTERS = (1, 1, 2, 1, 1, 1, 2, 1, 1)  # weights of four exact quarters: x = (1 - t^2) / (1 + t^2), there and back


@cache
def ellipse(a: Number, b: Number) -> ExactCurve:
    """An exact ellipse, counterclockwise from (a, 0)."""
    ring = [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1), (1, 0)]
    return pieces([(x * Decimal(a), y * Decimal(b)) for x, y in ring], QUARTERS)


@cache
def stadium(half_length: Number, radius: Number) -> ExactCurve:
    """Two straight parts and two exact half circles, counterclockwise from the lower left."""
    h, r = Decimal(half_length), Decimal(radius)
    right = [(h, -r), (h + r, -r), (h + r, Decimal(0)), (h + r, r), (h, r)]
    left = [(-x, -y) for x, y in right]
    lower, upper = (Decimal(0), -r), (Decimal(0), r)
    return pieces([left[-1], lower, *right, upper, *left], (1, 1, 1, 1, 2, 1, 1, 1, 1, 1, 2, 1, 1))


@cache
def lens() -> ExactCurve:
    """Two exact arcs of radius 50 that meet in two sharp edges, at (40, 0) and (-40, 0)."""
    half = "53.3333333333333"  # both tangents meet at 40 * 4 / 3 above the middle, and the arcs turn by atan2(4, 3) to either side
    return pieces([(40, 0), (0, half), (-40, 0), (0, f"-{half}"), (40, 0)], (1, "0.6", 1, "0.6", 1))


@cache
def angle_piece() -> ExactCurve:
    """The outline of an angle section, straight from corner to corner, counterclockwise; one corner of six is hollow."""
    corners = [(0, 0), (60, 0), (60, 20), (25, 20), (25, 50), (0, 50), (0, 0)]
    knots = [0, *range(7), 6]
    return ExactCurve(1, tuple(map(Decimal, knots)), _pairs(corners), (Decimal(1),) * 7, True)


@cache
def drop() -> ExactCurve:
    """A section with round edges: arcs of radius 6 about (0, 0) and 1.26 about (62.5, 0), joined by lines that touch both.

    The lines lean by asin(237 / 3125). The arcs are halves of the edges; the tangents of half their angles are 41 / 38 and 38 / 41.
    """
    large, small, length = Decimal(6), Decimal("1.26"), Decimal("62.5")
    sine, cosine = Decimal("0.07584"), Decimal("0.99712")
    front, back = (large * sine, large * cosine), (length + small * sine, small * cosine)
    nose, tail = (-large, rounded(large * 41 / 38)), (length + small, rounded(small * 38 / 41))
    upper = [tail, back, ((front[0] + back[0]) / 2, (front[1] + back[1]) / 2), front, nose]
    lower = [(x, -y) for x, y in reversed(upper)]
    start, middle = (length + small, Decimal(0)), (-large, Decimal(0))
    weights = (41, "62.5", "62.5", "62.5", 38)
    return pieces([start, *upper, middle, *lower, start], (50, *weights, 50, *reversed(weights), 50))


@cache
def bow() -> ExactCurve:
    """A bent section of even thickness: arcs of the radii 51.5 and 48.5 about (0, -40), and half circles of radius 1.5 around its ends.

    The middle line is an arc of radius 50 from (-30, 0) to (30, 0); all numbers are exact.
    """
    right: Places = [("31.2", "-0.9"), ("32.1", "0.3"), ("30.9", "1.2")]
    inner: Places = [("29.1", "-1.2"), ("30.3", "-2.1"), ("31.2", "-0.9")]

    def mirrored(places: Places) -> Places:
        return [(-Decimal(x), y) for x, y in reversed(places)]

    ring: Places = [*right, (0, "24.375"), *mirrored(right), *mirrored(inner)[1:], (0, "20.625"), *inner]
    return pieces(ring, (2, 1, 1, "0.8", 1, 1, 2, 1, 1, "0.8", 1, 1, 2))


@cache
def straight_line(length: Number) -> ExactCurve:
    """A straight line along x from the origin, the material below it."""
    return ExactCurve(1, tuple(map(Decimal, (0, 0, 1, 1))), _pairs([(0, 0), (length, 0)]), (Decimal(1),) * 2, False, "right")


@cache
def open_wave() -> ExactCurve:
    """An open cubic with hollows."""
    return clamped(3, [(0, 0), (12, 22), (30, 30), (48, 12), (66, -8), (86, 4), (100, 28), (122, 34), (140, 10)])


@cache
def rational_wave() -> ExactCurve:
    """An open rational cubic."""
    places = [(0, 0), (15, 26), (40, 34), (62, 12), (84, -4), (110, 12), (130, 40), (152, 30)]
    return clamped(3, places, (1, 1, "1.25", 1, "0.8", 1, "1.3", 1))


@cache
def cam() -> ExactCurve:
    """A smooth closed cubic with hollows and no symmetry."""
    ring: list[tuple[Number, Number]] = [
        (60, 0),
        ("52.2", "26.4"),
        (24, "34.2"),
        ("-4.2", 30),
        ("-34.2", 39),
        ("-58.2", 18),
        ("-51", "-8.4"),
        ("-28.2", "-26.4"),
    ]
    return closed_cubic([*ring, (6, "-19.8"), ("38.4", -30)])
