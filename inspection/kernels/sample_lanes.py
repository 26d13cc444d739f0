"""What happens to each point of a block at its nearest sample, written so that the loop over the block vectorises.

A lane is plain where its sample is proven to be the nearest, within a smooth piece, and no case has to be told apart. The others are
left as they were, for the careful way, which gives plain ones the same results to the last bit. Both sides of a choice are loaded
before it is made: the compiler would not dare to.
"""

from typing import Any

import numpy as np

from inspection.kernels.compiling import inlined_kernel, rows_to_columns
from inspection.kernels.layout import (
    BLOCK,
    CELL_LEFT,
    CELL_RIGHT,
    CELL_WIDTH,
    INSIDE,
    LEFT_EDGE_X,
    LEFT_POLE_CURVATURE,
    LEFT_POLE_X,
    NORMAL_X,
    NORMAL_Y,
    RIGHT_EDGE_X,
    RIGHT_POLE_CURVATURE,
    RIGHT_POLE_X,
    SAMPLE_CURVATURE,
    SAMPLE_SPEED,
    SAMPLE_STATION,
    SAMPLE_U,
    SAMPLE_WIDTH,
    SAMPLE_X,
    SAMPLE_Y,
    TANGENT_X,
    TANGENT_Y,
)

# Memory of a block. Reals: the first columns of the sample's row, those of its neighbour's, and then these.
SITE_ROW, OTHER_ROW = 0, 16
_X, _Y, LANE_LEFT, LANE_ALONG_X, LANE_ALONG_Y, _FIRST_ANGLE, _SECOND_ANGLE, _LENGTH = (BLOCK * (32 + i) for i in range(8))
_FOOT_X, _FOOT_Y, _U, _STATION = (BLOCK * (OTHER_ROW + i) for i in range(4))  # when the neighbour's row is not needed any more
# Integers.
SITE, IS_NEAREST, PLAIN, _ROW, _OTHER, _EDGE = (BLOCK * i for i in range(6))

SMALL_TURN = 1e-2  # rad; as samples lie densely most turns are smaller, and the next term of the series is below round-off
_STEPS = 2  # along the curve, in which most samples are reached


@inlined_kernel
def find_sample(
    values: Any, slots: Any, here: Any, parameter: Any, cells: Any, neighbours: Any, starts: Any, start: float, extent: float, j: int
) -> None:
    """Go down along the curve by a few steps, and see whether that is the nearest of all samples."""
    x, y, u = here[2 * j], here[2 * j + 1], parameter[j]
    step = (u - start) / extent * len(starts)
    site = starts[min(int(step if step >= 0.0 else 0.0), len(starts) - 1)]
    least = square_of_distance(cells, site, x, y)
    for _ in range(_STEPS):
        ahead, behind = int(neighbours[2 * site]), int(neighbours[2 * site + 1])
        to_ahead, to_behind = square_of_distance(cells, ahead, x, y), square_of_distance(cells, behind, x, y)
        nearer = behind if to_behind < least else site
        distance = to_behind if to_behind < least else least
        site, least = (ahead if to_ahead < least else nearer), (to_ahead if to_ahead < least else distance)
    ahead, behind = int(neighbours[2 * site]), int(neighbours[2 * site + 1])
    is_least = (square_of_distance(cells, ahead, x, y) >= least) & (square_of_distance(cells, behind, x, y) >= least)
    values[_X + j], values[_Y + j] = x, y
    slots[SITE + j], slots[_ROW + j] = site, SAMPLE_WIDTH * site
    slots[IS_NEAREST + j] = 1 if is_least & is_in_cell(cells, site, x, y) else 0
    slots[PLAIN + j] = 0


@inlined_kernel
def square_of_distance(cells: Any, site: int, x: float, y: float) -> float:
    """Square of the distance from a sample."""
    dx, dy = x - cells[CELL_WIDTH * site + SAMPLE_X], y - cells[CELL_WIDTH * site + SAMPLE_Y]
    return float(dx * dx + dy * dy)


