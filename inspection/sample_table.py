"""The samples of a nominal profile: as arrays, and packed for the compiled methods that look at samples only."""

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from inspection.box_tree import box_tree
from inspection.cache_lines import align
from inspection.curve import NurbsCurve
from inspection.first_use import OnFirstUse
from inspection.kernels.layout import LEAF, SAMPLE_COLUMNS, SAMPLE_WIDTH
from inspection.voronoi import SitePoles

Array = NDArray[np.float64]
Index = NDArray[np.int64]


_WITHIN = 0.999  # of a Voronoi cell: its corners are known to round-off only


@dataclass(frozen=True, slots=True, eq=False)
class ProfileSamples:
    """n samples of a curve with their neighbours and, made when they are first asked for, their poles.

    parameter       : (n,) curve parameter of each sample, rising within a piece
    points_mm       : (n, 2)
    tangent, normal : (n, 2) unit vectors; the normal is the tangent turned left
    curvature       : (n,) 1/mm, positive where the curve turns left
    station_mm      : (n,) arc length from the start of the curve
    speed           : (n,) mm of arc length per unit of the parameter
    next_site, previous_site : (n,) neighbours within the piece (around the seam where that is smooth), -1 at its ends
    twin            : (n,) the sample of the adjoining piece at the same corner, -1 elsewhere
    is_open_end     : (n,) the two ends of an open curve
    diagram         : the poles to be, for `poles`
    """

    parameter: Array
    points_mm: Array
    tangent: Array
    normal: Array
    curvature: Array
    station_mm: Array
    speed: Array
    next_site: Index
    previous_site: Index
    twin: Index
    is_open_end: NDArray[np.bool_]
    diagram: OnFirstUse[SitePoles]

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if isinstance(value, np.ndarray):
                value.setflags(write=False)

    def __len__(self) -> int:
        return len(self.parameter)

    @property
    def poles(self) -> SitePoles:
        """Left and right poles of every sample, from the Voronoi diagram of all of them: the paper's methods need them, no other does."""
        return self.diagram.value


@dataclass(frozen=True, slots=True, eq=False)
class SampleTable:
    """Packed tables of n samples for `kernels.project_on_samples`.

    samples  : (n, SAMPLE_WIDTH)
    links    : (n, LINK_WIDTH)
    boxes    : (2 q, 4) search tree over the samples, see `box_tree`; its leaf i holds the samples from i LEAF on
    starts   : (b,) a sample near each of b even steps of the parameter
    domain   : (start, end, length_mm, 1 when closed)
    cells    : (n, CELL_WIDTH) places of the samples, and what proves one the nearest to a point
    neighbours : (n, 2) the next sample and the one before, or the sample itself where there is none
    """

    samples: Array
    links: Index
    boxes: Array
    starts: Index
    domain: Array
    cells: Array
    neighbours: NDArray[np.int32]

    def __post_init__(self) -> None:
        for name in self.__slots__:
            getattr(self, name).setflags(write=False)

    @property
    def flat(self) -> tuple[Array, Index, Array, Index, Array, Array, NDArray[np.int32]]:
        """The tables as compiled loops take them, with one dimension each."""
        tree = self.samples.reshape(-1), self.links.reshape(-1), self.boxes.reshape(-1), self.starts, self.domain
        return *tree, self.cells.reshape(-1), self.neighbours.reshape(-1)


def pack_samples(samples: ProfileSamples, curve: NurbsCurve) -> SampleTable:
    """Tables of the samples of a curve."""
    s, poles, u = samples, samples.poles, samples.parameter
    sides = (poles.left, poles.right, poles.left_curvature, poles.right_curvature, poles.edge_left_mm, poles.edge_right_mm)
    rows = np.zeros((len(u), SAMPLE_WIDTH))
    rows[:, :SAMPLE_COLUMNS] = np.column_stack([s.points_mm, s.tangent, s.normal, s.curvature, s.parameter, s.station_mm, s.speed, *sides])
    links = np.column_stack([s.next_site, s.previous_site, s.twin, s.is_open_end]).astype(np.int64)
    start, end = curve.domain
    order = np.argsort(u, kind="stable")
    middles = start + (np.arange(len(u)) + 0.5) / len(u) * (end - start)
    nearest = np.minimum(np.searchsorted(u[order], middles), len(u) - 1)
    domain = np.array([start, end, curve.length_mm, float(curve.closed)])
    first = np.arange(0, len(u), LEAF)
    boxes = np.hstack([np.minimum.reduceat(s.points_mm, first), np.maximum.reduceat(s.points_mm, first)])
    itself = np.arange(len(u))
    neighbours = np.column_stack([np.where(link >= 0, link, itself) for link in (s.next_site, s.previous_site)]).astype(np.int32)
    return SampleTable(align(rows), links, box_tree(boxes), order[nearest], domain, align(_cells(s)), neighbours)


def _cells(s: ProfileSamples) -> Array:
    """Places of the samples, and the far edges of their Voronoi cells as far as these are certain.

    A cell is convex and holds the edges that it shares with the neighbours along the curve, so it holds what lies between their ends.
    It is not certain where there is no neighbour, at a corner, where there is no such edge (NaN), and where an edge does not reach to
    both sides of the sample.
    """
    earlier, within = s.previous_site, (s.previous_site >= 0) & (s.next_site >= 0) & (s.twin < 0)
    sides = []
    for ends, sign in ((s.poles.edge_left_mm, 1.0), (s.poles.edge_right_mm, -1.0)):
        first, last = _WITHIN * (ends[earlier] - s.points_mm), _WITHIN * (ends - s.points_mm)
        reach = sign * np.array([(first * s.normal).sum(axis=1), (last * s.normal).sum(axis=1)])
        x, y = sign * (last - first).T
        far = x * first[:, 1] - y * first[:, 0]
        certain = within & (reach > 0).all(axis=0) & np.isfinite(x + y + far)
        sides += [np.where(certain, x, 0.0), np.where(certain, y, 0.0), np.where(certain, far, -np.inf)]
    return np.column_stack([s.points_mm, *sides])
