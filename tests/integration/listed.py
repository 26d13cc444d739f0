"""A source that says what it is given, and ends as it is told."""

import threading
from collections.abc import Iterable, Iterator

from drivers.source import Arrival


class Listed:
    """A source that yields what it is given, raising what is an exception, until it is stopped."""

    def __init__(self, arrivals: Iterable[Arrival | Exception]) -> None:
        self._arrivals = arrivals
        self._stopped = threading.Event()

    def arrivals(self) -> Iterator[Arrival]:
        for arrival in self._arrivals:
            if self._stopped.is_set():
                return
            if isinstance(arrival, Exception):
                raise arrival
            yield arrival

    def stop(self) -> None:
        self._stopped.set()
