"""How much of a surface was measured, and which parts of it were not.

What no point is near was not seen. A place counts as measured where a judged point lies within half of the widest gap that is allowed,
so only the places of points decide, never their density: a further point never lowers the coverage, a lost one never raises it.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components, dijkstra
from scipy.spatial import cKDTree

from inspection.surface.feet import NominalSurface
from inspection.surface.nominal_places import NominalPlaces, with_sides
from inspection.surface.surface_result import Unmeasured

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Ways = tuple[Index, Index, Array]  # one end (e,), the other end (e,), and the length (e,) of each

_REACH = 2.5  # spacings within which two places are neighbours; a right angle between their normals counts for more
_NEIGHBOURS = 12


@dataclass(frozen=True, slots=True, eq=False)
class CoveredArea:
    """What of the area was measured.

    coverage   : share of the area
    unmeasured : its parts that were not, the largest first
    gap_mm     : the diameter of the widest place without points
    measured   : (n,) whether each place of the nominal was measured
    """

    coverage: float
    unmeasured: tuple[Unmeasured, ...]
    gap_mm: float
    measured: NDArray[np.bool_]


def measure_area(nominal: NominalSurface, places: NominalPlaces, distance_mm: Array, gap_max_mm: float) -> CoveredArea:
    """What was measured by points that are so far (n,) from places: what lies between two places may be farther off, by their reach."""
    away = distance_mm + places.reach_mm
    measured = 2 * away <= gap_max_mm
    unmeasured = _parts(nominal, places, away, measured)
    gap = max([2 * float(away[measured].max(initial=0.0)), *(part.width_mm for part in unmeasured)])
    return CoveredArea(float(np.count_nonzero(measured) / len(places)), unmeasured, gap, measured)


def neighbours_among(places: NominalPlaces, which: Index) -> Ways:
    """The ways from the places of these numbers (k,) to those next to them, on the same side."""
    reach = _REACH * places.spacing_mm
    tree = cKDTree(with_sides(places.places_mm, places.normals, reach), compact_nodes=False, balanced_tree=False)
    found = tree.query(tree.data[which], k=min(_NEIGHBOURS, len(places)), distance_upper_bound=reach, workers=-1)
    distance, other = np.asarray(found[0]), np.asarray(found[1])
    one = np.repeat(which, other.shape[1]).reshape(other.shape)
    near = np.isfinite(distance) & (other != one)
    return one[near], other[near], distance[near]


def _parts(nominal: NominalSurface, places: NominalPlaces, away_mm: Array, measured: NDArray[np.bool_]) -> tuple[Unmeasured, ...]:
    """What was not measured, in parts that hang together."""
    which = np.flatnonzero(~measured)
    if not len(which):
        return ()
    one, other, length = neighbours_among(places, which)
    row = np.full(len(places), -1)
    row[which] = np.arange(len(which))
    inner = ~measured[other]
    ways = row[one[inner]], row[other[inner]], length[inner]
    inward = _inward(ways, row[one[~inner]], away_mm[which])
    found = [_middle_and_width(places, which[rows], inward[rows]) for rows in groups_of(ways, len(which))]
    centres = places.places_mm[[middle for middle, _, _ in found]]
    faces = nominal.project(centres).face.tolist()
    parts = [
        Unmeasured(count * places.each_mm2, (x, y, z), on, width)
        for (x, y, z), on, (_, count, width) in zip(centres.tolist(), faces, found, strict=True)
    ]
    return tuple(sorted(parts, key=lambda part: -part.area_mm2))


def groups_of(ways: Ways, count: int) -> list[Index]:
    """The numbers (k,) of each group among so many things that hang together by ways between them, the group of the first thing first."""
    one, other, length = ways
    _, label = connected_components(coo_array((length, (one, other)), shape=(count, count)).tocsr(), directed=False)
    order = np.argsort(label, kind="stable")
    return np.split(order, np.flatnonzero(np.diff(label[order])) + 1)


def _inward(ways: Ways, border: Index, away_mm: Array) -> Array:
    """How far each unmeasured place (u,) is from the nearest point on the way along the surface; infinite where no way leads there."""
    border, u = np.unique(border), len(away_mm)
    one, other, length = ways
    ends = np.concatenate([one, np.full(len(border), u)]), np.concatenate([other, border])  # the points stand at the end of the numbers
    graph = coo_array((np.concatenate([length, away_mm[border]]), ends), shape=(u + 1, u + 1)).tocsr()
    return np.asarray(dijkstra(graph, directed=False, indices=np.array([u])))[0, :u]


def _middle_and_width(places: NominalPlaces, numbers: Index, inward_mm: Array) -> tuple[int, int, float]:
    """The middle place of one part, how many places it has, and its width.

    It is as wide as twice the way in to its innermost place, or as the whole of it where no way leads in.
    """
    if np.isfinite(inward_mm).all():
        return int(numbers[inward_mm.argmax()]), len(numbers), 2 * float(inward_mm.max())
    at = places.places_mm[numbers]
    across = float(np.linalg.norm(np.ptp(at, axis=0))) + 2 * places.spacing_mm
    return int(numbers[((at - at.mean(axis=0)) ** 2).sum(axis=1).argmin()]), len(numbers), across
