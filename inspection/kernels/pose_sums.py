"""Sums over the points at a pose, which say where a better one is: chunk by chunk, and always in the same order."""

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from inspection.kernels.blocks import FEET
from inspection.kernels.compiling import (
    INTEGER,
    MARK_ARRAY,
    REAL,
    REAL_ARRAY,
    REAL_TABLE,
    SHORT_TABLE,
    TRUTH,
    array_at,
    call_of,
    claim_chunk,
    code_of,
    inlined_kernel,
    inner_kernel,
    kernel,
    stack_reals,
    tuple_of,
)
from inspection.kernels.feet import Feet, feet_between
from inspection.kernels.layout import (
    AT_ONCE,
    BENDING_TT,
    BENDING_XT,
    BENDING_XX,
    BENDING_XY,
    BENDING_YT,
    BENDING_YY,
    BLOCK,
    CHUNK,
    CORNER,
    COUNT,
    OPEN_END,
    REALS,
    SLOPE_TURN,
    SLOPE_X,
    SLOPE_Y,
    SQUARE,
    SQUARE_BEFORE,
    SUMS,
    TANGENTIAL_TT,
    TANGENTIAL_XT,
    TANGENTIAL_XX,
    TANGENTIAL_XY,
    TANGENTIAL_YT,
    TANGENTIAL_YY,
)
from inspection.kernels.on_samples import BY_PROJECTION, project_by

Array = NDArray[np.float64]

_LEAST_REACH_MM = 1e-9
# No literals: to the compiler each of those has a type of its own, and what it is given to is compiled once more.
_FIRST_ROW: Any = np.int64(0)
_NOT_KNOWN: Any = np.bool_(False)
PLACE = tuple_of(REAL, REAL, REAL)  # the type of a pose, and of a span
PROBLEM = tuple_of(REAL_ARRAY, MARK_ARRAY, REAL_ARRAY, REAL_TABLE, SHORT_TABLE, REAL, REAL)
_MEMORY = (REAL_ARRAY, MARK_ARRAY, MARK_ARRAY, FEET)
_EVALUATION = (PROBLEM, BY_PROJECTION, PLACE, PLACE, *_MEMORY, TRUTH, INTEGER, REAL, REAL_ARRAY, REAL_ARRAY)  # what `_evaluate` takes
call_evaluation = call_of(*_EVALUATION)


