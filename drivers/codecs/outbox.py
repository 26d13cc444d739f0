"""What a decoder hands over, in the order in which it happened; every codec shares it.

Points are cheap only together. So a decoder collects them, and they become one batch as soon as anything else happens.
Every point passes here, and no point leaves that no part can have. The end of the scan is the last thing that leaves: what a
device sends behind it is not of this scan.
"""

from collections.abc import Callable

import numpy as np

from drivers.source import Arrival, Lost, PointBatch, Rejected, ScanClosed

LARGEST_MM = 1e6  # of a coordinate, as in files of points
NO_PART = f"coordinates that no part can have: not finite, or farther than {LARGEST_MM:,.0f} mm from zero"
NO_TIME = "time that is no number"


def sifted(batch: PointBatch) -> list[Arrival]:
    """Return the points that a part can have as one batch, behind the count of those that it cannot have."""
    possible = (np.abs(batch.points_mm) <= LARGEST_MM).all(axis=1)  # false for what is no number, too
    timed = np.isfinite(batch.time_s)
    good = possible & timed
    if good.all():
        return [batch]
    counts = ((int((~possible).sum()), NO_PART), (int((possible & ~timed).sum()), NO_TIME))
    found: list[Arrival] = [Rejected(count, reason) for count, reason in counts if count]
    if good.any():
        found.append(PointBatch(batch.sequence[good], batch.time_s[good], batch.points_mm[good]))
    return found


class Outbox:
    """Arrivals that wait to be handed over.

    closed           whether the end of the scan was appended
    take_collected   returns what the decoder has collected since the last call as one arrival, or None; it is called before
                     anything else is appended, so that the order stays the order of the wire
    """

    def __init__(self, take_collected: Callable[[], Arrival | None] = lambda: None) -> None:
        self._take_collected = take_collected
        self._waiting: list[Arrival] = []
        self.closed = False

    def append(self, arrival: Arrival) -> None:
        """Append an arrival behind everything that was collected; nothing is appended behind the end of the scan."""
        self.flush()
        self._append(arrival)

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
            self._append(collected)

    def hand_over(self) -> list[Arrival]:
        """Return everything since the last call."""
        self.flush()
        waiting, self._waiting = self._waiting, []
        return waiting

    def _append(self, arrival: Arrival) -> None:
        if not self.closed:
            self._waiting += sifted(arrival) if isinstance(arrival, PointBatch) else [arrival]
            self.closed = isinstance(arrival, ScanClosed)
