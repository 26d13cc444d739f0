"""Files of points: every form that means the same gives the same points; everything unclear is refused by line."""

import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from drivers.errors import PointFileError
from drivers.files.column_choice import AxisName
from drivers.files.point_file import PointFileSource, points_of, read_points
from drivers.files.text_table import parse_columns
from drivers.source import PointBatch, ScanClosed, ScanOpened

Array = NDArray[np.float64]

POINTS = np.array([[1.5, -2.25, 0.5], [3.0, 4.125, 0.5], [1e-3, 100.0, -0.25]])

SAME = {
    "commas": "1.5,-2.25,0.5\n3,4.125,0.5\n1e-3,100,-0.25\n",
    "commas and blanks": "1.5, -2.25, 0.5\n3, 4.125, 0.5\n1e-3, 100, -0.25\n",
    "comma at the end": "1.5,-2.25,0.5,\n3,4.125,0.5,\n1e-3,100,-0.25,\n",
    "semicolons": "1.5;-2.25;0.5\n3;4.125;0.5\n1e-3;100;-0.25",
    "decimal commas": "1,5;-2,25;0,5\n3;4,125;0,5\n1e-3;100;-0,25\n",
    "decimal commas and blanks": "1,5 -2,25 0,5\n3 4,125 0,5\n1e-3 100 -0,25\n",
    "decimal commas and tabs": "1,5\t-2,25\t0,5\n3\t4,125\t0,5\n0,001\t100\t-0,25\n",
    "tabs": "1.5\t-2.25\t0.5\n3\t4.125\t0.5\n1e-3\t100\t-0.25\n",
    "blanks in columns": "  1.5   -2.25  0.5\n  3.0    4.125 0.5\n  0.001  100.0  -.25\n",
    "Fortran exponents": "1.5D0 -2.25D+00 5D-1\n3. 4.125 0.5\n1d-3 1.0d2 -0.25\n",
    "carriage returns": "1.5,-2.25,0.5\r\n3,4.125,0.5\r\n1e-3,100,-0.25\r\n",
    "old line ends": "1.5,-2.25,0.5\r3,4.125,0.5\r1e-3,100,-0.25\r",
    "end mark": "1.5,-2.25,0.5\n3,4.125,0.5\n1e-3,100,-0.25\n\x1a",
    "byte order mark": "\ufeff1.5,-2.25,0.5\n3,4.125,0.5\n1e-3,100,-0.25\n",
    "header": "x,y,z\n1.5,-2.25,0.5\n3,4.125,0.5\n1e-3,100,-0.25\n",
    "header with units": "X [mm];Y [mm];Z [mm]\n1,5;-2,25;0,5\n3;4,125;0,5\n1e-3;100;-0,25\n",
    "quoted header": '"x_mm","y_mm","z_mm"\n1.5,-2.25,0.5\n3,4.125,0.5\n1e-3,100,-0.25\n',
    "title": "Scan of blade 12\n\n1.5 -2.25 0.5\n3 4.125 0.5\n1e-3 100 -0.25\n",
    "comments": "# a scan\n# x y z\n1.5 -2.25 0.5\n% half way\n3 4.125 0.5 # turn\n\n// last\n1e-3 100 -0.25\n",
    "count of points": "3\n1.5 -2.25 0.5\n3 4.125 0.5\n1e-3 100 -0.25\n",
    "normals behind": "1.5 -2.25 0.5 0 0 1\n3 4.125 0.5 0 1 0\n1e-3 100 -0.25 1 0 0\n",
    "index in front": "index,x_mm,y_mm,z_mm\n0,1.5,-2.25,0.5\n1,3,4.125,0.5\n2,1e-3,100,-0.25\n",
    "axes in another order": "z y x\n0.5 -2.25 1.5\n0.5 4.125 3\n-0.25 100 1e-3\n",
    "names in a comment": "# z y x\n0.5 -2.25 1.5\n0.5 4.125 3\n-0.25 100 1e-3\n",
}


def written(folder: Path, content: str | bytes, name: str = "points.csv") -> Path:
    path = folder / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


@pytest.mark.parametrize("form", SAME)
def test_every_form_means_the_same_points(tmp_path: Path, form: str) -> None:
    np.testing.assert_array_equal(read_points(written(tmp_path, SAME[form])).points_mm, POINTS)


