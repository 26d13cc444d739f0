"""Signed deviation of every point from the nominal profile, by the method of choice.

exact      the closest point of the curve itself
circle     projection on the osculating circle of the nearest sample (third order; Hu & Wallner 2005 is a relative)
chord      projection on the polygon of the samples
pcp        pole circle projection, equations 2 and 3 of Hari Ganesh & Samuel (2022), the circle on the point's side
veaw       Voronoi edge assisted weighting, equations 4 to 6 there, angles at the end of the shared Voronoi edge
inversion  point inversion started at the nearest sample, the published method's comparison
"""

from collections.abc import Callable
from typing import get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inspection.deviations import Deviations, Method
from inspection.inversion import inversion
from inspection.kernels import Feet, project
from inspection.nominal import NominalProfile
from inspection.projection import INSIDE, OPEN_END, dot, merged, nearest_sites, on_vertices, unit

Array = NDArray[np.float64]
Index = NDArray[np.int64]


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
    return _PROJECTIONS[method](points_mm, nominal)


def checked_points(points_mm: ArrayLike) -> Array:
    """Points as a finite float array (m, 2). Raises ValueError naming the first bad row."""
    points = np.asarray(points_mm, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != 2:
        raise ValueError(f"points must have shape (m, 2), got {points.shape}")
    bad = np.flatnonzero(~np.isfinite(points).all(axis=1))
    if bad.size:
        raise ValueError(f"point {bad[0] + 1} is not finite: {points[bad[0]]}")
    return points


def check_tip_radius(tip_radius_mm: float, nominal: NominalProfile) -> None:
    """Raise ValueError when a ball of this radius cannot touch the whole profile."""
    if not 0 <= tip_radius_mm < nominal.smallest_concave_radius_mm:
        raise ValueError(
            f"tip radius {tip_radius_mm:g} mm: must be zero or more and below the nominal's smallest concave radius, "
            f"{nominal.smallest_concave_radius_mm:.4g} mm"
        )


def exact(points_mm: Array, nominal: NominalProfile) -> Feet:
    """The globally closest point of the curve itself."""
    return project(points_mm, nominal.grid)


def circle(points_mm: Array, nominal: NominalProfile) -> Feet:
    """Projection on the osculating circle of the nearest sample: third order, |error| <= |curvature'| h^3 / 48."""
    site, faces_none = nearest_sites(points_mm, nominal)
    left, gradient = _on_circle(points_mm - nominal.points_mm[site], nominal.tangent[site], nominal.normal[site], nominal.curvature[site])
    return _from_sites(points_mm, nominal, site, faces_none, left, gradient)


def pcp(points_mm: Array, nominal: NominalProfile) -> Feet:
    """Pole circle projection: second order, |error| <= (3/8) |1/r - curvature| h^2 + (1/2) |curvature'| h^3."""
    site, faces_none = nearest_sites(points_mm, nominal)
    left, gradient = _on_pole_circle(points_mm, nominal, site)
    return _from_sites(points_mm, nominal, site, faces_none, left, gradient)


def veaw(points_mm: Array, nominal: NominalProfile) -> Feet:
    """Voronoi edge assisted weighting: pole circles of the nearest sample and its neighbour, blended by angles at their edge."""
    site, faces_none = nearest_sites(points_mm, nominal)
    reach = points_mm - nominal.points_mm[site]
    ahead = dot(reach, nominal.tangent[site]) >= 0
    neighbour = np.where(ahead, nominal.next_site[site], nominal.previous_site[site])
    alone = neighbour < 0
    other = np.where(alone, site, neighbour)
    vertex = _edge_end(nominal, np.where(ahead, site, other), dot(reach, nominal.normal[site]) > 0)
    at_site = _angle(nominal.points_mm[site] - vertex, points_mm - vertex)
    at_other = _angle(points_mm - vertex, nominal.points_mm[other] - vertex)
    total = at_site + at_other
    whole = alone | ~(total > 0)  # also where the two cells share no edge (NaN)
    weight = np.where(whole, 1.0, at_other / np.where(whole, 1.0, total))
    left_site, gradient_site = _on_pole_circle(points_mm, nominal, site)
    left_other, gradient_other = _on_pole_circle(points_mm, nominal, other)
    left = weight * left_site + (1 - weight) * left_other
    gradient = weight[:, None] * gradient_site + (1 - weight)[:, None] * gradient_other
    return _from_sites(points_mm, nominal, site, faces_none, left, unit(gradient))


def chord(points_mm: Array, nominal: NominalProfile) -> Feet:
    """Projection on the polygon of the samples, on the nearer of the two chords that meet at the nearest sample."""
    site, faces_none = nearest_sites(points_mm, nominal)
    left, gradient = _on_chord(points_mm, nominal, site, nominal.next_site[site])
    left_before, gradient_before = _on_chord(points_mm, nominal, site, nominal.previous_site[site])
    before = np.abs(left_before) < np.abs(left)
    left = np.where(before, left_before, left)
    return _from_sites(points_mm, nominal, site, faces_none, left, np.where(before[:, None], gradient_before, gradient))


def _on_circle(reach: Array, tangent: Array, normal: Array, curvature: Array) -> tuple[Array, Array]:
    """Signed distance (m,), positive along `normal`, to a circle through the site, and its gradient (m, 2).

    Stable form without cancellation as the radius tends to infinity: with s = k (a^2 + b^2) - 2 b,
    e = -s / (1 + sqrt(1 + k s)) and 1 + k s = (1 - k b)^2 + (k a)^2.
    """
    a, b = dot(reach, tangent), dot(reach, normal)
    s = curvature * (a * a + b * b) - 2 * b
    root = np.sqrt(np.maximum(1 + curvature * s, 0.0))
    along = -curvature * a / np.where(root > 0, root, 1.0)
    across = np.where(root > 0, (1 - curvature * b) / np.where(root > 0, root, 1.0), 1.0)
    return -s / (1 + root), along[:, None] * tangent + across[:, None] * normal


def _on_pole_circle(points_mm: Array, nominal: NominalProfile, site: Index) -> tuple[Array, Array]:
    """Left-signed distance to the pole circle on the point's side of the profile, and its gradient."""
    poles = nominal.poles
    reach = points_mm - nominal.points_mm[site]
    is_left = dot(reach, nominal.normal[site]) >= 0
    side = np.where(is_left, 1.0, -1.0)
    toward = np.where(is_left[:, None], poles.left[site], poles.right[site])
    curvature = np.where(is_left, poles.left_curvature[site], poles.right_curvature[site])
    across = np.column_stack([toward[:, 1], -toward[:, 0]])
    distance, gradient = _on_circle(reach, across, toward, curvature)
    return side * distance, side[:, None] * gradient


def _edge_end(nominal: NominalProfile, first: Index, is_left: NDArray[np.bool_]) -> Array:
    return np.where(is_left[:, None], nominal.poles.edge_left_mm[first], nominal.poles.edge_right_mm[first])


def _angle(a: Array, b: Array) -> Array:
    return np.abs(np.arctan2(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0], dot(a, b)))


