"""The published paper's method in plain numpy, as the benchmarks' rival: no more work than it needs.

Boxes from unweighted principal axes with the diagonal rule, tuning on dominant points whether or not it helps, and ICP: feet
from the nearest sample (scipy's KD-tree) by point inversion in three Newton steps, by PCP or by VEAW; best motion onto them.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from inspection import NominalProfile, RigidTransform
from inspection.coarse import align_boxes
from inspection.frame import dominant_points, principal_frame
from inspection.rigid import best_motion
from tests.inspection.profiles import Array

Index = NDArray[np.int64]

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
    u = nominal.parameter[_nearest(points_mm, nominal)]
    for _ in range(3):
        point, first, second = curve.derivatives(u, 2)
        reach = point - points_mm
        speed2 = (first * first).sum(axis=1)
        slope = speed2 + (second * reach).sum(axis=1)
        u = u - (first * reach).sum(axis=1) / np.where(slope > 0, slope, speed2)
        u = start + np.mod(u - start, end - start) if curve.closed else np.clip(u, start, end)
    return np.asarray(curve.point(u))


def pcp(points_mm: Array, nominal: NominalProfile) -> Array:
    """Feet (m, 2) on the pole circle, on the point's side, of the nearest sample."""
    site = _nearest(points_mm, nominal)
    distance, gradient = _on_pole_circle(points_mm, nominal, site)
    return np.asarray(points_mm - distance[:, None] * gradient)


def veaw(points_mm: Array, nominal: NominalProfile) -> Array:
    """Feet (m, 2) between those on the pole circles of the nearest sample and its neighbour, by angles at their edge's end."""
    site = _nearest(points_mm, nominal)
    reach = points_mm - nominal.points_mm[site]
    ahead = (reach * nominal.tangent[site]).sum(axis=1) >= 0
    neighbour = np.where(ahead, nominal.next_site[site], nominal.previous_site[site])
    other = np.where(neighbour < 0, site, neighbour)
    first = np.where(ahead, site, other)
    is_left = (reach * nominal.normal[site]).sum(axis=1) > 0
    vertex = np.where(is_left[:, None], nominal.poles.edge_left_mm[first], nominal.poles.edge_right_mm[first])
    at_site, at_other = (_angle(nominal.points_mm[i] - vertex, points_mm - vertex) for i in (site, other))
    alone = (neighbour < 0) | ~(at_site + at_other > 0)
    weight = np.where(alone, 1.0, at_other / np.where(alone, 1.0, at_site + at_other))[:, None]
    (e, g), (e_other, g_other) = (_on_pole_circle(points_mm, nominal, i) for i in (site, other))
    return np.asarray(points_mm - weight * e[:, None] * g - (1 - weight) * e_other[:, None] * g_other)


def _nearest(points_mm: Array, nominal: NominalProfile) -> Index:
    return np.asarray(nominal.tree.query(points_mm)[1], dtype=np.int64)


def _on_pole_circle(points_mm: Array, nominal: NominalProfile, site: Index) -> tuple[Array, Array]:
    """Distance (m,) from the pole circle, positive toward the pole, and its gradient; stable for poles at infinity."""
    poles, reach = nominal.poles, points_mm - nominal.points_mm[site]
    is_left = (reach * nominal.normal[site]).sum(axis=1) >= 0
    toward = np.where(is_left[:, None], poles.left[site], poles.right[site])
    k = np.where(is_left, poles.left_curvature[site], poles.right_curvature[site])
    b = (reach * toward).sum(axis=1)
    s = k * (reach * reach).sum(axis=1) - 2 * b
    root = np.sqrt(1 + k * s)
    return -s / (1 + root), (toward - k[:, None] * reach) / root[:, None]


def _angle(a: Array, b: Array) -> Array:
    return np.asarray(np.abs(np.arctan2(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0], (a * b).sum(axis=1))))


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
