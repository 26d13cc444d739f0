"""Algorithm 4: the pose that minimises the mean square deviation.

`gauss-newton` solves for the three unknowns at once from distances to the tangents, with the curvature of the profile in the
second derivative (METHOD: tangent distance plus curvature; Pottmann et al. 2006), so that it converges quadratically.
`icp` is the published scheme: feet by the method of choice, best motion onto the feet, until the mean square settles.
"""

import math
from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inspection.coarse import coarse_poses, registrable, trimmed_mean_square
from inspection.deviations import Method
from inspection.kernels import NormalEquations, normal_equations
from inspection.nominal import NominalProfile
from inspection.profile_error import feet_on
from inspection.projection import OPEN_END
from inspection.registration import Registration
from inspection.rigid import RigidTransform, about, best_motion

Array = NDArray[np.float64]
Scheme = Literal["gauss-newton", "icp"]

STANDSTILL_MM = 1e-9  # Gauss-Newton ends when no point moves further
_MOST_STEPS = 60
_ICP_MOST_STEPS = 2000
_ICP_TOLERANCE = 1e-6  # relative change of the mean square; the paper states none
_HALVINGS = 12
_HOVERING_STEPS = 3  # after them points that come and go at an open end in small steps are left out: no pose suits both
_HOVERING_MM = 0.01
_FREE = 1e-9  # a motion whose eigenvalue is below this share of the largest changes no deviation: it is undetermined
_OUTLIER_MADS = 6.0  # median absolute deviations beyond which Tukey's weight is zero and a point an outlier
_ROBUST_STEPS = 40
_SETTLED_WEIGHTS_MM = 1e-6
_TRUSTED = 1e-6  # least eigenvalue of the full second derivative, as a share of the largest, for it to be used
_LEAST_REACH_MM = 1e-9
_NO_WEIGHTS = np.empty(0)
_SCOUTS = 400  # points that rank coarse poses
_CLOSE_RMS = 3.0  # poses whose rms is within this factor are told apart by all points only: few points and 80 % of them miss an edge
_SCOUT_STEPS = 12  # a pose from which more are needed is not the one sought
_EQUAL_RMS = 1.1  # rivals whose rms is within this factor of the best fit as well
_SAME_POSE = 0.01  # of the part's size: poses closer than this are one


def register(
    points_mm: ArrayLike,
    nominal: NominalProfile,
    method: Method = "exact",
    scheme: Scheme = "gauss-newton",
    tip_radius_mm: float = 0.0,
    robust: bool = False,
) -> Registration:
    """Coarse then fine registration of section points (m, 2): every coarse pose is refined on a few points, those near the best on all.

    Poses of symmetric parts that fit equally well are reported as `rivals`. `robust` finds gross outliers first and leaves
    them out, see register_fine. Raises RegistrationError for too few points.
    """
    points = registrable(points_mm)
    ranked = ranked_poses(points, nominal, tip_radius_mm)
    close = [pose for rms, pose in ranked if rms <= _CLOSE_RMS * ranked[0][0]]
    refined = [register_fine(points, nominal, pose, method, scheme, tip_radius_mm, robust) for pose in close]
    best = min(refined, key=lambda fit: fit.rms_mm)
    others = _distinct([(fit.rms_mm, fit.nominal_from_section) for fit in refined], points)[1:]
    return replace(best, rivals=tuple(pose for rms, pose in others if rms <= _EQUAL_RMS * best.rms_mm))