def test_encodings_mean_the_same_points(tmp_path: Path) -> None:
    text = "X-L\u00e4nge;Y;Z in mm\n" + SAME["decimal commas"]
    for encoding in ("utf-8", "utf-8-sig", "utf-16", "latin-1"):
        np.testing.assert_array_equal(read_points(written(tmp_path, text.encode(encoding))).points_mm, POINTS)


def test_two_columns_lie_at_height_zero_and_scale_multiplies(tmp_path: Path) -> None:
    points = read_points(written(tmp_path, "1,2\n3,4.5\n"), scale=25.4).points_mm
    np.testing.assert_array_equal(points, np.array([[1, 2, 0], [3, 4.5, 0]]) * 25.4)


def test_whole_numbers_apart_by_commas_are_columns(tmp_path: Path) -> None:
    np.testing.assert_array_equal(read_points(written(tmp_path, "1,2,3\n4,5,6\n")).points_mm, [[1, 2, 3], [4, 5, 6]])


def test_what_was_left_out_is_said(tmp_path: Path) -> None:
    assert read_points(written(tmp_path, SAME["commas"])).notes == ()
    assert read_points(written(tmp_path, SAME["index in front"])).notes == ("columns left out: index",)
    assert read_points(written(tmp_path, SAME["normals behind"])).notes == ("the first three of 6 columns taken as x, y, z",)
    assert read_points(written(tmp_path, SAME["decimal commas"])).notes == ("decimal commas",)
    assert read_points(written(tmp_path, SAME["title"])).notes == ("line 1 taken as a header: 'Scan of blade 12'",)
    assert read_points(written(tmp_path, SAME["count of points"])).notes == ("line 1 counts the points",)


WITHOUT_NUMBERS = {
    "nan": "nan nan nan",
    "one nan": "3 NaN 0.5",
    "infinite": "3 -inf 0.5",
    "overflow": "3 1e999 0.5",
    "spreadsheet": "#N/A #N/A #N/A",
    "spreadsheet in German": "#NV #WERT! 3",
    "spreadsheet in Spanish": "#\u00a1VALOR! #N/D #\u00bfNOMBRE?",
    "spreadsheet in French": "3 #VALEUR! 0.5",
    "division": "#DIV/0! 4 #DIV/0!",
    "number error": "#NUM! #NUM! #NUM!",
    "old runtime": "1.#QNAN -1.#IND000 1.#INF",
    "new runtime": "-nan(ind) nan(snan) nan",
    "words": "invalid ERR n.a.",
    "one word": "3 missing 0.5",
    "dashes": "--- --- ---",
    "null": "NULL NULL NULL",
}


@pytest.mark.parametrize("form", WITHOUT_NUMBERS)
@pytest.mark.parametrize("row", [0, 1, 2])
def test_rows_without_numbers_stay_rows_and_are_counted(tmp_path: Path, form: str, row: int) -> None:
    rows = ["1.5 -2.25 0.5", "3 4.125 0.5"]
    rows.insert(row, WITHOUT_NUMBERS[form])
    file = read_points(written(tmp_path, "\n".join(rows)))
    np.testing.assert_array_equal(np.delete(file.points_mm, row, axis=0), POINTS[:2])
    assert np.isnan(file.points_mm[row]).all()
    assert file.notes == ("1 row without numbers: rejected",)


@pytest.mark.parametrize("empty", ["17,,,", "17,nan,nan,nan", "17,#N/A,#N/A,#N/A"])
def test_a_row_with_its_number_alone_holds_no_point(tmp_path: Path, empty: str) -> None:
    file = read_points(written(tmp_path, f"n,x,y,z\n16,1.5,-2.25,0.5\n{empty}\n18,3,4.125,0.5\n"))
    np.testing.assert_array_equal(file.points_mm[[0, 2]], POINTS[:2])
    assert np.isnan(file.points_mm[1]).all()


@pytest.mark.parametrize("delimiter", [",", ";", "|"])
def test_empty_fields_are_no_numbers_and_empty_rows_at_the_ends_are_none(tmp_path: Path, delimiter: str) -> None:
    rows = ["", "", "1.5,-2.25,0.5", ",,", "3,,0.5", "3,4.125,", "3,4.125,0.5", ",,", ",,"]
    file = read_points(written(tmp_path, "x,y,z\n".replace(",", delimiter) + "\n".join(rows).replace(",", delimiter) + "\n"))
    np.testing.assert_array_equal(file.points_mm[[0, 4]], POINTS[:2])
    assert np.isnan(file.points_mm[1:4]).all()
    assert len(file.points_mm) == 5
    assert set(file.notes) == {"3 rows without numbers: rejected", "2 empty rows at the ends left out"}


