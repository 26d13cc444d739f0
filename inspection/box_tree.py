"""The binary tree of bounding boxes in which compiled loops search for what is nearest to a place."""

import numpy as np
from numpy.typing import NDArray

from inspection.kernels.layout import BOX_HIGH_X, BOX_WIDTH

Array = NDArray[np.float64]


def box_tree(leaf_boxes_mm: Array) -> Array:
    """Boxes (2 q, 4) of the tree over leaves (k, 4), q being the smallest power of two that holds k.

    A box is low x, low y, high x, high y. Node 1 is the root, the children of node i are nodes 2 i and 2 i + 1, and node
    q + j is leaf j. Nodes without a leaf below them are empty: their low sides are infinite, their high sides minus infinite.
    """
    count = len(leaf_boxes_mm)
    q = 1 << max(0, (count - 1).bit_length())
    boxes = np.full((2 * q, BOX_WIDTH), np.inf)
    boxes[:, BOX_HIGH_X:] = -np.inf
    boxes[q : q + count] = leaf_boxes_mm
    while q > 1:
        children = boxes[q : 2 * q].reshape(q // 2, 2, BOX_WIDTH)
        boxes[q // 2 : q] = np.hstack([children[:, :, :BOX_HIGH_X].min(axis=1), children[:, :, BOX_HIGH_X:].max(axis=1)])
        q //= 2
    return boxes
