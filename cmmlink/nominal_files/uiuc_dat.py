"""Airfoil coordinates as the UIUC collection and XFOIL write them.

Selig: a title, then one loop from the trailing edge over the upper side to the leading edge and back below.
Lednicer: a title, a line with the two counts, then the upper and the lower side, each from the leading edge, apart by a
blank line. Found in the wild and understood: no title, a title that looks like numbers, a line of four numbers (the grid
of MSES), rows `999.0 999.0` between blocks, sides in the other direction, sides without a blank line between them, words or a row
of other numbers behind the points.
"""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from cmmlink.nominal_files import NominalFile
from cmmlink.nominal_files.dat_lines import DatLines, leave_out_words
from cmmlink.nominal_files.through_points import through_points
from drivers import UnitName, convert_to_mm, parse_columns
from inspection import NominalError

SUFFIXES = (".dat",)

Array = NDArray[np.float64]
Lines = NDArray[np.int64]
Block = tuple[Array, Lines]  # points (m, 2) and the lines they stand on

_SEPARATOR = 999.0
_CHORD_UNITS = 2.0  # an airfoil this small in mm was almost certainly given in chords
_MOST_LAST_ROWS = 3
_FEWEST_POINTS = 4
_JUMP = 0.8  # of the chord: a step from edge to edge, where one side ends and the next begins


def read(text: str, scale: float, closed: bool | None, unit: UnitName | None) -> NominalFile:
    """Interpolate the one loop, or the two sides joined at the leading edge."""
    given = leave_out_words(text)
    columns, notes = parse_columns("\n".join(given.lines)), list(given.notes)
    if columns.values.shape[1] != 2:
        raise NominalError(f"line {columns.line_numbers[0]}: {columns.values.shape[1]} columns; expected two, x and y")
    table, lines = _without_last_rows(columns.values, columns.line_numbers, notes)
    table, lines, counts = _without_counts(table, lines, notes)
    _refuse_far_rows(table, lines)
    _refuse_title_that_may_be_a_point(given, table)
    blocks = _blocks(table, lines, given.lines, counts)
    kind, (points, order) = _loop(blocks, notes)
    points_mm = convert_to_mm(points, order, scale)
    if scale == 1.0 and unit is None and np.ptp(points_mm, axis=0).max() <= _CHORD_UNITS:
        notes.append("no scale given: a chord of 1 is taken as 1 mm")
    return through_points(points_mm, order, closed, kind, (*columns.notes, *notes))


def _without_last_rows(table: Array, lines: Lines, notes: list[str]) -> tuple[Array, Lines]:
    """Take off last rows that lie far from all points, like a thickness and a camber in percent."""
    for count in range(_MOST_LAST_ROWS, 0, -1):
        others = table[1:-count]  # the first row may count the points
        if len(others) >= _FEWEST_POINTS and all(_is_far_from(row, others) for row in table[-count:]):
            said = [f"line {line}: '{x:g} {y:g}'" for (x, y), line in zip(table[-count:], lines[-count:], strict=True)]
            notes.append(f"{', '.join(said)} {'lies' if count == 1 else 'lie'} far from all points, behind the last: left out")
            return table[:-count], lines[:-count]
    return table, lines


def _refuse_far_rows(table: Array, lines: Lines) -> None:
    """Refuse a point farther from all others than these are from each other: a slip of the decimal point."""
    for i in range(1, len(table)) if len(table) > _FEWEST_POINTS else ():
        if _is_far_from(table[i], np.delete(table, i, axis=0)):
            x, y = table[i]
            raise NominalError(
                f"line {lines[i]}: {x:g} {y:g} lies far from all other points; expected a point of the profile: mend or remove it"
            )


def _refuse_title_that_may_be_a_point(given: DatLines, table: Array) -> None:
    numbers = given.title_numbers
    if numbers and not _is_far_from(np.array(numbers), table):
        raise NominalError(
            f"line {given.title_line}: begins with {numbers[0]:g} {numbers[1]:g}, which may be the first point, and goes on with words; "
            "expected a title that begins with a word, or a point with # before the words"
        )


def _without_counts(table: Array, lines: Lines, notes: list[str]) -> tuple[Array, Lines, tuple[int, int] | None]:
    """Take off what precedes the coordinates: a title that looks like numbers, and the counts of the two sides."""
    if len(table) > 2 and lines[0] == 1 and _is_far_from(table[0], table[2:]) and not _are_counts(table, lines):
        notes.append(f"line 1: '{table[0, 0]:g} {table[0, 1]:g}' lies far from the points: taken as the title")
        table, lines = table[1:], lines[1:]
    if len(table) > 1 and _are_counts(table, lines):
        return table[1:], lines[1:], (int(table[0, 0]), int(table[0, 1]))
    if len(table) > 1 and _is_far_from(table[0], table[1:]):
        raise NominalError(
            f"line {lines[0]}: {table[0, 0]:g} {table[0, 1]:g} is far from the {_points(table[1:])} points that follow; "
            "expected a point, or how many points the two sides have"
        )
    return table, lines, None


