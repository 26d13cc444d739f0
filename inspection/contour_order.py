"""The measured contour as a walk that does not depend on the order in which its points came.

Points are gathered in small cells, whose means stand for them, so that density does not count either. The shortest tree that joins
the means runs along the contour, since on a sampled curve the nearest neighbours are neighbours on it; its longest path is the walk.
The tree is a part of the Delaunay triangulation (Shamos & Hoey 1975), which keeps the search nearly linear.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import dijkstra, minimum_spanning_tree
from scipy.spatial import Delaunay, QhullError

from inspection.cloud import corners_of

Array = NDArray[np.float64]
Rows = NDArray[np.int64]

_ROUND_STEPS = 1e-9  # of a step: cell means are rounded to it, so that the order of a sum does not show
_SQUEEZED = 1e-6  # points whose box is thinner than this share of its length lie on a line, which has no triangulation


@dataclass(frozen=True, slots=True, eq=False)
class Contour:
    """Points that stand for a scan, whatever the order and the density of its own.

    points_mm  : (k, 2) means of the cells
    weights_mm : (k,) how much of the contour each stands for
    walk       : (w,) the rows in the order in which they lie along the contour; a side branch is not on the walk
    """

    points_mm: Array
    weights_mm: Array
    walk: Rows

    @property
    def walk_mm(self) -> Array:
        """The points (w, 2) of the walk."""
        return self.points_mm[self.walk]


def trace_contour(blocks: Callable[[], Iterable[Array]], step_mm: float) -> Contour:
    """Trace the contour of points through their means in cells of `step_mm`.

    blocks : gives the points piece by piece (k, 2), as often as they are asked for

    The direction of the walk, and where a closed contour is opened, follow from the points alone.
    """
    means = _cell_means(blocks, step_mm)
    first, second = _edges(means).T.astype(np.int32)  # the width that the graph searches of every SciPy take
    lengths = np.hypot(*(means[first] - means[second]).T)
    network = coo_array((lengths, (first, second)), shape=(len(means), len(means))).tocsr()
    tree = minimum_spanning_tree(network)
    ends, share = tree.tocoo(), np.zeros(len(means))
    for side in (ends.row, ends.col):
        np.add.at(share, side, ends.data / 2)
    return Contour(means, share, _longest_path(tree))


def _edges(means: Array) -> Rows:
    """Pairs (e, 2) of neighbours: of the triangulation, or along the line where all points lie on one."""
    spread = np.sqrt(np.maximum(np.linalg.eigvalsh(np.cov(means.T)), 0.0)) if len(means) > 3 else np.zeros(2)
    if spread[0] > _SQUEEZED * spread[1]:
        try:
            corners = Delaunay(means).simplices
        except QhullError:
            pass
        else:
            sides = np.sort(np.vstack([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]]), axis=1).astype(np.int64)
            numbers = np.unique(sides @ [len(means), 1])  # numbers in the order of the pairs, which numpy sorts faster than pairs
            return np.column_stack(np.divmod(numbers, len(means)))
    axis = np.linalg.eigh(np.cov(means.T))[1][:, -1] if len(means) > 1 else np.array([1.0, 0.0])
    order = np.argsort(means @ axis, kind="stable")
    return np.column_stack([order[:-1], order[1:]])


def _cell_means(blocks: Callable[[], Iterable[Array]], step_mm: float) -> Array:
    """The mean of the points in every cell that has any, in the order of the cells."""
    corners = [corners_of(block) for block in blocks() if len(block)]
    low = np.min([corner for corner, _ in corners], axis=0)
    across = int(np.floor((np.max([corner for _, corner in corners], axis=0) - low) / step_mm)[1]) + 1
    keys, sums = (
        np.empty(0, dtype=np.int64),
        np.empty((3, 0)),
    )  # of each cell: number of points, sums of x and y
    for block in blocks():
        cells = np.floor((block - low) / step_mm).astype(np.int64)
        own, which = np.unique(cells[:, 0] * across + cells[:, 1], return_inverse=True)
        grown = np.union1d(keys, own)
        before, place = sums, np.searchsorted(grown, own)[which]
        sums = np.zeros((3, len(grown)))
        sums[:, np.searchsorted(grown, keys)] = before
        for total, values in zip(sums, (np.ones(len(block)), *(block - low).T), strict=True):
            np.add.at(total, place, values)  # one after the other, so that the pieces do not show
        keys = grown
    grain = _ROUND_STEPS * step_mm
    rounded: Array = np.round((sums[1:] / sums[0]).T / grain) * grain + low
    return rounded


def _longest_path(tree: "csr_array[np.float64, tuple[int, int]]") -> NDArray[np.int64]:
    """Nodes of the longest path in a tree: from the node farthest from any one to the node farthest from it."""
    end = int(np.argmax(dijkstra(tree, directed=False, indices=[0])[0]))
    away, before = dijkstra(tree, directed=False, indices=[end], return_predecessors=True)
    path = [int(np.argmax(away[0]))]
    while path[-1] != end:
        path.append(int(before[0, path[-1]]))
    return np.array(path, dtype=np.int64)
