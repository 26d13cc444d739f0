"""Algorithm 3 of Hari Ganesh & Samuel (2022), and what a partial scan needs beyond it.

Published: the oriented bounding boxes are brought together, their diagonal points choose between the two ways round, and the
result is tuned on dominant points. Added: a walk along the contour with arc-length weights, so that neither the order of the
points nor how densely they lie changes a pose. Added for scans that cover only a part of the profile: their turning angle as a
function of arc length is slid along that of the nominal, in both directions (Arkin et al. 1991; Wolfson 1990).
"""

from collections.abc import Iterator

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import ArrayLike, NDArray

from inspection.cloud import Cloud
from inspection.contour_order import Contour, trace_contour
from inspection.errors import RegistrationError
from inspection.frame import Frame, arc_length_weights, dominant_points, principal_frame
from inspection.kernels import project, strides
from inspection.medians import median_place
from inspection.nominal import NominalProfile
from inspection.registration import Registration
from inspection.rigid import RigidTransform, best_motion, rotate
from inspection.signed_deviations import check_points

Array = NDArray[np.float64]

FEWEST_POINTS = 8  # three unknowns, and something left to judge
_SIGNATURE_STEPS = 400  # of the nominal's length; a chord of the signature spans four of them
_CHORD_STEPS = 4
_SIGNATURE_POSES = 4  # best shifts kept for each scan direction
_CELLS_A_STEP = 4  # the points in a cell of this share of a step are one point of the walk
_NEAR = 2.0  # sizes of the nominal from the median of the points: no point of the same part lies farther away
_SCORED_POINTS = 500


def register_coarse(points_mm: ArrayLike, nominal: NominalProfile) -> Registration:
    """The best of all coarse poses of points (m, 2), by the trimmed mean square distance to the nominal.

    Raises RegistrationError for fewer than 8 points or points all in one place.
    """
    points = check_registrable(points_mm)
    poses = poses_of_contour(contour_of(Cloud(points), nominal), nominal)
    few = Cloud(points).few(_SCORED_POINTS)
    pose = min(poses, key=lambda one: trimmed_mean_square(few, one, nominal))
    return Registration(
        pose,
        float(np.sqrt(mean_square(points, pose, nominal))),
        0,
        False,
        np.zeros((3, 3)),
        np.zeros(2),
        (),
        np.zeros(len(points), dtype=bool),
    )


def check_registrable(points_mm: ArrayLike) -> Array:
    """Points as a finite float array (m, 2). Raises RegistrationError for fewer than 8 points or points all in one place."""
    points = check_points(points_mm)
    if len(points) < FEWEST_POINTS:
        raise RegistrationError(f"{len(points)} points: a registration needs at least {FEWEST_POINTS}")
    if (points[0] == points[-1]).all() and (points == points[0]).all():  # two steps, because the full comparison is slow
        raise RegistrationError(f"all {len(points)} points coincide at ({points[0, 0]:g}, {points[0, 1]:g})")
    return points


def check_cloud(points: ArrayLike | Cloud) -> Cloud:
    """The same for points that may be a cloud already, whose points are finite."""
    if not isinstance(points, Cloud):
        return Cloud(np.ascontiguousarray(check_registrable(points)))
    if len(points) < FEWEST_POINTS:
        raise RegistrationError(f"{len(points)} points: a registration needs at least {FEWEST_POINTS}")
    low, high = points.corners()
    if (low == high).all():
        raise RegistrationError(f"all {len(points)} points coincide at ({low[0]:g}, {low[1]:g})")
    return points


def poses_of_contour(contour: Contour, nominal: NominalProfile) -> list[RigidTransform]:
    """Candidate poses of a measured contour: of the boxes, the published one first, then at the best shifts of the turning angle."""
    nominal_frame = principal_frame(nominal.points_mm, arc_length_weights(nominal.points_mm, nominal.curve.closed))
    poses = list(align_boxes(principal_frame(contour.points_mm, contour.weights_mm), nominal_frame))
    poses[0] = tune_on_dominant_points(contour.points_mm, poses[0], nominal)
    return poses + _signature_poses(contour.walk_mm, nominal)


