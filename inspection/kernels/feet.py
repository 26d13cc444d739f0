"""Closest points as records of arrays, the closer of two feet, and the sharing of points among threads."""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from inspection.kernels.compiling import inner_kernel
from inspection.kernels.layout import (
    CHUNK,
    FOOT_CURVATURE,
    FOOT_DISTANCE,
    FOOT_GRADIENT_X,
    FOOT_GRADIENT_Y,
    FOOT_STATION,
    FOOT_U,
    FOOT_VERTEX,
    FOOT_X,
    FOOT_Y,
)

Array = NDArray[np.float64]
Marks = NDArray[np.uint8]
Room = Callable[[tuple[int, ...], type[np.generic]], NDArray[Any]]
"""Gives an array of a shape and a type, whose values are not set: numpy.empty, or what keeps the arrays of a long scan on a disk."""

_SHARED = 65_536  # points from which a batch is worth waking other threads
_HELPERS = ThreadPoolExecutor(max(1, (os.cpu_count() or 1) - 1), "projection")  # started when first needed: a start takes 0.1 ms


class Feet(NamedTuple):
    """Closest points on a curve of m points.

    parameter   : (m,) curve parameter
    foot_mm     : (m, 2)
    distance_mm : (m,) positive to the left of the direction of travel
    gradient    : (m, 2) unit direction in which `distance_mm` grows; on the curve its left normal
    curvature   : (m,) 1/mm at the foot, positive where the curve turns left; 0 at vertices
    station_mm  : (m,) arc length from the start of the curve
    vertex      : (m,) INSIDE, CORNER or OPEN_END (see layout)
    """

    parameter: Array
    foot_mm: Array
    distance_mm: Array
    gradient: Array
    curvature: Array
    station_mm: Array
    vertex: NDArray[np.uint8]


def flatten(points_mm: Array) -> Array:
    """Points (m, 2) as the flat array (2 m,) that the loops take."""
    points = np.ascontiguousarray(points_mm, dtype=np.float64).reshape(-1)
    return points if points.flags.writeable else points.copy()  # one type for the compiler, whatever the caller's flags


def empty_feet(m: int) -> Feet:
    """Feet of m points, not filled in. The arrays are separate: the allocator reuses blocks of such a size, but would zero a large one."""
    return Feet(np.empty(m), np.empty((m, 2)), np.empty(m), np.empty((m, 2)), np.empty(m), np.empty(m), np.empty(m, dtype=np.uint8))


def share_out(work: Callable[[NDArray[np.int64]], None], m: int, threads: int | None) -> None:
    """Let one or more threads claim chunks of m points until none are left. None chooses the number of threads by that of the points."""
    claimed = np.zeros(1, dtype=np.int64)
    if threads is None:
        threads = (os.cpu_count() or 1) if m >= _SHARED else 1
    if threads == 1:
        work(claimed)
        return
    helping = [_HELPERS.submit(work, claimed) for _ in range(min(threads, -(-m // CHUNK)) - 1)]
    work(claimed)
    for help_given in helping:
        if not help_given.cancel():  # one that has not begun, as in a forked process, has nothing left to do
            help_given.result()


@inner_kernel
def feet_between(feet: Any, begin: int, end: int) -> Any:
    """The feet from one row to before another, in the memory of all."""
    return Feet(
        feet.parameter[begin:end],
        feet.foot_mm[begin:end],
        feet.distance_mm[begin:end],
        feet.gradient[begin:end],
        feet.curvature[begin:end],
        feet.station_mm[begin:end],
        feet.vertex[begin:end],
    )


@inner_kernel
def store_foot(foot: Any, feet: Any, i: int) -> None:
    """Enter the results of one point as row i."""
    feet.parameter[i], feet.distance_mm[i] = foot[FOOT_U], foot[FOOT_DISTANCE]
    feet.curvature[i], feet.station_mm[i] = foot[FOOT_CURVATURE], foot[FOOT_STATION]
    feet.foot_mm[i, 0], feet.foot_mm[i, 1] = foot[FOOT_X], foot[FOOT_Y]
    feet.gradient[i, 0], feet.gradient[i, 1] = foot[FOOT_GRADIENT_X], foot[FOOT_GRADIENT_Y]
    feet.vertex[i] = np.uint8(foot[FOOT_VERTEX])


@inner_kernel
def keep_closer(foot: Any, feet: Any, point: int) -> None:
    """Enter a foot where it is closer than the one so far. Of equally close feet the same one is kept, in whatever order they come."""
    order = abs(foot[FOOT_DISTANCE]) - abs(feet.distance_mm[point])
    if order == 0.0:
        order = foot[FOOT_U] - feet.parameter[point]
    if order == 0.0:  # one foot, worked out on two pieces or by the search as well: the last bits may differ
        order = foot[FOOT_STATION] - feet.station_mm[point]
    if order == 0.0:
        order = foot[FOOT_CURVATURE] - feet.curvature[point]
    for axis in range(2):
        if order == 0.0:
            order = foot[FOOT_X + axis] - feet.foot_mm[point, axis]
        if order == 0.0:
            order = foot[FOOT_GRADIENT_X + axis] - feet.gradient[point, axis]
    if order < 0.0:
        store_foot(foot, feet, point)
