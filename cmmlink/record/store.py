"""The records of a station: one SQLite file to which hash-chained records are only ever added.

When `append` returns, its records are on the disk (write-ahead log, synchronous FULL). Runs follow one another: the records of
a run stand together, from `run` to `end`; a run whose `end` is missing was interrupted, or is going on.
"""

import os
import re
import sqlite3
import stat
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import closing, contextmanager
from pathlib import Path

from cmmlink.errors import StoreError
from cmmlink.record.chain import (
    BEHIND_THE_END,
    GENESIS,
    Alteration,
    Draft,
    Record,
    chain_record,
    chain_records,
    first_alteration,
    is_damaged,
)
from cmmlink.record.sqlite_words import reason_of, translate_errors
from cmmlink.record.station_lock import PATIENCE_S, StationLock

FILE_NAME = "station.sqlite"
APPLICATION_ID = 0x434D4D4C  # "CMML", in the file's header
MIGRATIONS: tuple[str, ...] = (
    """
    CREATE TABLE record (
        number INTEGER PRIMARY KEY AUTOINCREMENT,
        run    TEXT    NOT NULL,
        kind   TEXT    NOT NULL,
        time_s REAL    NOT NULL,
        count  INTEGER NOT NULL,
        body   BLOB    NOT NULL,
        crc32  INTEGER NOT NULL,
        sha256 BLOB    NOT NULL
    );
    CREATE INDEX record_of_run ON record (run, kind, number);
    CREATE INDEX begin_and_end ON record (number) WHERE kind IN ('run', 'end');
    """,
)
"""Scripts from one version of the schema to the next. A migration adds tables, columns and indices; it never changes a record."""

_OF_THE_SYSTEM = (sqlite3.SQLITE_IOERR, sqlite3.SQLITE_FULL, sqlite3.SQLITE_CANTOPEN, sqlite3.SQLITE_PERM, sqlite3.SQLITE_BUSY)
_COLUMNS = "number, run, kind, time_s, count, body, crc32, sha256"
_PATIENCE_S = 5.0  # for another connection's transaction
_PAGES_AT_ONCE = 4096  # of a copy, between two words about how far it has come


