"""The tables of the results database, on PostgreSQL and SQLite alike. They change by a further step in `migrations`."""

from datetime import UTC, datetime
from typing import Any

from sqlalchemy import BigInteger, DateTime, Dialect, Double, ForeignKey, Index, Integer, LargeBinary, Text, UniqueConstraint
from sqlalchemy.orm import DeclarativeBase, Mapped, mapped_column
from sqlalchemy.types import TypeDecorator, TypeEngine

VERSION_TABLE = "cmmlink_version"
VERSIONS = ("1",)
"""The steps of `migrations`, oldest first. A database at another step was written by a newer program."""

_KEY = BigInteger().with_variant(Integer(), "sqlite")  # SQLite counts only INTEGER up by itself


class Moment(TypeDecorator[datetime]):
    """A moment with its time zone; SQLite, which has no such type, keeps seconds since 1970."""

    impl = DateTime
    cache_ok = True

    def load_dialect_impl(self, dialect: Dialect) -> TypeEngine[Any]:
        """The type in the database."""
        kept: TypeEngine[Any] = Double() if dialect.name == "sqlite" else DateTime(timezone=True)
        return dialect.type_descriptor(kept)

    def process_bind_param(self, value: datetime | None, dialect: Dialect) -> object:
        """What is sent."""
        return value.timestamp() if value is not None and dialect.name == "sqlite" else value

    def process_result_value(self, value: object, dialect: Dialect) -> datetime | None:
        """What comes back."""
        if isinstance(value, datetime):
            return value.astimezone(UTC)
        return datetime.fromtimestamp(value, UTC) if isinstance(value, float | int) else None


class Tables(DeclarativeBase):
    """All tables."""


class StationRow(Tables):
    """A station that pushes."""

    __tablename__ = "station"
    __table_args__ = (UniqueConstraint("name", name="station_name"),)

    id: Mapped[int] = mapped_column(_KEY, primary_key=True)
    name: Mapped[str] = mapped_column(Text)


class RunRow(Tables):
    """A run that has ended. `chain_sha256` is the hash of its end in the record of the station, which proves the row."""

    __tablename__ = "run"
    __table_args__ = (
        UniqueConstraint("station_id", "run", name="run_of_station"),
        Index("run_of_part", "part", "started"),
        Index("run_started", "started"),
        Index("run_of_serial_number", "serial_number"),
    )

    id: Mapped[int] = mapped_column(_KEY, primary_key=True)
    station_id: Mapped[int] = mapped_column(_KEY, ForeignKey("station.id", name="run_station"))
    run: Mapped[str] = mapped_column(Text)
    part: Mapped[str] = mapped_column(Text)
    section: Mapped[str] = mapped_column(Text)
    serial_number: Mapped[str] = mapped_column(Text)
    operator: Mapped[str] = mapped_column(Text)
    started: Mapped[datetime] = mapped_column(Moment)
    state: Mapped[str] = mapped_column(Text)
    verdict: Mapped[str | None] = mapped_column(Text)
    software: Mapped[str] = mapped_column(Text)
    chain_sha256: Mapped[str] = mapped_column(Text)
    plan_sha256: Mapped[str] = mapped_column(Text)
    nominal_sha256: Mapped[str] = mapped_column(Text)
    received: Mapped[int | None] = mapped_column(BigInteger)
    judged: Mapped[int | None] = mapped_column(BigInteger)
    rejected: Mapped[int | None] = mapped_column(BigInteger)
    lost: Mapped[int | None] = mapped_column(BigInteger)
    damaged_bytes: Mapped[int | None] = mapped_column(BigInteger)
    simulated: Mapped[bool]


class CharacteristicRow(Tables):
    """A characteristic of a part, once for all its runs."""

    __tablename__ = "characteristic"
    __table_args__ = (UniqueConstraint("part", "name", "type", "unit", name="characteristic_of_part"),)

    id: Mapped[int] = mapped_column(_KEY, primary_key=True)
    part: Mapped[str] = mapped_column(Text)
    name: Mapped[str] = mapped_column(Text)
    type: Mapped[str] = mapped_column(Text)
    unit: Mapped[str] = mapped_column(Text)


class ValueRow(Tables):
    """What was found of a characteristic in a run. `started` is that of the run: the newest values are found without it."""

    __tablename__ = "characteristic_value"
    __table_args__ = (Index("value_of_characteristic", "characteristic_id", "started"),)

    run_id: Mapped[int] = mapped_column(_KEY, ForeignKey("run.id", name="value_run"), primary_key=True, autoincrement=False)
    characteristic_id: Mapped[int] = mapped_column(
        _KEY, ForeignKey("characteristic.id", name="value_characteristic"), primary_key=True, autoincrement=False
    )
    started: Mapped[datetime] = mapped_column(Moment)
    value: Mapped[float | None] = mapped_column(Double)
    lower: Mapped[float | None] = mapped_column(Double)
    upper: Mapped[float | None] = mapped_column(Double)
    uncertainty: Mapped[float | None] = mapped_column(Double)
    verdict: Mapped[str] = mapped_column(Text)


class StripRow(Tables):
    """The deviations of a run along the profile, in even parts of its length, as float32, little-endian."""

    __tablename__ = "profile_strip"

    run_id: Mapped[int] = mapped_column(_KEY, ForeignKey("run.id", name="strip_run"), primary_key=True, autoincrement=False)
    length_mm: Mapped[float] = mapped_column(Double)
    lower_mm: Mapped[float | None] = mapped_column(Double)
    upper_mm: Mapped[float | None] = mapped_column(Double)
    mean_mm: Mapped[bytes] = mapped_column(LargeBinary)
    worst_mm: Mapped[bytes] = mapped_column(LargeBinary)


class EventRow(Tables):
    """Something that happened to a station, a part or a run. The same `key` is the same event."""

    __tablename__ = "event"
    __table_args__ = (UniqueConstraint("key", name="event_key"), Index("event_at", "at"))

    id: Mapped[int] = mapped_column(_KEY, primary_key=True)
    key: Mapped[str] = mapped_column(Text)
    at: Mapped[datetime] = mapped_column(Moment)
    kind: Mapped[str] = mapped_column(Text)
    station: Mapped[str] = mapped_column(Text)
    part: Mapped[str] = mapped_column(Text)
    characteristic: Mapped[str] = mapped_column(Text)
    run: Mapped[str] = mapped_column(Text)
    who: Mapped[str] = mapped_column(Text)
    words: Mapped[str] = mapped_column(Text)
