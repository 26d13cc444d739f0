"""What stands around the points in the lines of a dat file: a title, the limits of a flow grid, words behind the last point.

Lines that are left out are blanked, so that every other line keeps its number. What may be a point is never left out as words.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass

from drivers import count_of, numbers_of, shorten
from inspection import NominalError

_LEFT_OUT = "#"
_COMMENT_STARTS = ("#", "%", "!", "/")
_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eEdD][-+]?\d+)?")
_FEWEST_ROWS = 3  # a table: fewer rows of numbers before words may be part of a title


@dataclass(frozen=True, slots=True)
class DatLines:
    """The lines of a dat file, those blanked that hold no points.

    lines         : every line of the file
    notes         : what was left out
    title_line    : the line of the title, from 1; 0 for none
    title_numbers : the two numbers that the title begins with, if it does: it may be the first point and a remark
    """

    lines: tuple[str, ...]
    notes: tuple[str, ...]
    title_line: int
    title_numbers: tuple[float, ...]


def leave_out_words(text: str) -> DatLines:
    """Blank the title, the grid line of MSES and the words behind the points. Raises NominalError where a second table begins."""
    lines, notes = text.replace("\t", " ").split("\n"), list[str]()
    numbers = [numbers_of(line) for line in lines]
    title_line, title_numbers = _blank_title(lines, numbers, notes)
    rows = [i for i, found in enumerate(numbers) if found and lines[i] != _LEFT_OUT]
    if rows:
        _blank_words_behind(lines, rows[-1], notes)
        _refuse_second_table(lines, rows)
    return DatLines(tuple(lines), tuple(notes), title_line, title_numbers)


def _blank_title(lines: list[str], numbers: list[list[float]], notes: list[str]) -> tuple[int, tuple[float, ...]]:
    """Blank the title and the grid line; return the line of the title, and the two numbers that it begins with, if it does."""
    filled = [i for i, line in enumerate(lines) if line.strip()][:3]
    columns = [len(numbers[i]) for i in filled]
    number, begins = 0, list[float]()
    if columns[0] == 0 or columns[0] not in (2, columns[-1]):
        title, number = lines[filled[0]].strip(), filled[0] + 1
        notes.append(f"title: {title[:60]}")
        begins = (numbers_of(" ".join(_words(title)[:2])) or _numbers_in_disguise(title)) if columns[0] == 0 else []
        lines[filled[0]] = _LEFT_OUT
    if len(filled) > 2 and columns[1] in (4, 5) and columns[2] == 2:
        notes.append(f"line {filled[1] + 1}: {columns[1]} numbers, the limits of a flow grid, left out")
        lines[filled[1]] = _LEFT_OUT
    return number, tuple(begins) if len(begins) == 2 else ()


def _numbers_in_disguise(title: str) -> list[float]:
    """Two numbers with brackets, units or letters about them, like (1.0, 0.0) or 1.0f 0.0f; none where words say more."""
    found = _NUMBER.findall(title)
    rest = _NUMBER.sub("", title)
    return numbers_of(" ".join(found)) if len(found) == 2 and not re.search(r"[^\W\d_]{3}", rest) else []


def _blank_words_behind(lines: list[str], last_row: int, notes: list[str]) -> None:
    """Blank the lines behind the last row of numbers, if they are words: a damaged row is not."""
    behind = [i for i in range(last_row + 1, len(lines)) if lines[i].strip()]
    said = [i for i in behind if not lines[i].strip().startswith(_COMMENT_STARTS)]
    if not said or not all(_is_words(lines[i]) for i in said):
        return
    place = f"line {said[0] + 1}" if len(said) == 1 else f"lines {said[0] + 1} to {said[-1] + 1}"
    notes.append(f"{place}, behind the last point, left out: '{shorten(lines[said[0]].strip())}'")
    for i in said:
        lines[i] = _LEFT_OUT


def _refuse_second_table(lines: Sequence[str], rows: Sequence[int]) -> None:
    """Refuse numbers under a heading of their own behind the points: a polar, or another profile."""
    for before, after in zip(range(_FEWEST_ROWS, len(rows)), rows[_FEWEST_ROWS:], strict=True):
        heading = [i for i in range(rows[before - 1] + 1, after) if _is_words(lines[i])]
        if heading:
            raise NominalError(
                f"line {heading[0] + 1}: '{shorten(lines[heading[0]].strip())}' begins a second block of numbers "
                f"({count_of(len(rows) - before, 'row')} from line {after + 1} on); expected one profile in a file: move the block to a "
                "file of its own, or begin its lines with #"
            )


def _is_words(line: str) -> bool:
    """Tell whether a line holds words, and is no damaged row: a number alone, or with one more word or number behind it, may be one."""
    words = _words(line)
    if not words or line.strip().startswith(_COMMENT_STARTS) or numbers_of(line):
        return False
    return not (numbers_of(words[0]) and (len(words) < 3 or numbers_of(words[1])))


def _words(line: str) -> list[str]:
    return [word for word in re.split(r"[\s,;]+", line) if word]