def _on_chord(points_mm: Array, nominal: NominalProfile, site: Index, neighbour: Index) -> tuple[Array, Array]:
    """Left-signed distance to the chord between two samples and its gradient; infinite where there is no neighbour."""
    other = np.where(neighbour >= 0, neighbour, site)
    start = nominal.points_mm[site]
    span, reach = nominal.points_mm[other] - start, points_mm - start
    length2 = np.where(neighbour >= 0, dot(span, span), 1.0)
    share = np.clip(dot(reach, span) / length2, 0.0, 1.0)
    off = reach - share[:, None] * span
    distance = np.hypot(off[:, 0], off[:, 1])
    side = np.where(dot(off, nominal.normal[site]) >= 0, 1.0, -1.0)
    gradient = np.where((distance > 0)[:, None], off * (side / np.where(distance > 0, distance, 1.0))[:, None], nominal.normal[site])
    return np.where(neighbour >= 0, side * distance, np.inf), gradient


def _from_sites(
    points_mm: Array, nominal: NominalProfile, site: Index, faces_none: NDArray[np.bool_], left_mm: Array, gradient: Array
) -> Feet:
    """Complete a projection made at the nearest samples; where the point faces no piece the sample itself is its foot.

    The foot's arc length from the sample is that along the osculating circle.
    """
    foot = points_mm - left_mm[:, None] * gradient
    reach, curvature = foot - nominal.points_mm[site], nominal.curvature[site]
    ahead = dot(reach, nominal.tangent[site])
    bent = np.abs(curvature * ahead) > 1e-9
    turn = np.arctan2(curvature * ahead, 1 - curvature * dot(reach, nominal.normal[site]))
    travel = np.where(bent, turn / np.where(bent, curvature, 1.0), ahead)
    start, end = nominal.curve.domain
    near = Feet(
        parameter=_on_curve(nominal.parameter[site] + travel / nominal.speed[site], start, end, nominal.curve.closed),
        foot_mm=foot,
        distance_mm=left_mm,
        gradient=gradient,
        curvature=curvature,
        station_mm=_on_curve(nominal.station_mm[site] + travel, 0.0, nominal.length_mm, nominal.curve.closed),
        vertex=np.full(len(site), INSIDE, dtype=np.uint8),
    )
    return merged(faces_none, on_vertices(points_mm, site, nominal), near) if faces_none.any() else near


def _on_curve(value: Array, start: float, end: float, closed: bool) -> Array:
    return start + np.mod(value - start, end - start) if closed else np.clip(value, start, end)


_PROJECTIONS: dict[Method, Callable[[Array, NominalProfile], Feet]] = {
    "exact": exact,
    "circle": circle,
    "chord": chord,
    "pcp": pcp,
    "veaw": veaw,
    "inversion": inversion,
}
