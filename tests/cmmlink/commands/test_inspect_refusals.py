"""Points, options and nominals that `inspect` cannot use: one clear message each."""

import re
from pathlib import Path

import numpy as np
import pytest

from cmmlink.demo import plan_file as demo_plan_file
from tests.cmmlink.command import cmmlink
from tests.cmmlink.commands.oval_files import PLAN, TOLERANCE, inspect_oval, peanut, write_plan
from tests.cmmlink.oval_part import oval_points, write_points

GOOD_ROWS = "".join(f"{x:.6f},{y:.6f}\n" for x, y in oval_points(0.0))
WRONG_POINTS = {
    "empty": (b"", "the file is empty"),
    "blank": (b"\n\n  \n", "the file is empty"),
    "text": (b"this is\nno list of points\n", "no line of numbers"),
    "header alone": (b"x_mm,y_mm\n", "no line of numbers"),
    "bytes": (bytes(range(256)), "line 1: not a text file"),
    "nothing but nan": (b"1,nan\n" * 30, r"no row holds numbers for all coordinates"),
    "word": (f"1,2\n3,four\n{GOOD_ROWS}".encode(), r"line 2: 'four' is not a number"),
    "ragged": (f"1,2\n3\n{GOOD_ROWS}".encode(), r"line 2: "),
    "one column": (b"1\n2\n3\n", r"line 1: one column"),
    "one point": (b"1,2\n", r"1 point; expected at least two"),
    "two points": (b"1,2\n2,3\n", r"2 points: a registration needs at least \d"),
    "one point many times": (b"1.5,2.5\n" * 50, r"all 50 points coincide at \(1\.5, 2\.5\)"),
    "another unit": (
        f"x_inch,y_inch\n{GOOD_ROWS}".encode(),
        "the points do not fit .*; wrong.csv: the header gives x in inch: read in inch",
    ),
    "another part": (b"".join(b"%d,%d\n" % (i, i % 7) for i in range(200)), "the points do not fit the nominal"),
}


@pytest.mark.parametrize("name", WRONG_POINTS)
def test_points_that_cannot_be_used_are_refused_by_file_and_line(nominal: Path, name: str) -> None:
    content, message = WRONG_POINTS[name]
    points = nominal.parent / "wrong.csv"
    points.write_bytes(content)
    ended = cmmlink("inspect", points, "--nominal", nominal, *TOLERANCE)
    assert re.match(re.escape(f"{points}: ") + message, ended.refused())
    assert ended.out == ""


def test_rows_without_numbers_are_rejected_and_counted(nominal: Path) -> None:
    points = nominal.parent / "gaps.csv"
    points.write_text(f"nan,nan\n{GOOD_ROWS}3,nan\n", encoding="utf-8")
    facts = cmmlink("inspect", points, "--nominal", nominal, *TOLERANCE, "--fit", "none", "--json").json()
    assert (facts["received"], facts["judged"], facts["rejected"]) == (362, 360, 2)
    assert facts["rejected_by_reason"] == {"not finite": 2}


def test_swapped_columns_are_named_as_the_cause(tmp_path: Path) -> None:
    nominal = demo_plan_file().with_name("nominal.csv")
    points = np.loadtxt(nominal, delimiter=",", skiprows=2)[:-1]
    swapped = write_points(tmp_path / "swapped.csv", points[:, ::-1])
    message = cmmlink("inspect", swapped, "--nominal", nominal, *TOLERANCE, "--json").refused()
    assert re.match(re.escape(f"{swapped}: the points fit the nominal only mirrored") + ".*are the x and y columns swapped", message)


def test_points_that_are_no_file_are_refused(nominal: Path) -> None:
    for points, message in ((nominal.parent / "none.csv", "no such file"), (nominal.parent, "is a folder; expected a file")):
        assert cmmlink("inspect", points, "--nominal", nominal, *TOLERANCE).refused() == f"{points}: {message}"


WRONG_OPTIONS = [
    (("--tolerance", 0.05, -0.05), r"--tolerance is -0\.05: expected a number above the lower limit, 0\.05"),
    (("--tolerance", 0.05, 0.05), r"--tolerance is 0\.05: expected a number above the lower limit, 0\.05"),
    (("--tolerance", "nan", 0.05), r"--tolerance is nan: expected a finite number"),
    (("--uncertainty", 0.05), r"--uncertainty is 0\.05: expected .* less than half the zone of 0\.1 mm: more leaves nothing provable"),
    (("--uncertainty", -1), r"--uncertainty is -1: expected zero or more"),
    (
        ("--method", "guess"),
        r"Invalid value for '--method': 'guess' is not one of 'exact', 'circle', 'chord', 'pcp', 'veaw', 'hermite', 'inversion'; ",
    ),
    (("--fit", "tight"), r"Invalid value for '--fit': 'tight' is not one of 'best-fit', 'minimum-zone', 'none'; "),
    (("--material", "up"), r"Invalid value for '--material': 'up' is not one of 'left', 'right'; "),
    (("--tip-radius", -1), r"--tip-radius is -1: expected a number greater than or equal to 0"),
    (("--tip-radius", "big"), r"Invalid value for '--tip-radius': .*number"),
    (("--scale", 0), r"--scale is 0: expected a number greater than 0"),
    (("--scale", "nan"), r"--scale is nan: expected a finite number"),
    (("--coverage-min", 2), r"Invalid value for '--coverage-min': .*less than or equal to 1"),
    (("--reject-outliers",), r"--reject-outliers: expected false where fit is none: outliers are found by fitting the other points"),
    (("--metod", "exact"), r"No such option: --metod.*--method"),
    (("--out",), r"Option '--out' requires an argument"),
]


