"""Calls to the operating system that fail when they are told to: the n-th of a run, or the process dies at it.

What is intercepted: files looked at, opened, read, written and closed, folders and names, synchronisation, temporary files, ports,
sockets, names of hosts, threads, and every statement of SQLite. The code under test is not told. Threads named `NOT_OURS` play the
device: their calls never fail.
"""

import errno
import io
import os
import signal
import socket
import sqlite3
import sys
import threading
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType
from typing import Any
from unittest.mock import patch

termios: ModuleType | None
try:
    import termios
except ImportError:  # Windows sets up its ports by other calls
    termios = None

NOT_OURS = "counter-party"
ROOT = Path(__file__).parents[2]
PRODUCT = tuple(f"{ROOT / name}{os.sep}" for name in ("cmmlink", "drivers", "inspection", "simulators"))


@dataclass
class Faults:
    """Counts the calls of one run and lets one of them fail; 0 lets none fail.

    only    count only calls of this name, all where it is empty
    place   count only calls made at this place, all where it is empty
    after   whether the call that fails does its work first, as a disk that answers too late
    kills   whether the process dies at the call instead
    failed  what failed
    error   what was raised for it
    places  how often a call was made at each place, in the order of their first
    tell    is called with the rows of every transaction, by number, once they are committed
    """

    fails: int
    only: str = ""
    place: str = ""
    after: bool = False
    kills: bool = False
    calls: int = 0
    failed: str = ""
    active: bool = False
    lock: threading.Lock = field(default_factory=threading.Lock)
    error: BaseException | None = None
    places: Counter[str] = field(default_factory=Counter)
    committed: dict[int, bytes] = field(default_factory=dict)
    tell: Callable[[dict[int, bytes]], object] = len

    def is_due(self, what: str) -> bool:
        """Count one call; tell whether it is the one to fail."""
        if not self.active or (self.only and what != self.only) or threading.current_thread().name == NOT_OURS:
            return False
        place = place_of(what)
        with self.lock:
            self.places[place] += 1
            if self.place and place != self.place:
                return False
            self.calls += 1
            if self.calls != self.fails:
                return False
            self.failed = what
        if self.kills:
            os.kill(os.getpid(), signal.SIGKILL)
        return True

    def call(self, what: str, error: Callable[[], BaseException], work: Callable[..., Any], *args: Any, **options: Any) -> Any:
        """Do the work, or fail before or after it."""
        if not self.is_due(what):
            return work(*args, **options)
        if self.after and what not in NEVER_TOO_LATE:
            work(*args, **options)
        self.error = error()
        if what in OF_THE_SYSTEM and isinstance(args[0], str | os.PathLike) and isinstance(self.error, OSError):
            self.error.filename = os.fspath(args[0])  # as the system tells it
        raise self.error


def place_of(what: str) -> str:
    """Name the place of a call: what it is, the line that makes it, and the lines of cmmlink that lead to it."""
    frame, lines = sys._getframe(1), list[str]()
    while frame.f_code.co_filename == __file__ and frame.f_back:
        frame = frame.f_back
    lines.append(f"{os.path.basename(frame.f_code.co_filename)}:{frame.f_lineno}")
    above = frame.f_back
    while above:
        if above.f_code.co_filename.startswith(PRODUCT):
            lines.append(f"{os.path.basename(above.f_code.co_filename)}:{above.f_lineno}")
        above = above.f_back
    return f"{what} at {' < '.join(lines)}"


NOW = Faults(0)


def take(faults: Faults) -> Faults:
    """Let these be the failures of the next run; returns them."""
    global NOW  # noqa: PLW0603 - the patched calls belong to the whole process
    NOW = faults
    return faults


NEVER_TOO_LATE = ("open", "thread start", "sqlite connect", "socket")  # what fails has not been done: nobody could give it back


def no_space() -> OSError:
    return OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def too_many_files() -> OSError:
    return OSError(errno.EMFILE, os.strerror(errno.EMFILE))


def no_answer_of_the_disk() -> OSError:
    return OSError(errno.EIO, os.strerror(errno.EIO))


def no_name() -> OSError:
    return socket.gaierror(socket.EAI_AGAIN, "Temporary failure in name resolution")


def denied() -> OSError:
    return PermissionError(errno.EACCES, os.strerror(errno.EACCES))


def reset() -> OSError:
    return ConnectionResetError(errno.ECONNRESET, os.strerror(errno.ECONNRESET))


def no_thread() -> RuntimeError:
    return RuntimeError("can't start new thread")


def of_sqlite(code: int, words: str) -> Callable[[], sqlite3.Error]:
    """Make an error as SQLite raises it, with its code."""

    def make() -> sqlite3.Error:
        error = sqlite3.OperationalError(words)
        error.sqlite_errorcode = code
        error.sqlite_errorname = words
        return error

    return make


DISK_FULL = of_sqlite(sqlite3.SQLITE_FULL, "database or disk is full")
DISK_BROKEN = of_sqlite(sqlite3.SQLITE_IOERR, "disk I/O error")
NO_FILE = of_sqlite(sqlite3.SQLITE_CANTOPEN, "unable to open database file")


