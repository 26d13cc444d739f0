"""Sums over points that determine a small motion, and what follows from them: the motion and its covariance."""

from typing import Any

import numpy as np

from inspection.kernels.compiling import inner_kernel, kernel
from inspection.kernels.layout import BENDING_XX, SLOPE_TURN, SLOPE_X, SLOPE_Y, TANGENTIAL_XX

_FREE = 1e-9  # a motion whose eigenvalue is below this share of the largest changes no deviation: it is undetermined
_TRUSTED = 1e-6  # least eigenvalue of the full second derivative, as a share of the largest, for it to be used
_SWEEPS = 12  # of Jacobi rotations; four or five suffice


@kernel
def newton_step(sums: Any, reach: float) -> tuple[float, float, float, float]:
    """The shift (x, y) and rotation to the least mean square of the second-order model, and how far they move the farthest point.

    Full second derivative where it is positive definite, its Gauss-Newton part otherwise; motions that the points do not
    determine (a circle's rotation) are left alone.
    """
    matrix, values, vectors = np.empty((3, 3)), np.empty(3), np.empty((3, 3))
    _fill_normal_matrix(sums, 1.0, reach, matrix)
    _decompose(matrix, values, vectors)
    if min(values[0], values[1], values[2]) <= _TRUSTED * max(values[0], values[1], values[2]):
        _fill_normal_matrix(sums, 0.0, reach, matrix)
        _decompose(matrix, values, vectors)
    x = y = turn = 0.0
    for i in range(3):
        if values[i] > _FREE * max(values[0], values[1], values[2]):
            along = vectors[0, i] * sums[SLOPE_X] + vectors[1, i] * sums[SLOPE_Y] + vectors[2, i] * (sums[SLOPE_TURN] / reach)
            x -= vectors[0, i] * (along / values[i])
            y -= vectors[1, i] * (along / values[i])
            turn -= vectors[2, i] * (along / values[i])
    return x, y, turn / reach, np.hypot(x, y) + abs(turn)


@kernel
def fill_covariance(sums: Any, reach: float, scatter: float, covariance: Any) -> None:
    """Fill in the inverse of the normal matrix times the scatter. What is not determined gets the reach as its standard deviation."""
    matrix, values, vectors = np.empty((3, 3)), np.empty(3), np.empty((3, 3))
    _fill_normal_matrix(sums, 0.0, reach, matrix)
    _decompose(matrix, values, vectors)
    for k in range(3):
        for j in range(3):
            covariance[k, j] = 0.0
    for i in range(3):
        variance = scatter / values[i] if values[i] > _FREE * max(values[0], values[1], values[2]) else reach * reach
        vectors[2, i] /= reach
        for k in range(3):
            for j in range(3):
                covariance[k, j] += variance * vectors[k, i] * vectors[j, i]


@inner_kernel
def _fill_normal_matrix(sums: Any, bending: float, reach: float, matrix: Any) -> None:
    """Fill in the normal matrix (3, 3), with the rotation counted in mm at the farthest point.

    bending : 1.0 to add e times its second derivative, or 0.0
    """
    place = 0
    for i in range(3):
        for j in range(i, 3):
            value = sums[TANGENTIAL_XX + place] + bending * sums[BENDING_XX + place]
            value /= (reach if i == 2 else 1.0) * (reach if j == 2 else 1.0)
            matrix[i, j] = matrix[j, i] = value
            place += 1


@inner_kernel
def _decompose(matrix: Any, values: Any, vectors: Any) -> None:
    """Find the eigenvalues (3,) and eigenvectors, in columns, of a symmetric matrix by Jacobi's rotations. The matrix is used up.

    The method is written out because libraries for matrices differ in the last bits from processor to processor.
    """
    for i in range(3):
        for j in range(3):
            vectors[i, j] = 1.0 if i == j else 0.0
    for _ in range(_SWEEPS):
        if matrix[0, 1] == 0.0 and matrix[0, 2] == 0.0 and matrix[1, 2] == 0.0:
            break
        for p in range(2):
            for q in range(p + 1, 3):
                off = matrix[p, q]
                if abs(off) <= 1e-17 * (abs(matrix[p, p]) + abs(matrix[q, q])):
                    matrix[p, q] = matrix[q, p] = 0.0
                    continue
                theta = (matrix[q, q] - matrix[p, p]) / (2.0 * off)
                t = np.copysign(1.0, theta) / (abs(theta) + np.sqrt(theta * theta + 1.0))
                c = 1.0 / np.sqrt(t * t + 1.0)
                s = t * c
                for k in range(3):
                    a, b = matrix[k, p], matrix[k, q]
                    matrix[k, p], matrix[k, q] = c * a - s * b, s * a + c * b
                for k in range(3):
                    a, b = matrix[p, k], matrix[q, k]
                    matrix[p, k], matrix[q, k] = c * a - s * b, s * a + c * b
                for k in range(3):
                    a, b = vectors[k, p], vectors[k, q]
                    vectors[k, p], vectors[k, q] = c * a - s * b, s * a + c * b
    for i in range(3):
        values[i] = matrix[i, i]
