"""How many points arrive in a second, over the last second: it falls to zero when nothing comes."""

from collections import deque
from typing import NamedTuple

_OVER_S = 1.0
_STEP_S = 0.05


class _Received(NamedTuple):
    """How many points had been received at a moment of the run's clock."""

    time_s: float
    points: int


class ArrivalRate:
    """The rate of points by how many had been received at moments of the last second. One thread notes; any thread reads."""

    def __init__(self) -> None:
        self._received: deque[_Received] = deque()

    def note(self, time_s: float, points: int) -> None:
        """Take how many points have been received by now."""
        if self._received and time_s - self._received[-1].time_s < _STEP_S:
            return
        self._received.append(_Received(time_s, points))
        while len(self._received) > 2 and time_s - self._received[0].time_s > _OVER_S:
            self._received.popleft()

    def per_s(self, now_s: float) -> float:
        """Points per second."""
        if not self._received:
            return 0.0
        first, last = self._received[0], self._received[-1]
        if last.time_s <= first.time_s:
            return 0.0
        return round((last.points - first.points) / max(last.time_s - first.time_s, now_s - last.time_s), 1)
