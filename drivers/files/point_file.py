"""Files of points: columns of numbers from text, points in millimetres, and such a file as a source.

What a file may look like: csv, txt, asc, xyz with two or more columns apart by commas, semicolons, tabs or blanks, with
decimal points or decimal commas, a header, comment lines, a byte order mark, a first line that counts the points; npy.
What it means is settled from the file itself; where it could mean two things it is refused, with the line.

Functions that take a path name the file in their errors; functions that take text name the line alone.
"""

import re
import tokenize
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from threading import Event

import numpy as np
from numpy.typing import NDArray

from drivers.errors import PointFileError
from drivers.source import Arrival, PointBatch, ScanClosed, ScanOpened

Array = NDArray[np.float64]
Numbered = list[tuple[int, str]]  # line number and what stands on the line

# What numpy's reader of npy headers lets through on files that are none; RecursionError and MemoryError come from its literal_eval.
_NPY_ERRORS = (
    ValueError,
    EOFError,
    OSError,
    SyntaxError,
    TypeError,
    KeyError,
    MemoryError,
    RecursionError,
    OverflowError,
    tokenize.TokenError,
)
_LARGEST_MM = 1e6  # a kilometre: beyond it the unit or the scale is wrong, and a float64 no longer resolves a tenth of a nanometre
_SNIFFED_LINES = 100
_POINT_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eEdD][+-]?\d+)?|[+-]?(nan|inf|infinity)", re.IGNORECASE)
_COMMENT = re.compile(r"#(?!N/A|VALUE!|DIV/0!|REF!|NUM!|NAME\?|NULL!)|%|!|//")  # a spreadsheet's error value is no comment
_COMMENT_STARTS = ("#", "%", "!", "/")
_AXIS_NAME = re.compile(r"([xyz])(?![a-z0-9])(?:.*?(?<![a-zµ])(mm|cm|m|µm|um|inch|in)[\])]?$)?", re.IGNORECASE)
_MM_PER_UNIT = {"m": 1000.0, "cm": 10.0, "um": 0.001, "µm": 0.001, "in": 25.4, "inch": 25.4}


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


@dataclass(frozen=True, slots=True, eq=False)
class PointFile:
    """Measured points of a file: points_mm (m, 3), in the order of the file, and notes of what was assumed."""

    points_mm: Array
    notes: tuple[str, ...]

    def __post_init__(self) -> None:
        self.points_mm.setflags(write=False)


class PointFileSource:
    """A file of points as a scan: the sequence is the row, from 0. A file has no clock: every time is 0 s.

    The file is read here, so that a bad one is refused (PointFileError) before a run begins.
    """

    def __init__(self, path: Path, scale: float = 1.0, batch_points: int = 1024) -> None:
        if batch_points < 1:
            raise ValueError(f"a batch holds at least one point, not {batch_points}")
        self._name = path.name
        self._batch_points = batch_points
        self._stopped = Event()
        self._file = read_points(path, scale)

    @property
    def notes(self) -> tuple[str, ...]:
        """What was assumed when the file was read."""
        return self._file.notes

    def arrivals(self) -> Iterator[Arrival]:
        """Yield the points of the file, in batches; see ScanSource."""
        points = self._file.points_mm
        yield ScanOpened(device=f"file {self._name}", serial_number="", expected=len(points))
        for start in range(0, len(points), self._batch_points):
            if self._stopped.is_set():
                return
            batch = points[start : start + self._batch_points].copy()
            yield PointBatch(np.arange(start, start + len(batch), dtype=np.int64), np.zeros(len(batch)), batch)
        yield ScanClosed(sent=len(points))

    def stop(self) -> None:
        """End `arrivals` before its next batch."""
        self._stopped.set()


