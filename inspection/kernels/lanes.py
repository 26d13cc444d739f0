"""What happens to each point of a block, written so that the loop over the block vectorises."""

from typing import Any

import numpy as np

from inspection.kernels.compiling import fma, inlined_kernel, rows_to_columns
from inspection.kernels.layout import (
    BLOCK,
    BLOCK_DEPTH,
    BLOCK_LEVEL,
    FAR,
    INSIDE,
    LANE_CONTENT,
    LANE_CURVATURE,
    LANE_DISTANCE,
    LANE_FOOT_X,
    LANE_FOOT_Y,
    LANE_NORMAL_X,
    LANE_NORMAL_Y,
    LANE_ROW,
    LANE_SOLVED,
    LANE_STATION,
    LANE_T,
    LANE_U,
    LANE_X,
    LANE_Y,
    PIECE_DEGREE,
    PIECE_FIRST,
    PIECE_LAST,
    PIECE_STATION,
    PIECE_U,
    PIECE_U_PER_T,
    PIECE_WIDTH,
    PIECE_X,
    PIECE_Y,
    STATION_DEGREE,
)

_ACROSS = float(1 << BLOCK_LEVEL)
_DEPTH = (1 << BLOCK_DEPTH) - 1
_ANY = 0x7FFFFFFF  # tells the compiler that an index is not negative
# Where the columns of the pieces begin in the memory of a block.
_X0, _X1, _X2, _X3, _X4, _X5 = (BLOCK * (PIECE_X + power) for power in range(PIECE_DEGREE + 1))
_Y0, _Y1, _Y2, _Y3, _Y4, _Y5 = (BLOCK * (PIECE_Y + power) for power in range(PIECE_DEGREE + 1))
_S0, _S1, _S2, _S3, _S4, _S5, _S6, _S7 = (BLOCK * (PIECE_STATION + power) for power in range(STATION_DEGREE + 1))
_U, _U_PER_T, _FIRST, _LAST = (BLOCK * column for column in (PIECE_U, PIECE_U_PER_T, PIECE_FIRST, PIECE_LAST))
_STEP = 3e-9  # largest last step, in pieces, after which the square of the error is below round-off


@inlined_kernel
def locate(values: Any, slots: Any, here: Any, blocks: Any, cells: Any, x0: float, y0: float, per_mm: float, j: int) -> None:
    """Look up what the cell of point j holds."""
    x, y = here[2 * j], here[2 * j + 1]
    fx, fy = (x - x0) * per_mm, (y - y0) * per_mm
    inside = (fx >= 0.0) & (fx < _ACROSS) & (fy >= 0.0) & (fy < _ACROSS)
    fx = fx if inside else 0.0
    fy = fy if inside else 0.0
    bx, by = np.int32(fx), np.int32(fy)
    block = blocks[((by << BLOCK_LEVEL) | bx) & _ANY]
    depth = block & _DEPTH
    count = float(np.int32(1) << depth)
    cell = (block >> BLOCK_DEPTH) + (np.int32((fy - by) * count) << depth) + np.int32((fx - bx) * count)
    known = inside & (block >= 0)
    content = cells[(cell if known else 0) & _ANY]
    content = content if known else FAR
    slots[LANE_CONTENT + j] = content
    slots[LANE_ROW + j] = PIECE_WIDTH * max(content, 0)
    values[LANE_X + j] = x
    values[LANE_Y + j] = y


@inlined_kernel
def load_pieces(values: Any, slots: Any, pieces: Any, lanes: int) -> None:
    """Load the rows of all lanes' pieces as columns. The lanes that fill up the last eight take the first piece."""
    for j in range(lanes, (lanes + 7) & ~7):
        slots[LANE_ROW + j] = 0
    for j in range(0, lanes, 8):
        rows_to_columns(pieces, slots, LANE_ROW + j, values, j)
        rows_to_columns(pieces[8:], slots, LANE_ROW + j, values, 8 * BLOCK + j)
        rows_to_columns(pieces[16:], slots, LANE_ROW + j, values, 16 * BLOCK + j)


@inlined_kernel
def start_in_middle(values: Any, j: int) -> None:
    """Make one Halley step from the middle of the piece, where the derivatives are the coefficients."""
    rx, ry = values[_X0 + j] - values[LANE_X + j], values[_Y0 + j] - values[LANE_Y + j]
    x1, x2, x3 = values[_X1 + j], values[_X2 + j], values[_X3 + j]
    y1, y2, y3 = values[_Y1 + j], values[_Y2 + j], values[_Y3 + j]
    values[LANE_T + j] = _halley_step(rx, ry, x1, y1, x2, y2, x3, y3)


@inlined_kernel
def improve(values: Any, j: int, t: float) -> float:
    """The parameter after one Halley step from t."""
    rx, ry, vx, vy, hx, hy, kx, ky = _expand(values, j, t)
    return t + _halley_step(rx, ry, vx, vy, hx, hy, kx, ky)


