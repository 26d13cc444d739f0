"""Files that take their places together: a folder never holds half of one run's results and half of another's.

They are written into a hidden folder inside the one that they are for, and moved into their places once they are whole. Processes that
write to one folder at the same moment move their files one after the other. Where writing breaks off, the files that are whole take
their places, and the one that is not is gone.
"""

import os
import shutil
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from cmmlink.errors import PlanError

PATIENCE_S = 10.0  # another process takes milliseconds to move its files
_PREFIX = ".cmmlink-"
_LEFT_S = 86_400.0  # a hidden folder in which nothing was begun for so long was left behind by a process that was killed
_LOOK_S = 0.02


class NewFiles:
    """The files of one context, as `new_files` gives it."""

    def __init__(self, folder: Path, place: Path, alone: bool) -> None:
        """`folder` is where they will stand, `place` where they are written; `alone` says that nobody else moves files there meanwhile."""
        self._folder, self._place, self._alone = folder, place, alone
        self._asked: list[tuple[str, ...]] = []

    def __call__(self, name: str) -> Path:
        """Where to write a file that will stand there in the folder, like `result.json` or `section-1/contours.csv`.

        What was asked for before is whole by then.
        """
        (path,) = self.together(name)
        return path

    def together(self, *names: str) -> list[Path]:
        """Where to write files that become whole at the same time."""
        self._asked.append(names)
        paths = [self._place / name for name in names]
        for path in paths:
            path.parent.mkdir(parents=True, exist_ok=True)
        return paths

    def standing(self, name: str) -> Path | None:
        """The file of that name that the new one takes the place of, where it may be added to; None where it makes way, or is not there."""
        path = self._folder / name
        return path if self._alone and path.exists() else None

    @property
    def names(self) -> list[str]:
        """The names of the files, in the order in which they were asked for."""
        return [name for names in self._asked for name in names]

    def drop_last(self) -> None:
        """Take what was asked for last as not whole."""
        del self._asked[-1:]

    def move(self) -> None:
        """Let every file take its place."""
        for name in self.names:
            (self._folder / name).parent.mkdir(exist_ok=True)
            (self._place / name).replace(self._folder / name)


@contextmanager
def new_files(
    folder: Path, make_way: Callable[[Path], object] = lambda _: None, patience_s: float = PATIENCE_S, *, alone: bool = False
) -> Iterator[NewFiles]:
    """Write files that take their places in a folder, which is created, when the context ends.

    make_way   : called with the folder before they do, so that what stands there can be kept
    patience_s : how long another process may be moving its files
    alone      : no other process moves its files meanwhile: for files that are written from those that stand there

    Raises OSError where they cannot be written, PlanError where another process does not get done.
    """
    folder.mkdir(parents=True, exist_ok=True)
    _remove_left_behind(folder)
    place = Path(tempfile.mkdtemp(prefix=_PREFIX, dir=folder))
    files = NewFiles(folder, place, alone)
    try:
        with ExitStack() as held:
            if alone:
                held.enter_context(_alone_in(folder, patience_s))
            try:
                yield files
            except BaseException:
                files.drop_last()
                raise
            finally:
                if not alone:
                    held.enter_context(_alone_in(folder, patience_s))
                make_way(folder)
                files.move()
    finally:
        shutil.rmtree(place, ignore_errors=True)


@contextmanager
def _alone_in(folder: Path, patience_s: float) -> Iterator[None]:
    """Keep other processes, and other threads, from moving files into a folder meanwhile. Ends with the process, however that ends."""
    deadline_s = time.monotonic() + patience_s
    while (lock := _lock(folder)) is None:
        if time.monotonic() > deadline_s:
            raise PlanError(f"{folder}: another process writes its results there and does not get done; choose another folder with --out")
        time.sleep(_LOOK_S)
    try:
        yield
    finally:
        os.close(lock)


if sys.platform == "win32":

    def _lock(folder: Path) -> int | None:
        """A descriptor that holds the lock until it is closed; None while another one does."""
        try:
            return os.open(folder / f"{_PREFIX}lock", os.O_CREAT | os.O_EXCL | os.O_RDWR | os.O_TEMPORARY)
        except (FileExistsError, PermissionError):  # the other one's, or on its way out
            return None

else:
    import fcntl

    def _lock(folder: Path) -> int | None:
        """A descriptor that holds the lock until it is closed; None while another one does."""
        lock = os.open(folder, os.O_RDONLY)
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(lock)
            return None
        except OSError:
            return lock  # a file system without locks: the files are moved without one
        return lock


def _remove_left_behind(folder: Path) -> None:
    for path in folder.glob(f"{_PREFIX}*"):
        with suppress(OSError):  # another process may be at it, or it may be another user's
            if path.is_dir() and time.time() - path.stat().st_mtime > _LEFT_S:
                shutil.rmtree(path)
