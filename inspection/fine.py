"""Algorithm 4: the pose that minimises the mean square deviation.

`gauss-newton` solves for the three unknowns at once from distances to the tangents, with the curvature of the profile in the
second derivative (METHOD: tangent distance plus curvature; Pottmann et al. 2006), so that it converges quadratically.
`icp` is the published scheme: feet by the method of choice, best motion onto the feet, until the mean square settles.
"""

from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inspection.coarse import coarse_poses, registrable, trimmed_mean_square
from inspection.deviations import Deviations, Method
from inspection.nominal import NominalProfile
from inspection.profile_error import deviations
from inspection.registration import Registration
from inspection.rigid import RigidTransform, about, best_motion

Array = NDArray[np.float64]
Scheme = Literal["gauss-newton", "icp"]

STANDSTILL_MM = 1e-9  # Gauss-Newton ends when no point moves further
_MOST_STEPS = 60
_ICP_MOST_STEPS = 2000
_ICP_TOLERANCE = 1e-6  # relative change of the mean square; the paper states none
_HALVINGS = 12
_FREE = 1e-9  # a motion whose eigenvalue is below this share of the largest changes no deviation: it is undetermined
_OUTLIER_MADS = 6.0  # median absolute deviations beyond which Tukey's weight is zero and a point an outlier
_ROBUST_STEPS = 40
_SETTLED_WEIGHTS_MM = 1e-6
_SCOUTS = 400  # points that rank coarse poses
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
    """Coarse then fine registration of section points (m, 2): every coarse pose is refined on a few points, the best on all.

    Poses of symmetric parts that fit equally well are reported as `rivals`. `robust` finds gross outliers first and leaves
    them out, see register_fine. Raises RegistrationError for too few points.
    """
    points = registrable(points_mm)
    ranked = ranked_poses(points, nominal, tip_radius_mm)
    result = register_fine(points, nominal, ranked[0][1], method, scheme, tip_radius_mm, robust)
    return replace(result, rivals=tuple(pose for rms, pose in ranked[1:] if rms <= _EQUAL_RMS * ranked[0][0]))


