"""The map from any place to the piece of curve that is closest to it, worked out once for a nominal.

The curve is cut into short polynomial pieces; a quadtree over the places where measured points can lie is refined until
every cell knows, with proof, the one stretch of curve that can hold the closest point of all its points. Cells that the
medial axis crosses know several stretches. Everything is packed into two arrays, because a compiled call costs per array.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inspection.curve import NurbsCurve, left_of
from inspection.errors import NominalError
from inspection.kernels import BLOCK_LEVEL, FAR, LISTED, MOST_BRANCHES, VERTEX_WIDTH

Array = NDArray[np.float64]
Index = NDArray[np.int64]

LIST_WIDTH = 1 + MOST_BRANCHES
HEADER = 16  # numbers before the packed tables, in both arrays
_DEEPEST = 11  # smallest cells: half a thousandth of the size of the curve
_NEAR = 0.015  # band in which cells may become that small, as a fraction of the size
_BAND = 0.08  # band of the whole grid: beyond it every point is searched for along the whole curve
_PIECE_LENGTH = 1 / 100  # longest piece, as a fraction of the size
_PIECE_TURN = 1 / 8  # rad; a piece never turns by more, so that one third-order step from its middle comes close
_OVERLAP = 0.4  # a piece stays valid for this part of its length beyond its borders, within its knot span
_VERTEX_GRAIN = 2e-13  # part of a piece by which a foot may miss the end of the curve through round-off
_STEEPEST = 0.9  # a cell is certified where curvature x distance stays below this on the near side of the evolute
_STATION_ERROR = 1e-13  # of the arc length, as a fraction of the size
_MOST_PIECES = 200_000
_NODES = (np.arange(9) + 0.5) / 9  # inside a knot span, never on its borders


@dataclass(frozen=True, slots=True, eq=False)
class FootGrid:
    """Packed tables of a curve for `kernels.project`.

    reals      : header (origin x, y, blocks per mm, round-off of a place in mm, first and last parameter, length), then the pieces, their
                 bounds, the boxes of the search tree, the vertices
    integers   : header (blocks across, pieces, leaves of the tree, then where each table begins and the next ends, for the reals from 3,
                 for the integers from 8), then the links of the pieces, blocks, cells, lists
    pieces     : number of polynomial pieces
    cells      : number of cells of the grid
    band_mm    : half width of the band that the grid covers
    """

    reals: Array
    integers: NDArray[np.int32]
    pieces: int
    cells: int
    band_mm: float

    def __post_init__(self) -> None:
        self.reals.setflags(write=False)
        self.integers.setflags(write=False)


@dataclass(frozen=True, slots=True, eq=False)
class _Pieces:
    """Polynomial pieces in order along the curve.

    rows           : (p, PIECE_WIDTH)
    after, before  : (p,) the adjoining piece, or -1 - vertex
    start_mm, along_mm, sagitta_mm : (p, 2), (p, 2), (p,) chord and how far the piece strays from it
    middle_mm, tangent, curvature  : (p, 2), (p, 2), (p,) at the middle
    least, most    : (p,) range of curvature, overlap included
    reach_mm       : (p,) half the arc length, overlap included
    half_mm        : (p,) half the arc length
    length_mm      : (p,)
    vertices       : (v, VERTEX_WIDTH)
    cones          : (v, 2, 2) unit tangents before and after each vertex, 0 where there is none: the vertex can be closest to places
                     that lie ahead of the one and behind the other
    """

    rows: Array
    after: Index
    before: Index
    start_mm: Array
    along_mm: Array
    sagitta_mm: Array
    middle_mm: Array
    tangent: Array
    curvature: Array
    least: Array
    most: Array
    reach_mm: Array
    half_mm: Array
    length_mm: Array
    vertices: Array
    cones: Array

    def __len__(self) -> int:
        return len(self.rows)


def build_foot_grid(curve: NurbsCurve) -> FootGrid:
    """Tables for the closest point of `curve` to any place. Raises NominalError when the curve cannot be cut into pieces."""
    pieces = _pieces(curve)
    ends = np.vstack([pieces.start_mm, pieces.start_mm + pieces.along_mm])
    low, high = ends.min(axis=0), ends.max(axis=0)
    size = float((high - low).max())
    root = size * (1 + 2 * _BAND) * 1.02
    origin = (low + high) / 2 - root / 2
    leaves = _refine(pieces, origin, root, size)
    return _pack(pieces, origin, root, size, leaves, (*curve.domain, curve.length_mm))


# --- pieces -----------------------------------------------------------------------------------------------------------


def _pieces(curve: NurbsCurve) -> _Pieces:
    size = float(np.ptp(curve.control_points_mm, axis=0).max())
    low, high, span_low, span_high = _cut(curve, size)
    width, middle = high - low, (low + high) / 2
    smooth_before, smooth_after = low > span_low, high < span_high
    first = np.where(smooth_before, np.maximum(-0.5 - _OVERLAP, (span_low - middle) / width), -0.5)
    last = np.where(smooth_after, np.minimum(0.5 + _OVERLAP, (span_high - middle) / width), 0.5)
    coefficients = _coefficients(curve, middle, width)
    before, after, vertices, cones = _links(curve, low)
    is_end = np.append(vertices[:, 5] == 2, False)
    grain = np.where(is_end, _VERTEX_GRAIN, -_VERTEX_GRAIN)
    slack_before, slack_after = (np.where(link < 0, grain[np.where(link < 0, -1 - link, -1)], 1e-9) for link in (before, after))
    rows = np.column_stack([coefficients.reshape(-1, 12), middle, width, first - slack_before, last + slack_after])
    rows = np.column_stack([rows, _arc_length(rows, curve.station_mm(low))])
    return _with_geometry(rows, before, after, vertices, cones)


def _cut(curve: NurbsCurve, size: float) -> tuple[Array, Array, Array, Array]:
    """Halve every knot span until its parts are short, nearly straight, and polynomials of degree five."""
    start, end = curve.domain
    knots = np.unique(np.clip(curve.knots, start, end))
    low, high = knots[:-1], knots[1:]
    span_low, span_high = low, high
    done: list[tuple[Array, ...]] = []
    for _ in range(40):
        u = low[:, None] + (high - low)[:, None] * _NODES
        _, first, second = curve.derivatives(u.ravel(), 2).reshape(3, *u.shape, 2)
        speed = np.hypot(first[..., 0], first[..., 1])
        cross = np.abs(first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0])
        length = speed.mean(axis=1) * (high - low)
        with np.errstate(divide="ignore", invalid="ignore"):
            turn = (cross / speed**2).max(axis=1) * (high - low)
            uneven = speed.max(axis=1) / speed.min(axis=1)
        good = (length <= _PIECE_LENGTH * size) & (turn <= _PIECE_TURN) & (uneven <= 1.25)
        seventh = np.abs(np.diff(speed, 7, axis=1)).max(axis=1)  # 2.5 times the error of the arc length per parameter
        good &= seventh * (high - low) <= _STATION_ERROR * size
        good &= _is_quintic(curve, low, high, span_low, span_high, size)
        done.append((low[good], high[good], span_low[good], span_high[good]))
        middle = (low + high) / 2
        low, high, span_low, span_high = (
            np.concatenate([a[~good], b[~good]]) for a, b in ((low, middle), (middle, high), (span_low, span_low), (span_high, span_high))
        )
        if not low.size or len(low) > _MOST_PIECES:
            break
    if low.size:
        raise NominalError(f"the curve stands still or is not smooth near parameter {low[0]:g}: remove the repeated control point or knot")
    order = np.argsort(np.concatenate([part[0] for part in done]))
    cut = tuple(np.concatenate([part[i] for part in done])[order] for i in range(4))
    return cut[0], cut[1], cut[2], cut[3]


def _is_polynomial(curve: NurbsCurve) -> bool:
    """Whether every knot span is a polynomial of degree five or less as it stands."""
    assert curve.weights is not None
    return curve.degree <= 5 and bool(np.all(curve.weights == curve.weights[0]))


def _is_quintic(curve: NurbsCurve, low: Array, high: Array, span_low: Array, span_high: Array, size: float) -> NDArray[np.bool_]:
    """Whether a quintic misses the curve by a fraction of round-off, so that its tangent, too, is exact to round-off."""
    if _is_polynomial(curve):
        return np.ones(len(low), dtype=bool)
    width = high - low
    c = _taylor(curve, (low + high) / 2, width, 8)
    r = 0.5 + _OVERLAP
    missed = (np.abs(c) * np.array([0, 0, 0, 0, 0, 0, r**6 / 32, r**7 / 64, 2 * r**8])).sum(axis=2).max(axis=1)
    return np.asarray(missed <= 0.2 * np.finfo(float).eps * max(size, float(np.abs(curve.control_points_mm).max())))


def _taylor(curve: NurbsCurve, middle: Array, width: Array, order: int) -> Array:
    """Coefficients (p, 2, order + 1) of C(middle + width t)."""
    factor = _powers(width, order + 1) / np.cumprod(np.maximum(np.arange(order + 1), 1.0))[:, None]  # (order + 1, p)
    return np.ascontiguousarray((curve.derivatives(middle, order) * factor[:, :, None]).transpose(1, 2, 0))


def _coefficients(curve: NurbsCurve, middle: Array, width: Array) -> Array:
    """Coefficients (p, 2, 6) of the quintics: the curve's own, or its seventh Taylor polynomial less Chebyshev's of degree 7 and 6."""
    if _is_polynomial(curve):
        return _taylor(curve, middle, width, 5)
    c = _taylor(curve, middle, width, 7)
    r = 0.5 + _OVERLAP
    seventh, sixth = c[:, :, 7:], c[:, :, 6:7]
    c[:, :, 1:6:2] += seventh * (np.array([7 * r**6, -56 * r**4, 112 * r**2]) / 64)
    c[:, :, 0:5:2] += sixth * (np.array([r**6, -18 * r**4, 48 * r**2]) / 32)
    return np.ascontiguousarray(c[:, :, :6])


def _arc_length(rows: Array, start_mm: Array) -> Array:
    """Coefficients (p, 8) of the arc length from the start of the curve: the speed, a sextic through seven of its values, integrated."""
    c = rows[:, :12].reshape(-1, 2, 6)
    first, last = rows[:, 14:15], rows[:, 15:16]
    t = (first + last) / 2 + (last - first) / 2 * np.cos((2 * np.arange(7) + 1) * np.pi / 14)  # (p, 7)
    velocity = np.einsum("pdk,kpt->ptd", c[:, :, 1:] * np.arange(1, 6), _powers(t, 5))
    speed = np.hypot(velocity[..., 0], velocity[..., 1])
    fitted = _through(t, speed) / np.arange(1, 8)
    return np.column_stack([start_mm - (fitted * (-0.5) ** np.arange(1, 8)).sum(axis=1), fitted])


def _powers(x: Array, count: int) -> Array:
    """Powers 0 .. count - 1 of x, along a new first axis; multiplied out, so that every processor gives the same bits."""
    return np.asarray(np.cumprod(np.stack([np.ones_like(x), *[x] * (count - 1)]), axis=0), dtype=np.float64)


def _through(t: Array, value: Array) -> Array:
    """Coefficients (p, n), lowest first, of the polynomials through n values each: Newton's differences, then multiplied out.

    Not LAPACK, whose last bits depend on the processor.
    """
    n = t.shape[1]
    newton = value.copy()
    for order in range(1, n):
        newton[:, order:] = (newton[:, order:] - newton[:, order - 1 : -1]) / (t[:, order:] - t[:, : n - order])
    result = np.zeros_like(value)
    for order in range(n - 1, -1, -1):  # Horner: result <- result (t - t[order]) + newton[order]
        result[:, 1:], result[:, 0] = result[:, :-1] - t[:, order, None] * result[:, 1:], newton[:, order] - t[:, order] * result[:, 0]
    return result


def _links(curve: NurbsCurve, low: Array) -> tuple[Index, Index, Array, Array]:
    """The piece before and after each piece, or -1 - vertex; vertices (corners, then the ends of an open curve) and their cones."""
    count = len(low)
    before, after = np.arange(-1, count - 1), np.arange(1, count + 1)
    before[0], after[-1] = count - 1, 0
    made = []
    for corner in curve.corners:
        follower = int(np.argmin(np.abs(low - corner)))
        made.append(_vertex(curve, corner, 1.0))
        after[before[follower]], before[follower] = -len(made), -len(made)
    if not curve.closed:
        before[0], after[-1] = -1 - len(made), -2 - len(made)
        made += [_vertex(curve, end, 2.0) for end in curve.domain]
        made[-2][1][0], made[-1][1][1] = 0.0, 0.0
    rows, cones = np.array([row for row, _ in made]), np.array([cone for _, cone in made])
    return before, after, rows.reshape(-1, VERTEX_WIDTH), cones.reshape(-1, 2, 2)


def _vertex(curve: NurbsCurve, u: float, kind: float) -> tuple[Array, Array]:
    """One row of the vertices, and the tangents (2, 2) there. The pseudo-normal is the bisector of both normals (of a cusp: the later)."""
    here = np.array([u])
    point, tangent = curve.derivatives(here, 1)[:, 0]
    later = tangent / np.hypot(*tangent)
    tangent = curve.derivatives(left_of(here, curve), 1)[1, 0] if kind == 1.0 else later
    earlier = tangent / np.hypot(*tangent)
    both = later + earlier
    both = both / np.hypot(*both) if np.hypot(*both) > 1e-9 else later
    station = float(curve.station_mm(here)[0])
    return np.array([point[0], point[1], -both[1], both[0], u, kind, station, 0.0]), np.array([earlier, later])


def _with_geometry(rows: Array, before: Index, after: Index, vertices: Array, cones: Array) -> _Pieces:
    """Chords, frames and bounds of the pieces from their coefficients."""
    c = rows[:, :12].reshape(-1, 2, 6)
    first, last = rows[:, 14], rows[:, 15]
    t = first[:, None] + (last - first)[:, None] * np.linspace(0, 1, 9)  # (p, 9)
    powers = np.arange(6)
    velocity = np.einsum("pdk,ptk->ptd", c[:, :, 1:] * powers[1:], t[:, :, None] ** powers[:5])
    bend = np.einsum("pdk,ptk->ptd", c[:, :, 2:] * (powers[2:] * powers[1:5]), t[:, :, None] ** powers[:4])
    speed = np.hypot(velocity[..., 0], velocity[..., 1])
    curvature = (velocity[..., 0] * bend[..., 1] - velocity[..., 1] * bend[..., 0]) / speed**3
    spread = 0.25 * np.ptp(curvature, axis=1)  # what may hide between nine samples
    start, stop = (np.einsum("pdk,k->pd", c, np.array(side) ** powers) for side in (-0.5, 0.5))
    tangent = c[:, :, 1] / np.hypot(c[:, 0, 1], c[:, 1, 1])[:, None]
    second = np.abs(c[:, :, 2:] * (powers[2:] * powers[1:5]) * 0.5 ** powers[:4]).sum(axis=2)  # bound of |C''|
    middle_speed = np.hypot(c[:, 0, 1], c[:, 1, 1])
    return _Pieces(
        rows=rows,
        after=after,
        before=before,
        start_mm=start,
        along_mm=stop - start,
        sagitta_mm=np.hypot(second[:, 0], second[:, 1]) / 8,
        middle_mm=c[:, :, 0],
        tangent=tangent,
        curvature=2 * (c[:, 0, 1] * c[:, 1, 2] - c[:, 1, 1] * c[:, 0, 2]) / middle_speed**3,
        least=curvature.min(axis=1) - spread,
        most=curvature.max(axis=1) + spread,
        reach_mm=speed.max(axis=1) * np.maximum(-first, last),
        half_mm=speed.max(axis=1) / 2,
        length_mm=middle_speed,
        vertices=vertices,
        cones=cones,
    )


# --- quadtree ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, eq=False)
class _Leaves:
    """Finished cells: level, x and y index at that level, content; and the lists of pieces of LISTED cells."""

    level: Index
    x: Index
    y: Index
    content: Index
    lists: Index


@dataclass(slots=True, eq=False)
class _Pairs:
    """Cells of one level with the pieces that may hold the closest point of one of their points, sorted by cell, then piece.

    x, y  : (c,) index of the cell
    first : (c,) its first pair
    cell, piece : (k,) the pairs
    """

    x: Index
    y: Index
    first: Index
    cell: Index
    piece: Index


def _refine(pieces: _Pieces, origin: Array, root: float, size: float) -> _Leaves:
    """Split cells until each is certified, or as small as its distance from the curve allows."""
    level = 0
    count = len(pieces)
    pairs = _Pairs(np.zeros(1, np.int64), np.zeros(1, np.int64), np.zeros(1, np.int64), np.zeros(count, np.int64), np.arange(count))
    done: list[tuple[Index, ...]] = []
    lists: list[Index] = [np.zeros(0, np.int64)]
    while len(pairs.x):
        side = root / 2**level
        radius = side * np.sqrt(0.5) * (1 + 1e-9)
        centre = origin + (np.column_stack([pairs.x, pairs.y]) + 0.5) * side
        lowest = _keep_near(pairs, pieces, centre, radius)
        view = _keep_feet(pairs, pieces, centre, radius)
        far = lowest - radius > _BAND * size
        deepest = np.where(lowest - radius > _NEAR * size, _DEEPEST - 2, _DEEPEST)
        branches, certified, fits = _judge(pairs, pieces, centre, view, radius)
        single = (branches == 1) & certified & (fits | (level >= deepest - 1))
        last = level >= deepest
        ready = ~far & (level >= BLOCK_LEVEL) & (single | last)
        content = np.where(single, pairs.piece[view.nearest], FAR)
        listed = np.flatnonzero(ready & ~single & certified)
        content[listed] = _lists(pairs, pieces, centre, radius, listed, lists)
        rows = np.flatnonzero(ready)
        done.append((np.full(len(rows), level), pairs.x[rows], pairs.y[rows], content[rows]))
        pairs = _split(pairs, ~far & ~ready)
        level += 1
    joined = [np.concatenate([part[i] for part in done]) for i in range(4)]
    return _Leaves(joined[0], joined[1], joined[2], joined[3], np.concatenate(lists))


def _chord_distance(pairs: _Pairs, pieces: _Pieces, centre: Array) -> Array:
    """Distance (k,) of each pair's cell centre from the chord of its piece."""
    p, x, y = pairs.piece, centre[pairs.cell, 0], centre[pairs.cell, 1]
    x -= pieces.start_mm[p, 0]
    y -= pieces.start_mm[p, 1]
    ax, ay = pieces.along_mm[p, 0], pieces.along_mm[p, 1]
    t = np.clip((x * ax + y * ay) / (ax * ax + ay * ay), 0.0, 1.0)
    x -= t * ax
    y -= t * ay
    return np.asarray(np.sqrt(x * x + y * y))


