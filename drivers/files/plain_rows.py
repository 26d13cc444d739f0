"""The rows of a long file of nothing but plain numbers, read as a stream: its text is never held as a whole.

Here a row is one line of as many numbers as every other, apart by one delimiter. Whatever else a line may be is not understood here but
refused: such a file is read with care (text_table).
"""

from collections.abc import Callable, Iterator
from typing import Any, BinaryIO, NoReturn

import numpy as np
from numpy.typing import NDArray

from drivers.files.decimal_rows import decimal_rows
from drivers.files.row_reading import shorten

Array = NDArray[np.float64]
Room = Callable[[tuple[int, ...], type[np.generic]], NDArray[Any]]
"""Gives an array of a shape and a type, whose values are not set: numpy.empty, or what keeps long arrays on a disk."""

_CHUNK = 1 << 17  # some thousand lines, which stay in the cache while they are read
_SIGNS = b"0123456789+-eEnNaAiIfF \r\n"  # numbers, nan and inf; what else these letters spell is no number and is refused


def read_plain_rows(file: BinaryIO, delimiter: str | None, decimal: str, room: Room = np.empty, first_line: int = 1) -> Array:
    """Read the rest of a file, which holds at least a line, as numbers (m, c), the same to the last bit as reading with care gives.

    room       : gives the array of a long file
    first_line : number of the line that the rest begins with

    Raises ValueError, which names the line, where anything else than such rows is in it.
    """
    pieces = _pieces(file, delimiter, decimal, first_line)
    values = _parse(next(pieces), delimiter, first_line)
    count, piece = len(values), next(pieces, None)
    if piece is None:
        return values
    begun, values = values, room((count + piece.count(b"\n") + _most_lines(file) + 1, values.shape[1]), np.float64)
    values[:count] = begun
    while piece is not None:
        found = _parse(piece, delimiter, first_line + count, values.shape[1])
        values[count : count + len(found)] = found
        count, piece = count + len(found), next(pieces, None)
    return values[:count]


def _parse(text: bytes, delimiter: str | None, first_line: int, columns: int = 0) -> Array:
    """Numbers of whole lines (m, c), where they are as many on every line; of a file that goes on, as many as above."""
    found = decimal_rows(text, delimiter)
    if found is not None and columns in (0, found.shape[1]):
        return found
    lines = text.decode("ascii").splitlines()
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


def _pieces(file: BinaryIO, delimiter: str | None, decimal: str, first_line: int) -> Iterator[bytes]:
    """The rest of a file, some thousand whole lines at a time, with decimal points and a line feed at the end of every line.

    Raises ValueError for the first line that is not of plain numbers, or ends in another way than the others.
    """
    signs = _SIGNS + decimal.encode() + (delimiter or "\t").encode()
    begun = b""  # a line whose end is still to come
    while chunk := file.read(_CHUNK):
        if chunk.translate(None, signs) or len(begun) > _CHUNK:
            _refuse(begun + chunk, signs, first_line)
        whole, end, begun = (begun + chunk).rpartition(b"\n")
        if piece := _with_points(whole + end, signs, decimal, first_line):
            first_line += piece.count(b"\n")
            yield piece
    if piece := _with_points(begun.rstrip(b"\r"), signs, decimal, first_line):
        yield piece + b"\n"


def _with_points(lines: bytes, signs: bytes, decimal: str, first_line: int) -> bytes:
    ends = lines.count(b"\r")
    if ends != (lines.count(b"\r\n") if ends else 0):
        _refuse(lines, signs, first_line)
    return (lines.replace(b"\r", b"") if ends else lines).replace(decimal.encode(), b".")


def _refuse(text: bytes, signs: bytes, first_line: int) -> NoReturn:
    inside = signs.translate(None, b"\r\n")
    for number, line in enumerate(text.split(b"\n"), first_line):
        if line.removesuffix(b"\r").translate(None, inside) or len(line) > _CHUNK:
            raise ValueError(_words_of(number, line.decode("latin-1")))
    raise ValueError(f"line {first_line}: a line here is very long")
