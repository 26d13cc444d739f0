"""The nearest of a nominal's samples to a place: down along the curve, then by the search tree where that proves nothing."""

from typing import Any

import numpy as np

from inspection.kernels.compiling import inner_kernel, kernel
from inspection.kernels.layout import BOX_WIDTH, CELL_WIDTH, LEAF, LINK_WIDTH, NEXT_SAMPLE
from inspection.kernels.sample_lanes import is_in_cell, square_of_distance
from inspection.kernels.search import box_distance


@kernel
def nearest_sample(x: float, y: float, site: int, cells: Any, links: Any, boxes: Any, stack: Any) -> int:
    """The nearest of all samples.

    site  : where the search begins
    cells : places of the samples, and what proves one of them the nearest (see `layout`)
    stack : memory for the nodes of the tree that are still to be looked at

    The search goes down along the curve; then the Voronoi cell decides whether that is the nearest of all. Where it does not,
    the search climbs the tree from that sample's leaf, and of every other subtree it looks only at what may hold a nearer one.
    """
    least = square_of_distance(cells, site, x, y)
    side = 0
    while side < 2:
        other = links[LINK_WIDTH * site + NEXT_SAMPLE + side]
        distance = square_of_distance(cells, other, x, y) if other >= 0 else np.inf
        if distance < least:
            least, site, side = distance, other, -1
        side += 1
    if is_in_cell(cells, site, x, y):
        return site
    leaves = len(boxes) // (2 * BOX_WIDTH)
    node = leaves + site // LEAF
    least, site = _nearest_in_leaf(x, y, node - leaves, least, site, cells)
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
                least, site = _nearest_in_leaf(x, y, other - leaves, least, site, cells)
            else:
                stack[depth], stack[depth + 1] = 2 * other, 2 * other + 1
                depth += 2
    return site


@inner_kernel
def _nearest_in_leaf(x: float, y: float, leaf: int, least: float, site: int, cells: Any) -> tuple[float, int]:
    for i in range(leaf * LEAF, min((leaf + 1) * LEAF, len(cells) // CELL_WIDTH)):
        distance = square_of_distance(cells, i, x, y)
        if distance < least or (distance == least and i < site):
            least, site = distance, i
    return least, site
