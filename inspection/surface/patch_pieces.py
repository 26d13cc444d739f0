"""Spline faces cut into polynomial pieces, with bounds of their derivatives and boxes that hold them.

A face of degree three or less that is not rational is its own cubics, one of degree five or less its own quintics. Any other is cut until
quintics through its values miss it by no more than a fraction of a nanometre, `MISSED` of the size.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inspection.errors import NominalError
from inspection.kernels.surfaces.layout import (
    BOX_AXES,
    BOX_HALF,
    BOX_MIDDLE,
    COEFFICIENTS,
    M10,
    PIECE_DU,
    PIECE_DV,
    PIECE_OUTWARD,
    PIECE_U,
    PIECE_V,
    WIDTH_CUBIC,
    WIDTH_QUINTIC,
)
from inspection.surface.spline_face import SplineFace

Array = NDArray[np.float64]
Index = NDArray[np.int64]

MISSED = 2e-13  # of the size, by which a quintic may miss a face that is none
_TURNS_PER_RAD = 8.0  # pieces in a stretch that turns by one radian
_LONGEST = 0.02  # of the size; but what is nearly flat is cut into eight times fewer pieces than it would be by its turn
_UNEVEN = 0.5, 0.5  # what a change of speed along a knot span, of itself, counts as a turn in radians, and the most that it counts as
_ASPECT = 4.0  # of a piece that turns
_MOST_PIECES = 2_000_000
_MOST_HALVINGS = 12
_NODES = (np.arange(5) + 0.5) / 5  # of a knot span at which its length and turn are looked at
_BOX_ROUND_OFF = 1e-13  # of the farthest coordinate
_ORDERS = ((1, 0), (0, 1), (2, 0), (1, 1), (0, 2), (3, 0), (2, 1), (1, 2), (0, 3))  # of the bounds, in the order of their columns


@dataclass(frozen=True, slots=True, eq=False)
class PatchPieces:
    """Polynomial pieces of faces, face after face, and of each face row after row of v.

    coefficients : (p, 3, width, width) that of s^i t^j at [i, j]
    place        : (p, 4) parameters u and v of the middle, and how much of them a unit of s and of t is worth
    face         : (p,)
    grid         : for each face, how many pieces it has in u and in v
    creases      : for each face, whether lines of pieces in u (k + 1,) and v (l + 1,) are borders of what is smooth
    """

    coefficients: Array
    place: Array
    face: Index
    grid: tuple[tuple[int, int], ...]
    creases: tuple[tuple[NDArray[np.bool_], NDArray[np.bool_]], ...]

    def at(self, piece: Index, s: Array, t: Array) -> tuple[Array, Array, Array]:
        """S, S_s and S_t (m, 3) at places (s, t) (m,) of pieces (m,)."""
        width = self.coefficients.shape[-1]
        c = self.coefficients[piece]
        powers = np.arange(width)
        by_s, by_t = s[:, None] ** powers, t[:, None] ** powers
        d_s, d_t = (powers * x[:, None] ** np.maximum(powers - 1, 0) for x in (s, t))
        along_t, bent_t = (np.einsum("mdij,mj->mdi", c, by) for by in (by_t, d_t))  # in two steps: numpy goes through all terms of three
        value, in_s, in_t = (np.einsum("mdi,mi->md", along, by) for along, by in ((along_t, by_s), (along_t, d_s), (bent_t, by_s)))
        return value, in_s, in_t


def cut_into_patches(faces: Sequence[SplineFace], size_mm: float) -> PatchPieces:
    """Cut faces into pieces. Raises NominalError for a face that is not smooth enough for that."""
    low_degree = all(face.is_polynomial and max(face.degree) < WIDTH_CUBIC for face in faces)
    width = WIDTH_CUBIC if low_degree else WIDTH_QUINTIC
    parts = [_cut_face(face, size_mm, width) for face in faces]
    return PatchPieces(
        np.concatenate([part[0] for part in parts]),
        np.concatenate([part[1] for part in parts]),
        np.repeat(np.arange(len(parts)), [len(part[0]) for part in parts]),
        tuple(part[2] for part in parts),
        tuple(part[3] for part in parts),
    )


def _cut_face(
    face: SplineFace, size_mm: float, width: int
) -> tuple[Array, Array, tuple[int, int], tuple[NDArray[np.bool_], NDArray[np.bool_]]]:
    breaks, creases = zip(*(face.breaks(axis) for axis in range(2)), strict=True)
    cuts = [np.maximum(1, np.ceil(cut - 1e-9)).astype(np.int64) for cut in _wanted_cuts(face, breaks, size_mm)]
    is_exact = face.is_polynomial and max(face.degree) < width
    for _ in range(_MOST_HALVINGS):
        if int(cuts[0].sum()) * int(cuts[1].sum()) > _MOST_PIECES:
            break
        lines = [_lines(values, cut) for values, cut in zip(breaks, cuts, strict=True)]
        coefficients = _fitted(face, lines[0], lines[1], width)
        if is_exact:
            break
        missed = _missed(face, lines, coefficients)
        bad = [np.maximum.reduceat(far > MISSED * size_mm, np.cumsum(cut) - cut) for far, cut in zip(missed, cuts, strict=True)]
        if not (bad[0].any() or bad[1].any()):
            break
        cuts = [np.where(worse, 2 * cut, cut) for cut, worse in zip(cuts, bad, strict=True)]
    else:
        raise NominalError(f"face {face.name}: it is not smooth between its knots; export the part again")
    if int(cuts[0].sum()) * int(cuts[1].sum()) > _MOST_PIECES:
        raise NominalError(f"face {face.name}: it is too wrinkled: more than {_MOST_PIECES:,} pieces would be needed")
    middle = [(line[1:] + line[:-1]) / 2 for line in lines]
    step = [np.diff(line) for line in lines]
    k, m = len(middle[0]), len(middle[1])
    place = np.column_stack([np.tile(middle[0], m), np.repeat(middle[1], k), np.tile(step[0], m), np.repeat(step[1], k)])
    ends = []
    for crease, cut in zip(creases, cuts, strict=True):
        border = np.zeros(int(cut.sum()) + 1, dtype=bool)
        border[np.concatenate([[0], np.cumsum(cut)])] = crease
        border[[0, -1]] = True
        ends.append(border)
    return coefficients.reshape(-1, 3, width, width), place, (k, m), (ends[0], ends[1])


def _lines(breaks: Array, cuts: Index) -> Array:
    """The parameters at which pieces begin and end: each knot span cut evenly."""
    parts = [np.linspace(a, b, n + 1)[:-1] for a, b, n in zip(breaks[:-1], breaks[1:], cuts, strict=True)]
    return np.concatenate([*parts, breaks[-1:]])


def _wanted_cuts(face: SplineFace, breaks: tuple[Array, Array], size_mm: float) -> tuple[Array, Array]:
    """Into how many pieces, not yet whole, each knot span has to be cut in u and in v for what is short and turns little."""
    u, v = ((line[:-1, None] + np.diff(line)[:, None] * _NODES).ravel() for line in breaks)
    d = face.on_grid(u, v, 2)
    du, dv, twist = d[1, 0], d[0, 1], d[1, 1]
    speed_u, speed_v = (np.linalg.norm(x, axis=-1) for x in (du, dv))
    normal = np.cross(du, dv)
    area = np.linalg.norm(normal, axis=-1)
    known = area > 1e-9 * max(float(area.max()), 1e-300)
    with np.errstate(divide="ignore", invalid="ignore"):
        along = np.abs((twist * normal).sum(axis=-1)) / area
        turn_u = np.maximum(np.linalg.norm(np.cross(du, d[2, 0]), axis=-1) / speed_u**2, along / speed_v)
        turn_v = np.maximum(np.linalg.norm(np.cross(dv, d[0, 2]), axis=-1) / speed_v**2, along / speed_u)
        uneven_u, uneven_v = np.abs((du * d[2, 0]).sum(axis=-1)) / speed_u**2, np.abs((dv * d[0, 2]).sum(axis=-1)) / speed_v**2
    wanted, lengths = [], []
    for axis, (*rates, line) in enumerate(((speed_u, turn_u, uneven_u, breaks[0]), (speed_v, turn_v, uneven_v, breaks[1]))):
        spans = np.diff(line)
        length, turned, uneven = (
            _most_in_spans(np.where(known, np.minimum(values, most), 0.0), axis, len(spans)) * spans
            for values, most in zip(rates, (np.inf, 1e6, 1e6), strict=True)
        )
        by_turn = _TURNS_PER_RAD * np.maximum(turned, np.minimum(_UNEVEN[0] * uneven, _UNEVEN[1]))
        wanted.append(np.maximum(by_turn, np.minimum(length / (_LONGEST * size_mm), 8 * by_turn)))
        lengths.append(length)
    widest = [float((length / np.maximum(1, cut)).max()) for length, cut in zip(lengths, wanted, strict=True)]
    for axis in range(2):
        if wanted[1 - axis].max() > 1:  # it turns across: a long thin piece would lie near too many places
            wanted[axis] = np.maximum(wanted[axis], lengths[axis] / (_ASPECT * widest[1 - axis]))
    return wanted[0], wanted[1]


def _most_in_spans(values: Array, axis: int, spans: int) -> Array:
    """The greatest of the values in each knot span of an axis."""
    most = values.max(axis=1 - axis)
    return np.asarray(most.reshape(spans, len(_NODES)).max(axis=1))


def _chebyshev(width: int) -> Array:
    return np.cos((2 * np.arange(width) + 1) * np.pi / (2 * width)) / 2


def _fitted(face: SplineFace, u: Array, v: Array, width: int) -> Array:
    """Coefficients (l, k, 3, width, width) of the polynomials through the values at Chebyshev's nodes of each piece."""
    nodes = _chebyshev(width)
    inverse = np.linalg.inv(nodes[:, None] ** np.arange(width))
    (mid_u, step_u), (mid_v, step_v) = (((line[1:] + line[:-1]) / 2, np.diff(line)) for line in (u, v))
    at_u, at_v = (mid_u[:, None] + step_u[:, None] * nodes).ravel(), (mid_v[:, None] + step_v[:, None] * nodes).ravel()
    values = face.on_grid(at_u, at_v, 0)[0, 0].reshape(len(mid_u), width, len(mid_v), width, 3)
    middle = values.mean(axis=(1, 3))
    c = np.einsum("ai,kilbd->kalbd", inverse, values - middle[:, None, :, None])
    c = np.einsum("bj,kaljd->lkdab", inverse, c)
    c[..., 0, 0] += middle.transpose(1, 0, 2)
    return np.ascontiguousarray(c)


