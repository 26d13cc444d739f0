"""The paper's methods: projections made at the nearest sample of the nominal."""

from functools import cache
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from inspection.kernels.blocks import FEET, call_projection, projection_code, search_code
from inspection.kernels.compiling import (
    INTEGER,
    INTEGER_ARRAY,
    INTEGER_TABLE,
    REAL_ARRAY,
    REAL_TABLE,
    SHORT_TABLE,
    array_at,
    call_of,
    claim_chunk,
    code_of,
    inlined_kernel,
    inner_kernel,
    stack_integers,
    stack_reals,
    tuple_of,
)
from inspection.kernels.feet import store_foot
from inspection.kernels.layout import (
    AT_OPEN_END,
    BLOCK,
    CHORD,
    CHUNK,
    CIRCLE,
    CORNER,
    DOMAIN_CLOSED,
    DOMAIN_END,
    DOMAIN_LENGTH_MM,
    DOMAIN_START,
    FOOT_CURVATURE,
    FOOT_DISTANCE,
    FOOT_GRADIENT_X,
    FOOT_GRADIENT_Y,
    FOOT_STATION,
    FOOT_U,
    FOOT_VERTEX,
    FOOT_WIDTH,
    FOOT_X,
    FOOT_Y,
    INSIDE,
    INTEGERS,
    LEFT_EDGE_X,
    LEFT_POLE_CURVATURE,
    LEFT_POLE_X,
    LEFT_POLE_Y,
    LINK_WIDTH,
    NEXT_SAMPLE,
    NORMAL_X,
    NORMAL_Y,
    OPEN_END,
    PCP,
    PREVIOUS_SAMPLE,
    REALS,
    RIGHT_EDGE_X,
    RIGHT_POLE_CURVATURE,
    RIGHT_POLE_X,
    RIGHT_POLE_Y,
    SAMPLE_CURVATURE,
    SAMPLE_METHODS,
    SAMPLE_SPEED,
    SAMPLE_STATION,
    SAMPLE_U,
    SAMPLE_WIDTH,
    SAMPLE_X,
    SAMPLE_Y,
    STACK_AT,
    TANGENT_X,
    TANGENT_Y,
    TWIN_SAMPLE,
    VEAW,
)
from inspection.kernels.nearest_sample import nearest_sample
from inspection.kernels.sample_lanes import (
    IS_NEAREST,
    PLAIN,
    SITE,
    SMALL_TURN,
    angle_between,
    blend_pole_circles,
    choose_neighbours,
    complete,
    find_sample,
    load_samples,
    store_plain,
    take_osculating_circle,
    take_pole_circle,
)

Array = NDArray[np.float64]


class SampleTables(Protocol):
    """The samples of a nominal, packed."""

    @property
    def flat(self) -> tuple[Array, NDArray[np.int64], Array, NDArray[np.int64], Array, Array, NDArray[np.int32]]:
        """Samples, links, the boxes of the search tree, where a search begins, the domain of the curve, cells and neighbours."""
        ...


_TABLES = tuple_of(REAL_TABLE, INTEGER_TABLE, REAL_TABLE, INTEGER_TABLE, REAL_TABLE, REAL_TABLE, SHORT_TABLE, INTEGER)
_ON_SAMPLES = (REAL_ARRAY, _TABLES, FEET, INTEGER_ARRAY)  # the types that `project_points_on_samples` takes
_call_on_samples = call_of(*_ON_SAMPLES)
BY_PROJECTION = tuple_of(_TABLES, tuple_of(INTEGER, INTEGER, INTEGER))  # the type of what `projection_of` gives
# What stands in for the samples where a method needs none: of the same types, so that one compiled fit serves all methods.
_NO_REALS, _NO_INTEGERS, _NO_SHORTS = np.empty(0), np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int32)
for _empty in (_NO_REALS, _NO_INTEGERS, _NO_SHORTS):
    _empty.setflags(write=False)
_NO_TABLES = (_NO_REALS, _NO_INTEGERS, _NO_REALS, _NO_INTEGERS, _NO_REALS, _NO_REALS, _NO_SHORTS, 0)
NO_PROJECTION = (_NO_TABLES, (0, 0, 0))  # where no point is to be projected


@cache
def _on_samples_code() -> int:
    """Where the code of `project_points_on_samples` is."""
    return code_of(project_points_on_samples, *_ON_SAMPLES)


def projection_of(table: SampleTables | None, method: str) -> tuple[Any, tuple[int, int, int]]:
    """A projection for `project_by`: the tables of a method that looks at samples only, and where the code is. No table: exact feet."""
    if table is None:
        return _NO_TABLES, (projection_code(), search_code(), 0)
    return (*table.flat, SAMPLE_METHODS.index(method)), (projection_code(), search_code(), _on_samples_code())


