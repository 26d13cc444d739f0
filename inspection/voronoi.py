"""The Voronoi diagram of the samples of a profile, reduced to arrays with one row a site.

Algorithm 1, steps 4 to 9 of Hari Ganesh & Samuel (2022): the sites are enclosed in a box so that no Voronoi vertex lies
at infinity; the vertices of a cell farthest from its site on either side of the profile are its poles (Amenta & Bern),
centres of circles that touch the profile there and approximate the medial axis. Beyond the paper: on straight parts a pole
that lies out in the box counts as one at infinity, whatever the size of the box.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

BOX_SCALE = 10.0  # radius of the circle of box sites, in diagonals of the profile: 3 to 100 work alike, 1e4 breaks Qhull (measured)
_BOX_SITES = 8
_SAME_PLACE = 1e-10  # sites closer than this fraction of the diagonal are one site


@dataclass(frozen=True, slots=True, eq=False)
class SitePoles:
    """Poles of n sites, by side of the profile (left of the direction of travel, right of it).

    A pole circle touches its site in the unit direction `left` or `right` with curvature `1 / radius`, so that a pole
    at infinity is curvature 0: the circle is the tangent.

    left, right                     : (n, 2) unit directions from the site to its pole
    left_curvature, right_curvature : (n,) 1/mm
    angle_deg                       : (n,) angle at the site between its two farthest vertices on either side, those of the box
                                      included, as published; 180 in the limit of dense sampling
    edge_left_mm, edge_right_mm     : (n, 2) ends of the Voronoi edge shared with the next site; NaN where there is none
    """

    left: Array
    right: Array
    left_curvature: Array
    right_curvature: Array
    angle_deg: Array
    edge_left_mm: Array
    edge_right_mm: Array

    def __post_init__(self) -> None:
        for name in self.__slots__:
            getattr(self, name).setflags(write=False)


def site_poles(
    sites_mm: Array, normal: Array, next_site: NDArray[np.int64], is_end: NDArray[np.bool_], is_straight: NDArray[np.bool_]
) -> SitePoles:
    """Poles of every site.

    sites_mm  : (n, 2); coinciding sites (both sides of a corner) share one cell
    normal    : (n, 2) unit normals, to the left
    next_site : (n,) index of the neighbour along the profile, -1 where a piece ends
    is_end    : (n,) ends and corners, whose pole directions are plus and minus the normal, whatever their cell says
    is_straight : (n,) sites of straight parts, where a vertex out in the box counts as one at infinity
    """
    from scipy.spatial import Voronoi  # noqa: PLC0415 - it takes a third of a second, and the exact method needs no diagram

    site_of, cells = _distinct_cells(sites_mm)  # (n,), (c, 2)
    diagram = Voronoi(np.vstack([cells, _box_places(cells)]))
    ridges = np.asarray(diagram.ridge_points, dtype=np.int64)  # (r, 2) pairs of cells
    ends = np.asarray(diagram.ridge_vertices, dtype=np.int64)  # (r, 2) vertices, -1 at infinity
    inner = np.all(ends >= 0, axis=1)
    ridges, ends = ridges[inner], ends[inner]
    at_box = np.zeros(len(diagram.vertices), dtype=bool)
    at_box[ends[(ridges >= len(cells)).any(axis=1)]] = True
    left, right, left_radius, right_radius, angle = _poles(sites_mm, normal, site_of, ridges, ends, diagram.vertices, at_box, is_straight)
    left = np.where(is_end[:, None], normal, left)
    right = np.where(is_end[:, None], -normal, right)
    edge_left, edge_right = _shared_edges(sites_mm, normal, next_site, site_of, ridges, ends, diagram.vertices)
    return SitePoles(left, right, _inverse(left_radius), _inverse(right_radius), angle, edge_left, edge_right)


def _distinct_cells(sites_mm: Array) -> tuple[NDArray[np.int64], Array]:
    """Cell of every site (n,), and the places of the cells (c, 2)."""
    from scipy.spatial import cKDTree  # noqa: PLC0415

    grain = _SAME_PLACE * np.hypot(*np.ptp(sites_mm, axis=0))
    owner = np.arange(len(sites_mm))
    pairs = cKDTree(sites_mm).query_pairs(grain, output_type="ndarray")  # (p, 2), smaller index first
    owner[pairs[:, 1]] = pairs[:, 0]
    first, site_of = np.unique(owner, return_inverse=True)
    return np.asarray(site_of), sites_mm[first]


def _box_places(sites_mm: Array) -> Array:
    """Places (8, 2) of the sites that enclose the others."""
    low, high = sites_mm.min(axis=0), sites_mm.max(axis=0)
    turn = 2 * np.pi * np.arange(_BOX_SITES) / _BOX_SITES
    return np.asarray((low + high) / 2 + BOX_SCALE * np.hypot(*(high - low)) * np.column_stack([np.cos(turn), np.sin(turn)]))


def _poles(
    sites_mm: Array,
    normal: Array,
    site_of: NDArray[np.int64],
    ridges: NDArray[np.int64],
    ends: NDArray[np.int64],
    vertices: Array,
    at_box: NDArray[np.bool_],
    is_straight: NDArray[np.bool_],
) -> tuple[Array, Array, Array, Array, Array]:
    """Directions (n, 2) and radii (n,) of the poles on either side, and the angles (n,) of `SitePoles`."""
    n = len(sites_mm)
    cell, vertex = np.repeat(ridges.ravel(), 2), np.repeat(ends, 2, axis=0).ravel()  # every end of every ridge, for both its cells
    start = np.concatenate([[0], np.cumsum(np.bincount(cell, minlength=site_of.max() + 1))])
    by_cell = vertex[np.argsort(cell, kind="stable")]
    counts = np.diff(start)[site_of]  # (n,)
    site = np.repeat(np.arange(n), counts)
    within = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    corner = by_cell[np.repeat(start[site_of], counts) + within]
    reach = vertices[corner] - sites_mm[site]  # (pairs, 2) from site to vertex
    radius = np.hypot(reach[:, 0], reach[:, 1])
    farthest = _farthest_per_site(site, radius, np.ones(len(site), dtype=bool), n)
    opposite = _farthest_per_site(site, radius, (reach * reach[farthest[site]]).sum(axis=1) < 0, n)
    side = (reach * normal[site]).sum(axis=1) > 0
    on_left, on_right = _farthest_per_site(site, radius, side, n), _farthest_per_site(site, radius, ~side, n)
    angle = _angle_deg(reach[farthest], reach[opposite])
    angle[opposite < 0] = 0.0
    left_far = (on_left < 0) | (is_straight & at_box[corner[on_left]])
    right_far = (on_right < 0) | (is_straight & at_box[corner[on_right]])
    left = np.where(left_far[:, None], normal, reach[on_left] / radius[on_left][:, None])
    right = np.where(right_far[:, None], -normal, reach[on_right] / radius[on_right][:, None])
    return left, right, np.where(left_far, np.inf, radius[on_left]), np.where(right_far, np.inf, radius[on_right]), angle


def _farthest_per_site(site: NDArray[np.int64], radius: Array, chosen: NDArray[np.bool_], n: int) -> NDArray[np.int64]:
    """Row of the largest radius among the chosen rows of each site (n,), the first of equal ones; -1 where a site has none.

    site : rises from row to row
    """
    rows = np.flatnonzero(chosen)
    largest = np.full(n, -1.0)
    starts = _first_rows(site[rows])
    if len(starts):
        largest[site[rows[starts]]] = np.maximum.reduceat(radius[rows], starts)
    rows = rows[radius[rows] == largest[site[rows]]]
    rows = rows[_first_rows(site[rows])]
    result = np.full(n, -1)
    result[site[rows]] = rows
    return result


def _first_rows(site: NDArray[np.int64]) -> NDArray[np.int64]:
    """The first row of each site among rows (k,) in which it rises."""
    return np.flatnonzero(np.diff(site, prepend=-1))


def _angle_deg(a: Array, b: Array) -> Array:
    """Angle (n,) between vectors (n, 2), from 0 to 180."""
    return np.asarray(np.degrees(np.abs(np.arctan2(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0], (a * b).sum(axis=1)))))


def _shared_edges(
    sites_mm: Array,
    normal: Array,
    next_site: NDArray[np.int64],
    site_of: NDArray[np.int64],
    ridges: NDArray[np.int64],
    ends: NDArray[np.int64],
    vertices: Array,
) -> tuple[Array, Array]:
    """Left and right end (n, 2) of the Voronoi edge between each site and the next along the profile."""
    cells = site_of.max() + 1 + _BOX_SITES
    key = np.sort(ridges, axis=1) @ np.array([cells, 1])
    order = np.argsort(key)
    pair = np.sort(np.column_stack([site_of, site_of[next_site]]), axis=1) @ np.array([cells, 1])
    place = np.minimum(np.searchsorted(key[order], pair), len(key) - 1)
    ridge = order[place]
    missing = (next_site < 0) | (key[ridge] != pair)
    first, second = vertices[ends[ridge, 0]], vertices[ends[ridge, 1]]
    along = (first - second) * normal
    first_is_left = along.sum(axis=1) > 0
    edge_left = np.where(first_is_left[:, None], first, second)
    edge_right = np.where(first_is_left[:, None], second, first)
    edge_left[missing] = np.nan
    edge_right[missing] = np.nan
    return edge_left, edge_right


def _inverse(radius: Array) -> Array:
    """Curvature (n,) of circles; that of an infinite one is 0."""
    return np.asarray(1.0 / radius)