def _keep_near(pairs: _Pairs, pieces: _Pieces, centre: Array, radius: float) -> Array:
    """Drop pairs too far away to hold a closest point; the least distance (c,) of every cell.

    A point of the cell is at most upper + radius from the curve, so its foot is at most upper + 2 radius from the centre.
    """
    distance = _chord_distance(pairs, pieces, centre)
    sagitta = pieces.sagitta_mm[pairs.piece]
    upper = np.minimum.reduceat(distance + sagitta, pairs.first)
    lowest = np.minimum.reduceat(distance - sagitta, pairs.first)
    _keep(pairs, distance - sagitta <= (upper + 2 * radius)[pairs.cell])
    return lowest


def _keep(pairs: _Pairs, kept: NDArray[np.bool_]) -> None:
    pairs.cell, pairs.piece = pairs.cell[kept], pairs.piece[kept]
    pairs.first = np.flatnonzero(np.diff(pairs.cell, prepend=-1))


@dataclass(frozen=True, slots=True, eq=False)
class _View:
    """Each pair's piece seen from the centre of the cell.

    along, aside : (k,) coordinates of the centre in the frame at the middle of the piece
    steepest     : (k,) upper bound of curvature x signed distance over piece and cell: below one, there is one foot at most
    nearest      : (c,) the pair of the piece nearest to the centre
    """

    along: Array
    aside: Array
    steepest: Array
    nearest: Index


