"""Holds every row of the results database that is of this station's records against these: what is missing, altered, or was added."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields
from datetime import datetime
from pathlib import Path

from cmmlink.errors import PlanError, RunError, StoreError
from cmmlink.plant import ResultsDatabase, StoredRun, StoredValue, words_of
from cmmlink.plant_push.outbox import due
from cmmlink.plant_push.plant_settings import address_for
from cmmlink.plant_push.recorded_results import JUDGED_AGAIN, judged_again, stack_ended_by, station_of, stored_run, stored_stack
from cmmlink.record import Nominals, Store, check_chain, open_to_read, origin_of
from inspection import InspectionError

_MOST_NOMINALS = 4


@dataclass(frozen=True, slots=True)
class Row:
    """A row that is not as the record has it.

    station, run : which run
    what         : in words, as "verdict conform, the record says uncertain"
    """

    station: str
    run: str
    what: str


@dataclass(frozen=True, slots=True)
class PlantVerified:
    """What came of it.

    runs    : runs of the records that have ended, and stacks of sections that have characteristics
    agree   : how many of them are in the database as the record has them, with every value and event
    missing : runs, and judgements of runs, that are not there
    altered : rows that are not as the record has them
    extra   : runs of this station in the database that its records have not got
    record  : what is wrong with the records themselves; empty where their chain is whole
    """

    address: str
    runs: int
    agree: int
    missing: tuple[Row, ...]
    altered: tuple[Row, ...]
    extra: tuple[Row, ...]
    record: str

    @property
    def sound(self) -> bool:
        """Whether the database holds what the records hold."""
        return not (self.missing or self.altered or self.extra or self.record)


def verify_plant(folder: Path, now: Callable[[], datetime], tell: Callable[[float], None] = lambda share: None) -> PlantVerified:
    """Hold the database against the records. Raises PlantError, StoreError, and RunError where there are no records."""
    address = address_for(folder)
    with open_to_read(folder, now, close_interrupted=False) as store, ResultsDatabase(address, is_made=False) as database:
        found = check_chain(store, None)
        if found["altered"]:
            return PlantVerified(words_of(address), 0, 0, (), (), (), found["first"]["message"])
        return _Verifying(store, database).verify(words_of(address), tell)


class _Verifying:
    """The comparison, run by run of the database, so that only one of them is held."""

    def __init__(self, store: Store, database: ResultsDatabase) -> None:
        self._store, self._database, self._nominals = store, database, Nominals(_MOST_NOMINALS)
        self._stacks: dict[str, str] = {}  # the last section of each
        self._missing, self._altered, self._extra = list[Row](), list[Row](), list[Row]()

    def verify(self, address: str, tell: Callable[[float], None]) -> PlantVerified:
        ended = {begin.run: begin for begin, end in self._store.begins_and_ends() if end is not None}
        ends = {run: stack_ended_by(self._store, run) for run in ended}
        self._stacks = {stack: run for run, stack in ends.items() if stack is not None}
        stations = {run: station_of(self._store, run) for run in ended}
        stations |= {stack: stations[last] for stack, last in self._stacks.items()}
        own = {stations[run] for run in ended if origin_of(self._store, run) is None}
        seen = set[str]()
        for stored in (one for station in sorted(set(stations.values())) for one in self._database.stored_runs(station)):
            if stations.get(stored.run) == stored.station:
                seen.add(stored.run)
                self._compare(stored)
                tell(len(seen) / len(stations))
            elif stored.station in own:
                self._extra.append(Row(stored.station, stored.run, "the records have no such run"))
        self._missing += [Row(stations[run], run, "is not in the database") for run in stations if run not in seen]
        self._compare_events(set(stations.values()))
        troubled = {row.run for row in (*self._missing, *self._altered)}
        agree = sum(run not in troubled for run in stations)
        return PlantVerified(address, len(stations), agree, tuple(self._missing), tuple(self._altered), tuple(self._extra), "")

    def _compare(self, stored: StoredRun) -> None:
        """Note what a run has that its record has not."""
        try:
            last = self._stacks.get(stored.run)
            known = (self._store, last or stored.run, self._nominals)
            recorded = stored_run(*known) if last is None else stored_stack(*known)
        except (StoreError, PlanError, RunError, InspectionError) as error:
            self._altered.append(Row(stored.station, stored.run, f"its record cannot be read: {error}"))
            return
        told = [*_differences(stored, recorded), *_strip_differences(stored, recorded)]
        if told:
            self._altered.append(Row(stored.station, stored.run, "; ".join(told)))

    def _compare_events(self, stations: set[str]) -> None:
        """Note judgements that are missing or are told otherwise."""
        there = {event.key: event for event in self._database.events(kind=JUDGED_AGAIN, most=None) if event.station in stations}
        for record in (one for records in due(self._store, 0) for one in records if one.kind == "derived"):
            event = judged_again(self._store, record)
            stored = there.get(event.key)
            if stored is None:
                self._missing.append(Row(event.station, event.run, f"its judgement of {event.at:%Y-%m-%d} is not in the database"))
            elif stored != event:
                self._altered.append(Row(event.station, event.run, f"its judgement is {stored.words!r}, the record says {event.words!r}"))


def _differences(stored: StoredRun, recorded: StoredRun) -> Iterator[str]:
    """What a row says otherwise than the record: of the run itself, and of its values by their names."""
    for name in (field.name for field in fields(StoredRun) if field.name not in ("values", "strip")):
        if getattr(stored, name) != getattr(recorded, name):
            yield f"{name} {getattr(stored, name)}, the record says {getattr(recorded, name)}"
    there, here = ({(one.name, one.type, one.unit): one for one in run.values} for run in (stored, recorded))
    for key in dict.fromkeys([*here, *there]):
        if there.get(key) != here.get(key):
            yield f"{key[0]}: {_value_words(there.get(key))}, the record says {_value_words(here.get(key))}"


def _value_words(value: StoredValue | None) -> str:
    if value is None:
        return "nothing"
    told = {name: getattr(value, name) for name in ("value", "lower", "upper", "uncertainty")}
    return f"{value.verdict} (" + ", ".join(f"{name} {number}" for name, number in told.items()) + ")"


def _strip_differences(stored: StoredRun, recorded: StoredRun) -> Iterator[str]:
    there, here = stored.strip, recorded.strip
    if there is None or here is None:
        if there is not here:
            yield "its deviations along the profile are " + ("missing" if there is None else "not in the record")
        return
    same = (there.length_mm, there.lower_mm, there.upper_mm) == (here.length_mm, here.lower_mm, here.upper_mm)
    if not same or there.mean_mm.tobytes() != here.mean_mm.tobytes() or there.worst_mm.tobytes() != here.worst_mm.tobytes():
        yield "its deviations along the profile are others"
