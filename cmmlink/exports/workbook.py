"""XLSX: a workbook with a sheet of runs, one of characteristics, as many of points as they need, and one that says what the columns mean.

It is written row by row, so its size needs no memory; the same run gives the same bytes.
"""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from cmmlink.deviations_csv import POINT_WORDS, word_codes
from cmmlink.exports.measured_part import MeasuredPart
from cmmlink.exports.neutral_text import neutral
from cmmlink.exports.tables import CHARACTERISTIC_COLUMNS, POINT_COLUMNS, RUN_COLUMNS, Cell, characteristic_rows, run_rows, sections_of
from cmmlink.result_files import NewFiles
from inspection import JudgedRows

if TYPE_CHECKING:
    from xlsxwriter import Workbook

MOST_ROWS = 1_048_576  # of a sheet, its head included
_SHEETS = (("runs", RUN_COLUMNS), ("characteristics", CHARACTERISTIC_COLUMNS), ("points", POINT_COLUMNS))
_WIDTH = 14  # of a column, in digits


def write_xlsx(parts: Sequence[MeasuredPart], files: NewFiles, stem: str, most_rows: int = MOST_ROWS) -> None:
    """Write STEM.xlsx. Raises OSError where it cannot be written.

    most_rows : of a sheet, its head included; points beyond it go on in a sheet of their own
    """
    with _new_book(files(f"{stem}.xlsx"), parts[0].text("measured_at"), _hashes(parts)) as book:
        _write_table(book, "runs", RUN_COLUMNS, run_rows(parts))
        _write_table(book, "characteristics", CHARACTERISTIC_COLUMNS, characteristic_rows(parts))
        _write_points(book, parts, most_rows)
        _write_meanings(book, _SHEETS)


def write_sheets(sheets: Sequence[tuple[str, Mapping[str, str], Iterable[Mapping[str, Cell]]]], path: Path, created: str) -> None:
    """Write a workbook of tables: the name of each, what its columns mean, and its rows. Raises OSError where it cannot be written.

    created : the moment that stands in its properties (ISO 8601): the same tables give the same bytes
    """
    with _new_book(path, created, "") as book:
        for name, columns, rows in sheets:
            _write_table(book, name, columns, rows)
        _write_meanings(book, [(name, columns) for name, columns, _ in sheets])


@contextmanager
def _new_book(path: Path, created: str, comments: str) -> "Iterator[Workbook]":
    from xlsxwriter import Workbook  # noqa: PLC0415 - loaded when it serves
    from xlsxwriter.exceptions import FileCreateError  # noqa: PLC0415

    options = {"constant_memory": True, "strings_to_formulas": False, "strings_to_urls": False, "use_zip64": True, "tmpdir": path.parent}
    try:
        with Workbook(str(path), options) as book:
            book.set_properties({"created": datetime.fromisoformat(created), "comments": comments})
            yield book
    except FileCreateError as error:
        raise error.args[0] from None  # the OSError that it wraps


def _write_meanings(book: "Workbook", sheets: Iterable[tuple[str, Mapping[str, str]]]) -> None:
    meanings = ({"sheet": sheet, "column": name, "meaning": said} for sheet, columns in sheets for name, said in columns.items())
    _write_table(book, "columns", ("sheet", "column", "meaning"), meanings)


def _hashes(parts: Sequence[MeasuredPart]) -> str:
    """The hashes of the records, for the properties of the file."""
    return "\n".join(f"run {part.run}, chain_sha256 {part.chain_sha256}" for part in parts if part.run)


class _Sheet:
    """A sheet with its head, to which rows are added."""

    def __init__(self, book: "Workbook", name: str, columns: Iterable[str]) -> None:
        self._sheet = book.add_worksheet(name)
        self._row = 0
        names = list(columns)
        self._sheet.freeze_panes(1, 0)
        self._sheet.set_column(0, len(names) - 1, _WIDTH)
        self.add(names)

    @property
    def rows(self) -> int:
        """How many rows it has, its head included."""
        return self._row

    def add(self, values: Iterable[Cell]) -> None:
        """Add a row; a cell is left empty for None, NaN and empty text."""
        for column, value in enumerate(values):
            if isinstance(value, str):
                if value:
                    self._sheet.write_string(self._row, column, neutral(value))
            elif value is not None and not math.isnan(value):
                self._sheet.write_number(self._row, column, value)
        self._row += 1


def _write_table(book: "Workbook", name: str, columns: Iterable[str], rows: Iterable[Mapping[str, Cell]]) -> None:
    names = list(columns)
    sheet = _Sheet(book, name, names)
    for row in rows:
        sheet.add(row.get(column) for column in names)


def _write_points(book: "Workbook", parts: Sequence[MeasuredPart], most_rows: int) -> None:
    sheet, sheets = _Sheet(book, "points", POINT_COLUMNS), 1
    for row, _, section in sections_of(parts):
        chain, first = section.document.get("chain_sha256") or "", 0
        for rows in section.blocks():
            for index, point in enumerate(_point_rows(rows), start=first):
                if sheet.rows == most_rows:
                    sheets += 1
                    sheet = _Sheet(book, f"points {sheets}", POINT_COLUMNS)
                sheet.add((row, index, *point, "" if index else chain))
            first += rows.received


def _point_rows(rows: JudgedRows) -> Iterable[list[Any]]:
    """What stands in the columns of each point."""
    numbers = np.column_stack([rows.actual_mm, rows.station_mm, rows.foot_mm, rows.deviation_mm])
    return ([*values, POINT_WORDS[code]] for values, code in zip(numbers.tolist(), word_codes(rows).tolist(), strict=True))
