"""A recorded scan as a source: its wire bytes decoded anew, or its points as they were recorded.

A run that was cut short ends here as it ended then: with the same failure, or with `stop` for one that was aborted.
"""

from collections.abc import Iterable, Iterator
from threading import Event

from drivers.errors import DeviceError
from drivers.source import Arrival, Decoder, LinkDown, LinkUp, WireBytes


class Capture:
    """Plays recorded arrivals, in their order."""

    def __init__(self, recorded: Iterable[Arrival], decoder: Decoder | None, failure: str = "") -> None:
        """Take the recorded arrivals, and the `failure` that ended the scan; it is raised as a DeviceError where they end.

        With a `decoder` the wire bytes are decoded anew and what was decoded then is passed over; without one every arrival is given
        as it was recorded.
        """
        self._recorded, self._decoder, self._failure = recorded, decoder, failure
        self._stopped = Event()

    def stop(self) -> None:
        """End `arrivals` after the next arrival."""
        self._stopped.set()

    def arrivals(self) -> Iterator[Arrival]:
        """Yield what was recorded. Raises DeviceError where the scan failed, and whatever the decoder raises."""
        try:
            for arrival in self._recorded:
                if self._stopped.is_set():
                    return
                yield from [arrival] if self._decoder is None else _decode(arrival, self._decoder)
            if self._failure:
                raise DeviceError(self._failure)
        except DeviceError:
            if self._decoder is not None:
                yield from self._decoder.break_off()
            raise


def _decode(arrival: Arrival, decoder: Decoder) -> Iterator[Arrival]:
    if isinstance(arrival, LinkDown):
        yield from decoder.break_off()  # what the source did when the link was lost
    if isinstance(arrival, WireBytes | LinkDown | LinkUp):
        yield arrival
    if isinstance(arrival, WireBytes):
        yield from decoder.feed(arrival.data)
