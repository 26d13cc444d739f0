"""The search tree: every item in one leaf, full leaves, and boxes that hold what is below them."""

import numpy as np
import pytest

from inspection.kernels.surfaces.layout import BOX_HIGH, LEAF, NO_CHILD, STACK
from inspection.surface.item_tree import item_tree


@pytest.mark.parametrize(("count", "leaf_size"), [(1, 8), (8, 8), (9, 8), (1000, 8), (777, 1), (64, 1)])
def test_every_item_is_in_one_leaf_and_every_box_holds_what_is_below(count: int, leaf_size: int) -> None:
    low = np.random.default_rng(count).normal(size=(count, 3))
    low[: count // 3] = low[0]  # many in one place
    high = low + 0.1
    tree = item_tree(low, low, high, leaf_size)
    assert sorted(tree.members[tree.members >= 0].tolist()) == list(range(count))
    assert len(tree.members) == -(-count // leaf_size)
    nodes, links = tree.nodes.reshape(-1, 6, 8), tree.links.reshape(-1, 8)
    seen = []
    waiting = [(0, np.full(3, -np.inf), np.full(3, np.inf), 0)]
    deepest = 0
    while waiting:
        node, lower, upper, depth = waiting.pop()
        deepest = max(deepest, depth)
        for slot, link in enumerate(links[node]):
            box_low, box_high = nodes[node, :BOX_HIGH, slot], nodes[node, BOX_HIGH:, slot]
            if link == NO_CHILD:
                assert (box_low > box_high).all()
                continue
            assert (box_low >= lower).all()
            assert (box_high <= upper).all()
            if link <= LEAF:
                items = tree.members[LEAF - link]
                items = items[items >= 0]
                assert (low[items] >= box_low).all()
                assert (high[items] <= box_high).all()
                seen.append(LEAF - link)
            else:
                waiting.append((link, box_low, box_high, depth + 1))
    assert sorted(seen) == list(range(len(tree.members)))
    assert 7 * (deepest + 1) + 1 < STACK
