"""A table of numbers from any text: nominals, plans and files of points are read through it.

What a text may look like: two or more columns apart by commas, semicolons, tabs or blanks, with decimal points or decimal
commas, a header, a row of units, comment lines, a byte order mark, a first line that counts the rows, quoted fields, words in
columns that are not asked for, rows without numbers. What it means is settled from the text itself; where it could mean two
things it is refused, with the line.

Functions that take a path name the file in their errors; functions that take text name the line alone.
"""

import csv
import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from drivers.errors import PointFileError
from drivers.files.no_numbers import is_no_number, name_errors
from drivers.files.plain_rows import Room, read_plain_rows
from drivers.files.row_reading import HINT, NUMBER, READINGS, Reading, number_of, shorten
from drivers.files.stated_units import StatedUnit, axis_letters, units_of_lines, units_of_row

Array = NDArray[np.float64]
Numbered = list[tuple[int, str]]  # line number and what stands on the line

_SNIFFED_LINES = 100
_ROWS_AT_ONCE = 1 << 16
_HEAD_BYTES = 1 << 16  # of a long file, from which it is understood what its rows are
_LARGEST_WITH_CARE = 256 << 20  # bytes of text: 3 to 4 GB of memory while it is read
_UTF_16 = (b"\xff\xfe", b"\xfe\xff")
_UTF_8 = b"\xef\xbb\xbf"
_STRANGE = re.compile(r"[\x00-\x08\x0e-\x1f\x7f]")
_COMMENT = re.compile(r"#|%|!|//")
_COMMENT_STARTS = ("#", "%", "!", "/")
_REMARK = re.compile(r"(?<!\s)\s*(?:#|!|//).*")  # behind the numbers of a row; blanks are looked through once, from their first on
_PERCENT_REMARK = re.compile(r"(?<=\d)\s+%\s.*")  # of rows alone: in words, a percent sign follows its number
_COUNT = re.compile(r"\d{1,12}")  # a longer number counts nothing
_UNDERLINE = re.compile(r"[-=+|\s]+")
_VECTOR_NAMES = tuple("xyzijk")


@dataclass(frozen=True, slots=True, eq=False)
class Columns:
    """Numbers of a text, one row a line.

    values       : (m, c); NaN where a row holds no number
    line_numbers : (m,) where each row stands, from 1
    names        : (c,) the header's names of the columns, or none
    notes        : what was understood that the reader of the file may want to know
    units        : what the text states of its unit in remarks, header lines and a row of units; the names are not among them
    """

    values: Array
    line_numbers: NDArray[np.int64]
    names: tuple[str, ...]
    notes: tuple[str, ...]
    units: tuple[StatedUnit, ...] = ()

    def __post_init__(self) -> None:
        self.values.setflags(write=False)
        self.line_numbers.setflags(write=False)


def read_text(path: Path) -> str:
    """Read the text of a file in UTF-8, UTF-16 with a byte order mark, or Latin-1. Raises PointFileError, also when it is no text."""
    text = _decode(read_bytes(path)).rstrip("\x1a\0")  # the end marks of old systems
    strange = _STRANGE.search(text)
    if strange:
        line = text.count("\n", 0, strange.start()) + 1
        raise PointFileError(f"{path}: line {line}: not a text file (byte {ord(strange[0]):#04x}); expected plain text")
    if not text.strip():
        raise PointFileError(f"{path}: the file is empty")
    return text


