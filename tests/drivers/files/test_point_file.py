"""Files of points: every form that means the same gives the same points; everything unclear is refused by line."""

import io
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from drivers.errors import PointFileError
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


BAD: dict[str, tuple[str | bytes, str]] = {
    "empty": ("", "the file is empty"),
    "blank": (" \n\n", "the file is empty"),
    "words": ("hello\nworld\n", "no line of numbers"),
    "binary": (b"\x89PNG\r\n\x1a\n\x00\x00\x00\rIHDR", "line 2: not a text file (byte 0x1a)"),
    "NUL": (b"1 2\n3 \x00 4\n", "line 2: not a text file (byte 0x00)"),
    "one column": ("1.5\n2.5\n", "line 1: one column ('1.5'); expected two or three"),
    "one point": ("x,y\n1.5,2.5\n", "1 point; expected at least two"),
    "NaN": ("1 2\nnan 4\n", "line 2: nan is not a finite number"),
    "NaN first": ("NaN;0;0\n1;2;3\n", "line 1: nan is not a finite number"),
    "infinite": ("1,2\n3,-inf\n", "line 2: -inf is not a finite number"),
    "overflow": ("1 2\n3 1e999\n", "line 2: inf is not a finite number"),
    "huge": ("1 2\n3 1e9\n", "line 2: 1e+09 is larger than 1e+06 mm"),
    "letter for a digit": ("1 2 3\n4 5 6\n\n7 8.O 9\n", "line 4: '8.O' is not a number"),
    "first row damaged": ("O.5 1 2\n1 2 3\n", "line 1: 'O.5' is not a number"),
    "spreadsheet error": ("#N/A;1\n2;3\n4;5\n", "line 1: '#N/A' is not a number"),
    "underscore": ("1_000 2\n3 4\n", "line 1: '1_000' is not a number"),
    "short line": ("1 2 3\n4 5 6\n7 8\n", "line 3: 2 columns, line 1 has 3"),
    "long line": ("1,2.5\n4,5.5\n7,8.5,9\n", "line 3: 3 columns, line 1 has 2"),
    "gap": ("1;2;3\n4;;6\n", "line 2: column 2 is empty"),
    "words at the end": ("1 2\n3 4\nend of scan\n", "line 3: 'end' is not a number"),
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
    "inches": ("x [inch],y [inch]\n1.5,2\n4,5\n", "the header gives x in inch; expected mm: give the scale 25.4"),
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
def test_column_names_of_other_units_are_refused_with_the_scale(name: str, factor: float) -> None:
    with pytest.raises(PointFileError, match=f"expected mm: give the scale {factor:g}$"):
        points_of(parse_columns(f"n;y;{name}\n7;2;1.5\n8;4;3.5\n"), 1.0)


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
        (np.array([[1.0, 2.0], [np.nan, 2.0]]), "row 1: nan is not a finite number"),
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
        assert np.isfinite(points).all()


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
