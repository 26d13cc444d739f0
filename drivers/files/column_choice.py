"""Which columns of a table are x, y and z: by what is asked for, by their names, or by their place; and a question where that is not clear.

A column in front of x would shift every coordinate by one place without a word, so nothing is guessed: columns that count rows,
tell the time or hold something unknown are asked about.
"""

from collections.abc import Collection, Mapping
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from drivers.errors import PointFileError
from drivers.files.row_reading import shorten
from drivers.files.stated_units import axis_letters
from drivers.files.text_table import Array, Columns

AxisName = Literal["x", "y", "z"]

_BEGINNING = 1 << 16  # rows that show nearly always what columns are not
_FEWEST_ROWS = 3  # that show whether a column counts
_UNIT_LENGTH = 1e-2  # a normal may be rounded to two digits
_EVEN = 1e-6  # of a step: steps that differ by less are equal


def axes_of(columns: Mapping[AxisName, int] | None) -> dict[AxisName, int]:
    """Return places (from 0) of the columns asked for (from 1), in the order x, y, z. Raises PointFileError for what cannot be asked."""
    asked = dict(columns or {})
    wrong = [axis for axis in asked if axis not in get_args(AxisName)]
    if asked and (wrong or len(asked) < 2 or len(set(asked.values())) < len(asked) or min(asked.values()) < 1):
        told = ", ".join(f"{axis}={place}" for axis, place in asked.items())
        raise PointFileError(f"columns {told}: expected different columns, counted from 1, for two or three of x, y and z, like x=2,y=3")
    return {axis: asked[axis] - 1 for axis in get_args(AxisName) if axis in asked}


def refuse_places(columns: Mapping[AxisName, int] | None, count: int) -> None:
    """Raise PointFileError where a column is asked for that a table of so many columns has not."""
    for axis, place in (columns or {}).items():
        if place > count:
            raise PointFileError(f"{axis} is asked for in column {place}, but there are {count}; expected a column that is there")


def choose_axes(
    table: Columns, columns: Mapping[AxisName, int] | None, beside: Collection[int] = ()
) -> tuple[dict[AxisName, int], list[str]]:
    """Return the place (from 0) of x, y and, if there is one, z, and notes. Raises PointFileError where that is not clear.

    beside : columns (from 0) that are used for something else, so that they are not left out
    """
    count = table.values.shape[1]
    refuse_places(columns, count)
    asked = axes_of(columns)
    if asked:
        return asked, _notes_of(asked, table, "as asked", beside)
    letters = axis_letters(table.names)
    for letter in get_args(AxisName):
        if letters.count(letter) > 1:
            raise PointFileError(f"the header names more than one column {letter}: {', '.join(table.names)}; expected one x, y and z")
    named = {axis: letters.index(axis) for axis in get_args(AxisName) if axis in letters}
    if len(named) > 1:
        return named, _notes_of(named, table, "", beside)
    if table.names and count > 2:
        names = shorten(", ".join(table.names))
        raise PointFileError(
            f"the header names no columns x and y: {names}; expected x, y and perhaps z among them, or say which they are (columns x=2,y=3)"
        )
    return _first_ones(table, count)


def _notes_of(chosen: Mapping[AxisName, int], table: Columns, why: str, beside: Collection[int]) -> list[str]:
    """Say which columns were taken as asked, which axis is missing, and which columns are left out."""
    used = {*chosen.values(), *beside}
    left_out = [name or f"column {place + 1}" for place, name in enumerate(table.names) if place not in used]
    notes = [f"columns {', '.join(f'{axis}={place + 1}' for axis, place in chosen.items())}, {why}"] if why else []
    notes += [f"no column {axis}: taken as 0" for axis in "xy" if axis not in chosen]
    return notes + ([f"columns left out: {', '.join(left_out)}"] if left_out else [])


def _first_ones(table: Columns, count: int) -> tuple[dict[AxisName, int], list[str]]:
    """The first two or three columns of a table that names none."""
    values = _with_numbers(table.values[:_BEGINNING])
    if len(values) < _FEWEST_ROWS or any(_counts(values[:, place]) for place in (0, count - 1)):
        values = _with_numbers(table.values)  # what the beginning does not count, all do not either
    first_three: dict[AxisName, int] = {"x": 0, "y": 1, "z": 2}
    if count == 2:
        return {"x": 0, "y": 1}, []
    if count == 3:
        _refuse_count_among_three(values)
        return first_three, []
    if _counts(values[:, 0]):
        counted = ", ".join(f"{value:g}" for value in values[:3, 0])
        raise PointFileError(
            f"the first column counts the rows ({counted} ...); expected x, y, z first, or a header line that names the columns x, y, z, "
            "or say which they are (columns x=2,y=3,z=4)"
        )
    if (count == 6 and are_directions(table.values)) or (count == 4 and _counts(values[:, 3])):
        return first_three, [f"the first three of {count} columns taken as x, y, z"]
    raise PointFileError(
        f"{count} columns without names: which of them are x, y and z? Expected a header line that names them, "
        "or say which they are (columns x=1,y=2,z=3)"
    )


def _refuse_count_among_three(values: Array) -> None:
    """Ask where one of three unnamed columns may be a number or a time: number, x, y, or x, y, number."""
    for place, others, columns in ((0, values[:, 1:], "x=2,y=3"), (2, values[:, :2], "x=1,y=2")):
        flat = bool(np.any(np.ptp(others, axis=0) == 0)) if len(others) else True  # with one at a constant height, the column is an axis
        if _counts(values[:, place]) and not flat:
            counted = ", ".join(f"{value:g}" for value in values[:3, place])
            raise PointFileError(
                f"{'the first' if place == 0 else 'the last'} of three columns counts the rows or the time ({counted} ...), or is it a "
                f"coordinate? Expected a header line that names the columns, or say which they are (columns {columns}, or x=1,y=2,z=3)"
            )


def _counts(column: Array) -> bool:
    """Tell whether a column (m,) only counts: equal steps, or whole numbers that only rise or only fall."""
    steps = np.diff(column)
    if len(column) < _FEWEST_ROWS or not (np.all(steps > 0) or np.all(steps < 0)):
        return False
    even = bool(np.ptp(steps) <= _EVEN * abs(float(steps[0])) + 4 * np.spacing(np.abs(column).max()))
    return even or bool(np.all(column == np.round(column)))


def _with_numbers(values: Array) -> Array:
    """The rows (k, c) whose numbers are all there."""
    return values[np.isfinite(values).all(axis=1)]


def are_directions(values: Array) -> bool:
    """Tell whether the last three of six columns are vectors that all have length 1, in rows whose numbers are all there."""
    count = 0
    for first in range(0, len(values), _BEGINNING):
        length: NDArray[np.float64] = np.linalg.norm(_with_numbers(values[first : first + _BEGINNING])[:, 3:], axis=1)
        if not np.all(np.abs(length - 1.0) <= _UNIT_LENGTH):
            return False
        count += len(length)
    return count > 0
