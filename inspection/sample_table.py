"""The samples of a nominal profile packed for the compiled methods of the paper, with a search tree for the nearest one."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inspection.curve import NurbsCurve
from inspection.kernels import LEAF
from inspection.voronoi import SitePoles

Array = NDArray[np.float64]
Index = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class SampleTable:
    """Packed tables of n samples for `kernels.project_on_samples`.

    samples  : (n, SAMPLE_WIDTH)
    links    : (n, LINK_WIDTH)
    boxes    : (2 q, 4) binary tree of bounding boxes: node 1 is the root, leaf q + i holds the samples from i LEAF on; low x, y, high x, y
    starts   : (b,) a sample near each of b even steps of the parameter
    domain   : (start, end, length_mm, 1 when closed)
    """

    samples: Array
    links: Index
    boxes: Array
    starts: Index
    domain: Array

    def __post_init__(self) -> None:
        for name in self.__slots__:
            getattr(self, name).setflags(write=False)

    @property
    def flat(self) -> tuple[Array, Index, Array, Index, Array]:
        """The tables as compiled loops take them: one dimension each."""
        return self.samples.reshape(-1), self.links.reshape(-1), self.boxes.reshape(-1), self.starts, self.domain


def pack_samples(
    *,
    points_mm: Array,
    tangent: Array,
    normal: Array,
    curvature: Array,
    parameter: Array,
    station_mm: Array,
    speed: Array,
    poles: SitePoles,
    next_site: Index,
    previous_site: Index,
    twin: Index,
    is_open_end: NDArray[np.bool_],
    curve: NurbsCurve,
) -> SampleTable:
    """Tables of the samples of a nominal profile, whose fields these are."""
    sides = (poles.left, poles.right, poles.left_curvature, poles.right_curvature, poles.edge_left_mm, poles.edge_right_mm)
    samples = np.column_stack([points_mm, tangent, normal, curvature, parameter, station_mm, speed, *sides])
    links = np.column_stack([next_site, previous_site, twin, is_open_end]).astype(np.int64)
    start, end = curve.domain
    order = np.argsort(parameter, kind="stable")
    middles = start + (np.arange(len(parameter)) + 0.5) / len(parameter) * (end - start)
    nearest = np.minimum(np.searchsorted(parameter[order], middles), len(parameter) - 1)
    domain = np.array([start, end, curve.length_mm, float(curve.closed)])
    return SampleTable(samples, links, _boxes(points_mm), order[nearest], domain)


def _boxes(points_mm: Array) -> Array:
    leaves = -(-len(points_mm) // LEAF)
    q = 1 << max(0, (leaves - 1).bit_length())
    boxes = np.full((2 * q, 4), np.inf)
    boxes[:, 2:] = -np.inf
    first = np.arange(0, len(points_mm), LEAF)
    boxes[q : q + leaves, :2] = np.minimum.reduceat(points_mm, first)
    boxes[q : q + leaves, 2:] = np.maximum.reduceat(points_mm, first)
    while q > 1:
        children = boxes[q : 2 * q].reshape(q // 2, 2, 4)
        boxes[q // 2 : q] = np.hstack([children[:, :, :2].min(axis=1), children[:, :, 2:].max(axis=1)])
        q //= 2
    return boxes
