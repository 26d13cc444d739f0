"""Where more than two segments meet: which lines go on into which, so that shells that touch come out as the rings they are."""

from math import pi

import numpy as np
from numpy.typing import NDArray

_SURE_RAD = 1e-6  # two ways to go on that turn by the same angle: nothing tells which one is right


def ends_that_go_on(branch: NDArray[np.intp], piece: NDArray[np.intp], direction: NDArray[np.float64]) -> list[tuple[int, int]]:
    """Return the pairs of ends, of k that lie at branches, that are one line; ends that nothing pairs stay loose.

    branch    : (k,) the branch at which an end lies
    piece     : (k,) the line that ends there; a line has at most two ends
    direction : (k, 2) away from the branch

    A line that leaves a branch and comes back to it is a ring: a shell that touches another one there. When two ends are left
    then, they go on into each other. Where four are left, the lines go on with the least turn, without crossing each other.
    """
    return _Joining(branch, piece, direction).pairs()


class _Joining:
    def __init__(self, branch: NDArray[np.intp], piece: NDArray[np.intp], direction: NDArray[np.float64]) -> None:
        self._branch = branch.tolist()
        self._angle = np.arctan2(direction[:, 1], direction[:, 0]).tolist()
        self._far_end = _far_ends(piece)
        self._loose: dict[int, set[int]] = {}
        for end, at in enumerate(self._branch):
            self._loose.setdefault(at, set()).add(end)
        self._pairs: list[tuple[int, int]] = []

    def pairs(self) -> list[tuple[int, int]]:
        self._join_certain(list(self._loose))
        for at in list(self._loose):
            if len(self._loose[at]) == 4:  # one at a time: each may settle others
                self._join_all(_least_turn(sorted(self._loose[at], key=lambda end: self._angle[end]), self._angle))
        return self._pairs

    def _join_certain(self, waiting: list[int]) -> None:
        while waiting:
            ends = self._loose[waiting.pop()]
            pair = next(((end, self._far_end[end]) for end in sorted(ends) if self._far_end[end] in ends), None)
            if pair is None and len(ends) == 2:
                pair = (min(ends), max(ends))
            if pair is not None:
                waiting += self._join(*pair)

    def _join_all(self, pairs: list[tuple[int, int]]) -> None:
        self._join_certain([at for pair in pairs for at in self._join(*pair)])

    def _join(self, one: int, other: int) -> list[int]:
        """Make one line of two, and return the branches at which that may settle more."""
        at = self._branch[one]
        self._loose[at] -= {one, other}
        self._pairs.append((one, other))
        far_one, far_other = self._far_end[one], self._far_end[other]
        if far_one == other:
            return [at]
        for end, far in ((far_one, far_other), (far_other, far_one)):
            if end >= 0:
                self._far_end[end] = far
        return [at, *(self._branch[end] for end in (far_one, far_other) if end >= 0)]


def _far_ends(piece: NDArray[np.intp]) -> list[int]:
    """Return the end at the other side of the line of each end, or -1 where that lies at no branch."""
    far = np.full(len(piece), -1)
    order = np.argsort(piece, kind="stable")
    same = np.flatnonzero(piece[order[1:]] == piece[order[:-1]])
    far[order[same]], far[order[same + 1]] = order[same + 1], order[same]
    return [int(end) for end in far]


def _least_turn(around: list[int], angle: list[float]) -> list[tuple[int, int]]:
    """Pair four ends, given in the order of their angles, so that the lines turn least; none where two ways are alike.

    Lines that touch do not cross; they are taken to cross only where that is straight and every other way is a sharp bend.
    """
    a, b, c, d = around
    beside = sorted(([(a, b), (c, d)], [(b, c), (d, a)]), key=lambda pairs: _turn(pairs, angle))
    across = [(a, c), (b, d)]
    least, other = (_turn(pairs, angle) for pairs in beside)
    if least > pi / 2 and _turn(across, angle) < least / 2:
        return across
    return beside[0] if other - least > _SURE_RAD else []


def _turn(pairs: list[tuple[int, int]], angle: list[float]) -> float:
    """Return by how much two lines turn that go on from end to end, added up, in rad."""
    return sum(pi - abs((angle[one] - angle[other] + pi) % (2 * pi) - pi) for one, other in pairs)
