"""Point inversion: the comparison method of the published paper, in plain numpy.

Newton's iteration on C'(u) . (C(u) - M) = 0 started at the nearest sample (Piegl & Tiller, equations 6.3 to 6.5). It finds the
foot on the branch of that sample, which at thin edges need not be the closest one; `exact` does.
"""

import numpy as np
from numpy.typing import NDArray

from inspection.kernels import Feet
from inspection.nominal import NominalProfile
from inspection.projection import INSIDE, dot, merged, nearest_sites, on_vertices

Array = NDArray[np.float64]

_MOST_STEPS = 20
_STANDSTILL_MM = 1e-13


def inversion(points_mm: Array, nominal: NominalProfile) -> Feet:
    """Project by Newton steps in the parameter until none moves the foot by more than 1e-13 mm."""
    curve = nominal.curve
    start, end = curve.domain
    finite: NDArray[np.bool_] = np.asarray(np.isfinite(points_mm).all(axis=1))
    if not finite.all():
        some = inversion(np.where(finite[:, None], points_mm, nominal.points_mm[0]), nominal)
        return merged(finite, some, _nowhere(len(finite)))
    site, faces_none = nearest_sites(points_mm, nominal)
    u = nominal.parameter[site].copy()
    active = np.arange(len(u))  # a point that stands still is left alone, so that its result does not depend on its batch
    for _ in range(_MOST_STEPS):
        point, first, second = curve.derivatives(u[active], 2)
        reach = point - points_mm[active]
        speed2 = dot(first, first)
        slope = speed2 + dot(second, reach)
        stepped = u[active] - dot(first, reach) / np.where(slope > 0, slope, speed2)
        stepped = stepped if curve.closed else np.clip(stepped, start, end)
        moved = np.abs(stepped - u[active]) * np.sqrt(speed2)
        u[active] = stepped
        active = active[moved > _STANDSTILL_MM]
        if not active.size:
            break
    if curve.closed:
        u = start + np.mod(u - start, end - start)
    point, first, second = curve.derivatives(u, 2)
    speed = np.sqrt(dot(first, first))
    normal = np.column_stack([-first[:, 1], first[:, 0]]) / speed[:, None]
    reach = points_mm - point
    near = Feet(
        parameter=u,
        foot_mm=point,
        distance_mm=np.copysign(np.hypot(reach[:, 0], reach[:, 1]), dot(reach, normal)),
        gradient=normal,
        curvature=(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]) / (speed * speed * speed),
        station_mm=curve.station_mm(u),
        vertex=np.full(len(u), INSIDE, dtype=np.uint8),
    )
    return merged(faces_none, on_vertices(points_mm, site, nominal), near)


def _nowhere(m: int) -> Feet:
    flat, pair = np.full(m, np.nan), np.full((m, 2), np.nan)
    return Feet(flat, pair, flat, pair, flat, flat, np.full(m, INSIDE, dtype=np.uint8))
