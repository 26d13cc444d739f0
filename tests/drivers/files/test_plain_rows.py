"""Long files of plain numbers: read as a stream, and never otherwise than with care."""

import io
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from drivers.errors import PointFileError
from drivers.files import column_choice, plain_rows, text_table
from drivers.files.decimal_rows import decimal_rows
from drivers.files.plain_rows import read_plain_rows
from drivers.files.point_file import read_points
from drivers.files.text_table import Columns, parse_columns, read_plain, read_text

ROWS = 320
FORMS = [(",", "."), (";", "."), (";", ","), ("\t", "."), ("\t", ","), (None, "."), (None, ","), ("|", ".")]
HEADERS = [
    "", "x,y,z\n", "x;y;z\n", "x\ty\tz\n", "# scan of \u00e4 part, in mm\n", "scan 7\nx y z\nmm mm mm\n", "name,x,y\n", "320\n",
    "321\n", "\n\n",
]  # fmt: skip
ODD = [
    "", " ", "\t", "nan", "-inf", "1e", "1e5", "d", "#", "%", "!", "//", '"', "|", ";", ",", ".", "-", "\u2212", "\x1a", "\x0c", "\r", "\n",
    "\n\n", "\n \n", "\n\t\n", "END\n", "\n# remark\n", "\n,,\n", "\n1\n", "\n1,2\n", "inch", "\u00e4", "\x00", "1.#QNAN",
    "\n5 5 5\n", " 7", "_",
    "+",
]  # fmt: skip


@pytest.fixture(autouse=True)
def _short_beginning(monkeypatch: pytest.MonkeyPatch) -> None:
    """The beginning that is understood line by line ends after 150 to 280 of the rows."""
    monkeypatch.setattr(text_table, "_HEAD_BYTES", 4096)
    monkeypatch.setattr(text_table, "_ROWS_AT_ONCE", 50)
    monkeypatch.setattr(plain_rows, "_CHUNK", 2000)


def rows_of(seed: int, columns: int, whole: bool = False) -> list[list[str]]:
    values = np.random.default_rng(seed).normal(0, 30, (ROWS, columns))
    return [[f"{value:.0f}" if whole else f"{value:.5g}" for value in row] for row in values.tolist()]


def text_of(rows: list[list[str]], form: tuple[str | None, str], header: str) -> str:
    delimiter, decimal = form
    return header + "".join((delimiter or "  ").join(row).replace(".", decimal) + "\n" for row in rows)


def same(plain: Columns, careful: Columns) -> bool:
    np.testing.assert_array_equal(plain.values.view(np.int64), careful.values.view(np.int64), strict=True)
    np.testing.assert_array_equal(plain.line_numbers, careful.line_numbers, strict=True)
    return (plain.names, plain.notes, plain.units) == (careful.names, careful.notes, careful.units)


@pytest.mark.parametrize("form", FORMS[:-1])
@pytest.mark.parametrize("ends", ["\n", "\r\n"])
@pytest.mark.parametrize("mark", [b"", b"\xef\xbb\xbf"])
@pytest.mark.parametrize("header", ["", "x,y,z\n", "# scan of \u00e4 part\nx y z\nmm mm mm\n"])
def test_a_plain_file_is_read_as_a_stream(tmp_path: Path, form: tuple[str | None, str], ends: str, mark: bytes, header: str) -> None:
    path = tmp_path / "points.csv"
    rows = rows_of(1, 3)
    rows[7], rows[300] = ["nan"] * 3, ["1e-3", "-0.0", "+inf"]
    for last in (ends, ""):
        path.write_bytes(mark + text_of(rows, form, header).strip("\n").replace("\n", ends).encode() + last.encode())
        plain = read_plain(path)
        assert plain is not None
        assert plain.values.shape == (ROWS, 3)
        assert same(plain, parse_columns(read_text(path)))


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    form=st.sampled_from(FORMS),
    header=st.sampled_from(HEADERS),
    columns=st.integers(2, 4),
    whole=st.booleans(),
    places=st.sampled_from([(), (0, 1), (1, 2), (5, 6)]),
    changes=st.lists(st.tuples(st.floats(0, 1), st.sampled_from(ODD) | st.binary(min_size=1, max_size=2)), max_size=2),
    encoding=st.sampled_from(["utf-8", "utf-8-sig", "latin-1", "utf-16"]),
)
def test_whatever_a_long_file_holds_it_is_read_as_a_stream_only_where_care_gives_the_same(
    tmp_path: Path,
    form: tuple[str | None, str],
    header: str,
    columns: int,
    whole: bool,
    places: tuple[int, ...],
    changes: list[tuple[float, str | bytes]],
    encoding: str,
) -> None:
    content = text_of(rows_of(columns, columns, whole), form, header).encode(encoding)
    for share, change in changes:
        at = int(share * len(content))
        content = content[:at] + (change if isinstance(change, bytes) else change.encode(encoding, "ignore")) + content[at:]
    path = tmp_path / "points.csv"
    path.write_bytes(content)
    plain = read_plain(path, places)
    assert plain is None or same(plain, parse_columns(read_text(path), places))


