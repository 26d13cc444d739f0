"""Best fit with locked or limited freedoms: Newton steps in the free motions alone, begun at the datum's pose.

The motion is p = Z q with the free motions in the columns of Z, so the normal equations become Z' H Z q = -Z' g, and limits of q make
each step a bounded least-squares problem. There is no search over poses, and no other pose that could fit as well.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inspection.coarse import check_registrable
from inspection.freedoms import FreedomName, Freedoms, gradients
from inspection.gaps import weigh_by_station
from inspection.methods import Method, WeightName
from inspection.nominal import NominalProfile
from inspection.registration import Registration, no_outliers
from inspection.rigid import RigidTransform
from inspection.signed_deviations import Deviations, deviations

Array = NDArray[np.float64]

_MOST_STEPS = 60
_HALVINGS = 12
_STANDSTILL_MM = 1e-9
_TRUSTED = 1e-6  # least eigenvalue of the full second derivative, as a share of the largest, for it to be used
_FREE = 1e-9  # a motion whose eigenvalue is below this share of the largest changes no deviation
_LEAST_REACH_MM = 1e-9
_WEIGHINGS = 2  # the weights follow from the pose, and the pose from them


@dataclass(frozen=True, slots=True, eq=False)
class LimitedFit:
    """A best fit within its freedoms.

    registration : the pose; its covariance is about the moved pivot, over the freedoms that are neither locked nor at a limit
    amounts      : (k,) shift in mm or rotation in rad of each free motion from the start, in the order of the freedoms' names
    at_limit     : names of the freedoms that went as far as they may
    """

    registration: Registration
    amounts: Array
    at_limit: tuple[FreedomName, ...]


def register_within(
    points_mm: ArrayLike,
    nominal: NominalProfile,
    start: RigidTransform,
    freedoms: Freedoms,
    method: Method = "exact",
    tip_radius_mm: float = 0.0,
    target_mm: float = 0.0,
    weights: WeightName = "points",
    shares: Array | None = None,
) -> LimitedFit:
    """Least squares of section points (m, 2) over the free motions only, from the datum's pose `start`. The rest as `register_fine`.

    shares : how much of the profile each point (m,) stands for, where others than these points tell; it takes the place of `weights`
    """
    points = check_registrable(points_mm)
    look = _Look(points, nominal, start, freedoms, method, tip_radius_mm, target_mm)
    if shares is not None:
        look.weights = shares
    amounts, here, steps, settled = _settle(look, np.zeros(len(freedoms)))
    for _ in range(_WEIGHINGS if weights == "arc-length" and shares is None else 0):
        weigh_by_station(np.where(here.takes_part, here.station_mm, np.nan), look.weights, nominal)
        amounts, here, more, settled = _settle(look, amounts)
        steps += more
    return _limited_fit(look, amounts, here, steps, settled)


class _State(NamedTuple):
    """What amounts of the free motions lead to: the sums of the second-order model of the squares, and what they were made from."""

    square: float
    slope: Array
    tangential: Array
    bending: Array
    units_mm: Array
    reach_mm: float
    takes_part: NDArray[np.bool_]
    station_mm: Array


class _Look:
    """The deviations of points (m, 2) at amounts of the free motions, and their weights (m,)."""

    def __init__(
        self, points: Array, nominal: NominalProfile, start: RigidTransform, freedoms: Freedoms, method: Method, tip: float, target: float
    ) -> None:
        self.points, self.nominal, self.start, self.freedoms = points, nominal, start, freedoms
        self.method, self.tip_radius_mm, self.target_mm = method, tip, target
        self.weights = np.ones(len(points))

    def __call__(self, amounts: Array) -> _State:
        moved = self.freedoms.pose(self.start, amounts).apply(self.points)
        d = deviations(moved, self.nominal, self.method, self.tip_radius_mm)
        arms, part = self.freedoms.arms(moved, amounts), ~d.beyond_end
        reach = max(float(np.hypot(*arms[part].T).max(initial=0.0)), _LEAST_REACH_MM)
        units = self.freedoms.units_mm(reach)
        free = self.freedoms.directions.T / units  # (3, k): a step of 1 moves the farthest point by 1 mm
        e, w, J = d.deviation_mm[part] - self.target_mm, self.weights[part], gradients(d.normal, arms)[part]
        radial = (arms[:, 0] * d.normal[:, 0] + arms[:, 1] * d.normal[:, 1])[part]
        across = np.column_stack([-d.normal[part, 1], d.normal[part, 0], radial])
        bending = (across.T * (w * e * _bend(d, self.nominal.outward, self.tip_radius_mm)[part])) @ across
        bending[2, 2] -= float((w * e * radial).sum())
        square, slope = float((w * e * e).sum()), free.T @ (J.T @ (w * e))
        return _State(square, slope, free.T @ (J.T * w) @ J @ free, free.T @ bending @ free, units, reach, part, d.station_mm)


def _bend(d: Deviations, outward: float, tip_radius_mm: float) -> Array:
    """Second derivative (m,) of each deviation across its direction: of the distance from a curve, at a corner from a point."""
    field = d.deviation_mm + tip_radius_mm
    at_corner = d.at_vertex & ~d.beyond_end
    below = np.where(at_corner, field, np.maximum(1.0 - outward * d.curvature * field, 1e-3))
    usable = np.abs(below) > 1e-9
    return np.where(usable, np.where(at_corner, 1.0, -outward * d.curvature) / np.where(usable, below, 1.0), 0.0)


def _settle(look: _Look, amounts: Array) -> tuple[Array, _State, int, bool]:
    """Go to the least mean square. Gives the amounts (k,), what they lead to, the steps, and whether the last moved less than 1e-9 mm."""
    here, steps, settled = look(amounts), 0, not len(amounts)
    lower, upper = look.freedoms.lower, look.freedoms.upper
    while not settled and steps < _MOST_STEPS:
        steps += 1
        step, share = _step(here, (lower - amounts) * here.units_mm, (upper - amounts) * here.units_mm), 1.0
        settled = float(np.abs(step).sum()) <= _STANDSTILL_MM
        for _ in range(_HALVINGS):
            onward = np.clip(amounts + share * step / here.units_mm, lower, upper)
            trial = look(onward)
            if trial.square <= here.square * (1 + 1e-12):
                amounts, here = onward, trial
                break
            share /= 2
        else:
            break
    return amounts, here, steps, settled


def _step(state: _State, lower: Array, upper: Array) -> Array:
    """The step (k,) in mm to the least of the second-order model between the limits."""
    values, vectors = np.linalg.eigh(state.tangential + state.bending)
    if values.min() <= _TRUSTED * values.max():
        values, vectors = np.linalg.eigh(state.tangential)
    kept = values > _FREE * values.max()
    rows = (vectors[:, kept] * np.sqrt(values[kept])).T
    aim = -(vectors[:, kept].T @ state.slope) / np.sqrt(values[kept])
    step = np.linalg.lstsq(rows, aim)[0]
    if ((step >= lower) & (step <= upper)).all():
        return np.asarray(step)
    from scipy.optimize import lsq_linear  # noqa: PLC0415 - it takes half a second, and few fits meet their limits

    open_to = np.maximum(upper, lower + 1e-300)  # a limit of no width is a lock
    return np.clip(lsq_linear(rows, aim, (lower, open_to), method="bvls", tol=1e-15).x, lower, upper)


def _limited_fit(look: _Look, amounts: Array, here: _State, steps: int, settled: bool) -> LimitedFit:
    """The result at amounts (k,) of the free motions, and at what they lead to."""
    freedoms = look.freedoms
    count = int((here.takes_part & (look.weights > 0)).sum())
    held = np.minimum(amounts - freedoms.lower, freedoms.upper - amounts) * here.units_mm <= _STANDSTILL_MM
    scatter = here.square / max(count - int((~held).sum()), 1)
    covariance = np.zeros((3, 3))
    if not held.all():
        values, vectors = np.linalg.eigh(here.tangential[np.ix_(~held, ~held)])
        spread = np.divide(scatter, values, out=np.full_like(values, here.reach_mm**2), where=values > _FREE * values.max())
        motions = (freedoms.directions[~held].T / here.units_mm[~held]) @ vectors
        covariance = np.asarray((motions * spread) @ motions.T)
    rms = math.sqrt(here.square / count) if count else math.inf
    centre = freedoms.pivot_mm + (amounts @ freedoms.directions)[:2]
    pose = freedoms.pose(look.start, amounts)
    registration = Registration(pose, rms, steps, settled, covariance, centre, (), no_outliers(len(look.points)))
    return LimitedFit(registration, amounts, tuple(name for name, stuck in zip(freedoms.names, held, strict=True) if stuck))
