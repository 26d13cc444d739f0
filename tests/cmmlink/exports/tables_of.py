"""Workbooks and tables as a program without spreadsheet libraries reads them."""

import csv
import re
import zipfile
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

_N = "{http://schemas.openxmlformats.org/spreadsheetml/2006/main}"


def sheets_of(path: Path) -> dict[str, list[dict[str, Any]]]:
    """The rows of each sheet by the names in its head; numbers as numbers, and empty cells left out."""
    with zipfile.ZipFile(path) as book:
        names = [sheet.get("name") for sheet in ElementTree.fromstring(book.read("xl/workbook.xml")).iter(f"{_N}sheet")]
        found = {}
        for number, name in enumerate(names, start=1):
            rows = list(ElementTree.fromstring(book.read(f"xl/worksheets/sheet{number}.xml")).iter(f"{_N}row"))
            assert not any(row.iter(f"{_N}f") is None or list(row.iter(f"{_N}f")) for row in rows), "a formula"
            head, *others = [{_column(cell): _value(cell) for cell in row} for row in rows]
            found[str(name)] = [{head[column]: value for column, value in row.items()} for row in others]
        return found


def table_of(path: Path) -> list[dict[str, str]]:
    """The rows of a table by the names in its head; empty cells left out."""
    content = path.read_bytes()
    assert content.startswith(b"\xef\xbb\xbf")
    rows = csv.DictReader(content.decode("utf-8-sig").splitlines())
    return [{name: value for name, value in row.items() if value} for row in rows]


def _column(cell: ElementTree.Element) -> str:
    return re.sub(r"\d", "", cell.get("r") or "")


def _value(cell: ElementTree.Element) -> Any:
    if cell.get("t") == "inlineStr":
        return "".join(text.text or "" for text in cell.iter(f"{_N}t"))
    value = cell.find(f"{_N}v")
    return None if value is None else float(value.text or "nan")
