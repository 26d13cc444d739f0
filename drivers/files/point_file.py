"""Files of points in millimetres, and such a file as a source.

A file is a text with two or more columns of numbers (csv, txt, asc, xyz; see text_table) or an npy array. Rows without numbers
stay rows: their coordinates are NaN, so that the inspection rejects and counts them.
"""

import tokenize
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from threading import Event
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivers.errors import PointFileError
from drivers.files.column_choice import AxisName, axes_of, choose_axes, refuse_places
from drivers.files.normals import normals_at, places_of_normals
from drivers.files.plain_rows import Room
from drivers.files.stated_units import MM_PER_UNIT, UnitName, units_of_names
from drivers.files.text_table import Array, Columns, count_of, parse_columns, read_bytes, read_plain, read_text, refuse_long_text
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
    FloatingPointError,
    tokenize.TokenError,
)
_ROWS_AT_ONCE = 1 << 16
_IN_SPACE = (".stl", ".obj", ".ply")
_LARGEST_MM = 1e6  # a kilometre: beyond it the unit or the scale is wrong, and a float64 no longer resolves a tenth of a nanometre


@dataclass(frozen=True, slots=True, eq=False)
class PointFile:
    """Measured points of a file.

    points_mm : (m, 3) in the order of the file, NaN for rows without numbers
    notes     : what was assumed
    normals   : (m, 3) outward directions of the measured surface, zero or NaN where the file tells none; None where none are in it, or
                nobody asked for them
    """

    points_mm: Array
    notes: tuple[str, ...]
    normals: Array | None = None

    def __post_init__(self) -> None:
        self.points_mm.setflags(write=False)
        if self.normals is not None:
            if self.normals.shape != self.points_mm.shape:
                raise ValueError(f"expected a normal for every point, {self.points_mm.shape}, got {self.normals.shape}")
            self.normals.setflags(write=False)


class PointArraySource:
    """Points that are all there already, as a scan: the sequence is the row, from 0. They have no clock: every time is 0 s."""

    def __init__(self, device: str, points: PointFile, batch_points: int = 1024) -> None:
        """`device` is what the scan says that it comes from."""
        if batch_points < 1:
            raise ValueError(f"a batch holds at least one point, not {batch_points}")
        self._device, self._points = device, points
        self._batch_points = batch_points
        self._stopped = Event()

    @property
    def notes(self) -> tuple[str, ...]:
        """What was assumed when the points were read."""
        return self._points.notes

    def arrivals(self) -> Iterator[Arrival]:
        """Yield the points, in batches; see ScanSource."""
        points, normals = self._points.points_mm, self._points.normals
        yield ScanOpened(device=self._device, serial_number="", expected=len(points))
        for start in range(0, len(points), self._batch_points):
            if self._stopped.is_set():
                return
            batch = points[start : start + self._batch_points].copy()
            seen = None if normals is None else normals[start : start + self._batch_points].copy()
            yield PointBatch(np.arange(start, start + len(batch), dtype=np.int64), np.zeros(len(batch)), batch, seen)
        yield ScanClosed(sent=len(points))

    def stop(self) -> None:
        """End `arrivals` before its next batch."""
        self._stopped.set()


class PointFileSource(PointArraySource):
    """A file of points as a scan. It is read here, so that a bad one is refused (PointFileError) before a run begins.

    room : gives the arrays that are as long as the file, like numpy.empty
    """

    def __init__(
        self,
        path: Path,
        scale: float = 1.0,
        batch_points: int = 1024,
        *,
        unit: UnitName | None = None,
        columns: Mapping[AxisName, int] | None = None,
        invalid: Collection[float] = (),
        room: Room = np.empty,
    ) -> None:
        points = read_points(path, scale, unit=unit, columns=columns, invalid=invalid, room=room)
        super().__init__(f"file {path.name}", points, batch_points)


def read_points(
    path: Path,
    scale: float = 1.0,
    *,
    unit: UnitName | None = None,
    columns: Mapping[AxisName, int] | None = None,
    invalid: Collection[float] = (),
    room: Room = np.empty,
    normals: bool = False,
    in_space: bool = False,
) -> PointFile:
    """Read measured points (m, 3) in mm from csv, txt, asc, xyz or npy. Two columns are x and y, at z = 0, unless they must lie in space.

    scale   : how many mm a unit of the file is
    unit    : the same in words, above whatever the file states; not beside a scale
    columns : which columns (from 1) are x, y and z, where the file itself does not tell
    invalid : values that mean no point, as they stand in the file; a row with one of them as a coordinate has no numbers
    room    : gives the arrays that are as long as the file, like numpy.empty; those of a long one may lie on a disk
    normals : read the normals as well, where the file has any: in columns nx, ny, nz, or the last three of six without names
    in_space : refuse a file without all of x, y and z

    Raises PointFileError: file, line, what was found, what is expected.
    """
    asked = _Asked(scale, unit, columns, tuple(invalid), room, normals, in_space)
    npy = path.suffix.lower() == ".npy"
    if path.suffix.lower() in _IN_SPACE and path.is_file():
        told = f"{path.suffix.upper()[1:]} is the format of a scan of a whole surface, and no table of points"
        raise PointFileError(f"{path}: {told}; inspect it as a surface, or export its points as csv or npy")
    with _name_file(path):
        places = axes_of(columns).values()
    plain = None if npy else read_plain(path, places, room)
    if plain is None and not npy:
        refuse_long_text(path, places, room)
    text = "" if npy or plain else read_text(path)
    if npy and not read_bytes(path, 1):
        raise PointFileError(f"{path}: the file is empty")
    with _name_file(path):
        return _read_npy(path, asked) if npy else _read_table(plain or parse_columns(text, places), asked)


