"""Parts of a surface that are out of tolerance: points that lie out, joined where the places that they stand for are neighbours.

A place of the nominal stands for an area, which the points nearest to it share among them; one without a point of its own belongs to
the point nearest to it. So neither dense nor sparse points change how large a defect is.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from inspection.surface.covered_area import groups_of, neighbours_among
from inspection.surface.feet import SurfaceFeet
from inspection.surface.nominal_places import NominalPlaces, with_sides
from inspection.surface.surface_result import Defect

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Truth = NDArray[np.bool_]


def find_defects(
    places: NominalPlaces, feet: SurfaceFeet, judged: Index, is_out: Truth, nearest: Index, near: Truth, middle_mm: float
) -> tuple[Defect, ...]:
    """The parts of the surface out of tolerance, those with the largest excess over the zone first.

    judged   : rows (j,) of the feet that have a verdict; is_out : (j,) which of them are out of tolerance
    nearest  : (n,) which of the judged feet (0 .. j - 1) is nearest to each place; near : (n,) which of these are near enough for that
    """
    out = np.flatnonzero(is_out)
    if not len(out):
        return ()
    place = _place_of(places, feet, judged[out])
    count = _judged_at(places, feet, judged, np.unique(place))
    is_lone = near & (count == 0)  # no point of its own, or none that is out
    is_lone[place] = False
    lone = np.flatnonzero(is_lone & is_out[nearest])
    label = _labels(places, np.unique(np.concatenate([place, lone])))
    shares = np.concatenate([1.0 / count[place], np.ones(len(lone))])
    area = places.each_mm2 * np.bincount(np.concatenate([label[place], label[lone]]), shares)
    rows, part = judged[out], label[place]
    order = np.argsort(part, kind="stable")
    found = [
        _defect(feet, rows[group], area[part[group[0]]], middle_mm) for group in np.split(order, np.flatnonzero(np.diff(part[order])) + 1)
    ]
    return tuple(sorted(found, key=lambda defect: -abs(defect.worst_mm - middle_mm)))


def _place_of(places: NominalPlaces, feet: SurfaceFeet, rows: Index) -> Index:
    """The place nearest to each foot (k,), on its side."""
    tree = cKDTree(with_sides(places.places_mm, places.normals, places.side_mm), compact_nodes=False, balanced_tree=False)
    return np.asarray(tree.query(with_sides(feet.foot_mm[rows], feet.normal[rows], places.side_mm), workers=-1)[1])


def _judged_at(places: NominalPlaces, feet: SurfaceFeet, judged: Index, which: Index) -> Index:
    """How many judged points stand at each of the places (n,) that are asked for, by their numbers (w,); 0 elsewhere."""
    cell_mm = 4 * places.spacing_mm
    low = places.places_mm.min(axis=0) - 2 * cell_mm
    near = np.isin(_cells(feet.foot_mm[judged], low, cell_mm), _around(places.places_mm[which], low, cell_mm))
    at = _place_of(places, feet, judged[near])
    count = np.bincount(at, minlength=len(places))
    asked = np.zeros(len(places), dtype=bool)
    asked[which] = True
    return np.where(asked, count, 0)


def _cells(at_mm: Array, low: Array, cell_mm: float) -> Index:
    """The number (k,) of the cell that each place (k, 3) lies in."""
    x, y, z = np.floor((at_mm - low) / cell_mm).astype(np.int64).T
    return np.asarray((x << 42) + (y << 21) + z)


def _around(at_mm: Array, low: Array, cell_mm: float) -> Index:
    """The numbers of the cells that places (k, 3) lie in, and of those around them."""
    steps = np.stack(np.meshgrid(*[np.array([-1.0, 0.0, 1.0])] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    return np.unique(np.concatenate([_cells(at_mm + cell_mm * step, low, cell_mm) for step in steps]))


def _labels(places: NominalPlaces, which: Index) -> Index:
    """A number (n,) for each of the places asked for, the same for those that hang together; -1 elsewhere."""
    one, other, length = neighbours_among(places, which)
    row = np.full(len(places), -1)
    row[which] = np.arange(len(which))
    inner = row[other] >= 0
    label = np.full(len(places), -1)
    for number, group in enumerate(groups_of((row[one[inner]], row[other[inner]], length[inner]), len(which))):
        label[which[group]] = number
    return label


def _defect(feet: SurfaceFeet, rows: Index, area_mm2: float, middle_mm: float) -> Defect:
    """One part, by the rows (k,) of its points."""
    at, deviation = feet.foot_mm[rows], feet.distance_mm[rows]
    worst = int(np.abs(deviation - middle_mm).argmax())
    centre = int(((at - at.mean(axis=0)) ** 2).sum(axis=1).argmin())
    places = [(float(x), float(y), float(z)) for x, y, z in at[[worst, centre]]]
    return Defect(float(area_mm2), float(deviation[worst]), places[0], places[1], int(feet.face[rows[worst]]), len(rows))
