"""The published methods of projection in plain numpy: the reference that the compiled loops are held against."""

import numpy as np
from numpy.typing import NDArray

from inspection.curve import unit_vectors
from inspection.inversion import choose_feet, dot, feet_on_vertices, nearest_sites
from inspection.kernels import Feet
from inspection.kernels.layout import INSIDE
from inspection.nominal import NominalProfile

Array = NDArray[np.float64]
Index = NDArray[np.int64]


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
    return _from_sites(points_mm, nominal, site, faces_none, left, unit_vectors(gradient))


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
    return choose_feet(faces_none, feet_on_vertices(points_mm, site, nominal), near) if faces_none.any() else near


def _on_curve(value: Array, start: float, end: float, closed: bool) -> Array:
    return start + np.mod(value - start, end - start) if closed else np.clip(value, start, end)
