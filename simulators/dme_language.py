"""The language of I++ DME as a server reads it: tags, commands with their arguments, and the errors it answers with.

Written from the specification's rules of the line, without a look at the client.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

LONGEST = 65_536
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*(?:\.[A-Za-z][A-Za-z0-9_]*)*")
_NUMERAL = re.compile(r"[+-]?[0-9.]*(?:[eE][+-]?[0-9]*)?")

ERRORS: Mapping[int, tuple[int, str]] = MappingProxyType(
    {
        1: (2, "Illegal tag"),
        2: (2, "No space at position 6"),
        6: (2, "Transaction aborted (Use ClearAllErrors to Continue)"),
        7: (3, "Illegal character"),
        8: (3, "Protocol error"),
        500: (3, "Emergency stop"),
        501: (3, "Unsupported command"),
        502: (3, "Incorrect Arguments"),
        504: (1, "Argument out of range"),
        507: (3, "Illegal command"),
        508: (3, "Bad context"),
        509: (3, "Bad Argument"),
        510: (3, "Bad property"),
        513: (2, "Daemon does not exist"),
        514: (2, "Use ClearAllErrors to continue"),
        515: (2, "Daemon already exists"),
        1001: (2, "Illegal touch"),
        1006: (2, "Surface not found"),
        1007: (3, "Theta out of range"),
        1008: (3, "Target position out of machine volume"),
        1010: (2, "Vector has no norm"),
        1502: (3, "Tool not found"),
        1503: (3, "Tool not defined"),
        2002: (3, "Probe cannot do this"),
        2500: (3, "Machine limit encountered [Move Out Of Limits]"),
    }
)


class Refused(Exception):  # noqa: N818 - it is an answer of the machine, no fault of the program
    """The server refuses a command, with the code of the error."""

    def __init__(self, code: int) -> None:
        super().__init__(code)
        self.code = code


@dataclass(frozen=True, slots=True)
class Text:
    """A text between quotes."""

    value: str


@dataclass(frozen=True, slots=True)
class Word:
    """A bare word: the name of a coordinate system, or a tag."""

    value: str


@dataclass(frozen=True, slots=True)
class Call:
    """A name with arguments in brackets: a command, an axis, a property."""

    name: str
    arguments: tuple["Argument", ...]


Argument = float | Text | Word | Call


def split_tag(line: str) -> tuple[str, str]:
    """Take a line apart into tag and command. Raises Refused where the tag is none, or no blank follows it."""
    tag = line[:5]
    if not re.fullmatch(r"[0-9]{5}|E[0-9]{4}", tag) or tag in ("00000", "E0000"):
        raise Refused(1)
    if line[5:6] != " ":
        raise Refused(1 if line[5:6] else 2)
    return tag, line[6:]


def parse(command: str) -> Call:
    """Read one command. Raises Refused."""
    name = _NAME.match(command)
    if name is None:
        raise Refused(507)
    bracket = name.end() + (command[name.end() : name.end() + 1] == " ")  # servers bear a blank there
    if command[bracket : bracket + 1] != "(":
        raise Refused(502)
    reader = _Reader(command, bracket)
    found = Call(name[0], reader.arguments())
    if reader.rest:
        raise Refused(507)
    return found


class _Reader:
    """Reads arguments from an opening bracket on."""

    def __init__(self, text: str, at: int) -> None:
        self._text, self._at = text, at

    @property
    def rest(self) -> str:
        """What follows what was read."""
        return self._text[self._at :]

    def arguments(self) -> tuple[Argument, ...]:
        """Read the arguments and their closing bracket."""
        self._at += 1
        self._skip_blanks()
        found: list[Argument] = []
        if self._next() == ")":
            self._at += 1
            return ()
        while True:
            found.append(self._argument())
            self._skip_blanks()
            mark = self._next()
            self._at += 1
            if mark == ")":
                return tuple(found)
            if mark != ",":
                raise Refused(502)
            self._skip_blanks()

    def _argument(self) -> Argument:
        mark = self._next()
        if mark == '"':
            return self._quoted()
        if mark and mark in "+-.0123456789":
            return self._numeral()
        name = _NAME.match(self._text, self._at)
        if name is None:
            raise Refused(502)
        self._at = name.end()
        return Call(name[0], self.arguments()) if self._next() == "(" else Word(name[0])

    def _quoted(self) -> Text:
        end = self._text.find('"', self._at + 1)
        if end <= self._at + 1:  # without an end, or empty
            raise Refused(509)
        found = Text(self._text[self._at + 1 : end])
        self._at = end + 1
        return found

    def _numeral(self) -> float:
        found = _NUMERAL.match(self._text, self._at)
        assert found is not None
        self._at = found.end()
        mantissa, _, exponent = found[0].upper().partition("E")
        digits = sum(map(str.isdigit, mantissa))
        has_exponent = "E" in found[0].upper()
        if not 1 <= digits <= 16 or mantissa.count(".") > 1:
            raise Refused(509)
        if has_exponent and not re.fullmatch(r"[+-]?[0-9]{1,3}", exponent):
            raise Refused(509)
        return float(found[0])

    def _next(self) -> str:
        return self._text[self._at : self._at + 1]

    def _skip_blanks(self) -> None:
        while self._next() == " ":
            self._at += 1


def numbers_of(call: Call, *counts: int) -> list[float]:
    """The arguments of a command that takes so many numbers. Raises Refused."""
    found = [one for one in call.arguments if isinstance(one, float)]
    if len(call.arguments) not in counts or len(found) != len(call.arguments):
        raise Refused(502)
    return found


def text_of(call: Call) -> str:
    """The one text that a command takes. Raises Refused."""
    if len(call.arguments) != 1:
        raise Refused(502)
    [only] = call.arguments
    if not isinstance(only, Text):
        raise Refused(509)
    return only.value


def names_of(call: Call, allowed: frozenset[str]) -> list[str]:
    """The names that a command takes with empty brackets, each once. Raises Refused."""
    found = [one.name for one in call.arguments if isinstance(one, Call) and not one.arguments and one.name in allowed]
    if not found or len(found) != len(call.arguments) or len(set(found)) != len(found):
        raise Refused(502)
    return found


def axis_values(call: Call, allowed: frozenset[str], code: int = 509) -> dict[str, tuple[float, ...]]:
    """The values of axes, X(1), and of a direction, IJK(0,0,1), each named once. Raises Refused, with `code` for an axis without one."""
    found: dict[str, tuple[float, ...]] = {}
    for one in call.arguments:
        if not isinstance(one, Call) or one.name not in allowed or one.name in found:
            raise Refused(502)
        values = tuple(value for value in one.arguments if isinstance(value, float))
        if len(values) != len(one.arguments) or len(values) != (3 if one.name == "IJK" else 1):
            raise Refused(502 if one.name == "IJK" else code)
        found[one.name] = values
    if not found:
        raise Refused(502)
    return found


def without_arguments(call: Call) -> None:
    """Raise Refused where a command that takes none has arguments."""
    if call.arguments:
        raise Refused(502)


def spelled(value: float) -> str:
    """Spell a number of an answer: up to six digits behind the point."""
    return f"{value:.6f}".rstrip("0").rstrip(".") or "0"
