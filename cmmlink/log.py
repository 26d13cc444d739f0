"""The log file that an operator can send: what was asked for, what happened on the link, what went wrong, what came of it.

It holds no measured points; those are in the records. A thread of its own writes it, so that a slow disk never slows a run, and
a log that cannot be written is no reason for anything to fail or to be printed.
"""

import logging
import platform
import queue
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from logging.handlers import QueueHandler, QueueListener, RotatingFileHandler
from pathlib import Path

from platformdirs import user_log_path

from cmmlink.plant import without_password
from cmmlink.version import __version__

FILE_NAME = "cmmlink.log"
_MOST_BYTES, _OLDER_FILES = 1_000_000, 3
_LINE = "%(asctime)s %(process)d %(levelname)s %(name)s: %(message)s"
_log = logging.getLogger(__name__)


def log_folder() -> Path:
    """Folder of the log file: among the user's own logs."""
    return user_log_path("cmmlink", appauthor=False)


def log_files(folder: Path) -> list[Path]:
    """The log file and the older ones that took its place before, newest first."""
    return sorted(folder.glob(f"{FILE_NAME}*"))


@contextmanager
def keep_log(folder: Path) -> Iterator[None]:
    """Write what is logged by cmmlink meanwhile into the log file of a folder; into nothing where that cannot be."""
    lines: queue.SimpleQueue[logging.LogRecord] = queue.SimpleQueue()
    ours = logging.getLogger("cmmlink")
    into_queue = _SilentQueue(lines)
    writer = QueueListener(lines, _handler(folder))
    level, propagate = ours.level, ours.propagate
    ours.setLevel(logging.INFO)
    ours.propagate = False  # never onto standard error, whatever else is installed
    ours.addHandler(into_queue)
    is_writing = _begin_to_write(writer)
    try:
        yield
    finally:
        ours.removeHandler(into_queue)
        ours.setLevel(level)
        ours.propagate = propagate
        if is_writing:
            writer.stop()
        for handler in writer.handlers:
            with suppress(OSError):  # a disk may say only now that it took nothing
                handler.close()


def log_command(arguments: list[str]) -> None:
    """Note that a command begins, and with what it runs."""
    python = f"Python {platform.python_version()}, {platform.system()} {platform.machine()}"
    _log.info("cmmlink %s on %s: %s", __version__, python, " ".join(map(_quote, arguments)))
    with suppress(OSError):  # the folder may be gone
        _log.info("in %s", Path.cwd())


class _SilentQueue(QueueHandler):
    """A queue of lines whose failures stay its own."""

    def handleError(self, record: logging.LogRecord) -> None:  # noqa: N802 - the name is that of the standard library
        """Give up on one line."""


class _SilentFile(RotatingFileHandler):
    """A rotating file whose failures stay its own."""

    def doRollover(self) -> None:  # noqa: N802
        """Begin a new file; where another process holds the old one open (Windows), go on with that."""
        with suppress(OSError):
            super().doRollover()

    def handleError(self, record: logging.LogRecord) -> None:  # noqa: N802
        """Give up on one line."""


def _begin_to_write(writer: QueueListener) -> bool:
    """Start the thread that writes; tell whether the system has one to give."""
    try:
        writer.start()
    except RuntimeError:
        return False
    return True


def _handler(folder: Path) -> logging.Handler:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        handler = _SilentFile(folder / FILE_NAME, maxBytes=_MOST_BYTES, backupCount=_OLDER_FILES, encoding="utf-8", errors="replace")
    except OSError:
        return logging.NullHandler()
    handler.setFormatter(logging.Formatter(_LINE))
    return handler


def _quote(argument: str) -> str:
    argument = without_password(argument)
    return f'"{argument}"' if " " in argument else argument
