"""One thing that the station does: a run, a replay, a test of the device, or the inspection of a surface.

The station has one job at a time and replaces it as a whole. Everything that belongs to it hangs on it: its thread, its
device, the event that aborts it, the view that pages look at, and what came of it.
"""

import threading
from collections.abc import Callable
from typing import Literal

from cmmlink.errors import PlanError
from cmmlink.run import FinishedRun
from cmmlink.run_view import RunView
from cmmlink.surface_run import FinishedSurface
from drivers import ScanSource

JobKind = Literal["run", "replay", "device test", "surface", "registers"]


class Job:
    """A job, from the command that begins it to its end.

    Guarded by its own lock, which is held only while the source is set or looked up. What came of a run is written by the job's
    thread alone, and read once `wait` has returned True:

    finished  : the run, where it came to its end
    failure   : the error that broke it off
    unwritten : why the results are not where the plan wants them
    """

    def __init__(self, kind: JobKind, on_end: Callable[[], None]) -> None:
        """`on_end` is called at the very end, in the job's thread or by `give_up`."""
        self.kind = kind
        self.stop = threading.Event()
        self.view: RunView | None = None
        self.finished: FinishedRun | FinishedSurface | None = None
        self.failure: Exception | None = None
        self.unwritten: PlanError | None = None
        self._on_end = on_end
        self._lock = threading.Lock()
        self.moves = False  # a machine, which somebody has to look at
        self._source: ScanSource | None = None
        self._over = False
        self._done = threading.Event()

    @property
    def over(self) -> bool:
        """Whether the job has come to its end."""
        return self._over

    def start(self, work: Callable[[], None]) -> None:
        """Do the work in a thread of its own."""
        threading.Thread(target=self._carry_out, args=(work,), name=self.kind, daemon=True).start()

    def give_up(self) -> None:
        """End a job that was never started."""
        self._end()

    def attach(self, source: ScanSource, *, moves: bool = False) -> None:
        """Set the device that the job listens to, and whether it moves; it is stopped at once where the job was aborted before."""
        with self._lock:
            self._source, self.moves = source, moves
        if self.stop.is_set():
            source.stop()

    def detach(self) -> None:
        """Forget the device, which is not listened to any more."""
        with self._lock:
            self._source = None

    def end_scan(self) -> bool:
        """Stop the device, so that what was received is judged; returns False where nothing is being measured."""
        with self._lock:
            source = self._source
        if source is None or self.view is None or self.view.over:
            return False
        self.view.end_soon()
        source.stop()
        return True

    def abort(self) -> None:
        """Stop as soon as possible; nothing is proven by what was received."""
        self.stop.set()
        if self.view is not None:
            self.view.end_soon()
        with self._lock:
            source = self._source
        if source is not None:
            source.stop()

    def wait(self, timeout_s: float | None = None) -> bool:
        """Wait for the end; returns False when the job is still on."""
        return self._done.wait(timeout_s)

    def _carry_out(self, work: Callable[[], None]) -> None:
        try:
            work()
        finally:
            self._end()

    def _end(self) -> None:
        self.detach()
        self._over = True
        try:
            self._on_end()
        finally:
            self._done.set()
