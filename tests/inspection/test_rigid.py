"""Rigid motions against complex multiplication, and the one compiled motion against the one in numpy."""

import numpy as np
import pytest

from inspection import RigidTransform
from inspection.kernels.rows import place_rows
from inspection.rigid import best_motion, rotate, rotation_about, turned_about
from tests.inspection import profiles


def test_motions_equal_complex_multiplication_and_compose() -> None:
    rng = np.random.default_rng(1)
    points = rng.normal(0, 50, (30, 2))
    z = points[:, 0] + 1j * points[:, 1]
    first, then = RigidTransform(0.7, np.array([3.0, -4.0])), RigidTransform(-2.9, np.array([100.0, 1.0]))
    w = z * np.exp(0.7j) + (3 - 4j)
    assert np.abs(first.apply(points) - np.column_stack([w.real, w.imag])).max() < 1e-12
    w = w * np.exp(-2.9j) + (100 + 1j)
    assert np.abs(then.after(first).apply(points) - np.column_stack([w.real, w.imag])).max() < 1e-12
    assert np.abs(first.inverse().apply(first.apply(points)) - points).max() < 1e-12
    assert np.array_equal(RigidTransform.identity().apply(points), points)


def test_motions_of_one_place_are_those_of_many_to_the_last_bit() -> None:
    rng = np.random.default_rng(4)
    for angle in rng.uniform(-4, 4, 200):
        centre, shift = rng.normal(0, 100, (2, 2))
        motion, first = RigidTransform(angle, shift), RigidTransform(0.3, centre)
        assert np.array_equal(motion.after(first).translation_mm, motion.apply(centre[None])[0])
        assert np.array_equal(motion.inverse().translation_mm, -rotate(shift[None], -angle)[0])
        about = rotation_about(centre, angle, shift)
        assert np.array_equal(about.translation_mm, centre + shift - rotate(centre[None], angle)[0])
        both = turned_about(motion, centre, angle, *shift.tolist())
        assert (both.rotation_rad, *both.translation_mm) == (about.after(motion).rotation_rad, *about.after(motion).translation_mm)


def test_best_motion_is_the_known_one_and_no_other_is_better() -> None:
    rng = np.random.default_rng(2)
    source = rng.normal(0, 30, (40, 2))
    target = profiles.rotated(source, 163.0, (7.0, 8.0))
    assert np.abs(best_motion(source, target).apply(source) - target).max() < 1e-12
    target = target + rng.normal(0, 2.0, target.shape)
    found = best_motion(source, target)
    least = ((found.apply(source) - target) ** 2).sum()
    for step in rng.normal(0, 1, (200, 3)) * 10.0 ** -rng.integers(1, 6, (200, 1)):
        other = RigidTransform(found.rotation_rad + step[0] / 30, found.translation_mm + step[1:])
        assert ((other.apply(source) - target) ** 2).sum() > least
    # a mirror image would fit without rest, but is no motion
    mirrored = source * (1.0, -1.0)
    turned = best_motion(source, mirrored).apply(source)
    area = np.cross(np.append(turned[1] - turned[0], 0), np.append(turned[2] - turned[0], 0))[2]
    before = np.cross(np.append(source[1] - source[0], 0), np.append(source[2] - source[0], 0))[2]
    assert area == pytest.approx(before, rel=1e-9)


def test_a_rotation_about_a_centre_leaves_the_centre_where_the_shift_puts_it() -> None:
    centre, shift = np.array([30.0, -40.0]), np.array([0.5, 0.25])
    motion = rotation_about(centre, 1.2, shift)
    assert np.abs(motion.apply([centre]) - (centre + shift)).max() < 1e-13
    points = np.random.default_rng(3).normal(0, 50, (20, 2))
    z = (points - centre) @ (1, 1j) * np.exp(1.2j)
    assert np.abs(motion.apply(points) - (np.column_stack([z.real, z.imag]) + centre + shift)).max() < 1e-12


def test_the_compiled_motion_is_the_one_in_numpy_to_the_last_bit() -> None:
    rng = np.random.default_rng(4)
    for _ in range(50):
        pose = RigidTransform(rng.uniform(-4, 4), rng.normal(0, 300, 2))
        points = rng.normal(0, 10.0 ** rng.uniform(-3, 4), (200, 2))
        x, y = pose.translation_mm
        moved = place_rows(points, np.zeros(200, dtype=np.int8), 0, 200, (np.cos(pose.rotation_rad), np.sin(pose.rotation_rad), x, y))
        assert np.array_equal(moved, pose.apply(points))


def test_a_motion_on_the_grid_is_the_motion_to_within_half_a_step_and_stays_there() -> None:
    rng = np.random.default_rng(5)
    for _ in range(50):
        pose = RigidTransform(rng.uniform(-4, 4), rng.normal(0, 300, 2))
        snapped = pose.snap_to_grid()
        assert abs(snapped.rotation_rad - pose.rotation_rad) <= 2.0**-41
        assert np.abs(snapped.translation_mm - pose.translation_mm).max() <= 2.0**-31
        assert (snapped.rotation_rad * 2.0**40).is_integer()
        assert (snapped.translation_mm * 2.0**30 % 1 == 0).all()
        again = snapped.snap_to_grid()
        assert again.rotation_rad == snapped.rotation_rad
        assert np.array_equal(again.translation_mm, snapped.translation_mm)


@pytest.mark.parametrize(("angle", "shift"), [(np.nan, (0.0, 0.0)), (0.0, (np.inf, 0.0)), (0.0, (0.0, 0.0, 0.0)), (np.inf, (0.0, 1.0))])
def test_motions_that_cannot_be_are_refused(angle: float, shift: tuple[float, ...]) -> None:
    with pytest.raises(ValueError, match=r"need a finite angle and a translation \(2,\), got"):
        RigidTransform(angle, np.array(shift))