@inner_kernel
def project_by(projection: Any, points: Any, reals: Any, integers: Any, feet: Any) -> None:
    """Project points in another kernel, by a projection of `projection_of`."""
    tables, (exact, search, on_samples) = projection
    call_projection(exact, (points, reals, integers, search, feet, np.zeros(1, dtype=np.int64)))
    if on_samples != 0:
        _call_on_samples(on_samples, (points, tables, feet, np.zeros(1, dtype=np.int64)))


@inner_kernel
def project_points_on_samples(points: Any, tables: Any, feet: Any, claimed: Any) -> None:
    """Project the points chunk by chunk as they are claimed. Feet hold the exact results and take the new ones in their place."""
    samples, links, boxes, starts, domain, cells, neighbours, method = tables
    values, slots = array_at(stack_reals(), REALS), array_at(stack_integers(), INTEGERS)
    stack, foot, start, extent = slots[STACK_AT:], np.empty(FOOT_WIDTH), domain[DOMAIN_START], domain[DOMAIN_END] - domain[DOMAIN_START]
    first = claim_chunk(claimed)
    while first < len(feet.vertex):
        for block in range(first, min(first + CHUNK, len(feet.vertex)), BLOCK):
            lanes = min(BLOCK, len(feet.vertex) - block)
            here, parameter = points[2 * block : 2 * (block + lanes)], feet.parameter[block : block + lanes]
            for j in range(lanes):
                find_sample(values, slots, here, parameter, cells, neighbours, starts, start, extent, j)
            if method != CHORD:
                _project_plain(values, slots, samples, domain, neighbours, method, lanes)
                store_plain(values, slots, feet, block, lanes)
            for j in range(lanes):
                if slots[PLAIN + j] == 1 or np.isnan(parameter[j]):
                    continue
                x, y, site = here[2 * j], here[2 * j + 1], slots[SITE + j]
                if slots[IS_NEAREST + j] == 0:
                    step = int((parameter[j] - start) / extent * len(starts))
                    site = nearest_sample(x, y, starts[min(max(step, 0), len(starts) - 1)], cells, links, boxes, stack)
                site, facing = _facing_sample(x, y, site, samples, links)
                if facing:
                    _on_faced_sample(x, y, site, method, samples, links, domain, foot)
                else:
                    _take_sample(x, y, site, samples, links, foot)
                store_foot(foot, feet, block + j)
        first = claim_chunk(claimed)


@inlined_kernel
def _project_plain(values: Any, slots: Any, samples: Any, domain: Any, neighbours: Any, method: int, lanes: int) -> None:
    """Project those points of a block of which no case has to be told apart."""
    load_samples(values, slots, samples, lanes)
    if method == CIRCLE:
        for j in range(lanes):
            take_osculating_circle(values, slots, j)
    else:
        for j in range(lanes):
            take_pole_circle(values, slots, j)
    if method == VEAW:
        choose_neighbours(values, slots, samples, neighbours, lanes)
        blend_pole_circles(values, slots, lanes)
    start, end, length, is_open = domain[DOMAIN_START], domain[DOMAIN_END], domain[DOMAIN_LENGTH_MM], domain[DOMAIN_CLOSED] == 0.0
    for j in range(lanes):
        complete(values, slots, start, end, length, is_open, j)


@inlined_kernel
def _on_faced_sample(x: float, y: float, site: int, method: int, samples: Any, links: Any, domain: Any, foot: Any) -> None:
    if method == CIRCLE:
        left, gx, gy = _on_osculating_circle(x, y, site, samples)
    elif method == CHORD:
        left, gx, gy = _on_chords(x, y, site, samples, links)
    elif method == PCP:
        left, gx, gy = _on_pole_circle(x, y, site, samples)
    else:
        left, gx, gy = _between_pole_circles(x, y, site, samples, links)
    _complete(x, y, site, left, gx, gy, samples, domain, foot)


@inlined_kernel
def _in_frame(x: float, y: float, site: int, samples: Any) -> tuple[float, float]:
    """Coordinates of a point along the tangent and the normal of a sample."""
    row = SAMPLE_WIDTH * site
    dx, dy = x - samples[row + SAMPLE_X], y - samples[row + SAMPLE_Y]
    return dx * samples[row + TANGENT_X] + dy * samples[row + TANGENT_Y], dx * samples[row + NORMAL_X] + dy * samples[row + NORMAL_Y]


@inlined_kernel
def _facing_sample(x: float, y: float, site: int, samples: Any, links: Any) -> tuple[int, bool]:
    """The sample, or its twin on the other side of a corner, on a piece that the point faces; the nearer tangent wins."""
    ahead, off = _in_frame(x, y, site, samples)
    faced = _is_faced(ahead, site, links)
    twin = links[LINK_WIDTH * site + TWIN_SAMPLE]
    if twin >= 0:
        twin_ahead, twin_off = _in_frame(x, y, twin, samples)
        twin_faced = _is_faced(twin_ahead, twin, links)
        if twin_faced and (not faced or abs(twin_off) < abs(off)):
            return twin, True
    return site, faced


