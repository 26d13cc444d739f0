"""Where a curve crosses or touches itself: a nominal that does has no inside there, and deviations have no sign.

Crossings are found by bounds, not by samples. Every stretch of the curve lies within a strip about its chord. Two stretches
whose strips keep apart cannot meet; all others are halved until they keep apart or cross at an angle. Sides that lie upon
each other never keep apart: they are reported as well.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inspection.curve import NurbsCurve
from inspection.curve_pieces import CurvePieces, cut_into_pieces, derivative_bounds, piece_tree

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]

_SHORTEST = 1e-8  # of the size: stretches that do not keep apart although they are this short touch
_MOST_PAIRS = 50_000  # more pairs than this that do not keep apart are sides that lie upon each other
_MOST_PLACES = 1000  # that are worked out; a curve that goes round and round itself meets itself millions of times
_SAME_PLACE = 1e-6  # of the size: ends of an open curve as near as this are one place
_SLOWEST = 0.75  # of the speed at a piece's middle: a piece is cut so that its speed does not fall below this
_GENTLE = 0.1  # rad; stretches that turn by less are solved by Newton's method
_NEWTON_STEPS = 8
_SLACK = 1e-9  # of a stretch: a crossing on the border of two stretches is found from either


@dataclass(frozen=True, slots=True)
class Crossing:
    """A place at which a curve crosses or touches itself, and the two stations of that place."""

    x_mm: float
    y_mm: float
    first_mm: float
    second_mm: float


def find_crossings(curve: NurbsCurve) -> tuple[Crossing, ...]:
    """Every place at which a curve crosses or touches itself, by its first station; of very many the first.

    Raises NominalError where the curve stands still.
    """
    pieces = cut_into_pieces(curve)
    size = float(np.ptp(curve.control_points_mm, axis=0).max())
    pairs = _Pairs.whole(pieces, *_near_pieces(pieces))
    joins, grain = _joins(pieces, size), _SHORTEST * size
    met: list[Array] = []  # rows of x, y, and two parameters
    while len(pairs.first) and sum(map(len, met)) <= _MOST_PLACES:
        one, other = _stretches(pieces, pairs.first, pairs.first_t), _stretches(pieces, pairs.second, pairs.second_t)
        apart = _keep_apart(one, other) | _part_at_join(pairs, one, other, joins)
        once = ~apart & _cross_once(one, other)
        met.append(_solve(pieces, pairs.take(once)))
        left = ~apart & ~once
        length = np.maximum(one.length_mm, other.length_mm)[left]
        pairs = pairs.take(left)
        touch = length <= _SHORTEST * size
        if len(length) > _MOST_PAIRS:
            grain, touch = float(length.max()), np.ones(len(length), dtype=bool)
        met.append(_middles(pieces, pairs.take(touch & ~_meet_at_join(pairs, joins)[0])))
        pairs = pairs.take(~touch).halves()
    return _places(curve, np.vstack([np.zeros((0, 4)), *met]), grain)


# --- pairs of stretches ---------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, eq=False)
class _Pairs:
    """Pairs of stretches: the pieces (k,) they lie on, and from where to where (k, 2) in the parameter t of the piece."""

    first: Index
    second: Index
    first_t: Array
    second_t: Array

    @classmethod
    def whole(cls, pieces: CurvePieces, first: Index, second: Index) -> "_Pairs":
        """Pairs of whole pieces, but for those that follow one another smoothly: these turn too little to meet again."""
        smooth = (pieces.after[first] == second) | (pieces.after[second] == first)
        first, second = first[~smooth], second[~smooth]
        full = np.tile([-0.5, 0.5], (len(first), 1))
        return cls(first, second, full, full.copy())

    def take(self, chosen: Mask) -> "_Pairs":
        return _Pairs(self.first[chosen], self.second[chosen], self.first_t[chosen], self.second_t[chosen])

    def swapped(self) -> "_Pairs":
        return _Pairs(self.second, self.first, self.second_t, self.first_t)

    def halves(self) -> "_Pairs":
        """Every half of the first stretch with every half of the second."""
        parts = [(a, b) for a in _halved(self.first_t) for b in _halved(self.second_t)]
        first_t, second_t = (np.vstack([part[side] for part in parts]) for side in (0, 1))
        return _Pairs(np.tile(self.first, 4), np.tile(self.second, 4), first_t, second_t)


def _halved(t: Array) -> tuple[Array, Array]:
    middle = t.mean(axis=1)
    return np.column_stack([t[:, 0], middle]), np.column_stack([middle, t[:, 1]])


def _near_pieces(pieces: CurvePieces) -> tuple[Index, Index]:
    """Pairs of different pieces whose boxes overlap, found down the tree of boxes, all nodes of a level at once."""
    boxes = piece_tree(pieces)
    leaves = len(boxes) // 2
    a = b = np.ones(1, dtype=np.int64)
    while a[0] < leaves:
        a, b = (np.concatenate([2 * node + side for side in sides]) for node, sides in ((a, (0, 0, 1, 1)), (b, (0, 1, 0, 1))))
        overlap = np.all((boxes[a, :2] <= boxes[b, 2:]) & (boxes[b, :2] <= boxes[a, 2:]), axis=1)
        a, b = a[overlap & (a <= b)], b[overlap & (a <= b)]
    different = a < b
    return a[different] - leaves, b[different] - leaves


@dataclass(frozen=True, slots=True, eq=False)
class _Stretches:
    """Stretches of the curve: chord from start (k, 2) to end (k, 2), the strip about it, and a bound of the turn in rad."""

    start: Array
    end: Array
    half_strip_mm: Array
    turn: Array

    @property
    def chord(self) -> Array:
        return self.end - self.start

    @property
    def length_mm(self) -> Array:
        return np.asarray(np.hypot(*self.chord.T))

    def take(self, chosen: Mask) -> "_Stretches":
        return _Stretches(self.start[chosen], self.end[chosen], self.half_strip_mm[chosen], self.turn[chosen])


def _stretches(pieces: CurvePieces, piece: Index, t: Array) -> _Stretches:
    width = t[:, 1] - t[:, 0]
    bend = derivative_bounds(pieces)[piece, 1]
    start, end = (_points(pieces, piece, t[:, side]) for side in (0, 1))
    return _Stretches(start, end, bend * width**2 / 8, bend * width / (_SLOWEST * pieces.length_mm[piece]))


def _points(pieces: CurvePieces, piece: Index, t: Array, derivative: int = 0) -> Array:
    """Points (k, 2) of the pieces at t (k,), or their derivatives by t."""
    c = pieces.rows[piece, :12].reshape(-1, 2, 6)
    for _ in range(derivative):
        c = c[:, :, 1:] * np.arange(1, c.shape[2])
    value = c[:, :, -1]
    for power in range(c.shape[2] - 2, -1, -1):
        value = value * t[:, None] + c[:, :, power]
    return np.asarray(value)


def _keep_apart(one: _Stretches, other: _Stretches) -> Mask:
    """Whether a line along x, along y, or along either chord lies between the strips of each pair."""
    apart = np.zeros(len(one.turn), dtype=bool)
    reserve = one.half_strip_mm + other.half_strip_mm
    for axis in (np.array([[1.0, 0.0]]), np.array([[0.0, 1.0]]), _normals(one.chord), _normals(other.chord)):
        ends = np.stack([(axis * place).sum(axis=1) for place in (one.start, one.end, other.start, other.end)])
        gap = np.maximum(ends[2:].min(axis=0) - ends[:2].max(axis=0), ends[:2].min(axis=0) - ends[2:].max(axis=0))
        apart |= gap > reserve
    return np.asarray(apart)


def _normals(chord: Array) -> Array:
    length = np.maximum(np.hypot(*chord.T), np.finfo(float).tiny)
    return np.asarray(np.column_stack([-chord[:, 1], chord[:, 0]]) / length[:, None])


# --- stretches that share a corner ------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, eq=False)
class _Joins:
    """Corners (c,): the piece that ends there, the piece that begins there, and the angle between the two sides in rad."""

    ending: Index
    beginning: Index
    angle: Array


def _joins(pieces: CurvePieces, size: float) -> _Joins:
    """The corners of a curve, and the place where an open curve ends on its own beginning."""
    ending = np.flatnonzero(pieces.after < 0)
    beginning = np.array([_beginning_at(pieces, int(piece), size) for piece in ending], dtype=np.int64)
    ending, beginning = ending[beginning >= 0], beginning[beginning >= 0]
    half = np.full(len(ending), 0.5)
    back, ahead = -_points(pieces, ending, half, 1), _points(pieces, beginning, -half, 1)
    angle = np.arctan2(np.abs(_cross(back, ahead)), (back * ahead).sum(axis=1))
    return _Joins(ending, beginning, angle)


def _beginning_at(pieces: CurvePieces, ending: int, size: float) -> int:
    """The piece that begins where this one ends, or -1."""
    same_vertex = np.flatnonzero(pieces.before == pieces.after[ending])
    if same_vertex.size:
        return int(same_vertex[0])
    gap = pieces.start_mm[ending] + pieces.along_mm[ending] - pieces.start_mm[0]
    return 0 if np.hypot(*gap) <= _SAME_PLACE * size else -1


def _meet_at_join(pairs: _Pairs, joins: _Joins) -> tuple[Mask, Array]:
    """Whether the two stretches of a pair meet at a corner, and the angle there."""
    meets, angle = np.zeros(len(pairs.first), dtype=bool), np.zeros(len(pairs.first))
    for ending, beginning, between in zip(joins.ending, joins.beginning, joins.angle, strict=True):
        for pair in (pairs, pairs.swapped()):
            here = (pair.first == ending) & (pair.second == beginning) & (pair.first_t[:, 1] == 0.5) & (pair.second_t[:, 0] == -0.5)
            meets |= here
            angle[here] = between
    return meets, angle


def _part_at_join(pairs: _Pairs, one: _Stretches, other: _Stretches, joins: _Joins) -> Mask:
    """Whether two stretches share a corner and nothing else: the sides turn by less than the angle between them."""
    meets, angle = _meet_at_join(pairs, joins)
    return meets & (angle > one.turn + other.turn)


# --- where two stretches meet -----------------------------------------------------------------------------------------------


def _cross(a: Array, b: Array) -> Array:
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


def _cross_once(one: _Stretches, other: _Stretches) -> Mask:
    """Whether two stretches turn so little that no two of their tangents are parallel: they then meet once at most."""
    turn = one.turn + other.turn
    lengths = np.maximum(one.length_mm * other.length_mm, np.finfo(float).tiny)
    angle = np.arcsin(np.minimum(np.abs(_cross(one.chord, other.chord)) / lengths, 1.0))
    return np.asarray((turn < _GENTLE) & (angle > 2 * turn))


def _solve(pieces: CurvePieces, pairs: _Pairs) -> Array:
    """Rows (k, 4) of x, y and the two parameters of the curve, where the stretches of each pair meet, by Newton's method."""
    t, s = pairs.first_t.mean(axis=1), pairs.second_t.mean(axis=1)
    for _ in range(_NEWTON_STEPS):
        gap = _points(pieces, pairs.second, s) - _points(pieces, pairs.first, t)
        ahead, beside = _points(pieces, pairs.first, t, 1), _points(pieces, pairs.second, s, 1)
        determinant = _cross(ahead, beside)
        determinant[determinant == 0] = np.inf
        t, s = t + _cross(gap, beside) / determinant, s + _cross(gap, ahead) / determinant
        t, s = np.clip(t, -1.5, 1.5), np.clip(s, -1.5, 1.5)
    inside = _lies_in(t, pairs.first_t) & _lies_in(s, pairs.second_t)
    return _rows(pieces, pairs.take(inside), t[inside], s[inside])


