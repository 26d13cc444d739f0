"""Machine points in space to section points in the plane and back."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from inspection import SectionPlane


def test_axes_are_what_the_docstring_says() -> None:
    plane = SectionPlane(np.array([10.0, 20.0, 30.0]), np.array([0.0, 2.0, 0.0]), np.array([0.0, 0.0, 5.0]))
    # x along machine y; y = normal cross x = -machine x; height along machine z
    points, height = plane.to_section(np.array([[10.0, 21.0, 30.0], [9.0, 20.0, 30.0], [10.0, 20.0, 33.5]]))
    assert np.abs(points - [(1, 0), (0, 1), (0, 0)]).max() < 1e-14
    assert np.abs(height - [0, 0, 3.5]).max() < 1e-14


def test_only_the_part_of_the_x_axis_along_the_plane_counts() -> None:
    straight = SectionPlane(np.zeros(3), np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]))
    slanted = SectionPlane(np.zeros(3), np.array([3.0, 0.0, 7.0]), np.array([0.0, 0.0, 0.1]))
    points = np.random.default_rng(1).normal(0, 50, (20, 3))
    for a, b in zip(straight.to_section(points), slanted.to_section(points), strict=True):
        assert np.abs(a - b).max() < 1e-12


@given(
    st.lists(st.floats(-1, 1), min_size=9, max_size=9),
    st.floats(-10, 10),
)
def test_to_the_machine_and_back_is_the_same_and_keeps_distances(numbers: list[float], height: float) -> None:
    origin, x_axis, normal = 100 * np.array(numbers[:3]), np.array(numbers[3:6]), np.array(numbers[6:])
    if np.linalg.norm(np.cross(x_axis, normal)) < 0.05:
        return
    plane = SectionPlane(origin, x_axis, normal)
    section = np.random.default_rng(2).normal(0, 50, (15, 2))
    machine = plane.to_machine(section, height)
    back, up = plane.to_section(machine)
    assert np.abs(back - section).max() < 1e-11
    assert np.abs(up - height).max() < 1e-11
    assert np.abs(np.linalg.norm(np.diff(machine, axis=0), axis=1) - np.linalg.norm(np.diff(section, axis=0), axis=1)).max() < 1e-11
    # a right-handed frame: anticlockwise in the section is anticlockwise seen from the tip of the normal
    corner = plane.to_machine(np.array([(0.0, 0), (1, 0), (0, 1)]))
    assert np.cross(corner[1] - corner[0], corner[2] - corner[0]) @ normal > 0


@pytest.mark.parametrize(
    ("origin", "x_axis", "normal"),
    [
        ([0, 0, 0], [1, 0, 0], [0, 0, 0]),
        ([0, 0, 0], [0, 0, 0], [0, 0, 1]),
        ([0, 0, 0], [0, 0, 2], [0, 0, 1]),
        ([0, 0], [1, 0, 0], [0, 0, 1]),
        ([0, 0, float("nan")], [1, 0, 0], [0, 0, 1]),
        ([0, 0, 0], [1, 0, 0], [0, float("inf"), 1]),
    ],
)
def test_planes_that_cannot_be_are_refused(origin: list[float], x_axis: list[float], normal: list[float]) -> None:
    with pytest.raises(ValueError, match=r"origin|axis|normal"):
        SectionPlane(np.array(origin, dtype=float), np.array(x_axis, dtype=float), np.array(normal, dtype=float))


def test_points_that_are_not_in_space_are_refused() -> None:
    plane = SectionPlane(np.zeros(3), np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]))
    with pytest.raises(ValueError, match="3"):
        plane.to_section(np.zeros((4, 2)))
