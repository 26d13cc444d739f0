"""The closest point of the curve itself, over all its branches.

Every part of the curve is within half its own arc length of one of its two samples. With the distance d of the nearest
sample in hand, the closest point can therefore only lie beside samples nearer than d + h/2, h the longest step. Each local
minimum of the distance among those samples is bracketed by its neighbours and solved to round-off; the nearest foot wins.
"""

import numpy as np
from numpy.typing import NDArray

from inspection.curve import NurbsCurve
from inspection.inversion import choose_feet, dot, feet_on_vertices
from inspection.kernels import Feet
from inspection.kernels.layout import INSIDE
from inspection.nominal import NominalProfile

Array = NDArray[np.float64]
Index = NDArray[np.int64]

_MOST_STEPS = 80


def exact(points_mm: Array, nominal: NominalProfile) -> Feet:
    """Project on the globally closest point of the curve; the error is that of rounding (about 1e-13 mm)."""
    row, site = _candidates(points_mm, nominal)
    parameter, at_end = _solve(points_mm[row], site, nominal)
    reach = points_mm[row] - nominal.curve.point(parameter)
    distance = np.hypot(reach[:, 0], reach[:, 1])
    order = np.lexsort((at_end, distance, row))  # nearest first, a foot inside a piece before an equal one at its end
    best = order[np.unique(row[order], return_index=True)[1]]
    u, vertex, site = parameter[best], at_end[best], site[best]
    vertex &= nominal.is_open_end[site] | _in_normal_cone(points_mm, site, nominal)
    inside = _at_parameters(points_mm, u, nominal.curve)
    return choose_feet(vertex, feet_on_vertices(points_mm, site, nominal), inside) if vertex.any() else inside


def _candidates(points_mm: Array, nominal: NominalProfile) -> tuple[Index, Index]:
    """Pairs (row of the point, sample) where the sample is a local minimum of the distance that may hold the closest point."""
    distance = nominal.tree.query(points_mm)[0]
    ahead = np.flatnonzero(nominal.next_site >= 0)
    steps = np.mod(nominal.station_mm[nominal.next_site[ahead]] - nominal.station_mm[ahead], nominal.length_mm)
    reach = (distance + steps.max() / 2) * (1 + 1e-12)
    found = nominal.tree.query_ball_point(points_mm, reach)
    row = np.repeat(np.arange(len(points_mm)), [len(sites) for sites in found])
    site = np.concatenate([*map(np.asarray, found), np.empty(0)]).astype(np.int64)
    here = _distance2(points_mm, row, site, nominal)
    lowest = np.ones(len(row), dtype=bool)
    for neighbour in (nominal.next_site[site], nominal.previous_site[site]):
        there = _distance2(points_mm, row, np.maximum(neighbour, 0), nominal)
        lowest &= (neighbour < 0) | (here <= there)
    return row[lowest], site[lowest]


def _distance2(points_mm: Array, row: Index, site: Index, nominal: NominalProfile) -> Array:
    reach = points_mm[row] - nominal.points_mm[site]
    return dot(reach, reach)


def _solve(points_mm: Array, site: Index, nominal: NominalProfile) -> tuple[Array, NDArray[np.bool_]]:
    """Parameter (p,) of the stationary point between a sample's neighbours, by Newton steps kept inside a shrinking bracket.

    Also whether it is the end of a piece, where the distance still falls towards the outside.
    """
    curve = nominal.curve
    range_ = curve.domain[1] - curve.domain[0]
    u = nominal.parameter[site]
    low = np.where(nominal.previous_site[site] >= 0, nominal.parameter[nominal.previous_site[site]], u)
    high = np.where(nominal.next_site[site] >= 0, nominal.parameter[nominal.next_site[site]], u)
    low, high = np.where(low > u, low - range_, low), np.where(high < u, high + range_, high)  # across the seam
    active = np.arange(len(u))
    for _ in range(_MOST_STEPS):
        point, first, second = curve.derivatives(u[active], 2)
        reach = point - points_mm[active]
        slope = dot(first, reach)  # half the derivative of the squared distance
        falling = slope < 0
        low[active] = np.where(falling, u[active], low[active])
        high[active] = np.where(falling, high[active], u[active])
        bend = dot(first, first) + dot(second, reach)
        newton = u[active] - slope / np.where(bend > 0, bend, np.inf)
        inside = (bend > 0) & (newton >= low[active]) & (newton <= high[active])
        stepped = np.where(inside, newton, (low[active] + high[active]) / 2)
        moved = np.abs(stepped - u[active])
        u[active] = stepped
        active = active[moved > 4e-16 * range_]
        if not active.size:
            break
    at_start = (nominal.previous_site[site] < 0) & (u <= nominal.parameter[site])
    at_finish = (nominal.next_site[site] < 0) & (u >= nominal.parameter[site])
    start, end = curve.domain
    wrapped = np.where(u < start, u + range_, np.where(u > end, u - range_, u)) if curve.closed else u
    return wrapped, at_start | at_finish


def _in_normal_cone(points_mm: Array, site: Index, nominal: NominalProfile) -> NDArray[np.bool_]:
    """Whether the point lies beyond the end of both pieces that meet at the sample, by more than rounding."""
    beyond = np.ones(len(site), dtype=bool)
    for end in (site, np.where(nominal.twin[site] >= 0, nominal.twin[site], site)):
        ahead = dot(points_mm - nominal.points_mm[end], nominal.tangent[end])
        beyond &= np.where(nominal.next_site[end] < 0, ahead > 0, ahead < 0)
    return beyond


def _at_parameters(points_mm: Array, u: Array, curve: NurbsCurve) -> Feet:
    point, first, second = curve.derivatives(u, 2)
    speed = np.hypot(first[:, 0], first[:, 1])
    normal = np.column_stack([-first[:, 1], first[:, 0]]) / speed[:, None]
    reach = points_mm - point
    return Feet(
        parameter=u,
        foot_mm=point,
        distance_mm=np.copysign(np.hypot(reach[:, 0], reach[:, 1]), dot(reach, normal)),
        gradient=normal,
        curvature=(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]) / speed**3,
        station_mm=curve.station_mm(u),
        vertex=np.full(len(u), INSIDE, dtype=np.uint8),
    )
