"""One row of a table: what stands between its columns, which mark is its decimal point, and which numbers it holds."""

import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass

from drivers.errors import PointFileError
from drivers.files.no_numbers import is_no_number

NUMBER = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eEdD][+-]?\d+)?|[+-]?(nan|inf|infinity)", re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class Reading:
    """One way to read a line: what stands between the columns (None: blanks), and the decimal mark."""

    delimiter: str | None
    decimal: str

    def fields(self, line: str) -> list[str]:
        """Split a line into its columns; a delimiter at the very end begins no further column."""
        fields = [field.strip() for field in line.split(self.delimiter)]
        return fields[:-1] if len(fields) > 1 and not fields[-1] else fields

    def is_number(self, field: str) -> bool:
        """Tell whether a field is a number with this decimal mark."""
        if self.decimal == ",":
            field = "?" if "." in field else field.replace(",", ".")
        return NUMBER.fullmatch(field) is not None

    def explains(self, line: str, wanted: Collection[int] = ()) -> bool:
        """Tell whether all fields of a line are numbers, or those in the wanted places."""
        fields = self.fields(line)
        if not wanted:
            return len(fields) > 1 and all(map(self.is_number, fields))
        return len(fields) > max(wanted) and all(self.is_number(fields[place]) for place in wanted)

    def row(self, number: int, line: str, wanted: Collection[int] = ()) -> list[float]:
        """Return the numbers of a line, NaN for words not wanted and for what says that there is none.

        Raises PointFileError, naming the word.
        """
        fields = self.fields(line)
        if wanted and len(fields) == max(wanted):
            fields.append("")  # the last field, which is empty
        asked = wanted if wanted and len(fields) > max(wanted) else range(len(fields))
        if len(fields) > 1 and all(is_no_number(fields[place]) for place in asked):
            return [float("nan")] * len(fields)
        for place in asked:
            field = fields[place]
            if not self.is_number(field) and not is_no_number(field):
                found = f"'{shorten(field)}' is not a number"
                raise PointFileError(f"line {number}: {found}; expected numbers {self}{_hint_of_labels(fields, self)}")
        return [number_of(field) if self.is_number(field) else float("nan") for field in fields]

    def __str__(self) -> str:
        between = {None: "blanks", "\t": "tabs", ";": "semicolons", ",": "commas", "|": "bars"}[self.delimiter]
        return f"with {between} between them and decimal {'commas' if self.decimal == ',' else 'points'}"


# In order of preference where several explain as many lines: a semicolon or a tab is never part of a number.
_MARKS = ((";", "."), (";", ","), ("\t", "."), ("\t", ","), ("|", "."), ("|", ","), (",", "."), (None, "."), (None, ","))
READINGS = tuple(Reading(*marks) for marks in _MARKS)


def number_of(field: str) -> float:
    """The number that a field holds, with either decimal mark; old programs write d for e."""
    return float(field.replace(",", ".").replace("d", "e").replace("D", "e"))


HINT = "; name the columns in a header line, like name,x,y,z, or say which are x and y (columns x=2,y=3)"


def _hint_of_labels(fields: Sequence[str], reading: Reading) -> str:
    """Say what to do where words stand beside two numbers or more: a label has a column of its own."""
    words = [field for field in fields if not reading.is_number(field)]
    if len(fields) - len(words) < 2 or not all(re.match(r"[^\W\d_]{2}", word) for word in words):
        return ""
    return HINT


def shorten(text: str) -> str:
    """Return at most 40 characters of a text, for a message."""
    return text if len(text) <= 40 else text[:37] + "..."
