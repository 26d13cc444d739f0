"""The proof in mid-scan that a part will fail, sought beside the run while it goes on.

A proof found is for display: the final verdict is reached over all points without it.
"""

from cmmlink.beside import Beside
from inspection import LiveInspection, Prefix

_LET_THROUGH_S = 2e-4  # slept between two pieces of the search, of a few milliseconds each


class LiveProof:
    """Seeks the proof for one run, as long as it is entered as a context. All methods are called by the run's thread."""

    def __init__(self, live: LiveInspection) -> None:
        self._live, self._search = live, live.prefix_search()
        self._beside = Beside(self._look, "proof")
        self._refuted: int | None = None

    def __enter__(self) -> "LiveProof":
        return self

    def __exit__(self, *_: object) -> None:
        """End the search, whether it knows or not."""
        self._beside.__exit__()

    def end_soon(self) -> None:
        """Let it end after the piece of the search that it is at."""
        self._beside.end_soon()

    @property
    def refuted(self) -> int | None:
        """How many points had been received when no placement was left that passes; None while that is not proven."""
        return self._refuted

    def offer(self) -> None:
        """Hand over the points so far where some look out of tolerance, and where enough are new."""
        if self._refuted is not None or not self._beside.is_due(self._live.received):
            return
        prefix = self._live.prefix()
        if prefix is not None:
            self._beside.hand(prefix)

    def _look(self, prefix: Prefix) -> bool:
        if not self._search.refutes(prefix, lambda: self._beside.is_over(_LET_THROUGH_S)):
            return False
        self._refuted = prefix.received
        return True
