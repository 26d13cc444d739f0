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


def measure_area(places: NominalPlaces, distance_mm: Array, gap_max_mm: float) -> CoveredArea:
    """What was measured by points that are so far (n,) from places: between two places one may be farther off, by their spacing at most."""
    measured = 2 * (distance_mm + places.spacing_mm) <= gap_max_mm
    unmeasured = _parts(places, distance_mm, measured)
    seen = float(distance_mm[measured].max(initial=0.0)) + places.spacing_mm
    gap = max([2 * seen, *(part.width_mm for part in unmeasured)])
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


def _parts(places: NominalPlaces, distance_mm: Array, measured: NDArray[np.bool_]) -> tuple[Unmeasured, ...]:
    """What was not measured, in parts that hang together."""
    which = np.flatnonzero(~measured)
    if not len(which):
        return ()
    one, other, length = neighbours_among(places, which)
    row = np.full(len(places), -1)
    row[which] = np.arange(len(which))
    inner = ~measured[other]
    ways = row[one[inner]], row[other[inner]], length[inner]
    inward = _inward(ways, row[one[~inner]], distance_mm[which])
    parts = [_part(places, which[rows], inward[rows]) for rows in groups_of(ways, len(which))]
    return tuple(sorted(parts, key=lambda part: -part.area_mm2))


def groups_of(ways: Ways, count: int) -> list[Index]:
    """The numbers (k,) of each group among so many things that hang together by ways between them, the group of the first thing first."""
    one, other, length = ways
    _, label = connected_components(coo_array((length, (one, other)), shape=(count, count)).tocsr(), directed=False)
    order = np.argsort(label, kind="stable")
    return np.split(order, np.flatnonzero(np.diff(label[order])) + 1)


def _inward(ways: Ways, border: Index, distance_mm: Array) -> Array:
    """How far each unmeasured place (u,) is from the nearest point on the way along the surface; infinite where no way leads there."""
    border, u = np.unique(border), len(distance_mm)
    one, other, length = ways
    ends = np.concatenate([one, np.full(len(border), u)]), np.concatenate([other, border])  # the points stand at the end of the numbers
    graph = coo_array((np.concatenate([length, distance_mm[border]]), ends), shape=(u + 1, u + 1)).tocsr()
    return np.asarray(dijkstra(graph, indices=np.array([u])))[0, :u]


def _part(places: NominalPlaces, numbers: Index, inward_mm: Array) -> Unmeasured:
    """One part: as wide as twice the way in to its innermost place, or as the whole of it where no way leads in."""
    at = places.places_mm[numbers]
    across = float(np.linalg.norm(np.ptp(at, axis=0))) + 2 * places.spacing_mm
    if np.isfinite(inward_mm).all():
        middle, width = int(inward_mm.argmax()), 2 * (float(inward_mm.max()) + places.spacing_mm)
    else:
        middle, width = int(((at - at.mean(axis=0)) ** 2).sum(axis=1).argmin()), across
    x, y, z = at[middle].tolist()
    return Unmeasured(len(numbers) * places.each_mm2, (x, y, z), int(places.face[numbers[middle]]), width)
