"""Values that cost time and that many a caller never asks for."""

from collections.abc import Callable
from threading import Lock
from typing import Generic, TypeVar

Value = TypeVar("Value")


class OnFirstUse(Generic[Value]):
    """A value that is made when it is first asked for, once for all threads, and is the same from then on.

    Where making it raises, nothing is kept: the next one to ask makes it anew, and meets the same error.
    """

    __slots__ = ("_lock", "_made", "_make")

    _made: Value

    def __init__(self, make: Callable[[], Value]) -> None:
        self._lock = Lock()
        self._make: Callable[[], Value] | None = make

    @property
    def value(self) -> Value:
        """The value."""
        if self._make is not None:
            with self._lock:
                if self._make is not None:  # nobody else made it while this thread waited
                    self._made = self._make()
                    self._make = None  # and with it what only the making needed
        return self._made
