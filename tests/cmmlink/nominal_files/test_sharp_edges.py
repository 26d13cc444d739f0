"""Sharp and blunt trailing edges of nominals: what is outside has a positive deviation, on every nominal that is accepted."""

import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from cmmlink.nominal_files import NominalFile, load_nominal
from inspection import NominalError, NurbsCurve, deviations, discretize, find_crossings
from tests.inspection import profiles

Array = NDArray[np.float64]

OUT_MM = 0.02


def arc(turn: float, share: Array) -> Array:
    """Points (n, 2) at these shares of a circular arc from (0, 0) to (1, 0) that makes the angle `turn` with its chord at both ends."""
    if abs(turn) < 1e-9:
        return np.column_stack([share, 0 * share])
    radius, angle = 0.5 / np.sin(turn), turn * (2 * share - 1)
    return np.column_stack([0.5 + radius * np.sin(angle), radius * (np.cos(angle) - np.cos(turn))])


def edge(angle: float, upper: float, share: Array, pinch: float, reach: float, digits: int) -> Array:
    """Two arcs that meet at an angle in rad, the upper one at `upper` to the chord: (m, 2) in mm for a chord of 100, from tip to tip.

    The thickness falls short by the share `pinch` at the first points beside the edge, and by less over the `reach` next ones:
    such an edge is nearly a cusp. The digits are those of a file in chords.
    """
    sides = arc(upper, share), arc(upper - angle, share)
    middle, half = (sides[0] + sides[1]) / 2, (sides[0] - sides[1]) / 2
    beside = np.arange(len(share))[::-1] - 1.0
    half *= np.clip(1 - pinch * np.exp(-beside / reach), 0, 1)[:, None]
    loop = np.round(np.vstack([(middle + half)[::-1], (middle - half)[1:]]), digits) * 100
    loop[-1] = loop[0]
    return np.asarray(loop)


@st.composite
def sharp_edges(draw: st.DrawFn) -> Array:
    """Edges of 3 to 12 deg, of 40 to 120 points a side in 4 to 6 digits, cambered, up to nearly cusped."""
    angle, camber = np.radians(draw(st.floats(3, 12))), np.radians(draw(st.floats(-8, 8)))
    even = np.linspace(0, 1, draw(st.integers(40, 120)))
    share = even if draw(st.booleans()) else (1 - np.cos(np.pi * even)) / 2
    pinch, reach, digits = draw(st.floats(0, 0.8)), draw(st.floats(0.5, 2)), draw(st.integers(4, 6))
    return edge(angle, camber + angle * draw(st.floats(0, 1)), share, pinch, reach, digits)


def polygon_of(points: Array) -> NurbsCurve:
    count = len(points)
    return NurbsCurve(1, points, np.concatenate([[0.0], np.arange(count), [count - 1.0]]), closed=True)


def loaded(folder: Path, points: Array, closed: bool | None = None) -> NominalFile:
    path = folder / "edge.csv"
    path.write_text("".join(f"{x:.17g},{y:.17g}\n" for x, y in points), encoding="utf-8")
    return load_nominal(path, closed=closed)


def around_the_tip(points: Array) -> Array:
    """Places (61, 2) 0.02 mm from the tip, in all directions more than 30 deg off both sides; the middle one straight ahead."""
    into = points[[1, -2]] - points[0]
    first, last = np.arctan2(into[:, 1], into[:, 0])  # of the upper and the lower side
    wedge = np.mod(last - first, 2 * np.pi)  # turning to the left, from the upper side through the material to the lower one
    margin = np.radians(30)
    away = last + np.linspace(margin, 2 * np.pi - wedge - margin, 61)
    return np.asarray(points[0] + OUT_MM * np.column_stack([np.cos(away), np.sin(away)]))


def check_signs(curve: NurbsCurve, points: Array) -> None:
    nominal = discretize(curve, samples=200, step_min=0.9)
    found = deviations(around_the_tip(points), nominal).deviation_mm
    assert found[30] == pytest.approx(OUT_MM, abs=1e-9)
    assert np.all(found > OUT_MM * np.sin(np.radians(15)))
    assert np.all(found < OUT_MM * (1 + 1e-9))
    assert np.abs(deviations(points[1:-1], nominal).deviation_mm).max() < 1e-9