@inlined_kernel
def _is_faced(ahead: float, site: int, links: Any) -> bool:
    return (links[LINK_WIDTH * site + PREVIOUS_SAMPLE] >= 0 or ahead >= 0.0) and (
        links[LINK_WIDTH * site + NEXT_SAMPLE] >= 0 or ahead <= 0.0
    )


@inner_kernel
def _take_sample(x: float, y: float, site: int, samples: Any, links: Any, foot: Any) -> None:
    """Take the sample itself as the foot, its distance signed by the sum of the normals that meet there."""
    row, twin = SAMPLE_WIDTH * site, links[LINK_WIDTH * site + TWIN_SAMPLE]
    other = SAMPLE_WIDTH * (twin if twin >= 0 else site)
    nx, ny = samples[row + NORMAL_X] + samples[other + NORMAL_X], samples[row + NORMAL_Y] + samples[other + NORMAL_Y]
    length = np.hypot(nx, ny)
    nx, ny = nx / length, ny / length
    dx, dy = x - samples[row + SAMPLE_X], y - samples[row + SAMPLE_Y]
    distance = np.hypot(dx, dy)
    side = 1.0 if dx * nx + dy * ny >= 0.0 else -1.0
    if distance > 0.0:
        nx, ny = dx * (side / distance), dy * (side / distance)
    foot[FOOT_U], foot[FOOT_STATION] = samples[row + SAMPLE_U], samples[row + SAMPLE_STATION]
    foot[FOOT_X], foot[FOOT_Y] = samples[row + SAMPLE_X], samples[row + SAMPLE_Y]
    foot[FOOT_DISTANCE], foot[FOOT_CURVATURE] = side * distance, 0.0
    foot[FOOT_GRADIENT_X], foot[FOOT_GRADIENT_Y] = nx, ny
    foot[FOOT_VERTEX] = OPEN_END if links[LINK_WIDTH * site + AT_OPEN_END] else CORNER


@inlined_kernel
def _distance_to_circle(a: float, b: float, curvature: float) -> tuple[float, float, float]:
    """Signed distance of (a, b) to a circle through the origin with its centre on the second axis, and its gradient."""
    s = curvature * (a * a + b * b) - 2.0 * b
    root = np.sqrt(max(1.0 + curvature * s, 0.0))
    if root == 0.0:
        return -s, -curvature * a, 1.0
    return -s / (1.0 + root), -curvature * a / root, (1.0 - curvature * b) / root


@inlined_kernel
def _on_osculating_circle(x: float, y: float, site: int, samples: Any) -> tuple[float, float, float]:
    row = SAMPLE_WIDTH * site
    a, b = _in_frame(x, y, site, samples)
    left, along, across = _distance_to_circle(a, b, samples[row + SAMPLE_CURVATURE])
    gx = along * samples[row + TANGENT_X] + across * samples[row + NORMAL_X]
    gy = along * samples[row + TANGENT_Y] + across * samples[row + NORMAL_Y]
    return left, gx, gy


@inlined_kernel
def _on_pole_circle(x: float, y: float, site: int, samples: Any) -> tuple[float, float, float]:
    """Left-signed distance to the pole circle on the point's side (equations 2 and 3, the reading `side`), and its gradient."""
    row = SAMPLE_WIDTH * site
    dx, dy = x - samples[row + SAMPLE_X], y - samples[row + SAMPLE_Y]
    if dx * samples[row + NORMAL_X] + dy * samples[row + NORMAL_Y] >= 0.0:
        px, py, curvature, side = samples[row + LEFT_POLE_X], samples[row + LEFT_POLE_Y], samples[row + LEFT_POLE_CURVATURE], 1.0
    else:
        px, py, curvature, side = samples[row + RIGHT_POLE_X], samples[row + RIGHT_POLE_Y], samples[row + RIGHT_POLE_CURVATURE], -1.0
    distance, along, across = _distance_to_circle(dx * py - dy * px, dx * px + dy * py, curvature)
    return side * distance, side * (along * py + across * px), side * (across * py - along * px)


