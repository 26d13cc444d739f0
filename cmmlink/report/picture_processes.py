"""Pictures drawn by other processes, while this one does what comes before and beside them.

A process draws one picture at a time. It ends with this one, however that ends: nothing comes through its pipe any more. What it has not
drawn is drawn here, where an error can be told, and looks the same.
"""

import os
import pickle
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack, closing, suppress
from pathlib import Path
from queue import SimpleQueue
from threading import Semaphore
from types import TracebackType
from typing import TYPE_CHECKING, Self

from cmmlink.report.picture_content import PictureContent
from cmmlink.report.report_input import ReportInput

if TYPE_CHECKING:  # whoever only starts a process loads no matplotlib
    from cmmlink.report.picture import ProfilePictures

_MOST_PROCESSES = 4  # each holds a hundred megabytes
_WAITING = 2  # pictures for each process, so that a stack of thousands does not fill the memory with them
_CHILD = "import sys; sys.path.append(sys.argv[1]); from cmmlink.report.picture_processes import serve; serve()"
_DRAWN, _FAILED = b"+", b"-"

Sheet = PictureContent | ReportInput
"""What is drawn: the picture of a profile, or a report."""

Drawing = Future[Path | None]
"""A picture that may come from another process: its file, or None."""


class Pictures:
    """Draws pictures of profiles, in other processes once these were started. They end with the context.

    drawn_here, drawn_beside : how many were drawn by this process, and by others
    """

    def __init__(self) -> None:
        self.drawn_here = self.drawn_beside = 0
        self._beside: _Beside | None = None
        self._own: ProfilePictures | None = None
        self._opened = ExitStack()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._opened.close()

    def start(self, processes: int) -> None:
        """Start so many processes, or none where the system starts none. They load matplotlib at once."""
        if processes:
            with suppress(OSError):
                self._beside = self._opened.enter_context(closing(_Beside(processes)))

    def begin(self, sheet: Sheet, suffix: str = ".png") -> Drawing:
        """Let another process draw it, where there is one, as a file of that kind."""
        return drawn_by_none() if self._beside is None else self._beside.draw(sheet, suffix)

    def write(self, drawing: Drawing, sheet: Callable[[], Sheet], path: Path) -> None:
        """Put a picture that was begun in its place; where nobody has drawn it, draw it here."""
        if (drawn := drawing.result()) is not None:
            shutil.move(drawn, path)
            self.drawn_beside += 1
            return
        if self._own is None:
            from cmmlink.report.picture import ProfilePictures  # noqa: PLC0415 - it loads matplotlib, half a second

            self._own = ProfilePictures()
        _draw(self._own, sheet(), path)
        self.drawn_here += 1


def processes_here() -> int:
    """How many processes can draw at once on this computer; none on one with a single core, where nothing runs beside."""
    cores = os.cpu_count() or 1
    return min(cores, _MOST_PROCESSES) if cores > 1 else 0


def drawn_by_none() -> Drawing:
    """A picture that no other process draws."""
    nothing: Drawing = Future()
    nothing.set_result(None)
    return nothing


class _Beside:
    """Processes that draw, each with a thread that waits for it, and a folder for what they have drawn."""

    def __init__(self, count: int) -> None:
        with ExitStack() as opened:
            self._folder = Path(opened.enter_context(tempfile.TemporaryDirectory(prefix="cmmlink-", ignore_cleanup_errors=True)))
            self._idle: SimpleQueue[_Process] = SimpleQueue()
            for _ in range(count):
                self._idle.put(opened.enter_context(closing(_Process())))
            self._threads = ThreadPoolExecutor(count)
            opened.callback(self._threads.shutdown, cancel_futures=True)
            self._room = Semaphore((1 + _WAITING) * count)
            self._asked = 0
            self._opened = opened.pop_all()

    def draw(self, sheet: Sheet, suffix: str) -> Drawing:
        """Draw in one of the processes, once one is free. Gives the file, None where that failed; waits while too many wait."""
        self._room.acquire()
        self._asked += 1
        drawing = self._threads.submit(self._draw, sheet, self._folder / f"{self._asked}{suffix}")
        drawing.add_done_callback(lambda _: self._room.release())
        return drawing

    def _draw(self, sheet: Sheet, path: Path) -> Path | None:
        process = self._idle.get()
        try:
            return path if process.draw(sheet, path) else None
        finally:
            self._idle.put(process)

    def close(self) -> None:
        """End the processes; what was not fetched is gone."""
        self._opened.close()


class _Process:
    """A process that draws what comes through its pipe. It knows nothing of the program that started it, least of all its main script."""

    def __init__(self) -> None:
        command = [sys.executable, "-P", "-c", _CHILD, str(Path(__file__).resolve().parents[2])]
        self._child = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)

    def draw(self, sheet: Sheet, path: Path) -> bool:
        """Draw a picture, and wait until it is done. False where that failed."""
        assert self._child.stdin is not None
        assert self._child.stdout is not None
        try:
            pickle.dump((sheet, path), self._child.stdin)
            self._child.stdin.flush()
            return self._child.stdout.read(1) == _DRAWN
        except OSError:  # it was ended
            return False

    def close(self) -> None:
        self._child.kill()
        self._child.wait()
        for pipe in (self._child.stdin, self._child.stdout):
            assert pipe is not None
            with suppress(OSError):  # what was still to be sent has no receiver any more
                pipe.close()


def serve() -> None:
    """Run as the other process: draw what comes, until the pipe closes. Ctrl-C is the business of the one that waits for the pictures."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    asked, told = sys.stdin.buffer, os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what libraries print must not get among the answers
    from cmmlink.report.picture import ProfilePictures  # noqa: PLC0415 - only the process that draws loads matplotlib

    pictures = ProfilePictures()
    with suppress(EOFError, OSError):
        while True:
            sheet, path = pickle.load(asked)
            told.write(_DRAWN if _is_drawn(pictures, sheet, path) else _FAILED)
            told.flush()


def _is_drawn(pictures: "ProfilePictures", sheet: Sheet, path: Path) -> bool:
    try:
        _draw(pictures, sheet, path)
    except Exception:  # whatever it is, the process that asked meets it again and tells of it
        return False
    return True


def _draw(pictures: "ProfilePictures", sheet: Sheet, path: Path) -> None:
    if isinstance(sheet, PictureContent):
        pictures.write(sheet, path)
        return
    from cmmlink.report.pdf import write_report  # noqa: PLC0415 - a process that draws pictures alone needs no reportlab

    write_report(sheet, path)
