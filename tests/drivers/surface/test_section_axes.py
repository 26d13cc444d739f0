"""The plane's axes: the stated convention, and the way back."""

import numpy as np
import pytest

from drivers.surface.section_axes import axes_of


def test_the_normal_z_leaves_x_and_y_unchanged() -> None:
    axes = axes_of((0, 0, 7))
    points = np.random.default_rng(1).normal(size=(20, 3))
    assert np.array_equal(axes.section_mm(points), points[:, :2])
    assert np.array_equal(axes.height_mm(*points.T), points[:, 2])


@pytest.mark.parametrize("normal", [(1, 0, 0), (0, 1, 0), (0, 0, -1), (0.1, 0.2, 1), (-3, 1, 2), (0.95, 0.1, 0.2), (1e-9, 0, 1e9)])
def test_axes_are_orthonormal_right_handed_and_lead_back(normal: tuple[float, float, float]) -> None:
    axes = axes_of(normal)
    frame = np.stack([axes.x, axes.y, axes.normal])
    assert np.abs(frame @ frame.T - np.eye(3)).max() < 1e-15
    assert np.linalg.det(frame) == pytest.approx(1.0, abs=1e-14)
    assert axes.normal == pytest.approx(np.array(normal) / np.linalg.norm(normal), abs=1e-15)
    points = np.random.default_rng(2).normal(size=(20, 3)) * 50
    back = np.concatenate([axes.machine_mm(axes.section_mm(p[None]), float(axes.height_mm(*p[:, None])[0])) for p in points])
    assert np.abs(back - points).max() < 1e-13


def test_the_x_axis_is_the_machines_x_in_the_plane_or_its_y_where_the_normal_is_near_x() -> None:
    assert axes_of((0, 0.6, 0.8)).x == pytest.approx([1, 0, 0])
    assert axes_of((0.6, 0, 0.8)).x == pytest.approx([0.8, 0, -0.6])
    assert axes_of((1, 0, 0)).x == pytest.approx([0, 1, 0])


@pytest.mark.parametrize("normal", [(0, 0, 0), (0, np.nan, 1), (1, 2), (np.inf, 0, 0)])
def test_a_normal_that_is_no_direction_is_refused(normal: tuple[float, ...]) -> None:
    with pytest.raises(ValueError, match="normal"):
        axes_of(normal)
