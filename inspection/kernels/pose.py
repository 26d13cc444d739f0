"""The fine registration: Gauss-Newton on the pose of points, and their outliers by Tukey's weights."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from inspection.kernels.blocks import CurveTables, search_code
from inspection.kernels.compiling import array_at, inlined_kernel, inner_kernel, kernel, stack_reals
from inspection.kernels.feet import Feet, Marks, Room, empty_feet, flatten
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
from inspection.kernels.on_samples import NO_PROJECTION, SampleTables, project_by, projection_of

Array = NDArray[np.float64]

NONE_LEFT_OUT: Marks = np.empty(0, dtype=np.uint8)
AT_ONCE = 32 * BLOCK  # points projected together: their feet stay in the cache
MANY = 1 << 20  # points from which on a median is taken of a choice of them
_STANDSTILL_MM = 1e-9  # Gauss-Newton ends when no point moves further
_HALVINGS = 12
_HOVERING_STEPS = 3  # after them points that come and go at an open end in small steps are left out: no pose suits both
_HOVERING_MM = 0.01
_LEAST_REACH_MM = 1e-9
# Not literals: to the compiler each of those has a type of its own, and what it is given to is compiled once more.
_KNOWN: Any = np.bool_(True)
_NOT_KNOWN: Any = np.bool_(False)
_FIRST_ROW: Any = np.int64(0)


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
    """Gauss-Newton on the pose of points (n, 2), and the memory it works in: nine bytes a point, and two more for an open profile's ends.

    left_out : (n,) 1 for points that take no part, as if they were not there; (0,) where all do
    room     : gives arrays of the length of the scan, like numpy.empty
    at_once  : points that are projected together, a multiple of BLOCK; the result is the same
    weights  : (m,) share of each point in the sums that is not left out; a settled fit has set those that hover at an open end to 0
    """

    def __init__(
        self,
        points_mm: Array,
        grid: CurveTables,
        table: SampleTables | None,
        method: str,
        outward: float,
        tip_radius_mm: float,
        left_out: Marks = NONE_LEFT_OUT,
        room: Room = np.empty,
        at_once: int = AT_ONCE,
    ) -> None:
        m = len(points_mm) - int(np.count_nonzero(left_out))
        self.weights = room((m,), np.float64)
        self.weights[:] = 1.0
        curve = (grid.reals, grid.integers, float(outward), float(tip_radius_mm))
        self._problem = (flatten(points_mm), left_out, self.weights, *curve)
        self._projection = projection_of(table, method)
        chunk = min(m, at_once)
        before, after = room((m,), np.uint8), room((m,), np.uint8)
        before[:] = 1
        self._room, self._memory = room, (before, after, np.empty(2 * chunk), empty_feet(chunk))

    def settle(self, pose: tuple[float, float, float], most_steps: int) -> PoseEstimate:
        """Go from a pose to the least mean square of the deviations, by at most so many steps."""
        state, covariance = np.array([*pose, 0.0, 0.0, 0.0]), np.empty((3, 3))
        steps, settled = _settle_pose(self._problem, self._projection, self._memory, state, covariance, most_steps)
        angle, x, y, mean_square, _, _ = state.tolist()
        return PoseEstimate((angle, x, y), steps, settled, mean_square, state[4:], covariance)

    def find_outliers(self, pose: tuple[float, float, float], limit: OutlierLimit, most_steps: int) -> NDArray[np.bool_]:
        """Mark the points (m,) that are beyond the limit once the fit by Tukey's weights has settled."""
        m = len(self.weights)
        found, off = self._room((m,), np.bool_), self._room((m,), np.float64)
        found[:] = False
        _find_outliers(self._problem, self._projection, self._memory, pose, limit, most_steps, found, off)
        return found


def compile_fit() -> None:
    """Compile the search and the fit, or load them, as `PoseFit.settle` takes them. No point is settled, so none is projected."""
    search_code()
    none, integers = np.empty(0), np.frombuffer(bytes(4), dtype=np.int32)
    problem = (none, NONE_LEFT_OUT, none, NO_PROJECTION[0][0], integers, 1.0, 0.0)
    _settle_pose(problem, NO_PROJECTION, (NONE_LEFT_OUT, NONE_LEFT_OUT, none, empty_feet(1)), np.zeros(6), np.empty((3, 3)), 0)