@pytest.mark.parametrize(("options", "message"), WRONG_OPTIONS)
def test_a_wrong_option_is_named_with_what_is_allowed(nominal: Path, options: tuple[object, ...], message: str) -> None:
    ended = inspect_oval(nominal, 0.0, *options)
    assert re.match(message, ended.refused())
    assert ended.out == ""


def test_a_second_word_is_a_second_file(nominal: Path) -> None:
    ended = inspect_oval(nominal, 0.0, "further.csv")
    assert ended.refused() == "further.csv: no such file"
    assert "2 files: 1 CONFORM, 1 NOT MEASURED" in ended.out


def test_a_ball_larger_than_the_tightest_hollow_is_taken_and_points_there_are_rejected(tmp_path: Path) -> None:
    nominal, points = peanut(tmp_path)
    told = ("inspect", write_points(tmp_path / "p.csv", points), "--nominal", nominal, *TOLERANCE, "--fit", "none", "--tip-radius")
    assert "taken off twice? Leave out the tip radius of 19.5 mm" in cmmlink(*told, 19.5).refused()  # taken; but these are no ball centres


def test_a_ball_centre_is_judged_by_its_distance_less_the_radius(nominal: Path) -> None:
    facts = inspect_oval(nominal, 2.03, "--tip-radius", 2, "--json").json()
    assert facts["max_deviation_mm"] == pytest.approx(0.03, abs=1e-8)
    assert facts["verdict"] == "conform"


@pytest.mark.parametrize("name", ["file", "file/below"])
def test_a_folder_that_cannot_be_written_is_refused_before_the_run(nominal: Path, name: str) -> None:
    (nominal.parent / "file").write_text("", encoding="utf-8")
    plan = write_plan(nominal, 0.0, PLAN.replace("{type: file, file: points.csv}", "{type: serial, address: no-such-port}"))
    for ended in (inspect_oval(nominal, 0.0, "--out", nominal.parent / name), cmmlink("run", plan, "--out", nominal.parent / name)):
        assert ended.refused().startswith(f"{nominal.parent / name}: the results cannot be written")
    demo = cmmlink("demo", "--headless", "--out", nominal.parent / name)
    assert "choose another folder with --out" in demo.refused()


@pytest.mark.parametrize(
    ("content", "message"), [("", "the file is empty"), ("1,2\n", "1 point; expected at least 4"), ("a b\n", "no line of")]
)
@pytest.mark.parametrize("command", ["nominal", "inspect"])
def test_a_wrong_nominal_is_refused(tmp_path: Path, command: str, content: str, message: str) -> None:
    file = tmp_path / "nominal.csv"
    file.write_text(content, encoding="utf-8")
    points = write_points(tmp_path / "points.csv", oval_points(0.0))
    told = ("nominal", file) if command == "nominal" else ("inspect", points, "--nominal", file, *TOLERANCE)
    assert re.match(re.escape(f"{file}: ") + message, cmmlink(*told).refused())


def test_a_nominal_with_duplicate_points_is_refused_by_line(tmp_path: Path) -> None:
    points = oval_points(0.0)
    file = write_points(tmp_path / "nominal.csv", np.insert(points, 7, points[6], axis=0))
    assert re.match(r".*nominal\.csv: line 9: repeats the point \(.*\) of line 8; ", cmmlink("nominal", file).refused())


def test_a_nominal_of_unknown_format_is_refused_with_the_known_ones(tmp_path: Path) -> None:
    assert re.search(
        r"nominal\.foo: no nominal file is known by the suffix '\.foo'; .*\.csv", cmmlink("nominal", tmp_path / "nominal.foo").refused()
    )


def test_an_open_nominal_needs_its_material_side(tmp_path: Path) -> None:
    x = np.linspace(0, 50, 60)
    wave = np.column_stack([x, 3 * np.sin(x / 8) + 0.02 * x**1.5])
    nominal, points = write_points(tmp_path / "wave.csv", wave), write_points(tmp_path / "points.csv", wave + np.array([0, 0.01]))
    told = ("inspect", points, "--nominal", nominal, *TOLERANCE, "--fit", "none")
    assert "wave.csv: an open profile does not show" in cmmlink(*told).refused()
    assert "--material left or --material right" in cmmlink(*told).refused()
    left, right = cmmlink(*told, "--material", "left", "--json").json(), cmmlink(*told, "--material", "right", "--json").json()
    assert left["min_deviation_mm"] == pytest.approx(-right["max_deviation_mm"], abs=1e-9)
    assert -0.0101 < left["min_deviation_mm"] < left["max_deviation_mm"] < 0  # above the wave, material to its left is above it, too