@contextmanager
def _name_file(path: Path) -> Iterator[None]:
    """Put the name of the file before what is wrong with it."""
    try:
        yield
    except PointFileError as error:
        raise PointFileError(f"{path}: {error}") from None


@dataclass(frozen=True, slots=True)
class _Asked:
    """What is said of a file beside it."""

    scale: float
    unit: UnitName | None
    columns: Mapping[AxisName, int] | None
    invalid: tuple[float, ...]
    room: Room
    normals: bool = False
    in_space: bool = False

    @property
    def notes(self) -> list[str]:
        """What was asked, as far as the reader of the verdict has to know it."""
        return [f"read in {self.unit}, as asked"] if self.unit else []

    def places_of_normals(self, names: Sequence[str], values: NDArray[Any]) -> tuple[int, ...]:
        """The columns (from 0) of normals, where they are wanted and none of them was asked for as a coordinate."""
        found = places_of_normals(names, values) if self.normals else ()
        return () if set(found) & set(axes_of(self.columns).values()) else found


def _read_table(table: Columns, asked: _Asked) -> PointFile:
    seen = asked.places_of_normals(table.names, table.values)
    chosen, notes = choose_axes(table, asked.columns, seen)
    points, found = _points(table.values, chosen, asked, _mm_per_unit(table, asked.scale, asked.unit), table.line_numbers)
    unit = [*asked.notes, *_note_of_unit(table, asked.scale, asked.unit)]
    return PointFile(points, (*table.notes, *notes, *unit, *found), normals_at(seen, table.values, asked.room))


def points_of(columns: Columns, scale: float, unit: UnitName | None = None) -> tuple[Array, tuple[str, ...]]:
    """Return points (m, 3) in mm from the columns x, y and z, found by their names or else the first ones, and notes.

    unit : its name, where it was given in words; it goes above what the text states, and scale is then its length

    Raises PointFileError when it is not clear which columns those are, or when a coordinate is no usable number.
    """
    chosen, notes = choose_axes(columns, None)
    points = np.zeros((len(columns.values), 3))
    factor = _mm_per_unit(columns, scale, unit)
    for axis, place in chosen.items():
        points[:, "xyz".index(axis)] = convert_to_mm(columns.values[:, [place]], columns.line_numbers, factor)[:, 0]
    return points, (*columns.notes, *notes, *_note_of_unit(columns, scale, unit))


def _mm_per_unit(table: Columns | None, scale: float, unit: UnitName | None) -> float:
    """How many mm a unit of the file is: as asked, else as the file states it. Raises PointFileError where it states more than one."""
    if unit is not None:
        if scale not in (1.0, MM_PER_UNIT[unit]):
            raise PointFileError(f"unit {unit} and scale {scale:g} are both given; expected one of them")
        return MM_PER_UNIT[unit]
    stated = [*units_of_names(table.names), *table.units] if table else []
    if scale != 1.0 or not stated:
        return scale
    kinds = {each.unit: each for each in reversed(stated)}  # of each unit the first word
    if len(kinds) > 1:
        second, first = list(kinds.values())[-2:]
        raise PointFileError(f"{first.place} {first.word}, but {second.place} {second.word}; expected one unit: give the unit")
    return kinds.popitem()[1].mm


def _note_of_unit(table: Columns, scale: float, unit: UnitName | None) -> list[str]:
    """Say which unit the text states, where it is no mm, and whether it was followed: not where another one or a scale was asked for."""
    asked_mm = MM_PER_UNIT[unit] if unit else scale
    others = [each for each in (*units_of_names(table.names), *table.units) if each.mm != asked_mm]
    if not others:
        return []
    if unit is None and scale == 1.0:
        return [f"{others[0].place} {others[0].word}: read in {others[0].unit}"]
    return [f"{others[0].place} {others[0].word}: not followed, since {f'unit {unit}' if unit else f'scale {scale:g}'} was asked for"]


