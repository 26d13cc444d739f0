"""Allows one writer at a station: a lock between processes that works on every system and ends with its process, however that ends.

The lock is SQLite's own on a small file beside the records; a process that finds it taken can still read who holds it.
"""

import os
import sqlite3
from pathlib import Path

from cmmlink.errors import StationBusyError, StoreError

PATIENCE_S = 0.5  # another process may hold the lock for a moment to close an interrupted run


class StationLock:
    """Holds the lock from its making to `release`. Raises StationBusyError when another process holds it, StoreError where none can be."""

    def __init__(self, path: Path, patience_s: float = PATIENCE_S) -> None:
        """`patience_s` is how long another process may hold it before that counts as taken."""
        self._connection = sqlite3.connect(path, timeout=patience_s, isolation_level=None, check_same_thread=False)
        try:
            self._take()
        except sqlite3.OperationalError as error:
            holder = _holder(self._connection)
            self._connection.close()
            if error.sqlite_errorcode & 0xFF == sqlite3.SQLITE_BUSY:
                raise StationBusyError(
                    f"{path.parent}: {holder} records at this station already; wait until it has finished, "
                    "or keep the records of this run elsewhere with --records DIR"
                ) from None
            raise StoreError(f"{path.parent}: no record can be kept here: {error}; choose another folder with --records DIR") from None

    def release(self) -> None:
        """Give the lock back, so that another process can take it."""
        self._connection.close()

    def _take(self) -> None:
        execute = self._connection.execute
        execute("BEGIN IMMEDIATE")
        execute("CREATE TABLE IF NOT EXISTS holder (process INTEGER)")
        execute("DELETE FROM holder")
        execute("INSERT INTO holder VALUES (?)", (os.getpid(),))
        execute("COMMIT")  # so that others can read who it is
        execute("BEGIN IMMEDIATE")


def _holder(connection: sqlite3.Connection) -> str:
    try:
        found = connection.execute("SELECT process FROM holder").fetchone()
    except sqlite3.Error:
        found = None
    return f"another process ({found[0]})" if found else "another process"