@settings(max_examples=12, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(points=sharp_edges())
def test_points_outside_a_sharp_tip_have_positive_deviations(tmp_path: Path, points: Array) -> None:
    """A nominal is refused where its points themselves meet before the edge, or coincide, and for no other reason."""
    refusal = ""
    try:
        check_signs(loaded(tmp_path, points).curve, points)
    except NominalError as error:
        refusal = str(error)
    if refusal:
        coincide = bool(np.any(np.all(points[1:] == points[:-1], axis=1)))
        assert ("repeats the point" if coincide else "the curve crosses or touches itself at") in refusal
        assert coincide or find_crossings(polygon_of(points))


NEARLY_CUSPED = edge(np.radians(6), np.radians(7), np.linspace(0, 1, 61), 0.8, 1.0, 5)


def test_an_edge_whose_sides_nearly_touch_keeps_to_the_lines_between_its_points(tmp_path: Path) -> None:
    """Laid along the last lines alone the curve still crosses itself in its bends between the points behind them."""
    points = edge(np.radians(3.5), np.radians(6), np.linspace(0, 1, 70), 0.8, 0.5, 4)
    assert find_crossings(NurbsCurve.interpolate(points[:-1], 3, closed=True, corner_at_seam=True, ends_along_chords=True))
    nominal = loaded(tmp_path, points)
    assert not find_crossings(nominal.curve)
    check_signs(nominal.curve, points)
    assert "it keeps to the lines between the last 2 points of both sides instead, through every point" in nominal.notes[1]
    chord = (points[1] + points[0]) / 2
    assert abs(deviations(chord[None], discretize(nominal.curve, samples=200, step_min=0.9)).deviation_mm[0]) < 1e-3


def test_an_edge_that_the_smoothest_curve_turns_inside_out_is_mended(tmp_path: Path) -> None:
    inside_out = NurbsCurve.interpolate(NEARLY_CUSPED, closed=True, corner_at_seam=True)
    (crossing,) = find_crossings(inside_out)
    (wrong,) = deviations(around_the_tip(NEARLY_CUSPED)[30:31], discretize(inside_out, samples=200, step_min=0.9)).deviation_mm
    assert wrong == pytest.approx(-OUT_MM, abs=1e-9)
    nominal = loaded(tmp_path, NEARLY_CUSPED)
    check_signs(nominal.curve, NEARLY_CUSPED)
    place = f"{crossing.first_mm:.3g} mm before the edge, at ({crossing.x_mm:.6g}, {crossing.y_mm:.6g})"
    assert nominal.notes[1] == (
        f"mended: the smoothest curve through the points would cross itself {place}; it runs into the edge along the lines from the "
        "neighbouring points instead, through every point"
    )
    kept_open = loaded(tmp_path, NEARLY_CUSPED, closed=False)
    assert not find_crossings(kept_open.curve)
    assert any(note.startswith("mended: ") for note in kept_open.notes)


def test_an_edge_whose_sides_change_places_is_refused_with_the_place(tmp_path: Path) -> None:
    """The points before the tip of a symmetric edge change sides: the sides cross on the chord, before the next points."""
    points = edge(np.radians(6), np.radians(3), np.linspace(0, 1, 61), 0.0, 1.0, 6)
    points[[1, -2]] = points[[-2, 1]]
    with pytest.raises(NominalError) as caught:
        loaded(tmp_path, points)
    place = re.search(r"the curve crosses or touches itself at \((.*), (.*)\) at stations (.*) and (.*) mm; expected", str(caught.value))
    assert place
    x, y, first, second = (float(number) for number in place.groups())
    assert points[2, 0] < x < points[1, 0]
    assert y == pytest.approx(0.0, abs=1e-9)
    assert first == pytest.approx(100 - x, abs=0.05)  # the side turns up by 0.3 mm on its way
    assert second == pytest.approx(100 + x, abs=0.2)  # the arcs are 0.05 % longer than the chord


def test_a_blunt_edge_whose_ends_change_places_is_refused(tmp_path: Path) -> None:
    points = edge(np.radians(6), np.radians(3), np.linspace(0, 1, 61), 0.0, 1.0, 6)
    points[0, 1], points[-1, 1] = -0.15, 0.15
    with pytest.raises(NominalError, match="the curve crosses or touches itself at"):
        loaded(tmp_path, points)


def test_a_smooth_loop_that_crosses_itself_is_refused_with_every_place(tmp_path: Path) -> None:
    turn = np.linspace(0, 2 * np.pi, 81)
    with pytest.raises(NominalError, match=r"itself at \(.*\) at stations .* and .* mm, \(.*\) at stations"):
        loaded(tmp_path, 50 * np.column_stack([np.cos(turn), np.sin(3 * turn)]))


def test_airfoils_that_are_open_by_their_edge_are_closed_and_none_is_refused(tmp_path: Path) -> None:
    """Their own points give zero; a burr 2 mm behind the edge gives 2 mm, where an open profile would leave it out."""
    if not profiles.AIRFOILS.is_dir():
        pytest.skip(f"no airfoil coordinates at {profiles.AIRFOILS}: they may not be shipped")
    for file in sorted(profiles.AIRFOILS.glob("*.dat")):
        curve = load_nominal(file, scale=100.0).curve
        assert curve.closed
        first, last = np.loadtxt(file, skiprows=1)[[0, -1]] * 100
        nominal = discretize(curve, samples=200, step_min=0.9)
        behind = (first + last) / 2 + (2.0, 0.0)
        beyond = deviations(behind[None], nominal)
        assert not beyond.beyond_end[0], file.name
        assert beyond.deviation_mm[0] == pytest.approx(2.0, abs=2e-3), file.name
