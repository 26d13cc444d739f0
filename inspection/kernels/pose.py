"""The fine registration: Gauss-Newton on the pose of points, and their outliers by Tukey's weights."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from inspection.kernels.blocks import CurveTables, project_points
from inspection.kernels.compiling import array_at, inlined_kernel, kernel, stack_reals
from inspection.kernels.feet import empty_feet, flatten
from inspection.kernels.layout import (
    BENDING_TT,
    BENDING_XT,
    BENDING_XX,
    BENDING_XY,
    BENDING_YT,
    BENDING_YY,
    BLOCK,
    CORNER,
    COUNT,
    OPEN_END,
    REALS,
    SAMPLE_METHODS,
    SLOPE_TURN,
    SLOPE_X,
    SLOPE_Y,
    SQUARE,
    SQUARE_BEFORE,
    SUMS,
    TANGENTIAL_TT,
    TANGENTIAL_XT,
    TANGENTIAL_XX,
    TANGENTIAL_XY,
    TANGENTIAL_YT,
    TANGENTIAL_YY,
)
from inspection.kernels.normal_equations import fill_covariance, newton_step
from inspection.kernels.on_samples import SampleTables, project_points_on_samples

Array = NDArray[np.float64]

_STANDSTILL_MM = 1e-9  # Gauss-Newton ends when no point moves further
_HALVINGS = 12
_HOVERING_STEPS = 3  # after them points that come and go at an open end in small steps are left out: no pose suits both
_HOVERING_MM = 0.01
_LEAST_REACH_MM = 1e-9


class PoseEstimate(NamedTuple):
    """A pose of points, and how it was reached.

    pose        : rotation about the origin in rad, then shift in mm (x, y)
    steps       : Gauss-Newton steps made
    settled     : the last step moved no point by more than 1e-9 mm
    mean_square : of the deviations, mm^2, over the points that took part; infinite without any
    centre_mm   : (2,) where the pose puts the mean of the points
    covariance  : (3, 3) of shift in mm and rotation in rad about the centre, for deviations that are independent
    """

    pose: tuple[float, float, float]
    steps: int
    settled: bool
    mean_square: float
    centre_mm: Array
    covariance: Array


class OutlierLimit(NamedTuple):
    """The deviation from which on a point is an outlier.

    mads       : farther than so many median absolute deviations
    least_mm   : and farther than this, however small the deviations of the others are
    settled_mm : the fit by Tukey's weights has settled when it moves no point further
    """

    mads: float
    least_mm: float
    settled_mm: float


class PoseFit:
    """Gauss-Newton on the pose of points (m, 2), and the memory it works in.

    weights : (m,) share of each point in the sums; a settled fit has set those of points that hover at an open end to 0
    """

    def __init__(self, points_mm: Array, grid: CurveTables, table: SampleTables, method: str, outward: float, tip_radius_mm: float) -> None:
        m = len(points_mm)
        self.weights = np.ones(m)
        self._problem = (flatten(points_mm), self.weights, grid.reals, grid.integers, float(outward), float(tip_radius_mm))
        self._samples = (*table.flat, SAMPLE_METHODS.index(method)) if method in SAMPLE_METHODS else None
        self._memory = (np.empty(2 * m), np.ones(m), np.empty(m), empty_feet(m))

    def settle(self, pose: tuple[float, float, float], most_steps: int) -> PoseEstimate:
        """Go from a pose to the least mean square of the deviations, by at most so many steps."""
        state, covariance = np.array([*pose, 0.0, 0.0, 0.0]), np.empty((3, 3))
        steps, settled = _settle_pose(self._problem, self._samples, self._memory, state, covariance, most_steps)
        angle, x, y, mean_square, _, _ = state.tolist()
        return PoseEstimate((angle, x, y), steps, settled, mean_square, state[4:], covariance)

    def find_outliers(self, pose: tuple[float, float, float], limit: OutlierLimit, most_steps: int) -> NDArray[np.bool_]:
        """Mark the points (m,) that are beyond the limit once the fit by Tukey's weights has settled."""
        found = np.zeros(len(self.weights), dtype=np.bool_)
        _find_outliers(self._problem, self._samples, self._memory, pose, limit, most_steps, found)
        return found


