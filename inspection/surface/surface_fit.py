"""Points brought onto a surface in six freedoms: Gauss and Newton's method on exact feet, from a start or from none.

The order of the points has no say: they are sorted first. Nor has their density: where they lie more densely each weighs less.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inspection.errors import RegistrationError
from inspection.surface.feet import NominalSurface, points_in_space
from inspection.surface.pose_search import are_apart, seek_pose
from inspection.surface.pose_steps import FitProblem, SettledPose, settle_pose
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
_EQUAL = 1.001  # times the rms and the points that take part: only symmetry makes fits so much alike
_ROUNDING = 1e-9  # of the size: more than the rms of points without any deviation
_PLACES = 4000  # of the nominal that tell how much of it would hold the part


@dataclass(frozen=True, slots=True, eq=False)
class SurfaceRegistration:
    """Where a scan lies on its nominal, and how well that is known.

    nominal_from_scan : the motion that brings points of the scan onto the nominal
    rms_mm            : root of the mean square of the deviations from the target, weighted by area, of the points that took part
    steps             : of Gauss and Newton's method, those of a choice of the points included
    converged         : whether those to come are below round-off, or go round in a circle that is no wider than was allowed
    settles_within_mm : how far apart two poses of that circle bring a point at most; 0 where the pose was found to round-off, infinite
                        where the steps went on
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
    settles_within_mm: float
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
    circle_mm: float = 0.0,
) -> SurfaceRegistration:
    """Bring points (m, 3) onto a nominal.

    start     : the pose to begin with, within the reach of the nearest surface; None seeks it by the principal axes of both, and
                for scans of a part by pairs of points
    locked    : shifts and turns, in the coordinates of the nominal, that stay as they are in `start`
    target_mm : the deviation that points are brought to, the middle of the zone
    gross_mm  : leave out what deviates more than six times the median and more than this; None leaves nothing out
    farthest_mm : leave out in any case what lies farther off the surface
    circle_mm : how wide a circle may be in which the steps go round for the fit to count as settled

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
        start, others = seek_pose(given, weights, nominal, target_mm)
    free = np.array([name not in locked for name in _FREEDOMS])
    problem = FitProblem(given, weights, nominal, free, target_mm)
    fits = [_fit(problem, each, gross_mm, farthest_mm) for each in (start, *others)]
    found = _least_turned(fits, _ROUNDING * nominal.size_mm)
    settled = found.settles_within_mm <= circle_mm
    rivals: list[RigidMotion] = []
    for rival in (each.nominal_from_scan for each in fits if each is not found):
        if all(are_apart(rival, known, given, nominal) for known in [found.nominal_from_scan, *rivals]):
            rivals.append(rival)
    used, outlier = (np.zeros(len(points), dtype=bool) for _ in range(2))
    same = np.cumsum(is_new) - 1
    used[order], outlier[order] = found.used[same], found.outlier[same]
    return replace(found, converged=settled, used=used, outlier=outlier, rivals=len(rivals), rival_poses=tuple(rivals))


def _least_turned(fits: Sequence[SurfaceRegistration], rounding_mm: float) -> SurfaceRegistration:
    """Of the fits as good as the first that which turns the scan least: of a symmetric part, as it lies in its own coordinates."""
    first = fits[0]
    most_mm, fewest = _EQUAL * first.rms_mm + rounding_mm, np.count_nonzero(first.used) / _EQUAL
    as_good = [each for each in fits if each.rms_mm <= most_mm and np.count_nonzero(each.used) >= fewest]
    return max(as_good, key=lambda each: float(np.trace(each.nominal_from_scan.rotation)))


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
    within = found.within_mm
    return SurfaceRegistration(found.motion, rms, found.steps, not within, within, state.used, outlier, weakest, state.centre)
