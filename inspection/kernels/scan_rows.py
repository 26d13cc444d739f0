"""Points of a scan, row by row: machine points in, verdicts out."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from inspection.kernels.compiling import kernel
from inspection.kernels.feet import Feet
from inspection.kernels.layout import (
    BEYOND_END,
    CONFORM,
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
    UNCERTAIN,
)

Array = NDArray[np.float64]


def take_in(points_mm: Array, plane: Array, off_section_max_mm: float, section_mm: Array, rejection: NDArray[np.int8], at: int) -> None:
    """Enter points (m, 2) or (m, 3) as section points from row `at` on, and why any cannot be used.

    plane : (12,) origin, x axis, y axis and normal of the section in machine coordinates
    """
    _take_in(points_mm, plane, off_section_max_mm, section_mm, rejection, at)


@kernel
def _take_in(points: Any, plane: Any, off_section_max: float, section: Any, rejection: Any, at: int) -> None:
    flat = points.shape[1] == 2
    for i in range(len(points)):
        row = at + i
        x, y, height = points[i, 0], points[i, 1], 0.0
        if not flat:
            px, py, pz = x - plane[PLANE_ORIGIN], y - plane[PLANE_ORIGIN + 1], points[i, 2] - plane[PLANE_ORIGIN + 2]
            x = px * plane[PLANE_X_AXIS] + py * plane[PLANE_X_AXIS + 1] + pz * plane[PLANE_X_AXIS + 2]
            y = px * plane[PLANE_Y_AXIS] + py * plane[PLANE_Y_AXIS + 1] + pz * plane[PLANE_Y_AXIS + 2]
            height = px * plane[PLANE_NORMAL] + py * plane[PLANE_NORMAL + 1] + pz * plane[PLANE_NORMAL + 2]
        section[row, 0], section[row, 1] = x, y
        if not (np.isfinite(x) and np.isfinite(y) and np.isfinite(height)):
            rejection[row] = NOT_FINITE
        elif abs(height) > off_section_max:
            rejection[row] = OFF_SECTION
        else:
            rejection[row] = NOT_REJECTED


def placed(section_mm: Array, rejection: NDArray[np.int8], first: int, stop: int, pose: tuple[float, float, float, float]) -> Array:
    """Rows first .. stop - 1 in nominal coordinates by (cos, sin, x, y); NaN where a row cannot be used."""
    moved = np.empty((stop - first, 2))
    _placed(section_mm, rejection, first, pose, moved)
    return moved


@kernel
def _placed(section: Any, rejection: Any, first: int, pose: Any, moved: Any) -> None:
    c, s, tx, ty = pose
    for i in range(len(moved)):
        row = first + i
        if rejection[row] == NOT_FINITE or rejection[row] == OFF_SECTION:
            moved[i, 0] = moved[i, 1] = np.nan
        else:
            x, y = section[row, 0], section[row, 1]
            moved[i, 0] = c * x - s * y + tx
            moved[i, 1] = s * x + c * y + ty


def judge(feet: Feet, judgement: tuple[float, ...], first: int, rows: tuple[Any, ...]) -> None:
    """Enter what feet say from row `first` on.

    judgement : outward, tip radius, lower and upper limit, uncertainty
    rows      : arrays actual_mm, foot_mm, gradient, station_mm, deviation_mm, verdicts, rejection
    """
    _judge(feet.foot_mm, feet.distance_mm, feet.gradient, feet.station_mm, feet.vertex, judgement, first, rows)


@kernel
def _judge(foot: Any, distance: Any, gradient: Any, station: Any, vertex: Any, judgement: Any, first: int, rows: Any) -> None:
    outward, tip, lower, upper, uncertainty = judgement
    actual, feet, normals, stations, deviations, verdicts, rejection = rows
    for i in range(len(distance)):
        row = first + i
        if rejection[row] == BEYOND_END:
            rejection[row] = NOT_REJECTED  # beyond an end at an earlier pose
        if np.isnan(distance[i]) or vertex[i] == OPEN_END or rejection[row] != NOT_REJECTED:
            if rejection[row] == NOT_REJECTED:
                rejection[row] = BEYOND_END
            actual[row, 0] = actual[row, 1] = feet[row, 0] = feet[row, 1] = normals[row, 0] = normals[row, 1] = np.nan
            stations[row] = deviations[row] = np.nan
            verdicts[row] = NOT_JUDGED
            continue
        e = outward * distance[i] - tip
        nx, ny = outward * gradient[i, 0], outward * gradient[i, 1]
        actual[row, 0], actual[row, 1] = foot[i, 0] + e * nx, foot[i, 1] + e * ny
        feet[row, 0], feet[row, 1] = foot[i, 0], foot[i, 1]
        normals[row, 0], normals[row, 1] = nx, ny
        stations[row], deviations[row] = station[i], e
        beyond = max(lower - e, e - upper)
        verdicts[row] = NONCONFORM if beyond > uncertainty else CONFORM if beyond <= -uncertainty else UNCERTAIN
