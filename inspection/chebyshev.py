"""The motion that makes the largest of many values smallest (Chebyshev), by successive linear programs with a trust region.

At each step the values are linearised in the free motions, and a linear program finds the least largest of the linear problem. At
most one active point more than there are freedoms, with their multipliers, prove the last one optimal. The linearisation is local,
and so is the optimum. Of many points few stand for all: the largest of some values is never above that of all, so it is that of
all where no other exceeds it.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from inspection.freedoms import Freedoms, gradients
from inspection.rigid import RigidTransform
from inspection.telling_points import MANY, telling_rows

Array = NDArray[np.float64]
Rows = NDArray[np.int64]

_MOST_PROGRAMS = 50
_WORKING_SHARE = 0.8  # of the largest value; the program begins with the points above it and adds those that its solution violates
_MOST_JOINING = 128  # of these in a round, the worst: of all points few hold the solution, and each costs time in every program
_MOST_ROUNDS = 20  # in which points join the few that stand for all
_ROUND_OFF = 1e-12
_STANDSTILL_MM = 1e-10
_MULTIPLIER = 1e-9


class Values(NamedTuple):
    """What is made small, at one pose.

    value      : (m,) signed
    gradient   : (m, 2) of the values by the place of their points, mm
    station_mm : (m,) of the feet
    takes_part : (m,) whether the point counts
    """

    value: Array
    gradient: Array
    station_mm: Array
    takes_part: NDArray[np.bool_]

    @property
    def largest(self) -> float:
        """The largest |value| of the points that count."""
        return float(np.abs(self.value[self.takes_part]).max(initial=0.0))


Look = Callable[[Array], Values]


@dataclass(frozen=True, slots=True, eq=False)
class Descent:
    """Where the largest value is smallest, and why it is no smaller nearby.

    pose        : nominal from section
    amounts     : (k,) of the free motions from the start, mm or rad
    largest     : the largest |value| there
    active      : (a,) indices of the points that hold it
    multipliers : (a,) of those points, positive, with the sum 1
    programs    : linear programs solved
    converged   : the last step moved no point by more than 1e-10 mm
    """

    pose: RigidTransform
    amounts: Array
    largest: float
    active: Rows
    multipliers: Array
    programs: int
    converged: bool


def descend(
    points: Array,
    look: Look,
    start: RigidTransform,
    freedoms: Freedoms | None,
    length_mm: float,
    is_over: Callable[[], bool] = lambda: False,
    unit_mm: float = 1.0,
) -> Descent:
    """Lower the largest value of section points (m, 2) from a start, in the free motions; None frees all.

    look    : values of moved points (k, 2), any of the points, in nominal coordinates
    is_over : asked before every program; once it says so, the descent ends where it stands, not converged
    unit_mm : what a value of 1 is in mm: the first trust region is the largest value
    """
    order = np.lexsort(points.T)  # by their places, so that the order in which they came does not show in the last digit
    points = points[order]
    if freedoms is None:
        freedoms = Freedoms.about(start.apply(points).mean(axis=0))
    problem = _Problem(look, start, freedoms, unit_mm, is_over)
    few = len(points) <= MANY
    found = problem.descend(points, np.zeros(len(freedoms))) if few else _descend_by_few(problem, points, length_mm)
    active = order[found.active]
    by_row = np.argsort(active)
    return replace(found, active=active[by_row], multipliers=found.multipliers[by_row])


def _descend_by_few(problem: "_Problem", points: Array, length_mm: float) -> Descent:
    """Descend with those points that stand for all, which others join until none exceeds them."""
    amounts = np.zeros(len(problem.freedoms))
    here = problem.values(points, amounts)
    best = Descent(problem.start, amounts, here.largest, np.empty(0, np.int64), np.empty(0), 0, False)
    rows, outside, programs = np.empty(0, np.int64), np.flatnonzero(here.takes_part), 0
    for _ in range(_MOST_ROUNDS):
        rows = np.union1d(rows, outside[telling_rows(here.station_mm[outside], here.value[outside], length_mm)])
        few = problem.descend(points[rows], amounts)
        amounts, programs = few.amounts, programs + few.programs
        here = problem.values(points, amounts)
        holds = here.largest <= few.largest * (1 + _ROUND_OFF)
        if holds or here.largest < best.largest:
            best = Descent(few.pose, amounts, here.largest, rows[few.active], few.multipliers, programs, few.converged and holds)
        outside = np.flatnonzero(here.takes_part & (np.abs(here.value) > few.largest))
        if holds or not len(np.setdiff1d(outside, rows)) or problem.is_over():
            break
    return best


class _Step(NamedTuple):
    """The solution of a linear program: amounts (k,) to go, how far that moves a point, and what it promises the largest value to be."""

    amounts: Array
    moves_mm: float
    promised: float
    active: Rows
    multipliers: Array


class _Problem(NamedTuple):
    """What is lowered, from where, by which motions."""

    look: Look
    start: RigidTransform
    freedoms: Freedoms
    unit_mm: float
    is_over: Callable[[], bool]

    def values(self, points: Array, amounts: Array) -> Values:
        """The values of points (m, 2) after amounts (k,) of the free motions."""
        return self.look(self.freedoms.pose(self.start, amounts).apply(points))

    def descend(self, points: Array, amounts: Array) -> Descent:
        """Descend with all of points (m, 2) from amounts (k,)."""
        here = self.values(points, amounts)
        trust = here.largest * self.unit_mm
        active, multipliers = np.empty(0, dtype=np.int64), np.empty(0)
        programs, converged, can_go = 0, False, bool(here.takes_part.any())
        while can_go and programs < _MOST_PROGRAMS and not converged and not self.is_over():
            step = self._step(points, here, amounts, trust)
            programs += 1
            active, multipliers, moves, gain = step.active, step.multipliers, step.moves_mm, here.largest - step.promised
            onward = np.clip(amounts + step.amounts, self.freedoms.lower, self.freedoms.upper)
            trial = self.values(points, onward)
            won = here.largest - trial.largest
            converged = moves <= _STANDSTILL_MM or gain <= _ROUND_OFF * here.largest
            if won > 0:
                amounts, here = onward, trial
                trust *= 2.0 if won > 0.5 * gain else 0.5
            elif not converged:
                trust = min(trust, moves) / 4
                converged = trust <= _STANDSTILL_MM
        pose = self.freedoms.pose(self.start, amounts)
        return Descent(pose, amounts, here.largest, active, multipliers, programs, converged)

    def _step(self, points: Array, here: Values, amounts: Array, trust_mm: float) -> _Step:
        """Solve min t with |value + J q| <= t, beginning with few points and adding those that the solution violates."""
        from scipy.optimize import linprog  # noqa: PLC0415 - it takes half a second, and few verdicts need the minimum zone

        every = np.flatnonzero(here.takes_part)
        arms = self.freedoms.arms(self.freedoms.pose(self.start, amounts).apply(points[every]), amounts)
        units = self.freedoms.units_mm(float(np.hypot(*arms.T).max()))  # rotation in mm at the farthest point
        value, J = here.value[every], gradients(here.gradient[every], arms) @ (self.freedoms.directions.T / units)
        k = len(units)
        low = np.maximum((self.freedoms.lower - amounts) * units, -trust_mm)
        high = np.minimum((self.freedoms.upper - amounts) * units, trust_mm)
        largest, unit = float(np.abs(value).max()), trust_mm or 1.0  # it is zero where all points lie on the nominal
        working = np.flatnonzero(np.abs(value) >= _WORKING_SHARE * largest)
        while True:
            # In units of the trust region, counted from the largest value: the solver errs by 1e-7, whatever the numbers stand for.
            slack, of_work, value_of_work = -np.ones(len(working)), J[working], value[working]
            A = np.vstack([np.column_stack([of_work, slack]), np.column_stack([-of_work, slack])])
            b = np.concatenate([largest - value_of_work, largest + value_of_work]) / unit
            bounds = [*zip((low / unit).tolist(), (high / unit).tolist(), strict=True), (None, None)]
            result = linprog([0] * k + [1], A_ub=A, b_ub=b, bounds=bounds, method="highs")
            solution = unit * np.asarray(result.x)  # the program always has one: to stay
            step, promised = solution[:k], largest + float(solution[k])
            size = np.abs(value + J @ step)
            new = np.setdiff1d(np.flatnonzero(size > promised + _ROUND_OFF * (1 + promised)), working, assume_unique=True)
            if not new.size:
                break
            if len(new) > _MOST_JOINING:
                new = new[np.argpartition(size[new], -_MOST_JOINING)[-_MOST_JOINING:]]
            working = np.union1d(working, new)
        multipliers = -result.ineqlin.marginals.reshape(2, -1).sum(axis=0)
        held = np.flatnonzero(multipliers > _MULTIPLIER)
        moves = float(np.hypot(*(step @ (self.freedoms.directions / units[:, None]))[:2]) + np.abs(step[self.freedoms.turning]).sum())
        return _Step(step / units, moves, promised, every[working[held]], multipliers[held])