def _are_counts(table: Array, lines: Lines) -> bool:
    """Whether the first row holds the two counts: whole numbers with the right sum, set apart by a blank line or by distance."""
    row = table[0]
    whole = np.all(np.isfinite(row)) and np.all(row == np.round(row)) and np.all(row >= 2) and row.sum() == _points(table[1:])
    return bool(whole) and bool(lines[1] - lines[0] > 1 or _is_far_from(row, table[1:]))


def _points(table: Array) -> int:
    return int((table != _SEPARATOR).any(axis=1).sum())


def _is_far_from(point: Array, others: Array) -> bool:
    """Whether a point lies farther from the others than they lie from each other."""
    others = others[(others != _SEPARATOR).any(axis=1)]
    if not len(others) or not np.all(np.abs(others) < 1e9) or np.all(point == _SEPARATOR):
        return False
    low, high = others.min(axis=0), others.max(axis=0)
    size = (high - low).max()
    return bool(np.any(point > high + size) or np.any(point < low - size))


def _blocks(table: Array, lines: Lines, text: Sequence[str], counts: tuple[int, int] | None) -> list[Block]:
    """Cut where the file does: at the counts, at separators, else at blank lines, else where one side jumps to the next."""
    separator = (table == _SEPARATOR).all(axis=1)
    if counts:
        table, lines = table[~separator], lines[~separator]
        return [(table[: counts[0]], lines[: counts[0]]), (table[counts[0] :], lines[counts[0] :])]
    cuts = {int(i) for i in np.flatnonzero(separator)}
    if not cuts:
        cuts = {i for i, (a, b) in enumerate(pairwise(lines), 1) if any(not line.strip() for line in text[a : b - 1])}
    if not cuts:
        cuts = _jump(table)
    borders = [0, *sorted(cuts), len(table)]
    kept = [np.arange(a, b)[~separator[a:b]] for a, b in pairwise(borders)]
    return [(table[rows], lines[rows]) for rows in kept if len(rows)]


def _jump(table: Array) -> set[int]:
    """Where the second side begins, if the table steps back from one edge to the other, once."""
    step = np.hypot(*np.diff(table, axis=0).T)
    jumps = np.flatnonzero(step > _JUMP * np.ptp(table[:, 0])) + 1
    return {int(jumps[0])} if len(jumps) == 1 and 2 < jumps[0] < len(table) - 2 else set()


def _loop(blocks: list[Block], notes: list[str]) -> tuple[str, Block]:
    """Join the blocks to one loop: there is one already, or there are two sides."""
    if len(blocks) > 2:
        raise NominalError(f"line {blocks[2][1][0]}: a third block of points begins; expected one loop or two sides")
    if not blocks:
        raise NominalError("no points between the separators; expected one loop or two sides")
    if len(blocks) == 1:
        return "uiuc-selig", blocks[0]
    (upper, upper_lines), (lower, lower_lines) = blocks
    if _runs_on(upper, lower):
        return "uiuc-selig", (np.vstack([upper, lower]), np.concatenate([upper_lines, lower_lines]))
    _refuse_other_elements(blocks)
    upper, upper_lines = _from_leading_edge(upper, upper_lines, "first", notes)
    lower, lower_lines = _from_leading_edge(lower, lower_lines, "second", notes)
    if np.array_equal(upper[0], lower[0]):
        lower, lower_lines = lower[1:], lower_lines[1:]
    return "uiuc-lednicer", (np.vstack([upper[::-1], lower]), np.concatenate([upper_lines[::-1], lower_lines]))


def _runs_on(first: Array, second: Array) -> bool:
    """Whether the second block goes on at the leading edge where the first ends: a loop with a blank line in it."""
    return bool(first[0, 0] > first[-1, 0] and second[-1, 0] > second[0, 0] and not np.array_equal(first[-1], second[0]))


def _refuse_other_elements(blocks: list[Block]) -> None:
    """Refuse two loops, which are two elements (a flap): the two sides of one profile run from edge to edge."""
    chord = np.ptp(np.concatenate([points[:, 0] for points, _ in blocks]))
    for points, lines in blocks:
        if not abs(points[-1, 0] - points[0, 0]) >= 0.5 * chord:
            raise NominalError(f"line {lines[0]}: a block begins that is no whole side; expected one loop, or two sides of one profile")


def _from_leading_edge(points: Array, lines: Lines, side: str, notes: list[str]) -> Block:
    if points[0, 0] <= points[-1, 0]:
        return points, lines
    notes.append(f"the {side} side is given from the trailing edge: turned round")
    return points[::-1], lines[::-1]
