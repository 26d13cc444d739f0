"""A face of a CAD part as a B-spline surface, rational or not, evaluated on grids of its parameters."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inspection.b_spline import evaluate_b_spline
from inspection.errors import NominalError

Array = NDArray[np.float64]

_MOST_DEGREE = 25  # of Open CASCADE and of IGES readers; a higher one is a broken file


@dataclass(frozen=True, slots=True, eq=False)
class SplineFace:
    """A spline surface S(u, v) over the whole rectangle of its parameters: its loop is the border of that rectangle.

    degree            : in u and in v
    control_points_mm : (a, b, 3)
    knots_u, knots_v  : (a + degree + 1,) and (b + degree + 1,), non-decreasing; a closed direction comes unwrapped, its ends alike
    weights           : (a, b), positive; None where it is not rational
    reversed          : the outside is against S_u x S_v
    name              : what results call it

    Raises NominalError where these do not fit together.
    """

    degree: tuple[int, int]
    control_points_mm: Array
    knots_u: Array
    knots_v: Array
    weights: Array | None = None
    reversed: bool = False
    name: str = ""

    def __post_init__(self) -> None:
        points = self.control_points_mm
        if points.ndim != 3 or points.shape[2] != 3 or not np.isfinite(points).all():
            raise NominalError(f"face {self.name}: control points must be finite and have shape (a, b, 3), got {points.shape}")
        for axis, (degree, knots) in enumerate(zip(self.degree, (self.knots_u, self.knots_v), strict=True)):
            count = points.shape[axis]
            if not 1 <= degree <= min(_MOST_DEGREE, count - 1) or knots.shape != (count + degree + 1,):
                raise NominalError(
                    f"face {self.name}: degree {degree}, {count} control points and {len(knots)} knots in {'uv'[axis]} do not fit together"
                )
            if not (np.isfinite(knots).all() and (np.diff(knots) >= 0).all() and knots[degree] < knots[count]):
                raise NominalError(f"face {self.name}: the knots in {'uv'[axis]} must not decrease, and must span a length")
        if self.weights is not None and not (self.weights.shape == points.shape[:2] and (self.weights > 0).all()):
            raise NominalError(f"face {self.name}: weights must be positive and have shape {points.shape[:2]}")

    @property
    def is_polynomial(self) -> bool:
        """Whether every knot span is a polynomial as it stands."""
        return self.weights is None or bool((self.weights == self.weights.flat[0]).all())

    def breaks(self, axis: int) -> tuple[Array, NDArray[np.bool_]]:
        """The parameters (k,) at which knot spans in u (0) or v (1) begin and end, and whether the surface may have a crease there (k,)."""
        degree, knots = self.degree[axis], (self.knots_u, self.knots_v)[axis]
        start, end = knots[degree], knots[-degree - 1]
        values, counts = np.unique(knots[(knots >= start) & (knots <= end)], return_counts=True)
        return values, counts >= degree

    def on_grid(self, u: Array, v: Array, order: int) -> Array:
        """Derivatives up to an order in either direction on the grid of u (k,) and v (l,): (order + 1, order + 1, k, l, 3).

        Entry [i, j] is the i-th by u of the j-th by v; those whose sum exceeds 2 are given for non-rational faces alone, else NaN.
        """
        weights = np.ones(self.control_points_mm.shape[:2]) if self.is_polynomial or self.weights is None else self.weights
        along_u, along_v = _basis(self.knots_u, self.degree[0], u, order), _basis(self.knots_v, self.degree[1], v, order)
        homogeneous = np.concatenate([self.control_points_mm * weights[:, :, None], weights[:, :, None]], axis=2)
        by_v = np.tensordot(along_v, homogeneous, axes=(2, 1))  # (o, l, a, 4)
        both = np.tensordot(along_u, by_v, axes=(2, 2))  # (o, k, o, l, 4)
        derivatives = both.transpose(0, 2, 1, 3, 4)
        return np.ascontiguousarray(derivatives[..., :3]) if self.is_polynomial else _divided(derivatives)


def _basis(knots: Array, degree: int, u: Array, order: int) -> Array:
    """The basis functions (order + 1, m, k) and their derivatives, those above the degree being zero."""
    count = len(knots) - degree - 1
    found = evaluate_b_spline(knots, np.eye(count), degree, u, min(order, degree))
    return np.concatenate([found, np.zeros((order + 1 - len(found), len(u), count))])


def _divided(homogeneous: Array) -> Array:
    """Derivatives of A / w from those of (A, w), by the quotient rule up to the second."""
    a, w = homogeneous[..., :3], homogeneous[..., 3:]
    result = np.full(a.shape, np.nan)
    result[0, 0] = a[0, 0] / w[0, 0]
    if len(a) > 1:
        result[1, 0] = (a[1, 0] - w[1, 0] * result[0, 0]) / w[0, 0]
        result[0, 1] = (a[0, 1] - w[0, 1] * result[0, 0]) / w[0, 0]
        mixed = a[1, 1] - w[1, 0] * result[0, 1] - w[0, 1] * result[1, 0] - w[1, 1] * result[0, 0]
        result[1, 1] = mixed / w[0, 0]
    if len(a) > 2:
        result[2, 0] = (a[2, 0] - 2 * w[1, 0] * result[1, 0] - w[2, 0] * result[0, 0]) / w[0, 0]
        result[0, 2] = (a[0, 2] - 2 * w[0, 1] * result[0, 1] - w[0, 2] * result[0, 0]) / w[0, 0]
    return result
