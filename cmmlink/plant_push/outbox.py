"""What of a station's record the results database has not got yet.

The record itself is the outbox: every run in it that has ended is due, until it is known to be there. How far that is stands in a small
file beside the records. Where that is lost, or the records are others than before, all is pushed again, which changes nothing: a run is
in the database once. So nothing is lost as long as the record is there, and nothing is ever written to the record.
"""

import hashlib
import json
import os
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass, field, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from cmmlink.record import Record, Store
from cmmlink.words import utc_words

STATE_FILE = "plant-outbox.json"
_DUE = ("end", "derived")  # what follows from these records is pushed
_AT_ONCE = 20
_MOST_NAMED = 50


@dataclass(frozen=True, slots=True)
class OutboxState:
    """How far the results of a station have been pushed to one database.

    address    : the hash of its address; another one has got nothing yet
    begun      : when the first attempt was made, in UTC
    number, sha256 : the last record that is known to be there, with its hash
    pushed     : when something was pushed last, in UTC; empty: never
    problem    : why the last attempt failed; empty where it did not
    unreadable : runs of the record that cannot be read, each with why; they are not in the database
    others     : runs in whose place the database holds others of the same station and name
    """

    address: str
    begun: str
    number: int = 0
    sha256: str = ""
    pushed: str = ""
    problem: str = ""
    unreadable: Mapping[str, str] = field(default_factory=dict)
    others: tuple[str, ...] = ()

    def with_trouble(self, unreadable: Mapping[str, str], others: Iterator[str]) -> "OutboxState":
        """The same with further runs that could not be pushed; the newest are named."""
        kept = dict(list({**self.unreadable, **unreadable}.items())[-_MOST_NAMED:])
        return replace(self, unreadable=kept, others=tuple(dict.fromkeys([*self.others, *others]))[-_MOST_NAMED:])


@dataclass(frozen=True, slots=True)
class Waiting:
    """What waits to be pushed: how many runs, and since when, in seconds since 1970; None where nothing does."""

    runs: int
    since_s: float | None


def read_state(folder: Path, address: str, now: datetime) -> OutboxState:
    """How far the records of a folder have been pushed to a database; a new one where nothing is known."""
    fresh = OutboxState(hashlib.sha256(address.encode()).hexdigest(), utc_words(now))
    with suppress(OSError, ValueError, TypeError, KeyError, AttributeError):
        told: dict[str, Any] = json.loads((folder / STATE_FILE).read_bytes())
        known = OutboxState(**{**told, "others": tuple(told["others"])})
        datetime.fromisoformat(known.begun)
        if known.address == fresh.address and isinstance(known.number, int) and isinstance(known.unreadable, dict):
            return known
    return fresh


def keep_state(folder: Path, state: OutboxState) -> None:
    """Keep how far it is, whole or not at all; where that cannot be written, more is pushed again than need be."""
    with suppress(OSError):
        new = folder / f"{STATE_FILE}.{os.getpid()}"
        new.write_text(json.dumps(asdict(state)), encoding="utf-8")
        new.replace(folder / STATE_FILE)


def in_these_records(state: OutboxState, store: Store) -> OutboxState:
    """The state, from the beginning where the last record that was pushed is none of these records."""
    if not state.number:
        return state
    last = store.record_at(state.number)
    return state if last is not None and bytes(last.sha256).hex() == state.sha256 else replace(state, number=0, sha256="")


def due(store: Store, number: int) -> Iterator[list[Record]]:
    """The records behind a number from which something is pushed, some at a time, oldest first."""
    while records := store.added_behind_number(number, _DUE, _AT_ONCE):
        yield records
        number = records[-1].number


def waiting(store: Store, state: OutboxState) -> Waiting:
    """What waits. Nothing waits longer than since the first attempt."""
    ends = [record for records in due(store, in_these_records(state, store).number) for record in records if record.kind == "end"]
    if not ends:
        return Waiting(0, None)
    begun = datetime.fromisoformat(state.begun).astimezone(UTC).timestamp()
    return Waiting(len(ends), max(begun, min(record.time_s for record in ends)))
