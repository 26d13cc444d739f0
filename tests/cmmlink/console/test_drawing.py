import numpy as np

from cmmlink.console.drawing import nominal_message, points_message
from cmmlink.extremes import Extremes, PointsVersion
from inspection import NurbsCurve, discretize


def test_points_message_is_laid_out_as_written_down() -> None:
    rng = np.random.default_rng(5)
    station, deviation = rng.uniform(0, 100, 40), rng.normal(0, 0.02, 40)
    foot = np.column_stack([station, np.zeros(40)])
    extremes = Extremes(100.0, 0.0, bins=8)
    extremes.add(station, deviation, foot, foot + deviation[:, None] * [0.0, 1.0], np.zeros(40, dtype=np.int8))
    changed = extremes.changed_since(PointsVersion(-1, 0))
    message = points_message(changed, 7, None)
    k = len(changed.bins)
    assert len(message) == 32 + 4 * k * 15
    assert np.frombuffer(message, "<u4", 4).tolist() == [1, 7, k, 0]
    assert np.frombuffer(message, "<f8", 2, 16).tolist() == [0.0, 16384.0]
    assert np.frombuffer(message, "<u4", k, 32).tolist() == changed.bins.tolist()
    columns = np.frombuffer(message, "<f4", 14 * k, 32 + 4 * k).reshape(14, k)
    np.testing.assert_array_equal(columns[1], changed.extremes[:, 0, 1].astype(np.float32))
    np.testing.assert_array_equal(columns[7], changed.extremes[:, 1, 0].astype(np.float32))


def test_nominal_message_keeps_both_ends_and_says_whether_it_is_closed() -> None:
    corner = np.array([[0.0, 0.0], [100.0, 0.0], [100.0, 60.0], [40.0, 80.0]])
    profile = discretize(NurbsCurve.interpolate(corner), samples=20_000, material="left")
    message = nominal_message(profile)
    kind, generation, rows, flags = np.frombuffer(message, "<u4", 4).tolist()
    assert (kind, generation, flags) == (2, 0, 0)
    assert rows <= 6001 < len(profile)
    assert np.frombuffer(message, "<f8", 2, 16).tolist() == [0.0, profile.length_mm]
    x_y = np.frombuffer(message, "<f4", 5 * rows, 32).reshape(5, rows)[1:3]
    np.testing.assert_allclose(x_y[:, [0, -1]].T, corner[[0, -1]], atol=1e-5)
