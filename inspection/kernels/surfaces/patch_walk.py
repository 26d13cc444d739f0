"""Newton's method for the closest point of a net of pieces, which walks to the next piece where the foot leaves one."""

from typing import Any

from inspection.kernels.compiling import uncounted_kernel
from inspection.kernels.surfaces.layout import HALF, INNER, LINKS, PIECE_DU, PIECE_DV, PIECE_STRIDE, PIECE_U, PIECE_V
from inspection.kernels.surfaces.piece_minimum import square_at

WALK = 3  # pieces that a foot is looked for from the one that is begun in
_STEPS = 12
_SETTLED = 1e-6  # of a piece: a last step; the error of the foot after it is about its square, whatever the distance is
_PAST = 1e-12  # of a piece: a foot so far beyond its side lies on the side


@uncounted_kernel
def walk_to_foot(
    rows: Any, beyond: Any, width: int, row_width: int, start: int, x: float, y: float, z: float, farthest: int
) -> tuple[bool, int, float, float]:
    """Whether the gradient of the distance was found to vanish, and the piece and (s, t) where it does, or where the walk was given up.

    It begins in the middle of a piece and goes `farthest` pieces at most away from it in either direction, and over no border.
    """
    piece, s, t = start, 0.0, 0.0
    off_s, off_t, held = 0, 0, 0
    for _ in range(_STEPS):
        row = piece * row_width
        _, g, h, a, b, c = square_at(rows, row, width, x, y, z, s, t)
        determinant = a * c - b * b
        if not (a > 0.0 and determinant > 0.0):
            break
        ds, dt = (b * h - c * g) / determinant, (b * g - a * h) / determinant
        s, t = s + ds, t + dt
        settled = abs(ds) <= _SETTLED and abs(dt) <= _SETTLED
        if settled and abs(s) <= HALF + _PAST and abs(t) <= HALF + _PAST:
            return True, piece, min(max(s, -HALF), HALF), min(max(t, -HALF), HALF)
        following, side_s, side_t = piece, 1 if s > 0.0 else 0, 3 if t > 0.0 else 2
        if abs(s) > HALF:
            step = 1 if s > 0.0 else -1
            if abs(off_s + step) <= farthest and beyond[LINKS * piece + side_s] == INNER:
                following, off_s = following + step, off_s + step
            else:
                held += 1
        if abs(t) > HALF:
            step = 1 if t > 0.0 else -1
            if abs(off_t + step) <= farthest and beyond[LINKS * piece + side_t] == INNER:
                following, off_t = following + step * int(rows[row + PIECE_STRIDE]), off_t + step
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
    return False, piece, min(max(s, -HALF), HALF), min(max(t, -HALF), HALF)
