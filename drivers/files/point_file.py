"""Files of points in millimetres, and such a file as a source.

A file is a text with two or more columns of numbers (csv, txt, asc, xyz; see text_table) or an npy array.
"""

import tokenize
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from threading import Event

import numpy as np
from numpy.typing import NDArray

from drivers.errors import PointFileError
from drivers.files.text_table import AXIS_NAME, Array, Columns, axis_letters, count_of, parse_columns, read_bytes, read_text, shorten
from drivers.source import Arrival, PointBatch, ScanClosed, ScanOpened

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
_MM_PER_UNIT = {"m": 1000.0, "cm": 10.0, "um": 0.001, "µm": 0.001, "in": 25.4, "inch": 25.4}


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
        _refuse_fewer_than_two(points)
    except PointFileError as error:
        raise PointFileError(f"{path}: {error}") from None
    return PointFile(points, notes)


def points_of(columns: Columns, scale: float) -> tuple[Array, tuple[str, ...]]:
    """Return points (m, 3) in mm from the columns x, y and z, found by their names or else the first ones, and notes.

    Raises PointFileError when it is not clear which columns those are, or when a coordinate is no usable number.
    """
    chosen, notes = _choose_columns(columns, scale)
    points = np.zeros((len(columns.values), 3))
    points[:, : len(chosen)] = convert_to_mm(columns.values[:, chosen], columns.line_numbers, scale)
    return points, columns.notes + tuple(notes)


def convert_to_mm(values: Array, line_numbers: NDArray[np.int64], scale: float, place: str = "line") -> Array:
    """Return values (m, c) times scale. Raises PointFileError at the first number that is not finite or is beyond a kilometre."""
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


def _choose_columns(columns: Columns, scale: float) -> tuple[list[int], list[str]]:
    """Choose the columns that are x, y and, if there is one, z; return their places, and notes."""
    count = columns.values.shape[1]
    letters = axis_letters(columns.names)
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
    for axis in filter(None, map(AXIS_NAME.match, names)):
        factor = _MM_PER_UNIT.get((axis[2] or "mm").lower())
        if factor is not None and scale == 1.0:
            raise PointFileError(f"the header gives {axis[1]} in {axis[2]}; expected mm: give the scale {factor:g}")


def _refuse_unclear_columns(columns: Columns, count: int) -> None:
    """Ask for names rather than guess: a column in front of x would shift every coordinate by one place."""
    if columns.names and count > 2:
        names = shorten(", ".join(columns.names))
        raise PointFileError(f"the header names no columns x and y: {names}; expected x, y and perhaps z among them")
    first = columns.values[:, 0]
    if count > 3 and len(first) > 2 and first[0] in (0, 1) and np.all(np.diff(first) == 1):
        raise PointFileError("the first column counts the rows; expected x, y, z first, or a header line that names the columns x, y, z")


def _refuse_fewer_than_two(points: Sequence[object] | Array) -> None:
    if len(points) < 2:
        raise PointFileError(f"{count_of(len(points), 'point')}; expected at least two")


def _read_npy(path: Path, scale: float) -> PointFile:
    """Read an array (m, 2) or (m, 3) from an npy file. It is mapped first, so that a header that promises too much costs no memory."""
    if not read_bytes(path):
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
        _refuse_fewer_than_two(values)
        points = np.zeros((len(values), 3))
        points[:, : values.shape[1]] = convert_to_mm(values, np.arange(len(values)), scale, place="row")
    except PointFileError as error:
        raise PointFileError(f"{path}: {error}") from None
    return PointFile(points, ())
