"""The fine registration: Gauss-Newton on the pose of points, with or without gross outliers among them."""

from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from inspection.kernels.blocks import CurveTables, search_code
from inspection.kernels.compiling import inner_kernel, kernel
from inspection.kernels.feet import Marks, Room, empty_feet, flatten, share_out
from inspection.kernels.layout import AT_ONCE, COUNT, SLOPE_TURN, SLOPE_X, SLOPE_Y, SQUARE, SQUARE_BEFORE, SUMS
from inspection.kernels.normal_equations import fill_covariance, newton_step
from inspection.kernels.on_samples import NO_PROJECTION, SampleTables, projection_of
from inspection.kernels.outliers import MANY, TO_COME, OutlierFit, OutlierLimit, limit_of, mark_outliers, median_near, share_of_tukey
from inspection.kernels.pose_sums import add_up, call_evaluation, centre_of, evaluation_code, move_pose, span_of

Array = NDArray[np.float64]
Pose = tuple[float, float, float]  # rotation about the origin in rad, then shift in mm (x, y)

NONE_LEFT_OUT: Marks = np.empty(0, dtype=np.uint8)
_NO_WEIGHING: Array = np.empty(0)
_STANDSTILL_MM = 1e-9  # Gauss-Newton ends when no point moves further
_HALVINGS = 12
_HOVERING_STEPS = 3  # after them points that come and go at an open end in small steps are left out: no pose suits both
_HOVERING_MM = 0.01
_STANDSTILL_TO_COME_MM = 1e-12  # it ends as well when the step after this one moves none further, however slowly steps fall
_PASSES = 4  # near the least mean square two are enough
_WEIGHED_PASSES = 12


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

    pose: Pose
    steps: int
    settled: bool
    mean_square: float
    centre_mm: Array
    covariance: Array


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
        before[:] = after[:] = 1
        self._room, self._memory = room, (before, after, np.empty(2 * chunk), empty_feet(chunk))

    @property
    def reach_mm(self) -> float:
        """How far the farthest point is from the mean of all."""
        return float(self._span[2])

    @cached_property
    def _span(self) -> tuple[float, float, float]:
        """The mean of the points, and the reach."""
        return span_of(self._problem[0], self._problem[1], len(self.weights))

    @cached_property
    def _first_rows(self) -> NDArray[np.int64]:
        """The row of the first point of every chunk that a thread takes."""
        return _first_rows(self._problem[1], len(self.weights))

    def settle(self, pose: Pose, most_steps: int) -> PoseEstimate:
        """Go from a pose to the least mean square of the deviations, by at most so many steps."""
        state, covariance = np.array([*pose, 0.0, 0.0, 0.0]), np.empty((3, 3))
        steps, settled = _settle_pose(self._problem, self._projection, evaluation_code(), self._memory, state, covariance, most_steps)
        return _estimate(state, covariance, steps, settled)

    def settle_nearby(self, pose: Pose) -> PoseEstimate | None:
        """Go from a pose close to the least mean square there, on all threads; None where that takes more than a few whole steps.

        None as well where points with a weight take no part: `settle` knows what to do with those that hover at an end.
        """
        before, here = self._memory[:2]
        sums, last_mm, count = self._pass(pose, before, here), 0.0, np.count_nonzero(self.weights)
        for steps in range(1, _PASSES + 1):
            next_pose, moved_mm, fall = _next_pose(pose, self._span, sums, 1.0)
            if sums[COUNT] != count or not np.isfinite(moved_mm):
                return None
            if moved_mm <= _STANDSTILL_MM or moved_mm * moved_mm <= _STANDSTILL_TO_COME_MM * last_mm:
                sums[SQUARE] = max(sums[SQUARE] - fall, 0.0)
                state, covariance = np.empty(6), np.empty((3, 3))
                _report(sums, next_pose, self._span, state, covariance)
                return _estimate(state, covariance, steps, True)
            before, here = here, before
            there = self._pass(next_pose, before, here)
            if there[SQUARE_BEFORE] > sums[SQUARE] * (1.0 + 1e-12):
                return None
            pose, sums, last_mm = next_pose, there, moved_mm
        return None

    def find_outliers(self, pose: Pose, limit: OutlierLimit, most_steps: int) -> OutlierFit:
        """Mark the points (m,) that are beyond the limit once the fit by Tukey's weights has settled."""
        m = len(self.weights)
        found, off, state = self._room((m,), np.bool_), self._room((m,), np.float64), np.array([*pose, np.inf])
        found[:] = False
        settled = mark_outliers(self._problem, self._projection, evaluation_code(), self._memory, state, limit, most_steps, found, off)
        return OutlierFit(found, tuple(state[:3].tolist()), float(state[3]), settled)

    def find_outliers_nearby(self, near: OutlierFit, limit: OutlierLimit) -> OutlierFit | None:
        """The same, on all threads, from a fit to some of the points; None where that takes more than a few steps."""
        off, (before, here) = np.empty(len(self.weights)), self._memory[:2]
        pose, limit_mm, last_mm = near.pose, near.limit_mm, np.inf
        for _ in range(_WEIGHED_PASSES):
            sums = self._pass(pose, before, here, limit_mm, off)
            share = share_of_tukey(float(self.weights.sum()), float(np.sqrt(self.weights).sum()))
            next_pose, moved_mm, _ = _next_pose(pose, self._span, sums, share)
            if not sums[COUNT] > 0.0 or not np.isfinite(moved_mm):
                return None
            next_mm = limit_of(limit, median_near(off, limit_mm / limit.mads))
            to_come = TO_COME * (moved_mm + abs(next_mm - limit_mm)) if moved_mm <= last_mm / 2 else np.inf
            if moved_mm <= limit.settled_mm or not np.any(np.abs(off - next_mm) <= to_come):
                return OutlierFit(off >= next_mm, pose, next_mm, True)
            pose, limit_mm, last_mm = next_pose, next_mm, moved_mm
        return None

    def _pass(self, pose: Pose, before: Marks, here: Marks, limit_mm: float = 0.0, off: Array = _NO_WEIGHING) -> Array:
        """The sums over the points at a pose, chunk by chunk; `before` and `here` say who took part there and at the pose before."""
        sums = np.empty((len(self._first_rows), SUMS))
        asked = (self._problem, self._projection, evaluation_code(), pose, self._span, (before, here), self._first_rows, (limit_mm, off))
        share_out(lambda claimed: add_up(*asked, claimed, sums), len(self.weights), None)
        return np.asarray(np.add.reduce(sums, axis=0))