def _keep_feet(pairs: _Pairs, pieces: _Pieces, centre: Array, radius: float) -> _View:
    """Drop pairs whose piece is no point's foot: the tangential distance keeps its sign, or every foot would be a farthest point."""
    p = pairs.piece
    along, aside = _in_frame(pieces, p, centre[pairs.cell])
    flattest, steepest = _steepness(pieces, p, along, aside, radius)
    change = np.maximum(np.abs(1 - flattest), np.abs(1 - steepest)) * pieces.half_mm[p] + 2e-6 * (np.abs(aside) + radius)
    kept = (np.abs(along) - radius <= change) & (flattest <= 1)
    at_vertex = np.flatnonzero((pieces.after[p] < 0) | (pieces.before[p] < 0))
    kept[at_vertex] |= _may_end_at_vertex(pieces, p[at_vertex], centre[pairs.cell[at_vertex]], radius)
    _keep(pairs, kept)
    along, aside, steepest = along[kept], aside[kept], steepest[kept]
    distance = _chord_distance(pairs, pieces, centre)
    is_least = np.flatnonzero(distance == np.minimum.reduceat(distance, pairs.first)[pairs.cell])
    nearest = is_least[np.flatnonzero(np.diff(pairs.cell[is_least], prepend=-1))]
    return _View(along, aside, steepest, nearest)


