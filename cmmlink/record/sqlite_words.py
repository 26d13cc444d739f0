"""What SQLite says, in words that say what to do."""

import shutil
import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from cmmlink.errors import StoreError


@contextmanager
def translate_errors(path: Path) -> Iterator[None]:
    """Turn what SQLite says into a message that says what to do."""
    try:
        yield
    except sqlite3.Error as error:
        raise StoreError(f"{path}: {reason_of(error, path)}") from error
    except UnicodeDecodeError as error:  # where even the names in the file are damaged, its library cannot say what is
        raise StoreError(f"{path}: the file is damaged; keep it as it is and choose another folder with --records DIR") from error
    except MemoryError as error:
        raise StoreError(f"{path}: this computer has too little memory left; close other programs") from error


def reason_of(error: Exception, path: Path) -> str:
    """Why a file of records could not be used, and what mends that."""
    code = getattr(error, "sqlite_errorcode", 0) & 0xFF
    if code in (sqlite3.SQLITE_FULL, sqlite3.SQLITE_IOERR):
        mend = "free some space" if code == sqlite3.SQLITE_FULL else "look whether the disk is sound"
        return f"{error}{_words_of_room(path.parent)}; {mend}, or keep the records elsewhere with --records DIR"
    if code in (sqlite3.SQLITE_READONLY, sqlite3.SQLITE_CANTOPEN, sqlite3.SQLITE_PERM):
        return f"{error}; is the folder writable? --records DIR chooses another"
    if code in (sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_NOTADB):
        return f"{error}: the file is damaged; keep it as it is and choose another folder with --records DIR"
    return str(error)


def _words_of_room(folder: Path) -> str:
    """How much room the disk of a folder has, in brackets; nothing where it does not say."""
    try:
        return f" ({shutil.disk_usage(folder).free / 1e6:.1f} MB free)"
    except OSError:
        return ""
