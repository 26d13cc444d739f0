"""Normal equations of a pose that grow point by point."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from inspection.kernels.compiling import brief_kernel, inlined_kernel
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
_CORRELATION = 0.125  # share of the length over which form error is taken as one independent value: two to four waves around
# One array holds everything, because a compiled call costs per array: centre, reach and length; the motion; the sums; the squared
# changes and the last deviation; the marks of the 64ths.
_X, _Y, _REACH, _LENGTH, _MOTION = range(5)
_TOTALS = _MOTION + 3
_CHANGE = _TOTALS + SUMS
_LAST = _CHANGE + 1
_MARKS = _LAST + 1
_ALL_MARKS = 64


class GrowingSums:
    """Normal equations of a pose that grow point by point, about a pose fitted before.

    With p the small motion about `centre_mm` (2,) since that fit, every point adds J J' and J (e - J p): their minimum moves on
    without touching earlier points again. Besides: what the deviations change from point to point, which is noise, and which
    64ths of the profile's length hold points.

    expected_form_mm : standard deviation of the form error where nothing is measured yet
    target_mm        : e is the deviation less this
    """

    def __init__(self, centre_mm: Array, reach_mm: float, length_mm: float, expected_form_mm: float, target_mm: float) -> None:
        self._state = np.zeros(_MARKS + _ALL_MARKS)
        self._state[: _LENGTH + 1] = (*centre_mm, reach_mm, length_mm)
        self._state[_LAST] = np.nan
        self._expected, self._target = expected_form_mm**2, float(target_mm)

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
        _grow(foot_mm, normal, deviation_mm, station_mm, verdicts, self._target, follows, self._state)

    def count_as(self, points: int) -> None:
        """Let the points so far count as so many, for which they stand."""
        share = points / max(float(self._state[_TOTALS + COUNT]), 1.0)
        self._state[_TOTALS : _CHANGE + 1] *= share

    def move(self) -> tuple[float, float, float]:
        """Set the motion to the minimum: shift in mm (x, y), rotation in rad."""
        _move(self._state)
        x, y, turn = self._state[_MOTION:_TOTALS].tolist()
        return x, y, turn

    def spread_mm(self, places_mm: Array, normals: Array, station_mm: Array = _ANYWHERE) -> float:
        """Largest standard deviation of the pose's effect on a deviation at any place, by the model of `_scatter`.

        station_mm : of the places; only those count whose 64th of the length holds points. (0,) for all

        Hand over arrays that could be written to: others are of another type to the compiler.
        """
        return float(_spread(places_mm, normals, station_mm, self._expected, self._state))


@brief_kernel
def _grow(foot: Any, normal: Any, deviation: Any, station: Any, verdicts: Any, target: float, follows: bool, state: Any) -> None:
    sums, motion, marks = state[_TOTALS:_CHANGE], state[_MOTION:_TOTALS], state[_MARKS:]
    previous = state[_LAST] if follows else np.nan
    for i in range(len(verdicts)):
        if verdicts[i] < 0:
            continue
        gx, gy, e = normal[i, 0], normal[i, 1], deviation[i] - target
        turn = (foot[i, 0] - state[_X]) * gy - (foot[i, 1] - state[_Y]) * gx
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
            state[_CHANGE] += (e - previous) * (e - previous)
        previous = e
        marks[min(max(int(station[i] / state[_LENGTH] * len(marks)), 0), len(marks) - 1)] = 1.0
    state[_LAST] = previous


@brief_kernel
def _move(state: Any) -> None:
    state[_MOTION], state[_MOTION + 1], state[_MOTION + 2], _ = newton_step(state[_TOTALS:_CHANGE], state[_REACH])


@brief_kernel
def _spread(places: Any, normals: Any, station: Any, expected: float, state: Any) -> float:
    sums, marks, covariance = state[_TOTALS:_CHANGE], state[_MARKS:], np.empty((3, 3))
    fill_covariance(sums, state[_REACH], _scatter(sums, marks, state[_CHANGE], expected), covariance)
    most = 0.0
    for i in range(len(places)):
        if len(station) > 0 and marks[min(max(int(station[i] / state[_LENGTH] * len(marks)), 0), len(marks) - 1)] == 0.0:
            continue
        gx, gy = normals[i, 0], normals[i, 1]
        turn = (places[i, 0] - state[_X]) * gy - (places[i, 1] - state[_Y]) * gx
        x = covariance[0, 0] * gx + covariance[0, 1] * gy + covariance[0, 2] * turn
        y = covariance[1, 0] * gx + covariance[1, 1] * gy + covariance[1, 2] * turn
        t = covariance[2, 0] * gx + covariance[2, 1] * gy + covariance[2, 2] * turn
        most = max(most, gx * x + gy * y + turn * t)
    return float(np.sqrt(most))


@inlined_kernel
def _scatter(sums: Any, marks: Any, change: float, expected: float) -> float:
    """The variance (mm^2) of independent errors that would leave the pose as uncertain as noise and form do.

    What changes from point to point is noise, independent at every point. The rest is form error, one value for every eighth
    of the length: a scan of a few such patches is trusted no more than its patches, less those that the pose itself used up.
    Where nothing is measured yet, form error as large as expected counts.
    """
    held = 0.0
    for i in range(len(marks)):
        held += marks[i]
    covered, count = held / len(marks), sums[COUNT]
    noise, mean_square = change / max(count, 1.0) / 2.0, sums[SQUARE] / max(count, 1.0)
    patches = max(covered / _CORRELATION, 1.0)
    form = max(mean_square - noise, 0.0) * patches / max(patches - 3.0, 0.5)
    form = max(form, expected * (1 - covered))
    return float(noise + form * count / patches)
