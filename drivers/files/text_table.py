"""A table of numbers from any text: nominals, plans and files of points are read through it.

What a text may look like: two or more columns apart by commas, semicolons, tabs or blanks, with decimal points or decimal
commas, a header, comment lines, a byte order mark, a first line that counts the rows. What it means is settled from the text
itself; where it could mean two things it is refused, with the line.

Functions that take a path name the file in their errors; functions that take text name the line alone.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from drivers.errors import PointFileError

Array = NDArray[np.float64]
Numbered = list[tuple[int, str]]  # line number and what stands on the line

_SNIFFED_LINES = 100
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eEdD][+-]?\d+)?|[+-]?(nan|inf|infinity)", re.IGNORECASE)
_COMMENT = re.compile(r"#(?!N/A|VALUE!|DIV/0!|REF!|NUM!|NAME\?|NULL!)|%|!|//")  # a spreadsheet's error value is no comment
_COMMENT_STARTS = ("#", "%", "!", "/")
AXIS_NAME = re.compile(r"([xyz])(?![a-z0-9])(?:.*?(?<![a-zµ])(mm|cm|m|µm|um|inch|in)[\])]?$)?", re.IGNORECASE)


@dataclass(frozen=True, slots=True, eq=False)
class Columns:
    """Numbers of a text, one row a line.

    values       : (m, c)
    line_numbers : (m,) where each row stands, from 1
    names        : (c,) the header's names of the columns, or none
    notes        : what was understood that the reader of the file may want to know
    """

    values: Array
    line_numbers: NDArray[np.int64]
    names: tuple[str, ...]
    notes: tuple[str, ...]

    def __post_init__(self) -> None:
        self.values.setflags(write=False)
        self.line_numbers.setflags(write=False)


def read_text(path: Path) -> str:
    """Read the text of a file in UTF-8, UTF-16 with a byte order mark, or Latin-1. Raises PointFileError, also when it is no text."""
    data = read_bytes(path)
    try:
        text = data.decode("utf-16" if data[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("latin-1")
    text = text.replace("\r\n", "\n").replace("\r", "\n").rstrip("\x1a\0")  # the end marks of old systems
    strange = re.search(r"[\x00-\x08\x0e-\x1f\x7f]", text)
    if strange:
        line = text.count("\n", 0, strange.start()) + 1
        raise PointFileError(f"{path}: line {line}: not a text file (byte {ord(strange[0]):#04x}); expected plain text")
    if not text.strip():
        raise PointFileError(f"{path}: the file is empty")
    return text


def read_bytes(path: Path) -> bytes:
    """Read a regular file as it is. Raises PointFileError where there is none, or where it cannot be read."""
    try:
        if path.is_dir():
            raise PointFileError(f"{path}: is a folder; expected a file")
        if path.exists() and not path.is_file():
            raise PointFileError(f"{path}: is not a regular file")
        return path.read_bytes()
    except FileNotFoundError:
        raise PointFileError(f"{path}: no such file") from None
    except (OSError, ValueError) as error:  # ValueError: a NUL in the path, and PointFileError
        if isinstance(error, PointFileError):
            raise
        raise PointFileError(f"{path}: cannot be read: {error}") from None


def parse_columns(text: str) -> Columns:
    """Read columns of numbers, at least two, from a text. Raises PointFileError, naming the line."""
    header, data, comment = _split_lines(text)
    if not data:
        raise PointFileError("no line of numbers in the file; expected two or three columns of numbers")
    reading = _find_reading(data)
    notes: list[str] = []
    data = _drop_count(data, reading, notes)
    values = _values(data, reading)
    columns = values.shape[1]
    _refuse_unclear_commas(data, reading, columns)
    if reading.decimal == ",":
        notes.append("decimal commas")
    names = _names(header, comment, reading, columns)
    understood = 1 if header and {"x", "y"} <= set(axis_letters(names)) else 0
    notes += [f"line {number} taken as a header: '{shorten(line)}'" for number, line in header[: len(header) - understood]]
    return Columns(values, np.array([number for number, _ in data], dtype=np.int64), names, tuple(notes))


def axis_letters(names: Sequence[str]) -> list[str]:
    """Return which axis each name of a column is: x, y, z, or nothing."""
    axes = [AXIS_NAME.match(name) for name in names]
    return [axis[1].lower() if axis else "" for axis in axes]


def shorten(text: str) -> str:
    """Return at most 40 characters of a text, for a message."""
    return text if len(text) <= 40 else text[:37] + "..."


def count_of(count: int, noun: str) -> str:
    """Return a count with its noun in the right number: 1 point, 2 points."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


@dataclass(frozen=True, slots=True)
class _Reading:
    """One way to read a line: what stands between the columns (None: blanks), and the decimal mark."""

    delimiter: str | None
    decimal: str

    def fields(self, line: str) -> list[str]:
        """Split a line into its columns; a delimiter at the very end begins no further column."""
        fields = [field.strip() for field in line.split(self.delimiter)]
        return fields[:-1] if len(fields) > 1 and not fields[-1] else fields

    def is_number(self, field: str) -> bool:
        if self.decimal == ",":
            field = "?" if "." in field else field.replace(",", ".")
        return _NUMBER.fullmatch(field) is not None

    def explains(self, line: str) -> bool:
        fields = self.fields(line)
        return len(fields) > 1 and all(map(self.is_number, fields))

    def row(self, number: int, line: str) -> list[float]:
        """Return the numbers of a line. Raises PointFileError, naming what is none."""
        fields = self.fields(line)
        for column, field in enumerate(fields, 1):
            if not self.is_number(field):
                found = f"'{shorten(field)}' is not a number" if field else f"column {column} is empty"
                raise PointFileError(f"line {number}: {found}; expected numbers {self}")
        return [float(field.replace(",", ".").replace("d", "e").replace("D", "e")) for field in fields]

    def __str__(self) -> str:
        between = {None: "blanks", "\t": "tabs", ";": "semicolons", ",": "commas"}[self.delimiter]
        return f"with {between} between them and decimal {'commas' if self.decimal == ',' else 'points'}"


