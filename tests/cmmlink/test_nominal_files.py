"""Nominal files of every format: the side of the material, and refusals by file and line."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from cmmlink.nominal_files import known_suffixes, load_nominal, material_side
from inspection import NominalError, NurbsCurve
from tests.cmmlink.nominal_files.shapes import BLUNT_LOOP, LOOP, LOWER, QUARTER, UPPER, circle_points, rows, write_text

Array = NDArray[np.float64]


@pytest.mark.parametrize(
    ("points", "side"), [(circle_points(30), "left"), (circle_points(30)[::-1], "right"), (circle_points(30)[:20], None)]
)
def test_material_lies_inside(tmp_path: Path, points: Array, side: str | None) -> None:
    assert material_side(load_nominal(write_text(tmp_path, rows(points), "c.csv")).curve) == side


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
    "unknown suffix": ("a.prt", MANY, "no nominal file is known by the suffix '.prt'; expected one of .asc, .csv, .dat"),
    "no suffix": ("a", MANY, "suffix ''"),
    "yaml key": ("a.yaml", QUARTER + "control_points: []\n", "line 5: control_points is not a known key; did you mean control_points_mm?"),
    "yaml missing": ("a.yaml", QUARTER.replace("degree: 2\n", ""), "degree is missing: expected the degree"),
    "yaml word": ("a.yaml", QUARTER.replace("0.7", "o.7"), "line 4: weights[1] is 'o.7071067811865476'; expected a number"),
    "yaml point of three": ("a.yaml", QUARTER.replace("[1, 1]", "[1, 1, 0]"), "line 3: control_points_mm[1]"),
    "yaml knots": ("a.yaml", QUARTER.replace("[0, 0, 0, 1", "[0, 0, 1"), "3 control points of degree 2 need 6 knots, got 5"),
    "yaml weight": ("a.yaml", QUARTER.replace("[1, 0.7", "[0, 0.7"), "line 4: weights[0] is '0'; expected a number greater than"),
    "yaml not closed": ("a.yaml", QUARTER + "closed: true\n", "a closed curve must end where it begins: the gap is 1.41421 mm"),
    "yaml nearly closed": (
        "a.yaml",
        "degree: 1\nknots: [0, 0, 1, 2, 2]\ncontrol_points_mm: [[0, 0], [10, 5], [0.1, 0]]\n",
        "the curve ends 0.1 mm from where it begins: it may be closed or open; expected closed: false",
    ),
    "yaml bow tie": (
        "a.yaml",
        "degree: 1\nknots: [0, 0, 1, 2, 3, 4, 4]\ncontrol_points_mm: [[0, 0], [4, 3], [4, 0], [0, 3], [0, 0]]\n",
        "the curve crosses or touches itself at (2, 1.5) at stations 2.5 and 10.5 mm",
    ),
    "yaml huge": ("a.yaml", QUARTER.replace("[1, 1]", "[1, 1e99]"), "line 3: control_points_mm[1][1] is '1e99'; expected a number less"),
    "yaml one place": ("a.yaml", QUARTER.replace("[1, 1], [0, 1]", "[1, 0], [1, 0]"), "the control points lie within 0 mm"),
    "yaml list": ("a.yaml", "- 1\n", "line 1: found a list of 1"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_nominal_is_refused_with_file_line_and_finding(tmp_path: Path, case: str) -> None:
    name, content, message = BAD[case]
    path = write_text(tmp_path, content, name)
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
            load_nominal(write_text(tmp_path, MANY, "a.csv"), scale)


def test_formats_are_found_by_looking() -> None:
    read = ".asc .csv .dat .dxf .iges .igs .json .p21 .qif .step .stp .txt .xyz .yaml .yml"
    assert known_suffixes() == read.split()
