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

from inspection.cloud import MANY, Cloud
from inspection.coarse import check_cloud, contour_of, poses_of_contour, trimmed_mean_square
from inspection.contour_order import Contour
from inspection.gaps import weigh_by_station
from inspection.kernels import AT_ONCE, OutlierFit, OutlierLimit, PoseEstimate, PoseFit, project
from inspection.kernels.layout import OPEN_END
from inspection.methods import Method, WeightName
from inspection.nominal import NominalProfile
from inspection.registration import Registration, no_outliers
from inspection.rigid import RigidTransform, best_motion
from inspection.signed_deviations import feet_on

Array = NDArray[np.float64]
Scheme = Literal["gauss-newton", "icp"]

MISFIT = 0.02  # rms above this share of the nominal's size is no registration of the same part
_MOST_STEPS = 60
_ICP_MOST_STEPS = 2000
_ICP_TOLERANCE = 1e-6  # relative change of the mean square; the paper states none
_OUTLIER_MADS = 6.0  # median absolute deviations beyond which Tukey's weight is zero and a point an outlier
_ROBUST_STEPS = 40
_SETTLED_WEIGHTS_MM = 1e-6
_FEWEST, _THINNED = 400, 25  # a pose is settled first on so many points, or on one in so many
_WORTH_THINNING = 20  # where there are so many times as many
_HELD = 1 << 20  # points for whose deviations there is memory
_STEPS_OF_FEW = 6  # they settle quadratically, or not where all points would
_DETERMINED = 0.25  # variance of where the few put any point, as a share of that of their deviations
_WEIGHINGS = 2  # the weights follow from the pose, and the pose from them: after the second time they stay within rounding
_SCOUTS = 400  # points of the walk along the contour that rank coarse poses
_CLOSE_RMS = 3.0  # poses within this factor of the best rms are compared on all points: the trimmed score of 400 points can miss an edge
_SCOUT_STEPS = 12  # a pose from which more are needed is not the one sought
_EQUAL_RMS = 1.1  # other poses within this factor of the best rms are rivals
_SYMMETRIC = 1.001  # times the least rms: only symmetry makes fits to all points so much alike
_ROUNDING = 1e-9  # of the length: more than the rms of points without any deviation
_SAME_POSE = 0.01  # of the size of the part; two poses that are closer than this are one


def register(
    points_mm: ArrayLike | Cloud,
    nominal: NominalProfile,
    method: Method = "exact",
    scheme: Scheme = "gauss-newton",
    tip_radius_mm: float = 0.0,
    robust: bool = False,
    gross_mm: float = 0.0,
    target_mm: float = 0.0,
    weights: WeightName = "points",
) -> Registration:
    """Coarse then fine registration of section points (m, 2).

    Every coarse pose is refined on a few points; those near the best of them are refined on all points. Poses of symmetric parts
    that fit equally well are reported as `rivals`; of poses that differ by a symmetry that one is taken which turns the scan least, as
    the part lies in its own coordinates. `robust` finds gross outliers first and leaves them out; `target_mm` and `weights` say what
    the fit aims at and how points count in it: see register_fine. Raises RegistrationError for too few points.
    """
    points = check_cloud(points_mm)
    ranked = ranked_poses(points, nominal, tip_radius_mm + target_mm)
    close = [pose for rms, pose in ranked if rms <= _CLOSE_RMS * ranked[0][0]]
    settings = (method, scheme, tip_radius_mm, robust, gross_mm, target_mm, weights)
    refined = [register_fine(points, nominal, pose, *settings) for pose in close]
    fit_at = {fit.nominal_from_section: fit for fit in refined}
    distinct = _drop_equal_poses([(fit.rms_mm, pose) for pose, fit in fit_at.items()], points)
    least_mm = distinct[0][0]
    rounding_mm = _ROUNDING * nominal.length_mm
    best = max((pose for rms, pose in distinct if rms <= _SYMMETRIC * least_mm + rounding_mm), key=lambda pose: math.cos(pose.rotation_rad))
    rivals = tuple(pose for rms, pose in distinct if pose is not best and rms <= _EQUAL_RMS * least_mm + rounding_mm)
    return replace(fit_at[best], rivals=rivals)


