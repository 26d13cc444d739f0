"""The results of a plant: what stations push, and what trends, studies and searches ask.

A run is there once, however often it is pushed, and is never changed: its row holds the hash that proves it. The same on PostgreSQL and
on SQLite.
"""

try:
    import sqlalchemy  # noqa: F401 - that the extra is missing is said in one place
except ImportError:
    from cmmlink.errors import PlantError as Refusal

    raise Refusal("the results database needs an extra of cmmlink; `pip install 'cmmlink[plant]'` brings it") from None

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, fields
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from sqlalchemy import ColumnElement, Connection, Double, extract, select, type_coerce
from sqlalchemy.dialects import postgresql, sqlite

from cmmlink.errors import PlantError
from cmmlink.plant.database_engine import DatabaseEngine
from cmmlink.plant.profile_strip import STRIP_PARTS, ProfileStrip
from cmmlink.plant.result_rows import (
    PartCharacteristic,
    ProfileStrips,
    ResultSeries,
    RunFound,
    StoredEvent,
    StoredRun,
    StoredValue,
    numbers,
)
from cmmlink.plant.results_tables import CharacteristicRow, EventRow, RunRow, StationRow, StripRow, Tables, ValueRow

if TYPE_CHECKING:
    from sqlalchemy.orm import InstrumentedAttribute

Added = Literal["added", "there", "another"]
_AT_ONCE = 200  # runs
_OF_RUN = [field.name for field in fields(StoredRun) if field.name not in ("station", "values", "strip")]
_KIND = (CharacteristicRow.name, CharacteristicRow.type, CharacteristicRow.unit)
_BYTES = "<f4"  # of a strip


