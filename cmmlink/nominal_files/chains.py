"""Chains of curves that follow one another, found by their ends: closed or open, with gaps and forks named and never mended.

Two ends are one joint within a millionth of the drawing's size. Where three or more ends of a layer meet, nothing tells which way the
profile goes: the chain ends there, and says so. Curves of different layers follow one another only where no other end is there.
"""

from collections import Counter, defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from cmmlink.nominal_files.pieces import Piece, reverse
from inspection import NominalError

Array = NDArray[np.float64]
End = tuple[int, int]  # the number of a piece, and which of its ends: 0 or 1

_JOINT = 1e-6  # of the size of the drawing: ends no farther apart are one joint
_MOST_PIECES = 200_000
_ALIKE = 1e-5  # of the size: how near length and centroid of a curve drawn twice are; a closer look decides
_NEAR = 0.05  # of the length of a chain: a loose end this near to another one is worth a word


@dataclass(frozen=True, slots=True, eq=False)
class Chain:
    """Curves that follow one another, each turned so that it begins where the one before ends.

    pieces   : in the order of travel; an open chain travels as its first piece in the file does
    closed   : whether the last ends where the first begins
    length   : in the unit of the drawing
    fork     : a place (3,) at which more than two ends meet, if the chain ends at one
    gap      : how far a loose end lies from the nearest other one, and that place; None for a closed chain, and where none is near
    """

    pieces: tuple[Piece, ...]
    closed: bool
    length: float
    fork: Array | None = None
    gap: tuple[float, Array] | None = None

    @property
    def layers(self) -> list[str]:
        """The layers that it is drawn on."""
        return sorted({piece.layer for piece in self.pieces})


@dataclass(frozen=True, slots=True, eq=False)
class Chains:
    """The chains of a drawing, longest first.

    joint : how far apart ends may lie that are one joint, in the unit of the drawing
    notes : what was dropped
    """

    chains: tuple[Chain, ...]
    joint: float
    notes: tuple[str, ...]


def chains_of(pieces: Sequence[Piece]) -> Chains:
    """Find the chains of some pieces. Raises NominalError for more than can be a drawing of a profile."""
    if len(pieces) > _MOST_PIECES:
        raise NominalError(f"{len(pieces)} curves; expected a drawing of no more than {_MOST_PIECES}: export the profile alone")
    size = _size(pieces)
    joint = _JOINT * size
    kept, notes = _without_points(pieces, joint)
    kept = _without_copies(kept, joint, size, notes)
    partner, forks = _partners(kept, joint)
    walks = list(_walks(len(kept), partner))
    chains = [_chain(walk, kept, forks) for walk in walks]
    return Chains(tuple(sorted(_with_gaps(chains, joint), key=lambda chain: -round(chain.length / joint))), joint, tuple(notes))


def _size(pieces: Iterable[Piece]) -> float:
    boxes = [(piece.points.min(axis=0), piece.points.max(axis=0)) for piece in pieces]
    low, high = (np.array([box[side] for box in boxes]) for side in (0, 1))
    return float((high.max(axis=0) - low.min(axis=0)).max())


def _without_points(pieces: Sequence[Piece], joint: float) -> tuple[list[Piece], list[str]]:
    kept = [piece for piece in pieces if piece.length > joint]
    count = len(pieces) - len(kept)
    return kept, [f"{_counted(count, 'curve')} without length left out"] if count else []


def _without_copies(pieces: list[Piece], joint: float, size: float, notes: list[str]) -> list[Piece]:
    """Drop what is drawn twice, and say so: the first of the copies stays."""
    if len(pieces) < 2:
        return pieces
    from scipy.spatial import cKDTree  # noqa: PLC0415 - a file of points is read without it

    first_of: dict[tuple[bytes, bytes], int] = {}  # copies to the last bit need no closer look: a drawing may hold thousands
    alike = [first_of.setdefault((piece.poles.tobytes(), piece.knots.tobytes()), i) for i, piece in enumerate(pieces)]
    dropped = {i for i, first in enumerate(alike) if first != i}
    single = np.array([i for i in range(len(pieces)) if i not in dropped])
    signature = np.array([[pieces[i].length, *pieces[i].centroid] for i in single])
    for first, second in single[np.array(sorted(cKDTree(signature).query_pairs(_ALIKE * size)), dtype=np.int64).reshape(-1, 2)].tolist():
        if not {first, second} & dropped and _lies_on(pieces[second], pieces[first], joint):
            dropped.add(second)
    if dropped:
        names = sorted(f"{pieces[i].name or pieces[i].layer}" for i in dropped)
        notes.append(f"{_counted(len(dropped), 'curve')} drawn twice left out: {', '.join(names[:4])}{', ...' if len(names) > 4 else ''}")
    return [piece for i, piece in enumerate(pieces) if i not in dropped]


def _lies_on(one: Piece, other: Piece, tolerance: float) -> bool:
    """Whether points of one curve lie on the other, found by the nearest of many samples and Newton's method from there."""
    low, high = one.knots[0], one.knots[-1]
    points = one.derivatives(np.linspace(low, high, 8), 0)[0]
    borders = np.unique(other.knots)
    samples = np.unique(np.concatenate([np.linspace(a, b, 17) for a, b in pairwise(borders)]))
    drawn = other.derivatives(samples, 0)[0]
    nearest = samples[np.argmin(np.linalg.norm(points[:, None] - drawn[None], axis=2), axis=1)]
    for _ in range(8):
        at, first, second = other.derivatives(nearest, 2)
        gap = at - points
        slope = (first * first).sum(axis=1) + (gap * second).sum(axis=1)
        step = (gap * first).sum(axis=1) / np.where(slope > 0, slope, np.inf)
        nearest = np.clip(nearest - step, borders[0], borders[-1])
    return bool(np.linalg.norm(other.derivatives(nearest, 0)[0] - points, axis=1).max() <= tolerance)