@pytest.mark.parametrize("words", ["END", "*** end of file ***", "end of scan"])
def test_words_behind_the_last_row_are_left_out_and_noted(tmp_path: Path, words: str) -> None:
    file = read_points(written(tmp_path, f"1.5 -2.25 0.5\n3 4.125 0.5\n0.001 100 -0.25\n\n{words}\n"))
    np.testing.assert_array_equal(file.points_mm, POINTS)
    assert file.notes == (f"line 5, behind the last row, left out: '{words}'",)


PLAIN = {
    "minus signs": "1.5 \u22122.25 0.5\n3 4.125 0.5\n0.001 100 \u22120.25\n",
    "remarks of percent": "1.5 -2.25 0.5 % p0\n3 4.125 0.5 % p1\n0.001 100 -0.25 % p2\n",
    "bars": "| x | y | z |\n|---|---|---|\n| 1.5 | -2.25 | 0.5 |\n| 3 | 4.125 | 0.5 |\n| 0.001 | 100 | -0.25 |\n",
    "quoted header": '"x","y","z"\n1.5,-2.25,0.5\n3,4.125,0.5\n0.001,100,-0.25\n',
    "quoted everywhere": '"x","y","z"\n"1.5","-2.25","0.5"\n"3","4.125","0.5"\n"0.001","100","-0.25"\n',
    "quoted with decimal commas": '"x","y","z"\n"1,5","-2,25","0,5"\n"3","4,125","0,5"\n"0,001","100","-0,25"\n',
    "label": "name,x,y,z\npt1,1.5,-2.25,0.5\npt2,3,4.125,0.5\npt3,0.001,100,-0.25\n",
    "labels on both sides": "name;feature;x;y;z;note\np1;LE;1.5;-2.25;0.5;a\np2;TE;3;4.125;0.5;\np3;TE;0.001;100;-0.25;b c\n",
    "two labels and two blanks": "name feature x y z\np1 LE 1.5 -2.25 0.5\np2 TE 3 4.125 0.5\np3 TE 0.001 100 -0.25\n",
    "labels as many as numbers": "# name feature more x y z\np1 LE a 1.5 -2.25 0.5\np2 TE a 3 4.125 0.5\np3 TE a 0.001 100 -0.25\n",
    "remarks without a blank": "1.5 -2.25 0.5# p0\n3 4.125 0.5# p1\n0.001 100 -0.25#p2\n",
    "other remarks": "1.5 -2.25 0.5 // p0\n3 4.125 0.5! p1\n0.001 100 -0.25 ! p2\n",
    "row of units": "X,Y,Z\nmm,mm,mm\n1.5,-2.25,0.5\n3,4.125,0.5\n0.001,100,-0.25\n",
    "row of units in brackets": "n;X;Y;Z\n-;[mm];[mm];[mm]\n1;1.5;-2.25;0.5\n2;3;4.125;0.5\n3;0.001;100;-0.25\n",
    "vectors": "XYZIJK    METRIC\n1.5,-2.25,0.5,0,0,1\n3,4.125,0.5,0,1,0\n0.001,100,-0.25,1,0,0\n",
    "millimetres in words": "# Units: millimeters\n1.5 -2.25 0.5\n3 4.125 0.5\n0.001 100 -0.25\n",
}


@pytest.mark.parametrize("form", PLAIN)
def test_plain_files_are_read(tmp_path: Path, form: str) -> None:
    np.testing.assert_array_equal(read_points(written(tmp_path, PLAIN[form])).points_mm, POINTS)


