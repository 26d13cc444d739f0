"""The minimum zone: the pose with the smallest largest deviation (Chebyshev), with its certificate.

ISO 1101 judges form by the minimum zone, not by least squares. At each step the deviations are linearised in the three
unknowns of the pose, and linear programming finds the smallest zone of the linear problem within a trust region. At most four
active points and their multipliers prove the last zone optimal. The linearisation is local, and so is the optimum.

Of many points few stand for all: the zone of some points is never wider than that of all, so it is that of all where they lie in it.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import linprog

from inspection.coarse import check_registrable
from inspection.fine import register
from inspection.methods import Method
from inspection.nominal import NominalProfile
from inspection.registration import Registration
from inspection.rigid import RigidTransform, rotation_about
from inspection.signed_deviations import Deviations, deviations
from inspection.telling_points import MANY, telling_rows

Array = NDArray[np.float64]
DeviationsOf = Callable[[Array], Deviations]

_MOST_PROGRAMS = 50
_WORKING_SHARE = 0.3  # of the largest deviation; the program begins with the points above it and adds those its solution violates
_MOST_ROUNDS = 20  # in which points join the few that stand for all
_ROUND_OFF = 1e-12
_STANDSTILL_MM = 1e-10
_MULTIPLIER = 1e-9


@dataclass(frozen=True, slots=True, eq=False)
class MinimumZone:
    """The smallest zone, and why no smaller one exists nearby.

    nominal_from_section : pose of the fit
    zone_mm              : width of the zone, 2 * max |deviation - middle_mm|
    middle_mm            : middle of the zone
    active               : (a,) indices of the points that hold the zone
    multipliers          : (a,) of those points, positive, with the sum 1; the gradients of their deviations, weighted by
                           multiplier and sign, add up to zero
    programs             : linear programs solved
    converged            : the last step moved no point by more than 1e-10 mm
    """

    nominal_from_section: RigidTransform
    zone_mm: float
    middle_mm: float
    active: NDArray[np.int64]
    multipliers: Array
    programs: int
    converged: bool


def fit_minimum_zone(
    points_mm: ArrayLike,
    nominal: NominalProfile,
    start: Registration | RigidTransform | None = None,
    method: Method = "exact",
    tip_radius_mm: float = 0.0,
    middle_mm: float = 0.0,
    is_over: Callable[[], bool] = lambda: False,
) -> MinimumZone:
    """Minimum zone of section points (m, 2), begun at `start` or at their best fit. Points beyond open ends take no part.

    middle_mm : middle of the tolerance zone that the deviations are held against; zero for an equally disposed zone
    is_over   : asked before every linear program; once it says so, the fit ends where it stands, not converged
    """
    points = check_registrable(points_mm)
    begin = register(points, nominal, method, tip_radius_mm=tip_radius_mm) if start is None else start
    pose = begin.nominal_from_section if isinstance(begin, Registration) else begin

    def deviations_of(moved: Array) -> Deviations:
        return deviations(moved, nominal, method, tip_radius_mm)

    if len(points) <= MANY:
        return _fit_all(points, deviations_of, pose, middle_mm, is_over)
    return _fit_by_few(points, deviations_of, pose, middle_mm, nominal.length_mm, is_over)


def _fit_by_few(
    points: Array, deviations_of: DeviationsOf, pose: RigidTransform, middle_mm: float, length_mm: float, is_over: Callable[[], bool]
) -> MinimumZone:
    """The minimum zone of those points that stand for all, which others join until all lie in it."""
    d = deviations_of(pose.apply(points))
    smallest = MinimumZone(pose, 2 * _half_zone(d, middle_mm), middle_mm, np.empty(0, np.int64), np.empty(0), 0, False)
    rows, outside, programs = np.empty(0, np.int64), np.flatnonzero(~d.beyond_end), 0
    for _ in range(_MOST_ROUNDS):
        rows = np.union1d(rows, outside[telling_rows(d.station_mm[outside], d.deviation_mm[outside], length_mm)])
        few = _fit_all(points[rows], deviations_of, pose, middle_mm, is_over)
        pose, programs = few.nominal_from_section, programs + few.programs
        d = deviations_of(pose.apply(points))
        zone = 2 * _half_zone(d, middle_mm)
        holds = zone <= few.zone_mm * (1 + _ROUND_OFF)
        if holds or zone < smallest.zone_mm:
            smallest = MinimumZone(pose, zone, middle_mm, rows[few.active], few.multipliers, programs, few.converged and holds)
        outside = np.flatnonzero(~d.beyond_end & (2 * np.abs(d.deviation_mm - middle_mm) > few.zone_mm))
        if holds or not len(np.setdiff1d(outside, rows)) or is_over():
            break
    return smallest


def _fit_all(
    points: Array, deviations_of: DeviationsOf, pose: RigidTransform, middle_mm: float, is_over: Callable[[], bool]
) -> MinimumZone:
    """The minimum zone of points (m, 2), begun at a pose."""
    moved = pose.apply(points)
    d = deviations_of(moved)
    trust = _half_zone(d, middle_mm)
    active, multipliers = np.empty(0, dtype=np.int64), np.empty(0)
    programs, converged = 0, False
    while programs < _MOST_PROGRAMS and not converged and not is_over():
        centre, step, promised, active, multipliers = _linear_step(moved, d, middle_mm, trust)
        programs += 1
        reach = np.hypot(*(moved - centre).T).max()
        moves = float(np.hypot(step[0], step[1]) + abs(step[2]) * reach)
        trial = rotation_about(centre, step[2], step[:2]).after(pose)
        trial_moved = trial.apply(points)
        trial_d = deviations_of(trial_moved)
        now, then = _half_zone(d, middle_mm), _half_zone(trial_d, middle_mm)
        converged = moves <= _STANDSTILL_MM or now - promised <= 1e-12 * now
        if then < now:
            pose, moved, d = trial, trial_moved, trial_d
            trust *= 2.0 if now - then > 0.5 * (now - promised) else 0.5
        elif not converged:
            trust = min(trust, moves) / 4
            converged = trust <= _STANDSTILL_MM
    return MinimumZone(pose, 2 * _half_zone(d, middle_mm), middle_mm, active, multipliers, programs, converged)


def _half_zone(d: Deviations, middle_mm: float) -> float:
    """The largest distance of a deviation from the middle of the zone."""
    return float(np.abs(d.deviation_mm[~d.beyond_end] - middle_mm).max(initial=0.0))


def _linear_step(points: Array, d: Deviations, middle_mm: float, trust_mm: float) -> tuple[Array, Array, float, NDArray[np.int64], Array]:
    """Solve min t with |e + J p| <= t, beginning with few points and adding those that the solution violates.

    Gives the centre (2,) of the points, the step (3,) about it, the half zone that the linear problem promises, the active
    points and their multipliers.
    """
    rows_all = np.flatnonzero(~d.beyond_end)
    x, g, e = points[rows_all], d.normal[rows_all], d.deviation_mm[rows_all] - middle_mm
    centre = x.mean(axis=0)
    arm = x - centre
    reach = float(np.hypot(*arm.T).max())
    J = np.column_stack([g, (arm[:, 0] * g[:, 1] - arm[:, 1] * g[:, 0]) / reach])  # rotation in mm at the farthest point
    working = np.flatnonzero(np.abs(e) >= _WORKING_SHARE * np.abs(e).max())
    while True:
        A = np.vstack([np.column_stack([J[working], -np.ones(len(working))]), np.column_stack([-J[working], -np.ones(len(working))])])
        b = np.concatenate([-e[working], e[working]])
        result = linprog([0, 0, 0, 1], A_ub=A, b_ub=b, bounds=[(-trust_mm, trust_mm)] * 3 + [(0, None)], method="highs")
        solution = np.asarray(result.x)  # the program always has one: p = 0 with t = max |e|
        step, promised = solution[:3], float(solution[3])
        violated = np.flatnonzero(np.abs(e + J @ step) > promised + 1e-12 * (1 + promised))
        new = np.setdiff1d(violated, working, assume_unique=True)
        if not new.size:
            break
        working = np.union1d(working, new)
    multipliers = -result.ineqlin.marginals.reshape(2, -1).sum(axis=0)
    held = np.flatnonzero(multipliers > _MULTIPLIER)
    return centre, np.array([step[0], step[1], step[2] / reach]), promised, rows_all[working[held]], multipliers[held]
