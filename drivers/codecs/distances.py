"""Distances of a one-dimensional sensor to points (0, 0, distance): the rules that do not depend on the sensor's bytes.

A sensor's distances are numbered from 0. Two things are asked of each: that it is a distance at all, which the codec says,
and that it does not jump. The codecs have no checksum to go by: the jump is what gives a flipped bit away.
"""

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from drivers.codecs.outbox import Outbox
from drivers.source import Arrival, PointBatch, Rejected, ScanClosed

JUMP = "jump larger than the plan allows"


class Distances:
    """The account of one scan's distances.

    seconds           turns readings of the sensor's clock, (m,), into seconds
    gap               what a loss is called
    count             the scan ends after so many distances, received or lost; None: it goes on
    largest_step_mm   a distance that is further than this from the one before it is rejected; None: every distance is believed
    out               where the points go, and where the codec appends what else happens
    """

    def __init__(
        self,
        seconds: Callable[[NDArray[np.int64]], NDArray[np.float64]],
        *,
        gap: str,
        count: int | None,
        largest_step_mm: float | None,
    ) -> None:
        self.expected = 0
        self.closed = False
        self.out = Outbox(self._batch)
        self._seconds = seconds
        self._gap = gap
        self._count = count
        self._largest_step_mm = math.inf if largest_step_mm is None else largest_step_mm
        self._before_mm: float | None = None
        self._numbers: list[int] = []
        self._readings: list[int] = []
        self._distances_mm: list[float] = []

    def take(self, number: int, reading: int, distance_mm: float | None, *, lost: int = 0, refusal: str = "") -> None:
        """Take one distance with its number and the reading of the clock; after the end of the scan nothing is taken.

        `lost` counts the distances missing before it. `refusal` says why the device's value cannot be used. `distance_mm` is
        None where the value is no distance at all, so that the next distance is compared with an earlier one.
        """
        if self.closed:
            return
        if lost:
            self.out.append_loss(lost, self._gap)
        if distance_mm is not None:
            before_mm, self._before_mm = self._before_mm, distance_mm
            if not refusal and before_mm is not None and abs(distance_mm - before_mm) > self._largest_step_mm:
                refusal = JUMP
        if refusal:
            self.out.append(Rejected(1, refusal))
        else:
            self._numbers.append(number)
            self._readings.append(reading)
            self._distances_mm.append(distance_mm if distance_mm is not None else 0.0)
        self._reach(number + 1)

    def miss(self) -> None:
        """Count one distance that was due and is lost."""
        if not self.closed:
            self.out.append_loss(1, self._gap)
            self._reach(self.expected + 1)

    def would_end(self, number: int) -> bool:
        """Tell whether the distance with this number is the last one of the scan."""
        return self._count is not None and number + 1 >= self._count

    def room(self, most: int) -> int:
        """Return how many distances, at most `most`, `take_many` may take: those that do not end the scan."""
        return most if self._count is None else min(most, int(self._count) - 1 - self.expected)

    def are_steady(self, distance_mm: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Tell of each of (m,) consecutive distances whether it does not jump from the one before it."""
        before_mm = distance_mm[0] if self._before_mm is None else self._before_mm
        return np.asarray(np.abs(np.diff(distance_mm, prepend=before_mm)) <= self._largest_step_mm)

    def take_many(self, readings: NDArray[np.int64], distance_mm: NDArray[np.float64]) -> None:
        """Take (m,) distances, m > 0, that are the next ones in order and known to be good, with their readings of the clock."""
        self.out.flush()  # the clock is read in the order in which it ran
        numbers = self.expected + np.arange(len(distance_mm))
        self.expected += len(distance_mm)
        self._before_mm = float(distance_mm[-1])
        self.out.append(PointBatch(numbers, self._seconds(readings), _points_mm(distance_mm)))

    def _reach(self, expected: int) -> None:
        """Note the number of the next distance; the scan ends where its count is reached."""
        self.expected = max(self.expected, expected)  # a late one moves nothing
        if self.would_end(self.expected - 1):
            self.out.append(ScanClosed(None))
            self.closed = True

    def _batch(self) -> Arrival | None:
        """Return the distances taken one by one as one batch."""
        if not self._numbers:
            return None
        sequence = np.array(self._numbers, dtype=np.int64)
        time_s = self._seconds(np.array(self._readings, dtype=np.int64))
        points_mm = _points_mm(np.array(self._distances_mm))
        self._numbers, self._readings, self._distances_mm = [], [], []
        return PointBatch(sequence, time_s, points_mm)


def _points_mm(distance_mm: NDArray[np.float64]) -> NDArray[np.float64]:
    points_mm = np.zeros((len(distance_mm), 3))
    points_mm[:, 2] = distance_mm
    return points_mm
