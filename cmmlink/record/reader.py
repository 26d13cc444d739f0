"""Reads the records of a station: the list of runs, one run in full, and whether anything was altered.

A run whose end is missing is closed as interrupted by whoever opens the records next, unless it is being recorded just now.
Where that cannot be written, it is read as interrupted all the same.
"""

import dataclasses
import re
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from platformdirs import user_data_path

from cmmlink.errors import RunError, StationBusyError, StoreError
from cmmlink.record.anchors import anchors_of
from cmmlink.record.bodies import PlacedArrival, unpack_arrivals, unpack_document, unpack_points, unpack_reads
from cmmlink.record.chain import Record, is_damaged
from cmmlink.record.derived import derived_of
from cmmlink.record.machine_answer import answer_of
from cmmlink.record.origin import origin_of
from cmmlink.record.recorder import end_draft
from cmmlink.record.search import RunSearch
from cmmlink.record.shapes import End, Header, Result, checked
from cmmlink.record.signature import signature_of
from cmmlink.record.station_lock import PATIENCE_S
from cmmlink.record.store import Store, has_records, name_record
from cmmlink.words import deciding_words
from drivers import Arrival, PointBatch, Rejected, WireBytes

_FROM_HEADER = ("run", "started", "part", "serial_number", "simulated", "operator", "plan_file")
_FROM_END = ("state", "received", "verdict", "coverage")
_SHAPES: dict[str, type[Any]] = {"run": Header, "result": Result, "end": End}
_CUT_OFF = "the program ended before the run did: power failure, crash or kill"


@dataclass(frozen=True, slots=True)
class RecordedRun:
    """One run as it is kept. `end` is None while it is being recorded, `result` where no result was reached."""

    header: dict[str, Any]
    plan: str
    nominal: bytes
    end: dict[str, Any] | None
    result: dict[str, Any] | None
    chain_sha256: str

    @property
    def run(self) -> str:
        """The run's id."""
        return str(self.header["run"])

    @property
    def is_of_surface(self) -> bool:
        """Whether it is a run of a whole surface, and not of a section: its plan says so."""
        return any(line.startswith("surface:") for line in self.plan.splitlines())


def default_folder() -> Path:
    """Folder of the records when neither command nor plan says otherwise: in the user's data folder."""
    return user_data_path("cmmlink", appauthor=False) / "records"


@contextmanager
def open_to_record(folder: Path, now: Callable[[], datetime], patience_s: float = PATIENCE_S) -> Iterator[Store]:
    """Open the records to add a run. Raises StoreError when another process does so, and goes on doing so for `patience_s`."""
    with Store(folder, writing=True, epoch_s=lambda: now().timestamp(), patience_s=patience_s) as store:
        _close_interrupted(store, now)
        yield store


@contextmanager
def open_to_read(folder: Path, now: Callable[[], datetime], *, close_interrupted: bool = True) -> Iterator[Store]:
    """Open the records to read them. Raises RunError where there are none."""
    if not has_records(folder):
        raise RunError(f"{folder}: there are no records here; --records DIR says where they are")
    with Store(folder, writing=False, epoch_s=lambda: now().timestamp()) as store:
        unfinished = any(end is None for _, end in store.begins_and_ends())
    recording = False
    if unfinished and close_interrupted:
        try:
            with open_to_record(folder, now):
                pass
        except StationBusyError:
            recording = True
        except StoreError:  # the disk is full, or the medium write-protected: nobody records, and the run stays without its end
            pass
    with Store(folder, writing=False, epoch_s=lambda: now().timestamp()) as store:
        store.recording = recording
        yield store


def list_runs(folder: Path, now: Callable[[], datetime], deciding: bool = False, search: RunSearch | None = None) -> list[dict[str, Any]]:
    """Every run that is looked for, oldest first: what its header says of it, its place in a stack, and how it ended.

    The state of a run that another process records just now is "running"; a run that gave no result has no verdict.

    search   : which runs; None: all
    deciding : read the results as well, and tell which of several characteristics decided; else nothing is told of that
    """
    if not has_records(folder):
        return []
    with open_to_read(folder, now) as store:
        entries = entries_of(store, search)
        return [entry | {"decided_by": _decider(store, entry) if deciding else ""} for entry in entries]