@inner_kernel
def _between_pole_circles(x: float, y: float, site: int, samples: Any, links: Any) -> tuple[float, float, float]:
    """Pole circles of the sample and its neighbour, blended by angles at the end of their Voronoi edge (equations 4 to 6)."""
    ahead, off = _in_frame(x, y, site, samples)
    left, gx, gy = _on_pole_circle(x, y, site, samples)
    other = links[LINK_WIDTH * site + NEXT_SAMPLE] if ahead >= 0.0 else links[LINK_WIDTH * site + PREVIOUS_SAMPLE]
    if other < 0:
        return left, gx, gy
    edge = SAMPLE_WIDTH * (site if ahead >= 0.0 else other) + (LEFT_EDGE_X if off > 0.0 else RIGHT_EDGE_X)
    vx, vy = samples[edge], samples[edge + 1]
    row, other_row = SAMPLE_WIDTH * site, SAMPLE_WIDTH * other
    at_site = angle_between(samples[row + SAMPLE_X] - vx, samples[row + SAMPLE_Y] - vy, x - vx, y - vy)
    at_other = angle_between(x - vx, y - vy, samples[other_row + SAMPLE_X] - vx, samples[other_row + SAMPLE_Y] - vy)
    total = at_site + at_other
    if not total > 0.0:  # also where the two cells share no edge (NaN)
        return left, gx, gy
    share = at_other / total
    left_other, gx_other, gy_other = _on_pole_circle(x, y, other, samples)
    first_x, first_y = gx, gy
    gx, gy = share * gx + (1.0 - share) * gx_other, share * gy + (1.0 - share) * gy_other
    length = np.hypot(gx, gy)
    if length == 0.0:  # at a Voronoi vertex the two directions may be opposite: either is as near
        return left, first_x, first_y
    return share * left + (1.0 - share) * left_other, gx / length, gy / length


@inner_kernel
def _on_chords(x: float, y: float, site: int, samples: Any, links: Any) -> tuple[float, float, float]:
    """Projection on the nearer of the two chords that meet at the sample, signed by the side of its normal."""
    row = SAMPLE_WIDTH * site
    left, gx, gy = np.inf, samples[row + NORMAL_X], samples[row + NORMAL_Y]
    for side in range(2):
        other = links[LINK_WIDTH * site + NEXT_SAMPLE + side]
        if other < 0:
            continue
        there = SAMPLE_WIDTH * other
        sx, sy = samples[there + SAMPLE_X] - samples[row + SAMPLE_X], samples[there + SAMPLE_Y] - samples[row + SAMPLE_Y]
        dx, dy = x - samples[row + SAMPLE_X], y - samples[row + SAMPLE_Y]
        share = min(max((dx * sx + dy * sy) / (sx * sx + sy * sy), 0.0), 1.0)
        dx, dy = dx - share * sx, dy - share * sy
        distance = np.hypot(dx, dy)
        if distance < abs(left):
            sign = 1.0 if dx * samples[row + NORMAL_X] + dy * samples[row + NORMAL_Y] >= 0.0 else -1.0
            left, gx, gy = sign * distance, samples[row + NORMAL_X], samples[row + NORMAL_Y]
            if distance > 0.0:
                gx, gy = dx * (sign / distance), dy * (sign / distance)
    return left, gx, gy


@inlined_kernel
def _complete(x: float, y: float, site: int, left: float, gx: float, gy: float, samples: Any, domain: Any, foot: Any) -> None:
    """Fill in the foot of a projection. Its arc length from the sample is that along the osculating circle."""
    row = SAMPLE_WIDTH * site
    foot_x, foot_y = x - left * gx, y - left * gy
    ahead, off = _in_frame(foot_x, foot_y, site, samples)
    curvature = samples[row + SAMPLE_CURVATURE]
    turn = curvature * ahead / (1.0 - curvature * off)
    if abs(turn) < SMALL_TURN and curvature * off < 1.0:
        square = turn * turn
        travel = ahead / (1.0 - curvature * off) * (1.0 - square * (1 / 3 - square * (1 / 5 - square / 7)))
    else:
        travel = np.arctan2(curvature * ahead, 1.0 - curvature * off) / curvature
    closed = domain[DOMAIN_CLOSED] != 0.0
    foot[FOOT_U] = _hold_in_domain(
        samples[row + SAMPLE_U] + travel / samples[row + SAMPLE_SPEED], domain[DOMAIN_START], domain[DOMAIN_END], closed
    )
    foot[FOOT_X], foot[FOOT_Y], foot[FOOT_DISTANCE] = foot_x, foot_y, left
    foot[FOOT_GRADIENT_X], foot[FOOT_GRADIENT_Y] = gx, gy
    foot[FOOT_CURVATURE], foot[FOOT_VERTEX] = curvature, INSIDE
    foot[FOOT_STATION] = _hold_in_domain(samples[row + SAMPLE_STATION] + travel, 0.0, domain[DOMAIN_LENGTH_MM], closed)


@inlined_kernel
def _hold_in_domain(value: float, start: float, end: float, closed: bool) -> float:
    if not closed:
        return min(max(value, start), end)
    if start <= value < end:
        return value
    return start + (value - start) % (end - start)