def read_points(path: Path, scale: float = 1.0) -> PointFile:
    """Read measured points (m, 3) in mm from csv, txt, asc, xyz or npy; `scale` turns the file's unit into mm.

    Two columns are x and y, at z = 0. Raises PointFileError: file, line, what was found, what is expected.
    """
    if path.suffix.lower() == ".npy":
        return _read_npy(path, scale)
    text = read_text(path)
    try:
        points, notes = points_of(parse_columns(text), scale)
        _require_several(points)
    except PointFileError as error:
        raise PointFileError(f"{path}: {error}") from None
    return PointFile(points, notes)


def read_text(path: Path) -> str:
    """Text of a file in UTF-8, UTF-16 with a byte order mark, or Latin-1. Raises PointFileError, also when it is no text."""
    data = _read_bytes(path)
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


def parse_columns(text: str) -> Columns:
    """Columns of numbers, at least two, from text. Raises PointFileError, naming the line."""
    header, data, comment = _split_lines(text)
    if not data:
        raise PointFileError("no line of numbers in the file; expected two or three columns of numbers")
    reading = _best_reading(data)
    notes: list[str] = []
    data = _without_count(data, reading, notes)
    values = _values(data, reading)
    columns = values.shape[1]
    _refuse_unclear_commas(data, reading, columns)
    if reading.decimal == ",":
        notes.append("decimal commas")
    names = _names(header, comment, reading, columns)
    understood = 1 if header and {"x", "y"} <= set(_axis_letters(names)) else 0
    notes += [f"line {number} taken as a header: '{_shortened(line)}'" for number, line in header[: len(header) - understood]]
    return Columns(values, np.array([number for number, _ in data], dtype=np.int64), names, tuple(notes))


def points_of(columns: Columns, scale: float) -> tuple[Array, tuple[str, ...]]:
    """Points (m, 3) in mm of the columns x, y and z (by their names, else the first ones), and notes.

    Raises PointFileError when it is not clear which columns those are, or when a coordinate is no usable number.
    """
    chosen, notes = _chosen_columns(columns, scale)
    points = np.zeros((len(columns.values), 3))
    points[:, : len(chosen)] = checked_mm(columns.values[:, chosen], columns.line_numbers, scale)
    return points, columns.notes + tuple(notes)


def checked_mm(values: Array, line_numbers: NDArray[np.int64], scale: float, place: str = "line") -> Array:
    """Values (m, c) times scale, all finite and below a kilometre; PointFileError names the first line that is not."""
    if not (np.isfinite(scale) and scale > 0):
        raise PointFileError(f"the scale must be a positive number, not {scale:g}")
    with np.errstate(over="ignore", invalid="ignore"):
        scaled = np.asarray(values * scale)
        bad = ~(np.abs(scaled) <= _LARGEST_MM)  # catches NaN as well
    if bad.any():
        row = int(np.argmax(bad.any(axis=1)))
        found = values[row, int(np.argmax(bad[row]))]
        problem = f"larger than {_LARGEST_MM:g} mm at scale {scale:g}" if np.isfinite(found) else "not a finite number"
        raise PointFileError(f"{place} {line_numbers[row]}: {found:g} is {problem}; expected coordinates in mm")
    return scaled


@dataclass(frozen=True, slots=True)
class _Reading:
    """One way to read a line: what stands between the columns (None: blanks), and the decimal mark."""

    delimiter: str | None
    decimal: str

    def fields(self, line: str) -> list[str]:
        """Columns of a line; a delimiter at the very end ends the last one."""
        fields = [field.strip() for field in line.split(self.delimiter)]
        return fields[:-1] if len(fields) > 1 and not fields[-1] else fields

    def is_number(self, field: str) -> bool:
        if self.decimal == ",":
            field = "?" if "." in field else field.replace(",", ".")
        return _POINT_NUMBER.fullmatch(field) is not None

    def explains(self, line: str) -> bool:
        fields = self.fields(line)
        return len(fields) > 1 and all(map(self.is_number, fields))

    def row(self, number: int, line: str) -> list[float]:
        """Numbers of a line, or a PointFileError that names what is none."""
        fields = self.fields(line)
        for column, field in enumerate(fields, 1):
            if not self.is_number(field):
                found = f"'{_shortened(field)}' is not a number" if field else f"column {column} is empty"
                raise PointFileError(f"line {number}: {found}; expected numbers {self}")
        return [float(field.replace(",", ".").replace("d", "e").replace("D", "e")) for field in fields]

    def __str__(self) -> str:
        between = {None: "blanks", "\t": "tabs", ";": "semicolons", ",": "commas"}[self.delimiter]
        return f"with {between} between them and decimal {'commas' if self.decimal == ',' else 'points'}"