@kernel
def _settle_pose(problem: Any, projection: Any, memory: Any, state: Any, covariance: Any, most_steps: int) -> tuple[int, bool]:
    """Make Newton steps, each halved until the mean square falls. Returns their number and whether the pose has settled."""
    weights = problem[2]
    takes_part, new_part, moved, feet = memory
    span, pose, here, trial = _span(problem[0], problem[1], len(weights)), (state[0], state[1], state[2]), np.empty(SUMS), np.empty(SUMS)
    _evaluate(problem, projection, pose, span, moved, takes_part, takes_part, feet, _NOT_KNOWN, here)
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
            _evaluate(problem, projection, next_pose, span, moved, takes_part, new_part, feet, _NOT_KNOWN, trial)
            lower = trial[SQUARE_BEFORE] <= here[SQUARE] * (1.0 + 1e-12)
            if lower:
                break
            share *= 0.5
        if lower and steps >= _HOVERING_STEPS and share * step[3] < _HOVERING_MM and trial[COUNT] != here[COUNT]:
            _leave_out_hovering(weights, takes_part, new_part)
            _evaluate(problem, projection, next_pose, span, moved, takes_part, new_part, feet, _KNOWN, trial)
        if lower:
            here, trial = trial, here
            takes_part, new_part = new_part, takes_part
        if lower or settled:
            pose = next_pose
    _report(here, pose, span, state, covariance)
    return steps, settled


@inner_kernel
def _leave_out_hovering(weights: Any, before: Any, after: Any) -> None:
    """Leave out the points that took part at only one of two poses: an open end moves to and fro beside them."""
    for i in range(len(weights)):
        weights[i] *= before[i] * after[i]


@inner_kernel
def _report(sums: Any, pose: Any, span: Any, state: Any, covariance: Any) -> None:
    """Fill in the state (6,): the pose, the mean square of the deviations, the centre of the points; and the covariance."""
    state[0], state[1], state[2] = pose
    state[3] = sums[SQUARE] / sums[COUNT] if sums[COUNT] > 0.0 else np.inf
    state[4], state[5] = _centre(pose, span)
    fill_covariance(sums, span[2], sums[SQUARE] / max(sums[COUNT] - 3.0, 1.0), covariance)


@kernel
def _find_outliers(problem: Any, projection: Any, memory: Any, pose: Any, wanted: Any, most_steps: int, found: Any, off: Any) -> None:
    """Make weighted steps, the weights following from the deviations at every pose, and mark the points beyond the limit."""
    weights = problem[2]
    takes_part, _, moved, feet = memory
    span, sums, m = _span(problem[0], problem[1], len(weights)), np.empty(SUMS), len(weights)
    for _ in range(most_steps):
        count = _look_at_distances(problem, projection, pose, moved, takes_part, feet, off)
        limit = np.inf
        if count > 0:
            limit = max(wanted.mads * _median(off, takes_part), wanted.least_mm, _STANDSTILL_MM)
        for i in range(m):
            share = off[i] / limit
            weights[i] = (1.0 - share * share) ** 2 if off[i] < limit else 0.0
            found[i] = off[i] >= limit and takes_part[i] > 0
        _evaluate(problem, projection, pose, span, moved, takes_part, takes_part, feet, _KNOWN, sums)
        step = newton_step(sums, span[2])
        pose = _move_pose(pose, span, step, 1.0)
        if step[3] <= wanted.settled_mm:
            break


@inner_kernel
def _look_at_distances(problem: Any, projection: Any, pose: Any, moved: Any, takes_part: Any, feet: Any, off: Any) -> int:
    """Enter how far each point is from the target, and which take part, at a pose. Returns how many do."""
    points, left_out, weights, reals, integers, outward, tip = problem
    m, row, count = len(weights), _FIRST_ROW, 0
    for begin in range(0, m, len(feet.vertex)):
        stop = min(begin + len(feet.vertex), m)
        row = _place(points, left_out, row, stop - begin, pose, moved)
        project_by(projection, moved[: 2 * (stop - begin)], reals, integers, _first_feet(feet, stop - begin))
        for j in range(stop - begin):
            off[begin + j] = abs(outward * feet.distance_mm[j] - tip)
            takes_part[begin + j] = feet.vertex[j] != OPEN_END
            count += takes_part[begin + j]
    return count


@inner_kernel
def _median(off: Any, takes_part: Any) -> float:
    """The median of the values of points that take part: of many points, of a choice in every stretch of the scan."""
    step = max(1.0, len(off) / MANY)
    chosen, count, at = np.empty(min(len(off), MANY)), 0, 0.0
    while at < len(off) and count < len(chosen):
        shift = (0.6180339887498949 * (at / step)) % 1.0 if step > 1.0 else 0.0  # no rhythm of the scan is in step with it
        i = min(int(at + shift * step), len(off) - 1)
        if takes_part[i] > 0:
            chosen[count] = off[i]
            count += 1
        at += step
    return float(np.median(chosen[:count])) if count > 0 else np.inf


