"""The curve through the points of a file: what happens at its seam."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from cmmlink.nominal_files import load_nominal
from inspection import NominalError, NurbsCurve
from tests.cmmlink.nominal_files.shapes import (
    BLUNT_LOOP,
    BLUNT_LOWER,
    BLUNT_UPPER,
    LOOP,
    circle_points,
    read_or_refuse,
    rows,
    same_curve,
    write_text,
)


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


def test_circle_without_its_last_point_is_asked_about(tmp_path: Path) -> None:
    path = write_text(tmp_path, rows(circle_points(40)[:-1]), "circle.csv")
    with pytest.raises(
        NominalError, match=r"a gap of 3\.13836 mm from last to first point, 7\.8 % of the size: .*closed: true or closed: false"
    ):
        load_nominal(path)  # 2 * 20 mm * sin(pi / 40)
    opened, closed = load_nominal(path, closed=False), load_nominal(path, closed=True)
    same_curve(opened.curve, NurbsCurve.interpolate(circle_points(40)[:-1]))
    assert opened.notes == ("open: a gap of 3.13836 mm from last to first point",)
    same_curve(closed.curve, NurbsCurve.interpolate(circle_points(40)[:-1], closed=True))
    assert closed.notes == ("closed, as asked: a gap of 3.13836 mm from last to first point, joined smoothly",)


@pytest.mark.parametrize("count", [6, 40, 400, 4000])
def test_a_loop_that_lacks_its_last_point_is_never_silently_open(tmp_path: Path, count: int) -> None:
    """The gap is 50, 7.9, 0.79 and 0.079 % of the size: none of these is a blunt edge, for the points run on."""
    with pytest.raises(NominalError, match="the profile may be closed or open"):
        load_nominal(write_text(tmp_path, rows(circle_points(count)[:-1]), "circle.csv"))


def test_a_profile_whose_ends_lie_far_apart_is_open(tmp_path: Path) -> None:
    for share in (0.25, 0.5, 0.75):
        nominal = load_nominal(write_text(tmp_path, rows(circle_points(80)[: round(80 * share) + 1]), "arc.csv"))
        assert not nominal.curve.closed
        assert nominal.notes[0].startswith("open: a gap of ")


def test_blunt_edge_is_closed_by_a_straight_edge_unless_kept_open(tmp_path: Path) -> None:
    path = write_text(tmp_path, "NACA 0012\n" + rows(BLUNT_LOOP), "naca.dat")
    opened, closed, asked = (load_nominal(path, scale=100.0, closed=closed) for closed in (False, None, True))
    body = NurbsCurve.interpolate(BLUNT_LOOP * 100)
    same_curve(opened.curve, body)
    assert opened.notes[1] == "open: a gap of 0.252 mm from last to first point"  # 2 * 5 * 0.12 * 0.0021 of the chord
    said = "a gap of 0.252 mm from last to first point, joined by a straight line with a corner at each end (blunt trailing edge)"
    assert closed.notes[1] == f"closed: {said}; to keep it open, say so: --open, or closed: false"
    assert asked.notes[1] == f"closed, as asked: {said}"
    same_curve(closed.curve, asked.curve)
    curve = closed.curve
    assert curve.closed
    assert len(curve.corners) == 2
    assert curve.length_mm == pytest.approx(body.length_mm + 0.252, abs=1e-9)
    edge = curve.point(np.linspace(curve.corners[1], 1.0, 50))
    np.testing.assert_allclose(edge[:, 0], 100.0, atol=1e-12)
    assert np.all(np.diff(edge[:, 1]) > 0)
    share = curve.corners[1]  # the body's parameter, shrunk
    np.testing.assert_allclose(curve.point(np.linspace(0, share, 400)[:-1]), body.point(np.linspace(0, 1, 400)[:-1]), atol=1e-11)


@pytest.mark.parametrize("gap_share", [0.021, 0.06, 0.2])
def test_a_thick_blunt_edge_is_asked_about(tmp_path: Path, gap_share: float) -> None:
    """Parallel sides with an edge of this share of the chord: thicker than edges are, and far from open."""
    x = np.linspace(1, 0.1, 30)
    nose = np.linspace(0, np.pi, 12)[1:-1]
    half = gap_share / 2
    loop = np.vstack(
        [
            np.column_stack([x, np.full(30, half)]),
            np.column_stack([0.1 - 0.1 * np.sin(nose), half * np.cos(nose)]),
            np.column_stack([x[::-1], np.full(30, -half)]),
        ]
    )
    path = write_text(tmp_path, rows(loop * 100), "flat.csv")
    with pytest.raises(NominalError, match=f"{100 * gap_share:.2g} % of the size"):
        load_nominal(path)
    assert len(load_nominal(path, closed=True).curve.corners) == 2
    assert not load_nominal(path, closed=False).curve.closed


def test_closed_file_can_be_kept_open(tmp_path: Path) -> None:
    nominal = load_nominal(write_text(tmp_path, rows(LOOP * 100), "naca.csv"), closed=False)
    same_curve(nominal.curve, NurbsCurve.interpolate(LOOP * 100))
    assert nominal.notes == ("open, as asked: the last point repeats the first",)


def test_sharp_turn_between_the_ends_is_pointed_out(tmp_path: Path) -> None:
    x = np.linspace(0, 10, 11)
    roof = np.column_stack([np.concatenate([x, x[1:] + 10]), np.concatenate([2 * x, 20 - 2 * x[1:]])])
    notes = load_nominal(write_text(tmp_path, rows(roof), "roof.csv")).notes
    assert notes[1] == "line 11: the points turn by 127 deg; the curve is smooth there, a corner would need a nurbs yaml"


BLUNT_CORNER = "the points turn by {} deg; the curve is smooth there, a corner would need a nurbs yaml"


def test_both_corners_of_a_blunt_edge_closed_at_its_middle_are_pointed_out(tmp_path: Path) -> None:
    loop = np.vstack([[1.0, 0.0], BLUNT_LOOP, [1.0, 0.0]]) * 100
    nominal = load_nominal(write_text(tmp_path, rows(loop), "naca.csv"))
    (x, y), half = BLUNT_UPPER[-2], BLUNT_UPPER[-1, 1]
    turn = 90 - np.degrees(np.arctan2(y - half, 1 - x))
    assert [note for note in nominal.notes if "turn by" in note] == [
        f"line {line}: " + BLUNT_CORNER.format(f"{turn:.0f}") for line in (2, len(loop) - 1)
    ]


def test_both_corners_of_a_blunt_edge_inside_the_loop_are_pointed_out(tmp_path: Path) -> None:
    """The loop begins at the leading edge, so that two corners follow one another far from its seam."""
    loop = np.vstack([BLUNT_LOWER, BLUNT_UPPER[::-1]]) * 100
    nominal = load_nominal(write_text(tmp_path, rows(loop), "naca.csv"))
    assert [note.split(":")[0] for note in nominal.notes if "turn by" in note] == ["line 41", "line 42"]


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
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
