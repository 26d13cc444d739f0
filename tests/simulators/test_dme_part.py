"""The part under the probe of the simulated measuring machine, held against a circle."""

import numpy as np

from simulators.dme_part import PathPart
from simulators.motion import Motion, walk

TURN = np.linspace(0.0, 2.0 * np.pi, 20_001)
CIRCLE_MM = 20.0 * np.column_stack([np.cos(TURN), np.sin(TURN)])
STEP_MM = 0.1


def part() -> PathPart:
    return PathPart(CIRCLE_MM, Motion(STEP_MM * 1000.0, 1000.0, tip_radius_mm=1.5, seed=4))


def test_a_ball_touches_a_circle_at_the_sum_of_the_radii() -> None:
    for angle in np.radians([0.0, 33.3, 200.0]):
        direction = np.array([np.cos(angle), np.sin(angle), 0.0])
        centre = part().touch(20.0 * direction + [0.0, 0.0, 7.0], direction, 10.0, 10.0)
        assert centre is not None
        np.testing.assert_allclose(centre, 21.5 * direction + [0.0, 0.0, 7.0], atol=2e-5)  # a circle of lines


def test_a_ball_that_comes_from_the_side_touches_where_it_has_to() -> None:
    centre = part().touch(np.array([20.0, 3.0, 0.0]), np.array([1.0, 0.0, 0.0]), 10.0, 10.0)
    assert centre is not None
    np.testing.assert_allclose(centre, [np.sqrt(21.5**2 - 9.0), 3.0, 0.0], atol=2e-5)


def test_nothing_is_touched_where_nothing_is() -> None:
    assert part().touch(np.array([40.0, 0.0, 0.0]), np.array([1.0, 0.0, 0.0]), 10.0, 10.0) is None
    assert part().touch(np.array([20.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]), 10.0, 10.0) is None


def test_a_scan_takes_the_points_of_a_walk() -> None:
    motion = Motion(STEP_MM * 1000.0, 1000.0, tip_radius_mm=1.5, form_error_mm=0.02, noise_mm=0.001, seed=4)
    course = np.column_stack([CIRCLE_MM[:-1:50], np.zeros(400)])
    centres, outward, lost = PathPart(CIRCLE_MM, motion).follow(course, STEP_MM, closed=True, lost_mm=10.0)
    expected = walk(CIRCLE_MM, Motion(STEP_MM * 1000.0, 1000.0, 1257, form_error_mm=0.02, noise_mm=0.001, tip_radius_mm=1.5, seed=4))
    assert not lost
    np.testing.assert_array_equal(centres, expected.points_mm)
    np.testing.assert_allclose(np.linalg.norm(outward, axis=1), 1.0, atol=1e-9)


def test_a_course_that_leaves_the_part_loses_it() -> None:
    course = np.array([[20.0, 0.0, 0.0], [20.0, 1.0, 0.0], [20.0, 60.0, 0.0]])
    centres, _, lost = part().follow(course, STEP_MM, closed=False, lost_mm=2.0)
    assert lost
    assert 0 < len(centres) < 200