def _partners(pieces: Sequence[Piece], joint: float) -> tuple[dict[End, End], dict[End, Array]]:
    """Which end goes on at which other end, and the ends that lie in a fork, with the place of it."""
    if not pieces:
        return {}, {}
    from scipy.sparse import coo_array  # noqa: PLC0415 - a file of points is read without it
    from scipy.sparse.csgraph import connected_components  # noqa: PLC0415
    from scipy.spatial import cKDTree  # noqa: PLC0415

    ends = np.array([piece.ends for piece in pieces]).reshape(-1, 3)  # (2 n, 3): end 0 and end 1 of each piece in turn
    pairs = cKDTree(ends).query_pairs(joint, output_type="ndarray")
    links = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(ends), len(ends)))
    nodes: dict[int, list[int]] = defaultdict(list)
    for end, node in enumerate(connected_components(links, directed=False)[1]):
        nodes[int(node)].append(end)
    partner: dict[End, End] = {}
    forks: dict[End, Array] = {}
    for meeting in nodes.values():
        _pair_up(meeting, pieces, ends, partner, forks)
    return partner, forks


def _pair_up(meeting: list[int], pieces: Sequence[Piece], ends: Array, partner: dict[End, End], forks: dict[End, Array]) -> None:
    """Pair the ends that meet in one place: two of a layer, or two that are left over of different layers."""
    open_ends = [end for end in meeting if not (end ^ 1 in meeting and len(meeting) > 2)]  # a closed curve takes nobody else's end
    for end in set(meeting) - set(open_ends):
        partner[divmod(end, 2)] = divmod(end ^ 1, 2)
    by_layer: dict[str, list[int]] = defaultdict(list)
    for end in open_ends:
        by_layer[pieces[end // 2].layer].append(end)
    left = [group[0] for group in by_layer.values() if len(group) == 1]
    for group in (*by_layer.values(), left if len(left) == 2 else []):
        if len(group) == 2:
            one, other = (divmod(end, 2) for end in group)
            partner[one], partner[other] = other, one
        elif len(group) > 2:
            forks |= {divmod(end, 2): ends[end] for end in group}


def _walks(count: int, partner: dict[End, End]) -> Iterable[tuple[list[End], bool]]:
    """Each chain as the ends at which its pieces are entered, and whether it goes round; the first piece is entered at its start."""
    seen: set[int] = set()
    for first in range(count):
        if first in seen:
            continue
        ahead, closed = _follow((first, 0), partner)
        behind = [] if closed else _follow((first, 1), partner)[0][1:]
        walk = [*((piece, 1 - end) for piece, end in reversed(behind)), *ahead]
        seen |= {piece for piece, _ in walk}
        yield walk, closed


def _follow(entered: End, partner: dict[End, End]) -> tuple[list[End], bool]:
    """The ends at which pieces are entered one after another, and whether the way comes back to the first."""
    walk = [entered]
    while (following := partner.get((walk[-1][0], 1 - walk[-1][1]))) is not None:
        if following == entered:
            return walk, True
        walk.append(following)
    return walk, False


def _chain(walk: tuple[list[End], bool], pieces: Sequence[Piece], forks: dict[End, Array]) -> Chain:
    entered, closed = walk
    along = tuple(pieces[piece] if end == 0 else reverse(pieces[piece]) for piece, end in entered)
    loose = (entered[0], (entered[-1][0], 1 - entered[-1][1]))
    fork = next((forks[end] for end in loose if end in forks), None)
    return Chain(along, closed, sum(piece.length for piece in along), fork)


def _with_gaps(chains: list[Chain], joint: float) -> list[Chain]:
    """The chains, each open one with its narrowest gap to another loose end, where one is near."""
    loose = [i for i, chain in enumerate(chains) if not chain.closed and chain.fork is None]
    if not loose:
        return chains
    from scipy.spatial import cKDTree  # noqa: PLC0415 - a file of points is read without it

    ends = np.array([[chains[i].pieces[0].ends[0], chains[i].pieces[-1].ends[1]] for i in loose]).reshape(-1, 3)
    distance = np.asarray(cKDTree(ends).query(ends, k=2)[0])
    gaps = distance[:, 1].reshape(-1, 2)
    for i, gap, places in zip(loose, gaps, ends.reshape(-1, 2, 3), strict=True):
        narrow = int(np.argmin(gap))
        if joint < gap[narrow] <= _NEAR * chains[i].length:
            chains[i] = replace(chains[i], gap=(float(gap[narrow]), places[narrow]))
    return chains


def counted_names(names: Iterable[str]) -> str:
    """Words for several things of a few kinds, like "2 TEXT, 1 HATCH"."""
    return ", ".join(f"{count} {name}" for name, count in sorted(Counter(names).items()))


def _counted(count: int, what: str) -> str:
    return f"{count} {what}{'' if count == 1 else 's'}"
