"""Pictures drawn by other processes, while this one does what comes before and beside them.

What they have not drawn is drawn here, where an error can be told, and looks the same.
"""

import shutil
import tempfile
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import ExitStack, closing, suppress
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Self

from cmmlink.other_processes import OtherProcesses, answer_all
from cmmlink.report.picture_content import PictureContent
from cmmlink.report.report_input import ReportInput

if TYPE_CHECKING:  # whoever only starts a process loads no matplotlib
    from cmmlink.report.picture import ProfilePictures

Sheet = PictureContent | ReportInput
"""What is drawn: the picture of a profile, or a report."""

Drawing = Future[tuple[Path, ...] | None]
"""A picture that may come from another process: its files, one of each kind that was asked for, or None."""


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

    def begin(self, sheet: Sheet, *suffixes: str) -> Drawing:
        """Let another process draw it, where there is one, once and as a file of each of these kinds."""
        return drawn_by_none() if self._beside is None else self._beside.draw(sheet, suffixes)

    def write(self, drawing: Drawing, sheet: Callable[[], Sheet], *paths: Path) -> None:
        """Put a picture that was begun in its places, one of each kind; where nobody has drawn it, draw it here."""
        if (drawn := drawing.result()) is not None:
            for file, path in zip(drawn, paths, strict=True):
                shutil.move(file, path)
            self.drawn_beside += 1
            return
        if self._own is None:
            from cmmlink.report.picture import ProfilePictures  # noqa: PLC0415 - it loads matplotlib, half a second

            self._own = ProfilePictures()
        _draw(self._own, sheet(), *paths)
        self.drawn_here += 1


def drawn_by_none() -> Drawing:
    """A picture that no other process draws."""
    nothing: Drawing = Future()
    nothing.set_result(None)
    return nothing


class _Beside:
    """Processes that draw, and a folder for what they have drawn."""

    def __init__(self, count: int) -> None:
        with ExitStack() as opened:
            self._folder = Path(opened.enter_context(tempfile.TemporaryDirectory(prefix="cmmlink-", ignore_cleanup_errors=True)))
            self._processes = opened.enter_context(closing(OtherProcesses(count, __name__)))
            self._asked = 0
            self._opened = opened.pop_all()

    def draw(self, sheet: Sheet, suffixes: tuple[str, ...]) -> Drawing:
        """Draw in one of the processes, once one is free. Gives the files, None where that failed; waits while too many wait."""
        self._asked += 1
        return self._processes.ask((sheet, tuple(self._folder / f"{self._asked}{suffix}" for suffix in suffixes)))

    def close(self) -> None:
        """End the processes; what was not fetched is gone."""
        self._opened.close()


def serve() -> None:
    """Run as the other process: draw what comes."""
    answer_all(_begin_to_draw)


def _begin_to_draw() -> Callable[[tuple[Sheet, tuple[Path, ...]]], tuple[Path, ...]]:
    from cmmlink.report.picture import ProfilePictures  # noqa: PLC0415 - only the process that draws loads matplotlib

    pictures = ProfilePictures()

    def draw(asked: tuple[Sheet, tuple[Path, ...]]) -> tuple[Path, ...]:
        sheet, paths = asked
        _draw(pictures, sheet, *paths)
        return paths

    return draw


def _draw(pictures: "ProfilePictures", sheet: Sheet, *paths: Path) -> None:
    if isinstance(sheet, PictureContent):
        pictures.write(sheet, *paths)
        return
    from cmmlink.report.pdf import write_report  # noqa: PLC0415 - a process that draws pictures alone needs no reportlab

    for path in paths:
        write_report(sheet, path)
