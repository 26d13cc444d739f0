"""Machine points in space to section points in the plane, by the rows of a scan that every run goes through, and back."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from inspection import Rejection, SectionPlane
from inspection.scan_rows import ScanRows
from tests.inspection.profiles import Array

NUMBERS = st.lists(st.floats(-1, 1), min_size=9, max_size=9)


def take_in(points: Array, plane: SectionPlane, off_section_max_mm: float = np.inf) -> tuple[Array, list[int]]:
    """Section points and rejections of machine points that a scan has taken in."""
    rows = ScanRows()
    rows.take_in(points, plane, off_section_max_mm)
    return rows.points[: len(points)], rows.rejection[: len(points)].tolist()


def plane_of(numbers: list[float]) -> SectionPlane:
    origin, x_axis, normal = 100 * np.array(numbers[:3]), np.array(numbers[3:6]), np.array(numbers[6:])
    assume(np.linalg.norm(np.cross(x_axis, normal)) >= 0.05)
    return SectionPlane(origin, x_axis, normal)


def test_axes_are_what_the_docstring_says() -> None:
    plane = SectionPlane(np.array([10.0, 20.0, 30.0]), np.array([0.0, 2.0, 0.0]), np.array([0.0, 0.0, 5.0]))
    # x along machine y; y = normal cross x = -machine x; height along machine z
    points, rejection = take_in(np.array([[10.0, 21.0, 30.0], [9.0, 20.0, 30.0], [10.0, 20.0, 33.5]]), plane, 3.4)
    assert np.abs(points - [(1, 0), (0, 1), (0, 0)]).max() < 1e-14
    assert rejection == [Rejection.NONE, Rejection.NONE, Rejection.OFF_SECTION]


def test_only_the_part_of_the_x_axis_along_the_plane_counts() -> None:
    straight = SectionPlane(np.zeros(3), np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]))
    slanted = SectionPlane(np.zeros(3), np.array([3.0, 0.0, 7.0]), np.array([0.0, 0.0, 0.1]))
    points = np.random.default_rng(1).normal(0, 50, (20, 3))
    assert np.abs(take_in(points, straight)[0] - points[:, :2]).max() < 1e-12
    assert np.abs(take_in(points, slanted)[0] - points[:, :2]).max() < 1e-12


@settings(deadline=None)
@given(NUMBERS)
def test_section_points_are_the_scalar_products_with_the_axes(numbers: list[float]) -> None:
    plane, points = plane_of(numbers), np.random.default_rng(3).normal(0, 50, (40, 3))
    axes = np.array([plane.x_axis, np.cross(plane.normal, plane.x_axis), plane.normal])
    wanted = (points - plane.origin_mm) @ axes.T
    limit = float(np.median(np.abs(wanted[:, 2])))  # between two heights, as their number is even
    section, rejection = take_in(points, plane, limit)
    assert np.abs(section - wanted[:, :2]).max() < 1e-11
    assert rejection == np.where(np.abs(wanted[:, 2]) > limit, Rejection.OFF_SECTION, Rejection.NONE).tolist()


@settings(deadline=None)
@given(NUMBERS, st.floats(-10, 10))
def test_to_the_machine_and_back_is_the_same_and_keeps_distances(numbers: list[float], height: float) -> None:
    plane, section = plane_of(numbers), np.random.default_rng(2).normal(0, 50, (15, 2))
    machine = plane.to_machine(section, height)
    assert np.abs(take_in(machine, plane)[0] - section).max() < 1e-11
    assert np.abs((machine - plane.origin_mm) @ plane.normal - height).max() < 1e-11
    assert take_in(machine, plane, abs(height) + 1e-11)[1] == [Rejection.NONE] * 15
    assert take_in(machine, plane, abs(height) - 1e-11)[1] == [Rejection.OFF_SECTION] * 15
    assert np.abs(np.linalg.norm(np.diff(machine, axis=0), axis=1) - np.linalg.norm(np.diff(section, axis=0), axis=1)).max() < 1e-11
    # a right-handed frame: anticlockwise in the section is anticlockwise seen from the tip of the normal
    corner = plane.to_machine(np.array([(0.0, 0), (1, 0), (0, 1)]))
    assert np.cross(corner[1] - corner[0], corner[2] - corner[0]) @ plane.normal > 0


@pytest.mark.parametrize(
    ("origin", "x_axis", "normal", "message"),
    [
        ([0, 0, 0], [1, 0, 0], [0, 0, 0], "the section's normal must not be zero"),
        ([0, 0, 0], [0, 0, 0], [0, 0, 1], "x axis must not be zero or parallel"),
        ([0, 0, 0], [0, 0, 2], [0, 0, 1], "x axis must not be zero or parallel"),
        ([0, 0], [1, 0, 0], [0, 0, 1], "three finite numbers each"),
        ([0, 0, float("nan")], [1, 0, 0], [0, 0, 1], "three finite numbers each"),
        ([0, 0, 0], [1, 0, 0], [0, float("inf"), 1], "three finite numbers each"),
    ],
)
def test_planes_that_cannot_be_are_refused(origin: list[float], x_axis: list[float], normal: list[float], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        SectionPlane(np.array(origin, dtype=float), np.array(x_axis, dtype=float), np.array(normal, dtype=float))


def test_a_plane_cannot_be_changed_afterwards() -> None:
    plane = SectionPlane(np.zeros(3), np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]))
    for array in (plane.origin_mm, plane.x_axis, plane.normal, plane.packed):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0