class ResultsDatabase:
    """A results database that is open. Raises PlantError where it cannot be used, PlantAwayError where it cannot be reached.

    address : the path of a file of SQLite, or postgresql://USER@HOST/DATABASE
    is_made : whether the file is made where there is none; who only reads is told that nothing is there
    """

    def __init__(self, address: str | Path, *, is_made: bool = True) -> None:
        self._engine = DatabaseEngine(address, is_made=is_made)

    def close(self) -> None:
        """Close it."""
        self._engine.close()

    def __enter__(self) -> "ResultsDatabase":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def words(self) -> str:
        """Its address as people read it, without options or a password."""
        return self._engine.words

    def add_runs(self, runs: Sequence[StoredRun]) -> list[Added]:
        """Add runs with all that belongs to them, in one transaction: all of them, or none where that fails.

        Tells of each whether it was added, or was there, or whether another run of that name and station is there: that one stays.
        """
        with self._engine.writing() as connection:
            stations = {name: self._id_of(connection, StationRow, name=name) for name in sorted({run.station for run in runs})}
            known = _hashes_of(connection, stations, runs)
            rows = [{"station_id": stations[run.station], **{name: getattr(run, name) for name in _OF_RUN}} for run in runs]
            self._insert(connection, RunRow, rows)
            there = _hashes_of(connection, stations, runs)
            ours = [(there[run.station, run.run][0], run) for run in runs if there[run.station, run.run][1] == run.chain_sha256]
            fresh = [(key, run) for key, run in ours if (run.station, run.run) not in known]
            self._insert(connection, ValueRow, list(self._values(connection, fresh)))
            self._insert(connection, StripRow, [_strip_row(key, run.strip) for key, run in fresh if run.strip is not None])
        return [_added(known.get((run.station, run.run)), there[run.station, run.run][1], run.chain_sha256) for run in runs]

    def add_event(self, event: StoredEvent) -> None:
        """Add an event; where one with its key is there, that one stays."""
        with self._engine.writing() as connection:
            self._insert(connection, EventRow, [asdict(event)])

    def stations(self) -> list[str]:
        """The names of all stations."""
        with self._engine.reading() as connection:
            return list(connection.scalars(select(StationRow.name).order_by(StationRow.name)))

    def parts(self) -> list[str]:
        """The names of all parts of which there are values."""
        with self._engine.reading() as connection:
            return list(connection.scalars(select(CharacteristicRow.part).distinct().order_by(CharacteristicRow.part)))

    def characteristics(self, part: str) -> list[PartCharacteristic]:
        """The characteristics of a part, in the order in which they were first found."""
        of_part = select(*_KIND).where(CharacteristicRow.part == part)
        with self._engine.reading() as connection:
            return [PartCharacteristic(*row) for row in connection.execute(of_part.order_by(CharacteristicRow.id))]

    def series(
        self,
        part: str,
        characteristic: str,
        *,
        station: str | None = None,
        since: datetime | None = None,
        until: datetime | None = None,
        last: int | None = None,
    ) -> ResultSeries:
        """The values of one characteristic of a part, oldest first, of runs that came to their end; empty where there are none.

        station      : of one station only
        since, until : moments between which the runs began, the first included
        last         : at most so many, the newest
        """
        with self._engine.reading() as connection:
            of_name = select(CharacteristicRow).where(CharacteristicRow.part == part, CharacteristicRow.name == characteristic)
            kinds = {row.id: PartCharacteristic(row.name, row.type, row.unit) for row in connection.execute(of_name)}
            columns = (
                ValueRow.characteristic_id, ValueRow.value, ValueRow.lower, ValueRow.upper, self._seconds(ValueRow.started),
                ValueRow.verdict, RunRow.run, StationRow.name, RunRow.serial_number,
            )  # fmt: skip
            asked = select(*columns).join(RunRow, RunRow.id == ValueRow.run_id).join(StationRow, StationRow.id == RunRow.station_id)
            wanted = (RunRow.state == "complete", *_between(ValueRow.started, since, until), *_equal((StationRow.name, station)))
            asked = asked.where(ValueRow.characteristic_id.in_(kinds), *wanted)
            newest = asked.order_by(ValueRow.started.desc(), ValueRow.run_id.desc()).limit(last)
            rows: list[Any] = list(connection.execute(newest))[::-1] if kinds else []
        kind = kinds[rows[-1][0]] if rows else next(reversed(kinds.values()), PartCharacteristic(characteristic, "", ""))
        of_kind = [row for row in rows if kinds[row[0]] == kind]
        columns_of: list[Any] = list(zip(*of_kind, strict=True)) if of_kind else [()] * 9
        value, lower, upper, started_s = (numbers(column) for column in columns_of[1:5])
        verdict, run, where, serial_number = columns_of[5:]
        told, left_out = (verdict, run, where, serial_number), len(rows) - len(of_kind)
        return ResultSeries(part, characteristic, kind.type, kind.unit, value, lower, upper, started_s, *told, left_out)

    def sections(self, part: str) -> list[str]:
        """The heights of a part's sections of a surface, mm; empty text among them where there are runs that are none."""
        with self._engine.reading() as connection:
            found = connection.scalars(select(RunRow.section).where(RunRow.part == part).distinct())
            return sorted(found, key=lambda height: float(height or "-inf"))

    def strips(
        self, part: str, last: int = 60, *, station: str | None = None, section: str = "", until: datetime | None = None
    ) -> ProfileStrips:
        """The deviations along the profile of the newest runs of a part that came to their end, oldest first.

        section : of a part that is measured in sections of a surface, which of them: see `sections`
        until   : a moment, before which the runs began
        """
        columns = (
            StripRow.mean_mm, StripRow.worst_mm, StripRow.length_mm, StripRow.lower_mm, StripRow.upper_mm, self._seconds(RunRow.started),
            RunRow.verdict, RunRow.run, StationRow.name, RunRow.serial_number,
        )  # fmt: skip
        asked = select(*columns).join(RunRow, RunRow.id == StripRow.run_id).join(StationRow, StationRow.id == RunRow.station_id)
        wanted = (RunRow.part == part, RunRow.section == section, RunRow.state == "complete", *_between(RunRow.started, None, until))
        asked = asked.where(*wanted, *_equal((StationRow.name, station)))
        with self._engine.reading() as connection:
            rows = list(connection.execute(asked.order_by(RunRow.started.desc(), RunRow.id.desc()).limit(last)))[::-1]
        columns_of: list[Any] = list(zip(*rows, strict=True)) if rows else [()] * 10
        mean, worst = (np.frombuffer(b"".join(cut), _BYTES).reshape(-1, STRIP_PARTS).astype(np.float32) for cut in columns_of[:2])
        length, lower, upper, started_s = (numbers(column) for column in columns_of[2:6])
        return ProfileStrips(mean, worst, length, lower, upper, started_s, *columns_of[6:10])

    def search(
        self,
        *,
        part: str | None = None,
        month: str | None = None,
        serial_number: str | None = None,
        operator: str | None = None,
        verdict: str | None = None,
        station: str | None = None,
        since: datetime | None = None,
        until: datetime | None = None,
        most: int = 1000,
    ) -> list[RunFound]:
        """The newest runs that have all that is given, newest first.

        month : like 2026-03, of this computer's time zone
        most  : at most so many
        """
        columns = (
            StationRow.name, RunRow.run, RunRow.part, RunRow.section, RunRow.serial_number, RunRow.operator, RunRow.started, RunRow.state,
            RunRow.verdict, RunRow.chain_sha256,
        )  # fmt: skip
        of_month = (None, None) if month is None else month_of(month)
        wanted = [*_between(RunRow.started, since, until), *_between(RunRow.started, *of_month)]
        wanted += _equal((RunRow.part, part), (RunRow.serial_number, serial_number), (RunRow.operator, operator), (RunRow.verdict, verdict))
        asked = select(*columns).join(StationRow, StationRow.id == RunRow.station_id).where(*wanted, *_equal((StationRow.name, station)))
        with self._engine.reading() as connection:
            rows: Iterable[Any] = connection.execute(asked.order_by(RunRow.started.desc(), RunRow.id.desc()).limit(most))
            return [RunFound(*row) for row in rows]

    def events(
        self, *, part: str | None = None, kind: str | None = None, since: datetime | None = None, most: int | None = 1000
    ) -> list[StoredEvent]:
        """The newest events that have all that is given, newest first."""
        columns = [getattr(EventRow, field.name) for field in fields(StoredEvent)]
        asked = select(*columns).where(*_between(EventRow.at, since, None), *_equal((EventRow.part, part), (EventRow.kind, kind)))
        with self._engine.reading() as connection:
            return [StoredEvent(*row) for row in connection.execute(asked.order_by(EventRow.at.desc(), EventRow.id.desc()).limit(most))]

    def stored_runs(self, station: str) -> Iterator[StoredRun]:
        """Every run of a station with its values and its strip, as it is stored."""
        of_station = select(RunRow).join(StationRow, StationRow.id == RunRow.station_id).where(StationRow.name == station)
        last = 0
        while True:
            with self._engine.reading() as connection:
                rows = connection.execute(of_station.where(RunRow.id > last).order_by(RunRow.id).limit(_AT_ONCE)).all()
                if not rows:
                    return
                keys = [row.id for row in rows]
                strips = {row.run_id: row for row in connection.execute(select(StripRow).where(StripRow.run_id.in_(keys)))}
                values = _values_of(connection, keys)
            for row in rows:
                told = {name: getattr(row, name) for name in _OF_RUN}
                yield StoredRun(station=station, **told, values=tuple(values[row.id]), strip=_strip(strips.get(row.id)))
            last = keys[-1]

    def _seconds(self, moment: "InstrumentedAttribute[datetime]") -> ColumnElement[float]:
        """A moment in seconds since 1970, which takes a tenth of the time that dates take to be read."""
        return type_coerce(moment, Double()) if self._engine.dialect == "sqlite" else type_coerce(extract("epoch", moment), Double())

    def _insert(self, connection: Connection, table: type[Tables], rows: list[dict[str, Any]]) -> None:
        """Add rows; those that are there already stay as they are."""
        if rows:
            insert = postgresql.insert if self._engine.dialect == "postgresql" else sqlite.insert
            connection.execute(insert(table).on_conflict_do_nothing(), rows)

    def _id_of(self, connection: Connection, table: Any, **names: str) -> int:
        """The key of the row with these names, which is added where there is none."""
        asked = select(table.id).filter_by(**names)
        found = connection.scalar(asked)
        if found is None:
            self._insert(connection, table, [names])
            found = connection.scalar(asked)
        assert found is not None
        return int(found)

    def _values(self, connection: Connection, runs: Iterable[tuple[int, StoredRun]]) -> Iterator[dict[str, Any]]:
        """The rows of the values of runs, each with the key of its run."""
        keys: dict[tuple[str, ...], int] = {}
        for run_id, run in runs:
            for one in run.values:
                names = {"part": run.part, "name": one.name, "type": one.type, "unit": one.unit}
                characteristic = tuple(names.values())
                if characteristic not in keys:
                    keys[characteristic] = self._id_of(connection, CharacteristicRow, **names)
                told = {name: getattr(one, name) for name in ("value", "lower", "upper", "uncertainty", "verdict")}
                yield {"run_id": run_id, "characteristic_id": keys[characteristic], "started": run.started, **told}


