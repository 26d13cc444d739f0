"""Shows that a command is at work and how far it has come, once that takes more than a second and somebody looks."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from threading import Lock, Timer
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.progress import Progress

PATIENCE_S = 1.0  # before anything is shown
Tell = Callable[[float], None]


@contextmanager
def progress(what: str, patience_s: float = PATIENCE_S) -> Iterator[Tell]:
    """Show on standard error what is being done while this is entered, with the time it takes; what is printed must wait until it is left.

    Yields what may be told the share done, from 0 to 1; until it is, the bar only moves. Nothing shows where standard error is no
    terminal.
    """
    if not sys.stderr.isatty():
        yield lambda share: None
        return
    bar = _Bar(what, patience_s)
    try:
        yield bar.tell
    finally:
        bar.end()


class _Bar:
    """A bar that comes up by itself, in a thread of its own, for the command may be busy with one long step."""

    def __init__(self, what: str, patience_s: float) -> None:
        self._what, self._share = what, 0.0
        self._lock, self._ended = Lock(), False
        self._shown: Progress | None = None
        self._timer = Timer(patience_s, self._show)
        self._timer.daemon = True
        with suppress(RuntimeError):  # the system has no thread to give: the command works all the same
            self._timer.start()

    def tell(self, share: float) -> None:
        """Say how much is done."""
        with self._lock:
            self._share = share
            self._update()

    def end(self) -> None:
        """Take the bar off the screen."""
        self._timer.cancel()
        with self._lock:
            self._ended = True
            if self._shown is not None:
                self._shown.stop()

    def _show(self) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

        with self._lock:
            if self._ended:
                return
            columns = (TextColumn("{task.description}", markup=False), BarColumn(bar_width=30), TimeElapsedColumn())
            self._shown = Progress(*columns, console=Console(stderr=True), transient=True)
            self._shown.add_task(self._what, total=None)
            self._update()
            self._shown.start()

    def _update(self) -> None:
        if self._shown is not None and self._share > 0:
            self._shown.update(self._shown.task_ids[0], total=1.0, completed=self._share)
