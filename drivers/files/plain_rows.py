"""The rows of a long file of nothing but plain numbers, read as a stream: its text is never held as a whole.

Here a row is one line of as many numbers as every other, apart by one delimiter. Whatever else a line may be is not understood here but
refused: such a file is read with care (text_table).
"""

from collections.abc import Callable, Iterator
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from drivers.files.row_reading import shorten

Array = NDArray[np.float64]
Room = Callable[[tuple[int, ...], type[np.generic]], NDArray[Any]]
"""Gives an array of a shape and a type, whose values are not set: numpy.empty, or what keeps long arrays on a disk."""

_CHUNK = 1 << 16
_ROWS_AT_ONCE = 1 << 13
_SIGNS = b"0123456789+-eEnNaAiIfF \r\n"  # numbers, nan and inf; what else these letters spell is no number and is refused


def read_plain_rows(file: BinaryIO, delimiter: str | None, decimal: str, room: Room = np.empty, first_line: int = 1) -> Array:
    """Read the rest of a file, which holds at least a line, as numbers (m, c), the same to the last bit as reading with care gives.

    room       : gives the array of a long file
    first_line : number of the line that the rest begins with

    Raises ValueError, which names the line, where anything else than such rows is in it.
    """
    lines = _Lines(file, delimiter, decimal, first_line)
    values = _parse(lines.take(_ROWS_AT_ONCE), delimiter, first_line)
    count = len(values)
    if count < _ROWS_AT_ONCE:
        return values
    begun, values = values, room((count + _most_lines(file) + 1, values.shape[1]), np.float64)
    values[:count] = begun
    while rows := lines.take(_ROWS_AT_ONCE):
        values[count : count + len(rows)] = _parse(rows, delimiter, first_line + count, values.shape[1])
        count += len(rows)
    return values[:count]


def _parse(lines: list[str], delimiter: str | None, first_line: int, columns: int = 0) -> Array:
    """Numbers of lines (m, c), where they are as many on every line; of a file that goes on, as many as above."""
    found = _numbers(lines, delimiter)
    if found is not None and len(found) == len(lines) and columns in (0, found.shape[1]):
        return found
    columns = columns or (0 if (first := _numbers(lines[:1], delimiter)) is None else first.shape[1])
    for number, line in enumerate(lines, first_line):
        found = _numbers([line], delimiter)
        if found is None or found.shape != (1, columns):
            raise ValueError(_words_of(number, line))
    raise ValueError(f"line {first_line}: the rows from here on are not plain numbers")


def _numbers(lines: list[str], delimiter: str | None) -> Array | None:
    if not all(map(str.strip, lines)):
        return None  # of which numpy would warn
    try:
        return np.loadtxt(lines, delimiter=delimiter, comments=None, ndmin=2)
    except ValueError:
        return None


def _words_of(number: int, line: str) -> str:
    return f"line {number} ('{shorten(line.strip())}') is no row of plain numbers like the first one"


def _most_lines(file: BinaryIO) -> int:
    """How many lines can end between here and the end of a file, or in what was read of it ahead."""
    here = file.tell()
    file.seek(max(0, here - 2 * _CHUNK))
    count = 0
    while chunk := file.read(_CHUNK):
        count += chunk.count(b"\n")
    file.seek(here)
    return count


class _Lines:
    """The lines of a file, with decimal points."""

    def __init__(self, file: BinaryIO, delimiter: str | None, decimal: str, first_line: int) -> None:
        self._file, self._decimal, self._next_line = file, decimal.encode(), first_line
        self._signs = _SIGNS + self._decimal + (delimiter or "\t").encode()
        self._coming, self._ready = self._pieces(), list[str]()

    def take(self, count: int) -> list[str]:
        """The next lines, so many or all that are left."""
        while len(self._ready) < count and (lines := next(self._coming, None)) is not None:
            self._ready += lines
        taken, self._ready = self._ready[:count], self._ready[count:]
        return taken

    def _pieces(self) -> Iterator[list[str]]:
        begun = b""  # a line whose end is still to come
        while chunk := self._file.read(_CHUNK):
            if chunk.translate(None, self._signs) or len(begun) > _CHUNK:
                self._refuse(begun + chunk)
            whole, end, begun = (begun + chunk).rpartition(b"\n")
            yield self._lines(whole + end)
        yield self._lines(begun.rstrip(b"\r"))

    def _lines(self, chunk: bytes) -> list[str]:
        if chunk.count(b"\r") != chunk.count(b"\r\n"):
            self._refuse(chunk)
        lines = chunk.replace(self._decimal, b".").decode("ascii").splitlines()
        self._next_line += len(lines)
        return lines

    def _refuse(self, chunk: bytes) -> None:
        """Raise ValueError for the first line of a chunk that is not of plain numbers, or ends in another way than the others."""
        inside = self._signs.translate(None, b"\r\n")
        for number, line in enumerate(chunk.split(b"\n"), self._next_line):
            if line.removesuffix(b"\r").translate(None, inside) or len(line) > _CHUNK:
                raise ValueError(_words_of(number, line.decode("latin-1")))
        raise ValueError(f"line {self._next_line}: a line here is very long")
