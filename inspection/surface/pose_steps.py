"""Steps towards the pose of least squares: Gauss and Newton's, and what they leave out, learnt on the way.

The deviations change by the rows [n, (x - c) x n] for a shift and a turn about the middle c of the points. Gauss and Newton's method
stops there and gains two digits a step where deviations are large for the bend of the surface. How their squares bend besides follows
from how the rows changed over the last step (Dennis, Gay and Welsch 1981, the update of NL2SOL), and makes that four digits and more.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inspection.errors import RegistrationError
from inspection.surface.circling import PoseOnTheWay, best_of, find_circle, width_mm
from inspection.surface.feet import FootKind, NominalSurface
from inspection.surface.rigid_motion import RigidMotion

Array = NDArray[np.float64]
Truth = NDArray[np.bool_]

_STEPS = 100
_SETTLED = 1e-11  # of the size: a step at the rim of the points after which the pose is found
_TO_COME = 1e-12  # of the size: all steps to come, where they can be foreseen because the last ones became so much shorter
_SURE = 0.1  # of the step before
_ROUND_OFF = 1e-9  # of the size: a step so short that is hardly shorter than the one before only shows the round-off of the feet
_HELD = 1e-8  # part of the strongest direction's stiffness below which a direction has no minimum, and is held
_FEWEST = 6
_STRAIGHT: Array = np.zeros((6, 6))  # nothing learnt yet


@dataclass(frozen=True, slots=True, eq=False)
class FitProblem:
    """Points (m, 3) to bring onto a nominal.

    weights   : (m,) of the points
    free      : (6,) shifts and turns that may change
    target_mm : the deviation that points are brought to
    """

    points: Array
    weights: Array
    nominal: NominalSurface
    free: Truth
    target_mm: float

    def some(self, which: NDArray[np.int64]) -> "FitProblem":
        """The same with some of the points, by their numbers (k,)."""
        return FitProblem(self.points[which], self.weights[which], self.nominal, self.free, self.target_mm)


@dataclass(frozen=True, slots=True, eq=False)
class Linearised:
    """What a step needs of a pose.

    rows, residual, weights, arms : (k, 6), (k,), (k,) and (k, 3) from the centre (3,), of the k points that take part
    radius : how far the farthest of them is from the centre
    used   : (m,) which points these are: those with a foot inside the surface that are not left out
    off_mm : (m,) deviations of all points; NaN where they have none, because the foot is at a border or there is none
    """

    rows: Array
    residual: Array
    weights: Array
    arms: Array
    centre: Array
    radius: float
    mean_square: float
    used: Truth
    off_mm: Array

    def slope(self, residual: Array) -> Array:
        """The sum (6,) of the rows by these deviations (k,)."""
        return np.asarray(np.einsum("mi,m,m->i", self.rows, self.weights, residual))


@dataclass(frozen=True, slots=True, eq=False)
class SettledPose:
    """Where the steps ended, and what a fit that goes on from there may know.

    steps     : how many they were
    within_mm : how far apart the poses bring a point at most where the steps go round in circles; 0 where the pose was found to round-off,
                infinite where they went on
    bend      : how the squares bend there besides: a guess (6, 6) for a weight of 1 in all
    """

    motion: RigidMotion
    state: Linearised
    steps: int
    within_mm: float
    bend: Array


def linearise(problem: FitProblem, motion: RigidMotion, left_out: Truth) -> Linearised:
    """The deviations at a pose and how they change. Raises RegistrationError where too few points lie on the surface."""
    moved = motion.apply(problem.points)
    feet = problem.nominal.project(moved)
    inside = feet.kind < FootKind.BORDER
    used = inside & ~left_out
    if np.count_nonzero(used) < _FEWEST:
        raise RegistrationError(
            f"only {np.count_nonzero(used)} of {len(moved)} points lie on the surface, at least {_FEWEST} are needed: is it "
            "the right part, and the right unit?"
        )
    x, n, w = moved[used], feet.normal[used], problem.weights[used]
    centre = (x * w[:, None]).sum(axis=0) / w.sum()
    arms = x - centre
    residual = feet.distance_mm[used] - problem.target_mm
    return Linearised(
        rows=np.column_stack([n, np.cross(arms, n)]),
        residual=residual,
        weights=w,
        arms=arms,
        centre=centre,
        radius=float(np.sqrt((arms**2).sum(axis=1).max())),
        mean_square=float((w * residual**2).sum() / w.sum()),
        used=used,
        off_mm=np.where(inside, feet.distance_mm, np.nan),
    )


def settle_pose(problem: FitProblem, start: RigidMotion, left_out: Truth, bend: Array | None = None) -> SettledPose:
    """Steps until the pose of least squares is found. One after which the deviations grow is taken back, and the next is damped.

    Where the steps go round in circles, it is the best pose of the circle.

    left_out : (m,) points that take no part
    bend     : as an earlier `SettledPose` knows it
    """
    motion, damping, steps, last, shrinks = start, 0.0, 0, np.inf, 1.0
    state = linearise(problem, motion, left_out)
    bends = _STRAIGHT if bend is None else bend * state.weights.sum()
    way: list[PoseOnTheWay] = []
    while steps < _STEPS:
        change = step_of(state, problem.free, damping, bends)
        following = RigidMotion.about(state.centre, change[3:], change[:3]).after(motion)
        there = linearise(problem, following, left_out)
        steps += 1
        rim = float(np.linalg.norm(change[:3]) + np.linalg.norm(change[3:]) * state.radius)
        converged = _is_settled(rim / problem.nominal.size_mm, last / problem.nominal.size_mm, shrinks)
        if there.mean_square > state.mean_square * (1 + 1e-6) and not converged:
            damping, bends, last, shrinks = max(10 * damping, 1e-3), _STRAIGHT, np.inf, 1.0
            continue
        bends = _learn(bends, state, there, change)
        motion, state, shrinks, last = following, there, rim / last if last < np.inf else 1.0, rim
        damping = damping / 10 if damping > 1e-6 else 0.0
        if converged:
            return SettledPose(motion, state, steps, 0.0, bends / state.weights.sum())
        way.append(PoseOnTheWay(motion, state.mean_square))
        if circle := find_circle(way, state.centre, state.radius):
            motion, within = best_of(circle), width_mm(circle, problem.points[~left_out])
            return SettledPose(motion, linearise(problem, motion, left_out), steps, within, bends / state.weights.sum())
    return SettledPose(motion, state, steps, np.inf, bends / state.weights.sum())


def _is_settled(rim: float, last: float, shrinks: float) -> bool:
    """Whether no step to come moves the pose, by the last one and that before at the rim of the points, in sizes of the nominal.

    shrinks : by how much the step before had become shorter; the next ones shrink as the worse of two did
    """
    foreseen = rim * max(rim / last, shrinks) <= _TO_COME and rim <= _SURE * last
    return rim <= _SETTLED or foreseen or last / 2 <= rim <= _ROUND_OFF


def step_of(state: Linearised, free: Truth, damping: float, bends: Array = _STRAIGHT) -> Array:
    """The shift and turn (6,) that bring the squares to their least. What has no minimum is held."""
    scale = np.array([1.0] * 3 + [1.0 / state.radius] * 3)  # turns by the way that the rim goes
    rows = (state.rows * scale)[:, free]
    normal = np.einsum("mi,mj,m->ij", rows, rows, state.weights)
    values, vectors = np.linalg.eigh(normal)
    strong = values > _HELD * values[-1]
    ways = vectors[:, strong]
    stiff = np.diag(values[strong] + damping * values[-1])
    bent = stiff + ways.T @ (bends * np.outer(scale, scale))[np.ix_(free, free)] @ ways
    if np.linalg.eigvalsh(bent)[0] > 0.5 * stiff.min():  # else what was learnt is no minimum
        stiff = bent
    change = np.zeros(6)
    change[free] = -ways @ np.linalg.solve(stiff, ways.T @ (state.slope(state.residual) * scale)[free])
    return np.asarray(change * scale)


def _learn(bends: Array, before: Linearised, after: Linearised, change: Array) -> Array:
    """How the squares bend besides, after a step: the same where the points that take part have changed."""
    if not np.array_equal(before.used, after.used):
        return bends
    scale = np.array([1.0] * 3 + [1.0 / before.radius] * 3)
    step, known = change / scale, bends * np.outer(scale, scale)
    by_rows = (after.slope(after.residual) - before.slope(after.residual)) * scale
    by_all = (after.slope(after.residual) - before.slope(before.residual)) * scale
    along = float(by_all @ step)
    if not along > 0:
        return bends
    has = abs(float(step @ known @ step))
    if has > 0:
        known = known * min(1.0, abs(float(step @ by_rows)) / has)
    lacks = by_rows - known @ step
    known = known + (np.outer(lacks, by_all) + np.outer(by_all, lacks)) / along
    known = known - float(lacks @ step) / along**2 * np.outer(by_all, by_all)
    return np.asarray(known / np.outer(scale, scale))
