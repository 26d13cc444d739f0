"""What a link of bytes is, however it is opened: a port, a connection, or a file that grows."""

import threading
from typing import Protocol


class Line(Protocol):
    """An open line; to read and to write raises OSError where it is lost."""

    def read(self) -> bytes:
        """Return what is there, at the latest after a twentieth of a second."""

    def write(self, data: bytes) -> None:
        """Send all of the data."""

    def close(self) -> None:
        """Give the line up."""


class Opener(Protocol):
    """A place whose line is opened in a way of its own.

    words : how messages call the place
    hint  : what to look at where it cannot be opened
    """

    words: str
    hint: str

    def open(self, within_s: float, stopped: threading.Event) -> Line:
        """Open the line. Raises OSError where that does not succeed in time, or `stopped` was set."""
