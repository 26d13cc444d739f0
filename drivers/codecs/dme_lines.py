"""The lines of an I++ DME server: where they end, what stands in them, and what an error of the machine means.

A line is `TAG SP SIGN [SP DATA]`, of printable ASCII, ended by carriage return and line feed, at most 65,536 characters long. The sign
is `&` for acknowledged, `#` for data, `!` for an error and `%` for complete. A line that is not so is damage and is never read.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from drivers.source import Damaged

LONGEST_LINE = 65_536
EVENT_TAG = "E0000"  # of what the server says without being asked

_LINE = re.compile(r"([0-9]{5}|E[0-9]{4}) ([&#!%])(?: (.*))?")
_NUMERAL = r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{1,3})?"
_NUMBER = re.compile(_NUMERAL)
_NUMBERS = re.compile(rf" *{_NUMERAL} *(?:, *{_NUMERAL} *)*")
_ERROR = re.compile(r'Error\( *([0-9]) *, *([0-9]{4}) *, *("[^"]*"|[^,"]*?) *, *"([^"]*)" *\)')
_VALUE = re.compile(r' *([A-Za-z][A-Za-z0-9.]*)\(((?:"[^"]*"|\([^()"]*\)|[^()"])*)\) *(?:,|$)')
_MOST_DIGITS = 16
_BREAKDOWN = 2  # from this severity on the machine gives up what it does

_SEVERITIES: Mapping[int, str] = MappingProxyType({0: "information", 1: "warning", 2: "repairable", 3: "somebody must help", 9: "fatal"})
_ADVICE: Mapping[int, str] = MappingProxyType(
    {
        6: "the command was given up; see at the machine why",
        8: "a session runs already; close the other program that uses the machine",
        500: "release the emergency stop when it is safe, and measure again",
        501: "this machine does not know the command; choose another kind of scan in the plan",
        502: "this machine takes other arguments; choose another dialect or kind of scan in the plan",
        504: "choose a value that the machine allows",
        503: "the controller does not answer; restart it",
        507: "the machine is not ready for it; is it homed, and has it a tool?",
        514: "an earlier error was not cleared; clear it at the machine",
        1000: "clear the error at the machine",
        1001: "the probe touched where nothing was expected; is the part where the plan says, and the way free?",
        1002: "no surface was touched; is the part where the plan says?",
        1003: "no surface was touched; is the part where the plan says?",
        1005: "homing failed; look after the machine",
        1006: "no surface was found; is the part where the plan says?",
        1008: "a target lies outside the machine's volume; is the coordinate system the right one?",
        1009: "see to the air pressure",
        1010: "a direction has no length; check the directions in the plan",
        1011: "an axis cannot move; look after the machine",
        1500: "seat the probe head again",
        1501: "the probe is not armed",
        1502: "the machine knows no such tool; check device.tool in the plan",
        1503: "the tool is not defined; calibrate it",
        2000: "the tool is not calibrated",
        2001: "the probe was pressed too hard; is the way free?",
        2002: "this probe cannot scan; choose another tool, or single points: device.scan.type: points",
        2500: "a limit of the machine was reached; is the coordinate system the right one?",
        2504: "the machine collided; look after it before it moves again",
    }
)


@dataclass(frozen=True, slots=True)
class Response:
    """One sound line of the server."""

    tag: str
    sign: str
    data: str

    @property
    def size(self) -> int:
        """How many bytes the line has."""
        return len(self.tag) + 4 + (len(self.data) + 1 if self.data else 0)


@dataclass(frozen=True, slots=True)
class MachineError:
    """An error as the machine tells it; the cause comes quoted from real servers, and bare in the specification's examples."""

    severity: int
    code: int
    cause: str
    text: str

    @property
    def is_breakdown(self) -> bool:
        """Whether the machine gave up what it did, so that it takes nothing more before its errors are cleared."""
        return self.severity >= _BREAKDOWN

    @property
    def words(self) -> str:
        """The error for the operator."""
        kind = _SEVERITIES.get(self.severity, f"severity {self.severity}")
        told = f"error {self.code:04d} ({kind}), {self.text!r}"
        return f"{told}: {_ADVICE[self.code]}" if self.code in _ADVICE else told


class LineReader:
    """Cuts what comes from the server into its lines; the cuts of the network do not matter."""

    def __init__(self) -> None:
        self._pending = b""
        self._overlong = False

    def feed(self, data: bytes) -> list[Response | Damaged]:
        """Return the lines that are whole by now."""
        lines = (self._pending + data).split(b"\n")
        self._pending = lines.pop()
        found = [self._read(line) for line in lines]
        while len(self._pending) > LONGEST_LINE + 1:  # its carriage return
            found.append(Damaged(LONGEST_LINE, "line longer than the specification allows"))
            self._pending, self._overlong = self._pending[LONGEST_LINE:], True
        return found

    def break_off(self) -> list[Damaged]:
        """Count the line that was begun."""
        count, self._pending, self._overlong = len(self._pending), b"", False
        return [Damaged(count, "line cut off where the link ended")] if count else []

    def _read(self, line: bytes) -> Response | Damaged:
        overlong, self._overlong = self._overlong, False
        size = len(line) + 1
        if overlong or size > LONGEST_LINE + 2:
            return Damaged(size, "line longer than the specification allows")
        if not line.endswith(b"\r"):
            return Damaged(size, "line that ends with line feed alone, not with carriage return and line feed")
        body = line[:-1]
        if not body.isascii() or not body.decode("ascii").isprintable():
            return Damaged(size, "line with characters that the specification forbids")
        found = _LINE.fullmatch(body.decode("ascii"))
        if found is None or (found[2] in "#!") != (found[3] is not None):
            return Damaged(size, "line that is no answer")
        return Response(found[1], found[2], found[3] or "")


def numbers_in(data: str) -> list[float] | None:
    """Read bare numbers between commas, as scans send them; None unless every one is a number of the specification."""
    fields = data.split(",")
    if max(map(len, fields)) <= _MOST_DIGITS:  # none has too many digits
        return list(map(float, fields)) if _NUMBERS.fullmatch(data) else None
    found = [number_in(field) for field in fields]
    return None if any(number is None for number in found) else [number for number in found if number is not None]


def number_in(text: str) -> float | None:
    """Read one number: a sign, digits and a point, an exponent of up to three digits, at most 16 digits in all; None for anything else."""
    bare = text.strip(" ")
    if not _NUMBER.fullmatch(bare) or sum(map(str.isdigit, re.split("[eE]", bare)[0])) > _MOST_DIGITS:
        return None
    return float(bare)


def values_in(data: str) -> dict[str, str] | None:
    """Read `Name(arguments), Name(arguments)` as a mapping; None where the text is not so, or names a value twice."""
    found: dict[str, str] = {}
    at = 0
    while at < len(data):
        value = _VALUE.match(data, at)
        if value is None or value[1] in found:
            return None
        found[value[1]] = value[2].strip(" ")
        at = value.end()
    return found if found and not data.rstrip(" ").endswith(",") else None


def error_in(data: str) -> MachineError | None:
    """Read `Error(severity, code, cause, "text")`; None where it is not so."""
    found = _ERROR.fullmatch(data)
    return None if found is None else MachineError(int(found[1]), int(found[2]), found[3].strip('"'), found[4])