def month_of(month: str) -> tuple[datetime, datetime]:
    """The moments at which a month like 2026-03 begins and ends, by this computer's time zone. Raises PlantError."""
    try:
        begin = datetime.strptime(month, "%Y-%m")
    except ValueError:
        raise PlantError(f"{month!r} is no month; expected one like 2026-03") from None
    following = begin.replace(year=begin.year + begin.month // 12, month=begin.month % 12 + 1)
    return begin.astimezone(), following.astimezone()


def _between(moment: "InstrumentedAttribute[datetime]", since: datetime | None, until: datetime | None) -> list[ColumnElement[bool]]:
    """That a moment lies between two others, the first included; nothing is asked where one is None."""
    return [*([] if since is None else [moment >= since]), *([] if until is None else [moment < until])]


def _equal(*wanted: "tuple[InstrumentedAttribute[Any], object]") -> list[ColumnElement[bool]]:
    """That columns have values; nothing is asked where one is None."""
    return [column == value for column, value in wanted if value is not None]


def _hashes_of(connection: Connection, stations: dict[str, int], runs: Sequence[StoredRun]) -> dict[tuple[str, str], tuple[int, str]]:
    """The key and the hash of each of these runs that is there, by station and name."""
    names = {key: name for name, key in stations.items()}
    asked = select(RunRow.id, RunRow.station_id, RunRow.run, RunRow.chain_sha256)
    asked = asked.where(RunRow.station_id.in_(names), RunRow.run.in_([run.run for run in runs]))
    return {(names[station], run): (key, sha256) for key, station, run, sha256 in connection.execute(asked)}


def _added(known: tuple[int, str] | None, stored: str, ours: str) -> Added:
    return "another" if stored != ours else "added" if known is None else "there"


def _values_of(connection: Connection, keys: Sequence[int]) -> dict[int, list[StoredValue]]:
    """The values of runs, by the keys of these, in the order of their characteristics."""
    columns = [ValueRow.run_id, *_KIND, ValueRow.value, ValueRow.lower, ValueRow.upper, ValueRow.uncertainty, ValueRow.verdict]
    asked = select(*columns).join(CharacteristicRow, CharacteristicRow.id == ValueRow.characteristic_id)
    found: dict[int, list[StoredValue]] = {key: [] for key in keys}
    rows: Iterable[Any] = connection.execute(asked.where(ValueRow.run_id.in_(keys)).order_by(CharacteristicRow.id))
    for run_id, *told in rows:
        found[run_id].append(StoredValue(*told))
    return found


def _strip_row(key: int, strip: ProfileStrip) -> dict[str, Any]:
    """The row of a strip."""
    numbers_of = {name: getattr(strip, name) for name in ("length_mm", "lower_mm", "upper_mm")}
    return {"run_id": key, **numbers_of, **{name: getattr(strip, name).astype(_BYTES).tobytes() for name in ("mean_mm", "worst_mm")}}


def _strip(row: Any) -> ProfileStrip | None:
    """The strip of a row."""
    if row is None:
        return None
    mean, worst = (np.frombuffer(stored, _BYTES).astype(np.float32) for stored in (row.mean_mm, row.worst_mm))
    return ProfileStrip(row.length_mm, row.lower_mm, row.upper_mm, mean, worst)