def _may_end_at_vertex(pieces: _Pieces, p: Index, place: Array, radius: float) -> NDArray[np.bool_]:
    """Whether the vertex that the pieces p (k,) answer for can be closest to a point of the cell: that at their end, or an open start."""
    is_start = (pieces.before[p] < 0) & (pieces.vertices[-1 - np.minimum(pieces.before[p], -1), 5] == 2)
    vertex = np.where(pieces.after[p] < 0, -1 - pieces.after[p], np.where(is_start, -1 - pieces.before[p], -1))
    x, y = place[:, 0] - pieces.vertices[vertex, 0], place[:, 1] - pieces.vertices[vertex, 1]
    cone = pieces.cones[vertex]
    ahead = x * cone[:, 0, 0] + y * cone[:, 0, 1] >= -radius * (1 + 1e-9)
    behind = x * cone[:, 1, 0] + y * cone[:, 1, 1] <= radius * (1 + 1e-9)
    return np.asarray(ahead & behind & (vertex >= 0))


def _in_frame(pieces: _Pieces, p: Index, place: Array) -> tuple[Array, Array]:
    """Coordinates (k,) of places (k, 2) along and to the left of the tangent at the middle of the pieces p (k,)."""
    x, y = place[:, 0] - pieces.middle_mm[p, 0], place[:, 1] - pieces.middle_mm[p, 1]
    tx, ty = pieces.tangent[p, 0], pieces.tangent[p, 1]
    return x * tx + y * ty, y * tx - x * ty