@kernel
def _settle_pose(problem: Any, samples: Any, memory: Any, state: Any, covariance: Any, most_steps: int) -> tuple[int, bool]:
    """Make Newton steps, each halved until the mean square falls. Returns their number and whether the pose has settled."""
    points, weights, _, _, outward, tip = problem
    moved, takes_part, new_part, feet = memory
    span, pose, here, trial = _span(points), (state[0], state[1], state[2]), np.empty(SUMS), np.empty(SUMS)
    _evaluate(problem, samples, pose, span, moved, takes_part, takes_part, feet, here)
    steps, settled, lower = 0, False, True
    while lower and not settled and steps < most_steps:
        steps += 1
        step, next_pose, share, lower = newton_step(here, span[2]), pose, 1.0, False
        for _ in range(_HALVINGS):
            next_pose = _move_pose(pose, span, step, share)
            # It changes no deviation by more, so there is nothing to project again; without any point nothing was fitted.
            settled = share * step[3] <= _STANDSTILL_MM and here[COUNT] > 0.0
            if settled:
                break
            _evaluate(problem, samples, next_pose, span, moved, takes_part, new_part, feet, trial)
            lower = trial[SQUARE_BEFORE] <= here[SQUARE] * (1.0 + 1e-12)
            if lower:
                break
            share *= 0.5
        if lower and steps >= _HOVERING_STEPS and share * step[3] < _HOVERING_MM and trial[COUNT] != here[COUNT]:
            _leave_out_hovering(weights, takes_part, new_part)
            _add_up(weights, takes_part, new_part, outward, tip, next_pose, span, moved, feet, trial)
        if lower:
            here, trial = trial, here
            takes_part, new_part = new_part, takes_part
        if lower or settled:
            pose = next_pose
    _report(here, pose, span, state, covariance)
    return steps, settled


@kernel
def _leave_out_hovering(weights: Any, before: Any, after: Any) -> None:
    """Leave out the points that took part at only one of two poses: an open end moves to and fro beside them."""
    for i in range(len(weights)):
        weights[i] *= before[i] * after[i]


@kernel
def _report(sums: Any, pose: Any, span: Any, state: Any, covariance: Any) -> None:
    """Fill in the state (6,): the pose, the mean square of the deviations, the centre of the points; and the covariance."""
    state[0], state[1], state[2] = pose
    state[3] = sums[SQUARE] / sums[COUNT] if sums[COUNT] > 0.0 else np.inf
    state[4], state[5] = _centre(pose, span)
    fill_covariance(sums, span[2], sums[SQUARE] / max(sums[COUNT] - 3.0, 1.0), covariance)


@kernel
def _find_outliers(problem: Any, samples: Any, memory: Any, pose: Any, wanted: Any, most_steps: int, found: Any) -> None:
    """Make weighted steps, the weights following from the deviations at every pose, and mark the points beyond the limit."""
    points, weights, _, _, outward, tip = problem
    moved, takes_part, off, feet = memory
    span, sums, m = _span(points), np.empty(SUMS), len(weights)
    for _ in range(most_steps):
        for i in range(m):
            weights[i] = 1.0
        _evaluate(problem, samples, pose, span, moved, takes_part, takes_part, feet, sums)
        for i in range(m):
            off[i] = abs(outward * feet.distance_mm[i] - tip)
        limit = np.inf
        if sums[COUNT] > 0.0:
            limit = max(wanted.mads * np.median(off[takes_part > 0.0]), wanted.least_mm, _STANDSTILL_MM)
        for i in range(m):
            share = off[i] / limit
            weights[i] = (1.0 - share * share) ** 2 if off[i] < limit else 0.0
            found[i] = off[i] >= limit and takes_part[i] > 0.0
        _add_up(weights, takes_part, takes_part, outward, tip, pose, span, moved, feet, sums)
        step = newton_step(sums, span[2])
        pose = _move_pose(pose, span, step, 1.0)
        if step[3] <= wanted.settled_mm:
            break


@kernel
def _span(points: Any) -> tuple[float, float, float]:
    """Mean of the flat points (x, y), and the distance of the farthest from it: a motion does not change it."""
    x = y = square = 0.0
    m = len(points) // 2
    for i in range(m):
        x += points[2 * i]
        y += points[2 * i + 1]
    x, y = x / m, y / m
    for i in range(m):
        dx, dy = points[2 * i] - x, points[2 * i + 1] - y
        square = max(square, dx * dx + dy * dy)
    return x, y, max(np.sqrt(square), _LEAST_REACH_MM)


@kernel
def _centre(pose: Any, span: Any) -> tuple[float, float]:
    """Where the pose puts the mean of the points."""
    c, s = np.cos(pose[0]), np.sin(pose[0])
    return c * span[0] - s * span[1] + pose[1], s * span[0] + c * span[1] + pose[2]


@kernel
def _move_pose(pose: Any, span: Any, step: Any, share: float) -> tuple[float, float, float]:
    """The pose after a share of a step: its rotation about the centre, which moves by its shift alone."""
    x, y = _centre(pose, span)
    angle = pose[0] + share * step[2]
    angle = np.arctan2(np.sin(angle), np.cos(angle))
    c, s = np.cos(angle), np.sin(angle)
    return angle, x + share * step[0] - (c * span[0] - s * span[1]), y + share * step[1] - (s * span[0] + c * span[1])


