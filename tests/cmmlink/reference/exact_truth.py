"""The truth of written reference cases, found anew from their files alone: by mpmath at 50 digits, and by none of our code.

Curves are evaluated by the recursion of basis functions. The foot of a point is sought over the whole curve: between all samples that lie
nearer than the nearest one and a step, the equation of the foot is solved by bisection and secants; corners and ends count as well.
"""

import json
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from mpmath import mp, mpf
from numpy.typing import NDArray
from scipy.interpolate import BSpline

mp.dps = 50
Array = NDArray[np.float64]
SAMPLES = 6000
DIGITS = mpf(10) ** -13  # of a length of the size of the case: what rounding to 15 digits leaves of places, and more than of deviations


@dataclass(frozen=True)
class Foot:
    """The nearest place of a curve, the unit vector out of material there, and the signed distance of the point."""

    place: tuple[Any, Any]
    normal: tuple[Any, Any]
    deviation: Any

    @property
    def gradient(self) -> tuple[Any, Any, Any]:
        return self.normal[0], self.normal[1], self.place[0] * self.normal[1] - self.place[1] * self.normal[0]


class Written:
    """A case as its folder holds it; lengths in its unit."""

    def __init__(self, folder: Path) -> None:
        self.truth = json.loads((folder / "truth.json").read_text(encoding="ascii"), parse_float=mpf, parse_int=int)
        self.plan = yaml.safe_load((folder / "plan.yaml").read_text(encoding="ascii"))
        nominal = yaml.load((folder / "nominal.yaml").read_text(encoding="ascii"), yaml.BaseLoader)  # numbers as text
        scale = mpf("25.4") if self.truth["unit"] == "inch" else mpf(1)
        self.degree, self.closed = int(nominal["degree"]), nominal["closed"] == "true"
        self.knots = [mpf(knot) for knot in nominal["knots"]]
        self.control = [(mpf(x) / scale, mpf(y) / scale) for x, y in nominal["control_points_mm"]]
        self.weights = [mpf(weight) for weight in nominal.get("weights", ["1"] * len(self.control))]
        self.side = 1 if self.plan["nominal"]["material"] == "left" else -1
        rows = (folder / "points.csv").read_text(encoding="ascii").splitlines()
        assert rows[0] == f"x_{self.truth['unit']},y_{self.truth['unit']}"
        self.points = [(mpf(x), mpf(y)) for x, y in (row.split(",") for row in rows[1:])]
        self.size = max(max(abs(x), abs(y)) for x, y in [*self.points, *self.control])

    def basis(self, u: Any, degree: int, span: int) -> dict[int, Any]:
        """The basis functions of a degree that are not zero in a span, by the recursion of Cox and de Boor."""
        if degree == 0:
            return {span: mpf(1)}
        lower, found = self.basis(u, degree - 1, span), {}
        for i in range(span - degree, span + 1):
            value = mpf(0)
            for k, rising in ((i, True), (i + 1, False)):
                width = self.knots[k + degree] - self.knots[k]
                if k in lower and width:
                    value += lower[k] * ((u - self.knots[k]) if rising else (self.knots[k + degree] - u)) / width
            found[i] = value
        return found

    def place_and_rate(self, u: Any, span: int) -> tuple[tuple[Any, Any], tuple[Any, Any]]:
        """Place and derivative in a span of the knots."""
        p = self.degree
        value, lower = self.basis(u, p, span), self.basis(u, p - 1, span)
        rate = dict.fromkeys(value, mpf(0))
        for i in value:
            for k, sign in ((i, 1), (i + 1, -1)):
                width = self.knots[k + p] - self.knots[k]
                if k in lower and width:
                    rate[i] += sign * p * lower[k] / width

        def summed(shares: dict[int, Any]) -> tuple[Any, Any, Any]:
            terms = [(share * self.weights[i], *self.control[i]) for i, share in shares.items()]
            return sum(t[0] * t[1] for t in terms), sum(t[0] * t[2] for t in terms), sum(t[0] for t in terms)

        (a, b, w), (da, db, dw) = summed(value), summed(rate)
        x, y = a / w, b / w
        return (x, y), ((da - dw * x) / w, (db - dw * y) / w)

    @cached_property
    def spans(self) -> list[int]:
        return [i for i in range(self.degree, len(self.control)) if self.knots[i] < self.knots[i + 1]]

    @cached_property
    def samples(self) -> tuple[Array, Array, float]:
        """Parameters and places along the curve, denser than any detail, and the longest step between two of them."""
        weights = np.array([float(w) for w in self.weights])
        control = np.array([[float(x), float(y)] for x, y in self.control])
        curve = BSpline(np.array([float(k) for k in self.knots]), np.column_stack([control * weights[:, None], weights]), self.degree)
        each = [np.linspace(float(self.knots[i]), float(self.knots[i + 1]), SAMPLES // len(self.spans)) for i in self.spans]
        u = np.unique(np.concatenate(each))
        homogeneous = curve(u)
        places = homogeneous[:, :2] / homogeneous[:, 2:]
        return u, places, float(np.hypot(*np.diff(places, axis=0).T).max())

    def placed(self, point: tuple[Any, Any], pose: dict[str, Any] | None = None) -> tuple[Any, Any]:
        """A point where the known pose brings it."""
        pose = pose or self.truth["pose"]
        angle = mp.radians(pose["rotation_deg"])
        c, s, (x, y) = mp.cos(angle), mp.sin(angle), point
        return c * x - s * y + pose["translation"][0], s * x + c * y + pose["translation"][1]

    def foot(self, point: tuple[Any, Any]) -> Foot:
        """The foot of a placed point, sought over the whole curve."""
        u, places, step = self.samples
        away = np.hypot(*(places - np.array([float(point[0]), float(point[1])])).T)
        near = np.flatnonzero(away <= away.min() + step)
        found = []
        for first, last in _runs(near, len(u)):
            found += self._candidates(point, float(u[first]), float(u[last]))
        distance, at, normal = min(found, key=lambda each: each[0])
        outside = (point[0] - at[0]) * normal[0] + (point[1] - at[1]) * normal[1] > 0
        return Foot(at, self._direction(point, at, normal), distance if outside else -distance)

    def _direction(self, point: tuple[Any, Any], at: tuple[Any, Any], normal: tuple[Any, Any]) -> tuple[Any, Any]:
        """The unit vector from the foot to the point, turned out of material; the normal where the point is too near to tell."""
        dx, dy = point[0] - at[0], point[1] - at[1]
        size = mp.hypot(dx, dy)
        if size < self.size * mpf(10) ** -9:
            return normal
        sign = 1 if dx * normal[0] + dy * normal[1] > 0 else -1
        return sign * dx / size, sign * dy / size

    def _candidates(self, point: tuple[Any, Any], low: float, high: float) -> list[tuple[Any, tuple[Any, Any], tuple[Any, Any]]]:
        """The feet in a range of parameters: where the tangent is square to the way to the point, and the borders of spans."""
        found = []
        for span in self.spans:
            first, last = max(mpf(low), self.knots[span]), min(mpf(high), self.knots[span + 1])
            if first >= last:
                continue

            def along(u: Any, span: int = span) -> Any:
                (x, y), (dx, dy) = self.place_and_rate(u, span)
                return ((x - point[0]) * dx + (y - point[1]) * dy) / mp.hypot(dx, dy)

            ends = (along(first), along(last))
            roots = [first, last] if ends[0] * ends[1] > 0 else [mp.findroot(along, (first, last), solver="anderson", tol=mpf(10) ** -80)]
            for root in roots:
                (x, y), _ = self.place_and_rate(root, span)
                found.append((mp.hypot(x - point[0], y - point[1]), (x, y), self._normal(root)))
        return found

    def _normal(self, u: Any) -> tuple[Any, Any]:
        """The unit vector out of material; at a corner, or at the seam of a closed curve, the mean of both sides."""
        ends = self.knots[self.degree], self.knots[-self.degree - 1]
        at = {u, *(ends if self.closed and u in ends else ())}
        rates = [self.place_and_rate(each, i)[1] for i in self.spans for each in at if self.knots[i] <= each <= self.knots[i + 1]]
        units = [(self.side * dy / mp.hypot(dx, dy), -self.side * dx / mp.hypot(dx, dy)) for dx, dy in rates]
        x, y = (sum(unit[k] for unit in units) for k in (0, 1))
        return x / mp.hypot(x, y), y / mp.hypot(x, y)


def _runs(near: NDArray[np.int64], count: int) -> list[tuple[int, int]]:
    """First and last sample around every run of near ones."""
    cuts = np.flatnonzero(np.diff(near) > 1)
    firsts, lasts = [near[0], *near[cuts + 1]], [*near[cuts], near[-1]]
    return [(max(int(a) - 1, 0), min(int(b) + 1, count - 1)) for a, b in zip(firsts, lasts, strict=True)]


def check_deviations(case: Written, rows: range | list[int]) -> dict[int, Foot]:
    """Every known deviation of these rows is the distance to the curve, less the radius of the ball. Returns the feet."""
    stated, found = case.truth["deviation"], {}
    for row in rows:
        if stated[row] is None:
            continue
        foot = case.foot(case.placed(case.points[row]))
        assert abs(foot.deviation - case.truth["tip_radius"] - stated[row]) <= _last_digit(stated[row], case.size), row
        found[row] = foot
    return found


def _last_digit(value: Any, size: Any) -> Any:
    """Half a unit of the fifteenth digit of a number, and the square of what rounding moved the point by."""
    return mpf("0.51") * mpf(10) ** (mp.floor(mp.log10(abs(value))) - 14) + size * mpf(10) ** -26 if value else size * mpf(10) ** -26


def check_sums(case: Written) -> None:
    """The root mean square and the worst point are those of the deviations."""
    told = [d for d in case.truth["deviation"] if d is not None]
    rms = mp.sqrt(mp.fsum(d * d for d in told) / len(told))
    assert abs(rms - case.truth["rms"]) <= _last_digit(rms, 1) + mpf(10) ** -15 * max(map(abs, told))
    if "worst" in case.truth:
        worst = case.truth["worst"]
        assert worst["deviation"] == case.truth["deviation"][worst["row"]]
        assert abs(worst["deviation"]) == max(map(abs, told))
        place = case.placed(case.points[worst["row"]])
        assert max(abs(place[0] - worst["x"]), abs(place[1] - worst["y"])) <= case.size * mpf(10) ** -14


def check_least_squares(case: Written, feet: dict[int, Foot]) -> None:
    """The deviations of all points are orthogonal to every small motion."""
    stated = case.truth["deviation"]
    largest = max(abs(d) for d in stated if d is not None)
    for k, size in enumerate((1, 1, case.size)):
        balance = mp.fsum(foot.gradient[k] * stated[row] for row, foot in feet.items()) / (len(feet) * size)
        assert abs(balance) <= DIGITS * case.size + largest * mpf(10) ** -14


def check_held(case: Written, hold: dict[str, Any], value: Any, halves: dict[int, Any], middles: dict[int, Any]) -> None:
    """Equal shares at the points that hold an optimum, whose weighted gradients cancel; no motion improves on them all."""
    rows, multipliers, stated = hold["held_by"], hold["multipliers"], case.truth["deviation"]
    feet = {row: case.foot(case.placed(case.points[row])) for row in rows}
    assert all(m > mpf("0.05") for m in multipliers)
    assert abs(mp.fsum(multipliers) - 1) < mpf(10) ** -13
    shares = [(stated[row] - middles[row]) / halves[row] for row in rows]
    assert max(abs(abs(share) - value) for share in shares) <= DIGITS * case.size / min(halves.values())
    assert abs(mp.fsum(m * abs(share) for m, share in zip(multipliers, shares, strict=True)) - value) <= value * mpf(10) ** -13
    arm = max(mp.hypot(*foot.place) for foot in feet.values())
    scaled = [[g / s / halves[row] for g, s in zip(feet[row].gradient, (1, 1, arm), strict=True)] for row in rows]
    for k in range(3):
        total = mp.fsum(m * mp.sign(share) * row[k] for m, share, row in zip(multipliers, shares, scaled, strict=True))
        assert abs(total) <= DIGITS * 100 / min(halves.values())
    # Three of the four gradients already determine a motion, so that the optimum is one place and no ridge.
    three = mp.matrix([[g * halves[row] for g in each] for row, each in zip(rows[:3], scaled, strict=False)])
    assert abs(mp.det(three)) > mpf("0.005")


def check_zone(case: Written) -> None:
    """The minimum zone, by its certificate."""
    zone, stated = case.truth["zone"], case.truth["deviation"]
    scale = mpf("25.4") if case.truth["unit"] == "inch" else 1
    lower, upper = (mpf(repr(float(limit))) / scale for limit in case.truth["limits_mm"])
    middle, half = (lower + upper) / 2, zone["value"] / 2
    others = [abs(d - middle) for row, d in enumerate(stated) if row not in zone["held_by"]]
    assert max(others) < mpf("0.8") * half
    check_held(case, zone, half, dict.fromkeys(zone["held_by"], mpf(1)), dict.fromkeys(zone["held_by"], middle))


def check_consumption(case: Written) -> None:
    """The least consumption, by its certificate; limits by the stations of the points."""
    hold, stated = case.truth["consumption"], case.truth["deviation"]
    zone = case.plan["characteristics"][0]["zone"]
    _, places, _ = case.samples
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(places, axis=0).T))])
    placed = np.array([[float(v) for v in case.placed(point)] for point in case.points])
    station = along[[int(np.argmin(np.hypot(*(places - place).T))) for place in placed]]
    s, period = np.array(zone["stations_mm"]), along[-1] if case.closed else None
    low, high = (np.interp(station, s, zone[name], period=period) for name in ("lower_mm", "upper_mm"))
    consumed = np.abs(2 * np.array([float(d) for d in stated]) - low - high) / (high - low)
    held = hold["held_by"]
    assert np.delete(consumed, held).max() < 0.8 * float(hold["value"])
    for row in held:  # limits there are those of both neighbours, so that stations need no digits
        k = next(k for k, (a, b) in enumerate(pairwise(s)) if a + 0.5 < station[row] < b - 0.5)
        assert (zone["lower_mm"][k], zone["upper_mm"][k]) == (zone["lower_mm"][k + 1], zone["upper_mm"][k + 1])
    limits = {row: (mpf(repr(round(float(low[row]), 6))), mpf(repr(round(float(high[row]), 6)))) for row in held}
    halves, middles = ({row: (b + way * a) / 2 for row, (a, b) in limits.items()} for way in (-1, 1))
    check_held(case, hold, hold["value"], halves, middles)
