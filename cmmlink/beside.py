"""A thread beside a run that looks at what the run hands over, and never keeps the run waiting.

The run hands over copies and goes on. Where it hands them over faster than they are looked at, the newest takes the place of the one
that waits. Who looks works in short pieces and sleeps between them, so that whoever shares the interpreter is let through.
"""

import threading
from collections.abc import Callable
from contextlib import suppress
from typing import Generic, TypeVar

Copy = TypeVar("Copy")

_GROWTH = 1 / 32  # share by which the points must have grown before they are handed over again: copying stays cheap
_FEWEST_NEW, _MOST_NEW = 16, 1 << 16  # points, however short or long the scan is


class Beside(Generic[Copy]):
    """Looks at the newest copy of a scan, for as long as it is entered as a context. The run's thread calls all but `is_over`.

    look : takes a copy; True when nothing is left to look for
    """

    def __init__(self, look: Callable[[Copy], bool], name: str) -> None:
        self._look, self._name = look, name
        self._next_offer = 0
        self._waiting: Copy | None = None
        self._handed = threading.Condition()
        self._closing = threading.Event()
        self._thread: threading.Thread | None = None

    def __enter__(self) -> "Beside[Copy]":
        return self

    def __exit__(self, *_: object) -> None:
        """End it, whatever it is at."""
        self.end_soon()
        self.join()

    def end_soon(self) -> None:
        """Let it end after the piece of work that it is at."""
        self._closing.set()
        with self._handed:
            self._handed.notify()

    def join(self, timeout_s: float | None = None) -> None:
        """Wait until it has ended."""
        if self._thread is not None:
            self._thread.join(timeout_s)

    def is_due(self, received: int) -> bool:
        """Whether so many points are enough more than when it last was."""
        if received < self._next_offer:
            return False
        self._next_offer = received + min(max(_FEWEST_NEW, int(received * _GROWTH)), _MOST_NEW)
        return True

    def hand(self, copy: Copy) -> None:
        """Hand over a copy, in place of one that still waits."""
        if self._thread is None:
            thread = threading.Thread(target=self._work, name=self._name, daemon=True)
            with suppress(RuntimeError):  # the system has no thread to give: the run goes on without
                thread.start()
                self._thread = thread
        with self._handed:
            self._waiting = copy
            self._handed.notify()

    def is_over(self, rest_s: float) -> bool:
        """Sleep between two pieces of work, and tell whether the run is over."""
        return self._closing.wait(rest_s)

    def _work(self) -> None:
        while (copy := self._take()) is not None and not self._look(copy):
            pass

    def _take(self) -> Copy | None:
        """Wait for the newest copy; None when the run is over."""
        with self._handed:
            self._handed.wait_for(lambda: self._waiting is not None or self._closing.is_set())
            copy, self._waiting = self._waiting, None
        return None if self._closing.is_set() else copy