@inner_kernel
def _span(points: Any, left_out: Any, m: int) -> tuple[float, float, float]:
    """Mean of the flat points (x, y), and the distance of the farthest from it: a motion does not change it."""
    x = y = square = 0.0
    for row in range(len(points) // 2):
        if len(left_out) == 0 or left_out[row] == 0:
            x += points[2 * row]
            y += points[2 * row + 1]
    x, y = x / m, y / m
    for row in range(len(points) // 2):
        if len(left_out) == 0 or left_out[row] == 0:
            dx, dy = points[2 * row] - x, points[2 * row + 1] - y
            square = max(square, dx * dx + dy * dy)
    return x, y, max(np.sqrt(square), _LEAST_REACH_MM)


@inner_kernel
def _centre(pose: Any, span: Any) -> tuple[float, float]:
    """Where the pose puts the mean of the points."""
    c, s = np.cos(pose[0]), np.sin(pose[0])
    return c * span[0] - s * span[1] + pose[1], s * span[0] + c * span[1] + pose[2]


@inner_kernel
def _move_pose(pose: Any, span: Any, step: Any, share: float) -> tuple[float, float, float]:
    """The pose after a share of a step: its rotation about the centre, which moves by its shift alone."""
    x, y = _centre(pose, span)
    angle = pose[0] + share * step[2]
    angle = np.arctan2(np.sin(angle), np.cos(angle))
    c, s = np.cos(angle), np.sin(angle)
    return angle, x + share * step[0] - (c * span[0] - s * span[1]), y + share * step[1] - (s * span[0] + c * span[1])


@inner_kernel
def _place(points: Any, left_out: Any, row: int, count: int, pose: Any, moved: Any) -> int:
    """Move the next points that are not left out, from a row on, to a pose. Returns the row after the last."""
    c, s = np.cos(pose[0]), np.sin(pose[0])
    for i in range(count):
        if len(left_out) > 0:
            while left_out[row] != 0:
                row += 1
        x, y = points[2 * row], points[2 * row + 1]
        moved[2 * i] = c * x - s * y + pose[1]
        moved[2 * i + 1] = s * x + c * y + pose[2]
        row += 1
    return row


@inner_kernel
def _first_feet(feet: Any, count: int) -> Any:
    """The memory for the first feet of a chunk."""
    return Feet(
        feet.parameter[:count],
        feet.foot_mm[:count],
        feet.distance_mm[:count],
        feet.gradient[:count],
        feet.curvature[:count],
        feet.station_mm[:count],
        feet.vertex[:count],
    )


@inner_kernel
def _evaluate(
    problem: Any, projection: Any, pose: Any, span: Any, moved: Any, before: Any, takes_part: Any, feet: Any, known: bool, sums: Any
) -> None:
    """Add up the sums over the points at a pose, chunk by chunk and always in the same order.

    They are added first for each place in a block, so that the loop vectorises, then in halves.

    known : the points were looked at there before, so that their feet are still known where one chunk holds them all
    """
    points, left_out, weights, reals, integers, outward, tip = problem
    m, row = len(weights), _FIRST_ROW
    lanes = array_at(stack_reals(), REALS)
    for i in range(SUMS * BLOCK):
        lanes[i] = 0.0
    x0, y0 = _centre(pose, span)
    for begin in range(0, m, len(feet.vertex)):
        stop = min(begin + len(feet.vertex), m)
        if not known or m > len(feet.vertex):
            row = _place(points, left_out, row, stop - begin, pose, moved)
            project_by(projection, moved[: 2 * (stop - begin)], reals, integers, _first_feet(feet, stop - begin))
        for block in range(begin, stop, BLOCK):
            end = min(block + BLOCK, stop)
            near, far = block - begin, end - begin
            xy, gradient = moved[2 * near : 2 * far], feet.gradient.reshape(-1)[2 * near : 2 * far]
            distance, curvature, vertex = feet.distance_mm[near:far], feet.curvature[near:far], feet.vertex[near:far]
            weight, part_before, part = weights[block:end], before[block:end], takes_part[block:end]
            for j in range(end - block):
                _add_point(lanes, xy, gradient, distance, curvature, vertex, weight, part_before, part, outward, tip, x0, y0, j)
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