def entries_of(store: Store, search: RunSearch | None = None) -> list[dict[str, Any]]:
    """A line for every run that is looked for, as `list_runs` gives it."""
    all_entries = (_entry(store, begin, end) for begin, end in store.begins_and_ends())
    return [entry for entry in all_entries if search is None or search.finds(entry)]


def earlier_run(folder: Path, part: str, serial_number: str, now: Callable[[], datetime]) -> str | None:
    """The id of the newest run of a part with a serial number, None where it was not measured yet."""
    return next((run for run, serial in _newest_parts(folder, part, now) if serial == serial_number), None)


def last_serial_number(folder: Path, part: str, now: Callable[[], datetime]) -> str | None:
    """The serial number of the newest run of a part that has one."""
    return next((serial for _, serial in _newest_parts(folder, part, now) if serial), None)


def _newest_parts(folder: Path, part: str, now: Callable[[], datetime]) -> Iterator[tuple[str, str]]:
    """The id and the serial number of each run of a part, newest first; damaged headers tell nothing."""
    if not has_records(folder):
        return
    with open_to_read(folder, now) as store:
        for begin, _ in reversed(store.begins_and_ends()):
            found, serial_number = _part_of(store, begin)
            if found == part:
                yield str(begin.run), serial_number


def find_run(store: Store, name: str) -> str:
    """The id of the run that `name` means. Raises RunError where none is meant, or several are.

    name : an id, the beginning of one, its counter (12 for ...-0012), `last`, `last~1` for the one before it, or a serial number
    """
    begins = [begin for begin, _ in store.begins_and_ends()]
    found = _runs_named(store, begins, name)
    if len(found) == 1:
        return found[0]
    what = f"{len(found)} runs are meant by {name!r}: {', '.join(found[:5])}" if found else f"there is no run {name!r}"
    raise RunError(f"{store.path}: {what}; `cmmlink runs` lists them")


def _runs_named(store: Store, begins: Sequence[Record], name: str) -> list[str]:
    """The ids of the runs that a name may mean: by the first of its meanings that there is."""
    runs = [str(begin.run) for begin in begins]
    back = re.fullmatch(r"last(?:~([0-9]{1,9}))?", name)
    if back:
        place = len(runs) - 1 - int(back[1] or 0)
        return runs[place : place + 1] if place >= 0 else []
    if name in runs:
        return [name]
    counter = int(name) if re.fullmatch(r"[0-9]{1,6}", name) else None
    counted = [run for run in runs if (tail := run.rpartition("-")[2]).isdecimal() and int(tail) == counter]
    with_serial = [str(begin.run) for begin in begins if _part_of(store, begin)[1] == name]
    return sorted({*counted, *with_serial}) or [run for run in runs if run.startswith(name)]


def _part_of(store: Store, begin: Record) -> tuple[str, str]:
    """The part and the serial number of a run; a header that is damaged tells neither."""
    try:
        header = {} if is_damaged(begin) else _document(store, begin)
    except StoreError:
        return "", ""
    return str(header.get("part") or ""), str(header.get("serial_number") or "")


def find_stack(store: Store, name: str) -> tuple[str, list[str]]:
    """The id of a stack of sections and its runs in their order. Raises RunError.

    name : its id, the beginning of one, or a run of it
    """
    stacks: dict[str, dict[str, int]] = {}
    for begin, _ in store.begins_and_ends():
        place = (_document(store, begin).get("stack") or {}) if not is_damaged(begin) else {}
        if "stack" in place:
            stacks.setdefault(place["stack"], {})[str(begin.run)] = place["section"]
    found = [stack for stack in stacks if stack == name] or [stack for stack in stacks if name and stack.startswith(name)]
    if len(found) != 1:
        run = find_run(store, name)
        found = [stack for stack, runs in stacks.items() if run in runs]
    if not found:
        raise RunError(f"{store.path}: run {run} is no section of a surface, so that no stack belongs to it")
    runs = stacks[found[0]]
    return found[0], sorted(runs, key=lambda run: runs[run])