INCHES = {
    "vectors": "XYZIJK\n1.5,-2.25,0.5,0,0,1\n3,4.125,0.5,0,1,0\n0.001,100,-0.25,1,0,0\n",
    "remark": "# Units: inch\nx,y,z\n1.5,-2.25,0.5\n3,4.125,0.5\n0.001,100,-0.25\n",
    "sentence": "% all dimensions are in inches\n1.5 -2.25 0.5\n3 4.125 0.5\n0.001 100 -0.25\n",
    "short": "# unit = in\n1.5 -2.25 0.5\n3 4.125 0.5\n0.001 100 -0.25\n",
    "header": "UNITS,INCH\n1.5,-2.25,0.5\n3,4.125,0.5\n0.001,100,-0.25\n",
    "title": "Blade 12 (inches)\n1.5 -2.25 0.5\n3 4.125 0.5\n0.001 100 -0.25\n",
    "row of units": "n,X,Y,Z\n,in,in,in\n1,1.5,-2.25,0.5\n2,3,4.125,0.5\n3,0.001,100,-0.25\n",
    "columns": "X_inches;Y_inches;Z_inches\n1.5;-2.25;0.5\n3;4.125;0.5\n0.001;100;-0.25\n",
    "behind": "1.5 -2.25 0.5\n3 4.125 0.5\n0.001 100 -0.25\n# units: inches\n",
}


@pytest.mark.parametrize("form", INCHES)
def test_a_unit_stated_in_words_is_taken_and_said_and_one_that_is_given_goes_above_it(tmp_path: Path, form: str) -> None:
    path = written(tmp_path, INCHES[form])
    as_stated = read_points(path)
    np.testing.assert_array_equal(as_stated.points_mm, POINTS * 25.4)
    assert len([note for note in as_stated.notes if note.endswith(": read in inch")]) == 1
    np.testing.assert_array_equal(read_points(path, unit="inch").points_mm, POINTS * 25.4)
    np.testing.assert_array_equal(read_points(path, scale=25.4).points_mm, POINTS * 25.4)
    as_mm = read_points(path, unit="mm")
    np.testing.assert_array_equal(as_mm.points_mm, POINTS)
    assert "read in mm, as asked" in as_mm.notes
    assert any("not followed, since unit mm was asked for" in note for note in as_mm.notes)


@pytest.mark.parametrize(
    "words", ["# 2 inch blade, lot 7", "# coordinates in file order", "# in the order of the scan", "Scan in memory of m", "# foot 3 of 12"]
)
def test_words_that_state_no_unit_are_none(tmp_path: Path, words: str) -> None:
    np.testing.assert_array_equal(read_points(written(tmp_path, f"{words}\n{SAME['blanks in columns']}")).points_mm, POINTS)


def test_two_units_in_one_file_are_asked_about(tmp_path: Path) -> None:
    with pytest.raises(PointFileError, match="line 1 states inch, but line 2 states mm; expected one unit: give the unit"):
        read_points(written(tmp_path, "# units: inch\n# values in mm\n1.5 2\n3 4\n"))


def test_a_unit_beside_a_scale_is_refused(tmp_path: Path) -> None:
    with pytest.raises(PointFileError, match="unit inch and scale 2 are both given; expected one of them"):
        read_points(written(tmp_path, "1.5 2\n3 4\n"), 2.0, unit="inch")


COUNTED = {
    "from 101": ("101 303.8 179.2 60\n102 304.1 178.7 60\n103 305 178.1 60\n", "the first column counts the rows (101, 102, 103 ...)"),
    "steps of ten": ("10 303.8 179.2 60\n20 304.1 178.7 60\n30 305 178.1 60\n", "the first column counts the rows (10, 20, 30 ...)"),
    "falling": ("9 303.8 179.2 60\n8 304.1 178.7 60\n7 305 178.1 60\n", "the first column counts the rows (9, 8, 7 ...)"),
    "with holes": ("1 303.8 179.2 60\n2 304.1 178.7 60\n7 305 178.1 60\n", "the first column counts the rows (1, 2, 7 ...)"),
    "number, x, y": ("1 303.8 179.2\n2 304.1 178.7\n3 305 178.1\n", "the first of three columns counts the rows or the time (1, 2, 3 ...)"),
    "time, x, y": ("0.00 303.8 179.2\n0.01 304.1 178.7\n0.02 305 178.1\n", "the first of three columns counts the rows or the time"),
    "x, y, number": ("303.8 179.2 1\n304.1 178.7 2\n305 178.1 3\n", "the last of three columns counts the rows or the time (1, 2, 3 ...)"),
    "time, x, y, z": (
        "0,303.8,179.2,60\n0.3,304.1,178.7,60\n0.4,305,178.1,60\n",
        "4 columns without names: which of them are x, y and z?",
    ),
    "colours": ("1.5 2 3 255 0 0\n2.5 2 3 9 0 0\n3.7 1 3 8 8 8\n", "6 columns without names: which of them are x, y and z?"),
}


