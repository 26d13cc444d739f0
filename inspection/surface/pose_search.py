"""The start of a registration where none is given: by principal axes, and by pairs of points for scans of a part."""

from itertools import permutations, product

import numpy as np
from numpy.typing import NDArray

from inspection.errors import RegistrationError
from inspection.surface.feet import NominalSurface
from inspection.surface.pair_poses import poses_by_pairs
from inspection.surface.pose_steps import FitProblem, linearise, step_of
from inspection.surface.rigid_motion import RigidMotion

Array = NDArray[np.float64]

_FEW, _TRIES = 500, 25  # points that a pose is tried with, and steps
_PLACES = 4000  # of the nominal from which its axes are taken
_WORST = 0.1  # of the points that are left out while a pose is tried
_RIVAL = 1.1  # times the least rms: another pose that fits as well
_FITS = 0.02  # of the size: a larger rms means that the pose was not found
_OTHER_POSE = 0.02  # of the size at the rim: poses farther apart are different ones
_WHOLE = 0.02  # of the size: a scan that reaches as far along the axes is one of the whole part
_BY_PAIRS = 24  # poses by pairs that are tried


def seek_pose(points: Array, weights: Array, nominal: NominalSurface, target_mm: float) -> tuple[RigidMotion, list[RigidMotion]]:
    """The start for points (m, 3), and others that fit as well.

    Principal axes are laid on principal axes in all ways; for a scan that does not reach as far as the whole part, pairs are asked as
    well. Each pose is refined, the least rms wins. Raises RegistrationError where none fits.
    """
    places, normals = nominal.sample(_PLACES)
    to_middle, to_axes = _axes(places, np.ones(len(places)))
    from_middle, from_axes = _axes(points, weights)
    starts = []
    for turn in _proper_turns():
        rotation = to_axes @ turn @ from_axes.T
        starts.append(RigidMotion(rotation, to_middle - rotation @ from_middle))
    few = points[np.unique(np.linspace(0, len(points) - 1, _FEW).astype(np.int64))]
    tried = sorted((_trimmed(few, nominal, start, target_mm) for start in starts), key=lambda each: each[0])
    if not (tried[0][0] <= _FITS * nominal.size_mm and _reaches(points @ from_axes, places @ to_axes, nominal.size_mm)):
        by_pairs = poses_by_pairs(points, places, normals, nominal.size_mm, _BY_PAIRS)
        tried = sorted([*tried, *(_trimmed(few, nominal, start, target_mm) for start in by_pairs)], key=lambda each: each[0])
    least, best = tried[0]
    if not least <= _FITS * nominal.size_mm:
        raise RegistrationError(
            f"the pose was not found: at best the points lie {least:.3g} mm (rms) off the surface. Is enough of the part scanned, is it "
            "the right one and the right unit? Else give a start"
        )
    others: list[RigidMotion] = []
    for rms, motion in tried[1:]:
        if rms <= _RIVAL * least + 1e-9 * nominal.size_mm and all(are_apart(motion, known, few, nominal) for known in [best, *others]):
            others.append(motion)
    return best, others


def are_apart(one: RigidMotion, other: RigidMotion, points: Array, nominal: NominalSurface) -> bool:
    """Whether two poses of points (m, 3) are different ones: by how far they move the rim apart."""
    spread = np.sqrt(((points - points.mean(axis=0)) ** 2).sum(axis=1).max())
    corners = points.mean(axis=0) + spread * np.concatenate([np.eye(3), -np.eye(3)])
    return bool(np.abs(one.apply(corners) - other.apply(corners)).max() > _OTHER_POSE * nominal.size_mm)


def _reaches(points: Array, places: Array, size_mm: float) -> bool:
    """Whether points (m, 3), along their axes, reach as far as the places of the nominal do along theirs."""
    return bool((np.ptp(points, axis=0) > np.ptp(places, axis=0) - _WHOLE * size_mm).all())


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