def _breaks(pairs: _Pairs, pieces: _Pieces) -> NDArray[np.bool_]:
    """Pairs (k,) at which a new stretch of curve begins within their cell, the first of the cell included."""
    piece = pairs.piece
    starts = np.ones(len(piece), dtype=bool)
    starts[1:] = (pieces.before[piece[1:]] != piece[:-1]) | (pairs.cell[1:] != pairs.cell[:-1])
    return starts


def _judge(pairs: _Pairs, pieces: _Pieces, centre: Array, view: _View, radius: float) -> tuple[Index, NDArray[np.bool_], NDArray[np.bool_]]:
    """For every cell: stretches of curve, whether each has one foot at most, whether the nearest piece covers all feet of the cell."""
    starts = _breaks(pairs, pieces)
    branches = np.add.reduceat(starts.astype(np.int64), pairs.first)
    final = np.append(pairs.first[1:], len(pairs.piece)) - 1
    around_seam = pieces.before[pairs.piece[pairs.first]] == pairs.piece[final]
    branches -= around_seam & (branches > 1)
    certified = np.maximum.reduceat(view.steepest, pairs.first) < _STEEPEST
    nearest = view.nearest
    p, along, aside = pairs.piece[nearest], view.along[nearest], view.aside[nearest]
    certified &= _neighbours_certified(pieces, p, centre, radius)
    foot = along / np.maximum(1 - pieces.curvature[p] * aside, 0.1) / pieces.length_mm[p]
    reach = radius / np.clip(1 - view.steepest[nearest], 0.1, 1.0) / pieces.length_mm[p]
    fits = (foot - reach >= pieces.rows[p, 14]) | (pieces.before[p] < 0)
    fits &= (foot + reach <= pieces.rows[p, 15]) | (pieces.after[p] < 0)
    return branches, certified, fits


