"""Power cuts: what a disk may hold of a station's file when the power goes, with sectors that were not yet safe lost or swapped.

SQLite's own way to the disk is watched: a virtual file system of ours stands before the real one and notes every write, cut and
synchronisation of the file and of its write-ahead log. A cut at any of these moments leaves what was synchronised, and of everything
written since any choice of sectors, in any order. A file system keeps the order of its own names: a deletion is safe once anything is
synchronised after it, as ext4, XFS, NTFS and APFS have it. `python -m tests.integration.power_cuts CUTS` tries so many.
"""

import ctypes
import random
import sqlite3
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from ctypes.util import find_library
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from cmmlink.errors import StoreError
from cmmlink.record.chain import Draft
from cmmlink.record.reader import check_chain, list_runs, open_to_read
from cmmlink.record.store import Store
from tests.cmmlink.recorded import Script, record, scan_arrivals, today

SECTOR = 512
_WRITE, _TRUNCATE, _SYNC = 3, 4, 5  # places in sqlite3_io_methods, whose version stands in place 0
_POINTER = ctypes.c_void_p
_Methods = _POINTER * 19  # sqlite3_io_methods of version 3
_WriteCall = ctypes.CFUNCTYPE(ctypes.c_int, _POINTER, _POINTER, ctypes.c_int, ctypes.c_int64)
_TruncateCall = ctypes.CFUNCTYPE(ctypes.c_int, _POINTER, ctypes.c_int64)
_SyncCall = ctypes.CFUNCTYPE(ctypes.c_int, _POINTER, ctypes.c_int)
_OpenCall = ctypes.CFUNCTYPE(ctypes.c_int, _POINTER, _POINTER, _POINTER, ctypes.c_int, ctypes.POINTER(ctypes.c_int))
_DeleteCall = ctypes.CFUNCTYPE(ctypes.c_int, _POINTER, ctypes.c_char_p, ctypes.c_int)


class _Vfs(ctypes.Structure):
    """sqlite3_vfs of version 3; what stands behind `delete` is copied as it is."""

    _fields_ = [
        ("version", ctypes.c_int),
        ("file_size", ctypes.c_int),
        ("longest_path", ctypes.c_int),
        ("next", _POINTER),
        ("name", ctypes.c_char_p),
        ("data", _POINTER),
        ("open", _POINTER),
        ("delete", _POINTER),
        ("others", _POINTER * 14),
    ]


@dataclass(frozen=True)
class Step:
    """What happened to a file.

    what   `write` data at a place, `truncate` to a size, `sync`, `delete` (at 1: safely), or `said`: so many records are safe
    """

    what: str
    file: str
    at: int = 0
    data: bytes = b""


@dataclass
class Trace:
    """Everything that happened on the way to the disk, in its order; holds the callbacks for as long as SQLite may call them."""

    steps: list[Step] = field(default_factory=list)
    names: dict[int, str] = field(default_factory=dict)
    keep: list[Any] = field(default_factory=list)

    def say(self, records: int) -> None:
        """Note that the application was told that so many records are safe."""
        self.steps.append(Step("said", "", records))


def library() -> ctypes.CDLL | None:
    """The SQLite that Python itself has loaded, where it can be watched."""
    name = find_library("sqlite3")
    try:
        found = ctypes.CDLL(name) if name else None
        found = found if found and hasattr(found, "sqlite3_vfs_find") else None
    except OSError:
        return None
    if found is None:
        return None
    found.sqlite3_libversion.restype = ctypes.c_char_p
    found.sqlite3_vfs_find.restype = ctypes.POINTER(_Vfs)
    return found if found.sqlite3_libversion().decode() == sqlite3.sqlite_version else None


