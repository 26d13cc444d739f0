"""NURBS curves in the plane: points, exact derivatives, curvature, arc length, interpolation.

A curve is a rational B-spline in homogeneous form; the quotient rule makes its derivatives of those of the B-spline.
A closed curve is either periodic (wrapped control points, smooth seam) or clamped with equal ends (a corner at the seam).
"""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inspection.b_spline import evaluate_b_spline
from inspection.errors import NominalError
from inspection.first_use import OnFirstUse
from inspection.kernels import Spline, spline_derivatives

Array = NDArray[np.float64]

_GAUSS_NODES, _GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(8)
_CORNER_SINE = 1e-6  # rad; a smaller turn of the tangent is round-off in the control points, not a corner
_CLOSURE = 1e-9  # allowed gap of a closed curve, as a fraction of its size


@dataclass(frozen=True, slots=True, eq=False)
class NurbsCurve:
    """A planar rational B-spline curve.

    degree            : at least 1
    control_points_mm : (k, 2); a periodic curve repeats its first `degree` points at the end
    knots             : (k + degree + 1,) non-decreasing
    weights           : (k,) positive; None means all one
    closed            : the curve ends where it begins; parameters then wrap around
    corners           : (c,) parameters at which the tangent turns; the seam of a closed curve counts as its start

    Raises NominalError when the arrays do not describe a connected curve of positive length.
    """

    degree: int
    control_points_mm: Array
    knots: Array
    weights: Array | None = None
    closed: bool = False
    corners: Array = field(init=False)
    _homogeneous: Array = field(init=False, repr=False)  # (k, 3) of w x, w y, w
    _along: "OnFirstUse[tuple[Array, Array]]" = field(init=False, repr=False)  # see `_arc_length_table`: most drawn curves need none

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "control_points_mm", np.array(self.control_points_mm, dtype=np.float64))
        put(self, "knots", np.array(self.knots, dtype=np.float64))
        weights = np.ones(len(self.control_points_mm)) if self.weights is None else np.array(self.weights, dtype=np.float64)
        put(self, "weights", weights)
        self._check_arrays()
        put(self, "_homogeneous", np.column_stack([self.control_points_mm * weights[:, None], weights]))
        self._check_geometry()
        put(self, "_along", OnFirstUse(lambda: _arc_length_table(self)))
        put(self, "corners", _corners(self))
        for array in (self.control_points_mm, self.knots, weights, self._homogeneous, self.corners):
            array.setflags(write=False)

    def __repr__(self) -> str:
        ends = "closed" if self.closed else "open"
        return f"<NurbsCurve of degree {self.degree}, {len(self.control_points_mm)} control points, {self.length_mm:.6g} mm long, {ends}>"

    @property
    def domain(self) -> tuple[float, float]:
        """First and last parameter of the curve."""
        return float(self.knots[self.degree]), float(self.knots[-self.degree - 1])

    @property
    def spline(self) -> Spline:
        """The curve as compiled loops take it."""
        return Spline(self.knots, self._homogeneous, self.degree)

    @property
    def length_mm(self) -> float:
        """Arc length, to 1e-12 relative."""
        return float(self._along.value[1][-1])

    @classmethod
    def interpolate(
        cls, points_mm: ArrayLike, degree: int = 3, closed: bool = False, corner_at_seam: bool = False, ends_along_chords: bool = False
    ) -> "NurbsCurve":
        """Curve through points (m, 2) in order, centripetal parameter scaled to [0, 1] (Lee 1989).

        `closed` joins the last point to the first, smoothly, or with a corner there (`corner_at_seam`: a sharp trailing edge).
        A last point equal to the first is taken as that join. `ends_along_chords` (degree 3, an open curve or a corner at the
        seam): the curve leaves its first point in the direction of the second, and reaches its last from that of the one before.
        Raises NominalError for too few or coinciding neighbours.
        """
        from scipy.interpolate import make_interp_spline  # noqa: PLC0415 - it takes a third of a second, and most curves come as they are

        points = _check_neighbours(np.array(points_mm, dtype=np.float64), degree, closed)
        steps = np.sqrt(np.linalg.norm(np.diff(points, axis=0), axis=1))
        parameter = np.concatenate([[0.0], np.cumsum(steps)])
        parameter /= parameter[-1]
        smooth = closed and not corner_at_seam
        if ends_along_chords and (smooth or degree != 3):
            raise NominalError("ends along chords need a curve of degree 3 with two ends, or with a corner at the seam")
        first, last = (points[i + 1] - points[i] for i in (0, -2))
        conditions: Any = "periodic" if smooth else None
        if ends_along_chords:
            conditions = ([(1, first / parameter[1])], [(1, last / (1 - parameter[-2]))])
        spline = make_interp_spline(parameter, points, k=degree, bc_type=conditions)
        return cls(degree, spline.c, spline.t, closed=closed)

    def point(self, u: ArrayLike) -> Array:
        """Points (m, 2) at the parameters u (m,)."""
        return np.asarray(self.derivatives(u, 0)[0])

    def derivatives(self, u: ArrayLike, order: int) -> Array:
        """Point and derivatives by u up to `order`: (order + 1, m, 2). At a corner the side of larger u counts."""
        parameter = self._bring_inside(np.atleast_1d(np.asarray(u, dtype=np.float64)))
        result = np.zeros((order + 1, len(parameter), 2))
        weight = np.zeros((order + 1, len(parameter)))
        highest = min(order, self.degree)
        homogeneous = evaluate_b_spline(self.knots, self._homogeneous, self.degree, parameter, highest)  # (highest + 1, m, 3)
        result[: highest + 1], weight[: highest + 1] = homogeneous[:, :, :2], homogeneous[:, :, 2]
        for nu in range(order + 1):  # Leibniz on A = w C: C(nu) = (A(nu) - sum binomial w(j) C(nu - j)) / w
            binomial = 1
            for j in range(1, nu + 1):
                binomial = binomial * (nu - j + 1) // j
                result[nu] -= binomial * weight[j][:, None] * result[nu - j]
            result[nu] /= weight[0][:, None]
        return result

    def few_derivatives(self, u: ArrayLike, order: int) -> Array:
        """The same to the last bit by a compiled loop, for searches that ask for few places again and again."""
        parameter = self._bring_inside(np.atleast_1d(np.asarray(u, dtype=np.float64)))
        return spline_derivatives(self.spline, parameter, order)

    def curvature(self, u: ArrayLike) -> Array:
        """Signed curvature (m,) in 1/mm, positive where the curve turns left."""
        _, first, second = self.derivatives(u, 2)
        speed = np.hypot(first[:, 0], first[:, 1])
        return np.asarray((first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]) / (speed * speed * speed))

    def station_mm(self, u: ArrayLike) -> Array:
        """Arc length (m,) from the start of the curve to the parameters u (m,)."""
        parameter = self._bring_inside(np.atleast_1d(np.asarray(u, dtype=np.float64)))
        borders, stations = self._along.value
        piece = np.clip(np.searchsorted(borders, parameter, side="right") - 1, 0, len(borders) - 2)
        return np.asarray(stations[piece] + _arc_length(self, borders[piece], parameter))

    def _bring_inside(self, u: Array) -> Array:
        """Parameters (m,) wrapped into the domain of a closed curve. Raises ValueError for those outside that of an open one."""
        start, end = self.domain
        if self.closed:
            inside = (u >= start) & (u <= end)
            return u if inside.all() else np.where(inside, u, start + np.mod(u - start, end - start))
        slack = 1e-12 * (end - start)
        if not ((u >= start - slack) & (u <= end + slack)).all():
            raise ValueError(f"parameter outside [{start}, {end}] of an open curve: {u.min()} .. {u.max()}")
        return np.minimum(np.maximum(u, start), end)

    def _check_arrays(self) -> None:
        k = len(self.control_points_mm)
        if self.degree < 1:
            raise NominalError(f"degree must be at least 1, not {self.degree}")
        if self.control_points_mm.shape != (k, 2) or k < self.degree + 1:
            raise NominalError(
                f"degree {self.degree} needs at least {self.degree + 1} control points (k, 2), got {self.control_points_mm.shape}"
            )
        if self.knots.shape != (k + self.degree + 1,):
            raise NominalError(f"{k} control points of degree {self.degree} need {k + self.degree + 1} knots, got {self.knots.size}")
        assert self.weights is not None
        if self.weights.shape != (k,) or not np.all(self.weights > 0):
            raise NominalError(f"weights must be {k} positive numbers")
        if not all(np.all(np.isfinite(array)) for array in (self.control_points_mm, self.knots, self.weights)):
            raise NominalError("control points, knots and weights must be finite numbers")
        if np.any(np.diff(self.knots) < 0) or self.domain[0] >= self.domain[1]:
            raise NominalError("knots must not decrease and must span a range")
        inside = self.knots[(self.knots > self.domain[0]) & (self.knots < self.domain[1])]
        if inside.size and np.unique(inside, return_counts=True)[1].max() > self.degree:
            raise NominalError(f"an inner knot occurs more than {self.degree} times: the curve would fall apart there")

    def _check_geometry(self) -> None:
        size = float(np.ptp(self.control_points_mm, axis=0).max())
        if size == 0:
            raise NominalError("all control points coincide")
        if self.closed:
            first, last = self.point(np.array(self.domain))
            if np.hypot(*(last - first)) > _CLOSURE * size:
                raise NominalError(f"a closed curve must end where it begins: the gap is {np.hypot(*(last - first)):.6g} mm")


