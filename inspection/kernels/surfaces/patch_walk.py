"""Newton's method for the closest point of a net of pieces, which walks to the next piece where the foot leaves one."""

from typing import Any

from inspection.kernels.compiling import inlined_uncounted_kernel, uncounted_kernel
from inspection.kernels.surfaces.layout import HALF, INNER, LINKS, PIECE_DU, PIECE_DV, PIECE_STRIDE, PIECE_U, PIECE_V
from inspection.kernels.surfaces.piece_minimum import piece_at, piece_in_middle, square_of

WALK = 3  # pieces that a foot is looked for from the one that is begun in
_STEPS = 12
_SETTLED = 1e-6  # of a piece: a last step; the error of the foot after it is about its square, whatever the distance is
_PAST = 1e-12  # of a piece: a foot so far beyond its side lies on the side


@uncounted_kernel
def walk_to_foot(
    rows: Any, beyond: Any, width: int, row_width: int, start: int, x: float, y: float, z: float, farthest: int
) -> tuple[bool, int, float, float, Any, Any, Any]:
    """Whether the gradient of the distance was found to vanish, and the piece and (s, t) where it does, or where the walk was given up.

    It begins in the middle of a piece and goes `farthest` pieces at most away from it in either direction, and over no border. Where it
    found a foot, S, S_s and S_t there follow, for x, y and z each.
    """
    piece, s, t = start, 0.0, 0.0
    off_s, off_t, held = 0, 0, 0
    px, py, pz = piece_in_middle(rows, start * row_width, width)
    for step in range(_STEPS):
        row = piece * row_width
        if step:
            px, py, pz = piece_at(rows, row, width, s, t)
        _, g, h, a, b, c = square_of(px, py, pz, x, y, z)
        determinant = a * c - b * b
        if not (a > 0.0 and determinant > 0.0):
            break
        ds, dt = (b * h - c * g) / determinant, (b * g - a * h) / determinant
        s, t = s + ds, t + dt
        settled = abs(ds) <= _SETTLED and abs(dt) <= _SETTLED
        if settled and abs(s) <= HALF + _PAST and abs(t) <= HALF + _PAST:
            s, t = min(max(s, -HALF), HALF), min(max(t, -HALF), HALF)
            return True, piece, s, t, _after(px, ds, dt), _after(py, ds, dt), _after(pz, ds, dt)
        following, side_s, side_t = piece, 1 if s > 0.0 else 0, 3 if t > 0.0 else 2
        if abs(s) > HALF:
            sign = 1 if s > 0.0 else -1
            if abs(off_s + sign) <= farthest and beyond[LINKS * piece + side_s] == INNER:
                following, off_s = following + sign, off_s + sign
            else:
                held += 1
        if abs(t) > HALF:
            sign = 1 if t > 0.0 else -1
            if abs(off_t + sign) <= farthest and beyond[LINKS * piece + side_t] == INNER:
                following, off_t = following + sign * int(rows[row + PIECE_STRIDE]), off_t + sign
            else:
                held += 1
        if following != piece:
            to = following * row_width
            s = (s * rows[row + PIECE_DU] + (rows[row + PIECE_U] - rows[to + PIECE_U])) / rows[to + PIECE_DU]
            t = (t * rows[row + PIECE_DV] + (rows[row + PIECE_V] - rows[to + PIECE_V])) / rows[to + PIECE_DV]
            piece = following
        s, t = min(max(s, -HALF), HALF), min(max(t, -HALF), HALF)
        if held > 1:
            break
    return False, piece, min(max(s, -HALF), HALF), min(max(t, -HALF), HALF), px[:3], py[:3], pz[:3]


@inlined_uncounted_kernel
def _after(p: Any, ds: float, dt: float) -> tuple[float, float, float]:
    """A coordinate and its derivatives by s and t after a step so small that terms of third order are nothing."""
    ps, pt = p[1] + p[3] * ds + p[4] * dt, p[2] + p[4] * ds + p[5] * dt
    return p[0] + 0.5 * ((p[1] + ps) * ds + (p[2] + pt) * dt), ps, pt
