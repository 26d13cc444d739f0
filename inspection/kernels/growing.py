"""Normal equations of a pose that grow point by point."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from inspection.kernels.compiling import brief_kernel
from inspection.kernels.layout import (
    COUNT,
    SLOPE_TURN,
    SLOPE_X,
    SLOPE_Y,
    SQUARE,
    SUMS,
    TANGENTIAL_TT,
    TANGENTIAL_XT,
    TANGENTIAL_XX,
    TANGENTIAL_XY,
    TANGENTIAL_YT,
    TANGENTIAL_YY,
)
from inspection.kernels.normal_equations import fill_covariance, newton_step

Array = NDArray[np.float64]

_ANYWHERE: Array = np.empty(0)


class GrowingSums:
    """Normal equations of a pose that grow point by point, about a pose fitted before.

    With p the small motion about `centre_mm` (2,) since that fit, every point adds J J' and J (e - J p): their minimum moves on
    without touching earlier points again. Besides: what the deviations change from point to point, which is noise, and which
    64ths of the profile's length hold points.
    """

    def __init__(self, centre_mm: Array, reach_mm: float, length_mm: float) -> None:
        self.motion = np.zeros(3)  # shift in mm, rotation in rad
        self._frame = (np.array([*centre_mm, reach_mm, length_mm]), self.motion)
        self._sums, self._change, self._marks = np.zeros(SUMS), np.array([0.0, np.nan]), np.zeros(64)

    def add(
        self,
        foot_mm: Array,
        normal: Array,
        deviation_mm: Array,
        station_mm: Array,
        verdicts: NDArray[np.int8],
        follows: bool = False,
    ) -> None:
        """Take in points (m,) judged at the motion so far; those without a verdict (negative) take no part.

        follows : they follow those of the last call without a break
        """
        if not follows:
            self._change[1] = np.nan
        _grow(foot_mm, normal, deviation_mm, station_mm, verdicts, *self._frame, self._sums, self._change, self._marks)

    def count_as(self, points: int) -> None:
        """Let the points so far count as so many, for which they stand."""
        share = points / max(self.count, 1.0)
        self._sums *= share
        self._change[0] *= share

    def move(self) -> None:
        """Set the motion to the minimum."""
        _move(self._sums, *self._frame)

    @property
    def count(self) -> float:
        """Number of points taken in."""
        return float(self._sums[COUNT])

    @property
    def mean_square(self) -> float:
        """Mean square of the deviations, mm^2."""
        return float(self._sums[SQUARE] / max(self.count, 1.0))

    @property
    def noise(self) -> float:
        """Half the mean squared change of the deviation from point to point, mm^2."""
        return float(self._change[0] / max(self.count, 1.0) / 2.0)

    @property
    def covered(self) -> float:
        """Share of the length that holds points."""
        return np.count_nonzero(self._marks) / len(self._marks)

    def spread_mm(self, places_mm: Array, normals: Array, scatter: float, station_mm: Array = _ANYWHERE) -> float:
        """Largest standard deviation of the pose's effect on a deviation at any place, for independent errors of that variance.

        station_mm : of the places; only those count whose 64th of the length holds points. (0,) for all

        Hand over arrays that could be written to: others are of another type to the compiler.
        """
        return float(_spread(places_mm, normals, station_mm, scatter, self._frame[0], self._sums, self._marks))


@brief_kernel
def _grow(
    foot: Any,
    normal: Any,
    deviation: Any,
    station: Any,
    verdicts: Any,
    frame: Any,
    motion: Any,
    sums: Any,
    change: Any,
    marks: Any,
) -> None:
    previous = change[1]
    for i in range(len(verdicts)):
        if verdicts[i] < 0:
            continue
        gx, gy, e = normal[i, 0], normal[i, 1], deviation[i]
        turn = (foot[i, 0] - frame[0]) * gy - (foot[i, 1] - frame[1]) * gx
        rest = e - (gx * motion[0] + gy * motion[1] + turn * motion[2])
        sums[SLOPE_X] += gx * rest
        sums[SLOPE_Y] += gy * rest
        sums[SLOPE_TURN] += turn * rest
        sums[TANGENTIAL_XX] += gx * gx
        sums[TANGENTIAL_XY] += gx * gy
        sums[TANGENTIAL_XT] += gx * turn
        sums[TANGENTIAL_YY] += gy * gy
        sums[TANGENTIAL_YT] += gy * turn
        sums[TANGENTIAL_TT] += turn * turn
        sums[SQUARE] += e * e
        sums[COUNT] += 1.0
        if not np.isnan(previous):
            change[0] += (e - previous) * (e - previous)
        previous = e
        marks[min(max(int(station[i] / frame[3] * len(marks)), 0), len(marks) - 1)] = 1.0
    change[1] = previous


@brief_kernel
def _move(sums: Any, frame: Any, motion: Any) -> None:
    motion[0], motion[1], motion[2], _ = newton_step(sums, frame[2])


@brief_kernel
def _spread(places: Any, normals: Any, station: Any, scatter: float, frame: Any, sums: Any, marks: Any) -> float:
    covariance = np.empty((3, 3))
    fill_covariance(sums, frame[2], scatter, covariance)
    most = 0.0
    for i in range(len(places)):
        if len(station) > 0 and marks[min(max(int(station[i] / frame[3] * len(marks)), 0), len(marks) - 1)] == 0.0:
            continue
        gx, gy = normals[i, 0], normals[i, 1]
        turn = (places[i, 0] - frame[0]) * gy - (places[i, 1] - frame[1]) * gx
        x = covariance[0, 0] * gx + covariance[0, 1] * gy + covariance[0, 2] * turn
        y = covariance[1, 0] * gx + covariance[1, 1] * gy + covariance[1, 2] * turn
        t = covariance[2, 0] * gx + covariance[2, 1] * gy + covariance[2, 2] * turn
        most = max(most, gx * x + gy * y + turn * t)
    return float(np.sqrt(most))