@inlined_kernel
def _expand(values: Any, j: int, t: float) -> tuple[float, ...]:
    """Taylor coefficients at t of the piece C seen from the point M: C - M, C', C'' / 2 and C''' / 6, by repeated synthetic division."""
    x1, x2, x3, x4, x5 = values[_X1 + j], values[_X2 + j], values[_X3 + j], values[_X4 + j], values[_X5 + j]
    y1, y2, y3, y4, y5 = values[_Y1 + j], values[_Y2 + j], values[_Y3 + j], values[_Y4 + j], values[_Y5 + j]
    a4, b4 = fma(x5, t, x4), fma(y5, t, y4)
    a3, b3 = fma(a4, t, x3), fma(b4, t, y3)
    a2, b2 = fma(a3, t, x2), fma(b3, t, y2)
    a1, b1 = fma(a2, t, x1), fma(b2, t, y1)
    rx, ry = fma(a1, t, values[_X0 + j] - values[LANE_X + j]), fma(b1, t, values[_Y0 + j] - values[LANE_Y + j])
    a4, b4 = fma(x5, t, a4), fma(y5, t, b4)
    a3, b3 = fma(a4, t, a3), fma(b4, t, b3)
    a2, b2 = fma(a3, t, a2), fma(b3, t, b2)
    vx, vy = fma(a2, t, a1), fma(b2, t, b1)
    a4, b4 = fma(x5, t, a4), fma(y5, t, b4)
    a3, b3 = fma(a4, t, a3), fma(b4, t, b3)
    hx, hy = fma(a3, t, a2), fma(b3, t, b2)
    a4, b4 = fma(x5, t, a4), fma(y5, t, b4)
    kx, ky = fma(a4, t, a3), fma(b4, t, b3)
    return rx, ry, vx, vy, hx, hy, kx, ky


@inlined_kernel
def _halley_step(rx: float, ry: float, vx: float, vy: float, hx: float, hy: float, kx: float, ky: float) -> float:
    """Third-order step towards the zero of C' . (C - M), from C - M and the first three Taylor coefficients of C."""
    g = fma(rx, vx, ry * vy)
    g1 = fma(2.0, fma(rx, hx, ry * hy), fma(vx, vx, vy * vy))
    half_g2 = 3.0 * fma(vx, hx, fma(vy, hy, fma(rx, kx, ry * ky)))
    return float(-g * g1 / fma(g1, g1, -g * half_g2))


@inlined_kernel
def solve(values: Any, slots: Any, j: int, t: float) -> None:
    """Make a Newton step from t and enter the results. A lane is solved where the step is small and t belongs to the piece."""
    rx, ry, vx, vy, half_x, half_y, _, _ = _expand(values, j, t)
    hx, hy = 2.0 * half_x, 2.0 * half_y
    g1 = fma(rx, hx, fma(ry, hy, fma(vx, vx, vy * vy)))
    step = -fma(rx, vx, ry * vy) / g1
    t += step
    rx, ry = fma(vx, step, rx), fma(vy, step, ry)
    vx, vy = fma(hx, step, vx), fma(hy, step, vy)
    slowness = 1.0 / np.sqrt(fma(vx, vx, vy * vy))
    nx, ny = -vy * slowness, vx * slowness
    values[LANE_FOOT_X + j] = values[LANE_X + j] + rx
    values[LANE_FOOT_Y + j] = values[LANE_Y + j] + ry
    values[LANE_DISTANCE + j] = -fma(rx, nx, ry * ny)
    values[LANE_NORMAL_X + j] = nx
    values[LANE_NORMAL_Y + j] = ny
    values[LANE_CURVATURE + j] = fma(vx, hy, -vy * hx) * (slowness * slowness * slowness)
    values[LANE_T + j] = t
    good = (abs(step) <= _STEP) & (g1 > 0.0) & (t >= values[_FIRST + j]) & (t <= values[_LAST + j]) & (slots[LANE_CONTENT + j] >= 0)
    slots[LANE_SOLVED + j] = 1 if good else 0


@inlined_kernel
def measure(values: Any, j: int, first: float, last: float, length: float) -> None:
    """Enter the parameter and the arc length from the start of the curve, held in their ranges against round-off at the seam."""
    t = values[LANE_T + j]
    s = fma(values[_S7 + j], t, values[_S6 + j])
    s = fma(s, t, values[_S5 + j])
    s = fma(s, t, values[_S4 + j])
    s = fma(s, t, values[_S3 + j])
    s = fma(s, t, values[_S2 + j])
    s = fma(s, t, values[_S1 + j])
    values[LANE_STATION + j] = min(max(fma(s, t, values[_S0 + j]), 0.0), length)
    values[LANE_U + j] = min(max(fma(values[_U_PER_T + j], t, values[_U + j]), first), last)


@inlined_kernel
def store_block(values: Any, feet: Any, block: int, k: int) -> None:
    """Enter the results of all points of a block, solved or not."""
    end = block + k
    u, e, curvature, station = feet.parameter[block:end], feet.distance_mm[block:end], feet.curvature[block:end], feet.station_mm[block:end]
    foot, gradient = feet.foot_mm.reshape(-1)[2 * block : 2 * end], feet.gradient.reshape(-1)[2 * block : 2 * end]
    vertex = feet.vertex[block:end]
    for j in range(k):
        u[j] = values[LANE_U + j]
    for j in range(k):
        foot[2 * j] = values[LANE_FOOT_X + j]
        foot[2 * j + 1] = values[LANE_FOOT_Y + j]
    for j in range(k):
        e[j] = values[LANE_DISTANCE + j]
    for j in range(k):
        gradient[2 * j] = values[LANE_NORMAL_X + j]
        gradient[2 * j + 1] = values[LANE_NORMAL_Y + j]
    for j in range(k):
        curvature[j] = values[LANE_CURVATURE + j]
    for j in range(k):
        station[j] = values[LANE_STATION + j]
    for j in range(k):
        vertex[j] = INSIDE
