"""B-splines against scipy's, to the last bit."""

import numpy as np
import pytest
from scipy.interpolate import BSpline

from inspection.b_spline import evaluate_b_spline
from tests.inspection.profiles import Array


def knots_of(kind: str, degree: int, count: int, rng: np.random.Generator) -> Array:
    knots = np.sort(rng.normal(size=count + degree + 1))
    if kind != "free":
        knots[: degree + 1], knots[count:] = knots[0], knots[-1]
    if kind == "repeated":
        middle = count // 2
        knots[middle : middle + min(degree, count - middle)] = knots[middle]
    return np.sort(knots)


@pytest.mark.parametrize("kind", ["free", "clamped", "repeated"])
def test_values_and_derivatives_are_those_of_scipy_bit_by_bit(kind: str) -> None:
    rng = np.random.default_rng(3)
    for trial in range(60):
        degree = 1 + trial % 7
        count = degree + 1 + trial % 9
        knots, coefficients = knots_of(kind, degree, count, rng), rng.normal(size=(count, 3))
        start, end = knots[degree], knots[count]
        u = np.concatenate([rng.uniform(start, end, 50), knots[degree : count + 1], [np.nextafter(end, start), np.nan]])
        told = evaluate_b_spline(knots, coefficients, degree, u, degree)
        spline = BSpline(knots, coefficients, degree)
        for nu in range(degree + 1):
            np.testing.assert_array_equal(told[nu], spline(u, nu))


def test_many_parameters_are_evaluated_as_each_alone() -> None:
    rng = np.random.default_rng(4)
    knots, coefficients, u = knots_of("clamped", 3, 12, rng), rng.normal(size=(12, 2)), np.empty(0)
    u = rng.uniform(knots[0], knots[-1], 20_001)  # more than are worked on at once
    together = evaluate_b_spline(knots, coefficients, 3, u, 2)
    for i in (0, 8191, 8192, 20_000):
        np.testing.assert_array_equal(evaluate_b_spline(knots, coefficients, 3, u[i : i + 1], 2)[:, 0], together[:, i])


def test_a_knot_more_than_is_needed_at_an_end_does_not_hide_it() -> None:
    """Degree 2 with four equal knots at its end: the last span that has a length goes up to the last control point but one."""
    knots, coefficients = np.array([0.0, 0, 0, 1, 1, 1, 1]), np.array([[0.0], [1.0], [3.0], [9.0]])
    assert evaluate_b_spline(knots, coefficients, 2, np.array([0.0, 0.5, 1.0]), 0)[0, :, 0].tolist() == [0.0, 1.25, 3.0]
