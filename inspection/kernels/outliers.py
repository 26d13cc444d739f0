"""Gross outliers: the limit by the median, Tukey's weights, and which points lie beyond once the fit by these weights has settled."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from inspection.kernels.compiling import inner_kernel, kernel
from inspection.kernels.feet import feet_between
from inspection.kernels.layout import BLOCK, OPEN_END, SUMS
from inspection.kernels.normal_equations import newton_step
from inspection.kernels.on_samples import project_by
from inspection.kernels.pose_sums import call_evaluation, move_pose, place_points, span_of

Array = NDArray[np.float64]

MANY = 1 << 20  # points from which on a median is counted out, without a copy of them
TO_COME = 2.0  # all steps from here on together, as a multiple of one that is at most half as long as the one before
_AROUND_MEDIAN = 0.05  # share of a median within which the next one is expected
_LEAST_LIMIT_MM = 1e-9  # as far as a fit that has settled may still be off
# Not literals: to the compiler each of those has a type of its own, and what it is given to is compiled once more.
_KNOWN: Any = np.bool_(True)
_FIRST_ROW: Any = np.int64(0)


class OutlierLimit(NamedTuple):
    """The deviation from which on a point is an outlier.

    mads       : farther than so many median absolute deviations
    least_mm   : and farther than this, however small the deviations of the others are
    settled_mm : the fit by Tukey's weights has settled when it moves no point further
    """

    mads: float
    least_mm: float
    settled_mm: float


class OutlierFit(NamedTuple):
    """A fit by Tukey's weights.

    found    : (m,) which points are outliers
    pose     : rotation about the origin in rad, then shift in mm (x, y)
    limit_mm : a point as far off is an outlier
    settled  : the last step moved no point further than the limit of the fit says
    """

    found: NDArray[np.bool_]
    pose: tuple[float, float, float]
    limit_mm: float
    settled: bool


def limit_of(limit: OutlierLimit, median_mm: float) -> float:
    """How far off a point is an outlier, for a median of the deviations."""
    return max(limit.mads * median_mm, limit.least_mm, _LEAST_LIMIT_MM)


def median_near(values: Array, guess: float) -> float:
    """The median of the values that are numbers, of which only those around a guess are ordered where the guess is a good one."""
    low, high = guess * (1.0 - _AROUND_MEDIAN), guess * (1.0 + _AROUND_MEDIAN)
    inside = values[(values >= low) & (values <= high)]
    below, above = np.count_nonzero(values < low), np.count_nonzero(values > high)
    count = below + len(inside) + above
    if not count:
        return np.inf
    ranks = np.array([(count - 1) // 2, count // 2]) - below
    if ranks[0] < 0 or ranks[1] >= len(inside):
        return float(np.nanmedian(values))
    return float(np.partition(inside, ranks)[ranks].mean())


@kernel
def mark_outliers(
    problem: Any, projection: Any, evaluation: int, memory: Any, state: Any, wanted: Any, most_steps: int, found: Any, off: Any
) -> bool:
    """Make weighted steps, the weights following from the deviations at every pose, and mark the points beyond the limit.

    It ends where no step to come can change which points these are. Moves the state (4,), a pose and the limit, and returns whether it
    ended before the steps did.

    evaluation : `evaluation_code()`
    """
    weights = problem[2]
    takes_part, weighed, moved, feet = memory
    m, sums, last = len(weights), np.empty(SUMS), np.inf
    span, pose, before = span_of(problem[0], problem[1], m), (state[0], state[1], state[2]), state[3]
    for _ in range(most_steps):
        count = _look_at_distances(problem, projection, pose, moved, takes_part, feet, off)
        limit = np.inf
        if count > 0:
            limit = max(wanted.mads * _median(off, takes_part), wanted.least_mm, _LEAST_LIMIT_MM)
        weight, root = _weigh(off, takes_part, limit, weights, found)
        which = (takes_part, weighed)
        call_evaluation(evaluation, (problem, projection, pose, span, moved, *which, feet, _KNOWN, _FIRST_ROW, np.inf, off[:0], sums))
        step, share = newton_step(sums, span[2]), share_of_tukey(weight, root)
        pose = move_pose(pose, span, step, share)
        state[0], state[1], state[2] = pose
        state[3] = limit
        to_come = TO_COME * (share * step[3] + abs(limit - before)) if share * step[3] <= last / 2.0 else np.inf
        if share * step[3] <= wanted.settled_mm or not _is_any_within(off, weighed, limit, to_come):
            return count > 0
        before, last = limit, share * step[3]
    return False


@kernel
def share_of_tukey(weight: float, root: float) -> float:
    """By how much a step with Tukey's weights falls short, from the sums of the weights and of their roots.

    The derivative of w(e) e is less than w(e). The ratio of their sums, which is that of the step to Newton's where the
    deviations have nothing to do with place, makes half the steps.
    """
    slope = 5.0 * weight - 4.0 * root
    return weight / slope if slope > 0.5 * weight else 1.0


@inner_kernel
def _weigh(off: Any, takes_part: Any, limit: float, weights: Any, found: Any) -> tuple[float, float]:
    """Enter Tukey's weights, and which points are beyond the limit. Returns the sums of the weights and of their roots."""
    near, weight, root = np.empty(BLOCK), 0.0, 0.0
    for begin in range(0, len(off), BLOCK):
        stop = min(begin + BLOCK, len(off))
        here, part, weighed, beyond = off[begin:stop], takes_part[begin:stop], weights[begin:stop], found[begin:stop]
        for j in range(stop - begin):  # by itself, so that it vectorises; sums are added up one after the other
            share = here[j] / limit
            rest = 1.0 - share * share
            near[j] = rest if here[j] < limit else 0.0
            beyond[j] = (here[j] >= limit) & (part[j] > 0)
        for j in range(stop - begin):
            weighed[j] = near[j] * near[j]
            weight += weighed[j]
            root += near[j]
    return weight, root