def _missed(face: SplineFace, lines: Sequence[Array], coefficients: Array) -> tuple[Array, Array]:
    """How far the polynomials miss the face in each column of pieces (k,) and in each row (l,), between the nodes of that direction."""
    width = coefficients.shape[-1]
    nodes, between = _chebyshev(width), np.cos(np.arange(width + 1) * np.pi / width) / 2
    found = []
    for axis in range(2):
        at = [between, nodes] if axis == 0 else [nodes, between]
        u, v = ((((line[1:] + line[:-1]) / 2)[:, None] + np.diff(line)[:, None] * x).ravel() for line, x in zip(lines, at, strict=True))
        k, m = len(lines[0]) - 1, len(lines[1]) - 1
        wanted = face.on_grid(u, v, 0)[0, 0].reshape(k, len(at[0]), m, len(at[1]), 3)
        powers = [x[:, None] ** np.arange(width) for x in at]
        given = (powers[0] @ coefficients @ powers[1].T).transpose(1, 3, 0, 4, 2)
        far = np.abs(given - wanted).max(axis=(1, 3, 4))
        found.append(far.max(axis=1 - axis))
    return found[0], found[1]


def piece_rows(pieces: PatchPieces, outward: Array) -> Array:
    """The rows (p, row width) of the pieces as the loops take them; outward (p,) is 1 or -1."""
    c = pieces.coefficients
    p, _, width, _ = c.shape
    rows = np.zeros((p, COEFFICIENTS + 3 * width * width + (-3 * width * width) % 8))
    rows[:, COEFFICIENTS : COEFFICIENTS + 3 * width * width] = c.reshape(p, -1)
    rows[:, M10 : M10 + len(_ORDERS)] = _bounds(c)
    middle, axes, half = _boxes(c)
    rows[:, BOX_MIDDLE:BOX_AXES], rows[:, BOX_AXES:BOX_HALF], rows[:, BOX_HALF:PIECE_U] = middle, axes.reshape(p, 9), half
    rows[:, [PIECE_U, PIECE_V, PIECE_DU, PIECE_DV]] = pieces.place
    rows[:, PIECE_OUTWARD] = outward
    return rows


