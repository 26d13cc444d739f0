"""Values and derivatives of B-splines by de Boor's recurrence on whole arrays.

Every operation is that of scipy.interpolate.BSpline, in its order, so that the values are the same to the last bit where its compiler fuses
none of them (as on x86-64). scipy takes a third of a second to load, which every command would wait for.
"""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_AT_ONCE = 8192  # parameters worked on together, so that their arrays stay in the cache


def evaluate_b_spline(knots: Array, coefficients: Array, degree: int, u: Array, order: int) -> Array:
    """Value and derivatives up to `order`, at most the degree: (order + 1, m, c).

    knots        : (k + degree + 1,) non-decreasing
    coefficients : (k, c)
    u            : (m,) beyond the domain its first and last spans go on; NaN gives NaN
    """
    result = np.empty((order + 1, len(u), coefficients.shape[1]))
    for first in range(0, len(u), _AT_ONCE):
        part = slice(first, first + _AT_ONCE)
        _evaluate(knots, coefficients, degree, u[part], result[:, part])
    return result


def _evaluate(knots: Array, coefficients: Array, degree: int, u: Array, result: Array) -> None:
    first = np.searchsorted(knots, knots[degree], side="right") - 1  # the first and the last span that have a length
    last = np.searchsorted(knots, knots[len(coefficients)], side="left") - 1
    span = np.clip(np.searchsorted(knots, u, side="right") - 1, first, last)
    around = knots[span + np.arange(1 - degree, degree + 1)[:, None]]  # (2 degree, m) knots on either side
    before, after = u - around[:degree], around[degree:] - u
    levels = [np.ones((1, len(u)))]  # of each degree, the functions that are not zero on the span
    for j in range(1, degree + 1):
        levels.append(_raise_degree(levels[-1], around, before, after, degree, j))
    nearby = coefficients[span + np.arange(-degree, 1)[:, None]]  # (degree + 1, m, c)
    for nu in range(len(result)):
        weights = levels[degree - nu]
        for j in range(degree - nu + 1, degree + 1):
            weights = _derive(weights, around, degree, j)
        result[nu] = 0.0
        for weight, control in zip(weights, nearby, strict=True):
            result[nu] += control * weight[:, None]
    result[:, np.isnan(u)] = np.nan


def _raise_degree(lower: Array, around: Array, before: Array, after: Array, degree: int, j: int) -> Array:
    """The j + 1 functions (j + 1, m) of degree j, from those of the degree below."""
    raised = np.zeros((j + 1, lower.shape[1]))
    for n in range(1, j + 1):
        right, left = degree - 1 + n, degree - 1 + n - j
        share = lower[n - 1] / (around[right] - around[left])
        raised[n - 1] += share * after[n - 1]
        raised[n] = share * before[left]
    return raised


def _derive(lower: Array, around: Array, degree: int, j: int) -> Array:
    """The derivatives (j + 1, m) of the functions of degree j, from the functions or derivatives of the degree below."""
    derived = np.zeros((j + 1, lower.shape[1]))
    for n in range(1, j + 1):
        right, left = degree - 1 + n, degree - 1 + n - j
        share = j * lower[n - 1] / (around[right] - around[left])
        derived[n - 1] -= share
        derived[n] = share
    return derived