@inlined_kernel
def is_in_cell(cells: Any, site: int, x: float, y: float) -> bool:
    """Whether a point between the bisectors with both neighbours is surely in the Voronoi cell of a sample."""
    row = CELL_WIDTH * site
    dx, dy = x - cells[row + SAMPLE_X], y - cells[row + SAMPLE_Y]
    below = cells[row + CELL_LEFT] * dy - cells[row + CELL_LEFT + 1] * dx < cells[row + CELL_LEFT + 2]
    above = cells[row + CELL_RIGHT] * dy - cells[row + CELL_RIGHT + 1] * dx < cells[row + CELL_RIGHT + 2]
    return bool(below & above)


@inlined_kernel
def load_samples(values: Any, slots: Any, samples: Any, lanes: int) -> None:
    """Load what the rows of the samples begin with as columns."""
    _load(values, slots, samples, lanes, _ROW, SITE_ROW)


@inlined_kernel
def _load(values: Any, slots: Any, samples: Any, lanes: int, rows: int, column: int) -> None:
    """Load the first 16 columns of rows. The lanes that fill up the last eight take the first row."""
    for j in range(lanes, (lanes + 7) & ~7):
        slots[rows + j] = 0
    for j in range(0, lanes, 8):
        rows_to_columns(samples, slots, rows + j, values, column * BLOCK + j)
        rows_to_columns(samples[8:], slots, rows + j, values, (column + 8) * BLOCK + j)


@inlined_kernel
def choose_neighbours(values: Any, slots: Any, samples: Any, neighbours: Any, lanes: int) -> None:
    """Load the rows of the neighbours on the points' side along the tangent, and measure the angles at the ends of the shared edges."""
    for j in range(lanes):
        dx, dy = values[_X + j] - values[BLOCK * SAMPLE_X + j], values[_Y + j] - values[BLOCK * SAMPLE_Y + j]
        ahead = dx * values[BLOCK * TANGENT_X + j] + dy * values[BLOCK * TANGENT_Y + j]
        off = dx * values[BLOCK * NORMAL_X + j] + dy * values[BLOCK * NORMAL_Y + j]
        site = slots[SITE + j]
        other = int(neighbours[2 * site + (0 if ahead >= 0.0 else 1)])
        slots[_OTHER + j] = SAMPLE_WIDTH * other
        slots[_EDGE + j] = SAMPLE_WIDTH * (site if ahead >= 0.0 else other) + (LEFT_EDGE_X if off > 0.0 else RIGHT_EDGE_X)
    _load(values, slots, samples, lanes, _OTHER, OTHER_ROW)
    for j in range(lanes):
        edge = slots[_EDGE + j]
        vx, vy = samples[edge], samples[edge + 1]
        dx, dy = values[_X + j] - vx, values[_Y + j] - vy
        values[_FIRST_ANGLE + j] = angle_between(values[BLOCK * SAMPLE_X + j] - vx, values[BLOCK * SAMPLE_Y + j] - vy, dx, dy)
        other_x, other_y = values[BLOCK * (OTHER_ROW + SAMPLE_X) + j] - vx, values[BLOCK * (OTHER_ROW + SAMPLE_Y) + j] - vy
        values[_SECOND_ANGLE + j] = angle_between(dx, dy, other_x, other_y)


@inlined_kernel
def angle_between(ax: float, ay: float, bx: float, by: float) -> float:
    """The angle between two directions, not signed."""
    return float(abs(np.arctan2(ax * by - ay * bx, ax * bx + ay * by)))


@inlined_kernel
def take_osculating_circle(values: Any, slots: Any, j: int) -> None:
    """Enter the distance from the osculating circle of the sample, and its gradient."""
    dx, dy = values[_X + j] - values[BLOCK * SAMPLE_X + j], values[_Y + j] - values[BLOCK * SAMPLE_Y + j]
    tx, ty = values[BLOCK * TANGENT_X + j], values[BLOCK * TANGENT_Y + j]
    nx, ny = values[BLOCK * NORMAL_X + j], values[BLOCK * NORMAL_Y + j]
    left, along, across, root = _distance_to_circle(dx * tx + dy * ty, dx * nx + dy * ny, values[BLOCK * SAMPLE_CURVATURE + j])
    values[LANE_LEFT + j], values[LANE_ALONG_X + j], values[LANE_ALONG_Y + j] = left, along * tx + across * nx, along * ty + across * ny
    is_nearest = slots[IS_NEAREST + j]
    slots[PLAIN + j] = is_nearest if root > 0.0 else 0