def _bounds(c: Array) -> Array:
    """Bounds (p, 9) of the lengths of the derivatives over a piece, by the sums of what its coefficients can come to."""
    width = c.shape[-1]
    length = np.sqrt((c**2).sum(axis=1))  # (p, width, width)
    result = np.empty((len(c), len(_ORDERS)))
    for column, orders in enumerate(_ORDERS):
        factors = []
        for order in orders:
            powers = np.arange(width)
            falling = np.prod([np.maximum(powers - i, 0) for i in range(order)], axis=0) if order else np.ones(width)
            factors.append(falling * 0.5 ** np.maximum(powers - order, 0))
        result[:, column] = np.einsum("pij,i,j->p", length, factors[0], factors[1])
    return result * (1 + 1e-12)


def _boxes(c: Array) -> tuple[Array, Array, Array]:
    """Boxes along the tangents of the middles: the middle (p, 3), the axes (p, 3, 3) and half the sides (p, 3)."""
    first, second = c[:, :, 1, 0], c[:, :, 0, 1]
    long = np.where((first**2).sum(axis=1, keepdims=True) > 0, first, [1.0, 0.0, 0.0])
    e1 = long / np.linalg.norm(long, axis=1, keepdims=True)
    across = second - (second * e1).sum(axis=1, keepdims=True) * e1
    spare = np.cross(e1, np.where(np.abs(e1[:, :1]) < 0.7, [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]))  # at a pole, where there is no second one
    good = np.linalg.norm(across, axis=1, keepdims=True) > 1e-9 * np.linalg.norm(long, axis=1, keepdims=True)
    e2 = np.where(good, across, spare)
    e2 /= np.linalg.norm(e2, axis=1, keepdims=True)
    axes = np.stack([e1, e2, np.cross(e1, e2)], axis=1)
    along = np.einsum("pad,pdij->paij", axes, c)
    powers = np.arange(c.shape[-1])
    most = np.abs(along) * 0.5 ** (powers[:, None] + powers)
    even = ((powers[:, None] % 2 == 0) & (powers % 2 == 0)).astype(float)  # s^2 is never below 0
    even[0, 0], most[:, :, 0, 0] = 0.0, 0.0
    high = np.where(even > 0, np.maximum(np.sign(along), 0) * most, most).sum(axis=(2, 3))
    low = np.where(even > 0, np.minimum(np.sign(along), 0) * most, -most).sum(axis=(2, 3))
    middle = c[:, :, 0, 0] + np.einsum("pa,pad->pd", (high + low) / 2, axes)
    return middle, axes, (high - low) / 2 + _BOX_ROUND_OFF * np.abs(c[:, :, 0, 0]).max()


def boxes_along_axes(rows: Array) -> tuple[Array, Array, Array]:
    """The middles (p, 3) of pieces, and boxes along x, y and z around their own ones: low (p, 3) and high (p, 3)."""
    middle, axes, half = rows[:, BOX_MIDDLE:BOX_AXES], rows[:, BOX_AXES:BOX_HALF].reshape(-1, 3, 3), rows[:, BOX_HALF : BOX_HALF + 3]
    reach = np.einsum("pa,pad->pd", half, np.abs(axes)) * (1 + 1e-12)
    return middle, middle - reach, middle + reach