@pytest.mark.parametrize("case", COUNTED)
def test_columns_that_count_or_are_unknown_are_asked_about(tmp_path: Path, case: str) -> None:
    text, message = COUNTED[case]
    path = written(tmp_path, text)
    with pytest.raises(PointFileError) as caught:
        read_points(path)
    assert f"{path}: {message}" in str(caught.value)
    assert "(columns x=" in str(caught.value)
    x, y = (3, 2) if case == "colours" else (2, 1) if case == "x, y, number" else (3, 2)
    file = read_points(path, columns={"y": x, "x": y})
    table = parse_columns(text).values
    np.testing.assert_array_equal(file.points_mm, np.column_stack([table[:, y - 1], table[:, x - 1], np.zeros(3)]))


def test_a_profile_at_even_x_and_one_height_is_no_count(tmp_path: Path) -> None:
    np.testing.assert_array_equal(
        read_points(written(tmp_path, "1 3.8 5\n2 4.1 5\n3 5 5\n")).points_mm, [[1, 3.8, 5], [2, 4.1, 5], [3, 5, 5]]
    )


def test_a_line_below_the_names_is_no_row(tmp_path: Path) -> None:
    np.testing.assert_array_equal(read_points(written(tmp_path, "x y\n--- ---\n1 3.8\n2 4.1\n")).points_mm, [[1, 3.8, 0], [2, 4.1, 0]])


def test_a_label_without_a_header_is_told_what_to_do(tmp_path: Path) -> None:
    path = written(tmp_path, "pt1,1.5,2,3\npt2,2.5,2,4\n")
    with pytest.raises(PointFileError, match=r"'pt1.*name,x,y,z"):
        read_points(path)
    np.testing.assert_array_equal(read_points(path, columns={"x": 2, "y": 3}).points_mm, [[1.5, 2, 0], [2.5, 2, 0]])


@pytest.mark.parametrize("columns", [{"x": 2}, {"x": 2, "y": 2}, {"x": 0, "y": 1}, {"x": 1, "q": 2}, {"x": 1, "y": 9}])
def test_columns_that_are_not_there_are_refused(tmp_path: Path, columns: dict[AxisName, int]) -> None:
    np.save(tmp_path / "a.npy", np.ones((4, 4)))
    for path in (written(tmp_path, "1 2.5 3\n2 3.5 1\n"), tmp_path / "a.npy"):
        with pytest.raises(PointFileError, match="expected"):
            read_points(path, columns=columns)


def test_two_named_axes_are_those_axes(tmp_path: Path) -> None:
    file = read_points(written(tmp_path, "n;z;x\n7;2;1.5\n8;4;3.5\n"))
    np.testing.assert_array_equal(file.points_mm, [[1.5, 0, 2], [3.5, 0, 4]])
    assert file.notes == ("no column y: taken as 0", "columns left out: n")


