"""XML written element by element, so that a document of any size needs no memory."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from decimal import Decimal
from html import escape
from typing import TextIO

from cmmlink.words import printable

Value = str | int | float


class XmlStream:
    """Writes one document in UTF-8. Text is put on one line, without signs that XML does not know."""

    def __init__(self, file: TextIO) -> None:
        file.write('<?xml version="1.0" encoding="UTF-8"?>\n')
        self._file = file
        self._depth = 0

    @contextmanager
    def __call__(self, name: str, /, **attributes: Value) -> Iterator[None]:
        """An element that holds what is written while it is entered."""
        self._write(f"<{name}{_spelled(attributes)}>")
        self._depth += 1
        yield
        self._depth -= 1
        self._write(f"</{name}>")

    def leaf(self, name: str, value: Value | None = None, /, **attributes: Value) -> None:
        """An element that holds a value, or nothing."""
        end = "/>" if value is None else f">{escape(spelled(value), quote=False)}</{name}>"
        self._write(f"<{name}{_spelled(attributes)}{end}")

    def _write(self, line: str) -> None:
        self._file.write(f"{'  ' * self._depth}{line}\n")


def _spelled(attributes: Mapping[str, Value]) -> str:
    return "".join(f' {name}="{escape(spelled(value))}"' for name, value in attributes.items())


def spelled(value: Value) -> str:
    """A value as text: a number with all its digits, but without an exponent, which a decimal of XML has not."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return format(Decimal(repr(value)), "f")
    return str(value) if isinstance(value, int) else " ".join(printable(value).split())
