"""Rows of decimal numbers without powers, thousands at a time: the same to the last bit as one after the other, in a quarter of the time.

Eight digits are read from memory as one integer and put together by three multiplications (Lemire 2021, "Number parsing at a gigabyte
per second"). Digits that make an integer below 1e15, and the power of ten that they are divided by, are float64 exactly, so their
quotient is rounded once, as the nearest float64 of a text is (Clinger 1990). Whatever else a text may be is left to others.
"""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Places = NDArray[np.int64]
Words = NDArray[np.uint64]

_WORD = 8  # digits in a word
_DIGITS = 15  # of an integer that a float64 holds exactly, as any smaller one
_ZEROS = np.uint64(int.from_bytes(b"0" * _WORD, "little"))
_LAST = np.array(
    [(1 << 64) - (1 << 8 * (_WORD - kept)) for kept in range(_WORD + 1)], dtype=np.uint64
)  # of a word, the last so many letters
_POWERS = 10 ** np.arange(_DIGITS + 1)
_EXACT_POWERS = _POWERS.astype(np.float64)
_TEN, _ODD, _HALF = np.uint64(10), np.uint64(0x000000FF000000FF), np.uint64(32)
_OF_FIRST, _OF_SECOND = np.uint64(100 + (1_000_000 << 32)), np.uint64(1 + (10_000 << 32))


def decimal_rows(text: bytes, delimiter: str | None) -> Array | None:
    """The numbers (m, c) of whole lines, which end with a line feed each; None where they are not all of the plainest kind.

    That kind is a sign or none, at most 15 digits, and a decimal point or none, with as many numbers on every line.

    delimiter : what stands between two numbers; None for blanks and tabs, of which there may be several, as well at the ends of a line
    """
    if not text.endswith(b"\n"):
        return None
    letters = np.frombuffer(b"0" * _WORD + text, dtype=np.uint8)  # so that a word ends with any letter
    marks = np.flatnonzero(letters - np.uint8(ord("0")) > 9)  # what lies before the digits comes out large as well
    kinds = letters[marks]
    is_end, is_point, is_sign = kinds == ord("\n"), kinds == ord("."), _is_one_of(kinds, b"+-")
    is_stop = is_end | _is_one_of(kinds, delimiter.encode() if delimiter else b" \t")
    at = np.flatnonzero(is_stop)  # numpy takes what is told by number in a third of the time of what is marked
    stops, line = marks[at], (np.cumsum(is_end) - is_end)[at]
    starts = np.append(_WORD, stops[:-1] + 1)
    if delimiter is None:
        filled = stops > starts
        starts, stops, line = starts[filled], stops[filled], line[filled]
    lines = int(np.count_nonzero(is_end))
    columns = len(stops) // max(lines, 1)
    if (
        not columns
        or np.count_nonzero(is_stop | is_point | is_sign) < len(kinds)
        or not np.array_equal(line, np.repeat(np.arange(lines), columns))
    ):
        return None
    signs = np.count_nonzero(is_sign)
    negative = letters[starts] == ord("-")
    signed = negative | (letters[starts] == ord("+")) if signs else negative
    sizes = _sizes(letters, starts + signed, stops, marks[np.flatnonzero(is_point)]) if np.count_nonzero(signed) == signs else None
    return None if sizes is None else np.where(negative, -sizes, sizes).reshape(-1, columns)


def _is_one_of(letters: NDArray[np.uint8], which: bytes) -> NDArray[np.bool_]:
    found = np.zeros(len(letters), dtype=np.bool_)
    for letter in which:
        found |= letters == letter
    return found


def _sizes(letters: NDArray[np.uint8], starts: Places, stops: Places, points: Places) -> Array | None:
    """The numbers (k,) without signs between places (k,) in a text of digits and of decimal points at places (p,)."""
    of_each = _point_of_each(starts, stops, points)
    if of_each is None:
        return None
    before, behind = of_each - starts, np.maximum(stops - of_each - 1, 0)
    if (before + behind).min() < 1 or before.max() > _WORD or behind.max() > _DIGITS:
        return None
    whole = _integers(letters, of_each, before)
    if np.any(whole >= _POWERS[_DIGITS - behind]):
        return None
    whole = whole * _POWERS[behind] + _integers(letters, stops, np.minimum(behind, _WORD))
    if behind.max() > _WORD:
        whole += _integers(letters, stops - _WORD, np.maximum(behind - _WORD, 0)) * _POWERS[_WORD]
    return np.asarray(whole / _EXACT_POWERS[behind])


def _point_of_each(starts: Places, stops: Places, points: Places) -> Places | None:
    """Where the decimal points of numbers are, or would follow (k,); None where a number has two."""
    if len(points) == len(stops):
        return points if np.all((starts <= points) & (points < stops)) else None
    nearest = np.append(points, np.iinfo(np.int64).max)[np.searchsorted(points, starts)]
    return np.minimum(nearest, stops) if np.count_nonzero(nearest < stops) == len(points) else None


def _integers(letters: NDArray[np.uint8], stops: Places, counts: Places) -> Places:
    """The integers (k,) of the last 0 to 8 digits (k,) before places (k,)."""
    words: Words = np.ndarray(len(letters) - _WORD + 1, dtype="<u8", buffer=letters, strides=(1,))[stops - _WORD]
    words ^= _ZEROS
    words &= _LAST[counts]
    words = words * _TEN + (words >> np.uint64(8))
    words = ((words & _ODD) * _OF_FIRST + ((words >> np.uint64(16)) & _ODD) * _OF_SECOND) >> _HALF
    return words.view(np.int64)
