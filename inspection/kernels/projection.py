"""Feet of many points by any method, on one thread or several, and their deviations, worked out while the feet are in the cache."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from inspection.kernels.blocks import CurveTables
from inspection.kernels.compiling import claim_chunk, inlined_kernel, kernel
from inspection.kernels.feet import Feet, empty_feet, feet_between, flatten, share_out
from inspection.kernels.layout import AT_ONCE, CHUNK, FIRST_PARAMETER, INSIDE, LAST_PARAMETER, OPEN_END
from inspection.kernels.on_samples import SampleTables, project_by, projection_of

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_NO_FLAGS: Flags = np.empty(0, dtype=np.bool_)
_NOT_TURNED = (1.0, 0.0, np.inf, _NO_FLAGS, _NO_FLAGS, np.zeros(2, dtype=np.int64))


class Turned(NamedTuple):
    """Feet of m points with distances and gradients that grow out of material, and what a caller asks of them.

    feet         : `distance_mm` is the deviation, the tip radius already taken off; `gradient` is the direction in which it grows
    beyond_end   : (m,) the foot is an open end
    at_vertex    : (m,) the foot is a vertex
    is_any_far   : a coordinate is no number, or beyond the limit
    is_any_first_or_last : a foot has the first or the last parameter of the curve
    """

    feet: Feet
    beyond_end: Flags
    at_vertex: Flags
    is_any_far: bool
    is_any_first_or_last: bool


def project(points_mm: Array, grid: CurveTables, threads: int | None = None) -> Feet:
    """Globally closest points of the curve of `grid` to points (m, 2). Points that are not finite give NaN.

    threads : None chooses by the number of points; the result is the same.
    """
    return _feet_of(points_mm, grid, None, "exact", _NOT_TURNED, threads)


def project_on_samples(points_mm: Array, grid: CurveTables, table: SampleTables, method: str, threads: int | None = None) -> Feet:
    """Feet of points (m, 2) by a method that looks at samples only: circle, chord, pcp or veaw (see `methods`).

    The grid merely says where to begin the search for the nearest sample. Points that are not finite give NaN.
    """
    return _feet_of(points_mm, grid, table, method, _NOT_TURNED, threads)


def project_outward(
    points_mm: Array, grid: CurveTables, table: SampleTables | None, method: str, outward: float, tip_radius_mm: float, farthest_mm: float
) -> Turned:
    """Feet of points (m, 2) with signed deviations: exact ones, or those of a method that looks at the samples of a table.

    outward     : 1.0 where left of the curve is out of material, else -1.0
    farthest_mm : a coordinate beyond it is told
    """
    m, found = len(points_mm), np.zeros(2, dtype=np.int64)
    beyond_end, at_vertex = np.empty(m, dtype=np.bool_), np.empty(m, dtype=np.bool_)
    turned = (outward, tip_radius_mm, farthest_mm, beyond_end, at_vertex, found)
    feet = _feet_of(points_mm, grid, table, method, turned, None)
    far, first_or_last = found.tolist()
    return Turned(feet, beyond_end, at_vertex, far > 0, first_or_last > 0)


def _feet_of(points_mm: Array, grid: CurveTables, table: SampleTables | None, method: str, turned: Any, threads: int | None) -> Feet:
    points = flatten(points_mm)
    feet = empty_feet(len(points) // 2)
    asked = (points, grid.reals, grid.integers, projection_of(table, method), tuple(feet), turned)  # plain, see `rows.Columns`
    share_out(lambda claimed: _project_chunks(*asked, claimed), len(feet.vertex), threads)
    return feet


@kernel
def _project_chunks(points: Any, reals: Any, integers: Any, projection: Any, feet: Any, turned: Any, claimed: Any) -> None:
    """Project the flat points (2 m,), AT_ONCE together as this thread claims them, and turn their feet outward where that is asked for."""
    beyond_end = turned[3]
    every, m = Feet(*feet), len(feet[0])
    begin = claim_chunk(claimed) // CHUNK * AT_ONCE
    while begin < m:
        end = min(begin + AT_ONCE, m)
        some, here = feet_between(every, begin, end), points[2 * begin : 2 * end]
        project_by(projection, here, reals, integers, some)
        if len(beyond_end) > 0:
            _turn_outward(here, some, reals[FIRST_PARAMETER], reals[LAST_PARAMETER], turned, begin, end)
        begin = claim_chunk(claimed) // CHUNK * AT_ONCE


@inlined_kernel
def _turn_outward(points: Any, feet: Any, first: float, last: float, turned: Any, begin: int, end: int) -> None:
    """Make distances and gradients of a chunk positive where outward is, and take the tip radius off. Enter and tell what was asked for."""
    outward, tip, farthest, beyond_end, at_vertex, found = turned
    ends, vertices, gradient = beyond_end[begin:end], at_vertex[begin:end], feet.gradient.reshape(-1)
    for i in range(end - begin):
        feet.distance_mm[i] = outward * feet.distance_mm[i] - tip
    for i in range(len(gradient)):
        gradient[i] *= outward
    for i in range(end - begin):
        ends[i] = feet.vertex[i] == OPEN_END
        vertices[i] = feet.vertex[i] != INSIDE
    far = either = np.int64(0)  # for numbers, unlike for truths, the loops vectorise
    for i in range(len(points)):
        far |= np.int64(0) if abs(points[i]) <= farthest else np.int64(1)
    for i in range(end - begin):
        either |= np.int64(1) if (feet.parameter[i] == first) | (feet.parameter[i] == last) else np.int64(0)
    found[0] |= far
    found[1] |= either
