"""The bounded hand-over between acquisition and inspection: what does not fit waits, nothing is dropped."""

import threading
from collections import deque
from typing import Generic, TypeVar

Item = TypeVar("Item")

CAPACITY_POINTS = 500_000  # what a run may hold back when its plan does not say otherwise


class Buffer(Generic[Item]):
    """A queue from one producing thread to one consuming thread, first in, first out.

    capacity : what may wait, in the units of `size` (points)
    waiting, peak, stalls : how much waits now, how much waited at most so far, and how often the producer had to wait
    """

    def __init__(self, capacity: int) -> None:
        if capacity < 1:
            raise ValueError(f"the buffer must hold at least one point, not {capacity}")
        self.capacity = capacity
        self.waiting = self.peak = self.stalls = 0
        self._items: deque[tuple[int, Item]] = deque()
        self._changed = threading.Condition()
        self._closed = False

    def give(self, item: Item, size: int = 0) -> bool:
        """Hand an item over, after waiting while the buffer is full. Returns False once the buffer is closed.

        An item larger than the whole buffer passes when nothing else waits.
        """
        with self._changed:
            if self._full(size):
                self.stalls += 1
                self._changed.wait_for(lambda: self._closed or not self._full(size))
            if self._closed:
                return False
            self._items.append((size, item))
            self.waiting += size
            self.peak = max(self.peak, self.waiting)
            self._changed.notify_all()
            return True

    def take(self, timeout_s: float, most: int | None = None) -> list[Item]:
        """Take what waits, in order: everything, or items until they have the size `most` together. Nothing came in time: an empty list."""
        with self._changed:
            self._changed.wait_for(lambda: bool(self._items), timeout_s)
            taken: list[Item] = []
            size = 0
            while self._items and (most is None or size < most):
                each, item = self._items.popleft()
                taken.append(item)
                size += each
            self.waiting -= size
            self._changed.notify_all()
            return taken

    def close(self) -> None:
        """Wake a waiting producer; every later `give` returns False."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()

    def _full(self, size: int) -> bool:
        return self.waiting > 0 and self.waiting + size > self.capacity
