"""A closed wire of all that CAD systems draw, in closed form: two lines, a half circle, a rational cubic, a quarter of an ellipse.

Its truth needs nothing of the readers: points and curvatures by their formulas, the length by quadrature and an elliptic integral.
"""

from dataclasses import dataclass
from math import comb, pi

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import quad
from scipy.special import ellipe

from inspection import NurbsCurve, deviations, discretize

Array = NDArray[np.float64]

LINES = (((0.0, 0.0), (30.0, 0.0)), ((0.0, 11.0), (0.0, 0.0)))
CENTER, RADIUS = (30.0, 10.0), 10.0  # the half circle, from (30, 0) counter-clockwise to (30, 20)
POLES, WEIGHTS = ((30.0, 20.0), (24.0, 26.0), (16.0, 27.0), (10.0, 22.0)), (1.0, 2.0, 1.5, 1.0)
ELLIPSE_CENTER, SEMI_Y, SEMI_X = (10.0, 11.0), 11.0, 10.0  # from (10, 22) counter-clockwise to (0, 11)


@dataclass(frozen=True)
class Truth:
    """Points of the wire in mm (m, 2), and the curvature there, positive to the left (m,); none of them at a corner."""

    points: Array
    curvature: Array
    length: float


def cubic(t: Array) -> tuple[Array, Array, Array]:
    """Point, first and second derivative of the rational cubic, by Bernstein polynomials."""
    poles, weights = np.array(POLES), np.array(WEIGHTS)
    homogeneous = np.column_stack([poles * weights[:, None], weights])

    def bezier(points: Array) -> Array:
        n = len(points) - 1
        return np.asarray(np.sum([comb(n, i) * (t**i * (1 - t) ** (n - i))[:, None] * points[i] for i in range(n + 1)], axis=0))

    given = [bezier(homogeneous), bezier(3 * np.diff(homogeneous, axis=0)), bezier(6 * np.diff(homogeneous, n=2, axis=0))]
    w, w1, w2 = (array[:, 2:] for array in given)
    point = given[0][:, :2] / w
    first = (given[1][:, :2] - w1 * point) / w
    return point, first, (given[2][:, :2] - 2 * w1 * first - w2 * point) / w


def truth() -> Truth:
    t = np.linspace(0.01, 0.99, 40)
    point, first, second = cubic(t)
    bend = (first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]) / np.hypot(*first.T) ** 3
    turn = -pi / 2 + pi * t
    circle = np.array(CENTER) + RADIUS * np.column_stack([np.cos(turn), np.sin(turn)])
    angle = pi / 2 * (1 + t)
    ellipse = np.array(ELLIPSE_CENTER) + np.column_stack([SEMI_X * np.cos(angle), SEMI_Y * np.sin(angle)])
    bulge = SEMI_X * SEMI_Y / (SEMI_X**2 * np.sin(angle) ** 2 + SEMI_Y**2 * np.cos(angle) ** 2) ** 1.5
    straight = [np.array(a) + t[:, None] * (np.array(b) - np.array(a)) for a, b in LINES]
    curvature = np.concatenate([np.zeros(80), np.full(40, 1 / RADIUS), bend, bulge])
    length = 30.0 + 11.0 + pi * RADIUS + quad(lambda s: float(np.hypot(*cubic(np.array([s]))[1][0])), 0, 1, epsabs=1e-13, epsrel=1e-13)[0]
    length += SEMI_Y * float(ellipe(1 - (SEMI_X / SEMI_Y) ** 2))
    return Truth(np.vstack([*straight, circle, point, ellipse]), curvature, length)


TRUTH = truth()


def require_wire(curve: NurbsCurve, scale: float = 1.0) -> None:
    """The curve is the wire, times a scale: closed, every point and curvature of it, and its length, to a nanometre in a millimetre."""
    assert curve.closed
    assert abs(curve.length_mm - scale * TRUTH.length) < 1e-9
    found = deviations(scale * TRUTH.points, discretize(curve, 500))
    assert np.abs(found.deviation_mm).max() < 1e-9
    assert np.abs(curve.curvature(found.parameter) - TRUTH.curvature / scale).max() < 1e-9
