"""The nearest of a nominal's samples to a place: down along the curve, then by the search tree where that proves nothing."""

from typing import Any

import numpy as np

from inspection.kernels.compiling import inlined_kernel, inner_kernel, kernel
from inspection.kernels.layout import (
    BOX_WIDTH,
    LEAF,
    LEFT_EDGE_X,
    LINK_WIDTH,
    NEXT_SAMPLE,
    NORMAL_X,
    NORMAL_Y,
    PREVIOUS_SAMPLE,
    RIGHT_EDGE_X,
    SAMPLE_WIDTH,
    SAMPLE_X,
    SAMPLE_Y,
)
from inspection.kernels.search import box_distance

_WITHIN = 0.999  # of a Voronoi cell: its corners are known to round-off only


@kernel
def nearest_sample(x: float, y: float, site: int, samples: Any, links: Any, boxes: Any, stack: Any) -> int:
    """The nearest of all samples.

    site  : where the search begins
    stack : memory for the nodes of the tree that are still to be looked at

    The search goes down along the curve; then the Voronoi cell decides whether that is the nearest of all. Where it does not,
    the search climbs the tree from that sample's leaf, and of every other subtree it looks only at what may hold a nearer one.
    """
    least = _square_of_distance(samples, site, x, y)
    side = 0
    while side < 2:
        other = links[LINK_WIDTH * site + NEXT_SAMPLE + side]
        distance = _square_of_distance(samples, other, x, y) if other >= 0 else np.inf
        if distance < least:
            least, site, side = distance, other, -1
        side += 1
    if _in_cell(x, y, site, samples, links):
        return site
    leaves = len(boxes) // (2 * BOX_WIDTH)
    node = leaves + site // LEAF
    least, site = _nearest_in_leaf(x, y, node - leaves, least, site, samples)
    while node > 1:
        stack[0] = node ^ 1
        node >>= 1
        depth = 1
        while depth:
            depth -= 1
            other = stack[depth]
            if box_distance(boxes, other, x, y) > least:
                continue
            if other >= leaves:
                least, site = _nearest_in_leaf(x, y, other - leaves, least, site, samples)
            else:
                stack[depth], stack[depth + 1] = 2 * other, 2 * other + 1
                depth += 2
    return site


@inlined_kernel
def _in_cell(x: float, y: float, site: int, samples: Any, links: Any) -> bool:
    """Whether a point between the bisectors with both neighbours is surely in the Voronoi cell of a sample.

    The cell is convex and holds the edges that it shares with the neighbours, so it holds what lies between their ends. False
    also where there is no neighbour or no such edge (NaN), where an edge does not reach to both sides of the sample, and within a
    thousandth of the cell's border.
    """
    row, before = SAMPLE_WIDTH * site, links[LINK_WIDTH * site + PREVIOUS_SAMPLE]
    if before < 0 or links[LINK_WIDTH * site + NEXT_SAMPLE] < 0:
        return False
    earlier = SAMPLE_WIDTH * before
    px, py, nx, ny = samples[row + SAMPLE_X], samples[row + SAMPLE_Y], samples[row + NORMAL_X], samples[row + NORMAL_Y]
    dx, dy = x - px, y - py
    inside = True
    for end in (LEFT_EDGE_X, RIGHT_EDGE_X):
        ax, ay = _WITHIN * (samples[earlier + end] - px), _WITHIN * (samples[earlier + end + 1] - py)
        bx, by = _WITHIN * (samples[row + end] - px), _WITHIN * (samples[row + end + 1] - py)
        above = min(ax * nx + ay * ny, bx * nx + by * ny)
        below = max(ax * nx + ay * ny, bx * nx + by * ny)
        side = (bx - ax) * (dy - ay) - (by - ay) * (dx - ax)
        inside = inside and (side < 0.0 and above > 0.0 if end == LEFT_EDGE_X else side > 0.0 and below < 0.0)
    return inside


@inner_kernel
def _nearest_in_leaf(x: float, y: float, leaf: int, least: float, site: int, samples: Any) -> tuple[float, int]:
    for i in range(leaf * LEAF, min((leaf + 1) * LEAF, len(samples) // SAMPLE_WIDTH)):
        distance = _square_of_distance(samples, i, x, y)
        if distance < least or (distance == least and i < site):
            least, site = distance, i
    return least, site


@inlined_kernel
def _square_of_distance(samples: Any, site: int, x: float, y: float) -> float:
    dx, dy = x - samples[SAMPLE_WIDTH * site + SAMPLE_X], y - samples[SAMPLE_WIDTH * site + SAMPLE_Y]
    return float(dx * dx + dy * dy)