# In order of preference where several explain as many lines: a semicolon or a tab is never part of a number.
_READINGS = tuple(_Reading(*marks) for marks in ((";", "."), (";", ","), ("\t", "."), ("\t", ","), (",", "."), (None, "."), (None, ",")))


def _split_lines(text: str) -> tuple[Numbered, Numbered, Numbered]:
    """Header lines, lines of data, and the last comment before the data (it may name the columns)."""
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
    """Numbers (m, c) of the lines; numpy reads plain files, and whatever it stumbles over is looked at line by line."""
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
                f"line {number}: {_counted(len(row), 'column')}, line {data[0][0]} has {first}; expected as many on every line"
            )
    return np.array(rows)


def _is_header(line: str) -> bool:
    """Words, not numbers: the first is no number, nor are more than half of them (a damaged row has more)."""
    words = [word for word in re.split(r"[;,\t ]+", line) if word]
    numbers = [_POINT_NUMBER.fullmatch(word) is not None for word in words]
    return line[0] != "#" and re.search(r"[^\W\d_]", line) is not None and not numbers[0] and 2 * sum(numbers) <= len(numbers)


def _best_reading(data: Numbered) -> _Reading:
    """Find the reading that explains most of the first lines. Raises PointFileError when none explains any."""
    sample = [line for _, line in data[:_SNIFFED_LINES]]
    score = {reading: sum(map(reading.explains, sample)) for reading in _READINGS}
    best = max(_READINGS, key=lambda reading: score[reading])
    if score[best]:
        return best
    number, line = data[0]
    if re.fullmatch(_POINT_NUMBER, line) or re.fullmatch(r"[+-]?\d+,\d+", line):
        raise PointFileError(f"line {number}: one column ('{_shortened(line)}'); expected two or three: x, y and perhaps z")
    raise PointFileError(f"line {number}: '{_shortened(line)}' is not a row of numbers; expected two or three columns of numbers")


def _without_count(data: Numbered, reading: _Reading, notes: list[str]) -> Numbered:
    """Drop a first line that is the count of the points (pts and xyz files), and hold the file to it."""
    number, line = data[0]
    if len(data) < 2 or not line.isdecimal() or not reading.explains(data[1][1]):
        return data
    if int(line) != len(data) - 1:
        raise PointFileError(f"line {number}: announces {line} points, but {len(data) - 1} follow; expected the whole file")
    notes.append(f"line {number} counts the points")
    return data[1:]


def _refuse_unclear_commas(data: Numbered, reading: _Reading, columns: int) -> None:
    """1,5,2,5 may be four whole numbers or two with decimal commas: nobody can know."""
    if reading.delimiter != "," or any("." in line or "e" in line.lower() for _, line in data):
        return
    for number, line in data:
        if (columns > 3 and columns % 2 == 0) or re.search(r"(?<!\d)0\d", line):
            raise PointFileError(
                f"line {number}: '{_shortened(line)}' can be read with commas between whole numbers or with decimal commas; "
                "expected decimal points, or semicolons between the numbers"
            )


def _names(header: Numbered, comment: Numbered, reading: _Reading, columns: int) -> tuple[str, ...]:
    """Names of the columns: the last header line or the last comment before the data, when one fits.

    Words apart by blanks are names only if x and y are among them; else they are a title of as many words.
    """
    for _, line in header[-1:] + comment:
        for delimiter in (reading.delimiter, ";", "\t", ",", None):
            names = [name.strip().strip("\"'") for name in line.split(delimiter)]
            if len(names) == columns and {"x", "y"} <= set(_axis_letters(names)):
                return tuple(names)
    names = [name.strip() for name in header[-1][1].split(reading.delimiter)] if header and reading.delimiter else []
    return tuple(names) if len(names) == columns else ()


