"""Places spread evenly over a nominal surface, each of which stands for the same share of its area, and which of them are near points.

Nearness asks for the same side as well: a point does not measure the other side of a thin wall, nor the face round a sharp edge.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from inspection.surface.feet import NominalSurface

Array = NDArray[np.float64]
Index = NDArray[np.int64]

_SHARE = 8.0  # spacings in the widest gap that counts as measured
_FEWEST, _MOST = 4000, 400_000  # places
_TOLD = 4.0  # spacings in the narrowest gap that can be told
_OTHERS = 0.7  # times as many places of another pattern show how far these are apart
_SIDE = 0.67  # of how near a foot must be: what a difference of 1 between unit normals counts for, so that a right angle is too far
_BETWEEN = 1.1  # for what lies between those


@dataclass(frozen=True, slots=True, eq=False)
class NominalPlaces:
    """Places (n, 3) of a nominal with the outward normals (n, 3) there.

    each_mm2   : the area that each stands for; spacing_mm : the side of a square of that area
    reach_mm   : (n,) how far the places of the surface to which it is the nearest one lie from it at most
    side_mm    : what a difference of 1 between normals counts for as a distance
    """

    places_mm: Array
    normals: Array
    each_mm2: float
    spacing_mm: float
    reach_mm: Array
    side_mm: float

    def __len__(self) -> int:
        return len(self.places_mm)


def finest_gap_mm(nominal: NominalSurface) -> float:
    """The widest place without points that can be told on a surface of this size is not narrower than this."""
    return _TOLD * float(np.sqrt(nominal.area_mm2 / _MOST))


def spread_places(nominal: NominalSurface, gap_max_mm: float) -> NominalPlaces:
    """Places near enough to each other to tell a gap that is too wide."""
    wanted = nominal.area_mm2 * (_SHARE / min(gap_max_mm, nominal.size_mm)) ** 2
    count = int(np.clip(wanted, _FEWEST, _MOST))
    places, normals = nominal.sample(count)
    order = np.lexsort(places.T)  # a cloud gives its points more than once where it has few
    places, normals = places[order], normals[order]
    new = np.append(True, (np.diff(places, axis=0) != 0).any(axis=1))
    places, normals = places[new], normals[new]
    each = nominal.area_mm2 / len(places)
    spacing = float(np.sqrt(each))
    reach = _reach(places, normals, nominal.sample(int(_OTHERS * count)), spacing)
    near = gap_max_mm / 2 - spacing  # no foot farther off measures a place
    return NominalPlaces(places, normals, each, spacing, reach, _SIDE * min(max(near, spacing), nominal.size_mm))


def _reach(places: Array, normals: Array, others: tuple[Array, Array], spacing_mm: float) -> Array:
    """How far (n,) what each place stands for lies from it, by other places of the surface and their normals (k, 3)."""
    tree = cKDTree(with_sides(places, normals, spacing_mm), compact_nodes=False, balanced_tree=False)
    number = np.asarray(tree.query(with_sides(*others, spacing_mm), workers=-1)[1])
    reach = np.full(len(places), spacing_mm)
    np.maximum.at(reach, number, _BETWEEN * np.linalg.norm(others[0] - places[number], axis=1))
    return reach


def with_sides(places_mm: Array, normals: Array, side_mm: float) -> Array:
    """Places (n, 6) whose distances tell the two sides of a wall apart: the normals (n, 3) count as coordinates of their own."""
    return np.concatenate([places_mm, side_mm * normals], axis=1)


def nearest_of(places: NominalPlaces, feet_mm: Array, normals: Array) -> tuple[Array, Index]:
    """How far each place (n,) is from the nearest foot of the same side, infinite where there is none, and its number (n,)."""
    if not len(feet_mm):
        return np.full(len(places), np.inf), np.full(len(places), -1)
    tree = cKDTree(with_sides(feet_mm, normals, places.side_mm), compact_nodes=False, balanced_tree=False)
    distance, number = tree.query(with_sides(places.places_mm, places.normals, places.side_mm), workers=-1)
    return np.asarray(distance), np.asarray(number)
