"""One table in a file of its own, as csv or xlsx by the ending of its name."""

from collections.abc import Iterable, Mapping
from pathlib import Path

from cmmlink.exports.csv_tables import write_csv_table
from cmmlink.exports.tables import Cell
from cmmlink.exports.workbook import write_sheets


def write_table(name: str, columns: Mapping[str, str], rows: Iterable[Mapping[str, Cell]], path: Path, created: str) -> None:
    """Write a table: as a workbook, with what its columns mean, where the name of the file ends in .xlsx. Raises OSError.

    created : the moment that stands in the properties of a workbook (ISO 8601)
    """
    if path.suffix.lower() == ".xlsx":
        write_sheets([(name, columns, rows)], path, created)
    else:
        write_csv_table(path, columns, rows)
