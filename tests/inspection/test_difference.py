"""The difference of two courses along a profile: what it is in closed form, where it is unknown, and that density changes nothing."""

import numpy as np
import pytest
from numpy.typing import NDArray

from inspection.difference import Course, difference_along

LENGTH = 100.0


def course(count: int, shift: float = 0.0, start: float = 0.0, end: float = LENGTH, gap: float = 2.0) -> Course:
    """A wave of 0.1 mm over the whole length, shifted by a constant, at so many stations in any order."""
    station = start + np.random.default_rng(count).permutation(count) * (end - start) / count
    return Course(station, shift + wave(station), gap)


def wave(station: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(0.1 * np.sin(2 * np.pi * station / LENGTH))


@pytest.mark.parametrize("closed", [True, False])
def test_a_constant_apart_is_the_difference_everywhere(closed: bool) -> None:
    found = difference_along(course(2000), course(3001, 0.02), LENGTH, closed)
    known = np.isfinite(found.difference_mm)
    np.testing.assert_allclose(found.difference_mm[known], 0.02, atol=2e-6, rtol=0)  # the chords between the points of a wave
    assert found.compared == pytest.approx(1.0 if closed else 0.9995, abs=1e-9)
    assert (found.mean_mm, found.rms_mm) == pytest.approx((0.02, 0.02), abs=1e-6)


def test_mean_and_rms_are_those_of_the_straight_lines_whatever_the_density() -> None:
    """From 0 at station 0 to 1 at 50 and back: mean 1/2, rms 1/sqrt(3)."""
    flat = Course(np.array([0.0, 100.0]), np.zeros(2), 1000.0)
    for stations in (np.array([0.0, 50.0, 100.0]), np.concatenate([np.linspace(0, 10, 5000), [50.0, 100.0]])):
        roof = Course(stations, 1 - np.abs(stations - 50) / 50, 1000.0)
        found = difference_along(flat, roof, LENGTH, closed=False)
        assert (found.mean_mm, found.rms_mm) == pytest.approx((0.5, 3**-0.5), abs=1e-12)
        assert found.largest is not None
        assert found.station_mm[found.largest] == 50.0
    back = difference_along(roof, flat, LENGTH, closed=False)
    assert back.mean_mm == pytest.approx(-0.5, abs=1e-12)


def test_a_spike_of_one_point_is_the_largest_difference_and_lies_where_it_is() -> None:
    sharp = course(5000)
    deviation = sharp.deviation_mm.copy()
    deviation[np.argmin(np.abs(sharp.station_mm - 37))] -= 0.3
    found = difference_along(course(900), Course(sharp.station_mm, deviation, 2.0), LENGTH, closed=True)
    assert found.largest is not None
    assert found.station_mm[found.largest] == pytest.approx(37, abs=0.02)
    assert found.difference_mm[found.largest] == pytest.approx(-0.3, abs=1e-4)


def test_what_one_of_them_did_not_measure_is_not_compared_and_no_neighbour_stands_in_for_it() -> None:
    """The second begins at 20 and ends at 60, with nothing from 30 to 40."""
    whole, part = course(4000), course(4000, 0.02, 20.0, 60.0)
    keep = (part.station_mm <= 30) | (part.station_mm >= 40)
    found = difference_along(whole, Course(part.station_mm[keep], part.deviation_mm[keep], 2.0), LENGTH, closed=True)
    station, known = found.station_mm, np.isfinite(found.difference_mm)
    assert not known[(station < 20) | ((station > 30) & (station < 40)) | (station > 60)].any()
    assert known[((station > 20) & (station < 30)) | ((station > 40) & (station < 59.98))].all()
    assert found.compared == pytest.approx(0.3, abs=2e-4)


def test_the_seam_of_a_closed_profile_is_no_gap() -> None:
    first = Course(np.array([0.5, 50.0, 99.5]), np.array([1.0, 2.0, 1.0]), 60.0)
    second = Course(np.array([0.2, 0.2, 50.0, 100.0]), np.array([0.0, 2.0, 2.0, 1.0]), 60.0)  # twice at one station, and at the seam itself
    found = difference_along(first, second, LENGTH, closed=True)
    assert found.compared == pytest.approx(1.0)
    assert found.station_mm.tolist() == [0.0, 0.2, 0.5, 50.0, 99.5]
    np.testing.assert_allclose(found.difference_mm[:2], [0.0, 0.0], atol=1e-12)
    opened = difference_along(first, second, LENGTH, closed=False)
    assert opened.compared == pytest.approx(0.99)


def test_nothing_to_compare_is_no_difference() -> None:
    nothing = Course(np.empty(0), np.empty(0), 2.0)
    for pair in ((nothing, course(50)), (nothing, nothing), (course(50), nothing)):
        found = difference_along(*pair, LENGTH, closed=True)
        assert (found.compared, found.largest) == (0.0, None)
    with pytest.raises(ValueError, match="finite"):
        Course(np.array([np.nan]), np.zeros(1), 1.0)
    with pytest.raises(ValueError, match="twice"):
        Course(np.zeros(2), np.zeros(1), 1.0)