def _check_neighbours(points: Array, degree: int, closed: bool) -> Array:
    """The points, with the first one repeated at the end of a closed curve. Raises NominalError for too few or coinciding ones."""
    if points.ndim != 2 or points.shape[1] != 2 or not np.all(np.isfinite(points)):
        raise NominalError(f"points must be finite (m, 2), got shape {points.shape}")
    if closed and len(points) and not np.array_equal(points[0], points[-1]):
        points = np.vstack([points, points[:1]])
    needed = degree + 2 if closed else degree + 1
    if len(points) < needed:
        raise NominalError(
            f"a curve of degree {degree} needs at least {degree + 1} distinct points, got {len(points) - int(closed and len(points) > 0)}"
        )
    alike = np.flatnonzero(np.all(points[1:] == points[:-1], axis=1))
    if alike.size:
        raise NominalError(
            f"points {alike[0] + 1} and {alike[0] + 2} coincide at ({points[alike[0], 0]:g}, {points[alike[0], 1]:g}); remove one"
        )
    return points


def _speed(curve: NurbsCurve, u: Array) -> Array:
    """Arc length per unit of the parameter, in the shape of u."""
    first = curve.derivatives(u.ravel(), 1)[1]
    return np.asarray(np.hypot(first[:, 0], first[:, 1]).reshape(u.shape))


