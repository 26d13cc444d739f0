"""Pushes what is due to the results database, oldest first: it counts as pushed once it is in the database.

It reads the records as any reader does: nothing is written to them, and whoever records meanwhile waits for nothing.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path

from cmmlink.errors import PlanError, PlantAwayError, PlantError, RunError, StoreError
from cmmlink.plant import ResultsDatabase, StoredRun, words_of
from cmmlink.plant_push.outbox import OutboxState, Waiting, due, in_these_records, keep_state, read_state, waiting
from cmmlink.plant_push.plant_settings import address_for
from cmmlink.plant_push.recorded_results import judged_again, stack_ended_by, stored_run, stored_stack
from cmmlink.record import Nominals, Record, Store, has_records
from cmmlink.trend_alarms import trend_alarms
from cmmlink.words import utc_words
from inspection import InspectionError

_MOST_NOMINALS = 4
_LATE_S = _ALARMING_S = 86_400.0
_CANNOT_BE_READ = (StoreError, PlanError, RunError, InspectionError, KeyError)


@dataclass(frozen=True, slots=True)
class TrendAlarm:
    """A run that breaks a rule of Western Electric in the trend of a characteristic; `rule` in words, and which way."""

    run: str
    part: str
    serial_number: str
    characteristic: str
    rule: str


@dataclass(frozen=True, slots=True)
class Outbox:
    """What a station has pushed, and what waits.

    address : where to, in words
    added   : runs that this attempt added to the database
    waiting, since_s : runs that wait, and since when, in seconds since 1970
    late    : they have waited for more than a day
    problem : why they wait; empty where nothing keeps them
    away    : whether another attempt may succeed by itself
    pushed  : when something was pushed last, in UTC; empty: never
    unreadable, others : see OutboxState
    alarms  : what the runs that this attempt pushed have changed in the trends of their parts; of runs of the last day
    """

    address: str
    added: int
    waiting: int
    since_s: float | None
    late: bool
    problem: str
    away: bool
    pushed: str
    unreadable: dict[str, str]
    others: tuple[str, ...]
    alarms: tuple[TrendAlarm, ...] = ()


def push(folder: Path, now: Callable[[], datetime], *, again: bool = False, tell: Callable[[float], None] = lambda share: None) -> Outbox:
    """Push all that is due. What keeps it from being pushed is told, not raised.

    again : push every run of the records, also those that are known to be there
    tell  : is told the share done

    Raises PlantError where the settings cannot be used, StoreError where the records cannot be read.
    """
    address = address_for(folder)
    state = read_state(folder, address, now())
    if not has_records(folder):
        return _outbox(address, state, Waiting(0, None), now())
    with _reading(folder, now) as store:
        begun = in_these_records(replace(state, number=0) if again else state, store)
        pushing = _Pushing(folder, store, begun, now, tell)
        away = pushing.push_all(address)
        outbox = _outbox(address, pushing.state, waiting(store, pushing.state), now(), pushing.added, away)
        return replace(outbox, alarms=tuple(pushing.alarms))


def outbox_of(folder: Path, now: Callable[[], datetime]) -> Outbox:
    """What waits, without asking the database. Raises like `push`."""
    address = address_for(folder)
    state = read_state(folder, address, now())
    if not has_records(folder):
        return _outbox(address, state, Waiting(0, None), now())
    with _reading(folder, now) as store:
        return _outbox(address, state, waiting(store, state), now())


def _reading(folder: Path, now: Callable[[], datetime]) -> Store:
    """The records, to be read: runs that were cut off are closed by whoever records next, and are due then."""
    return Store(folder, writing=False, epoch_s=lambda: now().timestamp())


class _Pushing:
    """One attempt, batch by batch."""

    def __init__(self, folder: Path, store: Store, state: OutboxState, now: Callable[[], datetime], tell: Callable[[float], None]) -> None:
        self.state, self.added = state, 0
        self.alarms: list[TrendAlarm] = []
        self._folder, self._store, self._now, self._tell = folder, store, now, tell
        self._nominals = Nominals(_MOST_NOMINALS)

    def push_all(self, address: str) -> bool:
        """Push what is due, and keep how far it is after each batch. Returns whether the database was away."""
        batches = due(self._store, self.state.number)
        records = next(batches, None)
        if records is None:
            return False
        problem, away = "", False
        try:
            with ResultsDatabase(address) as database:
                while records is not None:
                    self._push(database, records)
                    self._tell(records[-1].number / max(self._store.head[0], 1))
                    records = next(batches, None)
        except PlantError as error:
            problem, away = str(error), isinstance(error, PlantAwayError)
        self.state = replace(self.state, problem=problem)
        keep_state(self._folder, self.state)
        return away

    def _push(self, database: ResultsDatabase, records: Sequence[Record]) -> None:
        """Push what follows from some records."""
        unreadable: dict[str, str] = {}
        runs = list[StoredRun]()
        for record in records:
            try:
                if record.kind == "end":
                    runs.append(stored_run(self._store, record.run, self._nominals))
                    if stack_ended_by(self._store, record.run) is not None:
                        runs.append(stored_stack(self._store, record.run, self._nominals))
                else:
                    database.add_event(judged_again(self._store, record))
            except _CANNOT_BE_READ as error:
                unreadable[str(record.run)] = f"{error}"[:200]
        added = database.add_runs(runs) if runs else []
        self.added += added.count("added")
        self._look_at_trends(database, [run for run, how in zip(runs, added, strict=True) if how != "another"])
        others = (f"{run.station} {run.run}" for run, how in zip(runs, added, strict=True) if how == "another")
        last = records[-1]
        pushed = utc_words(self._now()) if runs else self.state.pushed
        self.state = replace(self.state, number=last.number, sha256=last.sha256.hex(), pushed=pushed).with_trouble(unreadable, others)
        keep_state(self._folder, self.state)

    def _look_at_trends(self, database: ResultsDatabase, runs: Sequence[StoredRun]) -> None:
        """Add what runs have changed in the trends of their parts; that of an older run helps nobody any more."""
        for run in runs:
            if (self._now() - run.started).total_seconds() > _ALARMING_S:
                continue
            for event in trend_alarms(database, run):
                database.add_event(event)
                rule = event.words.removeprefix(f"{event.characteristic}: ")
                self.alarms.append(TrendAlarm(run.run, run.part, run.serial_number, event.characteristic, rule))


def _outbox(address: str, state: OutboxState, left: Waiting, now: datetime, added: int = 0, away: bool = False) -> Outbox:
    return Outbox(
        address=words_of(address),
        added=added,
        waiting=left.runs,
        since_s=left.since_s,
        late=left.since_s is not None and now.timestamp() - left.since_s > _LATE_S,
        problem=state.problem if left.runs else "",
        away=away,
        pushed=state.pushed,
        unreadable=dict(state.unreadable),
        others=state.others,
    )
