"""The nearest sample, from which the published methods of projection start, and feet that are samples themselves."""

import numpy as np
from numpy.typing import NDArray

from inspection.kernels import Feet
from inspection.nominal import NominalProfile

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]

INSIDE, CORNER, OPEN_END = 0, 1, 2  # kinds of feet, as `Feet.vertex` holds them


def nearest_sites(points_mm: Array, nominal: NominalProfile) -> tuple[Index, Mask]:
    """Nearest sample (m,) on a piece that the point faces, and whether the point faces none there.

    At a corner the two samples at one place belong to different pieces. The point faces a piece when it lies ahead of its
    beginning or behind its end; facing both (a concave corner) the nearer tangent wins, facing none the corner itself is
    the closest point (the normal cone of a convex corner, or the region beyond an open end).
    """
    site = np.asarray(nominal.tree.query(points_mm)[1], dtype=np.int64)
    twin = nominal.twin[site]
    faced, off = _faced(points_mm, site, nominal)
    twin_faced, twin_off = _faced(points_mm, np.maximum(twin, 0), nominal)
    twin_faced &= twin >= 0
    prefer_twin = twin_faced & (~faced | (twin_off < off))
    return np.where(prefer_twin, twin, site), ~faced & ~twin_faced


def _faced(points_mm: Array, site: Index, nominal: NominalProfile) -> tuple[Mask, Array]:
    """Whether each point lies on the piece's side of its end sample (always true inside a piece), and its offset from the tangent."""
    reach = points_mm - nominal.points_mm[site]
    ahead = dot(reach, nominal.tangent[site])
    faced = ((nominal.previous_site[site] >= 0) | (ahead >= 0)) & ((nominal.next_site[site] >= 0) | (ahead <= 0))
    return faced, np.abs(dot(reach, nominal.normal[site]))


def on_vertices(points_mm: Array, site: Index, nominal: NominalProfile) -> Feet:
    """Projection onto the samples themselves (ends and corners), signed by the sum of the normals that meet there."""
    twin = np.where(nominal.twin[site] >= 0, nominal.twin[site], site)
    bisector = unit(nominal.normal[site] + nominal.normal[twin])
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


def merged(chosen: Mask, if_chosen: Feet, otherwise: Feet) -> Feet:
    """Row by row from one set of feet or the other."""

    def pick(name: str) -> NDArray[np.generic]:
        a, b = getattr(if_chosen, name), getattr(otherwise, name)
        return np.asarray(np.where(chosen[:, None] if a.ndim == 2 else chosen, a, b))

    return Feet(*(pick(name) for name in Feet._fields))  # type: ignore[arg-type]


def dot(a: Array, b: Array) -> Array:
    """Row-wise scalar product (m,); element by element, so that no result depends on how points are batched."""
    return a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1]


def unit(vectors: Array) -> Array:
    """Row-wise unit vectors (m, 2)."""
    return np.asarray(vectors / np.hypot(vectors[:, 0], vectors[:, 1])[:, None])
