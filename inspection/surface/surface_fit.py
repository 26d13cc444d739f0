"""Points brought onto a surface in six freedoms: Gauss and Newton's method on exact feet, from a start or from none.

The order of the points has no say: they are sorted first. Nor has their density: where they lie more densely each weighs less.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import permutations, product
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inspection.errors import RegistrationError
from inspection.surface.feet import NominalSurface, points_in_space
from inspection.surface.pose_steps import FitProblem, SettledPose, linearise, settle_pose, step_of
from inspection.surface.rigid_motion import RigidMotion
from inspection.surface.weakness import Weakness, weakness_of

Array = NDArray[np.float64]
Truth = NDArray[np.bool_]
SurfaceFreedom = Literal["x", "y", "z", "rx", "ry", "rz"]

_FREEDOMS = get_args(SurfaceFreedom)
_CELL = 0.01  # of the size: points in one cell share its weight
_FEWEST = 6
_MADS = 6.0  # median absolute deviations beyond which a point is an outlier, as for profiles
_MANY, _AHEAD = 1 << 17, 1 << 14  # points from which on a choice of so many goes ahead
_ROUNDS = 20  # in which outliers are found anew
_FEW, _TRIES = 500, 25  # points that a pose is tried with, and steps
_PLACES = 4000  # of the nominal from which its axes are taken
_WORST = 0.1  # of the points that are left out while a pose is tried
_RIVAL = 1.1  # times the least rms: another pose that fits as well
_FITS = 0.02  # of the size: a larger rms means that the pose was not found
_OTHER_POSE = 0.02  # of the size at the rim: poses farther apart are different ones


@dataclass(frozen=True, slots=True, eq=False)
class SurfaceRegistration:
    """Where a scan lies on its nominal, and how well that is known.

    nominal_from_scan : the motion that brings points of the scan onto the nominal
    rms_mm            : root of the mean square of the deviations from the target, weighted by area, of the points that took part
    steps             : of Gauss and Newton's method, those of a choice of the points included
    converged         : whether those to come are below round-off
    used              : (m,) points that took part: those with a foot inside the surface that are no outliers
    outlier           : (m,) points left out as outliers, by six median deviations; none unless that was asked for
    weakest           : the direction that the points determine least; directions that they do not determine at all were held
    rivals            : other poses that fit as well, as in a symmetric part: how many
    rival_poses       : these poses, refined in the same way
    centre_mm         : the middle of the points that took part, on the nominal, about which the weakest direction turns
    """

    nominal_from_scan: RigidMotion
    rms_mm: float
    steps: int
    converged: bool
    used: Truth
    outlier: Truth
    weakest: Weakness
    centre_mm: Array
    rivals: int = 0
    rival_poses: tuple[RigidMotion, ...] = ()

    def slid_poses(self) -> tuple[RigidMotion, ...]:
        """The poses as far off both ways along the weakest direction as the part may lie (95 %); none where the points do not fix it."""
        weakest, far = self.weakest, self.weakest.shift_95_mm
        if not 0 < far < np.inf:
            return ()
        ways = (RigidMotion.about(self.centre_mm, sign * far * weakest.turn_rad, sign * far * weakest.shift) for sign in (1, -1))
        return tuple(way.after(self.nominal_from_scan).snap_to_grid() for way in ways)


def register_surface(
    points_mm: ArrayLike,
    nominal: NominalSurface,
    start: RigidMotion | None = None,
    locked: Sequence[SurfaceFreedom] = (),
    target_mm: float = 0.0,
    gross_mm: float | None = None,
    farthest_mm: float = np.inf,
) -> SurfaceRegistration:
    """Bring points (m, 3) onto a nominal.

    start     : the pose to begin with, within the reach of the nearest surface; None seeks it by the principal axes of both, for scans
                of the whole part
    locked    : shifts and turns, in the coordinates of the nominal, that stay as they are in `start`
    target_mm : the deviation that points are brought to, the middle of the zone
    gross_mm  : leave out what deviates more than six times the median and more than this; None leaves nothing out
    farthest_mm : leave out in any case what lies farther off the surface

    Raises RegistrationError where the pose is not found, or too few points lie on the surface.
    """
    unknown = set(locked) - set(_FREEDOMS)
    if unknown:
        raise ValueError(f"a freedom must be one of {', '.join(_FREEDOMS)}, not {', '.join(sorted(unknown))}")
    if locked and start is None:
        raise ValueError("freedoms can only be locked at a start")
    points = points_in_space(points_mm)
    order = np.lexsort(points.T)
    order = order[np.isfinite(points[order]).all(axis=1)]
    if len(order) < _FEWEST:
        raise RegistrationError(f"{len(order)} points are too few to find a pose: at least {_FEWEST} are needed")
    is_new = np.append(True, (np.diff(points[order], axis=0) != 0).any(axis=1))  # a point that came twice counts once
    given = points[order[is_new]]
    weights = _weights(given, _CELL * nominal.size_mm)
    others: list[RigidMotion] = []
    if start is None:
        start, others = _seek(given, weights, nominal, target_mm)
    free = np.array([name not in locked for name in _FREEDOMS])
    problem = FitProblem(given, weights, nominal, free, target_mm)
    found = _fit(problem, start, gross_mm, farthest_mm)
    rivals = tuple(_fit(problem, other, gross_mm, farthest_mm).nominal_from_scan for other in others)
    used, outlier = (np.zeros(len(points), dtype=bool) for _ in range(2))
    same = np.cumsum(is_new) - 1
    used[order], outlier[order] = found.used[same], found.outlier[same]
    return replace(found, used=used, outlier=outlier, rivals=len(rivals), rival_poses=rivals)


def _weights(points: Array, cell_mm: float) -> Array:
    """One over the number of points (m,) in the cell of each, so that what was scanned twice as densely weighs the same."""
    cell = np.floor((points - points.min(axis=0)) / cell_mm).astype(np.int64)
    across = cell.max(axis=0) + 1
    _, number, count = np.unique((cell[:, 0] * across[1] + cell[:, 1]) * across[2] + cell[:, 2], return_inverse=True, return_counts=True)
    return np.asarray(1.0 / count[number.ravel()])


def _fit(problem: FitProblem, start: RigidMotion, gross_mm: float | None, farthest_mm: float) -> SurfaceRegistration:
    """The pose of least squares from a start; what lies too far off is left out until that stays the same."""
    outlier = np.zeros(len(problem.points), dtype=bool)
    found = _settle_many(problem, start, outlier)
    for _ in range(_ROUNDS):
        off = found.state.off_mm
        now = np.abs(off) > farthest_mm  # never where there is no deviation
        if gross_mm is not None:
            inside = ~np.isnan(off)
            away = np.abs(off - _median(off[inside], problem.weights[inside]))
            now |= away > max(gross_mm, _MADS * _median(away[inside], problem.weights[inside]))
        if np.array_equal(now, outlier):
            break
        outlier = now
        found = _settle_many(problem, found.motion, outlier, found.bend)
    return _registration(problem, found, outlier)


def _median(values: Array, weights: Array) -> float:
    """The value with half the weight on either side."""
    order = np.argsort(values, kind="stable")
    sums = np.cumsum(weights[order])
    return float(values[order][np.searchsorted(sums, sums[-1] / 2)])


def _settle_many(problem: FitProblem, start: RigidMotion, left_out: Truth, bend: Array | None = None) -> SettledPose:
    """The same of any number of points: from many a choice goes ahead, so that all of them are looked at a few times only."""
    m, steps = len(problem.points), 0
    if m > _MANY and bend is None:
        some = np.unique(np.linspace(0, m - 1, _AHEAD).astype(np.int64))
        ahead = settle_pose(problem.some(some), start, left_out[some])
        start, bend, steps = ahead.motion, ahead.bend, ahead.steps
    found = settle_pose(problem, start, left_out, bend)
    return replace(found, steps=steps + found.steps)


def _registration(problem: FitProblem, found: SettledPose, outlier: Truth) -> SurfaceRegistration:
    """The record of a pose."""
    state, rms = found.state, float(np.sqrt(found.state.mean_square))
    places, normals = problem.nominal.sample(_PLACES)
    whole = np.column_stack([normals, np.cross(places - state.centre, normals)])
    weakest = weakness_of(state.rows, state.weights, state.arms, problem.free, rms, whole)
    return SurfaceRegistration(found.motion, rms, found.steps, found.converged, state.used, outlier, weakest, state.centre)


def _seek(points: Array, weights: Array, nominal: NominalSurface, target_mm: float) -> tuple[RigidMotion, list[RigidMotion]]:
    """The start for a scan of the whole part, and others that fit as well.

    Principal axes are laid on principal axes in all ways, each is refined, the least rms wins.
    """
    places, _ = nominal.sample(_PLACES)
    to_middle, to_axes = _axes(places, np.ones(len(places)))
    from_middle, from_axes = _axes(points, weights)
    few = points[np.unique(np.linspace(0, len(points) - 1, _FEW).astype(np.int64))]
    tried = []
    for turn in _proper_turns():
        rotation = to_axes @ turn @ from_axes.T
        motion = RigidMotion(rotation, to_middle - rotation @ from_middle)
        tried.append(_trimmed(few, nominal, motion, target_mm))
    tried.sort(key=lambda each: each[0])
    least, best = tried[0]
    if not least <= _FITS * nominal.size_mm:
        raise RegistrationError(
            f"the pose was not found: at best the points lie {least:.3g} mm (rms) off the surface. Is the whole part scanned, is it the "
            "right one and the right unit? Else give a start"
        )
    spread = np.sqrt(((few - few.mean(axis=0)) ** 2).sum(axis=1).max())
    corners = few.mean(axis=0) + spread * np.concatenate([np.eye(3), -np.eye(3)])
    others: list[RigidMotion] = []
    for rms, motion in tried[1:]:
        far = all(np.abs(motion.apply(corners) - known.apply(corners)).max() > _OTHER_POSE * nominal.size_mm for known in [best, *others])
        if rms <= _RIVAL * least + 1e-9 * nominal.size_mm and far:
            others.append(motion)
    return best, others


def _axes(points: Array, weights: Array) -> tuple[Array, Array]:
    """The middle (3,) of points and their principal axes, as the columns of a rotation."""
    middle = (points * weights[:, None]).sum(axis=0) / weights.sum()
    off = points - middle
    _, axes = np.linalg.eigh(np.einsum("mi,mj,m->ij", off, off, weights))
    if np.linalg.det(axes) < 0:
        axes[:, 0] *= -1
    return middle, axes


def _proper_turns() -> list[Array]:
    """The 24 rotations that bring axes onto axes, those that keep every axis in its line first."""
    turns = []
    for order, signs in product(permutations(range(3)), product((1.0, -1.0), repeat=3)):
        turn = np.zeros((3, 3))
        turn[range(3), order] = signs
        if np.linalg.det(turn) > 0:
            turns.append(turn)
    return turns


def _trimmed(few: Array, nominal: NominalSurface, motion: RigidMotion, target_mm: float) -> tuple[float, RigidMotion]:
    """A pose refined with few points, the worst tenth of them left out in each step: its rms, infinite where it leaves the surface."""
    problem = FitProblem(few, np.ones(len(few)), nominal, np.ones(6, dtype=bool), target_mm)
    rms, kept = np.inf, len(few) - int(_WORST * len(few))
    for _ in range(_TRIES):
        feet = nominal.project(motion.apply(few))
        off = np.abs(feet.distance_mm - target_mm)  # from borders as well, or a pose with all points beyond one would fit
        worst = np.argsort(off, kind="stable")[kept:]
        now = float(np.sqrt((np.sort(off)[:kept] ** 2).mean()))
        if not now < rms * (1 - 1e-3):
            return min(rms, now), motion
        rms = now
        outlier = np.zeros(len(few), dtype=bool)
        outlier[worst] = True
        try:
            state = linearise(problem, motion, outlier)
        except RegistrationError:
            return np.inf, motion
        change = step_of(state, problem.free, 1e-6)
        motion = RigidMotion.about(state.centre, change[3:], change[:3]).after(motion)
    return rms, motion
