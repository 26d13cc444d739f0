"""The characteristics of a part while it is measured, evaluated beside the run for whoever looks on.

They are evaluated one after the other, with rests between them that are longer than the work. What is found is for display: every
verdict is reached at the end, over all points, without it.
"""

import logging
from time import perf_counter

from cmmlink.beside import Beside
from inspection import CharacteristicResult, LiveInspection, ScanSoFar

_REST = 3.0  # times as long as the work before it
_EVERY_S = 0.4  # two evaluations are at least so far apart, so that whoever looks on is not flooded
_log = logging.getLogger(__name__)


class LiveCharacteristics:
    """Evaluates what one run is asked for, as long as it is entered as a context. All methods are called by the run's thread."""

    def __init__(self, live: LiveInspection) -> None:
        self._live, self._evaluation = live, live.evaluation_so_far()
        self._beside = Beside(self._look, "characteristics")
        self._found: tuple[CharacteristicResult, ...] | None = None
        self._began_s = 0.0

    def __enter__(self) -> "LiveCharacteristics":
        """Begin with what was asked for, of which nothing is known yet."""
        self._beside.hand(self._evaluation.nothing)
        return self

    def __exit__(self, *_: object) -> None:
        """End it, whatever it is at."""
        self._beside.__exit__()

    def end_soon(self) -> None:
        """Let it end after the characteristic that it is at: nobody need wait for that."""
        self._beside.end_soon()

    def offer(self) -> None:
        """Hand over the points so far where enough are new."""
        if self._beside.is_due(self._live.received) and (scan := self._live.so_far()) is not None:
            self._beside.hand(scan)

    def news(self) -> tuple[CharacteristicResult, ...] | None:
        """What was found since it was last asked for; None where nothing new was."""
        found, self._found = self._found, None
        return found

    def _look(self, scan: ScanSoFar) -> bool:
        began_s = self._began_s = perf_counter()
        try:
            found = self._evaluation.evaluate(scan, self._rest)
        except Exception:  # whatever is wrong in what is shown beside a run must not end the run
            _log.exception("the characteristics cannot be shown while the scan runs")
            return True
        if found is not None:
            self._found = found
        return self._beside.is_over(max(_EVERY_S - (perf_counter() - began_s), 0.0) if scan.received else 0.0)

    def _rest(self) -> bool:
        """Rest after a piece of work, and tell whether the run is over."""
        is_over = self._beside.is_over(_REST * (perf_counter() - self._began_s))
        self._began_s = perf_counter()
        return is_over
