"""The pictures of the sections of a stack, drawn by other processes while this one judges the sections that follow.

A process draws one picture at a time. It ends with this one, however that ends: nothing comes through its pipe any more. What it has not
drawn is drawn here, where an error can be told, and looks the same.
"""

import os
import shutil
import signal
import tempfile
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack, closing, suppress
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path
from queue import SimpleQueue
from threading import Semaphore
from types import TracebackType
from typing import TYPE_CHECKING, Self

from cmmlink.report.picture_content import PictureContent, content_of

if TYPE_CHECKING:  # a process that draws loads this file, and needs no more of the program than the picture does
    from cmmlink.report.picture import ProfilePictures
    from cmmlink.stack import SectionOutcome

_MOST_PROCESSES = 4  # each holds a hundred megabytes
_WORTH_A_PROCESS = 8  # pictures: it takes as long to load matplotlib
_WAITING = 2  # pictures for each process, so that a stack of thousands does not fill the memory with them


class SectionPictures:
    """Pictures of the sections of one stack, in the order of its sections; a context in which other processes may draw them.

    drawn_here, drawn_beside : how many were drawn by this process, and by others
    """

    def __init__(self, title: str, processes: int | None = None) -> None:
        self.drawn_here = self.drawn_beside = 0
        self._title = title
        self._processes = _processes_here() if processes is None else processes
        self._beside: _Beside | None = None
        self._begun: list[Future[Path | None]] = []
        self._own: ProfilePictures | None = None
        self._opened = ExitStack()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._opened.close()

    def expect(self, sections: int) -> None:
        """Start the other processes, as many as are worth it for so many sections."""
        count = min(self._processes, sections // _WORTH_A_PROCESS)
        if count:
            with suppress(OSError):  # the system starts no further process
                self._beside = self._opened.enter_context(closing(_Beside(count)))

    def begin(self, section: "SectionOutcome") -> None:
        """Let another process draw the next section, where there is one."""
        if self._beside is None:
            return
        content = self._content_of(section)
        self._begun.append(_nothing() if content is None else self._beside.draw(content))

    def write(self, number: int, section: "SectionOutcome", path: Path) -> None:
        """Write the picture of a section, whose number in the stack counts from 1, and in which points were judged."""
        drawn = self._begun[number - 1].result() if number <= len(self._begun) else None
        if drawn is not None:
            shutil.move(drawn, path)
            self.drawn_beside += 1
            return
        content = self._content_of(section)
        assert content is not None
        self._draw_here(content, path)

    def _content_of(self, section: "SectionOutcome") -> PictureContent | None:
        result = section.run.result
        if result is None or not result.judged:
            return None
        return content_of(result, section.profile, f"{self._title}, height {section.slice.height_mm:g} mm", section.run.ending)

    def _draw_here(self, content: PictureContent, path: Path) -> None:
        if self._own is None:
            from cmmlink.report.picture import ProfilePictures  # noqa: PLC0415 - it loads matplotlib, half a second

            self._own = ProfilePictures()
        self._own.write(content, path)
        self.drawn_here += 1


def _processes_here() -> int:
    """How many processes can draw at once on this computer; none on one with a single core, where nothing runs beside."""
    cores = os.cpu_count() or 1
    return min(cores, _MOST_PROCESSES) if cores > 1 else 0


def _nothing() -> "Future[Path | None]":
    nothing: Future[Path | None] = Future()
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

    def draw(self, content: PictureContent) -> "Future[Path | None]":
        """Draw in one of the processes, once one is free. Gives the file, None where that failed; waits while too many wait."""
        self._room.acquire()
        self._asked += 1
        drawing = self._threads.submit(self._draw, content, self._folder / f"{self._asked}.png")
        drawing.add_done_callback(lambda _: self._room.release())
        return drawing

    def _draw(self, content: PictureContent, path: Path) -> Path | None:
        process = self._idle.get()
        try:
            return path if process.draw(content, path) else None
        finally:
            self._idle.put(process)

    def close(self) -> None:
        """End the processes; what was not fetched is gone."""
        self._opened.close()


class _Process:
    """A process that draws what comes through its pipe."""

    def __init__(self) -> None:
        context = get_context("spawn")
        self._pipe, theirs = context.Pipe()
        self._child = context.Process(target=serve, args=(theirs,), daemon=True)
        with closing(theirs):
            self._child.start()

    def draw(self, content: PictureContent, path: Path) -> bool:
        """Draw a picture, and wait until it is done. False where that failed."""
        try:
            self._pipe.send((content, path))
            return bool(self._pipe.recv())
        except (OSError, EOFError):  # it was ended
            return False

    def close(self) -> None:
        self._child.kill()
        self._child.join()
        self._pipe.close()


def serve(pipe: "Connection[bool, tuple[PictureContent, Path]]") -> None:
    """Run as the other process: draw what comes, until the pipe closes. Ctrl-C is the business of the one that waits for the pictures."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    from cmmlink.report.picture import ProfilePictures  # noqa: PLC0415 - only the process that draws loads matplotlib

    pictures = ProfilePictures()
    with suppress(EOFError, OSError):
        while True:
            content, path = pipe.recv()
            pipe.send(_is_drawn(pictures, content, path))


def _is_drawn(pictures: "ProfilePictures", content: PictureContent, path: Path) -> bool:
    try:
        pictures.write(content, path)
    except Exception:  # whatever it is, the process that asked meets it again and tells of it
        return False
    return True