def _neighbours_certified(pieces: _Pieces, p: Index, centre: Array, radius: float) -> NDArray[np.bool_]:
    """Whether the pieces before and after p (c,), too, have one foot at most for points near centre (c, 2)."""
    certified = np.ones(len(p), dtype=bool)
    for link in (pieces.before[p], pieces.after[p]):
        neighbour = np.where(link >= 0, link, p)
        along, aside = _in_frame(pieces, neighbour, centre)
        certified &= _steepness(pieces, neighbour, along, aside, radius)[1] < _STEEPEST
    return certified


def _steepness(pieces: _Pieces, p: Index, along: Array, aside: Array, radius: float) -> tuple[Array, Array]:
    """Bounds (k,) of curvature x signed distance over a piece, its overlap, and all points of the cell.

    The tangential distance changes by 1 - curvature x signed distance per millimetre of the curve.
    """
    least, most, reach = pieces.least[p], pieces.most[p], pieces.reach_mm[p]
    sharpest = np.maximum(np.abs(least), np.abs(most))
    drift = sharpest * (np.abs(along) + 2 * reach * np.maximum(1.0, sharpest * np.abs(aside))) * reach + radius
    low, high = aside - drift, aside + drift
    corners = least * low, least * high, most * low, most * high
    flattest = np.minimum(np.minimum(corners[0], corners[1]), np.minimum(corners[2], corners[3]))
    return flattest, np.maximum(np.maximum(corners[0], corners[1]), np.maximum(corners[2], corners[3]))


