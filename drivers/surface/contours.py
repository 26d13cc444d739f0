"""Loose segments of many sections to ordered contours: welded, chained, told apart, and nothing closed in silence.

All sections of a batch are chained at once, by array operations and three passes of scipy's compiled graph routines.
Where more than two segments meet (a branch) the place is reported, and the lines go on as branches.py says; where a chain ends
(a gap) it stays open. Which closed chains are holes, nesting.py tells.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components, depth_first_order
from scipy.spatial import KDTree

from drivers.surface.branches import ends_that_go_on
from drivers.surface.nesting import nest

_ROUNDED = 4.0  # steps of float32, in which surfaces are stored: shells that touch may reach so far into each other by rounding
_OUTLINE = 1.5  # of the part's length: a noisy outline is no longer
_DUST_SHARE = 0.05  # of the longest piece; specks of a few voxels and the shells that noise makes stay well below


@dataclass(frozen=True, slots=True, eq=False)
class Chain:
    """One ordered line of points in a section.

    section_mm : (m, 2); a closed one does not repeat its first point. Closed outer contours run counter-clockwise, holes
                 clockwise; open chains have no sense of direction.
    hole       : closed, inside an odd number of other closed contours, and crossing none
    length_mm  : with the closing piece, where it is closed
    """

    section_mm: NDArray[np.float64]
    closed: bool
    hole: bool
    length_mm: float


@dataclass(frozen=True, slots=True, eq=False)
class ChainedSection:
    """What the segments of one section make.

    chains               : longest first, each at least as long as the limit
    set_aside_mm         : lengths of the closed and open pieces below the limit (dust, noise shells), longest first
    set_aside_open       : how many of them are open
    branches_mm          : (b, 2) where more than two segments meet
    overlaps_mm          : (k, 2) one place for each pair of closed chains that cross or coincide: neither is a hole
    zero_length, repeated : segments left out because they were shorter than the weld, or there twice
    """

    chains: tuple[Chain, ...]
    set_aside_mm: NDArray[np.float64]
    set_aside_open: int
    branches_mm: NDArray[np.float64]
    overlaps_mm: NDArray[np.float64]
    zero_length: int
    repeated: int


@dataclass(frozen=True, slots=True, eq=False)
class _Graph:
    """nodes_mm (v, 2), plane (v,) of each node, edges (e, 2) node pairs; every node has one or two edges."""

    nodes_mm: NDArray[np.float64]
    plane: NDArray[np.intp]
    edges: NDArray[np.intp]


def chain_sections(
    segments_mm: NDArray[np.float64],
    plane: NDArray[np.intp],
    planes: int,
    weld_mm: float,
    shortest_mm: float | None,
    part_mm: float = np.inf,
) -> list[ChainedSection]:
    """Chain segments (s, 2, 2) into one result for each section; `plane` (s,) tells to which section a segment belongs.

    `shortest_mm` is the length below which a piece is set aside; None takes 5 % of the section's longest piece, but no more than of
    an outline half as long again as that of the part, `part_mm`: what is scanned with a part may be as long as it likes.
    """
    nodes_mm, plane_of, ends = _weld(segments_mm, plane, weld_mm)
    moved = ends[:, 0] != ends[:, 1]
    edges = ends if moved.all() else ends[moved]
    degree = np.bincount(edges.ravel(), minlength=len(nodes_mm))
    if np.any(degree > 2):  # what comes twice shows as a branch, or as two nodes and nothing else (left out in _order)
        edges = _drop_repeats(edges, len(nodes_mm))
        degree = np.bincount(edges.ravel(), minlength=len(nodes_mm))
    if np.any(degree == 1):
        edges = _drop_repeats(_join_ends(nodes_mm, plane_of, edges, weld_mm), len(nodes_mm))
        degree = np.bincount(edges.ravel(), minlength=len(nodes_mm))
    branches = np.flatnonzero(degree > 2)
    pieces = _order(_split_branches(_Graph(nodes_mm, plane_of, edges), degree), planes, shortest_mm, _OUTLINE * part_mm)
    zero = np.bincount(plane[~moved], minlength=planes)
    kept = np.bincount(plane_of[edges[:, 0]], minlength=planes)
    repeated = np.bincount(plane[moved], minlength=planes) - kept + np.bincount(pieces.doubled_plane, minlength=planes)
    tie_mm = max(weld_mm, _ROUNDED * float(np.spacing(np.float32(np.abs(nodes_mm).max(initial=0.0)))))
    nested = [_nest([(nodes, closed) for at, nodes, closed in pieces.kept if at == index], tie_mm) for index in range(planes)]
    return [
        ChainedSection(
            chains=chains,
            set_aside_mm=np.sort(pieces.aside_mm[pieces.aside_plane == index])[::-1],
            set_aside_open=int(np.count_nonzero(pieces.aside_open[pieces.aside_plane == index])),
            branches_mm=nodes_mm[branches[plane_of[branches] == index]],
            overlaps_mm=overlaps_mm,
            zero_length=int(zero[index]),
            repeated=int(repeated[index]),
        )
        for index, (chains, overlaps_mm) in enumerate(nested)
    ]


def _weld(
    segments_mm: NDArray[np.float64], plane: NDArray[np.intp], weld_mm: float
) -> tuple[NDArray[np.float64], NDArray[np.intp], NDArray[np.intp]]:
    """Make one node of all ends in one cell of a `weld_mm` grid; return nodes (v, 2), their sections (v,), segments as pairs (s, 2)."""
    points = segments_mm.reshape(-1, 2)
    cells = np.rint(points / weld_mm).astype(np.int64)
    sections = np.repeat(plane, 2)
    # One number per cell: sorting it is many times faster than sorting rows. Wrap-around is wanted; collisions are looked for.
    with np.errstate(over="ignore"):
        key = (cells[:, 0] * np.int64(-7046029254386353131) + cells[:, 1]) * np.int64(-4417276706812531889) + sections
    order = np.argsort(key)
    new = np.empty(len(key), dtype=bool)
    new[:1] = True
    np.not_equal(key[order[1:]], key[order[:-1]], out=new[1:])
    node = np.empty(len(key), dtype=np.intp)
    node[order] = np.cumsum(new) - 1
    first = order[new]
    cell = np.take(cells, first, axis=0)  # rows: np.take is eight times faster than indexing
    if np.any(np.take(cell, node, axis=0) != cells) or np.any(sections[first][node] != sections):
        _, first, node = np.unique(np.column_stack([cells, sections]), axis=0, return_index=True, return_inverse=True)
    # The mean, not any one of them: two cutters that differ by rounding then differ by no more than that.
    nodes_mm = np.column_stack([np.bincount(node, points[:, axis]) for axis in range(2)]) / np.bincount(node)[:, None]
    return nodes_mm, sections[first], node.reshape(-1, 2)


def _drop_repeats(ends: NDArray[np.intp], nodes: int) -> NDArray[np.intp]:
    """Take every node pair once, (e, 2)."""
    key = np.unique(ends.min(axis=1) * nodes + ends.max(axis=1))
    return np.column_stack(np.divmod(key, max(nodes, 1)))


def _join_ends(nodes_mm: NDArray[np.float64], plane: NDArray[np.intp], edges: NDArray[np.intp], weld_mm: float) -> NDArray[np.intp]:
    """Join loose ends no farther apart than `weld_mm` that fell into neighbouring cells of the grid."""
    loose = np.flatnonzero(np.bincount(edges.ravel(), minlength=len(nodes_mm)) == 1)
    apart = 10.0 * weld_mm + 2.0 * np.abs(nodes_mm).max()  # no distance within a section reaches the next one
    near = KDTree(np.column_stack([nodes_mm[loose], apart * plane[loose]])).query_pairs(weld_mm, output_type="ndarray")
    target = np.arange(len(nodes_mm))
    target[loose[near[:, 1]]] = loose[near[:, 0]]
    joined: NDArray[np.intp] = target[edges]
    return np.asarray(joined[joined[:, 0] != joined[:, 1]])


def _split_branches(graph: _Graph, degree: NDArray[np.intp]) -> _Graph:
    """Give every edge that ends in a branch its own copy of the node, and one copy to two that go on: only lines and rings remain."""
    at = np.flatnonzero(degree[graph.edges.ravel()] > 2)
    if not len(at):
        return graph
    ends = graph.edges.flatten()
    old, copies = ends[at], len(graph.nodes_mm) + np.arange(len(at))
    direction = graph.nodes_mm[ends[at ^ 1]] - graph.nodes_mm[old]  # at ^ 1 is the other end of the same edge
    ends[at] = copies
    _, label = connected_components(_adjacency(ends.reshape(-1, 2), len(graph.nodes_mm) + len(at)), directed=False)
    for one, other in ends_that_go_on(old, label[copies].astype(np.intp), direction):
        ends[at[other]] = copies[one]
    nodes_mm = np.concatenate([graph.nodes_mm, graph.nodes_mm[old]])
    return _Graph(nodes_mm, np.concatenate([graph.plane, graph.plane[old]]), ends.reshape(-1, 2))


@dataclass(frozen=True, slots=True, eq=False)
class _Pieces:
    """kept: (section, (m, 2) points in order, closed); aside: length, section and openness of every piece below the limit.

    doubled_plane: the section of every piece that is one segment, twice.
    """

    kept: list[tuple[int, NDArray[np.float64], bool]]
    aside_mm: NDArray[np.float64]
    aside_plane: NDArray[np.intp]
    aside_open: NDArray[np.bool_]
    doubled_plane: NDArray[np.intp]


def _order(graph: _Graph, planes: int, shortest_mm: float | None, most_mm: float) -> _Pieces:
    """Sort the lines and rings by length against the limit and walk those that are kept."""
    v, edges = len(graph.nodes_mm), graph.edges
    count, label = connected_components(_adjacency(edges, v), directed=False)
    edge_label, lengths = label[edges[:, 0]], _distances(*(np.take(graph.nodes_mm, edges[:, end], axis=0) for end in range(2)))
    length = np.bincount(edge_label, lengths, count).astype(np.float64)  # bincount of nothing gives integers
    nodes_in, edges_in = np.bincount(label, minlength=count), np.bincount(edge_label, minlength=count)
    doubled = (nodes_in == 2) & (edges_in == 2)
    length[doubled] *= 0.5
    ring = (edges_in == nodes_in) & ~doubled
    section = np.zeros(count, dtype=np.intp)
    section[label] = graph.plane
    limit = np.zeros(planes)
    np.maximum.at(limit, section, length)
    limit = np.minimum(limit, most_mm) * _DUST_SHARE if shortest_mm is None else np.full(planes, shortest_mm)
    there = edges_in > 0  # false for what zero-length segments leave behind
    keep = there & (length >= limit[section])
    aside = there & ~keep
    kept = []
    for walk in _walk(graph, label, keep):
        piece = label[walk[0]]
        kept.append((int(section[piece]), np.take(graph.nodes_mm, walk, axis=0), bool(ring[piece])))
    return _Pieces(kept, length[aside], section[aside], ~ring[aside], section[doubled])


def _distances(first_mm: NDArray[np.float64], second_mm: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.hypot(first_mm[:, 0] - second_mm[:, 0], first_mm[:, 1] - second_mm[:, 1])


def _adjacency(edges: NDArray[np.intp], nodes: int) -> coo_array:
    return coo_array((np.ones(len(edges)), (edges[:, 0].astype(np.int32), edges[:, 1].astype(np.int32))), shape=(nodes, nodes))


def _walk(graph: _Graph, label: NDArray[np.int32], keep: NDArray[np.bool_]) -> list[NDArray[np.intp]]:
    """Return the nodes of each kept piece in order, by one depth-first walk from a root that is tied to an end of each, or to any node."""
    v, edges = len(graph.nodes_mm), graph.edges
    start = np.full(len(keep), -1, dtype=np.int32)
    start[label] = np.arange(v)
    ends = np.flatnonzero(np.bincount(edges.ravel(), minlength=v) == 1)
    start[label[ends]] = ends
    start = start[keep]
    if not len(start):
        return []
    rows = np.concatenate([edges[:, 0], edges[:, 1], np.full(len(start), v)], dtype=np.int32, casting="same_kind")
    columns = np.concatenate([edges[:, 1], edges[:, 0], start], dtype=np.int32, casting="same_kind")
    linked = coo_array((np.ones(len(rows)), (rows, columns)), shape=(v + 1, v + 1)).tocsr()
    walk = depth_first_order(linked, v, directed=True, return_predecessors=False)[1:]
    return np.split(walk, np.flatnonzero(np.diff(label[walk])) + 1)


def _nest(pieces: list[tuple[NDArray[np.float64], bool]], tie_mm: float) -> tuple[tuple[Chain, ...], NDArray[np.float64]]:
    """Tell holes from outer contours, turn each the agreed way round; return them longest first, and where they overlap (k, 2)."""
    rings = [nodes for nodes, closed in pieces if closed]
    nesting = nest(rings, tie_mm)
    chains = [_ring(nodes, hole) for nodes, hole in zip(rings, nesting.hole.tolist(), strict=True)]
    chains += [_line(nodes) for nodes, closed in pieces if not closed]
    return tuple(sorted(chains, key=lambda chain: -chain.length_mm)), nesting.overlaps_mm


def _ring(nodes: NDArray[np.float64], hole: bool) -> Chain:
    """Turn a ring the agreed way round, from its largest x: the result does not depend on the order of the triangles."""
    x, y = (nodes - nodes[0]).T
    area = 0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))
    if (area > 0) == hole:
        nodes = nodes[::-1]
    farthest = np.flatnonzero(nodes[:, 0] == nodes[:, 0].max())
    nodes = np.roll(nodes, -farthest[np.argmin(nodes[farthest, 1])], axis=0)
    return Chain(nodes, True, hole, float(_distances(nodes, np.roll(nodes, -1, axis=0)).sum()))


def _line(nodes: NDArray[np.float64]) -> Chain:
    """Start a line at the end with the larger x."""
    nodes = nodes[::-1].copy() if tuple(nodes[0]) < tuple(nodes[-1]) else nodes
    return Chain(nodes, False, False, float(_distances(nodes[:-1], nodes[1:]).sum()))