def recorded_run(store: Store, run: str) -> RecordedRun:
    """Read all but the bulk of a run. Raises StoreError where a record is missing or damaged."""
    found: dict[str, Record] = {}
    for kind in ("run", "plan", "nominal", "result", "end"):
        found.update((kind, record) for record in store.records(run, kind))
    for kind in ("run", "plan", "nominal"):
        if kind not in found:
            raise StoreError(f"{store.path}: the {kind} record of run {run} is missing; `cmmlink verify` says more")
    documents = {kind: _document(store, found[kind]) for kind in _SHAPES if kind in found}
    if documents["run"]["run"] != run:
        raise StoreError(f"{store.path}: run {run} says that it is another; `cmmlink verify` says more")
    sha256 = bytes(found["end"].sha256).hex() if "end" in found else ""
    plan = found["plan"].body.decode(errors="replace")  # it is read as a plan, and refused there
    return RecordedRun(documents["run"], plan, found["nominal"].body, documents.get("end"), documents.get("result"), sha256)


def run_header(store: Store, run: str) -> dict[str, Any]:
    """What a run begins with. Raises StoreError where it cannot be read."""
    for record in store.records(run, "run"):
        return _document(store, record)
    raise StoreError(f"{store.path}: the run record of run {run} is missing; `cmmlink verify` says more")


def recorded_result(store: Store, run: str) -> dict[str, Any]:
    """The result of a run alone; nothing where there is none. Raises StoreError where it cannot be read."""
    return next((_document(store, record) for record in store.records(run, "result")), {})


def _document(store: Store, record: Record) -> dict[str, Any]:
    """The document of a record, checked. Raises StoreError."""
    with name_record(store.path, record):
        document: dict[str, Any] = unpack_document(record.body)
        checked(_SHAPES[record.kind], document)
        return document


def reads_of(store: Store, run: str) -> Iterator[WireBytes]:
    """Every read of raw bytes, in order."""
    for record in store.records(run, "wire"):
        with name_record(store.path, record):
            reads = unpack_reads(record.body)
        yield from reads


def points_of(store: Store, run: str) -> Iterator[PointBatch]:
    """Every point, in order, as many at once as a record holds; with their normals where a record of these follows."""
    all_normals = store.records(run, "normals")
    normals = next(all_normals, None)
    for record in store.records(run, "points"):
        follows = normals is not None and normals.number == record.number + 1
        with name_record(store.path, normals if follows and normals is not None else record):
            batch = unpack_points(record.body, normals.body if follows and normals is not None else None)
        normals = next(all_normals, None) if follows else normals
        yield batch


def arrivals_of(store: Store, run: str) -> Iterator[PlacedArrival]:
    """Every arrival other than bytes and points, in order."""
    for record in store.records(run, "events"):
        with name_record(store.path, record):
            moments = unpack_arrivals(record.body)
        yield from moments


def registrations_of(store: Store, run: str) -> list[dict[str, Any]]:
    """The history of the registration: a document for each pose that was noted."""
    found: list[dict[str, Any]] = []
    for record in store.records(run, "registration"):
        with name_record(store.path, record):
            found += checked(list[dict[str, Any]], unpack_document(record.body))
    return found


