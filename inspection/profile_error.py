"""Signed deviation of every point from the nominal profile, by the method of choice.

exact      the closest point of the curve itself
circle     projection on the osculating circle of the nearest sample (third order; Hu & Wallner 2005 is a relative)
chord      projection on the polygon of the samples
pcp        pole circle projection, equations 2 and 3 of Hari Ganesh & Samuel (2022), the circle on the point's side
veaw       Voronoi edge assisted weighting, equations 4 to 6 there, angles at the end of the shared Voronoi edge
inversion  point inversion started at the nearest sample, the published method's comparison
"""

from typing import get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inspection.deviations import Deviations, Method
from inspection.inversion import inversion
from inspection.kernels import Feet, project, project_on_samples
from inspection.nominal import NominalProfile
from inspection.projection import INSIDE, OPEN_END

Array = NDArray[np.float64]


def deviations(points_mm: ArrayLike, nominal: NominalProfile, method: Method = "exact", tip_radius_mm: float = 0.0) -> Deviations:
    """Signed deviations of points (m, 2) given in the nominal's coordinates.

    tip_radius_mm : the points are centres of a probing ball of this radius; deviation = distance of the centre - radius
                    along the normal at the foot. Raises ValueError when the ball does not fit into the profile's hollows.
    """
    points = checked_points(points_mm)
    check_tip_radius(tip_radius_mm, nominal)
    if method not in get_args(Method):
        raise ValueError(f"method must be one of {', '.join(get_args(Method))}, not {method!r}")
    feet = feet_on(points, nominal, method)
    return Deviations(
        deviation_mm=nominal.outward * feet.distance_mm - tip_radius_mm,
        foot_mm=feet.foot_mm,
        parameter=feet.parameter,
        station_mm=feet.station_mm,
        normal=nominal.outward * feet.gradient,
        curvature=feet.curvature,
        beyond_end=feet.vertex == OPEN_END,
        at_vertex=feet.vertex != INSIDE,
    )


def feet_on(points_mm: Array, nominal: NominalProfile, method: Method) -> Feet:
    """Feet of points (m, 2) on the nominal by a method; points that are not finite give NaN."""
    if method == "exact":
        return project(points_mm, nominal.grid)
    if method == "inversion":
        return inversion(points_mm, nominal)
    return project_on_samples(points_mm, nominal.grid, nominal.samples, method)


def checked_points(points_mm: ArrayLike) -> Array:
    """Points as a finite float array (m, 2). Raises ValueError naming the first bad row."""
    points = np.asarray(points_mm, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != 2:
        raise ValueError(f"points must have shape (m, 2), got {points.shape}")
    if not np.isfinite(points).all():
        bad = np.flatnonzero(~np.isfinite(points).all(axis=1))
        raise ValueError(f"point {bad[0] + 1} is not finite: {points[bad[0]]}")
    return points


def check_tip_radius(tip_radius_mm: float, nominal: NominalProfile) -> None:
    """Raise ValueError when a ball of this radius cannot touch the whole profile."""
    if not 0 <= tip_radius_mm < nominal.smallest_concave_radius_mm:
        raise ValueError(
            f"tip radius {tip_radius_mm:g} mm: must be zero or more and below the nominal's smallest concave radius, "
            f"{nominal.smallest_concave_radius_mm:.4g} mm"
        )
