"""The registration of the published paper in plain numpy, as the benchmarks' rival: no more work than it needs.

Boxes from unweighted principal axes with the diagonal rule, tuning on dominant points whether or not it helps, and ICP with
point inversion: nearest sample by KD-tree, three Newton steps on the curve, best motion onto the feet.
"""

import numpy as np
from scipy.spatial import cKDTree

from inspection import NominalProfile, RigidTransform
from inspection.coarse import align_boxes
from inspection.frame import dominant_points, principal_frame
from inspection.rigid import best_motion
from tests.inspection.profiles import Array

ICP_TOLERANCE = 1e-6  # relative change of the mean square; the paper states none
_MOST_ITERATIONS = 2000


def boxes(points_mm: Array, nominal: NominalProfile) -> RigidTransform:
    """Algorithm 3 up to step 3: oriented bounding boxes of unweighted points, box centre to box centre."""
    return align_boxes(principal_frame(points_mm), principal_frame(nominal.points_mm))[0]


def tuned(points_mm: Array, pose: RigidTransform, nominal: NominalProfile) -> RigidTransform:
    """Algorithm 3, steps 4 and 5: best motion of the points nearest to the dominant points, taken in any case."""
    dominant = nominal.points_mm[dominant_points(nominal.points_mm, nominal.curve.closed)]
    moved = pose.apply(points_mm)
    return best_motion(moved[cKDTree(moved).query(dominant)[1]], dominant).after(pose)


def invert(points_mm: Array, nominal: NominalProfile) -> Array:
    """Feet (m, 2) by point inversion from the nearest sample: three steps reach 1e-11 mm at this sampling."""
    curve = nominal.curve
    start, end = curve.domain
    u = nominal.parameter[nominal.tree.query(points_mm)[1]]
    for _ in range(3):
        point, first, second = curve.derivatives(u, 2)
        reach = point - points_mm
        speed2 = (first * first).sum(axis=1)
        slope = speed2 + (second * reach).sum(axis=1)
        u = u - (first * reach).sum(axis=1) / np.where(slope > 0, slope, speed2)
        u = start + np.mod(u - start, end - start) if curve.closed else np.clip(u, start, end)
    return np.asarray(curve.point(u))


def icp(points_mm: Array, nominal: NominalProfile, start: RigidTransform) -> tuple[RigidTransform, int]:
    """Algorithm 4 with point inversion until the mean square settles, and the number of inversions made."""
    pose, previous = start, np.inf
    for iteration in range(1, _MOST_ITERATIONS + 1):
        moved = pose.apply(points_mm)
        feet = invert(moved, nominal)
        now = float(np.mean(((moved - feet) ** 2).sum(axis=1)))
        if abs(previous - now) <= ICP_TOLERANCE * now:
            return pose, iteration
        previous = now
        pose = best_motion(moved, feet).after(pose)
    return pose, _MOST_ITERATIONS
