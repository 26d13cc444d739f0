"""What a decoder hands over, in the order in which it happened; every codec shares it.

Points are cheap only together. So a decoder collects them, and they become one batch as soon as anything else happens.
"""

from collections.abc import Callable

from drivers.source import Arrival, Lost


class Outbox:
    """Arrivals that wait to be handed over.

    take_collected   returns what the decoder has collected since the last call as one arrival, or None; it is called before
                     anything else is appended, so that the order stays the order of the wire
    """

    def __init__(self, take_collected: Callable[[], Arrival | None] = lambda: None) -> None:
        self._take_collected = take_collected
        self._waiting: list[Arrival] = []

    def append(self, arrival: Arrival) -> None:
        """Append an arrival behind everything that was collected."""
        self.flush()
        self._waiting.append(arrival)

    def append_loss(self, count: int, gap: str = "gap in the sequence numbers") -> None:
        """Append the loss of `count` points under the name of its `gap`; a negative count means that they came late after all."""
        if count:
            self.append(Lost(count, gap if count > 0 else "arrived late after all"))

    def append_overflow(self) -> None:
        """Append that the device itself lost points; its counter will show how many."""
        self.append(Lost(0, "the device says that its buffer overflowed; its counter shows how many"))

    def flush(self) -> None:
        """Append what was collected so far."""
        collected = self._take_collected()
        if collected is not None:
            self._waiting.append(collected)

    def hand_over(self) -> list[Arrival]:
        """Return everything since the last call."""
        self.flush()
        waiting, self._waiting = self._waiting, []
        return waiting