@inlined_kernel
def take_pole_circle(values: Any, slots: Any, j: int) -> None:
    """Enter the distance from the pole circle of the sample on the point's side, and its gradient."""
    left, gx, gy, root = _pole_circle(values, SITE_ROW, j)
    values[LANE_LEFT + j], values[LANE_ALONG_X + j], values[LANE_ALONG_Y + j] = left, gx, gy
    is_nearest = slots[IS_NEAREST + j]
    slots[PLAIN + j] = is_nearest if root > 0.0 else 0


@inlined_kernel
def blend_pole_circles(values: Any, slots: Any, lanes: int) -> None:
    """Blend the pole circle of the sample with that of its neighbour by the angles at the end of their edge."""
    for j in range(lanes):
        left, gx, gy = values[LANE_LEFT + j], values[LANE_ALONG_X + j], values[LANE_ALONG_Y + j]
        other, other_x, other_y, root = _pole_circle(values, OTHER_ROW, j)
        total, plain = values[_FIRST_ANGLE + j] + values[_SECOND_ANGLE + j], slots[PLAIN + j]
        share = values[_SECOND_ANGLE + j] / total
        values[LANE_LEFT + j] = share * left + (1.0 - share) * other
        values[LANE_ALONG_X + j] = share * gx + (1.0 - share) * other_x
        values[LANE_ALONG_Y + j] = share * gy + (1.0 - share) * other_y
        slots[PLAIN + j] = plain if (root > 0.0) & (total > 0.0) else 0
    for j in range(lanes):  # by itself, because it does not vectorise
        values[_LENGTH + j] = np.hypot(values[LANE_ALONG_X + j], values[LANE_ALONG_Y + j])
    for j in range(lanes):
        length, plain = values[_LENGTH + j], slots[PLAIN + j]
        values[LANE_ALONG_X + j] /= length
        values[LANE_ALONG_Y + j] /= length
        slots[PLAIN + j] = plain if length > 0.0 else 0


@inlined_kernel
def _pole_circle(values: Any, column: int, j: int) -> tuple[float, float, float, float]:
    row = BLOCK * column + j
    dx, dy = values[_X + j] - values[row + BLOCK * SAMPLE_X], values[_Y + j] - values[row + BLOCK * SAMPLE_Y]
    on_left = dx * values[row + BLOCK * NORMAL_X] + dy * values[row + BLOCK * NORMAL_Y] >= 0.0
    left_x, left_y, left_curvature = _pole(values, row, LEFT_POLE_X, LEFT_POLE_CURVATURE)
    right_x, right_y, right_curvature = _pole(values, row, RIGHT_POLE_X, RIGHT_POLE_CURVATURE)
    px, py, curvature = left_x if on_left else right_x, left_y if on_left else right_y, left_curvature if on_left else right_curvature
    side = 1.0 if on_left else -1.0
    distance, along, across, root = _distance_to_circle(dx * py - dy * px, dx * px + dy * py, curvature)
    return side * distance, side * (along * py + across * px), side * (across * py - along * px), root


@inlined_kernel
def _pole(values: Any, row: int, pole: int, curvature: int) -> tuple[float, float, float]:
    return values[row + BLOCK * pole], values[row + BLOCK * (pole + 1)], values[row + BLOCK * curvature]


@inlined_kernel
def _distance_to_circle(a: float, b: float, curvature: float) -> tuple[float, float, float, float]:
    """Signed distance of (a, b) to a circle through the origin with its centre on the second axis, its gradient, and what divides it."""
    s = curvature * (a * a + b * b) - 2.0 * b
    root = np.sqrt(max(1.0 + curvature * s, 0.0))
    return -s / (1.0 + root), -curvature * a / root, (1.0 - curvature * b) / root, root