def ranked_poses(points_mm: ArrayLike | Cloud, nominal: NominalProfile, tip_radius_mm: float = 0.0) -> list[tuple[float, RigidTransform]]:
    """Distinct poses refined on a few of the points, best first, each with the rms of the nearer 80 % of them.

    The ratio of the first two says how clearly the points determine the pose.
    """
    points = check_cloud(points_mm)
    contour = contour_of(points, nominal)
    few = contour.points_mm[:: max(1, len(contour.points_mm) // _SCOUTS)]
    poses = _promising_poses(few, contour, nominal)
    return _drop_equal_poses([_scout_pose(few, nominal, pose, tip_radius_mm) for pose in poses], points)


def _drop_equal_poses(scored: list[tuple[float, RigidTransform]], points: Cloud) -> list[tuple[float, RigidTransform]]:
    """The poses, best first, without those that bring the points to the same place as a better one."""
    corners = points.corners()
    apart = _SAME_POSE * np.hypot(*(corners[1] - corners[0]))
    distinct: list[tuple[float, RigidTransform]] = []
    for rms, pose in sorted(scored, key=lambda one: one[0]):
        if all(np.abs(pose.apply(corners) - other.apply(corners)).max() > apart for _, other in distinct):
            distinct.append((rms, pose))
    return distinct


def _promising_poses(few: Array, contour: Contour, nominal: NominalProfile) -> list[RigidTransform]:
    """The six best coarse poses."""
    poses = poses_of_contour(contour, nominal)
    scores = np.array([trimmed_mean_square(few, pose, nominal) for pose in poses])
    order = np.argsort(scores, kind="stable")[:6]
    return [poses[i] for i in order]


def _scout_pose(few: Array, nominal: NominalProfile, pose: RigidTransform, tip_radius_mm: float) -> tuple[float, RigidTransform]:
    """A pose refined on few points (m, 2), and the rms of the nearer 80 % of them."""
    refined = _pose_of(
        _pose_fit(Cloud(np.ascontiguousarray(few)), nominal, "exact", tip_radius_mm).settle(_pose_numbers(pose), _SCOUT_STEPS)
    )
    off = np.sort(np.abs(nominal.outward * project(refined.apply(few), nominal.grid).distance_mm - tip_radius_mm))
    return float(np.sqrt((off[: max(1, int(0.8 * len(off)))] ** 2).mean())), refined


def register_fine(
    points_mm: ArrayLike | Cloud,
    nominal: NominalProfile,
    start: Registration | RigidTransform,
    method: Method = "exact",
    scheme: Scheme = "gauss-newton",
    tip_radius_mm: float = 0.0,
    robust: bool = False,
    gross_mm: float = 0.0,
    target_mm: float = 0.0,
    weights: WeightName = "points",
) -> Registration:
    """Fine registration of section points (m, 2) from a coarse pose. Points beyond open ends take no part.

    method : how deviations are found; with "pcp" or "veaw" Gauss-Newton may not settle (`converged` says so), "icp" is theirs;
             Gauss-Newton takes "inversion" for "exact"
    robust : find points farther than 6 median absolute deviations by Tukey weights, then fit the others by least squares, because
             weights alone would bias the pose where form error is systematic; `outliers` of the result says which were found
    gross_mm : points nearer than this are no outliers, however small the deviations of the others are
    target_mm : the deviation that the fit aims at: the middle of a tolerance zone that is not equally disposed
    weights : "points" counts every point alike; "arc-length" counts it by how much of the profile it stands for, so that neither
              dwelling nor a dense side moves the pose (Gauss-Newton only)
    """
    points = check_cloud(points_mm)
    pose = start.nominal_from_section if isinstance(start, Registration) else start
    if scheme == "icp":
        return _icp(points.few(len(points)), nominal, pose, method, tip_radius_mm + target_mm)
    if scheme != "gauss-newton":
        raise ValueError(f"scheme must be gauss-newton or icp, not {scheme!r}")
    aimed_mm, outliers, near = tip_radius_mm + target_mm, no_outliers(len(points)), _pose_numbers(pose)
    if robust:
        search = _find_outliers(points, nominal, method, aimed_mm, near, gross_mm)
        points, outliers = points.without(search.found), search.found
        # It is closer to the least mean square of the others, and ends at the same one where that does not depend on the way there: which
        # points lie beyond an open end does, and so does where a fit to the samples settles.
        near = search.pose if search.settled and nominal.curve.closed and method == "exact" else near
    fit = _pose_fit(points, nominal, method, aimed_mm)
    found = _settle(points, fit, _fit_to_few(points, nominal, method, aimed_mm), near)
    if weights == "arc-length":
        for _ in range(_WEIGHINGS):
            _weigh_by_arc_length(fit, points, found, nominal)
            again = fit.settle_nearby(found.pose) or fit.settle(found.pose, _MOST_STEPS)
            found = again._replace(steps=found.steps + again.steps)
    return _registration(found, found.steps, found.settled, outliers)


def _settle(points: Cloud, fit: PoseFit, few: PoseFit | None, pose: tuple[float, float, float]) -> PoseEstimate:
    """The least mean square of all points: first of a few, then by passes over all from there.

    Where the few do not settle at once, or do not say where they belong, every step is made over all points from the start.
    """
    near = few.settle(pose, _STEPS_OF_FEW) if few else None
    if near and near.settled and _is_determined(near, fit):
        found = fit.settle_nearby(near.pose)
        if found:
            return found._replace(steps=near.steps + found.steps)
    return fit.settle(pose, _MOST_STEPS)


def _is_determined(near: PoseEstimate, fit: PoseFit) -> bool:
    """Whether the pose that points were fitted to is known better than each of their deviations: that of a circle is not."""
    x, y, turn = np.diag(near.covariance).tolist()
    return bool(x + y + turn * fit.reach_mm**2 <= _DETERMINED * near.mean_square)


def _find_outliers(
    points: Cloud, nominal: NominalProfile, method: Method, aimed_mm: float, pose: tuple[float, float, float], gross_mm: float
) -> OutlierFit:
    """Which of the points (m,) are gross outliers, and the pose at which they were found."""
    limit = OutlierLimit(_OUTLIER_MADS, float(gross_mm), _SETTLED_WEIGHTS_MM)
    few, fit = _fit_to_few(points, nominal, method, aimed_mm), _pose_fit(points, nominal, method, aimed_mm, MANY)
    near = few.find_outliers(pose, limit, _ROBUST_STEPS) if few and len(points) <= _HELD else None
    found = fit.find_outliers_nearby(near, limit) if near and near.settled else None
    return found or fit.find_outliers(pose, limit, _ROBUST_STEPS)


def _fit_to_few(points: Cloud, nominal: NominalProfile, method: Method, aimed_mm: float) -> PoseFit | None:
    """A fit to a sample of the points, None where there are too few points for that to be quicker."""
    few = max(_FEWEST, len(points) // _THINNED)
    return _pose_fit(Cloud(points.few(few)), nominal, method, aimed_mm) if len(points) >= _WORTH_THINNING * few else None


def _weigh_by_arc_length(fit: PoseFit, points: Cloud, found: PoseEstimate, nominal: NominalProfile) -> None:
    """Let every point count by how much of the profile it stands for at the pose found so far."""
    station, at = points.room((len(points),), np.float64), 0
    for block in points.blocks():
        feet, rows = project(_pose_of(found).apply(block), nominal.grid), slice(at, at + len(block))
        station[rows] = np.where((fit.weights[rows] > 0) & (feet.vertex != OPEN_END), feet.station_mm, np.nan)
        at = rows.stop
    weigh_by_station(station, fit.weights, nominal, points.room)


def _icp(points: Array, nominal: NominalProfile, pose: RigidTransform, method: Method, tip_radius_mm: float) -> Registration:
    """The published scheme: best motion onto the feet of the points, again and again, until the mean square settles."""
    previous, converged = np.inf, False
    for iteration in range(1, _ICP_MOST_STEPS + 1):  # noqa: B007 - the count is part of the result
        moved = pose.apply(points)
        feet = feet_on(moved, nominal, method)
        used = feet.vertex != OPEN_END
        deviation = nominal.outward * feet.distance_mm - tip_radius_mm
        now = float(np.square(deviation[used]).mean()) if used.any() else np.inf
        converged = abs(previous - now) <= _ICP_TOLERANCE * now
        if converged or not used.any():
            break
        previous = now
        touched = moved - (nominal.outward * deviation)[:, None] * feet.gradient
        pose = best_motion(moved[used], touched[used]).after(pose)
    here = _pose_fit(Cloud(np.ascontiguousarray(points)), nominal, method, tip_radius_mm).settle(_pose_numbers(pose), 0)
    return _registration(here, iteration, converged, no_outliers(len(points)))


def _pose_fit(points: Cloud, nominal: NominalProfile, method: Method, tip_radius_mm: float, at_once: int = AT_ONCE) -> PoseFit:
    curve = (nominal.grid_for(method), nominal.table_for(method), method, nominal.outward, tip_radius_mm)
    return PoseFit(points.points_mm, *curve, points.left_out, points.room, at_once)


def _pose_numbers(pose: RigidTransform) -> tuple[float, float, float]:
    """Rotation in rad and shift in mm, as the kernels take a pose."""
    return (pose.rotation_rad, float(pose.translation_mm[0]), float(pose.translation_mm[1]))


def _pose_of(fit: PoseEstimate) -> RigidTransform:
    """The pose of an estimate as a motion."""
    return RigidTransform(fit.pose[0], np.array(fit.pose[1:]))


def _registration(fit: PoseEstimate, iterations: int, converged: bool, outliers: NDArray[np.bool_]) -> Registration:
    return Registration(_pose_of(fit), math.sqrt(fit.mean_square), iterations, converged, fit.covariance, fit.centre_mm, (), outliers)