def test_what_is_no_long_file_is_read_with_care(tmp_path: Path) -> None:
    (tmp_path / "short.csv").write_text("1,2\n3,4\n" * 50)
    assert [read_plain(tmp_path / name) for name in ("short.csv", "missing.csv", "", "a\0b")] == [None] * 4


@pytest.mark.parametrize("odd", ["# remark", "1,2", "1,2,3,4", "1,2,END", "", "1,2,\u00e4", "1,,3", "1,2,0x1"])
@pytest.mark.parametrize("at", [30, 150, 299, 320])
def test_a_text_too_long_to_be_read_with_care_is_refused_by_its_first_odd_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, odd: str, at: int
) -> None:
    rows = [",".join(row) for row in rows_of(5, 3)]
    path = tmp_path / "points.csv"
    path.write_text("\n".join(["x,y,z", *rows[:at], odd, *rows[at:], ""]), encoding="utf-8")
    monkeypatch.setattr(text_table, "_LARGEST_WITH_CARE", 5000)
    with pytest.raises(
        PointFileError, match=rf"points.csv: line {at + 2} \('.*'\) is no row of plain numbers.* save the points as an npy file"
    ):
        read_points(path)
    path.write_text("\n".join(["x,y,z", *rows]), encoding="utf-8")
    assert len(read_points(path).points_mm) == ROWS


@pytest.mark.parametrize("columns", [3, 4, 6])
@pytest.mark.parametrize("counts", ["nothing", "first", "last", "from the middle on"])
def test_columns_without_names_are_found_alike_by_the_beginning_and_by_all(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, columns: int, counts: str
) -> None:
    values = np.array(rows_of(6, columns), dtype=np.float64)
    values[:20] = np.nan
    values[:, 3:] /= np.linalg.norm(values[:, 3:], axis=1, keepdims=True) if columns == 6 else 1.0
    first, place = {"first": (0, 0), "last": (0, -1), "from the middle on": (160, 0), "nothing": (ROWS, 0)}[counts]
    values[first:, place] = np.arange(ROWS - first)
    np.savetxt(path := tmp_path / "points.csv", values, delimiter=",")

    def told() -> object:
        try:
            found = read_points(path)
            return found.points_mm.tobytes(), found.notes
        except PointFileError as error:
            return str(error)

    expected = told()
    monkeypatch.setattr(column_choice, "_BEGINNING", 30)
    assert told() == expected


def test_an_array_is_not_held_beside_its_points(tmp_path: Path) -> None:
    np.save(path := tmp_path / "points.npy", np.sin(np.arange(3e6)).reshape(-1, 3))
    read_points(path)
    tracemalloc.start()
    found = read_points(path).points_mm
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 24 * len(found) + 14e6 < 2 * 24 * len(found), "the points, and a piece of the array"


def test_a_long_file_takes_no_more_memory_than_its_numbers(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(plain_rows, "_CHUNK", 1 << 16)
    peaks, rows = [], (2_000, 20_000, 200_000)
    for count in rows:
        file = io.BytesIO(b"-12.345678,9.8765432\n" * count)
        tracemalloc.start()
        assert read_plain_rows(file, ",", ".").shape == (count, 2)
        peaks.append(tracemalloc.get_traced_memory()[1] - 16 * count)
        tracemalloc.stop()
    assert peaks[2] < 0.5 * 16 * rows[2] + 2e6


def test_plain_decimal_numbers_go_through_the_quick_way_alone_and_every_line_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """A line with a power sends the piece that it lies in, and no other, through the careful way."""
    read, careful = [], []
    quick, numbers = decimal_rows, plain_rows._numbers

    def count_quick(text: bytes, delimiter: str | None) -> object:
        read.append(text)
        return quick(text, delimiter)

    def count_careful(lines: list[str], delimiter: str | None) -> object:
        careful.append(len(lines))
        return numbers(lines, delimiter)

    monkeypatch.setattr(plain_rows, "decimal_rows", count_quick)
    monkeypatch.setattr(plain_rows, "_numbers", count_careful)
    lines = [b"%d.5,-%d" % (i, i * i) for i in range(2000)]
    for odd, ways in ((b"1200.5,-1440000", 0), (b"1200.5,-1.44e6", 1)):
        lines[1200] = odd
        read.clear()
        found = read_plain_rows(io.BytesIO(b"\r\n".join(lines)), ",", ".")
        assert b"".join(read) == b"\n".join(lines) + b"\n"
        assert len(read) > 10
        assert len(careful) == ways
        np.testing.assert_array_equal(found, [[i + 0.5, -i * i] for i in range(2000)])
    assert careful[0] < 200