@contextmanager
def traced() -> Iterator[Trace]:
    """Watch every file that SQLite opens meanwhile."""
    sqlite = library()
    assert sqlite is not None, "Python's SQLite cannot be watched here"
    trace, real = Trace(), sqlite.sqlite3_vfs_find(None).contents
    ours = _Vfs.from_buffer_copy(real)
    ours.name = b"watched"
    open_really, delete_really = _OpenCall(real.open), _DeleteCall(real.delete)

    def open_file(vfs: int, name: int | None, file: int, flags: int, told: Any) -> int:
        code = int(open_really(vfs, name, file, flags, told))  # by its address: SQLite goes on using the name
        if code == 0 and name:
            trace.names[file] = Path(ctypes.string_at(name).decode()).name
            _watch_file(trace, file)
        return code

    def delete_file(vfs: int, name: bytes, sync: int) -> int:
        code = int(delete_really(vfs, name, sync))
        if code == 0:
            trace.steps.append(Step("delete", Path(name.decode()).name, sync))
        return code

    trace.keep += [_OpenCall(open_file), _DeleteCall(delete_file)]
    ours.open, ours.delete = (ctypes.cast(call, _POINTER).value for call in trace.keep)
    sqlite.sqlite3_vfs_register(ctypes.byref(ours), 1)
    try:
        yield trace
    finally:
        sqlite.sqlite3_vfs_unregister(ctypes.byref(ours))
        sqlite.sqlite3_vfs_register(ctypes.byref(real), 1)


def _watch_file(trace: Trace, file: int) -> None:
    """Put methods that note what they do in the place of an open file's own."""
    where = _POINTER.from_address(file)
    assert where.value is not None
    ours = _Methods.from_buffer_copy(_Methods.from_address(where.value))
    real = [ours[place] or 0 for place in (_WRITE, _TRUNCATE, _SYNC)]
    write_really, truncate_really, sync_really = _WriteCall(real[0]), _TruncateCall(real[1]), _SyncCall(real[2])

    def write(handle: int, data: int, size: int, at: int) -> int:
        trace.steps.append(Step("write", trace.names[handle], at, ctypes.string_at(data, size)))
        return int(write_really(handle, data, size, at))

    def truncate(handle: int, size: int) -> int:
        trace.steps.append(Step("truncate", trace.names[handle], size))
        return int(truncate_really(handle, size))

    def sync(handle: int, flags: int) -> int:
        code = int(sync_really(handle, flags))
        trace.steps.append(Step("sync", trace.names[handle]))
        return code

    calls: list[Any] = [_WriteCall(write), _TruncateCall(truncate), _SyncCall(sync)]
    for place, call in zip((_WRITE, _TRUNCATE, _SYNC), calls, strict=True):
        ours[place] = ctypes.cast(call, _POINTER).value
    trace.keep += [ours, *calls]
    where.value = ctypes.addressof(ours)


@dataclass
class _OnDisk:
    """One file: what is safe, and what was written since."""

    safe: bytearray = field(default_factory=bytearray)
    since: list[Step] = field(default_factory=list)
    deleted: bool = False
    is_deletion_safe: bool = False

    def take(self, step: Step) -> None:
        if step.what == "delete":
            self.deleted, self.is_deletion_safe = True, bool(step.at)
        elif self.deleted:  # it was created anew, so that it had been deleted is safe as well
            self.safe, self.since, self.deleted = bytearray(), [], False
        if step.what == "sync":
            for one in self.since:
                _apply(self.safe, one)
            self.since = []
        elif step.what != "delete":
            self.since.append(step)

    def after_the_cut(self, rng: random.Random) -> bytes | None:
        """What the disk holds: of what was written since, any sectors in any order."""
        if self.deleted and (self.is_deletion_safe or rng.random() < 0.5):
            return None
        kept, share = bytearray(self.safe), rng.choice([0.0, 0.1, 0.5, 0.9, 1.0])
        pieces = [piece for step in self.since for piece in _sectors(step) if rng.random() < share]
        if rng.random() < 0.7:
            rng.shuffle(pieces)
        for piece in pieces:
            _apply(kept, piece, rng.choice([b"\0", b"\xa5"]))
        return bytes(kept)


def _apply(content: bytearray, step: Step, filler: bytes = b"\0") -> None:
    if step.what == "truncate":
        del content[step.at :]
        return
    content.extend(filler * max(0, step.at - len(content)))
    content[step.at : step.at + len(step.data)] = step.data


