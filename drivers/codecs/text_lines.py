"""Bytes of a machine tool's control to lines of text: what every language that a control prints has in common.

Lines end with carriage return, line feed or both. The characters that switch readers and tapes on and off (DC1 to DC4, which XON and XOFF
are, and NUL) mean nothing here, and may stand anywhere. Where seven data bits and a parity bit come as eight bits, the parity is checked
here: the systems' serial ports do not tell of it. A line that holds any other character is damaged as a whole.

Numbers are as DPRNT prints them: leading zeros may be missing or blanks, also between the sign and the first digit, and the point may be
missing where no decimals were asked for. In a field of a pattern an exponent may follow, as computers print it.
"""

import re
from collections.abc import Callable, Iterator, Mapping
from types import MappingProxyType

LONGEST_LINE = 256  # bytes; what is longer is no line of a control
MM_PER_UNIT: Mapping[str, float] = MappingProxyType({"mm": 1.0, "inch": 25.4})
NUMBER = r"[+-]? *(?:[0-9]{1,9}(?:\.[0-9]{0,9})?|\.[0-9]{1,9})"
_REQUEST = re.compile(r"0*[1-9][0-9]{0,6}")  # controls hold seven digits exactly
NO_REQUEST = "line whose number of a request is none from 1 to 9999999"
_FIELD = re.compile(rf"{NUMBER}(?:[eE][+-]?0{{0,2}}[0-9])?")  # computers print exponents, controls do not
_UNSEEN_BYTES = bytes((0x00, 0x11, 0x12, 0x13, 0x14))
_PRINTABLE = bytes(range(0x20, 0x7F))
_WITHOUT_PARITY = bytes(byte & 0x7F for byte in range(256))
_ODD_ONES = bytes(byte for byte in range(256) if byte.bit_count() % 2)
_EVEN_ONES = bytes(byte for byte in range(256) if not byte.bit_count() % 2)
_WRONG: Mapping[str, bytes] = MappingProxyType({"": b"", "even": _ODD_ONES, "odd": _EVEN_ONES})
_FEATURES = re.compile(r"\A *(?:POSN|SIZE|ANG|COMPONENT +NO|FEATURE +NO|\+{3,} *OUT OF TOL)|ACTUAL .*(?:TOL|DEV)", re.IGNORECASE)


def is_feature_print(line: str) -> bool:
    """Tell whether a line is of the print-out of features that Renishaw's Inspection Plus makes."""
    return _FEATURES.search(line) is not None


FEATURES = (
    "the machine prints features (Renishaw Inspection Plus: POSN, SIZE, COMPONENT NO), not points: there is no profile in them. "
    "Let the program print each touched point, as docs/machines.md shows"
)


def number_of(text: str) -> float | None:
    """Return the number that stands in a field, which may end with an exponent of one digit; None where none does."""
    bare = text.strip(" ")
    return float(bare.replace(" ", "")) if _FIELD.fullmatch(bare) else None


def request_in(text: str) -> int | None:
    """Return the number by which a control asks for a verdict; None where it is none that a variable of a control holds exactly.

    0 is none: that is what a variable holds which nobody has set.
    """
    bare = text.strip(" ").removesuffix(".")
    return int(bare) if _REQUEST.fullmatch(bare) else None


def unit_in_mm(unit: str) -> float:
    """Return how many mm a unit is. Raises ValueError for one that controls do not measure in."""
    if unit not in MM_PER_UNIT:
        raise ValueError(f"unit {unit!r} is none of {', '.join(MM_PER_UNIT)}")
    return MM_PER_UNIT[unit]


class TextLines:
    """Cuts bytes into lines. What is no line goes to `damage`: its size in bytes, and why."""

    def __init__(self, damage: Callable[[int, str], None], parity: str = "") -> None:
        """`parity` is even or odd where the bytes carry it as their eighth bit; nothing where they carry none."""
        if parity not in _WRONG:
            raise ValueError(f"parity {parity!r} is neither even nor odd; leave it out where the bytes carry none")
        self._damage = damage
        self._parity = parity
        sound = bytes(byte for byte in b"\r\n\x8d\x8a" if byte not in _WRONG[parity] and (parity or byte < 0x80))
        self._ends = re.compile(b"[" + sound + b"]")
        self._pending = b""
        self._overlong = False

    def feed(self, data: bytes) -> Iterator[tuple[str, int]]:
        """Take the next bytes; give each line that ends in them, without blanks around it, and its size in bytes."""
        *lines, pending = self._ends.split(self._pending + data)
        self._pending = b""  # whoever stops listening, at the end of the scan or because of a line, needs no more of it
        for line in lines:
            rest = self._without_excess(line)
            overlong, self._overlong = self._overlong, False
            text, flaw = ("", "no line end in time") if overlong else self._text(rest)
            if flaw:
                self._damage(len(rest) + 1, flaw)
            elif text:
                yield text, len(rest) + 1
        self._pending = self._without_excess(pending)

    def break_off(self) -> None:
        """Count the begun line, if any, as damaged."""
        if self._pending:
            self._damage(len(self._pending), "line cut off where the link ended")
        self._pending, self._overlong = b"", False

    def _without_excess(self, line: bytes) -> bytes:
        """Count what no line can hold as damage at fixed places, so that garbage without a line end needs no memory."""
        while len(line) > LONGEST_LINE:
            self._damage(LONGEST_LINE, "no line end in time")
            line, self._overlong = line[LONGEST_LINE:], True
        return line

    def _text(self, line: bytes) -> tuple[str, str]:
        """The characters of a line, or what is wrong with it."""
        if self._parity:
            if len(line.translate(None, _WRONG[self._parity])) < len(line):
                return "", "parity wrong"
            line = line.translate(_WITHOUT_PARITY)
        bare = line.translate(None, _UNSEEN_BYTES).replace(b"\t", b" ")
        if bare.translate(None, _PRINTABLE):
            return "", "line with characters that no control prints; are data bits and parity set as at the control?"
        return bare.decode("ascii").strip(" "), ""
