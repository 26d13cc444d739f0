"""A curve cut into short polynomial pieces, each with what bounds it: the closest point to any place is looked up among them.

A piece is a quintic in a parameter t of its own, from -0.5 to 0.5. It equals the curve to round-off and stays valid a little
beyond both its borders, so that a foot near a border is found from either side.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inspection.box_tree import box_tree
from inspection.curve import NurbsCurve, left_limit
from inspection.errors import NominalError
from inspection.kernels.layout import (
    BOUND_WIDTH,
    CORNER,
    OPEN_END,
    PIECE_DEGREE,
    PIECE_END,
    PIECE_FIRST,
    PIECE_LAST,
    PIECE_U,
    VERTEX_KIND,
    VERTEX_NORMAL_X,
    VERTEX_NORMAL_Y,
    VERTEX_STATION,
    VERTEX_U,
    VERTEX_WIDTH,
    VERTEX_X,
    VERTEX_Y,
)

Array = NDArray[np.float64]
Index = NDArray[np.int64]

_PIECE_LENGTH = 1 / 100  # longest piece, as a fraction of the size
_PIECE_TURN = 1 / 8  # rad; a piece never turns by more, so that one third-order step from its middle comes close
_PIECE_UNEVENNESS = 1.25  # largest ratio of the speeds within a piece
_OVERLAP = 0.4  # a piece stays valid for this part of its length beyond its borders, within its knot span
_VERTEX_GRAIN = 2e-13  # part of a piece by which a foot may miss the end of the curve through round-off
_STATION_ERROR = 1e-13  # of the arc length, as a fraction of the size
_MOST_PIECES = 200_000
_MOST_HALVINGS = 40
_NODES = (np.arange(9) + 0.5) / 9  # inside a knot span, never on its borders


@dataclass(frozen=True, slots=True, eq=False)
class CurvePieces:
    """Polynomial pieces in order along the curve.

    rows           : (p, PIECE_WIDTH) the polynomials, as the compiled loops take them
    after, before  : (p,) the piece that follows and the one that comes before; where a vertex ends the piece, -1 - its number
    start_mm       : (p, 2) where the chord begins
    along_mm       : (p, 2) from there to where the chord ends
    sagitta_mm     : (p,) bound of the distance between piece and chord
    middle_mm      : (p, 2) the point at t = 0; tangent (p, 2) and curvature (p,) are those there
    least, most    : (p,) bounds of the curvature in 1/mm, overlap included
    reach_mm       : (p,) bound of the arc length from the middle to either side, overlap included
    half_mm        : (p,) bound of half the arc length
    length_mm      : (p,) arc length that one unit of t is worth at the middle
    vertices       : (v, VERTEX_WIDTH) corners, then the ends of an open curve
    cones          : (v, 2, 2) unit tangents before and after each vertex, 0 where the curve does not go on. A vertex can only
                     be the closest point of places that lie ahead of the first tangent and behind the second
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


def cut_into_pieces(curve: NurbsCurve) -> CurvePieces:
    """Cut a curve into pieces. Raises NominalError where it stands still or is not smooth."""
    size = float(np.ptp(curve.control_points_mm, axis=0).max())
    low, high, span_low, span_high = _halve_spans(curve, size)
    width, middle = high - low, (low + high) / 2
    smooth_before, smooth_after = low > span_low, high < span_high
    first = np.where(smooth_before, np.maximum(-PIECE_END - _OVERLAP, (span_low - middle) / width), -PIECE_END)
    last = np.where(smooth_after, np.minimum(PIECE_END + _OVERLAP, (span_high - middle) / width), PIECE_END)
    coefficients = _quintic_coefficients(curve, middle, width)
    before, after, vertices, cones = _links(curve, low)
    is_end = np.append(vertices[:, VERTEX_KIND] == OPEN_END, False)
    grain = np.where(is_end, _VERTEX_GRAIN, -_VERTEX_GRAIN)
    slack_before, slack_after = (np.where(link < 0, grain[np.where(link < 0, -1 - link, -1)], 1e-9) for link in (before, after))
    rows = np.column_stack([coefficients.reshape(-1, PIECE_U), middle, width, first - slack_before, last + slack_after])
    rows = np.column_stack([rows, _arc_length_coefficients(rows, curve.station_mm(low))])
    return _measure_pieces(rows, before, after, vertices, cones)


def _halve_spans(curve: NurbsCurve, size: float) -> tuple[Array, Array, Array, Array]:
    """Halve every knot span until its parts are short, nearly straight, and polynomials of degree five.

    Gives the first and last parameter (p,) of each part, and those of the knot span that it is a part of.
    """
    start, end = curve.domain
    knots = np.unique(np.clip(curve.knots, start, end))
    low, high = knots[:-1], knots[1:]
    span_low, span_high = low, high
    done: list[tuple[Array, ...]] = []
    for _ in range(_MOST_HALVINGS):
        good = _is_fine_enough(curve, low, high, size) & _is_quintic(curve, low, high, size)
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


