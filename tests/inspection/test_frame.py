"""Principal frames, bounding boxes and dominant points of shapes whose own are known."""

import numpy as np
import pytest

from inspection.frame import arc_length_weights, dominant_points, principal_frame
from tests.inspection import profiles


def grid(half_x: float, half_y: float) -> profiles.Array:
    x, y = np.meshgrid(np.linspace(-half_x, half_x, 21), np.linspace(-half_y, half_y, 9))
    return np.column_stack([x.ravel(), y.ravel()])


@pytest.mark.parametrize("rotation_deg", [-170.0, -45.0, 0.0, 30.0, 90.0, 123.4])
def test_frame_of_a_turned_rectangle_is_the_rectangle(rotation_deg: float) -> None:
    points = profiles.rotated(grid(30.0, 8.0), rotation_deg, (100.0, -40.0))
    frame = principal_frame(points)
    assert np.abs(frame.origin_mm - (100.0, -40.0)).max() < 1e-12
    assert np.abs(frame.axes.T @ frame.axes - np.eye(2)).max() < 1e-14
    assert np.linalg.det(frame.axes) == pytest.approx(1.0, abs=1e-14)
    long = profiles.rotated(np.array([[1.0, 0.0]]), rotation_deg)[0]
    assert abs(frame.axes[:, 0] @ long) == pytest.approx(1.0, abs=1e-13)
    assert np.abs(frame.low_mm - (-30.0, -8.0)).max() < 1e-11
    assert np.abs(frame.high_mm - (30.0, 8.0)).max() < 1e-11
    assert np.abs(frame.box_centre_mm - (100.0, -40.0)).max() < 1e-11
    expected = profiles.rotated(np.array([(-30.0, -8), (30, -8), (30, 8), (-30, 8)]), rotation_deg, (100.0, -40.0))
    found = frame.corners_mm[np.lexsort(np.round(frame.corners_mm, 6).T)]
    assert np.abs(found - expected[np.lexsort(np.round(expected, 6).T)]).max() < 1e-11


def test_axes_diagonalise_the_weighted_covariance() -> None:
    rng = np.random.default_rng(1)
    points, weights = rng.normal(0, 1, (200, 2)) @ np.array([(5.0, 2.0), (0.0, 1.0)]) + (3.0, 4.0), rng.uniform(0.1, 2.0, 200)
    frame = principal_frame(points, weights)
    covariance = np.cov(points.T, aweights=weights, ddof=0)
    assert np.abs(frame.origin_mm - np.average(points, axis=0, weights=weights)).max() < 1e-12
    turned = frame.axes.T @ covariance @ frame.axes
    assert abs(turned[0, 1]) < 1e-12 * turned[0, 0]
    assert turned[0, 0] > turned[1, 1]
    local = (points - frame.origin_mm) @ frame.axes
    assert np.abs(local.min(axis=0) - frame.low_mm).max() < 1e-12
    assert np.abs(local.max(axis=0) - frame.high_mm).max() < 1e-12
    diagonal = frame.diagonal_points_mm
    assert diagonal.shape == (4,)
    assert np.abs(np.sort(diagonal) - np.sort(np.concatenate([frame.low_mm, frame.high_mm]))).max() < 1e-14


def test_arc_length_weights_share_out_the_length() -> None:
    rng = np.random.default_rng(2)
    angle = np.sort(rng.uniform(0, 2 * np.pi, 300))
    points = 20 * np.column_stack([np.cos(angle), np.sin(angle)])
    step = np.linalg.norm(np.diff(points, axis=0), axis=1)
    last = np.linalg.norm(points[0] - points[-1])
    open_weights, closed_weights = arc_length_weights(points, False), arc_length_weights(points, True)
    assert open_weights.sum() == pytest.approx(step.sum(), rel=1e-12)
    assert open_weights[0] == pytest.approx(step[0] / 2, rel=1e-12)
    assert closed_weights.sum() == pytest.approx(step.sum() + last, rel=1e-12)
    assert closed_weights[0] == pytest.approx((step[0] + last) / 2, rel=1e-12)
    assert closed_weights[17] == pytest.approx((step[16] + step[17]) / 2, rel=1e-12)


def test_weights_make_the_frame_independent_of_how_densely_points_lie() -> None:
    even, crowded = np.linspace(0, 1, 4001)[:-1], np.linspace(0, 1, 4001)[:-1]
    crowded = crowded + 0.12 * np.sin(2 * np.pi * crowded)
    curve = profiles.p3()
    truth = principal_frame(curve.point(even), arc_length_weights(curve.point(even), True))
    found = principal_frame(curve.point(crowded), arc_length_weights(curve.point(crowded), True))
    plain = principal_frame(curve.point(crowded))
    assert np.linalg.norm(found.origin_mm - truth.origin_mm) < 1e-3
    assert np.linalg.norm(plain.origin_mm - truth.origin_mm) > 1.0
    assert abs(found.axes[:, 0] @ truth.axes[:, 1]) < 1e-4


def test_dominant_points_are_the_vertices_of_an_ellipse_and_the_corners_of_a_square() -> None:
    angle = 2 * np.pi * np.arange(400) / 400
    oval = np.column_stack([50 * np.cos(angle), 20 * np.sin(angle)])
    assert set(dominant_points(oval, True).tolist()) == {0, 200}
    side = np.linspace(-20, 20, 41)[:-1]
    ones = np.full(40, 20.0)
    square = np.vstack([np.column_stack(p) for p in ((side, -ones), (ones, side), (-side, ones), (-ones, -side))])
    assert dominant_points(square, True).tolist() == [0, 40, 80, 120]


def test_ends_of_open_sets_are_dominant_too() -> None:
    for make in (profiles.p1, profiles.p2):
        points = make().point(np.linspace(0, 1, 2000))
        found = dominant_points(points, False)
        assert {0, 1999} <= set(found.tolist())
        assert 5 <= len(found) <= 8
        if make is profiles.p2:  # its curvature is continuous: between the ends each is the highest sample around
            curvature = np.abs(make().curvature(np.linspace(0, 1, 2000)))
            for i in found[1:-1]:
                assert curvature[i - 1 : i + 2].max() == curvature[i - 8 : i + 9].max()
