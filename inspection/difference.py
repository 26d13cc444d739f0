"""The difference of two courses of deviations along one profile, such as those of two scans of a part.

Between neighbouring points that are near enough to count as measured a course is a straight line, elsewhere it is unknown. So the
difference is a straight line between the stations of both, and its extremes lie at these; neither order nor density changes what it is.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Course:
    """Deviations of m judged points along a profile.

    station_mm   : (m,) in any order
    deviation_mm : (m,)
    gap_max_mm   : the longest gap between neighbours that counts as measured
    """

    station_mm: Array
    deviation_mm: Array
    gap_max_mm: float

    def __post_init__(self) -> None:
        if self.station_mm.shape != self.deviation_mm.shape or self.station_mm.ndim != 1:
            raise ValueError(f"expected (m,) twice, got {self.station_mm.shape} and {self.deviation_mm.shape}")
        if not (np.isfinite(self.station_mm).all() and np.isfinite(self.deviation_mm).all()):
            raise ValueError("a course needs finite numbers: leave out points that were not judged")
        for array in (self.station_mm, self.deviation_mm):
            array.setflags(write=False)


@dataclass(frozen=True, slots=True, eq=False)
class Difference:
    """What two courses differ by, the second less the first, at the k stations of both.

    station_mm    : (k,) rising
    first_mm      : (k,) the first course there; NaN where it was not measured
    second_mm     : (k,) the second one, likewise
    difference_mm : (k,) NaN where one of them was not measured
    compared      : the share of the profile's length along which both were measured
    mean_mm, rms_mm : of the difference along that length, whatever the density of points; NaN where there is none
    """

    station_mm: Array
    first_mm: Array
    second_mm: Array
    difference_mm: Array
    compared: float
    mean_mm: float
    rms_mm: float

    def __post_init__(self) -> None:
        for array in (self.station_mm, self.first_mm, self.second_mm, self.difference_mm):
            array.setflags(write=False)

    @property
    def largest(self) -> int | None:
        """Index of the largest difference, whatever its sign; None where nothing was compared."""
        away = np.where(np.isnan(self.difference_mm), -1.0, np.abs(self.difference_mm))
        return int(away.argmax()) if len(away) and away.max() >= 0 else None


def difference_along(first: Course, second: Course, length_mm: float, closed: bool) -> Difference:
    """Compare two courses along one profile; what crosses the seam of a closed one counts as anywhere else."""
    courses = [_in_order(course, length_mm, closed) for course in (first, second)]
    stations = np.unique(np.concatenate([_once_around(course, length_mm, closed) for course in (first, second)]))
    found = [_at(course, stations, gap) for course, gap in zip(courses, (first.gap_max_mm, second.gap_max_mm), strict=True)]
    difference = found[1] - found[0]
    steps = np.diff(np.append(stations, stations[0] + length_mm)) if closed and len(stations) else np.diff(stations)
    middles = (stations[: len(steps)] + steps / 2) % length_mm if closed else stations[: len(steps)] + steps / 2
    measured = [np.isfinite(_at(course, middles, gap)) for course, gap in zip(courses, (first.gap_max_mm, second.gap_max_mm), strict=True)]
    both = measured[0] & measured[1] & (steps > 0)
    start, end, width = difference[: len(steps)][both], np.roll(difference, -1)[: len(steps)][both], steps[both]
    total = float(width.sum())
    mean = float((width * (start + end)).sum() / 2 / total) if total else np.nan
    square = float((width * (start * start + start * end + end * end)).sum() / 3 / total) if total else np.nan
    return Difference(stations, found[0], found[1], difference, total / length_mm, mean, float(np.sqrt(square)))


def _in_order(course: Course, length_mm: float, closed: bool) -> tuple[Array, Array]:
    """Rising stations and their deviations, one for each station: the mean of several; of a closed profile one more at either end."""
    station, place = np.unique(_once_around(course, length_mm, closed), return_inverse=True)
    if not len(station):
        return station, station
    deviation = np.bincount(place, course.deviation_mm) / np.bincount(place)
    if not closed:
        return station, deviation
    around = np.concatenate([[station[-1] - length_mm], station, [station[0] + length_mm]])
    return around, np.concatenate([deviation[-1:], deviation, deviation[:1]])


def _once_around(course: Course, length_mm: float, closed: bool) -> Array:
    """The stations of a course; the end of a closed profile is its beginning."""
    return course.station_mm % length_mm if closed else course.station_mm


def _at(course: tuple[Array, Array], at_mm: Array, gap_max_mm: float) -> Array:
    """A course at stations (k,); NaN where its neighbours there are farther apart than counts as measured."""
    station, deviation = course
    if not len(station):
        return np.full(len(at_mm), np.nan)
    after = np.clip(np.searchsorted(station, at_mm), 0, len(station) - 1)
    before = np.where(station[after] == at_mm, after, np.maximum(after - 1, 0))
    near = (station[after] - station[before] <= gap_max_mm) & (station[before] <= at_mm) & (at_mm <= station[after])
    return np.where(near, np.interp(at_mm, station, deviation), np.nan)
