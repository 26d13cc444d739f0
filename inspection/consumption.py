"""The fit that consumes least of a tolerance zone which varies along the profile: min over poses of max |e - middle| / half width.

A minimum zone wants all deviations small alike; where one region has a tenth of the tolerance of another, the pose that passes may be
another one. Stations move with the pose, and the limits with them, so their slopes are part of the linear program.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inspection.chebyshev import Values, descend
from inspection.coarse import check_registrable
from inspection.fine import register
from inspection.freedoms import Freedoms
from inspection.methods import Method
from inspection.nominal import NominalProfile
from inspection.registration import Registration
from inspection.rigid import RigidTransform
from inspection.signed_deviations import Deviations, deviations
from inspection.zone_certificate import ConsumptionFit
from inspection.zones import VaryingZone

Array = NDArray[np.float64]

_LEAST = 1e-3  # of 1 - curvature times distance: nearer to the centre of curvature a station is not determined


def fit_least_consumption(
    points_mm: ArrayLike,
    nominal: NominalProfile,
    zone: VaryingZone,
    start: Registration | RigidTransform | None = None,
    method: Method = "exact",
    tip_radius_mm: float = 0.0,
    is_over: Callable[[], bool] = lambda: False,
    freedoms: Freedoms | None = None,
) -> ConsumptionFit:
    """Fit section points (m, 2) so that they consume least of the zone, from `start` or their best fit. As `fit_minimum_zone` otherwise.

    Where the zone has a step, the consumption jumps as a station passes it, and the optimum is one on this side of the jump:
    transitions are the remedy.
    """
    points = check_registrable(points_mm)
    if start is None and freedoms is not None:
        raise ValueError("a fit with locked or limited freedoms needs the pose from which they count")
    begin = register(points, nominal, method, tip_radius_mm=tip_radius_mm) if start is None else start
    pose = begin.nominal_from_section if isinstance(begin, Registration) else begin

    def look(moved: Array) -> Values:
        return _consumed(deviations(moved, nominal, method, tip_radius_mm), zone, nominal.outward, tip_radius_mm)

    narrowest = float((zone.upper_mm - zone.lower_mm).min()) / 2
    found = descend(points, look, pose, freedoms, nominal.length_mm, is_over, narrowest)
    station = deviations(found.pose.apply(points), nominal, method, tip_radius_mm).station_mm[found.active]
    proof = (found.active, station, found.multipliers, found.programs, found.converged)
    return ConsumptionFit(found.pose, found.largest, *proof)


def _consumed(d: Deviations, zone: VaryingZone, outward: float, tip_radius_mm: float) -> Values:
    """What every point consumes, and how that changes with its place: by its deviation, and by the limits that its station passes."""
    lower, upper, lower_slope, upper_slope = zone.limits(d.station_mm)
    half = (upper - lower) / 2
    value = (d.deviation_mm - (lower + upper) / 2) / half
    slope = (lower_slope + upper_slope) / 2 + value * (upper_slope - lower_slope) / 2
    distance = outward * (d.deviation_mm + tip_radius_mm)
    along = np.where(d.at_vertex, 0.0, 1.0 / np.maximum(1.0 - d.curvature * distance, _LEAST))  # of the station, by the tangent
    tangent = outward * np.column_stack([d.normal[:, 1], -d.normal[:, 0]])
    gradient = (d.normal - (slope * along)[:, None] * tangent) / half[:, None]
    return Values(value, gradient, d.station_mm, ~d.beyond_end)
