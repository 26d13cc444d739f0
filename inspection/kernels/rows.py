"""Points of a scan, row by row: machine points in, verdicts out."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from inspection.kernels.compiling import brief_kernel, kernel
from inspection.kernels.feet import Feet
from inspection.kernels.layout import (
    BEYOND_END,
    CONFORM,
    IN_HOLLOW,
    NONCONFORM,
    NOT_FINITE,
    NOT_JUDGED,
    NOT_REJECTED,
    OFF_SECTION,
    OPEN_END,
    PLANE_NORMAL,
    PLANE_ORIGIN,
    PLANE_X_AXIS,
    PLANE_Y_AXIS,
    REJECTIONS,
    UNCERTAIN,
)

Array = NDArray[np.float64]
Codes = NDArray[np.int8]
Columns = tuple[Array, Array, Codes, Codes, NDArray[np.int64], Array]  # plain tuples: a named one takes numba a microsecond a call
Places = tuple[Array, Array, Array]
Judgement = tuple[float, float, float, float, float]

JUDGED_AS = REJECTIONS  # place in the tally of the verdict 0; before it come the rejections
TALLY = JUDGED_AS + NONCONFORM + 1


def judge_rows(
    section_mm: Array,
    columns: Columns,
    places: Places,
    base: int,
    first: int,
    stop: int,
    pose: tuple[float, float, float, float],
    project: Callable[[Array], Feet],
    judgement: Judgement,
) -> None:
    """Place rows first .. stop - 1 of the section points (n, 2), project them, and enter what they are found to be.

    columns   : station and deviation in mm (n,), codes of the verdict and of the rejection (n,), NaN and NOT_JUDGED where there is no
                verdict; how many rows have each rejection and, from JUDGED_AS on, each verdict (TALLY,); heights above the plane (n,)
    places    : surface points, nominal points and directions of the deviation, (w, 2) each, of the rows from `base` on
    pose      : cosine and sine of the rotation, then the shift in mm (x, y)
    project   : feet of points (m, 2) in nominal coordinates; a row that cannot be used comes as NaN
    judgement : 1.0 where left of the curve is out of material, else -1.0; tip radius, lower and upper limit, uncertainty in mm
    """
    feet = project(place_rows(section_mm, columns[3], first, stop, pose))
    enter_feet(
        feet.foot_mm, feet.distance_mm, feet.gradient, feet.curvature, feet.station_mm, feet.vertex, judgement, first, base, columns, places
    )


def take_in(
    points_mm: Array, plane: Array, off_section_max_mm: float, section_mm: Array, columns: Columns, places: Places, base: int, at: int
) -> None:
    """Enter points (m, 2) or (m, 3) as section points from row `at` on, not judged yet, and why any cannot be used.

    plane : (12,) origin, x axis, y axis and normal of the section in machine coordinates
    columns, places, base : see judge_rows
    """
    enter_points(points_mm, plane, off_section_max_mm, section_mm, columns, places, base, at)


@brief_kernel
def enter_points(points: Any, plane: Any, off_section_max: float, section: Any, columns: Any, places: Any, base: int, at: int) -> None:
    """Enter points in another kernel, see `take_in`."""
    flat = points.shape[1] == 2
    stations, deviations, verdicts, rejection, tally, heights = columns
    for i in range(len(points)):
        row = at + i
        x, y, height = points[i, 0], points[i, 1], 0.0
        if not flat:
            px, py, pz = x - plane[PLANE_ORIGIN], y - plane[PLANE_ORIGIN + 1], points[i, 2] - plane[PLANE_ORIGIN + 2]
            x = px * plane[PLANE_X_AXIS] + py * plane[PLANE_X_AXIS + 1] + pz * plane[PLANE_X_AXIS + 2]
            y = px * plane[PLANE_Y_AXIS] + py * plane[PLANE_Y_AXIS + 1] + pz * plane[PLANE_Y_AXIS + 2]
            height = px * plane[PLANE_NORMAL] + py * plane[PLANE_NORMAL + 1] + pz * plane[PLANE_NORMAL + 2]
        section[row, 0], section[row, 1], heights[row] = x, y, height
        if not (np.isfinite(x) and np.isfinite(y) and np.isfinite(height)):
            rejection[row] = NOT_FINITE
        elif abs(height) > off_section_max:
            rejection[row] = OFF_SECTION
        else:
            rejection[row] = NOT_REJECTED
        verdicts[row] = NOT_JUDGED
        stations[row] = deviations[row] = np.nan
        tally[rejection[row]] += 1
        for place in places:
            place[row - base, 0] = place[row - base, 1] = np.nan


def place_rows(section_mm: Array, rejection: Codes, first: int, stop: int, pose: tuple[float, float, float, float]) -> Array:
    """Rows first .. stop - 1 in nominal coordinates; NaN where a row cannot be used."""
    moved = np.empty((stop - first, 2))
    place_some(section_mm, rejection, first, pose, moved)
    return moved


@kernel
def place_some(section: Any, rejection: Any, first: int, pose: Any, moved: Any) -> None:
    """Enter as many rows as `moved` has in nominal coordinates, see `place_rows`."""
    c, s, tx, ty = pose
    for i in range(len(moved)):
        row = first + i
        if rejection[row] == NOT_FINITE or rejection[row] == OFF_SECTION:
            moved[i, 0] = moved[i, 1] = np.nan
        else:
            x, y = section[row, 0], section[row, 1]
            moved[i, 0] = c * x - s * y + tx
            moved[i, 1] = s * x + c * y + ty


@kernel
def enter_feet(
    foot: Any,
    distance: Any,
    gradient: Any,
    curvature: Any,
    station: Any,
    vertex: Any,
    judgement: Any,
    first: int,
    base: int,
    columns: Any,
    places: Any,
) -> None:
    """Enter what rows are found to be by the feet of their points, see `judge_rows`."""
    outward, tip, lower, upper, uncertainty = judgement
    stations, deviations, verdicts, rejection, tally, _ = columns
    actual, feet, normals = places
    for i in range(len(distance)):
        row, place = first + i, first + i - base
        tally[rejection[row]] -= 1
        if verdicts[row] != NOT_JUDGED:
            tally[JUDGED_AS + verdicts[row]] -= 1
        if rejection[row] == BEYOND_END or rejection[row] == IN_HOLLOW:
            rejection[row] = NOT_REJECTED  # at an earlier pose
        too_tight = outward * curvature[i] * tip >= 1.0  # the ball does not reach the foot
        if np.isnan(distance[i]) or vertex[i] == OPEN_END or too_tight or rejection[row] != NOT_REJECTED:
            if rejection[row] == NOT_REJECTED:
                rejection[row] = IN_HOLLOW if too_tight else BEYOND_END
            actual[place, 0] = actual[place, 1] = feet[place, 0] = feet[place, 1] = normals[place, 0] = normals[place, 1] = np.nan
            stations[row] = deviations[row] = np.nan
            verdicts[row] = NOT_JUDGED
            tally[rejection[row]] += 1
            continue
        e = outward * distance[i] - tip
        nx, ny = outward * gradient[i, 0], outward * gradient[i, 1]
        actual[place, 0], actual[place, 1] = foot[i, 0] + e * nx, foot[i, 1] + e * ny
        feet[place, 0], feet[place, 1] = foot[i, 0], foot[i, 1]
        normals[place, 0], normals[place, 1] = nx, ny
        stations[row], deviations[row] = station[i], e
        beyond = max(lower - e, e - upper)
        verdicts[row] = NONCONFORM if beyond > uncertainty else CONFORM if beyond <= -uncertainty else UNCERTAIN
        tally[rejection[row]] += 1
        tally[JUDGED_AS + verdicts[row]] += 1
