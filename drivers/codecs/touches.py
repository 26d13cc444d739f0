"""Points that a machine touches one by one and prints as text: which of them are new, which are missing, and which cannot be told apart."""

from abc import ABC, abstractmethod

import numpy as np

from drivers.codecs.outbox import Outbox
from drivers.codecs.sequence import Place, SequenceCounter
from drivers.codecs.text_lines import TextLines
from drivers.source import ANOTHER_CONTENT, FRAME_REPEATED, Arrival, Damaged, PointBatch, Rejected, ScanClosed

Point = tuple[float, float, float]
MODULUS = 1 << 40  # no control prints so large a number: nothing wraps
UNKNOWN_LOSS = "end of a scan whose link was lost, with no number behind it that shows how many points were lost"
GAP = "gap in the numbers of the points"


class Touches:
    """The account of the touched points of one scan.

    A stretch of points is numbered in ones. Its first number is believed where its beginning was seen; otherwise numbers run from 1 (or 0),
    and what is missing before the first one that came is lost.

    count : the points of the scan that came or are known to be missing
    """

    def __init__(self, mm_per_unit: float) -> None:
        self.out = Outbox(self._batch)
        self._mm_per_unit = mm_per_unit
        self._before = 0  # points of the stretches before this one
        self._first: int | None = None
        self._counter = SequenceCounter(MODULUS)
        self._beginning_seen = False
        self._link_lost = self._loss_unknown = False
        self._sequence: list[int] = []
        self._points: list[Point] = []

    @property
    def count(self) -> int:
        """How many points of the scan came, or are known to be missing."""
        return self._before + (self._counter.expected - self._first if self._first is not None else 0)

    def begin_stretch(self) -> None:
        """Take note that a stretch begins, whose numbers may begin anew: they tell nothing of what was lost at the end of the last one."""
        self._loss_unknown |= self._link_lost
        self._before, self._first = self.count, None
        self._beginning_seen = True

    def take(self, number: int | None, point: Point, content: int, refusal: str = "") -> None:
        """Take a point with its number, if it has one, in the unit of the machine; `refusal` says why it cannot be used.

        content : a number that lines which differ do not share
        """
        place = self._place(number, content)
        if place.repeated:
            self.out.append(Rejected(1, FRAME_REPEATED if place.same else ANOTHER_CONTENT))
        elif refusal:
            self.out.append(Rejected(1, refusal))
        else:
            self._sequence.append(place.sequence)
            self._points.append(point)

    def miss(self, number: int, reason: str) -> None:
        """Take note that the machine has no point of this number, and why."""
        place = self._place(number, 0)
        if not place.repeated:
            self.out.append(Rejected(1, reason))

    def break_off(self) -> None:
        """Take note that the link was lost: the next number shows how many points were lost with it."""
        self._link_lost = True

    def close(self, size: int) -> None:
        """End the scan, with its last line of so many bytes."""
        if self._link_lost or self._loss_unknown:
            self.damage(size, UNKNOWN_LOSS)
        self.out.append(ScanClosed(None))

    def damage(self, byte_count: int, reason: str) -> None:
        """Count bytes that are no points."""
        self.out.append(Damaged(byte_count, reason))

    def _place(self, number: int | None, content: int) -> Place:
        """Find the place of a number, and count what is missing before it."""
        if self._first is None:
            self._first = number if number is not None and (self._beginning_seen or number < 1) else 0 if number is None else 1
            self._counter = SequenceCounter(MODULUS, self._first)
        self._link_lost &= number is None
        place = self._counter.place(self._counter.expected if number is None else number, content=content)
        self.out.append_loss(place.lost, GAP)
        return Place(self._before + place.sequence - self._first, place.lost, place.repeated, place.same)

    def _batch(self) -> Arrival | None:
        """Return the points collected so far as one batch; machines print no time."""
        if not self._sequence:
            return None
        sequence = np.array(self._sequence, dtype=np.int64)
        points_mm = np.array(self._points, dtype=np.float64) * self._mm_per_unit
        self._sequence, self._points = [], []
        return PointBatch(sequence, np.zeros(len(sequence)), points_mm)


class TouchLines(ABC):
    """Lines of text that a control prints, decoded to touched points up to the end of a scan. A language says what a line means."""

    def __init__(self, mm_per_unit: float, parity: str) -> None:
        """`parity` is even or odd where the bytes carry it as their eighth bit; nothing where they carry none."""
        self._touches = Touches(mm_per_unit)
        self._lines = TextLines(self._damage, parity)

    def request(self) -> bytes:
        """Controls are asked nothing."""
        return b""

    def feed(self, data: bytes) -> list[Arrival]:
        """Decode the next bytes, up to the end of the scan."""
        if not self._touches.out.closed:
            for line, size in self._lines.feed(data):
                self._take_line(line, size)
                if self._touches.out.closed:
                    break
        return self._touches.out.hand_over()

    def break_off(self) -> list[Arrival]:
        """Count the begun line, if any, as damaged."""
        self._lines.break_off()
        self._touches.break_off()
        return self._touches.out.hand_over()

    @abstractmethod
    def _take_line(self, line: str, size: int) -> None:
        """Take a line without its end, of so many bytes with it."""

    def _damage(self, byte_count: int, reason: str) -> None:
        """Count bytes that are no points."""
        self._touches.damage(byte_count, reason)
