"""The proof in mid-scan that a part will fail, sought in a thread of its own while the run goes on.

The run hands over copies of the points so far and never waits; where it hands them over faster than they are looked at, the
newest take the place of those that wait. It works in slices of a few milliseconds, and sleeps between them, so that whoever shares
the interpreter with it is let through. A proof found is for display: the final verdict is reached over all points without it.
"""

import threading
from contextlib import suppress

from inspection import LiveInspection, Prefix

_GROWTH = 1 / 32  # share by which the points must have grown before they are handed over again: copying stays cheap
_FEWEST_NEW, _MOST_NEW = 16, 1 << 16  # points, however short or long the scan is
_LET_THROUGH_S = 2e-4  # slept between two slices


class LiveProof:
    """Seeks the proof for one run, as long as it is entered as a context. All methods are called by the run's thread."""

    def __init__(self, live: LiveInspection) -> None:
        self._live, self._search = live, live.prefix_search()
        self._next_offer = 0
        self._waiting: Prefix | None = None
        self._refuted: int | None = None
        self._handed = threading.Condition()
        self._closing = threading.Event()
        self._thread: threading.Thread | None = None

    def __enter__(self) -> "LiveProof":
        return self

    def __exit__(self, *_: object) -> None:
        """End the search, whether it knows or not."""
        self._closing.set()
        with self._handed:
            self._handed.notify()
        if self._thread is not None:
            self._thread.join()

    @property
    def refuted(self) -> int | None:
        """How many points had been received when no placement was left that passes; None while that is not proven."""
        return self._refuted

    def offer(self) -> None:
        """Hand over the points so far where some look out of tolerance, and where enough are new."""
        received = self._live.received
        if self._refuted is not None or received < self._next_offer:
            return
        self._next_offer = received + min(max(_FEWEST_NEW, int(received * _GROWTH)), _MOST_NEW)
        prefix = self._live.prefix()
        if prefix is None:
            return
        if self._thread is None:
            seeker = threading.Thread(target=self._seek, name="proof", daemon=True)
            with suppress(RuntimeError):  # the system has no thread to give: the run goes on without a proof in mid-scan
                seeker.start()
                self._thread = seeker
        with self._handed:
            self._waiting = prefix
            self._handed.notify()

    def _seek(self) -> None:
        while (prefix := self._take()) is not None:
            if self._search.refutes(prefix, self._is_over):
                self._refuted = prefix.received
                return

    def _is_over(self) -> bool:
        """Let other threads through, and tell whether the run is over."""
        return self._closing.wait(_LET_THROUGH_S)

    def _take(self) -> Prefix | None:
        """Wait for the newest prefix; None when the run is over."""
        with self._handed:
            self._handed.wait_for(lambda: self._waiting is not None or self._closing.is_set())
            prefix, self._waiting = self._waiting, None
        return None if self._closing.is_set() else prefix
