"""What a device's running counters say: which frame is new, behind a gap, late or repeated, and at what time it was.

Counters wrap; here they are unwrapped. Every number between the first and the last one seen is either received
or lost, and a number counted as lost that comes late after all is taken back.
"""

from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

GAPS_REMEMBERED = 4096  # bounds the memory; a frame later than that many gaps counts as repeated
MOST_POINTS = 1 << 48  # of a scan: at a million points a second it would last nine years


@dataclass(frozen=True, slots=True)
class Place:
    """Where a frame stands. `lost` counts the frames missing before it, and is -1 for a late frame."""

    sequence: int
    lost: int
    repeated: bool


class SequenceCounter:
    """Unwraps a counter of the given modulus; the first frame of a scan has number 0."""

    def __init__(self, modulus: int, first: int = 0) -> None:
        self.modulus = modulus
        self.expected = first
        self._lost = first  # what is not received of the numbers below the expected one
        self._gaps: deque[range] = deque(maxlen=GAPS_REMEMBERED)

    def place(self, counter: int, near: int | None = None) -> Place:
        """Unwrap `counter` to the number closest to `near` (default: the expected one) and account for it."""
        sequence = self.unwrap(counter, near)
        ahead = sequence - self.expected
        if ahead >= 0:
            self._remember(range(self.expected, sequence))
            self._lost += ahead
            self.expected = sequence + 1
            return Place(sequence, ahead, repeated=False)
        if self._fill(sequence):
            self._lost -= 1
            return Place(sequence, -1, repeated=False)
        return Place(sequence, 0, repeated=True)

    def reach(self, counter: int, near: int | None = None) -> int:
        """Take the device's word that `counter` is the next number; return how many frames are newly lost."""
        return self.reach_total(max(self.expected, self.unwrap(counter, near)))

    def reach_total(self, total: int) -> int:
        """Take the device's word that it has sent `total` frames; return how many are newly lost.

        A total that no scan has, or that is less than what was received, is not believed.
        Negative where a gap longer than the counter's range had been taken for a longer one still.
        """
        received = self.expected - self._lost
        if not received <= total <= MOST_POINTS:  # it has sent what arrived, whatever it says
            return 0
        lost = total - self.expected
        self._remember(range(self.expected, total))
        self._lost += lost
        self.expected = total
        return lost

    def unwrap(self, counter: int, near: int | None = None) -> int:
        """Return the number congruent to `counter` that is closest to `near`."""
        anchor = self.expected if near is None else near
        half = self.modulus // 2
        return anchor + (counter - anchor + half) % self.modulus - half

    def _remember(self, gap: range) -> None:
        if gap:
            self._gaps.append(gap)

    def _fill(self, sequence: int) -> bool:
        for index, gap in enumerate(self._gaps):
            if sequence in gap:
                del self._gaps[index]
                self._remember(range(gap.start, sequence))
                self._remember(range(sequence + 1, gap.stop))
                return True
        return False


class WrappingClock:
    """Unwraps a device's clock of the given modulus; steps back (late frames) stay steps back."""

    def __init__(self, modulus: int, ticks_per_second: float) -> None:
        self._modulus = modulus
        self._ticks_per_second = ticks_per_second
        self._last: int | None = None

    def seconds(self, raw: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return the time of each reading, (m,), m > 0."""
        return np.array(self.ticks(raw.tolist())) / self._ticks_per_second

    def ticks(self, raw: list[int]) -> list[int]:
        """Return the unwrapped readings."""
        last = raw[0] if self._last is None else self._last
        half, modulus, unwrapped = self._modulus // 2, self._modulus, []
        for reading in raw:
            last += (reading - last + half) % modulus - half
            unwrapped.append(last)
        self._last = last
        return unwrapped