def ranked_poses(points_mm: ArrayLike, nominal: NominalProfile, tip_radius_mm: float = 0.0) -> list[tuple[float, RigidTransform]]:
    """Distinct poses refined on a few of the points, best first, each with the rms of its nearer 80 %.

    The ratio of the first two says how far the points determine the pose.
    """
    points = registrable(points_mm)
    few = points[:: max(1, len(points) // _SCOUTS)]
    scouts = sorted((_scout(few, nominal, pose, tip_radius_mm) for pose in _promising(few, points, nominal)), key=lambda scout: scout[0])
    corners = np.array([points.min(axis=0), points.max(axis=0)])
    apart = _SAME_POSE * np.hypot(*np.ptp(points, axis=0))
    distinct: list[tuple[float, RigidTransform]] = []
    for rms, pose in scouts:
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
    refined = register_fine(few, nominal, pose, tip_radius_mm=tip_radius_mm).nominal_from_section
    d = deviations(refined.apply(few), nominal, tip_radius_mm=tip_radius_mm)
    off = np.sort(np.abs(d.deviation_mm))
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
        moved = pose.apply(points)
        d = deviations(moved, nominal, method, tip_radius_mm)
        off = np.abs(d.deviation_mm)
        limit = _OUTLIER_MADS * float(np.median(off[~d.beyond_end])) if not d.beyond_end.all() else np.inf
        weights = np.where(off < limit, (1 - (off / max(limit, STANDSTILL_MM)) ** 2) ** 2, 0.0)
        centre, step = newton_step(moved, d, nominal, tip_radius_mm, weights)
        pose = about(centre, step[2], step[:2]).after(pose)
        if np.hypot(step[0], step[1]) + abs(step[2]) * _reach(moved - centre) <= _SETTLED_WEIGHTS_MM:
            break
    return (off >= limit) & ~d.beyond_end


def _gauss_newton(points: Array, nominal: NominalProfile, pose: RigidTransform, method: Method, tip_radius_mm: float) -> Registration:
    moved = pose.apply(points)
    d = deviations(moved, nominal, method, tip_radius_mm)
    converged = False
    for iteration in range(1, _MOST_STEPS + 1):  # noqa: B007 - the count is part of the result
        centre, step = newton_step(moved, d, nominal, tip_radius_mm)
        reach = _reach(moved - centre)
        best = _mean_square(d)
        for _ in range(_HALVINGS):
            motion = about(centre, step[2], step[:2])
            trial = motion.after(pose)
            trial_moved = trial.apply(points)
            trial_d = deviations(trial_moved, nominal, method, tip_radius_mm)
            if _mean_square(trial_d) <= best * (1 + 1e-12):
                break
            step = step / 2
        pose, moved, d = trial, trial_moved, trial_d
        if np.hypot(step[0], step[1]) + abs(step[2]) * reach <= STANDSTILL_MM:
            converged = True
            break
    return _registration(pose, moved, d, iteration, converged)


def newton_step(
    points: Array, d: Deviations, nominal: NominalProfile, tip_radius_mm: float, weights: Array | None = None
) -> tuple[Array, Array]:
    """Centre (2,) and step (3,) (shift in mm, rotation in rad about the centre) towards the least (weighted) mean square.

    Full second derivative where it is positive definite, its Gauss-Newton part otherwise; motions that the points do not
    determine (a circle's rotation) are left alone.
    """
    used = ~d.beyond_end
    x, e, g = points[used], d.deviation_mm[used], d.normal[used]
    centre = x.mean(axis=0) if len(x) else np.zeros(2)
    arm = x - centre
    rows = np.column_stack([g, arm[:, 0] * g[:, 1] - arm[:, 1] * g[:, 0]])  # (m, 3) gradient of each deviation
    w = np.ones(len(e)) if weights is None else weights[used]
    weighted = rows * w[:, None]
    slope = weighted.T @ e
    tangential = weighted.T @ rows
    full = tangential + _second_derivative(arm, w * e, g, _level_curvature(d, nominal, tip_radius_mm)[used])
    positive = np.linalg.eigvalsh(full)[0] > 0.1 * np.linalg.eigvalsh(tangential)[0]
    reach = _reach(arm)
    values, vectors = _motions(full if positive else tangential, reach)
    known = values > _FREE * values[-1]
    share = np.where(known, vectors.T @ (slope / [1, 1, reach]) / np.where(known, values, 1.0), 0.0)
    return centre, -(vectors @ share) / [1, 1, reach]


def _second_derivative(arm: Array, e: Array, g: Array, bend: Array) -> Array:
    """Sum of e times the second derivative of e by the pose: curvature of the distance field, and of the rotation."""
    t = np.column_stack([-g[:, 1], g[:, 0]])
    along = np.column_stack([t, arm[:, 0] * t[:, 1] - arm[:, 1] * t[:, 0]])
    result = (along * (e * bend)[:, None]).T @ along
    result[2, 2] -= (e * (arm * g).sum(axis=1)).sum()
    return np.asarray(result)


def _level_curvature(d: Deviations, nominal: NominalProfile, tip_radius_mm: float) -> Array:
    """Second derivative of the deviation across its gradient (m,): that of the distance field, 1 / distance at a vertex."""
    distance = d.deviation_mm + tip_radius_mm  # signed, outward
    outward = nominal.outward
    across = -outward * d.curvature / np.maximum(1 - outward * d.curvature * distance, 1e-3)
    return np.where(d.at_vertex, 1.0 / np.where(np.abs(distance) > 1e-9, distance, np.inf), across)


def _motions(matrix: Array, reach: float) -> tuple[Array, Array]:
    """Rising eigenvalues and eigenvectors of a normal matrix, its rotation counted in mm at the farthest point."""
    scale = np.array([1.0, 1.0, reach])
    values, vectors = np.linalg.eigh(matrix / np.outer(scale, scale))
    return values, vectors


def _reach(arm: Array) -> float:
    return max(float(np.hypot(arm[:, 0], arm[:, 1]).max(initial=0.0)), 1e-9)


def _icp(points: Array, nominal: NominalProfile, pose: RigidTransform, method: Method, tip_radius_mm: float) -> Registration:
    previous, converged = np.inf, False
    for iteration in range(1, _ICP_MOST_STEPS + 1):  # noqa: B007 - the count is part of the result
        moved = pose.apply(points)
        d = deviations(moved, nominal, method, tip_radius_mm)
        now = _mean_square(d)
        if abs(previous - now) <= _ICP_TOLERANCE * now:
            converged = True
            break
        previous = now
        used = ~d.beyond_end
        feet = moved[used] - (d.deviation_mm[:, None] * d.normal)[used]
        pose = best_motion(moved[used], feet).after(pose)
    return _registration(pose, moved, d, iteration, converged)


def _mean_square(d: Deviations) -> float:
    used = d.deviation_mm[~d.beyond_end]
    return float((used**2).mean()) if used.size else np.inf


def _registration(pose: RigidTransform, moved: Array, d: Deviations, iterations: int, converged: bool) -> Registration:
    used = ~d.beyond_end
    mean_square = _mean_square(d)
    x, g = moved[used], d.normal[used]
    centre = x.mean(axis=0) if len(x) else np.zeros(2)
    arm = x - centre
    rows = np.column_stack([g, arm[:, 0] * g[:, 1] - arm[:, 1] * g[:, 0]])
    reach = _reach(arm)
    values, vectors = _motions(rows.T @ rows, reach)
    known = values > _FREE * values[-1]
    scatter = mean_square * len(x) / max(len(x) - 3, 1)
    variances = np.where(known, scatter / np.where(known, values, 1.0), reach**2)
    spread = vectors / np.array([1, 1, reach])[:, None]
    covariance = (spread * variances) @ spread.T
    return Registration(pose, float(np.sqrt(mean_square)), iterations, converged, covariance, centre, (), np.zeros(len(moved), dtype=bool))
