"""The tree of bounding boxes: every node is the box around the leaves below it."""

import numpy as np

from inspection.box_tree import box_tree


def test_every_node_is_the_box_around_its_leaves() -> None:
    rng = np.random.default_rng(1)
    for count in (*range(1, 20), 31, 32, 33, 200):
        low = rng.normal(0, 10, (count, 2))
        leaves = np.hstack([low, low + rng.uniform(0, 3, (count, 2))])
        boxes = box_tree(leaves)
        q = len(boxes) // 2
        assert q >= count
        assert q == 1 or q // 2 < count
        for node in range(1, 2 * q):
            first, width = node, 1
            while first < q:
                first, width = 2 * first, 2 * width
            below = leaves[first - q : first - q + width]
            empty = [np.inf, np.inf, -np.inf, -np.inf]
            assert boxes[node].tolist() == ([*below[:, :2].min(axis=0), *below[:, 2:].max(axis=0)] if len(below) else empty), (count, node)
