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
from inspection.surface.feet import FootKind, NominalSurface, points_in_space
from inspection.surface.rigid_motion import RigidMotion
from inspection.surface.weakness import Weakness, weakness_of

Array = NDArray[np.float64]
Truth = NDArray[np.bool_]
SurfaceFreedom = Literal["x", "y", "z", "rx", "ry", "rz"]

_FREEDOMS = get_args(SurfaceFreedom)
_STEPS = 100
_SETTLED = 1e-11  # of the size: a step at the rim of the points after which the pose is found
_HELD = 1e-8  # part of the strongest direction's stiffness below which a direction has no minimum, and is held
_CELL = 0.01  # of the size: points in one cell share its weight
_FEWEST = 6
_MADS = 6.0  # median absolute deviations beyond which a point is an outlier, as for profiles
_ROUNDS = 20  # in which outliers are found anew
_FEW = 500  # points that a pose is tried with
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
    steps             : of Gauss and Newton's method
    converged         : whether the last one was below round-off
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
    limits = gross_mm, farthest_mm
    found = _fit(given, weights, nominal, start, free, target_mm, limits)
    rivals = tuple(_fit(given, weights, nominal, other, free, target_mm, limits).nominal_from_scan for other in others)
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


def _fit(
    points: Array,
    weights: Array,
    nominal: NominalSurface,
    start: RigidMotion,
    free: Truth,
    target_mm: float,
    limits: tuple[float | None, float],
) -> SurfaceRegistration:
    """The pose of least squares from a start; what lies too far off, by the limits, is left out until that stays the same."""
    outlier = np.zeros(len(points), dtype=bool)
    found = _settle(points, weights, nominal, start, free, target_mm, outlier)
    gross_mm, farthest_mm = limits
    if gross_mm is None and farthest_mm == np.inf:
        return found
    for _ in range(_ROUNDS):
        feet = nominal.project(found.nominal_from_scan.apply(points))
        inside = feet.kind < FootKind.BORDER
        now = inside & (np.abs(feet.distance_mm) > farthest_mm)
        if gross_mm is not None:
            off = np.abs(feet.distance_mm - _median(feet.distance_mm[inside], weights[inside]))
            now |= inside & (off > max(gross_mm, _MADS * _median(off[inside], weights[inside])))
        if (now == outlier).all():
            break
        outlier = now
        found = _settle(points, weights, nominal, found.nominal_from_scan, free, target_mm, outlier)
    return found


def _median(values: Array, weights: Array) -> float:
    """The value with half the weight on either side."""
    order = np.argsort(values, kind="stable")
    sums = np.cumsum(weights[order])
    return float(values[order][np.searchsorted(sums, sums[-1] / 2)])


def _settle(
    points: Array, weights: Array, nominal: NominalSurface, start: RigidMotion, free: Truth, target_mm: float, outlier: Truth
) -> SurfaceRegistration:
    """Gauss and Newton's method: rows [n, (x - c) x n] of the deviations' change by shift and turn about the middle c of the points.

    A step after which the deviations grow is taken back and damped.
    """
    motion, damping, steps, converged = start, 0.0, 0, False
    state = _linearise(points, weights, nominal, motion, target_mm, outlier)
    while steps < _STEPS and not converged:
        change = _step(state, free, damping)
        steps += 1
        following = RigidMotion.about(state.centre, change[3:], change[:3]).after(motion)
        there = _linearise(points, weights, nominal, following, target_mm, outlier)
        rim = float(np.linalg.norm(change[:3]) + np.linalg.norm(change[3:]) * state.radius)
        converged = rim <= _SETTLED * nominal.size_mm
        if there.mean_square > state.mean_square * (1 + 1e-6) and not converged:
            damping = max(10 * damping, 1e-3)
            continue
        motion, state, damping = following, there, damping / 10 if damping > 1e-6 else 0.0
    places, normals = nominal.sample(_PLACES)
    whole = np.column_stack([normals, np.cross(places - state.centre, normals)])
    weakest = weakness_of(state.rows, state.weights, state.arms, free, float(np.sqrt(state.mean_square)), whole)
    return SurfaceRegistration(motion, float(np.sqrt(state.mean_square)), steps, converged, state.used, outlier, weakest, state.centre)


@dataclass(frozen=True, slots=True, eq=False)
class _State:
    """What a step needs of a pose: rows (k, 6), residuals, weights and arms from the centre of the k points that take part."""

    rows: Array
    residual: Array
    weights: Array
    arms: Array
    centre: Array
    radius: float
    mean_square: float
    used: Truth


def _linearise(points: Array, weights: Array, nominal: NominalSurface, motion: RigidMotion, target_mm: float, outlier: Truth) -> _State:
    moved = motion.apply(points)
    feet = nominal.project(moved)
    used = (feet.kind < FootKind.BORDER) & ~outlier
    if np.count_nonzero(used) < _FEWEST:
        raise RegistrationError(
            f"only {np.count_nonzero(used)} of {len(points)} points lie on the surface, at least {_FEWEST} are needed: is it "
            "the right part, and the right unit?"
        )
    x, n, w = moved[used], feet.normal[used], weights[used]
    centre = (x * w[:, None]).sum(axis=0) / w.sum()
    arms = x - centre
    residual = feet.distance_mm[used] - target_mm
    radius = float(np.sqrt((arms**2).sum(axis=1).max()))
    return _State(
        np.column_stack([n, np.cross(arms, n)]), residual, w, arms, centre, radius, float((w * residual**2).sum() / w.sum()), used
    )


def _step(state: _State, free: Truth, damping: float) -> Array:
    """The shift and turn (6,) that bring the linearised deviations to the least squares. What has no minimum is held."""
    scale = np.array([1.0] * 3 + [1.0 / state.radius] * 3)  # turns by the way that the rim goes
    rows = (state.rows * scale)[:, free]
    normal = np.einsum("mi,mj,m->ij", rows, rows, state.weights)
    values, vectors = np.linalg.eigh(normal)
    slope = vectors.T @ np.einsum("mi,m,m->i", rows, state.weights, state.residual)
    strong = values > _HELD * values[-1]
    moved = vectors @ np.where(strong, -slope / np.where(strong, values + damping * values[-1], 1.0), 0.0)
    change = np.zeros(6)
    change[free] = moved
    return np.asarray(change * scale)


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
    free = np.ones(6, dtype=bool)
    rms, kept = np.inf, len(few) - int(_WORST * len(few))
    for _ in range(_STEPS // 4):
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
            state = _linearise(few, np.ones(len(few)), nominal, motion, target_mm, outlier)
        except RegistrationError:
            return np.inf, motion
        change = _step(state, free, 1e-6)
        motion = RigidMotion.about(state.centre, change[3:], change[:3]).after(motion)
    return rms, motion
