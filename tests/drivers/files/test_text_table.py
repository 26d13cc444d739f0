"""Tables of numbers from any text: what is read, on which line, under which names, and what is refused."""

from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from numpy.typing import NDArray

from drivers.errors import PointFileError
from drivers.files.point_file import points_of
from drivers.files.row_reading import shorten
from drivers.files.stated_units import axis_letters
from drivers.files.text_table import count_of, numbers_of, parse_columns, read_bytes, read_text

Array = NDArray[np.float64]
ROWS = [[1.5, -2.25], [3.0, 4.125]]


@example(values=[[-0.5, 0.0, 1.0], [0.0, 1.0, 0.0], [0.5, 0.0, 0.0]], delimiter=",", comma=False, header=[], line_end="\n")
@given(
    values=st.lists(st.lists(st.floats(-1e5, 1e5), min_size=3, max_size=3), min_size=2, max_size=20),
    delimiter=st.sampled_from([",", ";", "\t", " ", "  ", ", ", "; "]),
    comma=st.booleans(),
    header=st.sampled_from([[], ["x", "y", "z"], ["X (mm)", "Y (mm)", "Z (mm)"]]),
    line_end=st.sampled_from(["\n", "\r\n", "\n\n"]),
)
def test_columns_come_back_to_the_bit(values: list[list[float]], delimiter: str, comma: bool, header: list[str], line_end: str) -> None:
    if comma and "," in delimiter:
        delimiter = ";"
    if "," in delimiter and all(value == round(value) for row in values for value in row):
        values[0][0] = 0.5  # whole numbers may be unclear beside commas; repr writes 1.0, but an exponent hides the point
    lines = [delimiter.join(repr(value).replace(".", ",") if comma else repr(value) for value in row) for row in values]
    text = line_end.join(([";".join(header)] if header and delimiter.strip() else []) + lines)
    columns = parse_columns(text)
    np.testing.assert_array_equal(columns.values, values)
    if not columns.names and any(only_counts(columns.values[:, place]) for place in (0, 2)):
        with suppress(PointFileError):  # it is asked for a name, unless another column is constant
            np.testing.assert_array_equal(points_of(columns, 1.0)[0], values)
    else:
        np.testing.assert_array_equal(points_of(columns, 1.0)[0], values)


def only_counts(column: Array) -> bool:
    """Whether a column may be a number or a time: nearly equal steps, or whole numbers that only rise or only fall."""
    steps = np.diff(column)
    is_even = bool(np.ptp(steps) <= 0.1 * np.abs(steps).max() + 8 * np.spacing(np.abs(column).max()))
    return is_even or bool((column == np.round(column)).all() and ((steps > 0).all() or (steps < 0).all()))


def test_every_row_knows_its_line() -> None:
    columns = parse_columns("# a scan\n\nx;y\n1,5;-2,25\n\n3;4,125\n")
    np.testing.assert_array_equal(columns.values, ROWS)
    assert columns.line_numbers.tolist() == [4, 6]
    assert columns.names == ("x", "y")
    assert columns.notes == ("decimal commas",)
    assert not columns.values.flags.writeable


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ("n,x,y\n1,2,3\n4,5,6\n", ("n", "x", "y")),
        ("# x y\n1 2\n3 4\n", ("x", "y")),
        ("my part\n1 2\n3 4\n", ()),  # a title of as many words as there are columns
        ("u;v\n1;2\n3;4\n", ("u", "v")),
        ("1 2\n# x y\n3 4\n", ()),
    ],
)
def test_names_are_those_before_the_data_that_fit(text: str, names: tuple[str, ...]) -> None:
    assert parse_columns(text).names == names


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "no line of numbers in the file"),
        ("1 2\n3 4 5\n", "line 2: 3 columns, line 1 has 2"),
        ("1,5,2,5\n3,5,4,5\n", "line 1: '1,5,2,5' can be read with commas between whole numbers or with decimal commas"),
        ("1,05,2\n", "line 1: '1,05,2' can be read with commas"),
        ("3\n1 2\n3 4\n", "line 1: announces 3 points, but 2 follow"),
        ("1 2\n3 four\n", "line 2: 'four' is not a number; expected numbers with blanks between them and decimal points"),
    ],
)
def test_what_is_unclear_is_refused_with_its_line(text: str, message: str) -> None:
    with pytest.raises(PointFileError) as caught:
        parse_columns(text)
    assert str(caught.value).startswith(message)


@pytest.mark.parametrize(
    ("data", "text"),
    [
        ("\u00b5m\r\n1\r2\n\x1a".encode(), "\u00b5m\n1\n2\n"),
        ("\ufeff1 2\n".encode(), "1 2\n"),
        ("1 2\n".encode("utf-16"), "1 2\n"),
        ("L\u00e4nge\n".encode("latin-1"), "L\u00e4nge\n"),
    ],
)
def test_the_text_of_a_file_is_the_same_in_every_encoding(tmp_path: Path, data: bytes, text: str) -> None:
    path = tmp_path / "table.txt"
    path.write_bytes(data)
    assert read_text(path) == text


def test_what_is_no_text_or_cannot_be_read_names_the_file(tmp_path: Path) -> None:
    path = tmp_path / "scan.bin"
    path.write_bytes(b"1 2\n\x00\n")
    with pytest.raises(PointFileError, match=r"scan\.bin: line 2: not a text file \(byte 0x00\)"):
        read_text(path)
    path.write_bytes(b" \n")
    with pytest.raises(PointFileError, match=r"scan\.bin: the file is empty"):
        read_text(path)
    with pytest.raises(PointFileError, match="cannot be read"):
        read_bytes(Path("a\0b"))


def test_words_for_messages() -> None:
    assert axis_letters(["X [mm]", "y", "width", "z_mm", "xy"]) == ["x", "y", "", "z", ""]
    assert [count_of(1, "point"), count_of(2, "point")] == ["1 point", "2 points"]
    assert shorten("x" * 41) == "x" * 37 + "..."


@pytest.mark.parametrize(
    ("line", "numbers"),
    [
        ("1.000000D+00 -2.5d-1", [1.0, -0.25]),
        ("  1.0 0.0 # TE", [1.0, 0.0]),
        ("1.0 0.0 // edge", [1.0, 0.0]),
        ("1,5 2,25", [1.5, 2.25]),
        ("1,5; 2,25", [1.5, 2.25]),
        ("1.5, .25", [1.5, 0.25]),
        ("-2 3\t-2 3", [-2.0, 3.0, -2.0, 3.0]),
        ("1;2;3", [1.0, 2.0, 3.0]),
        ("12", [12.0]),
        ("# 1 2", []),
        ("1.0 0.0 TE", []),
        ("NACA 0012", []),
        ("", []),
    ],
)
def test_one_line_is_read_as_the_columns_are(line: str, numbers: list[float]) -> None:
    assert numbers_of(line) == numbers
    if len(numbers) > 1:
        assert parse_columns(f"{line}\n{line}").values.tolist() == [numbers, numbers]