def _estimate(state: Array, covariance: Array, steps: int, settled: bool) -> PoseEstimate:
    angle, x, y, mean_square, _, _ = state.tolist()
    return PoseEstimate((angle, x, y), steps, settled, mean_square, state[4:], covariance)


def _first_rows(left_out: Marks, m: int) -> NDArray[np.int64]:
    """The row of the first of every AT_ONCE points that are not left out, of m."""
    if not len(left_out):
        return np.arange(0, m, AT_ONCE)
    chosen, count = [], 0
    for first in range(0, len(left_out), MANY):
        inside = np.flatnonzero(left_out[first : first + MANY] == 0)
        chosen.append(first + inside[-count % AT_ONCE :: AT_ONCE])
        count += len(inside)
    return np.concatenate(chosen)


def compile_fit(outliers: bool = False) -> None:
    """Compile the search and the fit, or load them, as `PoseFit` takes them. No point is settled, so none is projected.

    outliers : that which finds outliers as well
    """
    search_code()
    none, integers = np.empty(0), np.frombuffer(bytes(4), dtype=np.int32)
    problem = (none, NONE_LEFT_OUT, none, NO_PROJECTION[0][0], integers, 1.0, 0.0)
    memory, chunks = (NONE_LEFT_OUT, NONE_LEFT_OUT, none, empty_feet(1)), np.empty(0, dtype=np.int64)
    _settle_pose(problem, NO_PROJECTION, evaluation_code(), memory, np.zeros(6), np.empty((3, 3)), 0)
    marks, tukey, span = (NONE_LEFT_OUT, NONE_LEFT_OUT), (0.0, _NO_WEIGHING), (0.0, 0.0, 1.0)
    add_up(
        problem,
        NO_PROJECTION,
        evaluation_code(),
        (0.0, 0.0, 0.0),
        span,
        marks,
        chunks,
        tukey,
        np.zeros(1, dtype=np.int64),
        np.empty((0, SUMS)),
    )
    _next_pose((0.0, 0.0, 0.0), span, np.zeros(SUMS), 1.0)
    if outliers:
        limit, found = OutlierLimit(1.0, 0.0, 0.0), np.empty(0, dtype=np.bool_)
        mark_outliers(problem, NO_PROJECTION, evaluation_code(), memory, np.zeros(4), limit, 0, found, none)


