"""The records of one run in two files, as an export hands them over, and the run as records again on another computer.

records.bin has the bodies of the records one behind the other, chain.csv their places in the chain. From these two alone the run is
judged again: whatever else stands beside them is there to be read, and must not say otherwise.
"""

import csv
import json
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import IO, Any

from cmmlink.errors import PlanError, StoreError
from cmmlink.record.bodies import unpack_document
from cmmlink.record.chain import GENESIS, Record, chain_record
from cmmlink.record.origin import Origin
from cmmlink.record.shapes import Header, checked
from cmmlink.record.store import Store
from cmmlink.result_files import NewFiles
from cmmlink.words import utc_words

BODIES, CHAIN = "records.bin", "chain.csv"
CHAIN_COLUMNS = {
    "number": "the place of the record in the station's chain",
    "kind": "what it holds, like plan, points or result",
    "time_s": "when it was written, in seconds since 1970 UTC",
    "count": "how many reads, points or events it holds; 1 for a document",
    "bytes": "how long its body is; the bodies lie one behind the other in records.bin",
    "previous_sha256": "the hash of the record before it",
    "sha256": "its own hash, over all that and its body",
}
# up to its end
_OF_A_RUN = ("run", "plan", "nominal", "wire", "points", "normals", "events", "registration", "deviations", "result", "end")
_IN_FILES = ("plan", "nominal", "result")  # which also stand in files of their own
_MOST = 2**63  # what a column of the records holds
_MEND = "Export the run anew with `cmmlink export RUN --out FOLDER`, and hand over the whole folder"


@dataclass(frozen=True, slots=True)
class Evidence:
    """An exported run as records of its own, every hash of which was recomputed.

    store        : holds the run, and its place in the chain that it comes from
    run          : its id
    records      : how many records were exported
    chain_sha256 : the hash of the run's end where it was exported; empty where its end is missing
    """

    store: Store
    run: str
    records: int
    chain_sha256: str

    @property
    def words(self) -> str:
        """What the evidence rests on."""
        told = f"the evidence is {self.records} exported records of run {self.run}, every hash recomputed"
        if not self.chain_sha256:
            return f"{told}; the end of the run is not among them: it was cut off, or exported while the run went on"
        return f"{told}; the last is {self.chain_sha256}, and nothing was written anew if the report of that day says the same"


def write_chain(store: Store, run: str, files: NewFiles) -> None:
    """Write the records of a run as they are hashed, and their hashes."""
    bodies_path, table_path = files.together(BODIES, CHAIN)
    with bodies_path.open("wb") as bodies, table_path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(CHAIN_COLUMNS)
        for record in store.records(run):
            before = store.record_at(record.number - 1)
            previous = before.sha256 if before is not None else GENESIS
            if not (isinstance(previous, bytes) and isinstance(record.sha256, bytes)):  # a column may hold anything once a file was altered
                raise StoreError(f"record {record.number} has no hash: it was altered. Run cmmlink verify, which names what was")
            bodies.write(record.body)
            place = (record.number, record.kind, repr(record.time_s), record.count, len(record.body))
            writer.writerow((*place, previous.hex(), record.sha256.hex()))


def is_evidence(folder: Path) -> bool:
    """Whether a folder holds an exported run."""
    return (folder / BODIES).is_file() and (folder / CHAIN).is_file()


@contextmanager
def open_evidence(folder: Path, now: Callable[[], datetime]) -> Iterator[Evidence]:
    """An exported run as records of its own, which are there while this is entered; the folder is only read.

    Raises PlanError where the folder holds none or cannot be read, StoreError where anything in it was altered.
    """
    if not is_evidence(folder):
        raise PlanError(f"{folder}: no exported run is here: {BODIES} and {CHAIN} are missing. {_MEND}")
    # Arrays of a long scan may lie there for as long as somebody holds them, and where a file is in use its folder stays.
    with tempfile.TemporaryDirectory(prefix="cmmlink-", ignore_cleanup_errors=True) as own:
        with _told_of(folder), (folder / BODIES).open("rb") as bodies:
            rows = list(csv.DictReader((folder / CHAIN).read_text(encoding="utf-8").splitlines()))
            reading = _Reading(folder, rows, bodies)
            with Store(Path(own), writing=True, epoch_s=lambda: now().timestamp()) as store:
                store.adopt(reading.records_with_origin(utc_words(now())))
            _require_agreement(folder, reading.documents)
        with Store(Path(own), writing=False, epoch_s=lambda: now().timestamp()) as store:
            yield Evidence(store, reading.run, len(rows), reading.chain_sha256)


