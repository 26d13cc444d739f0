"""Signed deviation of every point from the nominal profile, by a method of choice (see `methods`)."""

from dataclasses import dataclass
from typing import get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inspection.curve import NurbsCurve
from inspection.inversion import invert_points
from inspection.kernels import SAMPLE_METHODS, Feet, project, project_on_samples, project_outward
from inspection.kernels.layout import INSIDE, OPEN_END
from inspection.methods import Method
from inspection.nominal import NominalProfile

Array = NDArray[np.float64]

KILOMETRE_MM = 1e6  # as for what devices and files give: no part is so far from zero
_METHODS = get_args(Method)


@dataclass(frozen=True, slots=True, eq=False)
class Deviations:
    """Signed deviations of m actual points from the nominal.

    deviation_mm : (m,) positive out of material; for ball centres the tip radius is already taken off
    foot_mm      : (m, 2) the nominal point each deviation is measured from
    parameter    : (m,) curve parameter of the foot
    station_mm   : (m,) arc length of the foot from the start of the curve
    normal       : (m, 2) unit direction in which the deviation grows
    curvature    : (m,) 1/mm of the nominal at the foot, positive where it turns left; 0 at corners and ends
    beyond_end   : (m,) the foot is an end of an open profile: the sign is then not reliable, and the point is kept out of fit and verdict
    at_vertex    : (m,) the foot is an end or a corner, so that the deviation is the distance from a point
    """

    deviation_mm: Array
    foot_mm: Array
    parameter: Array
    station_mm: Array
    normal: Array
    curvature: Array
    beyond_end: NDArray[np.bool_]
    at_vertex: NDArray[np.bool_]

    def __post_init__(self) -> None:
        values = self.deviation_mm, self.parameter, self.station_mm, self.curvature, self.beyond_end, self.at_vertex
        pairs = self.foot_mm, self.normal
        m = len(values[0])
        one, two = (m,), (m, 2)
        for array in values:
            if array.shape != one:
                raise ValueError(f"expected {m} values, got an array of shape {array.shape}")
            array.setflags(write=False)
        for array in pairs:
            if array.shape != two:
                raise ValueError(f"expected an array of shape {two}, got {array.shape}")
            array.setflags(write=False)

    def __len__(self) -> int:
        return len(self.deviation_mm)

    def __repr__(self) -> str:
        extent = f", {self.deviation_mm.min():+.4f} .. {self.deviation_mm.max():+.4f} mm" if len(self) else ""
        return f"<Deviations of {len(self)} points{extent}, {np.count_nonzero(self.beyond_end)} beyond an open end>"


def profile_error_mm(deviations: Deviations) -> float:
    """Width of the smallest equally disposed zone that holds all points: 2 * max |deviation|. Points beyond an end are left out.

    Not the range max - min; a report shows both.
    """
    inside = deviations.deviation_mm[~deviations.beyond_end]
    return 2.0 * float(np.abs(inside).max(initial=0.0))


def deviations(points_mm: ArrayLike, nominal: NominalProfile, method: Method = "exact", tip_radius_mm: float = 0.0) -> Deviations:
    """Signed deviations of points (m, 2) given in the nominal's coordinates.

    tip_radius_mm : the points are centres of a probing ball of this radius; deviation = distance of the centre - radius
                    along the normal at the foot. Where a hollow of the profile is tighter than the ball, no centre has its foot
                    on the bottom: that stretch stays unmeasured. Raises ValueError for a radius that no ball has,
                    and for a ball that fits nowhere.
    """
    points = _pairs(points_mm)
    check_tip_radius(tip_radius_mm, nominal)
    check_method(method)
    if method == "inversion":
        return _invert(check_points(points), nominal, tip_radius_mm)
    asked = (nominal.grid_for(method), nominal.table_for(method), method, nominal.outward, tip_radius_mm, KILOMETRE_MM)
    feet, beyond_end, at_vertex, is_any_far, is_any_at_seam = project_outward(points, *asked)
    if is_any_far:
        check_points(points)
    if is_any_at_seam and method == "exact" and nominal.curve.closed:
        _set_seam(feet, nominal.curve)
    parameter = nominal.hermite.parameters_of_nominal(feet.parameter) if method == "hermite" else feet.parameter
    return Deviations(feet.distance_mm, feet.foot_mm, parameter, feet.station_mm, feet.gradient, feet.curvature, beyond_end, at_vertex)


