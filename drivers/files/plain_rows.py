"""The rows of a long file of nothing but plain numbers, read as a stream: its text is never held as a whole.

Here a row is one line of as many numbers as every other, apart by one delimiter. Whatever else a line may be is not understood here but
refused: such a file is read with care (text_table).
"""

from collections.abc import Iterator
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

_CHUNK = 1 << 16
_SIGNS = b"0123456789+-eEnNaAiIfF \r\n"  # numbers, nan and inf; what else these letters spell is no number and is refused


def read_plain_rows(file: BinaryIO, delimiter: str | None, decimal: str) -> NDArray[np.float64]:
    """Read the rest of a file, which holds at least a line, as numbers (m, c), the same to the last bit as reading with care gives.

    Raises ValueError where anything else than such rows is in it.
    """
    lines = _Lines(file, delimiter, decimal)
    values: NDArray[np.float64] = np.loadtxt(iter(lines), delimiter=delimiter, comments=None, ndmin=2)
    if len(values) != lines.count:
        raise ValueError(f"{lines.count} lines hold {len(values)} rows")
    return values


class _Lines:
    """The lines of a file, with decimal points. `count` tells how many were given so far."""

    def __init__(self, file: BinaryIO, delimiter: str | None, decimal: str) -> None:
        self.count = 0
        self._file, self._decimal = file, decimal.encode()
        self._signs = _SIGNS + self._decimal + (delimiter or "\t").encode()

    def __iter__(self) -> Iterator[str]:
        begun = b""  # a line whose end is still to come
        while chunk := self._file.read(_CHUNK):
            if chunk.translate(None, self._signs) or len(begun) > _CHUNK:
                raise ValueError("not numbers alone")
            whole, end, begun = (begun + chunk).rpartition(b"\n")
            yield from self._lines(whole + end)
        yield from self._lines(begun.rstrip(b"\r"))

    def _lines(self, chunk: bytes) -> Iterator[str]:
        if chunk.count(b"\r") != chunk.count(b"\r\n"):
            raise ValueError("a line ends in an unusual way")
        lines = chunk.replace(self._decimal, b".").decode("ascii").splitlines()
        self.count += len(lines)
        yield from lines
