"""Closest points on surfaces as a record of arrays, and the walk through the search tree that every kind of surface shares."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from inspection.kernels.compiling import inlined_uncounted_kernel, uncounted_kernel
from inspection.kernels.feet import flatten, share_out
from inspection.kernels.surfaces.layout import BOX_HIGH, BOX_LOW, BOX_SIDES, LEAF, NO_FOOT, SQUARES_OF_EIGHT, WAYS

Array = NDArray[np.float64]
Index = NDArray[np.int32]

AT_ONCE = 1024  # points that a thread claims together
_CELLS = 256  # along the longest side of what points are ordered by
_SCATTERED = 0.1  # of the size: points that lie farther from the one before are in no order
_SLACK = 1.0 + 1e-13  # round-off of the square of a distance from a box


class SpaceFeet(NamedTuple):
    """Closest points on a surface of m points.

    foot_mm     : (m, 3)
    distance_mm : (m,) positive on the side to which the normals point
    normal      : (m, 3) unit direction in which `distance_mm` grows
    item        : (m,) the triangle, or whatever the surface is made of, that the foot lies on
    parameter   : (m, 2) where on it
    kind        : (m,) ON_FACE, ON_EDGE, ON_CORNER, ON_BORDER or NO_FOOT (see layout)
    """

    foot_mm: Array
    distance_mm: Array
    normal: Array
    item: Index
    parameter: Array
    kind: NDArray[np.uint8]


def project_in_chunks(points_mm: Array, project: Callable[[Array, SpaceFeet, NDArray[np.int64]], None], threads: int | None) -> SpaceFeet:
    """Closest points to points (m, 3), which threads take in chunks; points near each other are projected one after the other.

    project : the loop of a kind of surface: it takes the coordinates (3 m,), the feet to fill in, and the counter of claimed chunks
    threads : None chooses by the number of points; the result is the same
    """
    order = nearby_first(points_mm)
    points = flatten(points_mm if order is None else points_mm[order])
    feet = _empty_feet(len(points_mm))
    share_out(lambda claimed: project(points, feet, claimed), len(points_mm), threads)
    return _put_back(feet, order)


def nearby_first(points_mm: Array) -> NDArray[np.int64] | None:
    """An order (m,) of points (m, 3) in which those near each other follow each other; None where they do already, as in a scan.

    It changes no result, only how far a search has to look, and how often tables come from the cache.
    """
    if len(points_mm) < AT_ONCE:
        return None
    some = np.linspace(0, len(points_mm) - 2, AT_ONCE).astype(np.int64)
    here, following = points_mm[some], points_mm[some + 1]
    known = np.isfinite(here).all(axis=1) & np.isfinite(following).all(axis=1)
    if not known.any():
        return None
    steps = np.abs(following[known] - here[known]).max(axis=1)
    if np.median(steps) <= _SCATTERED * float(np.ptp(here[known], axis=0).max()):
        return None
    finite = np.asarray(np.isfinite(points_mm).all(axis=1))
    low, high = points_mm[finite].min(axis=0), points_mm[finite].max(axis=0)
    size = float((high - low).max())
    cell = (np.where(finite[:, None], points_mm - low, 0.0) / size * _CELLS).astype(np.int64)
    key = np.zeros(len(cell), dtype=np.int64)
    for bit in range(_CELLS.bit_length() - 1):  # the bits of the three cells in turn: Morton's order
        for axis in range(3):
            key |= (cell[:, axis] >> bit & 1) << (3 * bit + axis)
    return np.argsort(key, kind="stable")


def _put_back(feet: SpaceFeet, order: NDArray[np.int64] | None) -> SpaceFeet:
    """Feet of points that were ordered, in their own order."""
    if order is None:
        return feet
    back = np.empty_like(order)
    back[order] = np.arange(len(order))
    foot_mm, distance_mm, normal, item, parameter, kind = feet
    return SpaceFeet(foot_mm[back], distance_mm[back], normal[back], item[back], parameter[back], kind[back])


def _empty_feet(m: int) -> SpaceFeet:
    """Feet of m points, not filled in."""
    return SpaceFeet(
        np.empty((m, 3)), np.empty(m), np.empty((m, 3)), np.empty(m, dtype=np.int32), np.empty((m, 2)), np.empty(m, dtype=np.uint8)
    )


@uncounted_kernel
def store_no_foot(feet: Any, i: int) -> None:
    """Enter that point i has no foot."""
    feet.foot_mm[i, :] = np.nan
    feet.normal[i, :] = np.nan
    feet.parameter[i, :] = np.nan
    feet.distance_mm[i], feet.item[i], feet.kind[i] = np.nan, -1, NO_FOOT


@inlined_uncounted_kernel
def square_from_last(foot_mm: Any, i: int, begin: int, x: float, y: float, z: float) -> float:
    """A bound of the square of the distance of point i: that from the foot of the point before, in the order of a scan close by.

    It only says where not to look. It is infinite where there is no such foot.
    """
    if i == begin or not np.isfinite(foot_mm[i - 1, 0]):
        return np.inf
    dx, dy, dz = x - foot_mm[i - 1, 0], y - foot_mm[i - 1, 1], z - foot_mm[i - 1, 2]
    return float((dx * dx + dy * dy + dz * dz) * (1.0 + 1e-9) + 1e-18)  # the foot itself is rounded


@inlined_uncounted_kernel
def next_leaf(nodes: Any, links: Any, x: float, y: float, z: float, least: float, depth: int, waiting: Any, squares: Any) -> Any:
    """The next leaf whose box is not farther than `least` (a square), nearest boxes first, and how many nodes wait then.

    The leaf is -1 where none is left. At the beginning the root waits: depth 1, waiting[0] = 0, squares[0] = 0.

    waiting, squares : (STACK,) what waits, as links, and (SCRATCH,) the squares of its distance
    """
    while depth:
        depth -= 1
        link = waiting[depth]
        if squares[depth] > least * _SLACK:
            continue
        if link <= LEAF:
            return LEAF - link, depth
        depth = _push_children(nodes, links, link, x, y, z, least * _SLACK, depth, waiting, squares)
    return -1, depth


@inlined_uncounted_kernel
def _push_children(
    nodes: Any, links: Any, node: int, x: float, y: float, z: float, least: float, depth: int, waiting: Any, squares: Any
) -> int:
    """Put the children of a node that are near enough on the stack, the nearest on top."""
    row = node * BOX_SIDES * WAYS
    low, high = row + BOX_LOW * WAYS, row + BOX_HIGH * WAYS
    for j in range(WAYS):
        dx = max(nodes[low + j] - x, 0.0, x - nodes[high + j])
        dy = max(nodes[low + WAYS + j] - y, 0.0, y - nodes[high + WAYS + j])
        dz = max(nodes[low + 2 * WAYS + j] - z, 0.0, z - nodes[high + 2 * WAYS + j])
        squares[SQUARES_OF_EIGHT + j] = dx * dx + dy * dy + dz * dz
    first = depth
    for j in range(WAYS):
        square = squares[SQUARES_OF_EIGHT + j]
        if square > least:
            continue
        at = depth
        while at > first and squares[at - 1] < square:
            waiting[at], squares[at] = waiting[at - 1], squares[at - 1]
            at -= 1
        waiting[at], squares[at] = links[node * WAYS + j], square
        depth += 1
    return depth