def _sectors(step: Step) -> Iterator[Step]:
    """A write as the pieces that a disk writes one by one."""
    if step.what != "write":
        yield step
        return
    first = 0
    while first < len(step.data):
        last = min(len(step.data), first + SECTOR - (step.at + first) % SECTOR)
        yield Step("write", step.file, step.at + first, step.data[first:last])
        first = last


def cut(steps: list[Step], at: int, folder: Path, rng: random.Random) -> int:
    """Write what the disk holds when the power goes before step `at`; returns how many records were said to be safe by then."""
    disk: dict[str, _OnDisk] = {}
    said = 0
    for step in steps[:at]:
        if step.what == "said":
            said = step.at
        else:
            disk.setdefault(step.file, _OnDisk()).take(step)
            if step.what == "sync":
                for file in disk.values():
                    file.is_deletion_safe = file.deleted
    for name, file in disk.items():
        content = file.after_the_cut(rng)
        if content is not None and name.startswith("station.sqlite"):
            (folder / name).write_bytes(content)
    return said


def trace_of_records(folder: Path, rng: random.Random, appends: int = 25) -> Trace:
    """Fill a station with runs of records small and large, over more than one length of the log, and close it twice in between."""
    with traced() as trace:
        number = 0
        for run in range(3):
            with Store(folder, writing=True, epoch_s=lambda: 12.5) as store:
                for _ in range(appends):
                    drafts = [Draft(f"run {run}", "wire", rng.randbytes(rng.choice([10, 3000, 120_000]))) for _ in range(rng.randint(1, 3))]
                    number = store.append(drafts)[-1].number
                    trace.say(number)
    return trace


def trace_of_a_run(folder: Path) -> Trace:
    """Record a run as it is recorded, every event committed at once."""
    with traced() as trace:
        record(folder, Script(*scan_arrivals(count=200, batch=10)), commit_s=0.0, acknowledge=lambda safe: trace.say(-safe.points))
    return trace


def check(folder: Path, said: int) -> str:
    """Open what a cut left; returns what is wrong, nothing if all is well. `said` counts records, or points where it is negative."""
    if not (folder / "station.sqlite").is_file() or not (folder / "station.sqlite").stat().st_size:
        return "" if not said and not _has_bytes(folder / "station.sqlite-wal") else "the file is gone"
    with open_to_read(folder, today, close_interrupted=False) as store:
        found = check_chain(store, None)
        if found["altered"]:
            return f"verify: {found['first']['message']}"
        if said >= 0:
            return "" if found["records"] >= said else f"{said} records were said to be safe, {found['records']} are there"
        kept = sum(store.totals(run["run"]).get("points", (0, 0))[1] for run in list_runs(folder, today))
        return "" if kept >= -said else f"{-said} points were said to be safe, {kept} are there"


def _has_bytes(path: Path) -> bool:
    return path.is_file() and path.stat().st_size > 0


def cut_often(trace: Trace, cuts: int, rng: random.Random) -> list[str]:
    """Cut the power at so many moments; returns what went wrong."""
    wrong = []
    for _ in range(cuts):
        at = rng.randint(1, len(trace.steps))
        with tempfile.TemporaryDirectory() as place:
            said = cut(trace.steps, at, Path(place), rng)
            try:
                words = check(Path(place), said)
            except StoreError as error:
                words = str(error)
            if words:
                wrong.append(f"before step {at} ({trace.steps[at - 1].what} {trace.steps[at - 1].file}): {words}")
            elif said > 0:
                with Store(Path(place), writing=True, epoch_s=lambda: 13.0) as store:
                    store.append([Draft("after", "run", b"{}")])
    return wrong


def main(cuts: int) -> int:
    """Cut the power so often at a station with records of its own, and as often during a run."""
    rng, wrong = random.Random(1), list[str]()
    makers: list[Callable[[Path], Trace]] = [lambda folder: trace_of_records(folder, rng), trace_of_a_run]
    for make in makers:
        with tempfile.TemporaryDirectory() as place:
            trace = make(Path(place))
        wrong += cut_often(trace, cuts, rng)
        print(f"{cuts} power cuts among {len(trace.steps)} steps to the disk", flush=True)
    print(*wrong, f"{len(wrong)} went wrong", sep="\n")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1])))
