"""The curve through the points of a file: what happens at its seam."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from cmmlink.nominal_files import load_nominal
from inspection import NurbsCurve
from tests.cmmlink.nominal_files.shapes import BLUNT_LOOP, LOOP, circle_points, read_or_refuse, rows, same_curve, write_text


@pytest.mark.parametrize("count", [8, 100])
@pytest.mark.parametrize("form", ["{:.17g},{:.17g}", "{:.6f},{:.6f}"])
def test_circle_stays_smooth_at_its_seam(tmp_path: Path, count: int, form: str) -> None:
    """The last row repeats the first but for round-off (sin 2 pi = -2e-16) or to the last written digit."""
    nominal = load_nominal(write_text(tmp_path, rows(circle_points(count), form), "circle.csv"))
    curve = nominal.curve
    assert nominal.notes == ("closed: the last point repeats the first, smooth there",)
    assert curve.closed
    assert curve.corners.size == 0
    radius = np.hypot(*curve.point(np.linspace(0, 1, 997)).T)
    # Even points make the centripetal parameter uniform. Of cosine data at step h the periodic cubic's second derivatives
    # are -m times the data, m = 6 (2 - 2 cos h) / (h^2 (4 + 2 cos h)); between two points it then lies at the radius
    # cos(h / 2) (1 + m h^2 / 8).
    h = 2 * np.pi / count
    farthest = 20 * (np.cos(h / 2) * (1 + 6 * (2 - 2 * np.cos(h)) / (4 + 2 * np.cos(h)) / 8) - 1)
    between = np.hypot(*curve.point((np.arange(count) + 0.5) / count).T)
    np.testing.assert_allclose(between - 20, farthest, rtol=1e-9, atol=2e-6 if "6f" in form else 1e-13)
    assert np.abs(radius - 20).max() < abs(farthest) + 2e-6
    seam = curve.curvature(np.array([0.0, 1e-9, 1 - 1e-9]))
    np.testing.assert_allclose(seam, seam[0], rtol=1e-6)


def test_circle_without_its_last_point_is_open_until_told(tmp_path: Path) -> None:
    path = write_text(tmp_path, rows(circle_points(40)[:-1]), "circle.csv")
    opened, closed = load_nominal(path), load_nominal(path, closed=True)
    assert not opened.curve.closed
    assert opened.notes == ("open: a gap of 3.13836 mm from last to first point",)  # 2 * 20 mm * sin(pi / 40)
    same_curve(closed.curve, NurbsCurve.interpolate(circle_points(40)[:-1], closed=True))
    assert closed.notes == ("closed, as asked: a gap of 3.13836 mm from last to first point, joined smoothly",)


def test_blunt_edge_stays_open_until_told_then_gets_a_straight_edge(tmp_path: Path) -> None:
    path = write_text(tmp_path, "NACA 0012\n" + rows(BLUNT_LOOP), "naca.dat")
    opened, closed = load_nominal(path, scale=100.0), load_nominal(path, scale=100.0, closed=True)
    body = NurbsCurve.interpolate(BLUNT_LOOP * 100)
    same_curve(opened.curve, body)
    assert opened.notes[1] == "open: a gap of 0.252 mm from last to first point"  # 2 * 5 * 0.12 * 0.0021 of the chord
    assert closed.notes[1].endswith("joined by a straight line with a corner at each end (blunt trailing edge)")
    curve = closed.curve
    assert curve.closed
    assert len(curve.corners) == 2
    assert curve.length_mm == pytest.approx(body.length_mm + 0.252, abs=1e-9)
    edge = curve.point(np.linspace(curve.corners[1], 1.0, 50))
    np.testing.assert_allclose(edge[:, 0], 100.0, atol=1e-12)
    assert np.all(np.diff(edge[:, 1]) > 0)
    share = curve.corners[1]  # the body's parameter, shrunk
    np.testing.assert_allclose(curve.point(np.linspace(0, share, 400)[:-1]), body.point(np.linspace(0, 1, 400)[:-1]), atol=1e-11)


def test_closed_file_can_be_kept_open(tmp_path: Path) -> None:
    nominal = load_nominal(write_text(tmp_path, rows(LOOP * 100), "naca.csv"), closed=False)
    same_curve(nominal.curve, NurbsCurve.interpolate(LOOP * 100))
    assert nominal.notes == ("open, as asked: the last point repeats the first",)


def test_sharp_turn_between_the_ends_is_pointed_out(tmp_path: Path) -> None:
    x = np.linspace(0, 10, 11)
    roof = np.column_stack([np.concatenate([x, x[1:] + 10]), np.concatenate([2 * x, 20 - 2 * x[1:]])])
    notes = load_nominal(write_text(tmp_path, rows(roof), "roof.csv")).notes
    assert notes[1] == "line 11: the points turn by 127 deg; the curve is smooth there, a corner would need a nurbs yaml"


@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    points=st.lists(st.tuples(st.integers(-3, 3), st.integers(-3, 3)), min_size=5, max_size=12),
    scale=st.sampled_from([1.0, 1e-7, 1e5]),
    closed=st.sampled_from([None, True, False]),
)
def test_any_points_give_a_curve_through_them_or_are_refused(
    tmp_path: Path, points: list[tuple[int, int]], scale: float, closed: bool | None
) -> None:
    nominal = read_or_refuse(write_text(tmp_path, rows(points), "a.csv"), scale, closed)
    if nominal is not None:
        knots = np.unique(nominal.curve.knots)
        through = nominal.curve.point(np.concatenate([knots[(knots >= 0) & (knots <= 1)], np.linspace(0, 1, 20_001)]))
        for point in np.array(points) * scale:
            assert np.hypot(*(through - point).T).min() < 2e-3 * scale  # half the polyline's largest step
