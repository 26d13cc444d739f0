"""The tree of boxes in which compiled loops search a surface: every node has eight children, and leaves hold a few items each."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inspection.kernels.surfaces.layout import BOX_HIGH, BOX_SIDES, LEAF, NO_CHILD, WAYS

Array = NDArray[np.float64]
Index = NDArray[np.int64]

_HALVINGS = 3  # that make eight children of a node
_STEPS = float(1 << 30)  # in which a group is measured along its longest side


@dataclass(frozen=True, slots=True, eq=False)
class ItemTree:
    """A search tree over n items, whose leaves are numbered from 0.

    nodes, links : (k * 6 * 8,) the boxes of the children in columns, and (k * 8,) what they are: see `layout`. Node 0 is the root
    members      : (l, leaf size) the items of each leaf, and -1 where a leaf is not full: only the last one may be
    """

    nodes: Array
    links: NDArray[np.int32]
    members: Index


def item_tree(place: Array, low_mm: Array, high_mm: Array, leaf_size: int) -> ItemTree:
    """The tree over items with boxes low (n, 3) and high (n, 3); those near each other by their places (n, c) share a leaf.

    The tree has no say in which item is found: it only says where not to look.
    """
    order = np.arange(len(place))
    start, count = np.zeros(1, dtype=np.int64), np.array([len(place)])
    nodes: list[Array] = []
    links: list[Index] = []
    members: list[Index] = []
    begun, leaves = 1, 0
    halvings = (-(-len(place) // leaf_size) - 1).bit_length() % _HALVINGS or _HALVINGS  # fewer at the root: below it nodes are full then
    while len(start):
        parent = np.arange(len(start))
        for _ in range(halvings):
            start, count, parent = _halve(place, order, start, count, parent, leaf_size)
        slot = np.arange(len(parent)) - np.searchsorted(parent, parent)
        boxes, link = np.full((parent[-1] + 1, BOX_SIDES, WAYS), np.inf), np.full((parent[-1] + 1, WAYS), NO_CHILD)
        boxes[:, BOX_HIGH:] = -np.inf
        boxes[parent, :BOX_HIGH, slot] = _reduced(np.minimum, low_mm[order], start, count)
        boxes[parent, BOX_HIGH:, slot] = _reduced(np.maximum, high_mm[order], start, count)
        goes_on = count > leaf_size
        made, ended = int(np.count_nonzero(goes_on)), int(np.count_nonzero(~goes_on))
        link[parent[goes_on], slot[goes_on]] = begun + np.arange(made)
        link[parent[~goes_on], slot[~goes_on]] = LEAF - leaves - np.arange(ended)
        members.append(_members(order, start[~goes_on], count[~goes_on], leaf_size))
        nodes.append(boxes.ravel())
        links.append(link.ravel())
        begun, leaves, halvings = begun + made, leaves + ended, _HALVINGS
        start, count = start[goes_on], count[goes_on]
    return _with_full_leaves_first(ItemTree(np.concatenate(nodes), np.concatenate(links).astype(np.int32), np.concatenate(members)))


def _with_full_leaves_first(tree: ItemTree) -> ItemTree:
    """The tree with the leaf that is not full, where there is one, as its last."""
    last = len(tree.members) - 1
    for leaf in np.flatnonzero(tree.members[:, -1] < 0).tolist():
        tree.members[[leaf, last]] = tree.members[[last, leaf]]
        one, other = tree.links == LEAF - leaf, tree.links == LEAF - last
        tree.links[one], tree.links[other] = LEAF - last, LEAF - leaf
    return tree


def _halve(place: Array, order: Index, start: Index, count: Index, parent: Index, leaf_size: int) -> tuple[Index, Index, Index]:
    """Halve every group that no leaf can hold, across its longest side, so that all leaves but one become full. Sorts `order` for it."""
    big = count > leaf_size
    if not big.any():
        return start, count, parent
    first, size = start[big], count[big]
    group = np.repeat(np.arange(len(first)), size)
    rows = np.arange(len(group)) + np.repeat(first - np.cumsum(size) + size, size)
    here = place[order[rows]]
    begin = np.cumsum(size) - size
    low, high = np.minimum.reduceat(here, begin), np.maximum.reduceat(here, begin)
    axis = np.argmax(high - low, axis=1)
    each = np.arange(len(first))
    length = (high - low)[each, axis]
    scale = np.divide(_STEPS, length, out=np.zeros_like(length), where=length > 0)
    along = (here[np.arange(len(group)), axis[group]] - low[each, axis][group]) * scale[group]
    key = (group << 32) + along.astype(np.int64)
    order[rows] = order[rows][np.argsort(key)]
    left = leaf_size * ((-(-size // leaf_size) + 1) // 2)
    pieces = np.where(big, 2, 1)
    new_start, new_count, new_parent = (np.repeat(values, pieces) for values in (start, count, parent))
    at = (np.cumsum(pieces) - pieces)[big]
    new_count[at], new_count[at + 1] = left, size - left
    new_start[at + 1] = first + left
    return new_start, new_count, new_parent


def _reduced(function: np.ufunc, values: Array, start: Index, count: Index) -> Array:
    """A function over the values (n, 3) of each group: (g, 3)."""
    padded = np.concatenate([values, values[-1:]])  # a group may end with the last value
    return np.asarray(function.reduceat(padded, np.column_stack([start, start + count]).ravel())[::2])


def _members(order: Index, start: Index, count: Index, leaf_size: int) -> Index:
    columns = np.arange(leaf_size)
    rows = np.minimum(start[:, None] + columns, len(order) - 1)
    return np.where(columns < count[:, None], order[rows], -1)