def _points(
    values: NDArray[Any], chosen: Mapping[AxisName, int], asked: _Asked, factor: float, line_numbers: NDArray[np.int64] | None
) -> tuple[Array, list[str]]:
    """Points (m, 3) in mm of the chosen columns, NaN for rows without numbers, and notes on these. Axes that are not there are 0.

    The values (m, c) are gone through in pieces: only the points are held. A row that holds a value which means no point has no numbers.

    line_numbers : (m,) where the rows stand; None for an array, whose rows are counted from 0
    """
    _refuse_fewer_than_two(values)
    if asked.in_space and len(chosen) < 3:
        raise PointFileError(
            f"the points have {' and '.join(chosen)} alone, and points in space need x, y and z; expected three columns of coordinates, or "
            "say which they are (columns x=1,y=2,z=3)"
        )
    points = asked.room((len(values), 3), np.float64)
    rows_with, gaps, usable = dict.fromkeys(asked.invalid, 0), 0, 0
    for first in range(0, len(values), _ROWS_AT_ONCE):
        rows = slice(first, min(first + _ROWS_AT_ONCE, len(values)))
        with np.errstate(invalid="ignore", over="ignore"):  # what is no number stays none
            read = np.asarray(values[rows], dtype=np.float64)[:, list(chosen.values())]
        gaps += int(np.count_nonzero(~np.isfinite(read).all(axis=1)))
        there = np.isfinite(read).all(axis=1)
        for value in rows_with:
            marked = (read == value).any(axis=1)
            rows_with[value] += int(np.count_nonzero(marked))
            there &= ~marked
        numbers = np.arange(rows.start, rows.stop) if line_numbers is None else line_numbers[rows]
        part = np.full((len(read), 3), np.nan)
        part[there] = 0.0
        in_mm = convert_to_mm(read[there], numbers[there], factor, "row" if line_numbers is None else "line")
        for column, axis in enumerate(chosen):
            part[there, "xyz".index(axis)] = in_mm[:, column]
        points[rows] = part
        usable += len(in_mm)
    if not usable:
        raise PointFileError("no row holds numbers for all coordinates; expected coordinates in mm")
    return points, [*_notes_on_marks(rows_with), *([f"{count_of(gaps, 'row')} without numbers: rejected"] if gaps else [])]


def _notes_on_marks(rows_with: Mapping[float, int]) -> Iterator[str]:
    """Say how many rows each value took that means no point."""
    for value, count in rows_with.items():
        yield f"{count_of(count, 'row')} {'holds' if count == 1 else 'hold'} {value:g}, which means no point: rejected"


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


def _refuse_fewer_than_two(points: Sequence[object] | Array) -> None:
    if len(points) < 2:
        raise PointFileError(f"{count_of(len(points), 'point')}; expected at least two")


def _read_npy(path: Path, asked: _Asked) -> PointFile:
    """Read an array (m, 2) or (m, 3) from an npy file, or a wider one where columns are given.

    The file is mapped first, so that a header that promises too much costs no memory.
    """
    try:
        with np.errstate(over="raise"):  # of a size that the header claims
            array = np.lib.format.open_memmap(path, mode="r")
    except _NPY_ERRORS:
        raise PointFileError("not a readable npy file of numbers; expected an array (m, 2) or (m, 3)") from None
    return _read_array(array, asked)


def points_in(
    array: object,
    scale: float = 1.0,
    *,
    unit: UnitName | None = None,
    columns: Mapping[AxisName, int] | None = None,
    invalid: Collection[float] = (),
) -> PointFile:
    """Take measured points from an array (m, 2) or (m, 3), or a wider one where columns are given, as `read_points` does from a file.

    What a masked array hides is no number: its rows are rejected and counted.

    Raises PointFileError: the row (from 0), what was found, what is expected.
    """
    try:
        values = np.ma.filled(np.ma.asarray(array, dtype=np.float64), np.nan) if isinstance(array, np.ma.MaskedArray) else np.asarray(array)
    except ValueError:  # rows of different lengths
        raise PointFileError("rows of different lengths; expected numbers of shape (m, 2) or (m, 3)") from None
    return _read_array(values, _Asked(scale, unit, columns, tuple(invalid), np.empty))


def _read_array(array: object, asked: _Asked) -> PointFile:
    columns = asked.columns
    flat = isinstance(array, np.ndarray) and array.ndim == 2 and array.dtype.kind in "fiu"
    seen = asked.places_of_normals((), array) if isinstance(array, np.ndarray) and flat else ()
    if not isinstance(array, np.ndarray) or not flat or (columns is None and not seen and array.shape[1] not in (2, 3)):
        found = f"{array.dtype} array of shape {array.shape}" if isinstance(array, np.ndarray) else "an archive"
        raise PointFileError(f"{found}; expected numbers of shape (m, 2) or (m, 3)")
    refuse_places(columns, array.shape[1])
    chosen = axes_of(columns) or dict(zip(("x", "y", "z"), range(min(3, array.shape[1])), strict=False))
    points, found_rows = _points(array, chosen, asked, _mm_per_unit(None, asked.scale, asked.unit), None)
    return PointFile(points, (*asked.notes, *found_rows), normals_at(seen, array, asked.room))
