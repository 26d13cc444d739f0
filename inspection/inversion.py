"""Point inversion, the comparison method of the published paper, in plain numpy; and the nearest sample it starts from.

Newton's iteration on C'(u) . (C(u) - M) = 0 is started at the nearest sample (Piegl & Tiller, equations 6.3 to 6.5). It finds
the foot on the branch of that sample, which at thin edges need not be the closest one; `exact` finds the closest.
"""

import numpy as np
from numpy.typing import NDArray

from inspection.curve import NurbsCurve, unit_vectors
from inspection.kernels import Feet
from inspection.kernels.layout import CORNER, INSIDE, OPEN_END
from inspection.nominal import NominalProfile

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]

_MOST_STEPS = 20
_STANDSTILL_MM = 1e-13


def invert_points(points_mm: Array, nominal: NominalProfile) -> Feet:
    """Feet of points (m, 2) by Newton steps in the parameter until none moves the foot by more than 1e-13 mm.

    Points that are not finite give NaN.
    """
    finite: Mask = np.asarray(np.isfinite(points_mm).all(axis=1))
    if not finite.all():
        feet = invert_points(np.where(finite[:, None], points_mm, nominal.points_mm[0]), nominal)
        return choose_feet(finite, feet, _no_feet(len(finite)))
    site, faces_none = nearest_sites(points_mm, nominal)
    u = _foot_parameters(points_mm, nominal.parameter[site], nominal.curve)
    return choose_feet(faces_none, feet_on_vertices(points_mm, site, nominal), _feet_at(points_mm, u, nominal.curve))


def _foot_parameters(points_mm: Array, start_parameter: Array, curve: NurbsCurve) -> Array:
    """Parameters (m,) of the feet that Newton's iteration reaches from the parameters it is started at (m,)."""
    start, end = curve.domain
    u = start_parameter.copy()
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
    return start + np.mod(u - start, end - start) if curve.closed else u


def _feet_at(points_mm: Array, u: Array, curve: NurbsCurve) -> Feet:
    """Feet of points (m, 2) that lie at the parameters u (m,)."""
    point, first, second = curve.derivatives(u, 2)
    speed = np.sqrt(dot(first, first))
    normal = np.column_stack([-first[:, 1], first[:, 0]]) / speed[:, None]
    reach = points_mm - point
    return Feet(
        parameter=u,
        foot_mm=point,
        distance_mm=np.copysign(np.hypot(reach[:, 0], reach[:, 1]), dot(reach, normal)),
        gradient=normal,
        curvature=(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]) / (speed * speed * speed),
        station_mm=curve.station_mm(u),
        vertex=np.full(len(u), INSIDE, dtype=np.uint8),
    )


def _no_feet(m: int) -> Feet:
    """What m points that are not finite get."""
    flat, pair = np.full(m, np.nan), np.full((m, 2), np.nan)
    return Feet(flat, pair, flat, pair, flat, flat, np.full(m, INSIDE, dtype=np.uint8))


# --- the nearest sample -------------------------------------------------------------------------------------------------


def nearest_sites(points_mm: Array, nominal: NominalProfile) -> tuple[Index, Mask]:
    """Nearest sample (m,) on a piece that the point faces, and whether the point faces none there.

    At a corner the two samples at one place belong to different pieces. A point faces a piece when it lies ahead of the
    piece's beginning or behind its end. Where it faces both (at a concave corner) the nearer tangent wins. Where it faces none
    (in the normal cone of a convex corner, or beyond an open end) the corner or end itself is the closest point.
    """
    site = np.asarray(nominal.tree.query(points_mm)[1], dtype=np.int64)
    twin = nominal.twin[site]
    faced, off = _view_of_piece(points_mm, site, nominal)
    twin_faced, twin_off = _view_of_piece(points_mm, np.maximum(twin, 0), nominal)
    twin_faced &= twin >= 0
    prefer_twin = twin_faced & (~faced | (twin_off < off))
    return np.where(prefer_twin, twin, site), ~faced & ~twin_faced


def _view_of_piece(points_mm: Array, site: Index, nominal: NominalProfile) -> tuple[Mask, Array]:
    """Whether each point faces the piece of its sample, which inside a piece it always does, and its distance from the tangent."""
    reach = points_mm - nominal.points_mm[site]
    ahead = dot(reach, nominal.tangent[site])
    faced = ((nominal.previous_site[site] >= 0) | (ahead >= 0)) & ((nominal.next_site[site] >= 0) | (ahead <= 0))
    return faced, np.abs(dot(reach, nominal.normal[site]))


def feet_on_vertices(points_mm: Array, site: Index, nominal: NominalProfile) -> Feet:
    """Projection onto the samples themselves (ends and corners), signed by the sum of the normals that meet there."""
    twin = np.where(nominal.twin[site] >= 0, nominal.twin[site], site)
    bisector = unit_vectors(nominal.normal[site] + nominal.normal[twin])
    reach = points_mm - nominal.points_mm[site]
    distance = np.hypot(reach[:, 0], reach[:, 1])
    side = np.where(dot(reach, bisector) >= 0, 1.0, -1.0)
    apart = distance > 0
    gradient = np.where(apart[:, None], reach * (side / np.where(apart, distance, 1.0))[:, None], bisector)
    return Feet(
        parameter=nominal.parameter[site],
        foot_mm=nominal.points_mm[site],
        distance_mm=side * distance,
        gradient=gradient,
        curvature=np.zeros(len(site)),
        station_mm=nominal.station_mm[site],
        vertex=np.where(nominal.is_open_end[site], OPEN_END, CORNER).astype(np.uint8),
    )


def choose_feet(chosen: Mask, if_chosen: Feet, otherwise: Feet) -> Feet:
    """Row by row the one set of feet where `chosen` (m,), and the other elsewhere."""

    def pick(name: str) -> NDArray[np.generic]:
        a, b = getattr(if_chosen, name), getattr(otherwise, name)
        return np.asarray(np.where(chosen[:, None] if a.ndim == 2 else chosen, a, b))

    return Feet._make(pick(name) for name in Feet._fields)


def dot(a: Array, b: Array) -> Array:
    """Row-wise scalar product (m,), element by element, so that no result depends on how points are batched."""
    return a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1]
