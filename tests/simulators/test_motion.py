"""The walk against closed forms of a circle and a square."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from simulators.motion import DEFECT_WIDTH_MM, Motion, feed_under, read_path, walk

ANGLE = np.linspace(0.0, 2.0 * np.pi, 20_001)
CIRCLE_MM = 10.0 * np.column_stack([np.cos(ANGLE), np.sin(ANGLE)])
SQUARE_MM = np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]])


def radius(points_mm: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(np.hypot(points_mm[:, 0], points_mm[:, 1]))


def test_a_square_is_walked_at_the_given_pace() -> None:
    scan = walk(SQUARE_MM, Motion(speed_mm_s=50.0, rate_hz=10.0))
    assert len(scan.points_mm) == 8
    np.testing.assert_allclose(scan.time_s, np.arange(8) / 10.0)
    np.testing.assert_allclose(scan.points_mm[:, :2], [[0, 0], [5, 0], [10, 0], [10, 5], [10, 10], [5, 10], [0, 10], [0, 5]])


@pytest.mark.parametrize("path_mm", [CIRCLE_MM, CIRCLE_MM[::-1], np.roll(CIRCLE_MM[:-1], 700, axis=0), CIRCLE_MM[CIRCLE_MM[:, 1] <= 0]])
def test_a_beam_sees_the_near_side_of_a_path_that_turns_back(path_mm: NDArray[np.float64]) -> None:
    x, y, _ = feed_under(path_mm, Motion(speed_mm_s=10.0, rate_hz=100.0, start_mm=1.0, count=180)).points_mm.T
    np.testing.assert_allclose(x, -9.0 + 0.1 * np.arange(180), atol=1e-5)
    np.testing.assert_allclose(y, -np.sqrt(100.0 - x**2), atol=1e-3)


def test_start_and_direction() -> None:
    scan = walk(SQUARE_MM, Motion(speed_mm_s=50.0, rate_hz=10.0, count=3, start_mm=5.0, backward=True))
    np.testing.assert_allclose(scan.points_mm[:, :2], [[5, 0], [0, 0], [0, 5]], atol=1e-12)


@pytest.mark.parametrize("path_mm", [CIRCLE_MM, CIRCLE_MM[::-1], CIRCLE_MM[:-1]])
def test_ball_centres_lie_outside_whatever_the_order(path_mm: NDArray[np.float64]) -> None:
    scan = walk(path_mm, Motion(speed_mm_s=10.0, rate_hz=100.0, tip_radius_mm=1.5))
    np.testing.assert_allclose(radius(scan.points_mm), 11.5, atol=1e-6)


def test_outward_of_an_open_path_is_right_of_its_order() -> None:
    line_mm = np.array([[0.0, 0.0], [100.0, 0.0]])
    for backward, start_mm in ((False, 0.0), (True, 100.0)):
        motion = Motion(speed_mm_s=10.0, rate_hz=10.0, closed=False, tip_radius_mm=2.0, backward=backward, start_mm=start_mm)
        np.testing.assert_allclose(walk(line_mm, motion).points_mm[:, 1], -2.0)


def test_the_defect_stands_where_it_was_asked_for() -> None:
    scan = walk(CIRCLE_MM, Motion(speed_mm_s=10.0, rate_hz=1000.0, defect_mm=0.12, defect_station_mm=40.0))
    height = radius(scan.points_mm) - 10.0
    station = np.unwrap(np.arctan2(scan.points_mm[:, 1], scan.points_mm[:, 0])) % (2 * np.pi) * 10.0
    assert height.max() == pytest.approx(0.12, abs=1e-6)
    assert station[height.argmax()] == pytest.approx(40.0, abs=0.02)
    assert np.ptp(station[height > 1e-4]) < DEFECT_WIDTH_MM


def test_a_defect_at_the_seam_lies_on_both_sides_of_it() -> None:
    length_mm = np.hypot(*np.diff(CIRCLE_MM, axis=0).T).sum()
    scan = walk(CIRCLE_MM, Motion(speed_mm_s=length_mm / 6.0, rate_hz=1000.0, count=6000, defect_mm=-0.1, defect_station_mm=0.0))
    height = radius(scan.points_mm) - 10.0
    np.testing.assert_allclose(height[1:200], height[:-200:-1], atol=1e-6)
    assert height[0] == pytest.approx(-0.1, abs=1e-6)


def test_form_error_is_smooth_closed_seeded_and_as_large_as_said() -> None:
    walks = [walk(CIRCLE_MM, Motion(speed_mm_s=10.0, rate_hz=1000.0, form_error_mm=0.02, seed=seed)) for seed in (1, 1, 2)]
    first, again, other = (radius(scan.points_mm) - 10.0 for scan in walks)
    np.testing.assert_array_equal(first, again)
    assert np.abs(first - other).max() > 0.005
    assert np.abs(first).max() == pytest.approx(0.02, rel=1e-3)
    assert np.abs(np.diff(np.append(first, first[0]))).max() < 1e-4


def test_noise_has_the_spread_asked_for() -> None:
    scan = walk(CIRCLE_MM, Motion(speed_mm_s=1.0, rate_hz=1000.0, noise_mm=0.003))
    assert np.std(radius(scan.points_mm)) == pytest.approx(0.003, rel=0.02)


def test_the_part_lies_where_it_was_put() -> None:
    motion = Motion(speed_mm_s=50.0, rate_hz=10.0, count=2, rotation_deg=90.0, translation_mm=(1.0, 2.0, 3.0))
    np.testing.assert_allclose(walk(SQUARE_MM, motion).points_mm, [[1, 2, 3], [1, 7, 3]], atol=1e-12)


def test_a_scan_off_an_open_path_is_refused() -> None:
    with pytest.raises(ValueError, match="off the open path of 30 mm"):
        walk(SQUARE_MM, Motion(speed_mm_s=50.0, rate_hz=10.0, closed=False, count=8))


@pytest.mark.parametrize("text", ["x,y\n0,0\n1.5,2\n", "0 0\n1.5 2\n", "# points\n0;0\n1.5;2\n"])
def test_path_files(tmp_path: Path, text: str) -> None:
    file = tmp_path / "path.csv"
    file.write_text(text)
    np.testing.assert_array_equal(read_path(file), [[0, 0], [1.5, 2]])


@pytest.mark.parametrize("text", ["", "1,2\n", "1,2\nx,3\n", "1,2\n1,2,3\n", "1,2\nnan,3\n"])
def test_files_that_are_no_path_are_refused(tmp_path: Path, text: str) -> None:
    file = tmp_path / "path.csv"
    file.write_text(text)
    with pytest.raises(ValueError, match=r"path\.csv"):
        read_path(file)


def test_scales_tell_whole_steps_and_nothing_else_changes() -> None:
    fine = Motion(speed_mm_s=10.0, rate_hz=100.0, noise_mm=0.01, rotation_deg=30.0)
    read = walk(CIRCLE_MM, replace(fine, resolution_mm=0.005)).points_mm
    np.testing.assert_allclose(read / 0.005, np.round(read / 0.005), atol=1e-9)
    assert 0.002 < np.abs(read - walk(CIRCLE_MM, fine).points_mm).max() <= 0.0025 + 1e-12
    with pytest.raises(ValueError, match="a resolution of -1 mm"):
        replace(fine, resolution_mm=-1)