@kernel
def span_of(points: Any, left_out: Any, m: int) -> tuple[float, float, float]:
    """Mean of the flat points (x, y), and the distance of the farthest from it: a motion does not change it."""
    x = y = square = 0.0
    for row in range(len(points) // 2):
        if len(left_out) == 0 or left_out[row] == 0:
            x += points[2 * row]
            y += points[2 * row + 1]
    x, y = x / m, y / m
    for row in range(len(points) // 2):
        if len(left_out) == 0 or left_out[row] == 0:
            dx, dy = points[2 * row] - x, points[2 * row + 1] - y
            square = max(square, dx * dx + dy * dy)
    return x, y, max(np.sqrt(square), _LEAST_REACH_MM)


@inner_kernel
def centre_of(pose: Any, span: Any) -> tuple[float, float]:
    """Where the pose puts the mean of the points."""
    c, s = np.cos(pose[0]), np.sin(pose[0])
    return c * span[0] - s * span[1] + pose[1], s * span[0] + c * span[1] + pose[2]


@inner_kernel
def move_pose(pose: Any, span: Any, step: Any, share: float) -> tuple[float, float, float]:
    """The pose after a share of a step: its rotation about the centre, which moves by its shift alone."""
    x, y = centre_of(pose, span)
    angle = pose[0] + share * step[2]
    angle = np.arctan2(np.sin(angle), np.cos(angle))
    c, s = np.cos(angle), np.sin(angle)
    return angle, x + share * step[0] - (c * span[0] - s * span[1]), y + share * step[1] - (s * span[0] + c * span[1])


@inner_kernel
def place_points(points: Any, left_out: Any, row: int, count: int, pose: Any, moved: Any) -> int:
    """Move the next points that are not left out, from a row on, to a pose. Returns the row after the last."""
    c, s = np.cos(pose[0]), np.sin(pose[0])
    for i in range(count):
        if len(left_out) > 0:
            while left_out[row] != 0:
                row += 1
        x, y = points[2 * row], points[2 * row + 1]
        moved[2 * i] = c * x - s * y + pose[1]
        moved[2 * i + 1] = s * x + c * y + pose[2]
        row += 1
    return row


@inner_kernel
def _evaluate(
    problem: Any,
    projection: Any,
    pose: Any,
    span: Any,
    moved: Any,
    before: Any,
    takes_part: Any,
    feet: Any,
    known: bool,
    row: int,
    limit: float,
    off: Any,
    sums: Any,
) -> None:
    """Add up the sums over the points at a pose, chunk by chunk and always in the same order.

    They are added first for each place in a block, so that the loop vectorises, then in halves. It does so where `before` and
    `takes_part` are not the same array.

    known : the points were looked at there before, so that their feet are still known where one chunk holds them all
    row   : of the first point; there are as many as weights
    limit : how far off a point has no weight any more; how far each is off is written to (m,), and the weights follow from it. With (0,)
            the weights stay as they are
    """
    points, left_out, weights, reals, integers, outward, tip = problem
    m = len(weights)
    lanes = array_at(stack_reals(), REALS)
    for i in range(SUMS * BLOCK):
        lanes[i] = 0.0
    x0, y0 = centre_of(pose, span)
    for begin in range(0, m, len(feet.vertex)):
        stop = min(begin + len(feet.vertex), m)
        if not known or m > len(feet.vertex):
            row = place_points(points, left_out, row, stop - begin, pose, moved)
            project_by(projection, moved[: 2 * (stop - begin)], reals, integers, feet_between(feet, _FIRST_ROW, stop - begin))
        if len(off) > 0:
            _weigh(feet, outward, tip, limit, off[begin:stop], weights[begin:stop])
        _add_points(lanes, moved, feet, weights[begin:stop], before[begin:stop], takes_part[begin:stop], outward, tip, x0, y0)
    _fold(lanes, sums)


@inner_kernel
def _evaluate_optimised_again(
    problem: Any,
    projection: Any,
    pose: Any,
    span: Any,
    moved: Any,
    before: Any,
    takes_part: Any,
    feet: Any,
    known: bool,
    row: int,
    limit: float,
    off: Any,
    sums: Any,
) -> None:
    """The same as `_evaluate`, a fifth faster: the loop over the points vectorises only in code that was optimised once before."""
    _evaluate(problem, projection, pose, span, moved, before, takes_part, feet, known, row, limit, off, sums)


@cache
def evaluation_code() -> int:
    """Where the code is that adds up the sums at a pose. It is called by its place, and so compiled once for all that call it."""
    return code_of(_evaluate_optimised_again, *_EVALUATION)


@kernel
def add_up(
    problem: Any, projection: Any, evaluation: int, pose: Any, span: Any, marks: Any, first_rows: Any, tukey: Any, claimed: Any, sums: Any
) -> None:
    """Add up the sums (c, SUMS) of the chunks of AT_ONCE points that this thread claims; the same whichever thread does.

    evaluation : `evaluation_code()`
    marks      : (m,) which points took part at the pose before, and which do here
    first_rows : (c,) row of the first point of every chunk
    tukey      : how far off a point has no weight any more, and how far each is found to be (m,): the weights follow from these, NaN for
                 a point that takes no part. With (0,) the weights stay as they are
    """
    points, left_out, weights, reals, integers, outward, tip = problem
    before, takes_part = marks
    limit, off = tukey
    m = len(weights)
    moved, feet = np.empty(2 * AT_ONCE), new_feet(min(AT_ONCE, m))
    chunk = claim_chunk(claimed) // CHUNK
    while chunk < len(first_rows):
        begin, stop = chunk * AT_ONCE, min((chunk + 1) * AT_ONCE, m)
        part = (points, left_out, weights[begin:stop], reals, integers, outward, tip)
        which = (before[begin:stop], takes_part[begin:stop])
        row = first_rows[chunk]
        call_evaluation(
            evaluation, (part, projection, pose, span, moved, *which, feet, _NOT_KNOWN, row, limit, off[begin:stop], sums[chunk])
        )
        chunk = claim_chunk(claimed) // CHUNK


@inner_kernel
def _weigh(feet: Any, outward: float, tip: float, limit: float, off: Any, weights: Any) -> None:
    """Enter how far each point of a chunk is off, and Tukey's weight of it."""
    for j in range(len(off)):
        off[j] = abs(outward * feet.distance_mm[j] - tip)
        share = off[j] / limit
        weights[j] = (1.0 - share * share) ** 2 if off[j] < limit else 0.0
        if feet.vertex[j] == OPEN_END:
            off[j] = np.nan


@inner_kernel
def new_feet(count: int) -> Any:
    """Memory for so many feet, within a kernel."""
    return Feet(
        np.empty(count),
        np.empty((count, 2)),
        np.empty(count),
        np.empty((count, 2)),
        np.empty(count),
        np.empty(count),
        np.empty(count, dtype=np.uint8),
    )


@inlined_kernel
def _add_points(
    lanes: Any, moved: Any, feet: Any, weights: Any, before: Any, takes_part: Any, outward: float, tip: float, x0: float, y0: float
) -> None:
    """Add the points of a chunk for each place in a block, so that the loop vectorises: the memory of a block overlaps no other."""
    count = len(weights)
    for near in range(0, count, BLOCK):
        far = min(near + BLOCK, count)
        xy, gradient = moved[2 * near : 2 * far], feet.gradient.reshape(-1)[2 * near : 2 * far]
        distance, curvature, vertex = feet.distance_mm[near:far], feet.curvature[near:far], feet.vertex[near:far]
        weight, part_before, part = weights[near:far], before[near:far], takes_part[near:far]
        for j in range(far - near):
            _add_point(lanes, xy, gradient, distance, curvature, vertex, weight, part_before, outward, tip, x0, y0, j)
        for j in range(far - near):  # in a loop of its own: the first one then writes to no array of a caller, and always vectorises
            part[j] = vertex[j] != OPEN_END and weight[j] > 0.0


@inlined_kernel
def _fold(lanes: Any, sums: Any) -> None:
    """Add up the places in a block, in halves."""
    half = BLOCK // 2
    while half > 0:
        for column in range(0, SUMS * BLOCK, BLOCK):
            for j in range(half):
                lanes[column + j] += lanes[column + half + j]
        half //= 2
    for quantity in range(SUMS):
        sums[quantity] = lanes[quantity * BLOCK]


@inlined_kernel
def _add_point(
    lanes: Any,
    points: Any,
    gradient: Any,
    distance: Any,
    curvature: Any,
    vertex: Any,
    weight: Any,
    before: Any,
    outward: float,
    tip: float,
    x0: float,
    y0: float,
    j: int,
) -> None:
    """Add a point to the sums: tangent distance plus curvature, e(p) = e + J p + p' H p / 2.

    H is the curvature of the distance field across its gradient.
    """
    # Every value is loaded whatever comes of it: a load that depends on a condition would keep the loop from being vectorised.
    bent, share, kind = curvature[j], weight[j], vertex[j]
    field = outward * distance[j]
    e = field - tip
    gx, gy = outward * gradient[2 * j], outward * gradient[2 * j + 1]
    ax, ay = points[2 * j] - x0, points[2 * j + 1] - y0
    turn, radial = ax * gy - ay * gx, ax * gx + ay * gy
    at_corner, turned_back = kind == CORNER, max(1.0 - bent * distance[j], 1e-3)
    numerator = 1.0 if at_corner else -outward * bent
    denominator = field if at_corner else turned_back
    ratio = numerator / denominator
    bend = ratio if abs(denominator) > 1e-9 else 0.0
    was_part = before[j]
    u = 0.0 if kind == OPEN_END else share
    takes_part = 1.0 if u > 0.0 else 0.0
    we = u * e
    across = we * bend
    lanes[BLOCK * SLOPE_X + j] += we * gx
    lanes[BLOCK * SLOPE_Y + j] += we * gy
    lanes[BLOCK * SLOPE_TURN + j] += we * turn
    lanes[BLOCK * TANGENTIAL_XX + j] += u * gx * gx
    lanes[BLOCK * TANGENTIAL_XY + j] += u * gx * gy
    lanes[BLOCK * TANGENTIAL_XT + j] += u * gx * turn
    lanes[BLOCK * TANGENTIAL_YY + j] += u * gy * gy
    lanes[BLOCK * TANGENTIAL_YT + j] += u * gy * turn
    lanes[BLOCK * TANGENTIAL_TT + j] += u * turn * turn
    lanes[BLOCK * BENDING_XX + j] += across * gy * gy
    lanes[BLOCK * BENDING_XY + j] -= across * gx * gy
    lanes[BLOCK * BENDING_XT + j] -= across * gy * radial
    lanes[BLOCK * BENDING_YY + j] += across * gx * gx
    lanes[BLOCK * BENDING_YT + j] += across * gx * radial
    lanes[BLOCK * BENDING_TT + j] += across * radial * radial - we * radial
    lanes[BLOCK * SQUARE + j] += we * e
    lanes[BLOCK * COUNT + j] += takes_part
    lanes[BLOCK * SQUARE_BEFORE + j] += was_part * share * e * e
