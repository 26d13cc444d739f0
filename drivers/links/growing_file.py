"""A file that a control, or a program beside it, writes line by line, read as it grows.

The file is opened anew for each look, so that nobody is kept from writing, moving or deleting it. A control may begin its file anew for
each part: before anything was read, all that stands in it then is new. A file that no longer holds what was read of it is lost like a
cable: which of its lines are of this scan nobody knows.
"""

import threading
import time
from collections.abc import Callable
from pathlib import Path

LOOK_S = 0.05
LARGEST_READ = 1 << 16
_REMEMBERED = 256  # bytes before the place where reading goes on


class GrowingFile:
    """The file at a path, which need not be there yet."""

    def __init__(self, path: Path, *, existing: bool, sleep: Callable[[float], None] = time.sleep) -> None:
        """`existing` says that what stands in the file already is read, too."""
        self._path, self._existing, self._sleep = path, existing, sleep
        self.words = str(path)
        self.hint = "is the folder reachable, and may the file be read?"

    def open(self, within_s: float, stopped: threading.Event) -> "OpenFile":
        """Look where the file ends by now. Raises OSError where its folder is not there, or the file cannot be read."""
        if not self._path.parent.is_dir():
            raise NotADirectoryError(f"there is no folder {self._path.parent}")
        place = 0
        if not self._existing and self._path.exists():
            with self._path.open("rb") as file:
                place = file.seek(0, 2)
        return OpenFile(self._path, place, self._sleep)


class OpenFile:
    """A file that is read like a line from a place on."""

    def __init__(self, path: Path, place: int, sleep: Callable[[float], None]) -> None:
        self._path, self._place, self._sleep = path, place, sleep
        self._has_read = False
        self._before = b""
        if place:
            self._before = self._bytes(max(0, place - _REMEMBERED), min(place, _REMEMBERED))

    def read(self) -> bytes:
        """Return what was written since, after a moment where nothing was. Raises OSError where what was read is no longer there."""
        try:
            found = self._bytes(self._place - len(self._before), len(self._before) + LARGEST_READ)
        except FileNotFoundError:
            found = b""
        if found[: len(self._before)] != self._before:
            if self._has_read:
                raise OSError("the file was written anew, or is gone; what was read of it is no longer there")
            self._place, self._before = 0, b""
            return b""
        data = found[len(self._before) :]
        if not data:
            self._sleep(LOOK_S)
            return b""
        self._place, self._has_read = self._place + len(data), True
        self._before = found[-_REMEMBERED:]
        return data

    def write(self, data: bytes) -> None:
        """Nothing is written: whoever writes the file is not listening."""

    def close(self) -> None:
        """Nothing is open between two looks."""

    def _bytes(self, first: int, count: int) -> bytes:
        with self._path.open("rb") as file:
            file.seek(first)
            return file.read(count)