def contour_of(points: Cloud, nominal: NominalProfile) -> Contour:
    """A bounded number of points that stand for the scan in any order and density.

    Points that are too far from the others to be of the same part are left out, so that no single number costs memory or time.
    """
    middle, most = median_place(points), _NEAR * nominal.size_mm

    def near() -> Iterator[Array]:
        for block in points.blocks():
            off_x, off_y = np.abs(block - middle).T
            yield block[(off_x <= most) & (off_y <= most)]

    if sum(len(block) for block in near()) >= FEWEST_POINTS:
        contour = trace_contour(near, nominal.length_mm / (_SIGNATURE_STEPS * _CELLS_A_STEP))
        if len(contour.points_mm) >= FEWEST_POINTS:
            return contour
    some = points.few()
    few = some[np.lexsort(some.T)][:: max(1, len(some) // FEWEST_POINTS)]  # all in a few cells, or none near another
    return Contour(few, np.ones(len(few)), np.arange(len(few)))


def align_boxes(measured: Frame, nominal: Frame) -> tuple[RigidTransform, RigidTransform]:
    """The two motions that bring the measured box onto the nominal one, box centre to box centre, the likelier one first.

    Which one that is the diagonal points decide: the extents of the measured box about its mean are compared with those of the
    nominal box as they are, and after half a turn.
    """
    extents, reference = measured.diagonal_points_mm, nominal.diagonal_points_mm
    turned = -np.roll(extents, 2)
    poses = []
    for sign in (1.0, -1.0):
        rotation = sign * nominal.axes @ measured.axes.T
        shift = nominal.box_centre_mm - rotation @ measured.box_centre_mm
        poses.append(RigidTransform(float(np.arctan2(rotation[1, 0], rotation[0, 0])), shift))
    straight = np.abs(reference - extents).sum() <= np.abs(reference - turned).sum()
    return (poses[0], poses[1]) if straight else (poses[1], poses[0])


def tune_on_dominant_points(points_mm: Array, pose: RigidTransform, nominal: NominalProfile) -> RigidTransform:
    """The pose after the best motion of the points nearest to the nominal's dominant points, or as it was if that fits no better."""
    dominant = nominal.points_mm[dominant_points(nominal.points_mm, nominal.curve.closed)]
    moved = pose.apply(points_mm)
    if len(dominant) < 2:
        return pose
    gaps = ((moved[None] - dominant[:, None]) ** 2).sum(axis=2)  # (dominant, m)
    tuned = best_motion(moved[gaps.argmin(axis=1)], dominant).after(pose)
    return min(pose, tuned, key=lambda candidate: mean_square(points_mm, candidate, nominal))


def mean_square(points_mm: Array, pose: RigidTransform, nominal: NominalProfile) -> float:
    """Mean square distance to the nominal, mm^2 (the paper's MSD)."""
    return float(np.mean(np.square(project(pose.apply(points_mm), nominal.grid).distance_mm)))


def trimmed_mean_square(points_mm: Array, pose: RigidTransform, nominal: NominalProfile) -> float:
    """Mean square distance of the nearer 80 % of points (m, 2), so that outliers do not choose the pose."""
    distance = np.sort(np.abs(project(pose.apply(points_mm), nominal.grid).distance_mm))
    return float((distance[: max(1, int(0.8 * len(distance)))] ** 2).mean())


def _signature_poses(points_mm: Array, nominal: NominalProfile) -> list[RigidTransform]:
    """Poses at the best matches of the scan's turning angle with the nominal's, forwards and backwards."""
    step = nominal.length_mm / _SIGNATURE_STEPS
    clean = _drop_spikes(points_mm)
    poses: list[RigidTransform] = []
    for scan in (clean, clean[::-1]):
        even = _even_walk(scan, step)
        if len(even) > 2 * _CHORD_STEPS:
            poses += _poses_at_best_shifts(even, nominal, step)
    return poses


def _poses_at_best_shifts(scan: Array, nominal: NominalProfile, step: float) -> list[RigidTransform]:
    """Poses at those shifts of the scan along the nominal at which the difference of their directions varies least."""
    reference = _even_nominal_points(nominal, step, len(scan))
    along_nominal, along_scan = _chord_directions(reference), _chord_directions(scan)
    if len(along_scan) > len(along_nominal):
        scan = scan[: len(reference)]
        along_scan = along_scan[: len(along_nominal)]
    difference = sliding_window_view(along_nominal, len(along_scan)) - along_scan  # (shifts, chords)
    variance = difference.var(axis=1)
    padded = np.concatenate([[np.inf], variance, [np.inf]])
    lowest = np.flatnonzero((variance <= padded[:-2]) & (variance <= padded[2:]))
    chosen = lowest[np.argsort(variance[lowest])[:_SIGNATURE_POSES]]
    poses = []
    for shift in chosen:
        angle = float(difference[shift].mean())
        target = reference[shift : shift + len(scan)]
        poses.append(RigidTransform(angle, target.mean(axis=0) - rotate(scan, angle).mean(axis=0)))
    return poses


def _even_nominal_points(nominal: NominalProfile, step: float, window: int) -> Array:
    """Nominal points every `step` of arc length. A closed profile goes on past its seam by `window` points."""
    station = np.arange(_SIGNATURE_STEPS + (window if nominal.curve.closed else 1)) * step
    known = np.append(nominal.station_mm, nominal.length_mm) if nominal.curve.closed else nominal.station_mm
    points = np.vstack([nominal.points_mm, nominal.points_mm[:1]]) if nominal.curve.closed else nominal.points_mm
    order = np.argsort(known, kind="stable")
    wanted = np.mod(station, nominal.length_mm) if nominal.curve.closed else station
    return np.column_stack([np.interp(wanted, known[order], points[order, axis]) for axis in (0, 1)])


def _chord_directions(points_mm: Array) -> Array:
    """Directions in rad, without jumps, of the chords that span four steps each."""
    chords = points_mm[_CHORD_STEPS:] - points_mm[:-_CHORD_STEPS]
    return np.asarray(np.unwrap(np.arctan2(chords[:, 1], chords[:, 0])))


def _drop_spikes(points_mm: Array) -> Array:
    """Points that stay near the median of the seven around them in scan order, because single spikes would bend the turning angle."""
    if len(points_mm) < 2 * FEWEST_POINTS:
        return points_mm
    padded = np.vstack([np.repeat(points_mm[:1], 3, axis=0), points_mm, np.repeat(points_mm[-1:], 3, axis=0)])
    off = np.hypot(*(points_mm - np.median(sliding_window_view(padded, 7, axis=0), axis=2)).T)
    return np.asarray(points_mm[off <= 6 * np.median(off) + 1e-12])


def _even_walk(points_mm: Array, step: float) -> Array:
    """Points (k, 2) about one `step` apart along the scan, so that noise between them does not lengthen the walk.

    The walk ends when it is as long as the nominal: what lies far out costs no more than what lies near.
    """
    corners = points_mm[strides(points_mm, step)]
    travelled = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(corners, axis=0).T))])
    even = np.arange(0.0, min(travelled[-1], (_SIGNATURE_STEPS + 0.5) * step), step)  # (k,), k <= _SIGNATURE_STEPS + 1
    return np.column_stack([np.interp(even, travelled, corners[:, axis]) for axis in (0, 1)])