def _decode(data: bytes) -> str:
    try:
        text = data.decode("utf-16" if data[:2] in _UTF_16 else "utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("latin-1")
    return text.replace("\u2212", "-").replace("\r\n", "\n").replace("\r", "\n")


def read_bytes(path: Path, most: int = -1) -> bytes:
    """Read a regular file as it is, or its first bytes. Raises PointFileError where there is none, or where it cannot be read."""
    try:
        if path.is_dir():
            raise PointFileError(f"{path}: is a folder; expected a file")
        if path.exists() and not path.is_file():
            raise PointFileError(f"{path}: is not a regular file")
        if not path.stat().st_size:
            return b""  # what the system makes while it is read has no size, and may have no end
        with path.open("rb") as file:
            return file.read(most)
    except FileNotFoundError:
        raise PointFileError(f"{path}: no such file") from None
    except (OSError, ValueError) as error:  # ValueError: a NUL in the path, and PointFileError
        if isinstance(error, PointFileError):
            raise
        raise PointFileError(f"{path}: cannot be read: {error}") from None


def parse_columns(text: str, places: Collection[int] = ()) -> Columns:
    """Read columns of numbers, at least two, from a text. Raises PointFileError, naming the line.

    places : columns (from 0) whose numbers are wanted; words in the others do no harm. None: those that the header names x, y and z
    """
    header, data, remarks, wanted = _split_lines(text, tuple(sorted(places)))
    if not data:
        raise PointFileError("no line of numbers in the file; expected two or three columns of numbers")
    reading, wanted = _find_reading(data, wanted)
    notes: list[str] = []
    data = _drop_count(_without_edges(data, reading, bool(wanted), notes), reading, notes)
    values = _values(data, reading, wanted)
    _refuse_unclear_commas(data, reading, values.shape[1])
    return _columns(values, np.array([number for number, _ in data], dtype=np.int64), header, remarks, reading, notes)


def read_plain(path: Path, places: Collection[int] = (), room: Room = np.empty) -> Columns | None:
    """Read the columns of a long file of plain numbers, as `parse_columns` does, but without its text ever being held as a whole.

    What its rows are, and everything above them, is understood from its beginning. None where anything in it has to be read with care.

    room : gives the arrays of a long file, like numpy.empty
    """
    try:
        return _read_plain(path, places, room) if path.is_file() and path.stat().st_size > _HEAD_BYTES else None
    except (OSError, ValueError):  # PointFileError is a ValueError
        return None


def refuse_long_text(path: Path, places: Collection[int], room: Room) -> None:
    """Raise PointFileError where a text that has to be read with care is too long to be held as a whole."""
    try:
        if not path.is_file() or path.stat().st_size <= _LARGEST_WITH_CARE:
            return
        _read_plain(path, places, room)
    except ValueError as error:
        told = f"a text of more than {_LARGEST_WITH_CARE >> 20} MB is read only where all its rows are plain numbers, as many on every line"
        raise PointFileError(f"{path}: {error}; {told}. Mend it there, or save the points as an npy file") from None
    except OSError:
        return  # whoever reads it says why


def _read_plain(path: Path, places: Collection[int], room: Room) -> Columns:
    """Read a file of plain numbers. Raises ValueError where it is none."""
    with path.open("rb") as file:
        head, end, _ = file.read(_HEAD_BYTES).rpartition(b"\n")
        head += end
        header, data, remarks, reading = _understand(head, tuple(sorted(places)))
        first = data[0][0]
        above = b"".join(head.splitlines(keepends=True)[: first - 1])
        file.seek(len(above) if above or not head.startswith(_UTF_8) else len(_UTF_8))
        values = read_plain_rows(file, reading.delimiter, reading.decimal, room, first)
    line_numbers = room((len(values),), np.int64)
    for begin in range(0, len(values), _ROWS_AT_ONCE):
        line_numbers[begin : begin + _ROWS_AT_ONCE] = np.arange(first + begin, first + min(begin + _ROWS_AT_ONCE, len(values)))
    return _columns(values, line_numbers, header, remarks, reading, [])


def _understand(head: bytes, places: tuple[int, ...]) -> tuple[Numbered, Numbered, Numbered, Reading]:
    """Header lines, lines of data and remarks at the beginning of a file, and how its rows are read.

    Raises ValueError where that may depend on what follows.
    """
    text = _decode(head)
    if head[:2] in _UTF_16 or _STRANGE.search(text) or head.count(b"\r") != head.count(b"\r\n"):
        raise ValueError("an unusual text")
    header, data, remarks, wanted = _split_lines(text, places)
    if len(data) < _SNIFFED_LINES or _COUNT.fullmatch(data[0][1]):
        raise ValueError("too few rows, or their number")
    reading, _ = _find_reading(data, wanted)
    if not _has_points_or_powers(data, reading):
        raise ValueError("commas may be decimal ones")
    return header, data, remarks, reading


def _columns(
    values: Array, line_numbers: NDArray[np.int64], header: Numbered, remarks: Numbered, reading: Reading, notes: list[str]
) -> Columns:
    """The columns of values (m, c) with what stands above and beside them."""
    if reading.decimal == ",":
        notes.append("decimal commas")
    names, units, understood = _names_and_units(header, remarks, int(line_numbers[0]), reading, values.shape[1])
    notes += [f"line {number} taken as a header: '{shorten(line)}'" for number, line in header if number not in understood]
    return Columns(values, line_numbers, names, tuple(notes), tuple(units))


def numbers_of(line: str) -> list[float]:
    """Return the numbers of one line, as `parse_columns` reads them, without a remark behind; none if anything else stands on it."""
    line = _REMARK.sub("", _without_quotes(line.strip()), count=1)
    fields = next((reading.fields(line) for reading in READINGS if reading.explains(line)), [line])
    return [] if len(fields) == 1 and not NUMBER.fullmatch(line) else [number_of(field) for field in fields]


def count_of(count: int, noun: str) -> str:
    """Return a count with its noun in the right number: 1 point, 2 points."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def _split_lines(text: str, wanted: tuple[int, ...]) -> tuple[Numbered, Numbered, Numbered, tuple[int, ...]]:
    """Split a text into header lines, lines of data and remarks; give the wanted columns as well, if need be by their names."""
    header: Numbered = []
    data: Numbered = []
    remarks: Numbered = []
    asked = bool(wanted)
    for number, raw in enumerate(text.split("\n"), 1):
        line = name_errors(_without_quotes(raw.strip()))
        remark = _COMMENT.match(line) if line[:1] in _COMMENT_STARTS else None
        if remark:
            line = line[remark.end() :].lstrip("#%!/ ")
            remarks.append((number, line))
        elif line and len(data) == 1 and _COUNT.fullmatch(data[0][1]) and _is_header(line):
            header.append((number, line))  # below the count of points
        elif line and (data or _is_data(line, wanted, bool(header))):
            data.append((number, _PERCENT_REMARK.sub("", _REMARK.sub("", line, count=1))))
            continue
        elif line:
            header.append((number, line))
        elif data and "\t" in raw:
            data.append((number, raw.strip(" ")))  # a row of empty fields, if tabs stand between them
        if line and not data and not asked:
            wanted = _named_places(line) or wanted
    return header, data, remarks, wanted


def _without_edges(data: Numbered, reading: Reading, labels: bool, notes: list[str]) -> Numbered:
    """Leave out rows of nothing but delimiters at both ends, as spreadsheets write them, and lines of words behind the last row."""
    filled = [i for i, (_, line) in enumerate(data) if any(reading.fields(line))]
    first, stop = filled[0], filled[-1] + 1
    words = stop
    while words > first + 1 and _is_footer(data[words - 1][1], reading, labels):
        words -= 1
    if words < stop:
        notes.append(f"line {data[words][0]}, behind the last row, left out: '{shorten(data[words][1])}'")
    kept = [(number, line) for number, line in data[first:words] if reading.delimiter == "\t" or line.strip()]
    empty = [number for number, line in (*data[:first], *data[stop:]) if line.strip()]
    if empty:
        notes.append(f"{count_of(len(empty), 'empty row')} at the ends left out")
    return kept


def _is_footer(line: str, reading: Reading, labels: bool) -> bool:
    """Tell whether a line behind the data is words: no number is on it, nor anything in place of one alone, and it is no labelled row."""
    fields = [field for field in re.split(r"[;,|\s]+", line) if field]
    if (reading.delimiter and reading.delimiter in line) or (labels and not reading.delimiter):
        return False
    return not any(map(reading.is_number, fields)) and not all(map(is_no_number, fields))


def _is_data(line: str, wanted: Sequence[int], below_header: bool) -> bool:
    """Tell whether a line may begin the data: it is no header, or holds numbers where they are wanted."""
    if wanted and any(reading.explains(line, wanted) for reading in READINGS):
        return True
    return not _is_header(line) and not (below_header and _UNDERLINE.fullmatch(line))


def _without_quotes(line: str) -> str:
    """Take the quotes from fields, and bars from both ends.

    Where a quoted field holds a comma, semicolons stand between the fields instead.
    """
    if line[:1] == line[-1:] == "|" and line.strip("| "):
        line = line[1:-1].strip()
    if line.count('"') < 2 or line.count('"') % 2:
        return line
    if not re.search(r'"[^"]*,[^"]*"\s*(,|$)', line) or ";" in line or "\t" in line:
        return line.replace('"', "")
    return ";".join(next(csv.reader([line], skipinitialspace=True)))


def _named_places(line: str) -> tuple[int, ...]:
    """Where a line names the axes x and y, and perhaps z: their columns (from 0); none where it does not."""
    for delimiter in (";", "\t", "|", ",", None):
        letters = axis_letters([name.strip() for name in line.split(delimiter)])
        places = [place for place, letter in enumerate(letters) if letter]
        if {"x", "y"} <= set(letters) and len(places) == len({letters[place] for place in places}):
            return tuple(places)
    return ()


def _values(data: Numbered, reading: Reading, wanted: Sequence[int]) -> Array:
    """Return the numbers (m, c) of the lines. numpy reads plain files; what it cannot read is looked at line by line."""
    if reading.decimal == ".":
        try:
            return np.loadtxt([line for _, line in data], delimiter=reading.delimiter, comments=None, ndmin=2)
        except ValueError:
            pass
    rows = [reading.row(number, line, wanted) for number, line in data]
    widest = max(map(len, rows))
    for (_, line), row in zip(data, rows, strict=True):
        if reading.delimiter and line.endswith(reading.delimiter) and len(row) == widest - 1:
            row.append(float("nan"))  # an empty last field
    full = next((at for at, row in enumerate(rows) if not np.isnan(row).all()), 0)
    first = len(rows[full])
    for at, (number, _) in enumerate(data):
        if len(rows[at]) != first and np.isnan(rows[at]).all():
            rows[at] = [float("nan")] * first
        if len(rows[at]) != first:
            raise PointFileError(
                f"line {number}: {count_of(len(rows[at]), 'column')}, line {data[full][0]} has {first}; expected as many on every line"
            )
    return np.array(rows)


def _is_header(line: str) -> bool:
    """Tell whether a line is a header: its first word is no number, and at most half of its words are (a damaged row has more)."""
    words = [word for word in re.split(r"[;,\t ]+", line) if word]
    if len(words) > 1 and all(map(is_no_number, words)):
        return False
    numbers = [NUMBER.fullmatch(word) is not None for word in words]
    return line[0] != "#" and re.search(r"[^\W\d_]", line) is not None and not numbers[0] and 2 * sum(numbers) <= len(numbers)


def _find_reading(data: Numbered, wanted: tuple[int, ...]) -> tuple[Reading, tuple[int, ...]]:
    """Find the reading that explains most of the first lines, and the places that it wants: none named where that explains fewer.

    Raises PointFileError when none explains any.
    """
    sample = [line for _, line in data[:_SNIFFED_LINES]]
    for places in ((), wanted) if wanted else ((),):
        score = {reading: sum(reading.explains(line, places) for line in sample) for reading in READINGS}
        best = max(READINGS, key=lambda reading: score[reading])
        if score[best]:
            as_wanted = sum(best.explains(line, wanted) for line in sample) if wanted else 0
            return best, wanted if as_wanted >= score[best] else ()
    number, line = data[0]
    if re.fullmatch(NUMBER, line) or re.fullmatch(r"[+-]?\d+,\d+", line):
        raise PointFileError(f"line {number}: one column ('{shorten(line)}'); expected two or three: x, y and perhaps z")
    labels = next((HINT for reading in READINGS if sum(map(reading.is_number, reading.fields(line))) > 1), "")
    raise PointFileError(f"line {number}: '{shorten(line)}' is not a row of numbers; expected two or three columns of numbers{labels}")


def _drop_count(data: Numbered, reading: Reading, notes: list[str]) -> Numbered:
    """Drop a first line that counts the points (pts and xyz files), and refuse a file that holds another number of them."""
    number, line = data[0]
    if len(data) < 2 or not _COUNT.fullmatch(line) or not reading.explains(data[1][1]):
        return data
    if int(line) != len(data) - 1:
        raise PointFileError(f"line {number}: announces {line} points, but {len(data) - 1} follow; expected the whole file")
    notes.append(f"line {number} counts the points")
    return data[1:]


def _refuse_unclear_commas(data: Numbered, reading: Reading, columns: int) -> None:
    """Refuse lines like 1,5,2,5, which may be four whole numbers or two with decimal commas."""
    if _has_points_or_powers(data, reading):
        return
    for number, line in data:
        if (columns > 3 and columns % 2 == 0) or re.search(r"(?<!\d)0\d", line):
            raise PointFileError(
                f"line {number}: '{shorten(line)}' can be read with commas between whole numbers or with decimal commas; "
                "expected decimal points, or semicolons between the numbers"
            )


def _has_points_or_powers(data: Numbered, reading: Reading) -> bool:
    """Tell whether commas can only stand between the numbers."""
    return reading.delimiter != "," or any("." in line or "e" in line.lower() for _, line in data)


def _names_and_units(
    header: Numbered, remarks: Numbered, first: int, reading: Reading, columns: int
) -> tuple[tuple[str, ...], list[StatedUnit], set[int]]:
    """Return the names of the columns, the units that the text states, and the header lines that are understood so.

    The names are those of the last header line, or the last remark before the first row, that fits the columns.
    """
    before = [(number, line) for number, line in remarks[::-1] if number < first]
    names, line_of_names = _names(header, before, reading, columns)
    units, understood = units_of_lines(header + remarks), {line_of_names}
    for number, line in header:
        if number == line_of_names:
            continue
        row = units_of_row(number, line.split(reading.delimiter), axis_letters(names))
        if row or any(unit.place.startswith(f"line {number} ") for unit in units):
            units = [unit for unit in units if not unit.place.startswith(f"line {number} ")] + row if row else units
            understood.add(number)
    return names, units, understood


def _names(header: Numbered, remarks: Numbered, reading: Reading, columns: int) -> tuple[tuple[str, ...], int]:
    """Return the names of the columns and their line, 0 where nothing names an axis.

    Words apart by blanks are names only if x and y are among them; else they are a title of as many words.
    """
    for number, line in header[::-1] + remarks:
        if line.upper().startswith("XYZIJK"):
            return (*_VECTOR_NAMES[:columns], *[""] * (columns - len(_VECTOR_NAMES))), number
        for delimiter in (reading.delimiter, ";", "\t", "|", ",", None):
            names = [name.strip().strip("\"'") for name in line.split(delimiter)]
            if len(names) == columns and len({"x", "y", "z"} & set(axis_letters(names))) > 1:
                return tuple(names), number
    names = [name.strip() for name in header[-1][1].split(reading.delimiter)] if header and reading.delimiter else []
    return (tuple(names) if len(names) == columns else ()), 0