def describe(store: Store, run: str) -> dict[str, Any]:
    """Everything about a run except its points, as plain values."""
    recorded = recorded_run(store, run)
    end = recorded.end or end_missing(store, run)
    moments = list(arrivals_of(store, run))
    totals = store.totals(run)
    return {
        **recorded.header,
        **{key: end.get(key) for key in ("state", "ended", "message", "received", "verdict", "coverage")},
        "result": recorded.result,
        "chain_sha256": recorded.chain_sha256,
        "signature": None if (signature := signature_of(store, run)) is None else signature.beside_result(),
        "answer": answer_of(store, run),
        "anchors": [dataclasses.asdict(one) for one in anchors_of(store, run)],
        "origin": None if (origin := origin_of(store, run)) is None else origin.model_dump(mode="json"),
        "derived": derived_of(store, run),
        "recorded": {
            "wire_bytes": sum(len(read.data) for read in reads_of(store, run)),
            "reads": totals.get("wire", (0, 0))[1],
            "points": totals.get("points", (0, 0))[1],
            "events": dict(Counter(type(moment.arrival).__name__ for moment in moments)),
            "records": sum(records for records, _ in totals.values()),
        },
        "events": [event_document(moment) for moment in moments if _is_telling(moment.arrival)],
        "registrations": registrations_of(store, run),
        "plan": recorded.plan,
    }


def event_document(moment: PlacedArrival) -> dict[str, Any]:
    """An arrival with its place, as plain values."""
    place = {"event": type(moment.arrival).__name__, "time_s": moment.time_s, "after_points": moment.points}
    return place | dataclasses.asdict(moment.arrival)


def check_chain(store: Store, run: str | None) -> dict[str, Any]:
    """Recompute the chain of a run, or of all: altered, records (sound ones), chain_sha256, and the first altered record.

    The hash is that of the last sound record, of a run that of its end.
    """
    found, sound, last = store.first_alteration(run)
    if run is not None and found is None:
        last = next((bytes(end.sha256) for end in store.records(run, "end")), last)
    first = None if found is None else {**dataclasses.asdict(found), "message": str(found)}
    return {"altered": found is not None, "run": run, "records": sound, "chain_sha256": last.hex(), "first": first}


def _is_telling(arrival: Arrival) -> bool:
    return type(arrival).__name__ not in (
        "Damaged",
        "Heartbeat",
    )  # there may be thousands: they are only counted here


def _entry(store: Store, begin: Record, end: Record | None) -> dict[str, Any]:
    damaged = {"run": str(begin.run), "state": "damaged"} | dict.fromkeys((*_FROM_HEADER[1:], "stack", *_FROM_END[1:]))
    if is_damaged(begin) or (end is not None and is_damaged(end)):
        return damaged
    try:
        header = _document(store, begin)
        closing = _document(store, end) if end else end_missing(store, begin.run)
    except StoreError:
        return damaged
    stack = header.get("stack")
    place = {key: value for key, value in stack.items() if key != "plan"} if stack else None
    return {key: header.get(key) for key in _FROM_HEADER} | {"stack": place} | {key: closing.get(key) for key in _FROM_END}


def _decider(store: Store, entry: Mapping[str, Any]) -> str:
    """Which of several characteristics gave a run its verdict; nothing where it conforms, or where its result cannot be read."""
    if entry["verdict"] in (None, "conform"):
        return ""
    try:
        result = recorded_result(store, entry["run"])
    except StoreError:
        return ""
    return deciding_words([(one["name"], one["verdict"]) for one in result.get("characteristics", ())])


def end_missing(store: Store, run: str) -> dict[str, Any]:
    """What stands in place of a run's end: it goes on, or it was interrupted and that could not be written."""
    if store.recording:
        return {"state": "running", "message": "the run is being recorded", "received": None, "verdict": None}
    return {"state": "interrupted", "message": _CUT_OFF, "received": _count_received(store, run), "verdict": None}


def _close_interrupted(store: Store, now: Callable[[], datetime]) -> None:
    for begin, end in store.begins_and_ends():
        if end is None:
            store.append([end_draft(begin.run, "interrupted", _CUT_OFF, now(), {"received": _count_received(store, begin.run)})])


def _count_received(store: Store, run: str) -> int | None:
    """Points of a run that was cut off, None where a damaged record hides their number."""
    try:
        rejected = sum(moment.arrival.count for moment in arrivals_of(store, run) if isinstance(moment.arrival, Rejected))
        return rejected + sum(len(batch) for batch in points_of(store, run))
    except StoreError:
        return None
