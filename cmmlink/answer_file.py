"""The file from which the control of a machine tool reads the verdict: it is replaced as a whole, or left as it is.

It is written beside its place, brought to the disk, moved there by one renaming, and read again. Its folder is never made: where a share
is not connected, a folder of the same name on this computer would take the answer, and no machine would read it.
"""

import os
import re
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from cmmlink.errors import AnswerError

PATIENCE_S = 2.0  # for a control, or whatever carries the file there, to let go of the one that it reads
_LOOK_S = 0.05
_LEFT_S = 60.0  # after which an unfinished file was left behind by a process that was killed
_OWN = re.compile(rb"O[0-9]+ \(CMMLINK ANSWER\)\r\n")


def replace_answer(file: Path, data: bytes, sleep: Callable[[float], None] = time.sleep) -> None:
    """Put an answer in the place of an earlier one. Raises AnswerError where the control cannot read it there for sure.

    A file that is no answer of cmmlink's is left as it is. So is an earlier answer, wherever this is raised before the renaming.
    """
    try:
        refuse_foreign(file)
        _remove_left_behind(file)
        new = file.with_name(f".{file.name}.{os.getpid()}.new")
        try:
            _write(new, data)
            _move(new, file, sleep)
        except BaseException:
            with suppress(OSError):
                new.unlink()
            raise
        _bring_to_disk(file.parent)
        found = file.read_bytes()
    except OSError as error:
        if not file.parent.is_dir():
            raise AnswerError(f"{file}: there is no folder {file.parent}; connect the share") from error
        raise AnswerError(f"{file}: the answer cannot be kept there: {error.strerror or error}") from error
    if found != data:
        raise AnswerError(f"{file}: something else was written there at the same time; let one station alone answer there")


def withdraw_answer(file: Path, data: bytes) -> None:
    """Put an answer that passes nothing in the place of an earlier one, or take that away where there is no room for another.

    Raises AnswerError where an earlier answer may stand there still.
    """
    try:
        replace_answer(file, data)
    except AnswerError:
        if not _is_taken_away(file):
            raise


def _is_taken_away(file: Path) -> bool:
    """Take an earlier answer away, and tell whether none stands there: where the folder is out of reach, nobody knows."""
    with suppress(OSError, AnswerError):
        refuse_foreign(file)
        if file.parent.is_dir():
            file.unlink(missing_ok=True)
            return True
    return False


def refuse_foreign(file: Path) -> None:
    """Raise AnswerError where the place is taken by a file that was not written here; an empty one was left by a disk that was full."""
    try:
        with file.open("rb") as standing:
            head = standing.read(64)
    except FileNotFoundError:
        return
    if head and not _OWN.match(head):
        raise AnswerError(f"{file}: what stands there is no answer of cmmlink's, and is left as it is; name another file, or take it away")


def _write(new: Path, data: bytes) -> None:
    with new.open("wb") as file:
        file.write(data)
        file.flush()
        os.fsync(file.fileno())


def _move(new: Path, file: Path, sleep: Callable[[float], None]) -> None:
    """Let the new file take its place, once nobody holds the old one open: Windows keeps it as long as somebody reads it."""
    for _ in range(round(PATIENCE_S / _LOOK_S)):
        with suppress(PermissionError):
            os.replace(new, file)
            return
        sleep(_LOOK_S)
    os.replace(new, file)


def _bring_to_disk(folder: Path) -> None:
    """Bring the renaming to the disk, where the system can: without it a cut of power may bring an earlier answer back."""
    if sys.platform == "win32":
        return
    with suppress(OSError):  # shares do not know it
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


def _remove_left_behind(file: Path) -> None:
    with suppress(OSError):  # what stands beside the answer is in nobody's way
        for left in file.parent.glob(f".{file.name}.*.new"):
            if time.time() - left.stat().st_mtime > _LEFT_S:
                left.unlink()