def ranked_poses(points_mm: ArrayLike, nominal: NominalProfile, tip_radius_mm: float = 0.0) -> list[tuple[float, RigidTransform]]:
    """Distinct poses refined on a few of the points, best first, each with the rms of its nearer 80 %.

    The ratio of the first two says how far the points determine the pose.
    """
    points = registrable(points_mm)
    few = points[:: max(1, len(points) // _SCOUTS)]
    return _distinct([_scout(few, nominal, pose, tip_radius_mm) for pose in _promising(few, points, nominal)], points)


def _distinct(scored: list[tuple[float, RigidTransform]], points: Array) -> list[tuple[float, RigidTransform]]:
    """Poses best first, without those that bring the points to the same place as a better one."""
    corners = np.array([points.min(axis=0), points.max(axis=0)])
    apart = _SAME_POSE * np.hypot(*np.ptp(points, axis=0))
    distinct: list[tuple[float, RigidTransform]] = []
    for rms, pose in sorted(scored, key=lambda one: one[0]):
        if all(np.abs(pose.apply(corners) - other.apply(corners)).max() > apart for _, other in distinct):
            distinct.append((rms, pose))
    return distinct


def _promising(few: Array, points: Array, nominal: NominalProfile) -> list[RigidTransform]:
    """Coarse poses worth refining: those near the best of them, at most six."""
    poses = coarse_poses(points, nominal)
    scores = np.array([trimmed_mean_square(few, pose, nominal) for pose in poses])
    order = np.argsort(scores, kind="stable")[:6]
    return [poses[i] for i in order]


def _scout(few: Array, nominal: NominalProfile, pose: RigidTransform, tip_radius_mm: float) -> tuple[float, RigidTransform]:
    refined = _gauss_newton(few, nominal, pose, "exact", tip_radius_mm, _SCOUT_STEPS).nominal_from_section
    off = np.sort(np.abs(_Placed(few, refined, nominal, "exact", tip_radius_mm).deviation_mm))
    return float(np.sqrt((off[: max(1, int(0.8 * len(off)))] ** 2).mean())), refined


def register_fine(
    points_mm: ArrayLike,
    nominal: NominalProfile,
    start: Registration | RigidTransform,
    method: Method = "exact",
    scheme: Scheme = "gauss-newton",
    tip_radius_mm: float = 0.0,
    robust: bool = False,
) -> Registration:
    """Fine registration of section points (m, 2) from a coarse pose. Points beyond open ends take no part.

    method : how deviations are found; with "pcp" or "veaw" Gauss-Newton may not settle (`converged` says so), "icp" is theirs
    robust : detect points farther than 6 median absolute deviations by Tukey weights, then fit the others by least squares
             (weights alone would bias the pose where form error is systematic); `outliers` of the result says which
    """
    points = registrable(points_mm)
    pose = start.nominal_from_section if isinstance(start, Registration) else start
    if scheme == "icp":
        return _icp(points, nominal, pose, method, tip_radius_mm)
    if scheme != "gauss-newton":
        raise ValueError(f"scheme must be gauss-newton or icp, not {scheme!r}")
    if not robust:
        return _gauss_newton(points, nominal, pose, method, tip_radius_mm)
    outliers = _outliers(points, nominal, pose, method, tip_radius_mm)
    inliers = _gauss_newton(points[~outliers], nominal, pose, method, tip_radius_mm)
    return replace(inliers, outliers=outliers)


def _outliers(points: Array, nominal: NominalProfile, pose: RigidTransform, method: Method, tip_radius_mm: float) -> NDArray[np.bool_]:
    """Points (m,) whose Tukey weight is zero once the weighted fit has settled."""
    for _ in range(_ROBUST_STEPS):
        here = _Placed(points, pose, nominal, method, tip_radius_mm)
        off, used = np.abs(here.deviation_mm), here.feet.vertex != OPEN_END
        limit = _OUTLIER_MADS * float(np.median(off[used])) if used.any() else np.inf
        weights = np.where(off < limit, (1 - (off / max(limit, STANDSTILL_MM)) ** 2) ** 2, 0.0)
        centre, step, moves_mm = here.newton_step(weights)
        pose = about(centre, step[2], step[:2]).after(pose)
        if moves_mm <= _SETTLED_WEIGHTS_MM:
            break
    return np.asarray((off >= limit) & used)


class _Placed:
    """Points at a trial pose: their feet, and the normal equations there."""

    def __init__(self, points: Array, pose: RigidTransform, nominal: NominalProfile, method: Method, tip_radius_mm: float) -> None:
        self.moved = pose.apply(points)
        self.feet = feet_on(self.moved, nominal, method)
        self._outward, self._tip = nominal.outward, tip_radius_mm
        self._centre = np.array([self.moved[:, 0].mean(), self.moved[:, 1].mean()])  # by column: four times faster than along an axis
        self.sums = self._summed(_NO_WEIGHTS)

    @property
    def deviation_mm(self) -> Array:
        return self._outward * self.feet.distance_mm - self._tip

    @property
    def mean_square(self) -> float:
        return self.sums.sum_square / self.sums.count if self.sums.count else np.inf

    @property
    def takes_part(self) -> NDArray[np.bool_]:
        return np.asarray(self.feet.vertex != OPEN_END)

    def mean_square_of(self, other: "_Placed") -> float:
        """Mean square, here, of the points that take part there: comparable though some have passed an open end."""
        if self.sums.count == other.sums.count:
            return self.mean_square
        return float(np.square(self.deviation_mm[other.takes_part]).mean())

    def _summed(self, weights: Array) -> NormalEquations:
        return normal_equations(self.moved, self.feet, self._outward, self._tip, self._centre, weights)

    def newton_step(self, weights: Array | None = None) -> tuple[Array, Array, float]:
        """Centre (2,), step (3,) (shift in mm, rotation in rad about it), and how far that moves the farthest point.

        The step leads to the least (weighted) mean square of the second-order model.
        Full second derivative where it is positive definite, its Gauss-Newton part otherwise; motions that the points do not
        determine (a circle's rotation) are left alone.
        """
        sums = self.sums if weights is None else self._summed(weights)
        reach = max(sums.reach_mm, _LEAST_REACH_MM)
        scale = np.array([1.0, 1.0, reach])
        values, vectors = _motions(sums.tangential + sums.bending, scale)
        if values[0] <= _TRUSTED * values[-1]:
            values, vectors = _motions(sums.tangential, scale)
        known = values > _FREE * values[-1]
        share = np.where(known, vectors.T @ (sums.slope / scale) / np.where(known, values, 1.0), 0.0)
        step = -(vectors @ share) / scale
        return self._centre, step, math.hypot(step[0], step[1]) + abs(step[2]) * reach

    def registration(self, pose: RigidTransform, iterations: int, converged: bool, points: int) -> Registration:
        sums = self.sums
        scale = np.array([1.0, 1.0, max(sums.reach_mm, _LEAST_REACH_MM)])
        values, vectors = _motions(sums.tangential, scale)
        known = values > _FREE * values[-1]
        scatter = sums.sum_square / max(sums.count - 3, 1)
        variances = np.where(known, scatter / np.where(known, values, 1.0), scale[2] ** 2)
        spread = vectors / scale[:, None]
        nothing = np.zeros(points, dtype=bool)
        covariance = (spread * variances) @ spread.T
        return Registration(pose, math.sqrt(self.mean_square), iterations, converged, covariance, self._centre, (), nothing)


def _gauss_newton(
    points: Array, nominal: NominalProfile, pose: RigidTransform, method: Method, tip_radius_mm: float, most_steps: int = _MOST_STEPS
) -> Registration:
    fitted = points
    here = _Placed(fitted, pose, nominal, method, tip_radius_mm)
    for iteration in range(1, most_steps + 1):
        centre, step, moves_mm = here.newton_step()
        for _ in range(_HALVINGS):
            trial_pose = about(centre, step[2], step[:2]).after(pose)
            if moves_mm <= STANDSTILL_MM:  # it changes no deviation by more: nothing to project again
                return here.registration(trial_pose, iteration, True, len(points))
            trial = _Placed(fitted, trial_pose, nominal, method, tip_radius_mm)
            if trial.mean_square_of(here) <= here.mean_square * (1 + 1e-12):
                break
            step, moves_mm = step / 2, moves_mm / 2
        else:
            break  # no step this way lowers the mean square
        if iteration >= _HOVERING_STEPS and moves_mm < _HOVERING_MM and trial.sums.count != here.sums.count:
            fitted = fitted[trial.takes_part & here.takes_part]
            trial = _Placed(fitted, trial_pose, nominal, method, tip_radius_mm)
        pose, here = trial_pose, trial
    return here.registration(pose, iteration, False, len(points))


def _icp(points: Array, nominal: NominalProfile, pose: RigidTransform, method: Method, tip_radius_mm: float) -> Registration:
    previous, converged = np.inf, False
    for iteration in range(1, _ICP_MOST_STEPS + 1):  # noqa: B007 - the count is part of the result
        here = _Placed(points, pose, nominal, method, tip_radius_mm)
        now = here.mean_square
        if abs(previous - now) <= _ICP_TOLERANCE * now:
            converged = True
            break
        previous = now
        used = here.feet.vertex != OPEN_END
        feet = here.moved - (nominal.outward * here.deviation_mm)[:, None] * here.feet.gradient
        pose = best_motion(here.moved[used], feet[used]).after(pose)
    return here.registration(pose, iteration, converged, len(points))


def _motions(matrix: Array, scale: Array) -> tuple[Array, Array]:
    """Rising eigenvalues and eigenvectors of a normal matrix, its rotation counted in mm at the farthest point."""
    values, vectors = np.linalg.eigh(matrix / (scale[:, None] * scale))
    return values, vectors
