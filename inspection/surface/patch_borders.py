"""Where faces end: which adjoin there, how their outsides agree, and the pseudonormals that tell the side of a place beside an edge."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from inspection.kernels.surfaces.layout import BORDER_STEPS, CORNERS, INNER, LINKS, SIDES
from inspection.surface.patch_pieces import PatchPieces

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Truth = NDArray[np.bool_]

_AT = np.linspace(-0.5, 0.5, BORDER_STEPS + 1)
_STARTS = np.linspace(-0.5, 0.5, 9)
_STEPS = 8  # of Newton's method along a border
_ALONG = 0.9  # cosine of the angle of two borders that run alongside and do not merely meet
_ROWS_AT_ONCE = 256
_BESIDE_POLE = 1e-5


@dataclass(frozen=True, slots=True, eq=False)
class PatchBorders:
    """The sides of pieces at which something smooth ends.

    links    : (p, LINKS) what lies beyond the sides and at the corners of each piece, see the layout of the kernels
    piece, side : (b,) the sides of borders, in the order of their rows
    group    : (b,) sides of one border of one face have the same number
    corner_piece, corner : (v,) the corners of faces, in the order of their rows
    """

    links: Index
    piece: Index
    side: Index
    group: Index
    corner_piece: Index
    corner: Index


def find_borders(pieces: PatchPieces) -> PatchBorders:
    """The sides of pieces on the borders of faces, and on lines within them where a crease may be."""
    links = np.full((len(pieces.face), LINKS), INNER)
    sides: list[tuple[Index, int, Index]] = []
    base = groups = 0
    for (k, m), creases in zip(pieces.grid, pieces.creases, strict=True):
        number = base + np.arange(k * m).reshape(m, k)
        for axis, crease in enumerate(creases):
            cells = number.T if axis == 0 else number  # [line of pieces, along the line]
            for line in np.flatnonzero(crease):
                for low, row in ((1, line), (0, line - 1)):  # what begins at the line, what ends there
                    if 0 <= row < len(cells):
                        sides.append((cells[row], 2 * axis + 1 - low, np.full(len(cells[row]), groups)))
                        groups += 1
        base += k * m
    piece = np.concatenate([cells for cells, _, _ in sides])
    side = np.repeat([which for _, which, _ in sides], [len(cells) for cells, _, _ in sides])
    links[piece, side] = np.arange(len(piece))
    at_corner = np.stack([(links[:, i & 1] != INNER) & (links[:, 2 + (i >> 1)] != INNER) for i in range(CORNERS)], axis=1)
    corner_piece, corner = np.nonzero(at_corner)
    links[corner_piece, SIDES + corner] = np.arange(len(corner_piece))
    return PatchBorders(links, piece, side, np.concatenate([group for _, _, group in sides]), corner_piece, corner)


@dataclass(frozen=True, slots=True, eq=False)
class AdjoiningSides:
    """Where another border adjoins: the row of a border and the step along it, and of the other one its row and the place on it."""

    row: Index
    step: Index
    other: Index
    at: Array


_NONE = np.empty(0, dtype=np.int64)
NO_ADJOINING = AdjoiningSides(_NONE, _NONE, _NONE, np.empty(0))


def find_adjoining(pieces: PatchPieces, borders: PatchBorders, near_mm: float) -> AdjoiningSides:
    """Where the borders of faces, or the two ends of a closed face, lie within `near_mm` of each other."""
    count, steps = len(borders.piece), len(_AT)
    rows = np.arange(count)
    places, tangents = _along(pieces, borders, np.repeat(rows, steps), np.tile(_AT, count))
    places, tangents = places.reshape(count, steps, 3), tangents.reshape(count, steps, 3)
    reach = np.linalg.norm(np.diff(places, axis=1), axis=2).max(axis=1)[:, None] + near_mm
    low, high = places.min(axis=1) - reach, places.max(axis=1) + reach
    one, other = _overlapping(low, high, borders.group)
    is_pole = _is_pole(places)
    one, other = (side[~is_pole[one] & ~is_pole[other]] for side in (one, other))
    row, step, partner = np.repeat(one, steps), np.tile(np.arange(steps), len(one)), np.repeat(other, steps)
    wanted = places[row, step]
    at = _nearest_along(pieces, borders, partner, wanted)
    found, tangent = _along(pieces, borders, partner, at)
    apart = np.linalg.norm(found - wanted, axis=1)
    own = tangents[row, step]
    lengths = np.linalg.norm(own, axis=1) * np.linalg.norm(tangent, axis=1)
    alongside = np.abs((own * tangent).sum(axis=1)) > _ALONG * lengths
    good = (apart <= near_mm) & ((np.abs(at) < 0.5 - 1e-6) | alongside)
    order = np.lexsort((apart[good], borders.group[partner[good]], step[good], row[good]))
    keys = np.column_stack([row[good], step[good], borders.group[partner[good]]])[order]
    first = np.ones(len(keys), dtype=bool)
    first[1:] = (keys[1:] != keys[:-1]).any(axis=1)  # of the sides of one border the nearest
    kept = order[first]
    return AdjoiningSides(row[good][kept], step[good][kept], partner[good][kept], at[good][kept])


def _is_pole(places: Array) -> Truth:
    """Whether sides through places (b, k, 3) have no length."""
    extent = np.ptp(places, axis=1).max(axis=1)
    return np.asarray(extent <= 1e-9 * float(extent.max()))


def _places_on(borders: PatchBorders, rows: Index, along: Array) -> tuple[Array, Array]:
    """The places s and t (m,) along sides (m,) of pieces."""
    side = borders.side[rows]
    end = np.where(side % 2 == 0, -0.5, 0.5)
    return np.where(side < 2, end, along), np.where(side < 2, along, end)


def _along(pieces: PatchPieces, borders: PatchBorders, rows: Index, along: Array) -> tuple[Array, Array]:
    """Places (m, 3) on sides, and the tangents along them."""
    value, by_s, by_t = pieces.at(borders.piece[rows], *_places_on(borders, rows, along))
    return value, np.where((borders.side[rows] < 2)[:, None], by_t, by_s)


def _overlapping(low: Array, high: Array, group: Index) -> tuple[Index, Index]:
    """Pairs of sides of different borders whose boxes meet."""
    found = []
    for begin in range(0, len(low), _ROWS_AT_ONCE):
        part = slice(begin, begin + _ROWS_AT_ONCE)
        meets = group[part, None] != group
        for axis in range(3):
            meets &= (low[part, axis, None] <= high[:, axis]) & (high[part, axis, None] >= low[:, axis])
        one, other = np.nonzero(meets)
        found.append(np.stack([one + begin, other]))
    both = np.concatenate(found, axis=1)
    return both[0], both[1]


def _nearest_along(pieces: PatchPieces, borders: PatchBorders, rows: Index, wanted: Array) -> Array:
    """Where on sides (m,) the places nearest to others (m, 3) are: from the nearest of nine by Gauss's and Newton's method."""
    best, at = np.full(len(rows), np.inf), np.zeros(len(rows))
    for start in _STARTS:
        found, _ = _along(pieces, borders, rows, np.full(len(rows), start))
        square = ((found - wanted) ** 2).sum(axis=1)
        at = np.where(square < best, start, at)
        best = np.minimum(square, best)
    for _ in range(_STEPS):
        found, tangent = _along(pieces, borders, rows, at)
        length = (tangent**2).sum(axis=1)
        step = ((wanted - found) * tangent).sum(axis=1) / np.where(length > 0, length, 1.0)
        at = np.clip(at + step, -0.5, 0.5)
    return at


def normals_on(pieces: PatchPieces, piece: Index, s: Array, t: Array) -> tuple[Array, Array]:
    """Unit normals S_s x S_t (m, 3), at a pole those beside it, and the direction into the piece from there (m, 3), along the surface."""
    _, by_s, by_t = pieces.at(piece, s, t)
    normal = np.cross(by_s, by_t)
    size = np.linalg.norm(by_s, axis=1) * np.linalg.norm(by_t, axis=1)
    biggest = float(size.max(initial=0.0))
    bad = np.linalg.norm(normal, axis=1) <= 1e-7 * biggest
    if bad.any():
        _, beside_s, beside_t = pieces.at(piece[bad], s[bad] * (1 - _BESIDE_POLE), t[bad] * (1 - _BESIDE_POLE))
        normal[bad] = np.cross(beside_s, beside_t)
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    inward = -np.sign(np.round(s, 9))[:, None] * (np.abs(s) == 0.5)[:, None] * by_s
    inward -= np.sign(np.round(t, 9))[:, None] * (np.abs(t) == 0.5)[:, None] * by_t
    return normal / np.where(length > 0, length, 1.0), inward


def agreeing_faces(pieces: PatchPieces, borders: PatchBorders, adjoining: AdjoiningSides, outward: Array) -> tuple[Index, Index, Truth]:
    """The faces (e,) on both sides of borders that adjoin in their middles, and whether they have their outsides on the same side.

    Who walks along its own border with the face on the left and its outside up meets the neighbour walking the other way.
    """
    middle = adjoining.step == BORDER_STEPS // 2
    row, other, at = adjoining.row[middle], adjoining.other[middle], adjoining.at[middle]
    walks = []
    for rows, along in ((row, np.zeros(len(row))), (other, at)):
        piece = borders.piece[rows]
        s, t = _places_on(borders, rows, along)
        normal, inward = normals_on(pieces, piece, s, t)
        walks.append(np.cross(inward, normal * outward[pieces.face[piece]][:, None]))
    along = (walks[0] * walks[1]).sum(axis=1)
    told = np.abs(along) > 0.5 * np.linalg.norm(walks[0], axis=1) * np.linalg.norm(walks[1], axis=1)  # a pole says nothing
    return pieces.face[borders.piece[row]][told], pieces.face[borders.piece[other]][told], along[told] < 0


def border_rows(pieces: PatchPieces, borders: PatchBorders, adjoining: AdjoiningSides, outward: Array) -> Array:
    """Pseudonormals along the borders (b, BORDER_STEPS + 1, 4): the sum of the normals of what adjoins, and 1 where nothing does.

    A border without a length, the pole of a face, adjoins itself.
    """
    count, steps = len(borders.piece), len(_AT)
    rows = np.repeat(np.arange(count), steps)
    s, t = _places_on(borders, rows, np.tile(_AT, count))
    own = _outward_normals(pieces, borders.piece[rows], s, t, outward).reshape(count, steps, 3)
    sums = own.copy()
    other_s, other_t = _places_on(borders, adjoining.other, adjoining.at)
    np.add.at(sums, (adjoining.row, adjoining.step), _outward_normals(pieces, borders.piece[adjoining.other], other_s, other_t, outward))
    free = np.ones((count, steps))
    free[adjoining.row, adjoining.step] = 0.0
    places, _ = _along(pieces, borders, rows, np.tile(_AT, count))
    free[_is_pole(places.reshape(count, steps, 3))] = 0.0
    return np.concatenate([sums, free[:, :, None]], axis=2)


def vertex_rows(pieces: PatchPieces, borders: PatchBorders, sides: Array, outward: Array, near_mm: float) -> Array:
    """Pseudonormals at the corners of faces (v, 4): the normals of all corners in one place, weighted by their angles there.

    It is free where a border that ends there is.

    sides : the rows of the borders
    """
    s, t = np.where(borders.corner & 1, 0.5, -0.5), np.where(borders.corner & 2, 0.5, -0.5)
    places, by_s, by_t = pieces.at(borders.corner_piece, s, t)
    normal = _outward_normals(pieces, borders.corner_piece, s, t, outward)
    into_s, into_t = -np.sign(s)[:, None] * by_s, -np.sign(t)[:, None] * by_t
    angle = np.arctan2(np.linalg.norm(np.cross(into_s, into_t), axis=1), (into_s * into_t).sum(axis=1))
    end_s, end_t = np.where(s > 0, BORDER_STEPS, 0), np.where(t > 0, BORDER_STEPS, 0)
    along_t = borders.links[borders.corner_piece, np.where(s > 0, 1, 0)]  # the side at this s runs along t
    along_s = borders.links[borders.corner_piece, np.where(t > 0, 3, 2)]
    free = np.maximum(sides[along_t, end_t, 3], sides[along_s, end_s, 3])
    pairs = cKDTree(places).query_pairs(near_mm, output_type="ndarray")
    links = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(places), len(places)))
    _, label = connected_components(links, directed=False)
    sums = np.column_stack([np.bincount(label, angle * normal[:, axis]) for axis in range(3)])
    length = np.linalg.norm(sums, axis=1, keepdims=True)
    alone = sums / np.where(length > 0, length, 1.0)
    is_free = np.bincount(label, free) > 0
    return np.column_stack([alone[label], is_free[label].astype(float)])


def _outward_normals(pieces: PatchPieces, piece: Index, s: Array, t: Array, outward: Array) -> Array:
    return normals_on(pieces, piece, s, t)[0] * outward[pieces.face[piece]][:, None]
