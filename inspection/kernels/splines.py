"""Points and derivatives of rational B-splines at few parameters, where a search asks again and again.

Every operation is that of `b_spline` and of `NurbsCurve.derivatives` on whole arrays, in its order, so that the values are the same to
the last bit. On a few hundred parameters the arrays cost ten times as much as what is worked out on them.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from inspection.kernels.compiling import inner_kernel, kernel

Array = NDArray[np.float64]


class Spline(NamedTuple):
    """A rational B-spline.

    knots       : (k + degree + 1,) non-decreasing
    homogeneous : (k, 3) of w x, w y, w
    """

    knots: Array
    homogeneous: Array
    degree: int


def spline_derivatives(spline: Spline, u: Array, order: int) -> Array:
    """Point and derivatives by u (m,), which lies in the domain, up to `order`: (order + 1, m, 2). NaN gives NaN."""
    result = np.empty((order + 1, len(u), 2))
    derive(spline.knots, spline.homogeneous, spline.degree, np.ascontiguousarray(u), result)
    return result


@inner_kernel
def _functions(knots: Any, degree: int, span: int, u: float, levels: Any) -> None:
    """The functions of every degree that are not zero on a span."""
    levels[0, 0] = 1.0
    for j in range(1, degree + 1):
        for n in range(j + 1):
            levels[j, n] = 0.0
        for n in range(1, j + 1):
            right, left = knots[span + n], knots[span + n - j]
            share = levels[j - 1, n - 1] / (right - left)
            levels[j, n - 1] += share * (right - u)
            levels[j, n] = share * (u - left)


@inner_kernel
def _derive(knots: Any, degree: int, span: int, j: int, lower: Any, derived: Any) -> None:
    """The derivatives of the functions of degree j, from the functions or derivatives of the degree below."""
    for n in range(j + 1):
        derived[n] = 0.0
    for n in range(1, j + 1):
        share = j * lower[n - 1] / (knots[span + n] - knots[span + n - j])
        derived[n - 1] -= share
        derived[n] = share


@kernel
def derive(knots: Any, homogeneous: Any, degree: int, parameters: Any, result: Any) -> None:
    """Fill in points and derivatives (orders, m, 2)."""
    orders, count = len(result), len(homogeneous)
    first = np.searchsorted(knots, knots[degree], side="right") - 1  # the first and the last span that have a length
    last = np.searchsorted(knots, knots[count], side="left") - 1
    levels = np.empty((degree + 1, degree + 1))  # of each degree, the functions that are not zero on the span
    weights, derived = np.empty(degree + 1), np.empty(degree + 1)
    held = np.zeros((orders, 3))
    for i in range(len(parameters)):
        u = parameters[i]
        if np.isnan(u):
            result[:, i, :] = np.nan
            continue
        span = min(max(np.searchsorted(knots, u, side="right") - 1, first), last)
        _functions(knots, degree, span, u, levels)
        held[:] = 0.0
        for nu in range(min(orders, degree + 1)):
            weights[: degree - nu + 1] = levels[degree - nu, : degree - nu + 1]
            for j in range(degree - nu + 1, degree + 1):
                _derive(knots, degree, span, j, weights, derived)
                weights[: j + 1] = derived[: j + 1]
            for n in range(degree + 1):
                for c in range(3):
                    held[nu, c] += homogeneous[span + n - degree, c] * weights[n]
        for nu in range(orders):  # Leibniz, as of the curve
            x, y, binomial = held[nu, 0], held[nu, 1], 1
            for j in range(1, nu + 1):
                binomial = binomial * (nu - j + 1) // j
                x -= binomial * held[j, 2] * result[nu - j, i, 0]
                y -= binomial * held[j, 2] * result[nu - j, i, 1]
            result[nu, i, 0], result[nu, i, 1] = x / held[0, 2], y / held[0, 2]
