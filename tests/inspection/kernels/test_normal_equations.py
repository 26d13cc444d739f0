"""The step and the covariance from sums, against numpy's solution of the same equations."""

import numpy as np
import pytest

from inspection.kernels import layout
from inspection.kernels.normal_equations import fill_covariance, newton_step
from tests.inspection.profiles import Array


def sums_of(jacobian: Array, deviation: Array, bending: Array) -> Array:
    """Sums of points with these gradients (m, 3) and deviations (m,), and a sum of second derivatives (3, 3)."""
    sums = np.zeros(layout.SUMS)
    upper = np.triu_indices(3)
    sums[layout.SLOPE_X : layout.SLOPE_TURN + 1] = jacobian.T @ deviation
    sums[layout.TANGENTIAL_XX : layout.TANGENTIAL_TT + 1] = (jacobian.T @ jacobian)[upper]
    sums[layout.BENDING_XX : layout.BENDING_TT + 1] = bending[upper]
    return sums


def random_sums(bending: float) -> tuple[Array, Array, Array]:
    rng = np.random.default_rng(9)
    jacobian, deviation = rng.normal(0, 1, (40, 3)) * (1.0, 1.0, 30.0), rng.normal(0, 0.1, 40)
    half = rng.normal(0, 1, (3, 3))
    second = bending * (half + half.T)
    return sums_of(jacobian, deviation, second), jacobian.T @ jacobian + second, jacobian.T @ deviation


@pytest.mark.parametrize("bending", [0.0, 1.0])
def test_the_step_goes_to_the_minimum_of_the_second_order_model(bending: float) -> None:
    sums, hessian, slope = random_sums(bending)
    x, y, turn, farthest = newton_step(sums, 30.0)
    assert np.abs(np.array([x, y, turn]) + np.linalg.solve(hessian, slope)).max() < 1e-14
    assert farthest == pytest.approx(np.hypot(x, y) + 30.0 * abs(turn), rel=1e-14)


def test_a_second_derivative_that_is_not_positive_is_left_out() -> None:
    sums, _, slope = random_sums(0.0)
    sums[layout.BENDING_XX] = -1e6
    normal_matrix, *_ = (random_sums(0.0)[1],)
    x, y, turn, _ = newton_step(sums, 30.0)
    assert np.abs(np.array([x, y, turn]) + np.linalg.solve(normal_matrix, slope)).max() < 1e-14


def test_a_motion_that_changes_no_deviation_is_left_alone() -> None:
    angle = np.linspace(0, 6, 50)
    jacobian = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(50)])  # a circle about the centre: its rotation shows nowhere
    wanted = np.array([0.3, -0.2, 0.0])
    x, y, turn, _ = newton_step(sums_of(jacobian, -jacobian @ wanted, np.zeros((3, 3))), 10.0)
    assert np.abs(np.array([x, y]) - wanted[:2]).max() < 1e-14
    assert turn == 0.0


def test_the_covariance_is_the_inverse_of_the_normal_matrix_and_the_reach_where_that_has_none() -> None:
    sums, normal_matrix, _ = random_sums(0.0)
    covariance = np.empty((3, 3))
    fill_covariance(sums, 30.0, 0.04, covariance)
    assert np.abs(covariance - 0.04 * np.linalg.inv(normal_matrix)).max() < 1e-15
    only_x = sums_of(np.tile([1.0, 0.0, 0.0], (10, 1)), np.zeros(10), np.zeros((3, 3)))
    fill_covariance(only_x, 30.0, 0.04, covariance)
    assert np.abs(covariance - np.diag([0.004, 900.0, 1.0])).max() < 1e-12
