"""CSV: three tables beside each other, of runs, characteristics and points; UTF-8 with a mark, decimal points, ISO times."""

import csv
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np

from cmmlink.csv_rows import Texts, write_rows
from cmmlink.deviations_csv import point_columns
from cmmlink.exports.measured_part import MeasuredPart
from cmmlink.exports.neutral_text import neutral
from cmmlink.exports.tables import CHARACTERISTIC_COLUMNS, POINT_COLUMNS, RUN_COLUMNS, Cell, characteristic_rows, run_rows, sections_of
from cmmlink.result_files import NewFiles

_MARK = b"\xef\xbb\xbf"  # by which spreadsheets know UTF-8


def write_csv(parts: Sequence[MeasuredPart], files: NewFiles, stem: str) -> None:
    """Write STEM.csv with one row a run, STEM-characteristics.csv and STEM-points.csv."""
    write_csv_table(files(f"{stem}.csv"), RUN_COLUMNS, run_rows(parts))
    write_csv_table(files(f"{stem}-characteristics.csv"), CHARACTERISTIC_COLUMNS, characteristic_rows(parts))
    _write_points(files(f"{stem}-points.csv"), parts)


def write_csv_table(path: Path, columns: Mapping[str, str], rows: Iterable[Mapping[str, Cell]]) -> None:
    """Write one table, as spreadsheets read it."""
    with path.open("w", newline="", encoding="utf-8-sig") as file:
        writer = csv.writer(file)
        writer.writerow(columns)
        writer.writerows([_cell(row.get(name)) for name in columns] for row in rows)


def _cell(value: Cell) -> str:
    """A cell: text without harm, and numbers with all their digits."""
    if value is None:
        return ""
    return neutral(value) if isinstance(value, str) else repr(value)


def _write_points(path: Path, parts: Sequence[MeasuredPart]) -> None:
    with path.open("wb") as file:
        file.write(_MARK + (",".join(POINT_COLUMNS) + "\r\n").encode())
        for row, _, section in sections_of(parts):
            words, first = ["", section.document.get("chain_sha256") or ""], 0
            for rows in section.blocks():
                codes = (np.arange(first, first + rows.received) == 0).astype(np.int64)
                write_rows(file, [np.full(rows.received, row), *point_columns(rows, first), Texts(codes, words)])
                first += rows.received