@dataclass
class _Reading:
    """Reads the records of a folder one by one, and recomputes the hash of each.

    chain_sha256 : the hash of the run's end, once it was read
    documents    : bodies of records that also stand in files of their own, by kind
    """

    folder: Path
    rows: Sequence[Mapping[str, str | None]]
    bodies: IO[bytes]
    run: str = ""
    chain_sha256: str = ""
    documents: dict[str, bytes] = field(default_factory=dict)

    def records_with_origin(self, taken_over: str) -> Iterator[Record]:
        """The records in their order and, behind the end of the run, where it was recorded. Raises StoreError."""
        left = (self.folder / BODIES).stat().st_size
        first: tuple[int, bytes] | None = None
        before = 0, GENESIS
        for count, row in enumerate(self.rows, start=1):
            record, previous = self._record(row, left)
            first, left = first or (record.number, previous), left - len(record.body)
            self._require_place(record, previous, before if count > 1 else None)
            yield record
            before = record.number, record.sha256
            if record.kind == "end":
                self.chain_sha256 = record.sha256.hex()
                if not any(row["kind"] == "origin" for row in self.rows):  # else it was taken over before, and keeps its first origin
                    yield self._origin(record, first, count, taken_over)
        if left or not self.rows:
            raise self._altered(f"{BODIES} holds more than {CHAIN} says: records were cut off there")

    def _record(self, row: Mapping[str, str | None], left: int) -> tuple[Record, bytes]:
        """The record of a row and the hash that it follows. Raises StoreError for one that is not as it was hashed."""
        place = _place(row)
        try:
            number, count, size = (int(row[key] or "") for key in ("number", "count", "bytes"))
            previous, stated = (bytes.fromhex(row[key] or "") for key in ("previous_sha256", "sha256"))
            kind, time_s = row["kind"] or "", float(row["time_s"] or "")
            if not 0 <= size <= left:
                raise self._altered(f"{place} is cut off: {BODIES} ends within it")
            body = self.bodies.read(size)
            self.run = self.run or _run_in(body)
            record = chain_record(Record(number, self.run, kind, time_s, count, body, 0, b""), number, time_s, previous)
        except (KeyError, ValueError):
            raise self._altered(f"{place} is not as cmmlink writes it") from None
        if record.sha256 != stated or not (0 < number < _MOST and 0 <= count < _MOST):
            raise self._altered(f"{place} was altered: its hash does not fit")
        if kind in _IN_FILES:
            self.documents[kind] = body
        return record, previous

    def _require_place(self, record: Record, previous: bytes, before: tuple[int, bytes] | None) -> None:
        """Up to its end the records of a run follow one another; behind it others may stand between what was judged later."""
        if before is None:
            follows = record.kind == "run"
        elif self.chain_sha256:
            follows = record.kind not in _OF_A_RUN and record.number > before[0]
        else:
            follows = (record.number - 1, previous) == before
        if not follows:
            raise self._altered(f"record {record.number} ({record.kind}) does not follow the record before it, which is missing")

    def _origin(self, end: Record, first: tuple[int, bytes], count: int, taken_over: str) -> Record:
        """The record of where the run comes from; its own place and hash are given to it where it is kept."""
        name = self.folder.resolve().name.encode(errors="replace").decode()
        origin = Origin(file=name, first=first[0], records=count, previous=first[1].hex(), chain_sha256=end.sha256.hex(), merged=taken_over)
        draft = origin.draft(self.run)
        return Record(0, self.run, draft.kind, end.time_s, draft.count, draft.body, 0, b"")

    def _altered(self, problem: str) -> StoreError:
        return StoreError(f"{self.folder}: {problem}. What was altered is not judged again. {_MEND}")


def _place(row: Mapping[str, str | None]) -> str:
    return f"record {row.get('number') or '?'} ({row.get('kind') or '?'})"


def _run_in(body: bytes) -> str:
    """The id in the record that a run begins with. Raises ValueError where it is none."""
    try:
        header = unpack_document(body)
        checked(Header, header)
    except StoreError as error:
        raise ValueError(str(error)) from None
    return str(header["run"])


def _require_agreement(folder: Path, documents: Mapping[str, bytes]) -> None:
    """Raise StoreError where the plan, the nominal or the result that people read there is not what was recorded."""
    for file in (*folder.glob("nominal-*"), folder / "plan.yaml", folder / "result.json"):
        kept = documents.get(file.name.partition(".")[0].partition("-")[0])
        if kept is None or not file.is_file():
            continue
        told = file.read_bytes()
        if not (_holds(told, kept) if file.name == "result.json" else told == kept):
            raise StoreError(f"{file}: this is not what was recorded: the file was altered after the export. {_MEND}")


def _holds(told: bytes, kept: bytes) -> bool:
    """Whether a result file says all that is in a recorded result."""
    try:
        document: Any = json.loads(told)
    except (ValueError, RecursionError):
        return False
    return isinstance(document, dict) and {**document, **unpack_document(kept)} == document


@contextmanager
def _told_of(folder: Path) -> Iterator[None]:
    """Name the folder in what keeps it from being read."""
    try:
        yield
    except OSError as error:
        raise PlanError(f"{folder}: the exported run cannot be read ({error.strerror or error})") from None
    except (UnicodeDecodeError, csv.Error):
        raise StoreError(f"{folder / CHAIN}: this is no table of records: it was altered. {_MEND}") from None