@inlined_kernel
def complete(values: Any, slots: Any, start: float, end: float, length: float, is_open: bool, j: int) -> None:
    """Enter foot, parameter and arc length, held in their ranges: start .. end and 0 .. length."""
    left, gx, gy = values[LANE_LEFT + j], values[LANE_ALONG_X + j], values[LANE_ALONG_Y + j]
    foot_x, foot_y = values[_X + j] - left * gx, values[_Y + j] - left * gy
    dx, dy = foot_x - values[BLOCK * SAMPLE_X + j], foot_y - values[BLOCK * SAMPLE_Y + j]
    ahead = dx * values[BLOCK * TANGENT_X + j] + dy * values[BLOCK * TANGENT_Y + j]
    off = dx * values[BLOCK * NORMAL_X + j] + dy * values[BLOCK * NORMAL_Y + j]
    curvature = values[BLOCK * SAMPLE_CURVATURE + j]
    turn = curvature * ahead / (1.0 - curvature * off)
    square = turn * turn
    travel = ahead / (1.0 - curvature * off) * (1.0 - square * (1 / 3 - square * (1 / 5 - square / 7)))
    u, station = values[BLOCK * SAMPLE_U + j] + travel / values[BLOCK * SAMPLE_SPEED + j], values[BLOCK * SAMPLE_STATION + j] + travel
    in_range = (u >= start) & (u < end) & (station >= 0.0) & (station < length)
    held_u, held_station, plain = min(max(u, start), end), min(max(station, 0.0), length), slots[PLAIN + j]
    values[_FOOT_X + j], values[_FOOT_Y + j] = foot_x, foot_y
    values[_U + j] = held_u if is_open else u
    values[_STATION + j] = held_station if is_open else station
    slots[PLAIN + j] = plain if (abs(turn) < SMALL_TURN) & (curvature * off < 1.0) & (is_open | in_range) else 0


@inlined_kernel
def store_plain(values: Any, slots: Any, feet: Any, block: int, lanes: int) -> None:
    """Enter the results of the plain lanes, and leave the others as they were."""
    end = block + lanes
    u, e, curvature, station = feet.parameter[block:end], feet.distance_mm[block:end], feet.curvature[block:end], feet.station_mm[block:end]
    foot, gradient = feet.foot_mm.reshape(-1)[2 * block : 2 * end], feet.gradient.reshape(-1)[2 * block : 2 * end]
    vertex = feet.vertex[block:end]
    for j in range(lanes):
        u[j] = _one_of(slots[PLAIN + j], values[_U + j], u[j])
    for j in range(lanes):
        e[j] = _one_of(slots[PLAIN + j], values[LANE_LEFT + j], e[j])
    for j in range(lanes):
        foot[2 * j] = _one_of(slots[PLAIN + j], values[_FOOT_X + j], foot[2 * j])
        foot[2 * j + 1] = _one_of(slots[PLAIN + j], values[_FOOT_Y + j], foot[2 * j + 1])
    for j in range(lanes):
        gradient[2 * j] = _one_of(slots[PLAIN + j], values[LANE_ALONG_X + j], gradient[2 * j])
        gradient[2 * j + 1] = _one_of(slots[PLAIN + j], values[LANE_ALONG_Y + j], gradient[2 * j + 1])
    for j in range(lanes):
        curvature[j] = _one_of(slots[PLAIN + j], values[BLOCK * SAMPLE_CURVATURE + j], curvature[j])
    for j in range(lanes):
        station[j] = _one_of(slots[PLAIN + j], values[_STATION + j], station[j])
    for j in range(lanes):
        vertex[j] = _one_of(slots[PLAIN + j], INSIDE, vertex[j])


@inlined_kernel
def _one_of(plain: int, new: Any, old: Any) -> Any:
    return new if plain == 1 else old