# In order of preference where several explain as many lines: a semicolon or a tab is never part of a number.
_READINGS = tuple(_Reading(*marks) for marks in ((";", "."), (";", ","), ("\t", "."), ("\t", ","), (",", "."), (None, "."), (None, ",")))


def _split_lines(text: str) -> tuple[Numbered, Numbered, Numbered]:
    """Split a text into header lines, lines of data, and the last comment before the data, which may name the columns."""
    header: Numbered = []
    data: Numbered = []
    comment: Numbered = []
    for number, raw in enumerate(text.split("\n"), 1):
        line = raw.strip()
        remark = _COMMENT.match(line) if line[:1] in _COMMENT_STARTS else None
        if remark:
            comment = comment if data else [(number, line[remark.end() :].lstrip("#%!/ "))]
        elif line and (data or not _is_header(line)):
            data.append((number, line.split(" #")[0].rstrip() if " #" in line else line))
        elif line:
            header.append((number, line))
    return header, data, comment


def _values(data: Numbered, reading: _Reading) -> Array:
    """Return the numbers (m, c) of the lines. numpy reads plain files; what it cannot read is looked at line by line."""
    if reading.decimal == ".":
        try:
            return np.loadtxt([line for _, line in data], delimiter=reading.delimiter, comments=None, ndmin=2)
        except ValueError:
            pass
    rows = [reading.row(number, line) for number, line in data]
    first = len(rows[0])
    for (number, _), row in zip(data, rows, strict=True):
        if len(row) != first:
            raise PointFileError(
                f"line {number}: {count_of(len(row), 'column')}, line {data[0][0]} has {first}; expected as many on every line"
            )
    return np.array(rows)


def _is_header(line: str) -> bool:
    """Tell whether a line is a header: its first word is no number, and at most half of its words are (a damaged row has more)."""
    words = [word for word in re.split(r"[;,\t ]+", line) if word]
    numbers = [_NUMBER.fullmatch(word) is not None for word in words]
    return line[0] != "#" and re.search(r"[^\W\d_]", line) is not None and not numbers[0] and 2 * sum(numbers) <= len(numbers)


def _find_reading(data: Numbered) -> _Reading:
    """Find the reading that explains most of the first lines. Raises PointFileError when none explains any."""
    sample = [line for _, line in data[:_SNIFFED_LINES]]
    score = {reading: sum(map(reading.explains, sample)) for reading in _READINGS}
    best = max(_READINGS, key=lambda reading: score[reading])
    if score[best]:
        return best
    number, line = data[0]
    if re.fullmatch(_NUMBER, line) or re.fullmatch(r"[+-]?\d+,\d+", line):
        raise PointFileError(f"line {number}: one column ('{shorten(line)}'); expected two or three: x, y and perhaps z")
    raise PointFileError(f"line {number}: '{shorten(line)}' is not a row of numbers; expected two or three columns of numbers")


def _drop_count(data: Numbered, reading: _Reading, notes: list[str]) -> Numbered:
    """Drop a first line that counts the points (pts and xyz files), and refuse a file that holds another number of them."""
    number, line = data[0]
    if len(data) < 2 or not line.isdecimal() or not reading.explains(data[1][1]):
        return data
    if int(line) != len(data) - 1:
        raise PointFileError(f"line {number}: announces {line} points, but {len(data) - 1} follow; expected the whole file")
    notes.append(f"line {number} counts the points")
    return data[1:]


def _refuse_unclear_commas(data: Numbered, reading: _Reading, columns: int) -> None:
    """Refuse lines like 1,5,2,5, which may be four whole numbers or two with decimal commas."""
    if reading.delimiter != "," or any("." in line or "e" in line.lower() for _, line in data):
        return
    for number, line in data:
        if (columns > 3 and columns % 2 == 0) or re.search(r"(?<!\d)0\d", line):
            raise PointFileError(
                f"line {number}: '{shorten(line)}' can be read with commas between whole numbers or with decimal commas; "
                "expected decimal points, or semicolons between the numbers"
            )


def _names(header: Numbered, comment: Numbered, reading: _Reading, columns: int) -> tuple[str, ...]:
    """Return the names of the columns: the last header line or the last comment before the data, when one fits.

    Words apart by blanks are names only if x and y are among them; else they are a title of as many words.
    """
    for _, line in header[-1:] + comment:
        for delimiter in (reading.delimiter, ";", "\t", ",", None):
            names = [name.strip().strip("\"'") for name in line.split(delimiter)]
            if len(names) == columns and {"x", "y"} <= set(axis_letters(names)):
                return tuple(names)
    names = [name.strip() for name in header[-1][1].split(reading.delimiter)] if header and reading.delimiter else []
    return tuple(names) if len(names) == columns else ()