class Store:
    """An open station file. `writing` takes the station's lock for as long as the store is open.

    recording : whether another process was found recording when the file was opened to be read
    """

    def __init__(
        self,
        folder: Path,
        *,
        writing: bool,
        epoch_s: Callable[[], float],
        migrations: Sequence[str] = MIGRATIONS,
        patience_s: float = PATIENCE_S,
        name: str = FILE_NAME,
    ) -> None:
        """`epoch_s` gives seconds since 1970. Raises StoreError: locked, newer, unusable folder, not a file of records.

        name : of the file, where it is not that of a station
        """
        self.path = folder / name
        self.recording = False
        self._epoch_s = epoch_s
        self._lock: StationLock | None = None
        self._head: tuple[int, bytes] = (0, GENESIS)  # number and hash of the last record
        try:
            self._found_empty = self.path.is_file() and not self.path.stat().st_size
            if writing:
                folder.mkdir(parents=True, exist_ok=True)
                self._lock = StationLock(folder / "station.lock", patience_s)
            self._connection = _connect(self.path)
        except (OSError, sqlite3.Error) as error:
            self._unlock()
            raise StoreError(f"{self.path}: cannot be opened: {error}; choose another folder with --records DIR") from None
        try:
            with translate_errors(self.path):
                self._prepare(writing, migrations)
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Close the file and release the lock."""
        self._connection.close()
        self._unlock()

    def __enter__(self) -> "Store":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def append(self, drafts: Sequence[Draft], behind: Callable[[Record], Sequence[Draft]] = lambda last: ()) -> list[Record]:
        """Add records in one transaction; they are on the disk when this returns. Raises StoreError: then none of them is.

        behind : gives what stands behind the last of them and follows from its hash
        """
        time_s = self._epoch_s()
        records = chain_records(drafts, self._head, time_s)
        if records:
            records += chain_records(behind(records[-1]), (records[-1].number, records[-1].sha256), time_s)
        self._insert(records)
        return records

    def append_each(self, drafts: Sequence[Draft], behind: Callable[[Record], Sequence[Draft]]) -> list[Record]:
        """The same, with what follows from a record behind each of them. Returns the records of the drafts."""
        time_s, head = self._epoch_s(), self._head
        added, records = list[Record](), list[Record]()
        for draft in drafts:
            added += chain_records([draft], head, time_s)
            records += [added[-1], *chain_records(behind(added[-1]), (added[-1].number, added[-1].sha256), time_s)]
            head = records[-1].number, records[-1].sha256
        self._insert(records)
        return added

    def _insert(self, records: Sequence[Record]) -> None:
        rows = [(r.number, r.run, r.kind, r.time_s, r.count, r.body, r.crc32, r.sha256) for r in records]
        with translate_errors(self.path), _transaction(self._connection):
            self._connection.executemany(f"INSERT INTO record ({_COLUMNS}) VALUES (?, ?, ?, ?, ?, ?, ?, ?)", rows)
        if records:
            self._head = records[-1].number, records[-1].sha256

    def adopt(self, records: Iterable[Record]) -> None:
        """Add records of another file with the moments at which they were written, in one transaction, each with its place in this chain.

        Records that follow in the other file on what stands in this one keep their numbers and hashes. Raises StoreError: then none is
        added.
        """
        number, previous = self._head

        def rows() -> Iterator[tuple[object, ...]]:
            nonlocal number, previous
            for record in records:
                placed = chain_record(record, number + 1, record.time_s, previous)
                number, previous = number + 1, placed.sha256
                yield number, record.run, record.kind, record.time_s, record.count, record.body, placed.crc32, previous

        with translate_errors(self.path), _transaction(self._connection):
            self._connection.executemany(f"INSERT INTO record ({_COLUMNS}) VALUES (?, ?, ?, ?, ?, ?, ?, ?)", rows())
        self._head = number, previous

    def back_up(self, path: Path, tell: Callable[[float], None] = lambda share: None) -> None:
        """Copy what stands in the file at this moment to a new file, while others may go on recording. `tell` is told the share done."""
        with translate_errors(path), closing(sqlite3.connect(path, isolation_level=None)) as copy:
            with self._as_it_is():
                self._connection.backup(copy, pages=_PAGES_AT_ONCE, progress=lambda _, left, pages: tell(1 - left / max(pages, 1)))
            copy.execute("PRAGMA journal_mode = DELETE")  # so that one file holds all of it

    @contextmanager
    def _as_it_is(self) -> Iterator[None]:
        """While this is entered, the file reads as it is now, whatever others add to it."""
        with translate_errors(self.path):
            self._connection.execute("BEGIN")
            self._connection.execute("SELECT count(*) FROM sqlite_master").fetchone()  # this is what begins it
        try:
            yield
        finally:
            with translate_errors(self.path):
                self._connection.execute("ROLLBACK")

    @property
    def head(self) -> tuple[int, bytes]:
        """The number and the hash of the last record, when the file was opened or last added to."""
        return self._head

    def record_at(self, number: int) -> Record | None:
        """The record with a number."""
        with translate_errors(self.path):
            row = self._connection.execute(f"SELECT {_COLUMNS} FROM record WHERE number = ?", (number,)).fetchone()
            return None if row is None else Record(*row)

    def records_from(self, number: int) -> Iterator[Record]:
        """All records from a number on, in their order."""
        with translate_errors(self.path):
            for row in self._connection.execute(f"SELECT {_COLUMNS} FROM record WHERE number >= ? ORDER BY number", (number,)):
                yield Record(*row)

    def added_behind_number(self, number: int, kinds: Sequence[str], most: int) -> list[Record]:
        """The first records of some kinds behind a number, read at once: nothing of the file is held for whoever goes on adding."""
        query = f"SELECT {_COLUMNS} FROM record WHERE number > ? AND kind IN ({', '.join('?' * len(kinds))}) ORDER BY number LIMIT ?"
        with translate_errors(self.path):
            return [Record(*row) for row in self._connection.execute(query, (number, *kinds, most)).fetchall()]

    def records(self, run: str, kind: str | None = None) -> Iterator[Record]:
        """Records of a run in their order, all or of one kind. Raises StoreError where one cannot be read."""
        query = f"SELECT {_COLUMNS} FROM record WHERE run = ?" + (" AND kind = ?" if kind else "") + " ORDER BY number"
        with translate_errors(self.path):
            for row in self._connection.execute(query, (run, kind) if kind else (run,)):
                record = Record(*row)
                if is_damaged(record):
                    what = f"record {record.number} ({record.kind} of run {run})"
                    raise StoreError(f"{self.path}: {what} is damaged; `cmmlink verify` says more")
                yield record

    def holds(self, kind: str) -> bool:
        """Whether there is a record of a kind."""
        with translate_errors(self.path):
            return self._connection.execute("SELECT 1 FROM record WHERE kind = ? LIMIT 1", (kind,)).fetchone() is not None

    def added_behind(self, run: str, end: int) -> int | None:
        """The number of the first record of a run that has no place behind its end, None where there is none; also of a second end."""
        allowed = ", ".join("?" * len(BEHIND_THE_END))
        query = (
            f"SELECT max(number) FROM record WHERE run = ? AND kind NOT IN ({allowed}) AND (number > ? OR (number < ? AND kind = 'end'))"
        )
        with translate_errors(self.path):
            (found,) = self._connection.execute(query, (run, *BEHIND_THE_END, end, end)).fetchone()
        return None if found is None else int(found)

    def stray_record(self) -> int | None:
        """The number of a record that belongs to no run and is none of the station, None where there is none."""
        runs = "SELECT run FROM record WHERE kind = 'run'"
        query = f"SELECT max(number) FROM record WHERE NOT (run = '' AND kind = 'key') AND run NOT IN ({runs})"
        with translate_errors(self.path):
            (found,) = self._connection.execute(query).fetchone()
        return None if found is None else int(found)

    def totals(self, run: str) -> dict[str, tuple[int, int]]:
        """Records and what they hold together (reads, points, ...), by kind."""
        query = "SELECT kind, count(*), sum(count) FROM record WHERE run = ? GROUP BY kind"
        with translate_errors(self.path):
            return {kind: (records, count) for kind, records, count in self._connection.execute(query, (run,))}

    def count_runs(self) -> int:
        """How many runs there are."""
        with translate_errors(self.path):
            (count,) = self._connection.execute("SELECT count(*) FROM record WHERE kind = 'run'").fetchone()
            return int(count)

    def begins_and_ends(self) -> list[tuple[Record, Record | None]]:
        """The first and, unless it is open, the last record of every run, oldest run first."""
        query = f"SELECT {_COLUMNS} FROM record WHERE kind IN ('run', 'end') ORDER BY number"
        found: dict[str, tuple[Record, Record | None]] = {}
        with translate_errors(self.path):
            for record in (Record(*row) for row in self._connection.execute(query)):
                if record.kind == "run":
                    found[record.run] = record, None
                elif record.run in found:
                    found[record.run] = found[record.run][0], record
        return list(found.values())

    def first_alteration(self, run: str | None = None) -> tuple[Alteration | None, int, bytes]:
        """Recompute the chain over a run, or over all; returns the first alteration, the number of sound records and the last hash."""
        try:
            first, number, previous = self._where(run)
            rows = self._connection.execute(f"SELECT {_COLUMNS} FROM record WHERE number BETWEEN ? AND ? ORDER BY number", (first, number))
            found, stopped, last = first_alteration((Record(*row) for row in rows), first, previous)
            if found is None and stopped <= number:
                found = Alteration(stopped, "", "", f"is missing, as is all up to record {number}: deleted from the end")
            if found is None and run is None:
                found = self._unsound_file(number)
        except (sqlite3.DatabaseError, UnicodeDecodeError) as error:
            if getattr(error, "sqlite_errorcode", 0) & 0xFF in _OF_THE_SYSTEM:  # says nothing about what is in the file
                raise StoreError(f"{self.path}: {reason_of(error, self.path)}") from error
            return Alteration(0, "", "", f"cannot be read: the file is damaged ({error})"), 0, b""
        return found, stopped - first, last

    def _where(self, run: str | None) -> tuple[int, int, bytes]:
        """First and last number of a run (or of all), and the hash before it."""
        execute = self._connection.execute
        if run is None:
            known = execute("SELECT seq FROM sqlite_sequence WHERE name = 'record'").fetchone()
            count = known[0] if known else 0
            if not isinstance(count, int):
                raise sqlite3.DatabaseError(f"the number of its last record is {count!r:.40}")
            return 1, count, GENESIS
        (first,) = execute("SELECT min(number) FROM record WHERE run = ? AND kind = 'run'", (run,)).fetchone()
        if first is None:
            raise sqlite3.DatabaseError(f"run {run} has no beginning")
        (following,) = execute("SELECT min(number) FROM record WHERE number > ? AND kind = 'run'", (first,)).fetchone()
        before = execute("SELECT sha256 FROM record WHERE number = ?", (first - 1,)).fetchone()
        return first, following - 1 if following else self._where(None)[1], before[0] if before else GENESIS

    def _unsound_file(self, number: int) -> Alteration | None:
        """Damage that the chain cannot show: records beyond its end, and damage of the file itself."""
        lowest, beyond = self._connection.execute("SELECT min(number), max(number) FROM record").fetchone()
        if (beyond or 0) > number:
            return Alteration(number + 1, "", "", "was added without being counted")
        if lowest is not None and lowest < 1:
            return Alteration(lowest, "", "", "was added before the first: numbers begin with 1")
        foreign = self._connection.execute("SELECT name FROM sqlite_master WHERE type IN ('trigger', 'view')").fetchone()
        if foreign is not None:
            return Alteration(0, "", "", f"every record is sound, but the file holds {foreign[0]!r:.60}, which cmmlink never writes")
        (report,) = self._connection.execute("PRAGMA integrity_check(1)").fetchone()
        return None if report == "ok" else Alteration(0, "", "", f"every record is sound, but the file is damaged: {report}")

    def _prepare(self, writing: bool, migrations: Sequence[str]) -> None:
        (version,) = self._connection.execute("PRAGMA user_version").fetchone()
        (application,) = self._connection.execute("PRAGMA application_id").fetchone()
        (tables,) = self._connection.execute("SELECT count(*) FROM sqlite_master").fetchone()
        if tables and application != APPLICATION_ID:
            raise StoreError(f"{self.path}: this is no file of records of cmmlink; choose another folder with --records DIR")
        if version > len(migrations):
            raise StoreError(
                f"{self.path}: written by a newer cmmlink (schema {version}; this one knows up to {len(migrations)}); "
                "update cmmlink, or choose another folder with --records DIR"
            )
        if version < len(migrations):
            self._migrate(version, migrations, writing)
        if writing:
            self._be_durable()
        found = self._connection.execute("SELECT number, sha256 FROM record ORDER BY number DESC LIMIT 1").fetchone()
        self._head = found or (0, GENESIS)
        if writing and not isinstance(self._head[1], bytes):
            raise StoreError(f"{self.path}: its last record was altered; keep it as it is and choose another folder with --records DIR")

    def _migrate(self, version: int, migrations: Sequence[str], writing: bool) -> None:
        lock = None if writing else StationLock(self.path.parent / "station.lock")
        try:
            if self._found_empty and lock is not None and not self.path.stat().st_size:  # no other process is creating it at this moment
                raise StoreError(f"{self.path}: the file is empty: what was recorded in it is gone. Move it away to begin a new one")
            for target, script in enumerate(migrations[version:], start=version + 1):
                # One transaction each, so that after a kill the file has either the old version or the new one.
                mark = f"PRAGMA application_id = {APPLICATION_ID}; PRAGMA user_version = {target};"
                self._connection.executescript(f"BEGIN IMMEDIATE; {script}; {mark} COMMIT;")
        finally:
            if lock is not None:
                lock.release()

    def _be_durable(self) -> None:
        execute = self._connection.execute
        (mode,) = execute("PRAGMA journal_mode = WAL").fetchone()
        if mode != "wal":
            why = "this folder cannot keep a crash-safe record (is it on a network share?)"
            raise StoreError(f"{self.path}: {why}; choose another with --records DIR")
        execute("PRAGMA synchronous = FULL")
        execute("PRAGMA fullfsync = ON")  # macOS: through the drive's own cache as well
        execute("PRAGMA journal_size_limit = 16777216")

    def _unlock(self) -> None:
        if self._lock is not None:
            self._lock.release()


def _connect(path: Path) -> sqlite3.Connection:
    # Records on a write-protected medium can be read all the same, as long as nobody writes them.
    protected = path.is_file() and not (os.access(path, os.W_OK) and os.access(path.parent, os.W_OK))
    left = path.with_name(path.name + "-wal")
    if protected and left.is_file() and left.stat().st_size:
        what = f"its last records are still in {left.name}, which cannot be read where nothing can be written"
        raise StoreError(f"{path}: {what}; copy the whole folder to a disk that can be written, and read it there")
    address = path.resolve().as_uri() + ("?immutable=1" if protected else "")
    address = re.sub("^file://(?=[^/])", "file:////", address)  # a network share: to SQLite, the server belongs to the path
    return sqlite3.connect(address, uri=True, timeout=_PATIENCE_S, isolation_level=None, check_same_thread=False)


@contextmanager
def _transaction(connection: sqlite3.Connection) -> Iterator[None]:
    connection.execute("BEGIN IMMEDIATE")
    try:
        yield
        connection.execute("COMMIT")
    except BaseException:
        if connection.in_transaction:  # SQLite has rolled back by itself after some failures
            connection.execute("ROLLBACK")
        raise


@contextmanager
def name_record(path: Path, record: Record) -> Iterator[None]:
    """Say which record of a file it is that cannot be read."""
    try:
        yield
    except StoreError as error:
        what = f"record {record.number} ({record.kind} of run {record.run})"
        raise StoreError(f"{path}: {what} cannot be read: {error}; `cmmlink verify` says more") from None


def has_records(folder: Path) -> bool:
    """Tell whether there is a file of records in a folder. Raises StoreError where the system does not say."""
    try:
        return stat.S_ISREG((folder / FILE_NAME).stat().st_mode)
    except (FileNotFoundError, NotADirectoryError):
        return False
    except OSError as error:
        raise StoreError(f"{folder / FILE_NAME}: cannot be opened: {error}; choose another folder with --records DIR") from None
