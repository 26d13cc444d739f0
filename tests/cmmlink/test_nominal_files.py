"""Nominal files: every format against closed forms, what is said of a seam, and refusals by line."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from numpy.typing import ArrayLike, NDArray

from cmmlink.nominal_files import NominalFile, known_suffixes, load_nominal, material_side
from cmmlink.nominal_files.nurbs_yaml import save_nurbs_yaml
from inspection import NominalError, NurbsCurve
from tests.inspection import profiles

Array = NDArray[np.float64]


def naca_sides(thickness: float, points: int, last: float = 0.1036) -> tuple[Array, Array]:
    """Upper and lower side of a symmetric NACA section, chord 1, leading edge first; last = 0.1036 makes the edge sharp, 0.1015 blunt."""
    x = (1 - np.cos(np.linspace(0, np.pi, points))) / 2
    half = 5 * thickness * (0.2969 * np.sqrt(x) - 0.126 * x - 0.3516 * x**2 + 0.2843 * x**3 - last * x**4)
    half[-1] = 0.0 if last == 0.1036 else half[-1]
    return np.column_stack([x, half]), np.column_stack([x, -half])


def rows(points: ArrayLike, form: str = "{:.17g} {:.17g}") -> str:
    return "".join(form.format(x, y) + "\n" for x, y in np.asarray(points))


UPPER, LOWER = naca_sides(0.12, 41)
BLUNT_UPPER, BLUNT_LOWER = naca_sides(0.12, 41, last=0.1015)
LOOP = np.vstack([UPPER[::-1], LOWER[1:]])
BLUNT_LOOP = np.vstack([BLUNT_UPPER[::-1], BLUNT_LOWER[1:]])


def written(folder: Path, text: str | bytes, name: str) -> Path:
    path = folder / name
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return path


def same_curve(one: NurbsCurve, other: NurbsCurve) -> None:
    assert (one.degree, one.closed) == (other.degree, other.closed)
    for name in ("knots", "control_points_mm", "weights"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


def reference(loop: Array, scale: float = 100.0) -> NurbsCurve:
    return NurbsCurve.interpolate(loop[:-1] * scale, closed=True, corner_at_seam=True)


DAT = {
    "title": "NACA 0012\n" + rows(LOOP),
    "no title": rows(LOOP),
    "title of one number": "0012\n" + rows(LOOP),
    "title of two numbers": "63 215\n" + rows(LOOP),
    "title of three numbers": "16 0.12 3\n" + rows(LOOP),
    "title with a number first": "18% thick\n" + rows(LOOP),
    "flow grid": "NACA 0012\n-2.0 3.0 -2.5 3.0\n" + rows(LOOP),
    "blank line in the loop": "NACA 0012\n" + rows(UPPER[::-1]) + "\n" + rows(LOWER[1:]),
    "separator at the end": "NACA 0012\n" + rows(LOOP) + "999.0 999.0\n",
    "commas": "NACA 0012\n" + rows(LOOP, "{:.17g}, {:.17g}"),
    "carriage returns and end mark": ("NACA 0012\n" + rows(LOOP)).replace("\n", "\r\n") + "\x1a",
    "Lednicer": "NACA 0012\n41. 41.\n\n" + rows(UPPER) + "\n" + rows(LOWER),
    "Lednicer, one blank line": "NACA 0012\n41 41\n" + rows(UPPER) + "\n" + rows(LOWER),
    "Lednicer, counts alone": "NACA 0012\n41.0 41.0\n" + rows(UPPER) + rows(LOWER),
    "Lednicer, no counts": "NACA 0012\n" + rows(UPPER) + "\n" + rows(LOWER),
    "Lednicer, nothing between": "NACA 0012\n" + rows(UPPER) + rows(LOWER),
    "Lednicer, separators": "NACA 0012\n" + rows(UPPER) + "999.0 999.0\n" + rows(LOWER) + "999. 999.\n",
    "Lednicer, upper side reversed": "NACA 0012\n41 41\n\n" + rows(UPPER[::-1]) + "\n" + rows(LOWER),
    "Lednicer, lower side reversed": "NACA 0012\n41 41\n\n" + rows(UPPER) + "\n" + rows(LOWER[::-1]),
    "Lednicer, title of two numbers": "63 215\n41 41\n\n" + rows(UPPER) + "\n" + rows(LOWER),
    "Lednicer, no title": "41 41\n\n" + rows(UPPER) + "\n" + rows(LOWER),
}


@pytest.mark.parametrize("form", DAT)
def test_every_form_of_dat_gives_the_same_loop(tmp_path: Path, form: str) -> None:
    nominal = load_nominal(written(tmp_path, DAT[form], "naca.dat"), scale=100.0)
    assert nominal.source_format == ("uiuc-lednicer" if form.startswith("Lednicer") else "uiuc-selig")
    same_curve(nominal.curve, reference(LOOP))
    assert material_side(nominal.curve) == "left"


def test_counts_in_millimetres_are_counts(tmp_path: Path) -> None:
    text = "NACA 0012\n41 41\n\n" + rows(UPPER * 100) + "\n" + rows(LOWER * 100)
    same_curve(load_nominal(written(tmp_path, text, "naca.dat")).curve, reference(LOOP))


def test_dat_notes_say_what_was_understood(tmp_path: Path) -> None:
    def notes(form: str, scale: float = 100.0) -> tuple[str, ...]:
        return load_nominal(written(tmp_path, DAT[form], "naca.dat"), scale).notes

    x, y = UPPER[-2]
    turn = 180 - 2 * np.degrees(np.arctan2(y, 1 - x))
    edge = f"closed: the last point repeats the first, a corner of {turn:.0f} deg kept there (sharp trailing edge)"
    assert notes("title") == ("title: NACA 0012", edge)
    assert notes("no title", scale=1.0) == ("no scale given: a chord of 1 is taken as 1 mm", edge)
    assert notes("title of two numbers") == ("line 1: '63 215' lies far from the points: taken as the title", edge)
    assert notes("flow grid")[1] == "line 2: 4 numbers, the limits of a flow grid, left out"
    assert notes("Lednicer, upper side reversed")[1] == "the first side is given from the trailing edge: turned round"


@pytest.mark.parametrize("name", ["naca.csv", "naca.txt", "naca.xyz", "naca.asc", "NACA.CSV"])
def test_points_are_interpolated_with_a_corner_at_a_sharp_seam(tmp_path: Path, name: str) -> None:
    nominal = load_nominal(written(tmp_path, "x,y\n" + rows(LOOP * 100, "{:.17g},{:.17g}"), name))
    same_curve(nominal.curve, reference(LOOP))
    assert nominal.source_format == "points"
    assert nominal.curve.corners.tolist() == [0.0]


def circle_points(count: int, radius: float = 20.0) -> Array:
    angle = np.linspace(0, 2 * np.pi, count + 1)
    return radius * np.column_stack([np.cos(angle), np.sin(angle)])


@pytest.mark.parametrize("count", [8, 100])
@pytest.mark.parametrize("form", ["{:.17g},{:.17g}", "{:.6f},{:.6f}"])
def test_circle_stays_smooth_at_its_seam(tmp_path: Path, count: int, form: str) -> None:
    """The last row repeats the first but for round-off (sin 2 pi = -2e-16) or to the last written digit."""
    nominal = load_nominal(written(tmp_path, rows(circle_points(count), form), "circle.csv"))
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
    path = written(tmp_path, rows(circle_points(40)[:-1]), "circle.csv")
    opened, closed = load_nominal(path), load_nominal(path, closed=True)
    assert not opened.curve.closed
    assert opened.notes == ("open: a gap of 3.13836 mm from last to first point",)  # 2 * 20 mm * sin(pi / 40)
    same_curve(closed.curve, NurbsCurve.interpolate(circle_points(40)[:-1], closed=True))
    assert closed.notes == ("closed, as asked: a gap of 3.13836 mm from last to first point, joined smoothly",)


def test_blunt_edge_stays_open_until_told_then_gets_a_straight_edge(tmp_path: Path) -> None:
    path = written(tmp_path, "NACA 0012\n" + rows(BLUNT_LOOP), "naca.dat")
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
    nominal = load_nominal(written(tmp_path, rows(LOOP * 100), "naca.csv"), closed=False)
    same_curve(nominal.curve, NurbsCurve.interpolate(LOOP * 100))
    assert nominal.notes == ("open, as asked: the last point repeats the first",)


def test_sharp_turn_between_the_ends_is_pointed_out(tmp_path: Path) -> None:
    x = np.linspace(0, 10, 11)
    roof = np.column_stack([np.concatenate([x, x[1:] + 10]), np.concatenate([2 * x, 20 - 2 * x[1:]])])
    notes = load_nominal(written(tmp_path, rows(roof), "roof.csv")).notes
    assert notes[1] == "line 11: the points turn by 127 deg; the curve is smooth there, a corner would need a nurbs yaml"


def test_constant_height_is_left_out(tmp_path: Path) -> None:
    text = "".join(f"{x:.17g};{y:.17g};12.5\n" for x, y in circle_points(20))
    nominal = load_nominal(written(tmp_path, text, "circle.csv"), scale=2.0)
    assert nominal.notes[0] == "z = 25 mm left out"
    assert nominal.curve.length_mm == pytest.approx(2 * np.pi * 40, rel=1e-4)


@pytest.mark.parametrize("name", ["P1", "P2", "P3"])
def test_nurbs_yaml_comes_back_to_the_bit(tmp_path: Path, name: str) -> None:
    curve = profiles.EVERY[name]()
    save_nurbs_yaml(curve, tmp_path / "curve.yaml")
    nominal = load_nominal(tmp_path / "curve.yaml")
    same_curve(nominal.curve, curve)
    assert (nominal.source_format, nominal.notes) == ("nurbs-yaml", ())


QUARTER = """\
degree: 2
knots: [0, 0, 0, 1, 1, 1]
control_points_mm: [[1, 0], [1, 1], [0, 1]]
weights: [1, 0.7071067811865476, 1]
"""


def test_nurbs_yaml_by_hand_is_a_quarter_circle(tmp_path: Path) -> None:
    curve = load_nominal(written(tmp_path, QUARTER, "quarter.yml"), scale=30.0).curve
    np.testing.assert_allclose(np.hypot(*curve.point(np.linspace(0, 1, 101)).T), 30.0, rtol=1e-14)
    assert curve.length_mm == pytest.approx(15 * np.pi, rel=1e-12)
    assert not curve.closed


def test_nurbs_yaml_that_ends_where_it_begins_is_closed(tmp_path: Path) -> None:
    triangle = "degree: 1\nknots: [0, 0, 1, 2, 3, 3]\ncontrol_points_mm: [[0, 0], [3, 0], [0, 4], [0, 0]]\n"
    nominal = load_nominal(written(tmp_path, triangle, "triangle.yaml"))
    assert nominal.curve.closed
    assert nominal.notes == ("closed: the curve ends where it begins",)
    assert nominal.curve.length_mm == pytest.approx(12.0, rel=1e-14)
    kept_open = load_nominal(tmp_path / "triangle.yaml", closed=False)
    assert not kept_open.curve.closed
    said = load_nominal(written(tmp_path, triangle + "closed: true\n", "said.yaml"), closed=False)
    assert said.notes == ("open, as asked, against what the file says",)


@pytest.mark.parametrize(
    ("points", "side"), [(circle_points(30), "left"), (circle_points(30)[::-1], "right"), (circle_points(30)[:20], None)]
)
def test_material_lies_inside(tmp_path: Path, points: Array, side: str | None) -> None:
    assert material_side(load_nominal(written(tmp_path, rows(points), "c.csv")).curve) == side


def test_material_lies_inside_a_blunt_airfoil_kept_open() -> None:
    assert material_side(NurbsCurve.interpolate(BLUNT_LOOP)) == "left"
    assert material_side(NurbsCurve.interpolate(BLUNT_LOOP[::-1].copy())) == "right"


MANY = rows(circle_points(12))
BAD: dict[str, tuple[str, str | bytes, str]] = {
    "empty": ("a.dat", "", "the file is empty"),
    "title alone": ("a.dat", "NACA 0012\n", "no line of numbers"),
    "binary": ("a.dat", b"\x7fELF\x02\x01\x01\x00", "line 1: not a text file"),
    "one point": ("a.csv", "1,2.5\n", "1 point; expected at least 4"),
    "three points": ("a.csv", "0,0.5\n1,2.5\n3,1.5\n", "3 different points; expected at least 4"),
    "three points and back": ("a.csv", "0 0\n1 0\n1 1\n0 0\n", "3 different points; expected at least 4"),
    "NaN": ("a.dat", "t\n" + rows(LOOP[:9]) + "nan 0\n", "line 11: nan is not a finite number"),
    "repeated": ("a.csv", "x,y\n0,0.5\n1,2.5\n\n1,2.5\n3,4.5\n5,6.5\n", "line 5: repeats the point (1, 2.5) of line 3"),
    "repeated in dat": ("a.dat", "t\n" + rows(LOOP[:5]) + rows(LOOP[4:]), "line 7: repeats the point (0.975528"),
    "all in one place": ("a.csv", "1 1\n1 1\n1 1\n1 1\n", "line 2: repeats the point (1, 1) of line 1"),
    "huge": ("a.csv", MANY + "1e9 0\n", "line 14: 1e+09 is larger than 1e+06 mm"),
    "tiny": ("a.csv", rows(circle_points(12) * 1e-9), "expected a profile in mm: give the scale"),
    "far away": ("a.csv", rows(circle_points(12) * 1e-3 + 9e5), "expected a profile in mm"),
    "no plane": ("a.csv", "0 0 0\n1 0 0\n1 1 0\n0 1 0.5\n0 0.5 0\n", "line 4: z runs from 0 to 0.5 mm; expected a plane profile"),
    "short line": ("a.csv", "0 0\n1 0\n1\n0 1\n", "line 3: 1 column, line 1 has 2"),
    "words": ("a.txt", "lorem ipsum\n", "no line of numbers"),
    "three columns in dat": ("a.dat", "t\n1 2 3\n4 5 6\n7 8 9\n1 5 9\n", "line 2: 3 columns; expected two, x and y"),
    "two elements": ("a.dat", "t\n" + rows(LOOP) + "999 999\n" + rows(LOOP * 0.3 + 1), "expected one loop, or two sides of one profile"),
    "three blocks": ("a.dat", "t\n" + rows(UPPER) + "\n" + rows(LOWER) + "\n" + rows(LOWER), "line 86: a third block of points begins"),
    "only separators": ("a.dat", "t\n999 999\n999 999\n", "no points between the separators"),
    "wrong counts": ("a.dat", "t\n41. 40.\n\n" + rows(UPPER) + "\n" + rows(LOWER), "line 2: 41 40 is far from the 82 points that follow"),
    "unknown suffix": ("a.stp", MANY, "no nominal file is known by the suffix '.stp'; expected one of .asc, .csv, .dat"),
    "no suffix": ("a", MANY, "suffix ''"),
    "yaml key": ("a.yaml", QUARTER + "control_points: []\n", "line 5: control_points is not a known key; did you mean control_points_mm?"),
    "yaml missing": ("a.yaml", QUARTER.replace("degree: 2\n", ""), "degree is missing: expected the degree"),
    "yaml word": ("a.yaml", QUARTER.replace("0.7", "o.7"), "line 4: weights[1] is 'o.7071067811865476'; expected a number"),
    "yaml point of three": ("a.yaml", QUARTER.replace("[1, 1]", "[1, 1, 0]"), "line 3: control_points_mm[1]"),
    "yaml knots": ("a.yaml", QUARTER.replace("[0, 0, 0, 1", "[0, 0, 1"), "3 control points of degree 2 need 6 knots, got 5"),
    "yaml weight": ("a.yaml", QUARTER.replace("[1, 0.7", "[0, 0.7"), "line 4: weights[0] is '0'; expected a number greater than"),
    "yaml not closed": ("a.yaml", QUARTER + "closed: true\n", "a closed curve must end where it begins: the gap is 1.41421 mm"),
    "yaml huge": ("a.yaml", QUARTER.replace("[1, 1]", "[1, 1e99]"), "line 3: control_points_mm[1][1] is '1e99'; expected a number less"),
    "yaml one place": ("a.yaml", QUARTER.replace("[1, 1], [0, 1]", "[1, 0], [1, 0]"), "the control points lie within 0 mm"),
    "yaml list": ("a.yaml", "- 1\n", "line 1: found a list of 1"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_nominal_is_refused_with_file_line_and_finding(tmp_path: Path, case: str) -> None:
    name, content, message = BAD[case]
    path = written(tmp_path, content, name)
    with pytest.raises(NominalError) as caught:
        load_nominal(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert message in str(caught.value)


def test_missing_file_folder_and_bad_scale_are_refused(tmp_path: Path) -> None:
    with pytest.raises(NominalError, match=r"none\.dat: no such file"):
        load_nominal(tmp_path / "none.dat")
    (tmp_path / "folder.dat").mkdir()
    with pytest.raises(NominalError, match="is a folder"):
        load_nominal(tmp_path / "folder.dat")
    for scale in (0.0, -1.0, np.nan, np.inf):
        with pytest.raises(NominalError, match="the scale must be a positive number"):
            load_nominal(written(tmp_path, MANY, "a.csv"), scale)


def test_formats_are_found_by_looking() -> None:
    assert known_suffixes() == [".asc", ".csv", ".dat", ".txt", ".xyz", ".yaml", ".yml"]


def read_or_refused(path: Path, scale: float = 1.0, closed: bool | None = None) -> NominalFile | None:
    """Either a curve of finite length comes back, or the one named error that names the file."""
    nominal, message = None, f"{path}: read"
    try:
        nominal = load_nominal(path, scale, closed)
    except NominalError as error:
        message = str(error)
    assert message.startswith(f"{path}: ")
    assert nominal is None or 0 < nominal.curve.length_mm < np.inf
    return nominal


DAT_LINES = [
    "NACA 0012",
    "63 215",
    "41 41",
    "3 2",
    "2 2",
    "",
    "999 999",
    "1 0",
    "0.5 0.1",
    "0 0",
    "0.5 -.1",
    "1 1e-3",
    "0.9 nan",
    "1 2 3",
    "-2 3 -2 3",
    "x",
    "1e6 -1e6",
]


@settings(max_examples=300, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    content=st.one_of(
        st.binary(max_size=60), st.lists(st.sampled_from(DAT_LINES), max_size=14).map(lambda lines: "\n".join(lines).encode())
    ),
    suffix=st.sampled_from([".dat", ".csv"]),
    closed=st.sampled_from([None, True, False]),
)
def test_hostile_dat_and_points_are_read_or_refused(tmp_path: Path, content: bytes, suffix: str, closed: bool | None) -> None:
    read_or_refused(written(tmp_path, content, "a" + suffix), closed=closed)


NUMBER = st.one_of(st.integers(-2, 2), st.sampled_from([1e-12, 1e-7, 0.5, 1e5, 1e6]), st.floats())


@st.composite
def nurbs_texts(draw: st.DrawFn) -> str:
    """Curves that are nearly right: counts that mostly fit, knots that mostly rise, numbers of every size."""
    degree, count = draw(st.integers(0, 5)), draw(st.integers(0, 9))
    size = max(0, count + degree + 1 + draw(st.sampled_from([0, 0, 0, 0, 1, -1])))
    knots = draw(st.lists(st.one_of(st.integers(0, 3), st.floats(0, 3), NUMBER), min_size=size, max_size=size))
    knots = sorted(knots) if draw(st.booleans()) else knots
    points = draw(st.lists(st.lists(NUMBER, min_size=2, max_size=2), min_size=count, max_size=count))
    weights = draw(st.one_of(st.just("null"), st.lists(NUMBER, min_size=count, max_size=count)))
    closed = draw(st.sampled_from(["true", "false", "null"]))
    return f"degree: {degree}\nknots: {knots}\ncontrol_points_mm: {points}\nclosed: {closed}\nweights: {weights}\n"


@settings(max_examples=300, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(text=nurbs_texts())
@example(text="degree: 1\nknots: [0, 0, 1, 1]\ncontrol_points_mm: [[0, 0], [0, 1]]\nweights: [1, 1e-300]\n")
@example(text="degree: 1\nknots: [0, 0, 1e-308, 1e-308]\ncontrol_points_mm: [[0, 0], [0, 1]]\n")
@example(text="degree: 1\nknots: []\ncontrol_points_mm: [[0, 0], [0, 1]]\n")
@example(text="degree: 1\nknots: [0, 0, 1, 1]\ncontrol_points_mm: []\n")
def test_hostile_nurbs_is_read_or_refused(tmp_path: Path, text: str) -> None:
    read_or_refused(written(tmp_path, text, "a.yaml"))


@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    points=st.lists(st.tuples(st.integers(-3, 3), st.integers(-3, 3)), min_size=5, max_size=12),
    scale=st.sampled_from([1.0, 1e-7, 1e5]),
    closed=st.sampled_from([None, True, False]),
)
def test_any_points_give_a_curve_through_them_or_are_refused(
    tmp_path: Path, points: list[tuple[int, int]], scale: float, closed: bool | None
) -> None:
    nominal = read_or_refused(written(tmp_path, rows(points), "a.csv"), scale, closed)
    if nominal is not None:
        knots = np.unique(nominal.curve.knots)
        through = nominal.curve.point(np.concatenate([knots[(knots >= 0) & (knots <= 1)], np.linspace(0, 1, 20_001)]))
        for point in np.array(points) * scale:
            assert np.hypot(*(through - point).T).min() < 2e-3 * scale  # half the polyline's largest step


def test_airfoil_files_become_the_profiles_of_the_tests() -> None:
    """All files beside the checkout, by the reader of the inspection tests, which shares no line with ours."""
    if not profiles.AIRFOILS.is_dir():
        pytest.skip(f"no airfoil coordinates at {profiles.AIRFOILS}: they may not be shipped")
    files = sorted(profiles.AIRFOILS.glob("*.dat"))
    assert len(files) >= 14
    for file in files:
        nominal = load_nominal(file, scale=100.0)
        points = np.loadtxt(file, skiprows=1) * 100
        sharp = bool(np.array_equal(points[0], points[-1]))
        assert nominal.curve.closed is sharp
        assert nominal.source_format == "uiuc-selig"
        same_curve(nominal.curve, NurbsCurve.interpolate(points, closed=sharp, corner_at_seam=sharp))
        assert len(nominal.curve.corners) == int(sharp)
        assert material_side(nominal.curve) == "left"
        assert not any("turn by" in note for note in nominal.notes)