def _lists(pairs: _Pairs, pieces: _Pieces, centre: Array, radius: float, cells: Index, lists: list[Index]) -> Index:
    """What the cells hold: the place in `lists` (rows of LIST_WIDTH: count, pieces) of the nearest piece of each of their stretches."""
    if not cells.size:
        return cells
    starts = np.flatnonzero(_breaks(pairs, pieces))  # (s,) first pair of each stretch
    distance = _chord_distance(pairs, pieces, centre)
    stretch = np.zeros(len(pairs.cell), dtype=np.int64)
    stretch[starts[1:]] = 1
    is_least = np.flatnonzero(distance == np.minimum.reduceat(distance, starts)[np.cumsum(stretch)])
    chosen = pairs.piece[is_least[np.searchsorted(is_least, starts)]]  # (s,)
    certified = _neighbours_certified(pieces, chosen, centre[pairs.cell[starts]], radius)
    first = np.searchsorted(starts, pairs.first[cells])
    count = np.searchsorted(starts, np.append(pairs.first, len(pairs.cell))[cells + 1]) - first
    rows = np.zeros((len(cells), LIST_WIDTH), dtype=np.int64)
    rows[:, 0] = count
    good = count < LIST_WIDTH
    for branch in range(LIST_WIDTH - 1):
        has = good & (branch < count)
        rows[has, 1 + branch] = chosen[first[has] + branch]
        good[has] &= certified[first[has] + branch]
    place = sum(map(len, lists))
    distinct, which = np.unique(rows[good], axis=0, return_inverse=True)
    lists.append(distinct.ravel())
    content = np.full(len(cells), FAR)
    content[good] = LISTED - (place + LIST_WIDTH * which.ravel())
    return content


def _split(pairs: _Pairs, chosen: NDArray[np.bool_]) -> _Pairs:
    """The four quarters of every chosen cell, each with its parent's pairs."""
    new = np.cumsum(chosen) - 1
    kept = chosen[pairs.cell]
    cell, piece = new[pairs.cell[kept]], pairs.piece[kept]
    count = int(chosen.sum())
    x, y = 2 * pairs.x[chosen], 2 * pairs.y[chosen]
    cells = np.concatenate([cell + quarter * count for quarter in range(4)])
    first = np.flatnonzero(np.diff(cells, prepend=-1))
    return _Pairs(np.concatenate([x, x + 1, x, x + 1]), np.concatenate([y, y, y + 1, y + 1]), first, cells, np.tile(piece, 4))


# --- packing ----------------------------------------------------------------------------------------------------------


