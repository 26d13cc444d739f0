"""Long files of plain numbers: read as a stream, and never otherwise than with care."""

import io
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from drivers.files import text_table
from drivers.files.plain_rows import read_plain_rows
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


def test_a_long_file_takes_no_more_memory_than_its_numbers() -> None:
    peaks, rows = [], (2_000, 20_000, 200_000)
    for count in rows:
        file = io.BytesIO(b"-12.345678,9.8765432\n" * count)
        tracemalloc.start()
        assert read_plain_rows(file, ",", ".").shape == (count, 2)
        peaks.append(tracemalloc.get_traced_memory()[1] - 16 * count)
        tracemalloc.stop()
    assert peaks[2] < 0.5 * 16 * rows[2] + 2e6
