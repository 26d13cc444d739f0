"""The closest point of a surface of spline faces, cut into polynomial pieces, and the side that a place is on."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from inspection.kernels.compiling import (
    array_at,
    claim_chunk,
    inlined_uncounted_kernel,
    kernel,
    stack_integers,
    stack_reals,
    uncounted_kernel,
)
from inspection.kernels.layout import CHUNK
from inspection.kernels.surfaces.cell_grid import list_at
from inspection.kernels.surfaces.layout import (
    BORDER_STEPS,
    BORDER_WIDTH,
    BOX_AXES,
    BOX_HALF,
    BOX_MIDDLE,
    CERTAIN,
    FAR,
    HALF,
    INNER,
    LINKS,
    M01,
    M10,
    NAMED,
    ON_BORDER,
    ON_CORNER,
    ON_EDGE,
    ON_FACE,
    PIECE_DU,
    PIECE_DV,
    PIECE_OUTWARD,
    PIECE_SCRATCH,
    PIECE_U,
    PIECE_V,
    PLACE_WIDTH,
    SIDES,
    STACK,
)
from inspection.kernels.surfaces.patch_walk import WALK, walk_to_foot
from inspection.kernels.surfaces.piece_minimum import closest_on_piece, may_have_foot, piece_at
from inspection.kernels.surfaces.space_feet import (
    AT_ONCE,
    SpaceFeet,
    next_leaf,
    project_in_chunks,
    square_from_last,
    store_no_foot,
)

Array = NDArray[np.float64]
Index = NDArray[np.int32]

_ROUND_OFF = 1.0 + 1e-12  # of the square of a distance from a box
_NONE_YET: Any = np.int64(-1)  # not literals, which have types of their own
_ROOT_ALONE: Any = np.int64(1)
_INWARD = 1e-5  # how far from a place without a normal, a pole, its neighbour's is taken
_DEGENERATE = 1e-7  # sine of the angle of two tangents that span no plane


class PatchTables(NamedTuple):
    """A surface of spline faces as the loops take it.

    nodes, links : the search tree, see `item_tree`; a leaf is one piece
    members      : (p,) the piece of each leaf
    rows         : (p * row width,) the pieces, see `layout`
    beyond       : (p * LINKS,) what lies beyond the sides and at the corners of each piece
    borders      : (b * BORDER_WIDTH,) pseudonormals along the borders of faces
    vertices     : (v * PLACE_WIDTH,) and at their corners
    width        : coefficients in one direction: WIDTH_CUBIC or WIDTH_QUINTIC
    row_width    : numbers in a row
    grid         : (GRID_WIDTH,) where the blocks of cells lie
    blocks       : (3,) how many there are along x, y and z
    cells        : what each block, and each part of one that is cut, holds: LISTED - (NAMED * (piece to begin in) + CERTAIN or GUESSED)
    grain_mm     : a distance below which it is round-off; a foot that is held back at a border by less is not beyond it
    """

    nodes: Array
    links: Index
    members: Index
    rows: Array
    beyond: Index
    borders: Array
    vertices: Array
    width: int
    row_width: int
    grid: Array
    blocks: NDArray[np.int64]
    cells: Index
    grain_mm: float


def project_on_patches(points_mm: Array, tables: PatchTables, threads: int | None = None) -> SpaceFeet:
    """Closest points of a surface to points (m, 3). Points that are not finite have no foot.

    threads : None chooses by the number of points; the result is the same.
    """
    return project_in_chunks(points_mm, lambda points, feet, claimed: _project_chunks(points, tables, feet, claimed), threads)


@kernel
def _project_chunks(points: Any, tables: Any, feet: Any, claimed: Any) -> None:
    m = len(feet.kind)
    waiting, memory = array_at(stack_integers(), STACK), array_at(stack_reals(), PIECE_SCRATCH)
    nodes, links, members, rows, foot_mm = tables.nodes, tables.links, tables.members, tables.rows, feet.foot_mm
    width, row_width, beyond = tables.width, tables.row_width, tables.beyond
    grid, blocks, cells, grain = tables.grid, tables.blocks, tables.cells, tables.grain_mm
    begin = claim_chunk(claimed) // CHUNK * AT_ONCE
    while begin < m:
        for i in range(begin, min(begin + AT_ONCE, m)):
            x, y, z = points[3 * i], points[3 * i + 1], points[3 * i + 2]
            if not (np.isfinite(x) and np.isfinite(y) and np.isfinite(z)):
                store_no_foot(feet, i)
                continue
            least, best, s, t = square_from_last(foot_mm, i, begin, x, y, z), _NONE_YET, 0.0, 0.0
            named = list_at(grid, blocks, cells, x, y, z)
            if named != FAR:
                certain = named % NAMED == CERTAIN
                is_foot, best, s, t, px, py, pz = walk_to_foot(
                    rows, beyond, width, row_width, named // NAMED, x, y, z, 1 if certain else WALK
                )
                if is_foot and certain:
                    _store_foot(x, y, z, tables, best, s, t, px, py, pz, feet, i)
                    continue
                least, s, t = closest_on_piece(rows, best * row_width, width, x, y, z, memory)
            waiting[0], memory[0] = 0, 0.0
            depth = _ROOT_ALONE
            while True:
                leaf, depth = next_leaf(nodes, links, x, y, z, least, depth, waiting, memory)
                if leaf < 0:
                    if best >= 0 or least == np.inf:
                        break
                    least, depth, waiting[0], memory[0] = np.inf, _ROOT_ALONE, 0, 0.0  # the last foot seemed nearer than any, by round-off
                    continue
                piece = np.int64(members[leaf])
                if piece == best or square_from_box(rows, piece * row_width, x, y, z) > least * _ROUND_OFF:
                    continue
                if (  # found by the place alone, so that it has no part in the answer what the point before was close to
                    named != FAR and is_inner(beyond, piece) and not may_have_foot(rows, piece * row_width, width, x, y, z, 0.0, grain)
                ):
                    continue
                square, here_s, here_t = closest_on_piece(rows, piece * row_width, width, x, y, z, memory)
                if square < least or (square == least and piece < best):
                    least, best, s, t = square, piece, here_s, here_t
            at_x, at_y, at_z = piece_at(rows, best * row_width, width, s, t)
            _store_foot(x, y, z, tables, best, s, t, at_x[:3], at_y[:3], at_z[:3], feet, i)
        begin = claim_chunk(claimed) // CHUNK * AT_ONCE


@inlined_uncounted_kernel
def is_inner(beyond: Any, piece: Any) -> bool:
    """Whether a piece goes on in others beyond all its sides: what is closest on them and on it is no end of the face."""
    at = LINKS * piece
    return bool(beyond[at] == INNER and beyond[at + 1] == INNER and beyond[at + 2] == INNER and beyond[at + 3] == INNER)


@inlined_uncounted_kernel
def square_from_box(rows: Any, row: int, x: float, y: float, z: float) -> float:
    """Square of the distance from the box of a piece."""
    x, y, z = x - rows[row + BOX_MIDDLE], y - rows[row + BOX_MIDDLE + 1], z - rows[row + BOX_MIDDLE + 2]
    square = 0.0
    for axis in range(3):
        at = row + BOX_AXES + 3 * axis
        along = rows[at] * x + rows[at + 1] * y + rows[at + 2] * z
        beyond = max(abs(along) - rows[row + BOX_HALF + axis], 0.0)
        square += beyond * beyond
    return square


@inlined_uncounted_kernel
def _normal(px: Any, py: Any, pz: Any, rows: Any, row: int, width: int, s: float, t: float) -> tuple[float, float, float]:
    """The unit normal out of material at a place of a piece by its derivatives; at a pole that of a place beside it."""
    nx, ny, nz = py[1] * pz[2] - pz[1] * py[2], pz[1] * px[2] - px[1] * pz[2], px[1] * py[2] - py[1] * px[2]
    length = np.sqrt(nx * nx + ny * ny + nz * nz)
    if length <= _DEGENERATE * rows[row + M10] * rows[row + M01]:
        qx, qy, qz = piece_at(rows, row, width, s * (1.0 - _INWARD), t * (1.0 - _INWARD))
        nx, ny, nz = qy[1] * qz[2] - qz[1] * qy[2], qz[1] * qx[2] - qx[1] * qz[2], qx[1] * qy[2] - qy[1] * qx[2]
        length = np.sqrt(nx * nx + ny * ny + nz * nz)
    outward = rows[row + PIECE_OUTWARD] / length
    return nx * outward, ny * outward, nz * outward


@uncounted_kernel
def _store_foot(
    x: float, y: float, z: float, tables: Any, piece: int, s: float, t: float, px: Any, py: Any, pz: Any, feet: Any, i: int
) -> None:
    """Fill in the results for the foot at (s, t) of a piece, or for the edge or corner that holds it back.

    px, py, pz : x, y and z there, and their derivatives by s and t
    """
    rows, width = tables.rows, tables.width
    row = piece * tables.row_width
    dx, dy, dz = x - px[0], y - py[0], z - pz[0]
    distance = np.sqrt(dx * dx + dy * dy + dz * dz)
    nx, ny, nz = _normal(px, py, pz, rows, row, width, s, t)
    push_s, push_t = dx * px[1] + dy * py[1] + dz * pz[1], dx * px[2] + dy * py[2] + dz * pz[2]
    grain = tables.grain_mm
    beyond_s = abs(s) == HALF and push_s * s > grain * np.sqrt(px[1] * px[1] + py[1] * py[1] + pz[1] * pz[1])
    beyond_t = abs(t) == HALF and push_t * t > grain * np.sqrt(px[2] * px[2] + py[2] * py[2] + pz[2] * pz[2])
    side_s = tables.beyond[LINKS * piece + (1 if s > 0.0 else 0)] if beyond_s else INNER
    side_t = tables.beyond[LINKS * piece + (3 if t > 0.0 else 2)] if beyond_t else INNER
    vertex = tables.beyond[LINKS * piece + SIDES + (1 if s > 0.0 else 0) + (2 if t > 0.0 else 0)]
    kind, free = ON_FACE, 0.0
    if max(side_s, side_t) != INNER and min(side_s, side_t, vertex) != INNER:
        kind, at = ON_CORNER, PLACE_WIDTH * vertex
        nx, ny, nz, free = tables.vertices[at], tables.vertices[at + 1], tables.vertices[at + 2], tables.vertices[at + 3]
    elif side_s != INNER or side_t != INNER:
        kind = ON_EDGE
        side, along = (side_s, t) if side_s != INNER else (side_t, s)
        nx, ny, nz, free = _on_border(tables.borders, BORDER_WIDTH * side, along)
    sign = 1.0 if dx * nx + dy * ny + dz * nz >= 0.0 else -1.0
    feet.distance_mm[i], feet.kind[i] = sign * distance, ON_BORDER if free > 0.0 else kind
    if kind != ON_FACE and distance > grain:
        nx, ny, nz = sign * dx / distance, sign * dy / distance, sign * dz / distance
    feet.normal[i, 0], feet.normal[i, 1], feet.normal[i, 2] = nx, ny, nz
    feet.foot_mm[i, 0], feet.foot_mm[i, 1], feet.foot_mm[i, 2] = px[0], py[0], pz[0]
    feet.item[i] = piece
    feet.parameter[i, 0] = rows[row + PIECE_U] + s * rows[row + PIECE_DU]
    feet.parameter[i, 1] = rows[row + PIECE_V] + t * rows[row + PIECE_DV]


@uncounted_kernel
def _on_border(borders: Any, row: int, along: float) -> tuple[float, float, float, float]:
    """The unit pseudonormal at a place of a border, and a number above 0 where nothing adjoins there."""
    place = (along + HALF) * BORDER_STEPS
    step = min(int(place), BORDER_STEPS - 1)
    share = place - step
    at = row + PLACE_WIDTH * step
    nx = borders[at] + share * (borders[at + 4] - borders[at])
    ny = borders[at + 1] + share * (borders[at + 5] - borders[at + 1])
    nz = borders[at + 2] + share * (borders[at + 6] - borders[at + 2])
    length = np.sqrt(nx * nx + ny * ny + nz * nz)
    per = 1.0 / length if length > 0.0 else 0.0
    return nx * per, ny * per, nz * per, borders[at + 3] + borders[at + 7]