def _pack(pieces: _Pieces, origin: Array, root: float, size: float, leaves: _Leaves, ends: tuple[float, float, float]) -> FootGrid:
    across = 2**BLOCK_LEVEL
    blocks, cells = _cells(leaves)
    boxes = _search_tree(pieces)
    bounds = _bounds(pieces)
    tables = [np.zeros(HEADER), pieces.rows.ravel(), bounds.ravel(), boxes.ravel(), pieces.vertices.ravel()]
    links = np.column_stack([pieces.before, pieces.after])
    index_tables = [np.zeros(HEADER, np.int64), links.ravel(), blocks.ravel(), cells, leaves.lists]
    real_at = np.cumsum([len(table) for table in tables])
    index_at = np.cumsum([len(table) for table in index_tables])
    tables[0][:4] = [origin[0], origin[1], across / root, 16 * np.finfo(float).eps * (size + np.abs(origin).max())]
    tables[0][4:7] = ends
    index_tables[0][:13] = [across, len(pieces), len(boxes) // 2, *real_at, *index_at]
    return FootGrid(_aligned(np.concatenate(tables)), np.concatenate(index_tables).astype(np.int32), len(pieces), len(cells), _BAND * size)


def _aligned(numbers: Array) -> Array:
    """The same numbers, beginning on a cache line."""
    memory = np.empty(len(numbers) + 8)
    skip = (-memory.ctypes.data % 64) // 8
    memory[skip : skip + len(numbers)] = numbers
    return memory[skip : skip + len(numbers)]


def _cells(leaves: _Leaves) -> tuple[Index, Index]:
    """Blocks (across x across,), 16 x offset + depth of their cells or FAR, and the content of all cells."""
    across = 2**BLOCK_LEVEL
    depth = leaves.level - BLOCK_LEVEL
    block = (leaves.y >> depth) * across + (leaves.x >> depth)
    deepest = np.full(across * across, -1)
    np.maximum.at(deepest, block, depth)
    offset = np.concatenate([[0], np.cumsum(np.where(deepest < 0, 0, 4 ** np.maximum(deepest, 0)))])
    cells = np.full(offset[-1], FAR)
    finer = deepest[block] - depth
    for fine in np.unique(finer):
        rows = np.flatnonzero(finer == fine)
        row_depth = deepest[block[rows]]
        step = np.arange(2**fine)
        x = ((leaves.x[rows] << fine) & ((1 << row_depth) - 1))[:, None, None] + step[None, None, :]
        y = ((leaves.y[rows] << fine) & ((1 << row_depth) - 1))[:, None, None] + step[None, :, None]
        place = offset[block[rows]][:, None, None] + (y << row_depth[:, None, None]) + x
        cells[place] = leaves.content[rows][:, None, None]
    return np.where(deepest < 0, -1, 16 * offset[:-1] + deepest), cells


def _bounds(pieces: _Pieces) -> Array:
    """Bounds (p, 4) of the first four derivatives on each piece."""
    c = np.abs(pieces.rows[:, :12].reshape(-1, 2, 6))
    result = np.zeros((len(pieces), 4))
    factor = np.ones(6)
    for order in range(4):
        factor = factor * np.maximum(np.arange(6) - order, 0)
        terms = c * factor * 0.5 ** np.maximum(np.arange(6) - order - 1, 0)
        result[:, order] = np.hypot(*terms.sum(axis=2).T)
    return result


def _search_tree(pieces: _Pieces) -> Array:
    """Bounding boxes (2 q, 4) of a binary tree over the pieces: node 1 is the root, node q + p is piece p; low x, y, high x, y."""
    q = 1 << max(0, (len(pieces) - 1).bit_length())
    boxes = np.full((2 * q, 4), np.inf)
    boxes[:, 2:] = -np.inf
    ends = np.stack([pieces.start_mm, pieces.start_mm + pieces.along_mm])
    sagitta = pieces.sagitta_mm[:, None] * (1 + 1e-9)
    boxes[q : q + len(pieces)] = np.hstack([ends.min(axis=0) - sagitta, ends.max(axis=0) + sagitta])
    while q > 1:
        children = boxes[q : 2 * q].reshape(q // 2, 2, 4)
        boxes[q // 2 : q] = np.hstack([children[:, :, :2].min(axis=1), children[:, :, 2:].max(axis=1)])
        q //= 2
    return boxes