@inner_kernel
def _is_any_within(off: Any, takes_part: Any, limit: float, reach: float) -> bool:
    """Whether a point that takes part is as close to the limit."""
    found = False
    for i in range(len(off)):
        found |= (takes_part[i] > 0) & (abs(off[i] - limit) <= reach)
    return found


@inner_kernel
def _look_at_distances(problem: Any, projection: Any, pose: Any, moved: Any, takes_part: Any, feet: Any, off: Any) -> int:
    """Enter how far each point is from the target, and which take part, at a pose. Returns how many do."""
    points, left_out, weights, reals, integers, outward, tip = problem
    m, row, count = len(weights), _FIRST_ROW, 0
    for begin in range(0, m, len(feet.vertex)):
        stop = min(begin + len(feet.vertex), m)
        row = place_points(points, left_out, row, stop - begin, pose, moved)
        project_by(projection, moved[: 2 * (stop - begin)], reals, integers, feet_between(feet, _FIRST_ROW, stop - begin))
        distance, vertex, away, part = feet.distance_mm, feet.vertex, off[begin:stop], takes_part[begin:stop]
        for j in range(stop - begin):
            away[j] = abs(outward * distance[j] - tip)
        for j in range(stop - begin):
            part[j] = vertex[j] != OPEN_END
        for j in range(stop - begin):
            count += part[j]
    return count


@inner_kernel
def _median(off: Any, takes_part: Any) -> float:
    """The median of the values of points that take part; of many it is counted out, which takes no copy of them."""
    count = 0
    for i in range(len(off)):
        count += takes_part[i] > 0
    if count == 0:
        return np.inf
    if count > MANY:
        return 0.5 * (_value_of_rank(off, takes_part, (count - 1) // 2) + _value_of_rank(off, takes_part, count // 2))
    chosen, at = np.empty(count), 0
    for i in range(len(off)):
        if takes_part[i] > 0:
            chosen[at] = off[i]
            at += 1
    return float(np.median(chosen))


@inner_kernel
def _value_of_rank(values: Any, takes_part: Any, rank: int) -> float:
    """The value with so many smaller or equal ones before it, of values that are not negative: their bits are ordered like themselves."""
    bits, tally, found = values.view(np.int64), np.empty(1 << 16, dtype=np.int64), np.zeros(1, dtype=np.int64)
    for shift in (48, 32, 16, 0):
        tally[:] = 0
        for i in range(len(bits)):
            if takes_part[i] > 0 and bits[i] >> shift >> 16 == found[0]:
                tally[(bits[i] >> shift) & 0xFFFF] += 1
        digit = 0
        while rank >= tally[digit]:
            rank -= tally[digit]
            digit += 1
        found[0] = found[0] << 16 | digit
    return float(found.view(np.float64)[0])
