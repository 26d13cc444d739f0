"""Backups of the records, and merging those of two stations. All of it is checked to the last hash before anything counts.

A backup is one file of records, as a station has it, and holds what was acknowledged when it was begun: it can be made while a run is
recorded. Restoring adds to a station what the backup has beyond it, or gives an empty folder all of it. Merging adds the runs of
another station, or a run that was exported, behind those that are there, each with its origin.
"""

import hashlib
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from dataclasses import replace as replace_fields
from datetime import datetime
from pathlib import Path

from cmmlink.errors import PlanError, RunError, StoreError
from cmmlink.record.chain import BEHIND_THE_END, GENESIS, Record
from cmmlink.record.evidence import is_evidence, open_evidence
from cmmlink.record.origin import Origin, origin_of
from cmmlink.record.reader import open_to_read, open_to_record
from cmmlink.record.station_lock import StationLock
from cmmlink.record.store import FILE_NAME, Store, has_records
from cmmlink.words import utc_words

_MEND = "choose another place, or free some space"
_EXPECTED = "expected a backup of records, or a folder of them"
Now = Callable[[], datetime]
Tell = Callable[[float], None]


@dataclass(frozen=True, slots=True)
class Copied:
    """What a file of records holds by now.

    added      : ids of the runs that were not there before
    unfinished : ids of the runs that have no end: they were being recorded when the backup was begun, or were cut off
    aside      : where the records that were there before are kept; None where nothing was moved
    """

    path: Path
    runs: int
    records: int
    chain_sha256: str
    added: tuple[str, ...] = ()
    unfinished: tuple[str, ...] = ()
    aside: Path | None = None


def back_up(folder: Path, file: Path, now: Now, *, replace: bool = False, tell: Tell = lambda share: None) -> Copied:
    """Copy the records of a folder to a file, and check every hash of the copy. A backup that was there stays until that is done.

    Raises RunError where there are no records, PlanError for a file that is there already, StoreError where the records were altered or
    cannot be copied: then no backup is left.
    """
    if not has_records(folder):
        raise RunError(f"{folder}: there are no records here; --records DIR says where they are")
    if file.exists() and not replace:
        raise PlanError(f"{file}: there is a file of this name already; choose another name, or --replace to write a new backup over it")
    if file.exists() and file.resolve() == (folder / FILE_NAME).resolve():
        raise PlanError(f"{file}: these are the records themselves; choose another file for their backup")
    with _open(folder / FILE_NAME, now) as store, _new_file(file) as part:
        store.back_up(part, tell)
        with _open(part, now) as copy:
            made = _checked(copy, of=store.path)
        os.replace(part, file)
    return replace_fields(made, path=file)


def restore(file: Path, folder: Path, now: Now, *, replace: bool = False, tell: Tell = lambda share: None) -> Copied:
    """Bring back what a backup holds: all of it into a folder without records, else what it has beyond those that are there.

    replace : move the records that are there aside first, as when they are damaged

    Raises PlanError where the records there went on otherwise than the backup, StoreError where either was altered, or while
    another process records there. Nothing is changed then.
    """
    with _open_given(file, now) as backup:
        _require_another(backup, folder)
        held = _checked(backup, of=file)
        if has_records(folder) and not replace:
            return _add_what_is_missing(backup, held, folder, now)
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise StoreError(f"{folder}: cannot be made: {error.strerror or error}; choose another folder with --records DIR") from None
        lock = StationLock(folder / "station.lock")
        try:
            with _new_file(folder / FILE_NAME) as part:
                backup.back_up(part, tell)
                with _open(part, now) as copy:
                    made = _checked(copy, of=folder / FILE_NAME)
                aside = _put_in_place(part, folder, now)
            return replace_fields(made, path=folder / FILE_NAME, added=_ids(backup), aside=aside)
        finally:
            lock.release()


def merge(file: Path, folder: Path, now: Now, tell: Tell = lambda share: None) -> Copied:
    """Add the runs of another station's records, of their backup, or of an export, that are not there yet. Each keeps id and origin.

    A run without its end is left out: it can be merged once it has one. Raises StoreError where either file was altered, or where both
    have a run of one id with different contents: then nothing is added.
    """
    with _runs_given(file, now) as other:
        _require_another(other, folder)
        _checked(other, of=file)
        with open_to_record(folder, now) as store:
            _checked(store, of=store.path)
            there = dict.fromkeys(_ids(store))
            ended = [str(begin.run) for begin, end in other.begins_and_ends() if end is not None]
            for run in ended:
                if run in there and _content(store, run) != _content(other, run):
                    raise StoreError(f"{store.path}: run {run} is there with another content than in {file}; nothing was merged")
            added = [run for run in ended if run not in there]
            for count, run in enumerate(added):
                tell(count / len(added))
                store.adopt(_with_origin(other, run, file.name, utc_words(now())))
            left = tuple(str(begin.run) for begin, end in other.begins_and_ends() if end is None)
            return Copied(store.path, store.count_runs(), store.head[0], store.head[1].hex(), tuple(added), left)