BAD: dict[str, tuple[str | bytes, str]] = {
    "empty": ("", "the file is empty"),
    "blank": (" \n\n", "the file is empty"),
    "words": ("hello\nworld\n", "no line of numbers"),
    "binary": (b"\x89PNG\r\n\x1a\n\x00\x00\x00\rIHDR", "line 2: not a text file (byte 0x1a)"),
    "NUL": (b"1 2\n3 \x00 4\n", "line 2: not a text file (byte 0x00)"),
    "one column": ("1.5\n2.5\n", "line 1: one column ('1.5'); expected two or three"),
    "one point": ("x,y\n1.5,2.5\n", "1 point; expected at least two"),
    "nothing but NaN": ("nan 2\nnan 4\n", "no row holds numbers for all coordinates"),
    "huge": ("1 2\n3 1e9\n", "line 2: 1e+09 is larger than 1e+06 mm"),
    "letter for a digit": ("1 2 3\n4 5 6\n\n7 8.O 9\n", "line 4: '8.O' is not a number"),
    "first row damaged": ("O.5 1 2\n1 2 3\n", "line 1: 'O.5' is not a number"),
    "underscore": ("1_000 2\n3 4\n", "line 1: '1_000' is not a number"),
    "short line": ("1 2 3\n4 5 6\n7 8\n", "line 3: 2 columns, line 1 has 3"),
    "long line": ("1,2.5\n4,5.5\n7,8.5,9\n", "line 3: 3 columns, line 1 has 2"),
    "a letter in place of a number": ("1,2,3\n4,x,6\n7,8,9\n", "line 2: 'x' is not a number"),
    "a number and words at the end": ("1 2\n3 4\n2 points\n", "line 3: 'points' is not a number"),
    "times without a name": ("12:00:00;1.5;2.5;3.5\n12:00:01;2.5;3.5;4.5\n", "say which are x and y (columns x=2,y=3)"),
    "thousands": ("1.234,5;2\n1.000,5;4\n", "line 1: '1.234,5;2' is not a row of numbers"),
    "unclear commas, four columns": (
        "1,5,2,5\n1,2,3,4\n",
        "line 1: '1,5,2,5' can be read with commas between whole numbers or with decimal commas",
    ),
    "unclear commas, three columns": ("1,5,2\n1,05,3\n", "line 2: '1,05,3' can be read"),
    "cut short": ("4\n1 2 3\n4 5 6\n7 8 9\n", "line 1: announces 4 points, but 3 follow"),
    "index without a name": ("0 1.5 2.5 3.5\n1 2.5 3.5 4.5\n2 3.5 4.5 5.5\n", "the first column counts the rows"),
    "other names": ("a;b;c\n1;2;3\n4;5;6\n", "the header names no columns x and y: a, b, c"),
    "two x": ("x,y,x\n1.5,2,3\n4,5,6\n", "more than one column x"),
    "two units": ("x [inch],y [mm]\n1.5,2\n4,5\n", "the header gives y in mm, but the header gives x in inch; expected one unit"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_file_is_refused_with_file_line_and_finding(tmp_path: Path, case: str) -> None:
    content, message = BAD[case]
    path = written(tmp_path, content)
    with pytest.raises(PointFileError) as caught:
        read_points(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert message in str(caught.value)
    assert "expected" in str(caught.value) or "empty" in message


def test_missing_file_and_folder_are_refused(tmp_path: Path) -> None:
    with pytest.raises(PointFileError, match=r"none\.csv: no such file"):
        read_points(tmp_path / "none.csv")
    with pytest.raises(PointFileError, match="is a folder; expected a file"):
        read_points(tmp_path)


@pytest.mark.parametrize("scale", [0.0, -1.0, float("nan"), float("inf")])
def test_scale_must_be_a_positive_number(tmp_path: Path, scale: float) -> None:
    with pytest.raises(PointFileError, match="scale must be a positive number"):
        read_points(written(tmp_path, SAME["commas"]), scale)


@pytest.mark.parametrize("name", ["x", "X", "x_mm", "X [mm]", "x(mm)", "x in mm", "X-Wert", "x pos"])
def test_column_names_of_millimetres(name: str) -> None:
    points, _ = points_of(parse_columns(f"n;y;{name}\n7;2;1.5\n8;4;3.5\n"), 1.0)
    np.testing.assert_array_equal(points, [[1.5, 2, 0], [3.5, 4, 0]])


@pytest.mark.parametrize(
    ("name", "factor"), [("x_m", 1000), ("X [cm]", 10), ("x(um)", 0.001), ("x [\u00b5m]", 0.001), ("x in", 25.4), ("X inch", 25.4)]
)
def test_column_names_of_other_units_are_followed_and_said(name: str, factor: float) -> None:
    points, notes = points_of(parse_columns(f"n;y;{name}\n7;2;1.5\n8;4;3.5\n"), 1.0)
    np.testing.assert_allclose(points, np.array([[1.5, 2, 0], [3.5, 4, 0]]) * factor, rtol=1e-15)
    assert [note for note in notes if note.startswith("the header gives") and ": read in " in note]


def test_unit_in_the_header_is_taken_with_a_scale(tmp_path: Path) -> None:
    points = read_points(written(tmp_path, "x_in y_in\n1 2\n3 4\n"), scale=25.4).points_mm
    np.testing.assert_array_equal(points, np.array([[1, 2, 0], [3, 4, 0]]) * 25.4)


@pytest.mark.parametrize("dtype", ["<f8", ">f8", "<f4", "<i4"])
def test_npy_gives_the_array(tmp_path: Path, dtype: str) -> None:
    values = np.array([[1, 2, 3], [4, 5, 6]], dtype=dtype)
    np.save(tmp_path / "a.npy", values)
    np.testing.assert_array_equal(read_points(tmp_path / "a.npy", scale=0.5).points_mm, values.astype(float) * 0.5)
    np.save(tmp_path / "b.npy", np.asfortranarray(values[:, :2]))
    np.testing.assert_array_equal(read_points(tmp_path / "b.npy").points_mm, np.column_stack([values[:, :2], [0, 0]]))


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (np.zeros(4), "shape \\(4,\\); expected numbers of shape"),
        (np.zeros((4, 4)), "shape \\(4, 4\\)"),
        (np.array([["a", "b"], ["c", "d"]]), "expected numbers of shape"),
        (np.array([[np.nan, 2.0], [np.nan, 2.0]]), "no row holds numbers for all coordinates"),
        (np.array([[1.0, 2.0]]), "1 point; expected at least two"),
        (np.array([[1j, 2.0], [3.0, 4.0]]), "complex128 array"),
        (np.array([[1.0, 1e300], [3.0, 4.0]]), "row 0: 1e\\+300 is larger than"),
    ],
)
def test_bad_npy_is_refused(tmp_path: Path, values: Array, message: str) -> None:
    np.save(tmp_path / "a.npy", values)
    with pytest.raises(PointFileError, match=message):
        read_points(tmp_path / "a.npy")


def test_npy_with_objects_or_cut_short_is_refused(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", np.array([[{}, []], [1, 2]], dtype=object), allow_pickle=True)
    whole = io.BytesIO()
    np.save(whole, np.ones((100, 3)))
    for name, content in (
        ("a.npy", None),
        ("b.npy", whole.getvalue()[:-8]),
        ("c.npy", whole.getvalue()[:50]),
        ("d.npy", b"PK\x03\x04"),
        ("e.npy", b""),
    ):
        path = written(tmp_path, content, name) if content is not None else tmp_path / name
        with pytest.raises(PointFileError, match=f"{name}: (not a readable npy file|the file is empty)"):
            read_points(path)


def test_source_yields_opening_batches_and_closing(tmp_path: Path) -> None:
    values = np.random.default_rng(3).normal(size=(2500, 3))
    np.save(tmp_path / "scan.npy", values)
    opened, *batches, closed = PointFileSource(tmp_path / "scan.npy", batch_points=1024).arrivals()
    assert opened == ScanOpened(device="file scan.npy", serial_number="", expected=2500)
    assert closed == ScanClosed(sent=2500)
    assert all(isinstance(batch, PointBatch) for batch in batches)
    rows = [batch for batch in batches if isinstance(batch, PointBatch)]
    assert [len(batch) for batch in rows] == [1024, 1024, 452]
    np.testing.assert_array_equal(np.concatenate([batch.sequence for batch in rows]), np.arange(2500))
    np.testing.assert_array_equal(np.concatenate([batch.points_mm for batch in rows]), values)
    assert not np.concatenate([batch.time_s for batch in rows]).any()


def test_stopped_source_ends_without_closing(tmp_path: Path) -> None:
    np.save(tmp_path / "scan.npy", np.ones((10, 2)))
    source = PointFileSource(tmp_path / "scan.npy", batch_points=4)
    arrivals = source.arrivals()
    assert isinstance(next(arrivals), ScanOpened)
    assert isinstance(next(arrivals), PointBatch)
    source.stop()
    source.stop()
    assert list(arrivals) == []


def test_source_refuses_a_bad_file_before_it_begins(tmp_path: Path) -> None:
    with pytest.raises(PointFileError, match="no such file"):
        PointFileSource(tmp_path / "none.csv")
    with pytest.raises(ValueError, match="at least one point"):
        PointFileSource(written(tmp_path, SAME["commas"]), batch_points=0)


NUMBERS_AND_NOISE = st.text(alphabet="0123456789.,;- \t\n+eExyznai#/%_'\u00e4\u0661", max_size=80)


def read_or_refused(path: Path) -> None:
    """Either usable points come back, or the one named error that names the file."""
    message = None
    try:
        points = read_points(path).points_mm
    except PointFileError as error:
        message = str(error)
    if message is not None:
        assert message.startswith(f"{path}: ")
    else:
        assert points.shape == (len(points), 3)
        assert len(points) >= 2
        whole = np.isfinite(points).all(axis=1)
        assert whole.any()
        assert np.isnan(points[~whole]).all()


@settings(max_examples=400, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(content=st.one_of(st.binary(max_size=80), NUMBERS_AND_NOISE.map(str.encode)))
@example(content=b"\xff\xfe1")
@example(content=b"1 2\n3 4\n" * 300 + b"x")
def test_hostile_text_is_read_or_refused(tmp_path: Path, content: bytes) -> None:
    read_or_refused(written(tmp_path, content))


@settings(max_examples=300, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(header=st.binary(max_size=60), cut=st.integers(0, 200), place=st.integers(0, 127), byte=st.integers(0, 255))
@example(header=b"(" * 60, cut=200, place=0, byte=0x93)
@example(header=b"'\\d'", cut=200, place=0, byte=0x93)
def test_hostile_npy_is_read_or_refused(tmp_path: Path, header: bytes, cut: int, place: int, byte: int) -> None:
    whole = io.BytesIO()
    np.save(whole, np.ones((4, 3)))
    damaged = bytearray(whole.getvalue())
    damaged[place] = byte
    made_up = b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header
    for content in (bytes(damaged[:cut]), made_up, b"\x93NUMPY" + header):
        read_or_refused(written(tmp_path, content, "a.npy"))


@pytest.mark.parametrize("form", ["text", "npy"])
def test_values_that_mean_no_point_are_rows_without_numbers(tmp_path: Path, form: str) -> None:
    rows = np.array([[1.5, 2.0, 0.0], [-9999.0, -9999.0, -9999.0], [3.0, 4.5, 0.0], [5.0, 0.25, 32767.0], [6.0, -9999.5, 0.0]])
    path = tmp_path / ("points.npy" if form == "npy" else "points.csv")
    if form == "npy":
        np.save(path, rows)
    else:
        path.write_text("x,y,z\n" + "".join(",".join(map(str, row)) + "\n" for row in rows) + "nan,nan,nan\n", encoding="utf-8")
    file = read_points(path, invalid=(-9999.0, 32767.0, 7.0))
    there = [0, 2, 4]
    np.testing.assert_array_equal(file.points_mm[there], rows[there])
    assert np.isnan(file.points_mm[[1, 3]]).all()
    counted = [note for note in file.notes if "means no point" in note]
    assert [note.split(",")[0] for note in counted] == ["1 row holds -9999", "1 row holds 32767", "0 rows hold 7"]
    assert ("1 row without numbers: rejected" in file.notes) == (form == "text")


def test_a_unit_or_a_scale_that_was_asked_for_goes_above_what_the_file_states_and_says_so(tmp_path: Path) -> None:
    path = written(tmp_path, "# units: inch\n1 2\n3 4.5\n")
    assert read_points(path, unit="um").notes == ("read in um, as asked", "line 1 states inch: not followed, since unit um was asked for")
    assert read_points(path, 2.0).notes == ("line 1 states inch: not followed, since scale 2 was asked for",)
    assert read_points(path, 25.4).notes == ()


@pytest.mark.parametrize("kind", ["csv", "npy"])
def test_a_file_gone_through_in_pieces_gives_the_same_points_and_notes(kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    values = np.sin(np.arange(300.0)).reshape(100, 3)
    values[[7, 40, 99], 1], values[[3, 77], 2] = np.nan, -9999.0
    path = tmp_path / f"points.{kind}"
    if kind == "npy":
        np.save(path, values)
    else:
        path.write_text("\n".join(",".join(map(str, row)) for row in values.tolist()), encoding="utf-8")
    whole = read_points(path, unit="inch", invalid=[-9999.0])
    asked: list[tuple[int, ...]] = []

    def room(shape: tuple[int, ...], kind: type[np.generic]) -> Any:
        asked.append(shape)
        return np.empty(shape, kind)

    monkeypatch.setattr("drivers.files.point_file._ROWS_AT_ONCE", 7)
    pieces = read_points(path, unit="inch", invalid=[-9999.0], room=room)
    assert (100, 3) in asked
    assert (
        pieces.notes
        == whole.notes
        == ("read in inch, as asked", "2 rows hold -9999, which means no point: rejected", "3 rows without numbers: rejected")
    )
    np.testing.assert_array_equal(pieces.points_mm, whole.points_mm)
    assert np.flatnonzero(np.isnan(whole.points_mm).all(axis=1)).tolist() == [3, 7, 40, 77, 99]
    assert whole.points_mm[50].tolist() == (25.4 * values[50]).tolist()
