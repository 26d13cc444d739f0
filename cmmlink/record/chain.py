"""The hash chain over everything that is recorded: each record's SHA-256 covers the record before it.

A record that is changed, deleted, added or moved breaks the chain at its place. What a chain inside a file cannot show is a
file written anew as a whole, hashes and all; therefore every result file carries the last hash of its run.
"""

import hashlib
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal
from zlib import crc32

Kind = Literal[
    "run", "plan", "nominal", "wire", "points", "normals", "events", "registration", "deviations", "result", "end",
    "signature", "answer", "anchors", "timestamp", "origin", "derived", "countersignature", "key",
]  # fmt: skip
"""What a record holds. Normals are those of the points in the record before them. Behind the end of a run may stand its signature, what a
machine tool was told of it, which places were told its hash, a time stamp, where the run was taken over from, what it was found to be when
judged again, and signatures of these. A key that was handed over belongs to no run."""

BEHIND_THE_END: tuple[Kind, ...] = ("signature", "answer", "anchors", "timestamp", "origin", "derived", "countersignature")

GENESIS = bytes(32)  # in place of the hash before the first record


@dataclass(frozen=True, slots=True)
class Draft:
    """A record before it is written. `count` is the number of reads, points or events in the body; 1 for a document."""

    run: str
    kind: Kind
    body: bytes
    count: int = 1


@dataclass(frozen=True, slots=True)
class Record:
    """A record as it stands in the file. `time_s` is when it was written, in seconds since 1970 UTC; numbers run from 1 without a gap."""

    number: int
    run: str
    kind: str
    time_s: float
    count: int
    body: bytes
    crc32: int
    sha256: bytes


@dataclass(frozen=True, slots=True)
class Alteration:
    """The first record that is not as it was written."""

    number: int
    run: str
    kind: str
    problem: str

    def __str__(self) -> str:
        kind = f" ({self.kind} of run {self.run})" if self.run else ""
        return f"record {self.number}{kind}: {self.problem}" if self.number else f"the file of records: {self.problem}"


def chain_record(draft: Draft | Record, number: int, time_s: float, previous: bytes) -> Record:
    """Give a draft its place in the chain, or a record of another file its place in this one."""
    sha256 = _sha256(number, draft.run, draft.kind, time_s, draft.count, draft.body, previous)
    return Record(number, draft.run, draft.kind, time_s, draft.count, draft.body, crc32(draft.body), sha256)


def chain_records(drafts: Iterable[Draft], head: tuple[int, bytes], time_s: float) -> list[Record]:
    """Give drafts their places behind the head of a chain: the number and the hash of its last record."""
    (number, previous), found = head, list[Record]()
    for draft in drafts:
        found.append(chain_record(draft, number + 1, time_s, previous))
        number, previous = found[-1].number, found[-1].sha256
    return found


def hash_of(records: Iterable[Record], number: int, previous: bytes) -> bytes:
    """The last hash of records as they stood in another file, from `number` on behind the hash `previous`."""
    for record in records:
        number, previous = number + 1, chain_record(record, number, record.time_s, previous).sha256
    return previous


def first_alteration(records: Iterable[Record], number: int, previous: bytes) -> tuple[Alteration | None, int, bytes]:
    """Recompute the chain over records in the order of their numbers, which begin with `number` after the hash `previous`.

    Returns the first alteration, or None, and the number and hash that the next record follows.
    """
    for record in records:
        if record.number != number:
            missing = Alteration(number, "", "", "is missing: it was deleted, or its number was changed")
            return missing, number, previous
        problem = problem_of(record, previous)
        if problem:
            return Alteration(number, str(record.run), str(record.kind), problem), number, previous
        number, previous = number + 1, record.sha256
    return None, number, previous


def is_damaged(record: Record) -> bool:
    """True when a body does not match its CRC, or a hash is none. Quick, but no protection against intent."""
    if not (isinstance(record.body, bytes) and isinstance(record.sha256, bytes)):  # tampering may have left text
        return True
    return record.crc32 != crc32(record.body)


def problem_of(record: Record, previous: bytes) -> str:
    """What is wrong with a record behind the hash of the one before it; nothing where it is as it was written."""
    try:
        expected = _sha256(record.number, record.run, record.kind, record.time_s, record.count, record.body, previous)
    except (TypeError, ValueError, AttributeError):  # a column may hold a value of any type once a file was tampered with
        return "holds a value of another type than was written"
    if record.sha256 != expected:
        return "was altered, or does not follow the record before it: its hash does not fit"
    return "its CRC was altered" if is_damaged(record) else ""


def _sha256(number: int, run: str, kind: str, time_s: float, count: int, body: bytes, previous: bytes) -> bytes:
    head = f"{number:d}\n{run}\n{kind}\n{time_s!r}\n{count:d}\n{len(body)}\n"
    digest = hashlib.sha256(previous + head.encode())
    digest.update(body)
    return digest.digest()