def _is_fine_enough(curve: NurbsCurve, low: Array, high: Array, size: float) -> NDArray[np.bool_]:
    """Whether the stretches from low (k,) to high (k,) are short, nearly straight, of even speed, and of known arc length."""
    u = low[:, None] + (high - low)[:, None] * _NODES
    _, first, second = curve.derivatives(u.ravel(), 2).reshape(3, *u.shape, 2)
    speed = np.hypot(first[..., 0], first[..., 1])
    cross = np.abs(first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0])
    length = speed.mean(axis=1) * (high - low)
    with np.errstate(divide="ignore", invalid="ignore"):
        turn = (cross / speed**2).max(axis=1) * (high - low)
        unevenness = speed.max(axis=1) / speed.min(axis=1)
    seventh = np.abs(np.diff(speed, 7, axis=1)).max(axis=1)  # 2.5 times the error of the arc length per parameter
    small = (length <= _PIECE_LENGTH * size) & (turn <= _PIECE_TURN) & (unevenness <= _PIECE_UNEVENNESS)
    return np.asarray(small & (seventh * (high - low) <= _STATION_ERROR * size))


def _is_polynomial(curve: NurbsCurve) -> bool:
    """Whether every knot span is a polynomial of degree five or less as it stands."""
    assert curve.weights is not None
    return curve.degree <= PIECE_DEGREE and bool(np.all(curve.weights == curve.weights[0]))


def _is_quintic(curve: NurbsCurve, low: Array, high: Array, size: float) -> NDArray[np.bool_]:
    """Whether a quintic misses the curve by no more than a fraction of round-off: its tangent is then exact to round-off as well."""
    if _is_polynomial(curve):
        return np.ones(len(low), dtype=bool)
    width = high - low
    c = _taylor_coefficients(curve, (low + high) / 2, width, 8)
    r = 0.5 + _OVERLAP
    missed = (np.abs(c) * np.array([0, 0, 0, 0, 0, 0, r**6 / 32, r**7 / 64, 2 * r**8])).sum(axis=2).max(axis=1)
    return np.asarray(missed <= 0.2 * np.finfo(float).eps * max(size, float(np.abs(curve.control_points_mm).max())))


def _taylor_coefficients(curve: NurbsCurve, middle: Array, width: Array, order: int) -> Array:
    """Coefficients (p, 2, order + 1) of C(middle + width t)."""
    factor = _powers(width, order + 1) / np.cumprod(np.maximum(np.arange(order + 1), 1.0))[:, None]  # (order + 1, p)
    return np.ascontiguousarray((curve.derivatives(middle, order) * factor[:, :, None]).transpose(1, 2, 0))


def _quintic_coefficients(curve: NurbsCurve, middle: Array, width: Array) -> Array:
    """Coefficients (p, 2, 6) of the quintics.

    A curve of degree five or less is its own quintic. For any other curve the two highest terms of the Taylor polynomial of
    degree 7 are cancelled by subtracting multiples of the Chebyshev polynomials of degree 7 and 6.
    """
    if _is_polynomial(curve):
        return _taylor_coefficients(curve, middle, width, 5)
    c = _taylor_coefficients(curve, middle, width, 7)
    r = 0.5 + _OVERLAP
    seventh, sixth = c[:, :, 7:], c[:, :, 6:7]
    c[:, :, 1:6:2] += seventh * (np.array([7 * r**6, -56 * r**4, 112 * r**2]) / 64)
    c[:, :, 0:5:2] += sixth * (np.array([r**6, -18 * r**4, 48 * r**2]) / 32)
    return np.ascontiguousarray(c[:, :, :6])


def _arc_length_coefficients(rows: Array, start_mm: Array) -> Array:
    """Coefficients (p, 8) of the arc length from the start of the curve: the integral of the sextic through seven values of the speed."""
    c = _coordinates(rows)
    first, last = rows[:, PIECE_FIRST, None], rows[:, PIECE_LAST, None]
    t = (first + last) / 2 + (last - first) / 2 * np.cos((2 * np.arange(7) + 1) * np.pi / 14)  # (p, 7)
    velocity = np.einsum("pdk,kpt->ptd", c[:, :, 1:] * np.arange(1, 6), _powers(t, 5))
    speed = np.hypot(velocity[..., 0], velocity[..., 1])
    fitted = _interpolating_polynomials(t, speed) / np.arange(1, 8)
    return np.column_stack([start_mm - (fitted * (-0.5) ** np.arange(1, 8)).sum(axis=1), fitted])


def _powers(x: Array, count: int) -> Array:
    """Powers 0 .. count - 1 of x along a new first axis, by multiplication alone, so that every processor gives the same bits."""
    return np.asarray(np.cumprod(np.stack([np.ones_like(x), *[x] * (count - 1)]), axis=0), dtype=np.float64)