@kernel
def _next_pose(pose: Any, span: Any, sums: Any, share: float) -> tuple[Pose, float, float]:
    """The pose after a share of a Newton step, how far that moves the farthest point, and by how much the sum of squares is to fall."""
    step = newton_step(sums, span[2])
    fall = -(sums[SLOPE_X] * step[0] + sums[SLOPE_Y] * step[1] + sums[SLOPE_TURN] * step[2])
    return move_pose(pose, span, step, share), share * step[3], fall


@kernel
def _settle_pose(
    problem: Any, projection: Any, evaluation: int, memory: Any, state: Any, covariance: Any, most_steps: int
) -> tuple[int, bool]:
    """Make Newton steps, each halved until the mean square falls. Returns their number and whether the pose has settled."""
    weights = problem[2]
    takes_part, new_part, moved, feet = memory
    span, pose, here, trial = span_of(problem[0], problem[1], len(weights)), (state[0], state[1], state[2]), np.empty(SUMS), np.empty(SUMS)
    all_weights = (_FIRST_ROW, np.inf, weights[:0])
    call_evaluation(evaluation, (problem, projection, pose, span, moved, new_part, takes_part, feet, _NOT_KNOWN, *all_weights, here))
    steps, settled, lower = 0, False, True
    while lower and not settled and steps < most_steps:
        steps += 1
        step, next_pose, share, lower = newton_step(here, span[2]), pose, 1.0, False
        for _ in range(_HALVINGS):
            next_pose = move_pose(pose, span, step, share)
            # It changes no deviation by more, so there is nothing to project again; without any point nothing was fitted.
            settled = share * step[3] <= _STANDSTILL_MM and here[COUNT] > 0.0
            if settled:
                break
            call_evaluation(
                evaluation, (problem, projection, next_pose, span, moved, takes_part, new_part, feet, _NOT_KNOWN, *all_weights, trial)
            )
            lower = trial[SQUARE_BEFORE] <= here[SQUARE] * (1.0 + 1e-12)
            if lower:
                break
            share *= 0.5
        if lower and steps >= _HOVERING_STEPS and share * step[3] < _HOVERING_MM and trial[COUNT] != here[COUNT]:
            _leave_out_hovering(weights, takes_part, new_part)
            call_evaluation(
                evaluation, (problem, projection, next_pose, span, moved, takes_part, new_part, feet, _KNOWN, *all_weights, trial)
            )
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


@kernel
def _report(sums: Any, pose: Any, span: Any, state: Any, covariance: Any) -> None:
    """Fill in the state (6,): the pose, the mean square of the deviations, the centre of the points; and the covariance."""
    state[0], state[1], state[2] = pose
    state[3] = sums[SQUARE] / sums[COUNT] if sums[COUNT] > 0.0 else np.inf
    state[4], state[5] = centre_of(pose, span)
    fill_covariance(sums, span[2], sums[SQUARE] / max(sums[COUNT] - 3.0, 1.0), covariance)