def _axis_letters(names: Sequence[str]) -> list[str]:
    axes = [_AXIS_NAME.match(name) for name in names]
    return [axis[1].lower() if axis else "" for axis in axes]


def _chosen_columns(columns: Columns, scale: float) -> tuple[list[int], list[str]]:
    """Which columns are x, y and, if there is one, z; and notes."""
    count = columns.values.shape[1]
    letters = _axis_letters(columns.names)
    for letter in "xyz":
        if letters.count(letter) > 1:
            raise PointFileError(f"the header names more than one column {letter}: {', '.join(columns.names)}; expected one x, y and z")
    if "x" in letters and "y" in letters:
        _refuse_other_unit(columns.names, scale)
        chosen = [letters.index(letter) for letter in "xyz" if letter in letters]
        ignored = [name or f"column {i + 1}" for i, name in enumerate(columns.names) if i not in chosen]
        return chosen, [f"columns left out: {', '.join(ignored)}"] if ignored else []
    _refuse_unclear_columns(columns, count)
    return list(range(min(count, 3))), [f"the first three of {count} columns taken as x, y, z"] if count > 3 else []


def _refuse_other_unit(names: Sequence[str], scale: float) -> None:
    for axis in filter(None, map(_AXIS_NAME.match, names)):
        factor = _MM_PER_UNIT.get((axis[2] or "mm").lower())
        if factor is not None and scale == 1.0:
            raise PointFileError(f"the header gives {axis[1]} in {axis[2]}; expected mm: give the scale {factor:g}")


def _refuse_unclear_columns(columns: Columns, count: int) -> None:
    """Ask for names rather than guess: a column in front of x would shift every coordinate by one place."""
    if columns.names and count > 2:
        names = _shortened(", ".join(columns.names))
        raise PointFileError(f"the header names no columns x and y: {names}; expected x, y and perhaps z among them")
    first = columns.values[:, 0]
    if count > 3 and len(first) > 2 and first[0] in (0, 1) and np.all(np.diff(first) == 1):
        raise PointFileError("the first column counts the rows; expected x, y, z first, or a header line that names the columns x, y, z")


def _require_several(points: Sequence[object] | Array) -> None:
    if len(points) < 2:
        raise PointFileError(f"{_counted(len(points), 'point')}; expected at least two")


def _read_bytes(path: Path) -> bytes:
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


def _read_npy(path: Path, scale: float) -> PointFile:
    """Array (m, 2) or (m, 3) of numbers from an npy file, mapped first so that a header that lies costs no memory."""
    if not _read_bytes(path):
        raise PointFileError(f"{path}: the file is empty")
    try:
        array = np.lib.format.open_memmap(path, mode="r")
    except _NPY_ERRORS:
        raise PointFileError(f"{path}: not a readable npy file of numbers; expected an array (m, 2) or (m, 3)") from None
    if not isinstance(array, np.ndarray) or array.ndim != 2 or array.shape[1] not in (2, 3) or array.dtype.kind not in "fiu":
        found = f"{array.dtype} array of shape {array.shape}" if isinstance(array, np.ndarray) else "an archive"
        raise PointFileError(f"{path}: {found}; expected numbers of shape (m, 2) or (m, 3)")
    try:
        values = np.array(array, dtype=np.float64)
        _require_several(values)
        points = np.zeros((len(values), 3))
        points[:, : values.shape[1]] = checked_mm(values, np.arange(len(values)), scale, place="row")
    except PointFileError as error:
        raise PointFileError(f"{path}: {error}") from None
    return PointFile(points, ())


def _shortened(text: str) -> str:
    return text if len(text) <= 40 else text[:37] + "..."


def _counted(count: int, noun: str) -> str:
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"