class FailingRaw(io.FileIO):
    """A file whose writes count, its first read, and that it is closed after it was written."""

    _was_read = False

    def write(self, data: Any, /) -> int:
        return int(NOW.call("file write", no_space, super().write, data))

    def readinto(self, buffer: Any, /) -> int:
        if self._was_read:
            return super().readinto(buffer)
        self._was_read = True
        return int(NOW.call("file read", no_answer_of_the_disk, super().readinto, buffer))

    def readall(self) -> bytes:
        if self._was_read:
            return super().readall()
        self._was_read = True
        return bytes(NOW.call("file read", no_answer_of_the_disk, super().readall))

    def close(self) -> None:
        is_first, written = not self.closed, not self.closed and self.writable()
        super().close()
        if is_first and written:
            NOW.call("file close", no_answer_of_the_disk, lambda: None)


class FailingConnection(sqlite3.Connection):
    """A connection whose statements count; it remembers which rows were committed."""

    _pending: dict[int, bytes]

    def execute(self, sql: str, parameters: Any = (), /) -> sqlite3.Cursor:
        verb = sql.split(maxsplit=1)[0].upper()
        try:
            cursor: sqlite3.Cursor = NOW.call(f"sqlite {verb}", DISK_BROKEN, super().execute, sql, parameters)
        finally:
            if verb == "BEGIN":
                self._pending = {}
        if verb == "COMMIT":
            rows = getattr(self, "_pending", {})
            NOW.committed |= rows
            NOW.tell(rows)
        return cursor

    def executemany(self, sql: str, rows: Any, /) -> sqlite3.Cursor:
        rows = list(rows)
        error = MemoryError if NOW.fails % 3 == 0 else DISK_FULL
        cursor: sqlite3.Cursor = NOW.call("sqlite INSERT", error, super().executemany, sql, rows)
        self._pending |= {row[0]: row[-1] for row in rows}
        return cursor

    def executescript(self, script: str, /) -> sqlite3.Cursor:
        return NOW.call("sqlite script", DISK_FULL, super().executescript, script)  # type: ignore[no-any-return]


def _opened(real: Callable[..., Any]) -> Callable[..., Any]:
    """`open` as it is, but through files whose writes count."""

    def failing_open(file: Any, mode: str = "r", buffering: int = -1, *args: Any, **options: Any) -> Any:
        if (
            not NOW.active
            or threading.current_thread().name == NOT_OURS
            or options.get("opener")
            or not isinstance(file, str | os.PathLike)
        ):
            return real(file, mode, buffering, *args, **options)
        if NOW.is_due(f"open {'to write' if set(mode) & set('wax+') else 'to read'}"):
            NOW.error = OSError(errno.EMFILE, os.strerror(errno.EMFILE), os.fspath(file))
            raise NOW.error
        binary = mode.replace("t", "").replace("b", "")
        raw = FailingRaw(os.fspath(file), binary)
        if buffering == 0:
            return raw
        buffered: Any = io.BufferedRandom(raw) if "+" in mode else io.BufferedReader(raw) if "r" in mode else io.BufferedWriter(raw)
        return buffered if "b" in mode else io.TextIOWrapper(buffered, *args, **options)

    return failing_open


def _failing(owner: Any, name: str, error: Callable[[], BaseException], what: str) -> Any:
    real = getattr(owner, name)

    def call(*args: Any, **options: Any) -> Any:
        return NOW.call(what, error, real, *args, **options)

    return patch.object(owner, name, call)


def _failing_method(owner: type, name: str, error: Callable[[], BaseException], what: str) -> Any:
    real = getattr(owner, name)

    def call(self: Any, *args: Any, **options: Any) -> Any:
        return NOW.call(what, error, real, self, *args, **options)

    return patch.object(owner, name, call)


OF_THE_SYSTEM: dict[str, Callable[[], BaseException]] = {
    **dict.fromkeys(("mkdir", "replace", "fsync", "listdir", "scandir"), no_space),
    **dict.fromkeys(("unlink", "rmdir", "rename"), denied),
    **dict.fromkeys(("stat", "lstat", "statvfs", "read", "write"), no_answer_of_the_disk),
    "open": too_many_files,
}
OF_SOCKETS: dict[str, Callable[[], BaseException]] = {
    **dict.fromkeys(("connect", "connect_ex", "recv", "recv_into", "send", "sendall"), reset),
    "__init__": too_many_files,
}


@contextmanager
def intercepted() -> Iterator[None]:
    """Put counting calls in the place of the real ones."""
    real_connect = sqlite3.connect

    def connect(*args: Any, **options: Any) -> sqlite3.Connection:
        if not NOW.active:
            return sqlite3.Connection(*args, **options)
        found: sqlite3.Connection = NOW.call("sqlite connect", NO_FILE, real_connect, *args, factory=FailingConnection, **options)
        return found

    with ExitStack() as stack:
        for name, error in OF_THE_SYSTEM.items():
            stack.enter_context(_failing(os, name, error, name))
        if termios is not None:
            stack.enter_context(_failing(termios, "tcsetattr", no_answer_of_the_disk, "port settings"))
        stack.enter_context(_failing(socket, "getaddrinfo", no_name, "name of a host"))
        for method, failure in OF_SOCKETS.items():
            stack.enter_context(_failing_method(socket.socket, method, failure, f"socket {method}".removesuffix(" __init__")))
        stack.enter_context(_failing_method(threading.Thread, "start", no_thread, "thread start"))
        stack.enter_context(patch.object(sqlite3, "connect", connect))
        stack.enter_context(patch("builtins.open", _opened(open)))
        stack.enter_context(patch.object(io, "open", _opened(io.open)))
        yield


def failing(work: Callable[[], None]) -> Callable[[], None]:
    """Work during which calls fail."""

    def work_with_failures() -> None:
        NOW.active = True
        try:
            work()
        finally:
            NOW.active = False

    return work_with_failures