def _arc_length(curve: NurbsCurve, start: Array, end: Array) -> Array:
    """Eight-point Gauss-Legendre arc length (m,) between paired parameters."""
    half = (end - start) / 2
    nodes = (start + end)[:, None] / 2 + half[:, None] * _GAUSS_NODES  # (m, 8)
    return np.asarray((_speed(curve, nodes) * _GAUSS_WEIGHTS).sum(axis=1) * half)


def _arc_length_table(curve: NurbsCurve) -> tuple[Array, Array]:
    """Parameters (b,) that cut the curve finely enough for Gauss-Legendre to be exact to round-off, and the arc lengths up to them (b,).

    Every knot span is halved until that changes its arc length by no more than round-off.
    """
    start, end = curve.domain
    spans = np.unique(np.clip(curve.knots, start, end))
    left, right = spans[:-1], spans[1:]
    whole = _arc_length(curve, left, right)
    scale = whole.sum()
    done_left: list[Array] = []
    done_length: list[Array] = []
    for _ in range(30):  # a cusp never converges: thirty halvings leave an error below 1e-9 of its span
        middle = (left + right) / 2
        halves = np.stack([_arc_length(curve, left, middle), _arc_length(curve, middle, right)])  # (2, spans)
        good = np.abs(halves.sum(axis=0) - whole) <= 1e-13 * scale
        done_left.append(left[good])
        done_length.append(halves.sum(axis=0)[good])
        left, right, whole = (
            np.concatenate([left[~good], middle[~good]]),
            np.concatenate([middle[~good], right[~good]]),
            np.concatenate([halves[0][~good], halves[1][~good]]),
        )
        if not left.size:
            break
    done_left.append(left)
    done_length.append(whole)
    borders, lengths = np.concatenate(done_left), np.concatenate(done_length)
    order = np.argsort(borders)
    stations, borders = np.concatenate([[0.0], np.cumsum(lengths[order])]), np.append(borders[order], end)
    stations.setflags(write=False)
    borders.setflags(write=False)
    return borders, stations


def _corners(curve: NurbsCurve) -> Array:
    """Parameters where the unit tangent jumps: knots of full multiplicity, and the seam of a closed curve."""
    start, end = curve.domain
    values, counts = np.unique(curve.knots, return_counts=True)
    candidates = values[(counts >= curve.degree) & (values > start) & (values < end)]
    if curve.closed:
        candidates = np.concatenate([[start], candidates])
    if not candidates.size:
        return candidates
    before = unit_vectors(curve.derivatives(left_limit(candidates, curve), 1)[1])
    after = unit_vectors(curve.derivatives(candidates, 1)[1])
    sine = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
    cosine = (before * after).sum(axis=1)
    return np.asarray(candidates[(np.abs(sine) > _CORNER_SINE) | (cosine < 0)])


def left_limit(u: Array, curve: NurbsCurve) -> Array:
    """Parameters in the span before u (m,), as close to u as can be, so that derivatives there are left-hand ones."""
    start, end = curve.domain
    return np.where(u <= start, end, np.where(u >= end, end, np.nextafter(u, -np.inf)))


def unit_vectors(vectors: Array) -> Array:
    """Vectors (m, 2) scaled to length one."""
    return np.asarray(vectors / np.hypot(vectors[:, 0], vectors[:, 1])[:, None])
