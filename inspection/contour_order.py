"""The measured contour as a walk that does not depend on the order in which its points came.

Points are gathered in small cells, whose means stand for them, so that density does not count either. The shortest tree that joins
the means runs along the contour, since on a sampled curve the nearest neighbours are neighbours on it; its longest path is the walk.
The tree is a part of the Delaunay triangulation (Shamos & Hoey 1975), which keeps the search nearly linear; over few points it is grown
without (Prim 1957), which takes no longer and needs nothing of scipy. Where several trees are as short, the triangulation decides.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from inspection.cloud import corners_of
from inspection.kernels import GrownTree, shortest_tree

if TYPE_CHECKING:
    from scipy.sparse import csr_array

Array = NDArray[np.float64]
Rows = NDArray[np.int64]

_FEW = 4096  # points: to look at all pairs of more takes longer than their triangulation
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
    tree = _tree_of(means)
    share = np.zeros(len(means))
    for side in (tree.first, tree.second):
        np.add.at(share, side, tree.length_mm / 2)
    return Contour(means, share, tree.longest_path)


class _Tree(NamedTuple):
    """The shortest tree over points: its edges (e,) in the order of their ends, and the nodes (w,) of its longest path."""

    first: Rows
    second: Rows
    length_mm: Array
    longest_path: Rows


def _tree_of(means: Array) -> _Tree:
    """The shortest tree: grown over all pairs of points where these are few and it is the only one, else of neighbours."""
    lie_on_line = _lie_on_line(means)
    grown = shortest_tree(means) if len(means) <= _FEW and not lie_on_line else None
    return _tree_of_neighbours(means, lie_on_line) if grown is None else _tree_that_grew(means, grown)


def _lie_on_line(means: Array) -> bool:
    spread = np.sqrt(np.maximum(np.linalg.eigvalsh(np.cov(means.T)), 0.0)) if len(means) > 3 else np.zeros(2)
    return not spread[0] > _SQUEEZED * spread[1]


def _tree_that_grew(means: Array, grown: GrownTree) -> _Tree:
    child = grown.joined[1:]
    pairs = np.sort(np.column_stack([grown.parent[child], child]), axis=1)
    first, second = pairs[np.lexsort(pairs.T[::-1])].T
    length = np.hypot(*(means - means[grown.parent]).T)  # (n,) from each point to its parent
    return _Tree(first, second, np.hypot(*(means[first] - means[second]).T), _longest_path_of(grown, length))


def _longest_path_of(grown: GrownTree, length: Array) -> Rows:
    """Nodes of the longest path: from the node farthest from any one to the node farthest from it."""
    parent, to_parent, joined = grown.parent.tolist(), length.tolist(), grown.joined.tolist()
    away = [0.0] * len(parent)
    for node in joined[1:]:
        away[node] = away[parent[node]] + to_parent[node]
    end = node = int(np.argmax(away))
    away, before = [-1.0] * len(parent), list(parent)
    away[end] = 0.0
    while parent[node] >= 0:  # from the end up to where the tree began, every node is reached from the one below
        before[parent[node]], away[parent[node]] = node, away[node] + to_parent[node]
        node = parent[node]
    for node in joined:
        if away[node] < 0:
            away[node] = away[parent[node]] + to_parent[node]
    path = [int(np.argmax(away))]
    while path[-1] != end:
        path.append(before[path[-1]])
    return np.array(path, dtype=np.int64)


def _tree_of_neighbours(means: Array, lie_on_line: bool) -> _Tree:
    """The tree as a part of the Delaunay triangulation."""
    from scipy.sparse import coo_array  # noqa: PLC0415 - together they take a third of a second, and the points are few as a rule
    from scipy.sparse.csgraph import minimum_spanning_tree  # noqa: PLC0415

    first, second = _edges(means, lie_on_line).T.astype(np.int32)  # the width that the graph searches of every SciPy take
    lengths = np.hypot(*(means[first] - means[second]).T)
    tree = minimum_spanning_tree(coo_array((lengths, (first, second)), shape=(len(means), len(means))).tocsr())
    ends = tree.tocoo()
    return _Tree(ends.row.astype(np.int64), ends.col.astype(np.int64), ends.data, _longest_path(tree))


def _edges(means: Array, lie_on_line: bool) -> Rows:
    """Pairs (e, 2) of neighbours: of the triangulation, or along the line where all points lie on one."""
    from scipy.spatial import Delaunay, QhullError  # noqa: PLC0415

    if not lie_on_line:
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
        cell = cells[:, 0] * across + cells[:, 1]
        begins = np.flatnonzero(np.diff(cell, prepend=-1))  # where points in the order of a scan leave one cell for the next
        own, which = np.unique(cell[begins], return_inverse=True)
        grown = np.union1d(keys, own)
        before, place = sums, np.repeat(np.searchsorted(grown, own)[which], np.diff(begins, append=len(cell)))
        sums = np.zeros((3, len(grown)))
        sums[:, np.searchsorted(grown, keys)] = before
        for total, values in zip(sums, (np.ones(len(block)), *(block - low).T), strict=True):
            np.add.at(total, place, values)  # one after the other, so that the pieces do not show
        keys = grown
    grain = _ROUND_STEPS * step_mm
    rounded: Array = np.round((sums[1:] / sums[0]).T / grain) * grain + low
    return rounded


def _longest_path(tree: "csr_array[np.float64, tuple[int, int]]") -> Rows:
    """Nodes of the longest path, see `_longest_path_of`, in a tree of neighbours."""
    from scipy.sparse.csgraph import dijkstra  # noqa: PLC0415

    end = int(np.argmax(dijkstra(tree, directed=False, indices=[0])[0]))
    away, before = dijkstra(tree, directed=False, indices=[end], return_predecessors=True)
    path = [int(np.argmax(away[0]))]
    while path[-1] != end:
        path.append(int(before[0, path[-1]]))
    return np.array(path, dtype=np.int64)