def _invert(points_mm: Array, nominal: NominalProfile, tip_radius_mm: float) -> Deviations:
    """Signed deviations of points (m, 2) by point inversion."""
    feet = invert_points(points_mm, nominal)
    deviation, normal = nominal.outward * feet.distance_mm - tip_radius_mm, nominal.outward * feet.gradient
    ends, vertices = feet.vertex == OPEN_END, feet.vertex != INSIDE
    return Deviations(deviation, feet.foot_mm, feet.parameter, feet.station_mm, normal, feet.curvature, ends, vertices)


def _set_seam(feet: Feet, curve: NurbsCurve) -> None:
    """Tell parameter and arc length of feet at the seam by where they lie; the projection holds both in the curve's range."""
    start, end = curve.domain
    rows = np.flatnonzero((feet.parameter == start) | (feet.parameter == end))
    if not len(rows):
        return
    (place, after), (_, before) = (curve.derivatives(at, 1)[:, 0] for at in (start, end))
    for row in rows:
        off = feet.foot_mm[row] - place
        ahead = off @ after > 0
        step = float(off @ after / (after @ after)) if ahead else float(off @ before / (before @ before))
        feet.parameter[row] = min(max((start if ahead else end) + step, start), end)
        travel = step * float(np.linalg.norm(after if ahead else before))
        feet.station_mm[row] = min(max(travel if ahead else curve.length_mm + travel, 0.0), curve.length_mm)


def feet_on(points_mm: Array, nominal: NominalProfile, method: Method) -> Feet:
    """Feet of points (m, 2) on the nominal by a method. Points that are not finite give NaN."""
    if method == "inversion":
        return invert_points(points_mm, nominal)
    if method not in SAMPLE_METHODS:
        return project(points_mm, nominal.grid_for(method))
    return project_on_samples(points_mm, nominal.grid, nominal.sample_table, method)


def check_method(method: str) -> None:
    """Raise ValueError when there is no such method of projection."""
    if method not in _METHODS:
        raise ValueError(f"method must be one of {', '.join(_METHODS)}, not {method!r}")


def check_points(points_mm: ArrayLike) -> Array:
    """Points as a float array (m, 2) of places that a part can have. Raises ValueError naming the first bad row."""
    points = _pairs(points_mm)
    if not (points.min(initial=0.0) >= -KILOMETRE_MM and points.max(initial=0.0) <= KILOMETRE_MM):  # or one is no number
        row = int(np.argmin((np.abs(points) <= KILOMETRE_MM).all(axis=1)))
        what = f"lies beyond {KILOMETRE_MM:g} mm, where no part is" if np.isfinite(points[row]).all() else "is not finite"
        raise ValueError(f"point {row + 1} {what}: {points[row]}")
    return points


def _pairs(points_mm: ArrayLike) -> Array:
    """Points as a float array (m, 2)."""
    points = np.asarray(points_mm, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != 2:
        raise ValueError(f"points must have shape (m, 2), got {points.shape}")
    return points


def check_tip_radius(tip_radius_mm: float, nominal: NominalProfile) -> None:
    """Raise ValueError for a radius that no ball has, or one that fits nowhere into the profile."""
    if not 0 <= tip_radius_mm < np.inf:
        raise ValueError(f"tip radius {tip_radius_mm:g} mm: must be a finite number, zero or more")
    widest = nominal.hollowness[0]  # the least hollow place
    if widest * tip_radius_mm >= 1:
        raise ValueError(
            f"tip radius {tip_radius_mm:g} mm: the ball touches the profile nowhere, whose widest hollow has {1 / widest:.4g} mm"
        )