def _interpolating_polynomials(t: Array, value: Array) -> Array:
    """Coefficients (p, n), lowest first, of the polynomials through n values each, by Newton's divided differences.

    LAPACK is not used because its last bits depend on the processor.
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
    """What comes before and after each piece, and the vertices with their cones, as `CurvePieces` holds them."""
    count = len(low)
    before, after = np.arange(-1, count - 1), np.arange(1, count + 1)
    before[0], after[-1] = count - 1, 0
    made = []
    for corner in curve.corners:
        follower = int(np.argmin(np.abs(low - corner)))
        made.append(_vertex_row(curve, corner, CORNER))
        after[before[follower]], before[follower] = -len(made), -len(made)
    if not curve.closed:
        before[0], after[-1] = -1 - len(made), -2 - len(made)
        made += [_vertex_row(curve, end, OPEN_END) for end in curve.domain]
        made[-2][1][0], made[-1][1][1] = 0.0, 0.0
    rows, cones = np.array([row for row, _ in made]), np.array([cone for _, cone in made])
    return before, after, rows.reshape(-1, VERTEX_WIDTH), cones.reshape(-1, 2, 2)


def _vertex_row(curve: NurbsCurve, u: float, kind: int) -> tuple[Array, Array]:
    """The row of one vertex, and the unit tangents (2, 2) before and after it.

    Its pseudo-normal is the bisector of the two normals; at a cusp, where they cancel, it is the later one.
    """
    here = np.array([u])
    point, tangent = curve.derivatives(here, 1)[:, 0]
    later = tangent / np.hypot(*tangent)
    tangent = curve.derivatives(left_limit(here, curve), 1)[1, 0] if kind == CORNER else later
    earlier = tangent / np.hypot(*tangent)
    both = later + earlier
    both = both / np.hypot(*both) if np.hypot(*both) > 1e-9 else later
    row = np.zeros(VERTEX_WIDTH)
    row[VERTEX_X], row[VERTEX_Y] = point
    row[VERTEX_NORMAL_X], row[VERTEX_NORMAL_Y] = -both[1], both[0]
    row[VERTEX_U], row[VERTEX_KIND], row[VERTEX_STATION] = u, kind, curve.station_mm(here)[0]
    return row, np.array([earlier, later])


def _measure_pieces(rows: Array, before: Index, after: Index, vertices: Array, cones: Array) -> CurvePieces:
    """The pieces with their chords, frames and bounds, all worked out from their coefficients."""
    c = _coordinates(rows)
    first, last = rows[:, PIECE_FIRST], rows[:, PIECE_LAST]
    t = first[:, None] + (last - first)[:, None] * np.linspace(0, 1, 9)  # (p, 9)
    powers = np.arange(6)
    velocity = np.einsum("pdk,ptk->ptd", c[:, :, 1:] * powers[1:], t[:, :, None] ** powers[:5])
    bend = np.einsum("pdk,ptk->ptd", c[:, :, 2:] * (powers[2:] * powers[1:5]), t[:, :, None] ** powers[:4])
    speed = np.hypot(velocity[..., 0], velocity[..., 1])
    curvature = (velocity[..., 0] * bend[..., 1] - velocity[..., 1] * bend[..., 0]) / speed**3
    spread = 0.25 * np.ptp(curvature, axis=1)  # how far the curvature may go beyond its values at nine places
    start, stop = (np.einsum("pdk,k->pd", c, np.array(side) ** powers) for side in (-PIECE_END, PIECE_END))
    tangent = c[:, :, 1] / np.hypot(c[:, 0, 1], c[:, 1, 1])[:, None]
    second = np.abs(c[:, :, 2:] * (powers[2:] * powers[1:5]) * 0.5 ** powers[:4]).sum(axis=2)  # bound of |C''|
    middle_speed = np.hypot(c[:, 0, 1], c[:, 1, 1])
    return CurvePieces(
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


def _coordinates(rows: Array) -> Array:
    """The coefficients (p, 2, 6) of x and y in the rows of pieces."""
    return rows[:, :PIECE_U].reshape(-1, 2, PIECE_DEGREE + 1)


def derivative_bounds(pieces: CurvePieces) -> Array:
    """Bounds (p, 4) of the first four derivatives on each piece."""
    c = np.abs(_coordinates(pieces.rows))
    result = np.zeros((len(pieces), BOUND_WIDTH))
    factor = np.ones(6)
    for order in range(BOUND_WIDTH):
        factor = factor * np.maximum(np.arange(6) - order, 0)
        terms = c * factor * 0.5 ** np.maximum(np.arange(6) - order - 1, 0)
        result[:, order] = np.hypot(*terms.sum(axis=2).T)
    return result


def piece_tree(pieces: CurvePieces) -> Array:
    """Search tree (2 q, 4) over the bounding boxes of the pieces, see `box_tree`."""
    ends = np.stack([pieces.start_mm, pieces.start_mm + pieces.along_mm])
    sagitta = pieces.sagitta_mm[:, None] * (1 + 1e-9)
    return box_tree(np.hstack([ends.min(axis=0) - sagitta, ends.max(axis=0) + sagitta]))