@kernel
def _evaluate(problem: Any, samples: Any, pose: Any, span: Any, moved: Any, before: Any, takes_part: Any, feet: Any, sums: Any) -> None:
    """Move the points to a pose, project them, and add up the sums over them.

    samples : tables and number of a method that looks at samples only, or None for the exact feet
    """
    points, weights, reals, integers, outward, tip = problem
    c, s, m = np.cos(pose[0]), np.sin(pose[0]), len(weights)
    for i in range(m):
        x, y = points[2 * i], points[2 * i + 1]
        moved[2 * i] = c * x - s * y + pose[1]
        moved[2 * i + 1] = s * x + c * y + pose[2]
    project_points(moved, reals, integers, feet, np.zeros(1, dtype=np.int64))
    if samples is not None:
        project_points_on_samples(moved, samples, feet, np.zeros(1, dtype=np.int64))
    _add_up(weights, before, takes_part, outward, tip, pose, span, moved, feet, sums)


@kernel
def _add_up(
    weights: Any, before: Any, takes_part: Any, outward: float, tip: float, pose: Any, span: Any, moved: Any, feet: Any, sums: Any
) -> None:
    """Add up the sums, always in the same order: first for each place in a block, so that the loop vectorises, then in halves."""
    lanes = array_at(stack_reals(), REALS)
    for i in range(SUMS * BLOCK):
        lanes[i] = 0.0
    x0, y0 = _centre(pose, span)
    for block in range(0, len(weights), BLOCK):
        end = min(block + BLOCK, len(weights))
        points, gradient = moved[2 * block : 2 * end], feet.gradient.reshape(-1)[2 * block : 2 * end]
        distance, curvature, vertex = feet.distance_mm[block:end], feet.curvature[block:end], feet.vertex[block:end]
        weight, part_before, part = weights[block:end], before[block:end], takes_part[block:end]
        for j in range(end - block):
            _add_point(lanes, points, gradient, distance, curvature, vertex, weight, part_before, part, outward, tip, x0, y0, j)
    half = BLOCK // 2
    while half > 0:
        for column in range(0, SUMS * BLOCK, BLOCK):
            for j in range(half):
                lanes[column + j] += lanes[column + half + j]
        half //= 2
    for quantity in range(SUMS):
        sums[quantity] = lanes[quantity * BLOCK]


@inlined_kernel
def _add_point(
    lanes: Any,
    points: Any,
    gradient: Any,
    distance: Any,
    curvature: Any,
    vertex: Any,
    weight: Any,
    before: Any,
    part: Any,
    outward: float,
    tip: float,
    x0: float,
    y0: float,
    j: int,
) -> None:
    """Add a point to the sums: tangent distance plus curvature, e(p) = e + J p + p' H p / 2.

    H is the curvature of the distance field across its gradient.
    """
    field = outward * distance[j]
    e = field - tip
    gx, gy = outward * gradient[2 * j], outward * gradient[2 * j + 1]
    ax, ay = points[2 * j] - x0, points[2 * j + 1] - y0
    turn, radial = ax * gy - ay * gx, ax * gx + ay * gy
    at_corner = vertex[j] == CORNER
    numerator = 1.0 if at_corner else -outward * curvature[j]
    denominator = field if at_corner else max(1.0 - curvature[j] * distance[j], 1e-3)
    bend = numerator / denominator if abs(denominator) > 1e-9 else 0.0
    was_part = before[j]
    u = 0.0 if vertex[j] == OPEN_END else weight[j]
    takes_part = 1.0 if u > 0.0 else 0.0
    part[j] = takes_part
    we = u * e
    across = we * bend
    lanes[BLOCK * SLOPE_X + j] += we * gx
    lanes[BLOCK * SLOPE_Y + j] += we * gy
    lanes[BLOCK * SLOPE_TURN + j] += we * turn
    lanes[BLOCK * TANGENTIAL_XX + j] += u * gx * gx
    lanes[BLOCK * TANGENTIAL_XY + j] += u * gx * gy
    lanes[BLOCK * TANGENTIAL_XT + j] += u * gx * turn
    lanes[BLOCK * TANGENTIAL_YY + j] += u * gy * gy
    lanes[BLOCK * TANGENTIAL_YT + j] += u * gy * turn
    lanes[BLOCK * TANGENTIAL_TT + j] += u * turn * turn
    lanes[BLOCK * BENDING_XX + j] += across * gy * gy
    lanes[BLOCK * BENDING_XY + j] -= across * gx * gy
    lanes[BLOCK * BENDING_XT + j] -= across * gy * radial
    lanes[BLOCK * BENDING_YY + j] += across * gx * gx
    lanes[BLOCK * BENDING_YT + j] += across * gx * radial
    lanes[BLOCK * BENDING_TT + j] += across * radial * radial - we * radial
    lanes[BLOCK * SQUARE + j] += we * e
    lanes[BLOCK * COUNT + j] += takes_part
    lanes[BLOCK * SQUARE_BEFORE + j] += was_part * weight[j] * e * e
