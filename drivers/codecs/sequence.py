"""What a device's running counters say: which frame is new, behind a gap, late or repeated, and at what time it was.

Counters wrap; here they are unwrapped. Every number between the first and the last one seen is either received
or lost, and a number counted as lost that comes late after all is taken back. What came with the newest numbers is remembered, so
that a repetition is told from another point under an old number, as a device sends it that counts anew without saying so.
"""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

GAPS_REMEMBERED = 4096  # bounds the memory; a frame later than that many gaps counts as repeated
CONTENTS_REMEMBERED = 512  # of the newest frames; nobody repeats an older one
_MIXED = np.array([0x9E3779B97F4A7C1, 0x5851F42D4C957F2D, 0x2545F4914F6CDD1D])  # odd multipliers that spread over 64 bits
MOST_POINTS = 1 << 48  # of a scan: at a million points a second it would last nine years


@dataclass(frozen=True, slots=True)
class Place:
    """Where a frame stands. `lost` counts the frames missing before it, and is -1 for a late frame.

    repeated : its number has been
    same     : it is known to be the very frame that came under this number; of a frame that is not repeated this says nothing
    """

    sequence: int
    lost: int
    repeated: bool
    same: bool = True


class SequenceCounter:
    """Unwraps a counter of the given modulus; the first frame of a scan has number 0."""

    def __init__(self, modulus: int, first: int = 0) -> None:
        self.modulus = modulus
        self.expected = first
        self._lost = first  # what is not received of the numbers below the expected one
        self._gaps: deque[range] = deque(maxlen=GAPS_REMEMBERED)
        self._numbers = np.full(CONTENTS_REMEMBERED, -1, dtype=np.int64)
        self._contents = np.zeros(CONTENTS_REMEMBERED, dtype=np.int64)

    def place(self, counter: int, near: int | None = None, content: int = 0) -> Place:
        """Unwrap `counter` to the number closest to `near` (default: the expected one) and account for it.

        content : a number below 2**63 that frames which differ do not share
        """
        sequence = self.unwrap(counter, near)
        ahead = sequence - self.expected
        if ahead >= 0:
            self._remember(range(self.expected, sequence))
            self._lost += ahead
            self.expected = sequence + 1
            self._note(sequence, np.array([content], dtype=np.int64))
            return Place(sequence, ahead, repeated=False)
        if self._fill(sequence):
            self._lost -= 1
            self._note(sequence, np.array([content], dtype=np.int64))
            return Place(sequence, -1, repeated=False)
        at = sequence % CONTENTS_REMEMBERED
        return Place(sequence, 0, repeated=True, same=bool(self._numbers[at] == sequence and self._contents[at] == content))

    def take(self, contents: Sequence[int] | NDArray[np.int64]) -> None:
        """Take (m,) frames that are the next ones in order, given by their contents."""
        self._note(self.expected, np.asarray(contents[-CONTENTS_REMEMBERED:], dtype=np.int64), len(contents))
        self.expected += len(contents)

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

    def _note(self, first: int, contents: NDArray[np.int64], count: int = 1) -> None:
        """Remember what the last of `count` frames from the number `first` on hold."""
        numbers = first + count - len(contents) + np.arange(len(contents))
        self._numbers[numbers % CONTENTS_REMEMBERED] = numbers
        self._contents[numbers % CONTENTS_REMEMBERED] = contents

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


def contents_of(ticks: NDArray[np.int64], xyz: NDArray[np.integer]) -> NDArray[np.int64]:
    """Return a number for each of m points that points with another time (m,) or place (m, 3) do not share, but for a rare chance."""
    return np.asarray(xyz.astype(np.int64) @ _MIXED + ticks)  # an overflow wraps, which is as good


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