def _add_what_is_missing(backup: Store, held: Copied, folder: Path, now: Now) -> Copied:
    """Add the records of a backup that follow on those which are there. Its own interrupted runs stay as they are."""
    with Store(folder, writing=True, epoch_s=lambda: now().timestamp()) as store:
        _checked(store, of=store.path)
        number, last = store.head
        first = backup.head[0]
        if number <= first:
            follows = number == 0 or _hash_at(backup, number) == last
        else:
            follows = first == 0 or _hash_at(store, first) == backup.head[1]
        if not follows:
            raise PlanError(
                f"{store.path}: the records there are not those that the backup was made of, or went on otherwise since; nothing was "
                "restored. Restore into another folder with --records DIR, add the runs of the backup with `cmmlink merge`, or move what "
                "is there aside with --replace"
            )
        before = set(_ids(store))
        if number < first:
            store.adopt(backup.records_from(number + 1))
            if store.head != backup.head:
                raise StoreError(f"{store.path}: what was restored does not end as the backup does; `cmmlink verify` says more")
        added = tuple(run for run in _ids(store) if run not in before)
        return Copied(store.path, store.count_runs(), store.head[0], store.head[1].hex(), added, held.unfinished if number < first else ())


def _with_origin(other: Store, run: str, name: str, merged: str) -> Iterator[Record]:
    """The records of a run and, behind its end, where it comes from; a run that was taken over before keeps its first origin."""
    first, count, known = 0, 0, origin_of(other, run) is not None
    for record in other.records(run):
        first, count = first or record.number, count + 1
        yield record
        if record.kind == "end" and not known:
            origin = Origin(
                file=name,
                first=first,
                records=count,
                previous=_hash_at(other, first - 1).hex(),
                chain_sha256=bytes(record.sha256).hex(),
                merged=merged,
            )
            draft = origin.draft(run)
            yield Record(0, run, draft.kind, record.time_s, draft.count, draft.body, 0, b"")  # its place and hashes are given to it there
            known = True


def _content(store: Store, run: str) -> bytes:
    """A hash of all that was recorded of a run, wherever its records stand."""
    digest = hashlib.sha256()
    for record in store.records(run):
        if record.kind not in BEHIND_THE_END:
            digest.update(f"{record.kind}\n{record.time_s!r}\n{record.count}\n{len(record.body)}\n".encode() + record.body)
    return digest.digest()


def _hash_at(store: Store, number: int) -> bytes:
    record = store.record_at(number)
    return GENESIS if record is None else bytes(record.sha256)


def _ids(store: Store) -> tuple[str, ...]:
    return tuple(str(begin.run) for begin, _ in store.begins_and_ends())


def _checked(store: Store, of: Path) -> Copied:
    """What a file of records holds, every hash recomputed. Raises StoreError for the first record that was altered."""
    altered, records, last = store.first_alteration()
    if altered is not None:
        raise StoreError(f"{of}: {altered}; nothing was copied. Keep the file as it is; `cmmlink verify` says more")
    runs = store.begins_and_ends()
    unfinished = tuple(str(begin.run) for begin, end in runs if end is None)
    return Copied(of, len(runs), records, last.hex(), unfinished=unfinished)


def _open(file: Path, now: Now) -> Store:
    return Store(file.parent, writing=False, epoch_s=lambda: now().timestamp(), name=file.name)


def _open_given(file: Path, now: Now) -> Store:
    """Open a file of records, or that of a folder. Raises PlanError where there is none."""
    found = file / FILE_NAME if file.is_dir() else file
    if not found.is_file() or not found.stat().st_size:
        raise PlanError(f"{found}: there are no records here; {_EXPECTED}")
    try:
        return _open(found, now)
    except StoreError as error:
        raise PlanError(f"{str(error).partition('; ')[0]}; {_EXPECTED}") from None


@contextmanager
def _runs_given(file: Path, now: Now) -> Iterator[Store]:
    """The records of a file or a folder, or the run that was exported to a folder. Raises PlanError where there are none."""
    if is_evidence(file):
        with open_evidence(file, now) as evidence:
            yield evidence.store
    else:
        with _open_given(file, now) as store:
            yield store


@contextmanager
def open_archive(place: Path, now: Now) -> Iterator[Store]:
    """The records of a folder, of a backup or of an export, to be read. Raises PlanError where there are none."""
    with open_to_read(place, now) if has_records(place) else _runs_given(place, now) as store:
        yield store


def _require_another(given: Store, folder: Path) -> None:
    if given.path.resolve() == (folder / FILE_NAME).resolve():
        raise PlanError(f"{given.path}: these are the records themselves; {_EXPECTED.replace('a folder of them', 'the folder of others')}")


@contextmanager
def _new_file(file: Path) -> Iterator[Path]:
    """A file to write beside `file`, whose place it may take; what is left of it at the end is removed."""
    part = file.with_name(f"{file.name}.part")
    try:
        part.unlink(missing_ok=True)
        yield part
    except OSError as error:
        raise StoreError(f"{file}: cannot be written: {error.strerror or error}; {_MEND}") from None
    except StoreError as error:
        cause, found, _ = str(error).removeprefix(f"{part}: ").partition("; ")
        if not str(error).startswith(f"{part}: ") or not found:
            raise
        raise StoreError(f"{file}: {cause}; {_MEND}") from None
    finally:
        for left in (part, part.with_name(f"{part.name}-journal")):
            with suppress(OSError):
                left.unlink(missing_ok=True)


def _put_in_place(part: Path, folder: Path, now: Now) -> Path | None:
    """Make a file the records of a folder. Returns where those are that were there, with the log that SQLite keeps beside them."""
    aside = folder / f"station-before-{now():%Y%m%d-%H%M%S}.sqlite"
    there = [(folder / f"{FILE_NAME}{suffix}", aside.with_name(aside.name + suffix)) for suffix in ("-wal", "-shm", "")]
    moved = [(old, new) for old, new in there if old.exists()]
    try:
        for old, new in moved:
            os.replace(old, new)
        os.replace(part, folder / FILE_NAME)
    except OSError:
        for old, new in moved:  # a station without records would begin new ones
            if new.exists():
                os.replace(new, old)
        raise
    return aside if moved else None