def _lies_in(t: Array, ends: Array) -> Mask:
    slack = _SLACK * (ends[:, 1] - ends[:, 0])
    return np.asarray((t >= ends[:, 0] - slack) & (t <= ends[:, 1] + slack))


def _middles(pieces: CurvePieces, pairs: _Pairs) -> Array:
    return _rows(pieces, pairs, pairs.first_t.mean(axis=1), pairs.second_t.mean(axis=1))


def _rows(pieces: CurvePieces, pairs: _Pairs, t: Array, s: Array) -> Array:
    first, second = (pieces.rows[piece, 12] + pieces.rows[piece, 13] * at for piece, at in ((pairs.first, t), (pairs.second, s)))
    return np.column_stack([_points(pieces, pairs.first, t), first, second])


def _places(curve: NurbsCurve, rows: Array, grain_mm: float) -> tuple[Crossing, ...]:
    """The crossings of the rows. Rows whose stations follow one another by the grain are one place, of which the first is taken."""
    if not len(rows):
        return ()
    from scipy.sparse.csgraph import connected_components  # noqa: PLC0415 - it takes a third of a second, and most curves do not cross
    from scipy.spatial import cKDTree  # noqa: PLC0415

    if len(rows) > _MOST_PLACES:
        rows = rows[np.argsort(rows[:, 2:].min(axis=1), kind="stable")[:_MOST_PLACES]]
    stations = np.sort(curve.station_mm(rows[:, 2:].ravel()).reshape(-1, 2), axis=1)
    order = np.lexsort(stations.T[::-1])
    rows, stations = rows[order], stations[order]
    _, kept = np.unique(np.round(stations / grain_mm), axis=0, return_index=True)
    kept = np.sort(kept)
    tree = cKDTree(stations[kept])
    near = tree.sparse_distance_matrix(tree, 3 * grain_mm, output_type="coo_matrix")
    _, place = connected_components(near, directed=False)
    firsts = kept[np.unique(place, return_index=True)[1]]
    return tuple(Crossing(*(float(value) for value in (*rows[i, :2], *stations[i]))) for i in np.sort(firsts))
