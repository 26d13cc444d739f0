"""An open results database: connected, brought to the tables of this program, and what goes wrong told in words without passwords."""

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from sqlalchemy import Connection, Engine, NullPool, create_engine, event, inspect, make_url, text
from sqlalchemy.exc import ArgumentError, DBAPIError, SQLAlchemyError

from cmmlink.errors import PlantAwayError, PlantError
from cmmlink.plant.database_address import address_of, is_server, without_password, words_of
from cmmlink.plant.database_words import remedy, require_place
from cmmlink.plant.results_tables import VERSION_TABLE, VERSIONS, Tables

_PATIENCE_S = 10  # to reach a server, and for another program's transaction in a file
_OF_MIGRATION = 0x434D4D4C  # the number of the lock that one program holds while it makes tables
_AWAY = ("08", "57P", "53")  # classes of PostgreSQL's errors: connection, shutting down, out of resources
_WRITING = "cmmlink_writing"
_SERVER_OPTIONS = {
    "connect_timeout": _PATIENCE_S,
    "application_name": "cmmlink",
    "keepalives_idle": 30,
    "tcp_user_timeout": 30_000,  # ms; a server that vanished without a word is given up
    "options": "-c synchronous_commit=on",  # what counts as pushed has to outlive the server, however it was set up
}


class DatabaseEngine:
    """A connected results database. Raises PlantError where it cannot be used, PlantAwayError where it cannot be reached.

    is_made : whether a file is made where there is none
    """

    def __init__(self, given: str | Path, *, is_made: bool = True) -> None:
        address = address_of(given)
        self.words = words_of(address)
        if not is_server(address) and (file := make_url(address).database):
            require_place(Path(file), is_made=is_made)
        with self._translated():
            self._engine = _server(address) if is_server(address) else _file(address)
            try:
                self._bring_up_to_date()
            except BaseException:
                self._engine.dispose()
                raise

    def close(self) -> None:
        """Close every connection."""
        self._engine.dispose()

    @property
    def dialect(self) -> str:
        """Which kind of database it is: postgresql or sqlite."""
        return self._engine.dialect.name

    @contextmanager
    def reading(self) -> Iterator[Connection]:
        """A transaction that only reads."""
        with self._translated(), self._engine.connect() as connection:
            yield connection

    @contextmanager
    def writing(self) -> Iterator[Connection]:
        """A transaction that is committed at its end, whole or not at all."""
        engine = self._engine.execution_options(**{_WRITING: True})
        with self._translated(), engine.begin() as connection:
            yield connection

    def _bring_up_to_date(self) -> None:
        """Take the steps that the database lacks. Raises PlantError for one of a newer program, and for one of somebody else."""
        with self.reading() as connection:
            if self._version(connection) == VERSIONS[-1]:
                return
        with self.writing() as connection:
            if self.dialect == "postgresql":
                connection.execute(text(f"SELECT pg_advisory_xact_lock({_OF_MIGRATION})"))
            if self._version(connection) != VERSIONS[-1]:  # another program may have done it meanwhile
                _migrate(connection)

    def _version(self, connection: Connection) -> str | None:
        """The last step that the database has taken; None for an empty one."""
        there = set(inspect(connection).get_table_names())
        if VERSION_TABLE not in there:
            if foreign := sorted(there & set(Tables.metadata.tables)):
                told = f"holds a table {foreign[0]!r} that is not of cmmlink"
                raise PlantError(f"{self.words}: {told}; give the results a database, or a schema, of their own")
            return None
        version = connection.execute(text(f"SELECT version_num FROM {VERSION_TABLE}")).scalar()
        if version is not None and version not in VERSIONS:
            known = f"it is at step {version}, this program knows up to {VERSIONS[-1]}"
            raise PlantError(f"{self.words}: was written by a newer cmmlink ({known}); update cmmlink here")
        return version

    @contextmanager
    def _translated(self) -> Iterator[None]:
        """Turn what the library says into words."""
        try:
            yield
        except DBAPIError as error:
            state = str(getattr(error.orig, "sqlstate", None) or "")
            told = " ".join(without_password(str(error.orig)).split()).partition(" Is the server running")[0]
            kind = PlantAwayError if _is_away(error, state) else PlantError
            of_server = type(error.orig).__module__.startswith("psycopg")
            raise kind(f"{self.words}: {told[:300]}{remedy(told, of_server=of_server)}") from None
        except ImportError as error:
            raise PlantError(f"PostgreSQL needs an extra of cmmlink; `pip install 'cmmlink[plant]'` brings it ({error})") from None
        except (ArgumentError, SQLAlchemyError) as error:
            raise PlantError(f"{self.words}: {without_password(str(error)).splitlines()[0][:300]}") from None


def _is_away(error: DBAPIError, state: str) -> bool:
    """Whether another attempt later may succeed: nobody answers, or somebody else holds the file."""
    is_unanswered = not state and type(error.orig).__name__ == "OperationalError"
    told = str(error.orig)
    is_refused = "authentication failed" in told or "does not exist" in told or "unable to open" in told
    return error.connection_invalidated or state.startswith(_AWAY) or (is_unanswered and not is_refused)


def _server(address: str) -> Engine:
    for library in ("psycopg", "sqlalchemy"):  # what they say of a lost connection is told in our words, and not on standard error
        if not logging.getLogger(library).handlers:
            logging.getLogger(library).addHandler(logging.NullHandler())
    url = make_url(address)
    options = {name: value for name, value in _SERVER_OPTIONS.items() if name not in url.query}
    return create_engine(url, connect_args=options, pool_pre_ping=True, pool_size=2, hide_parameters=True)


def _file(address: str) -> Engine:
    engine = create_engine(address, connect_args={"timeout": _PATIENCE_S}, poolclass=NullPool, hide_parameters=True)
    event.listen(engine, "connect", _prepare_file)
    event.listen(engine, "begin", _begin)
    return engine


def _prepare_file(connection: Any, _record: object) -> None:
    """Let the program begin its transactions itself: the library would begin none before tables are made."""
    connection.isolation_level = None
    connection.execute("PRAGMA journal_mode = WAL")  # who reads does not wait for who writes
    connection.execute("PRAGMA foreign_keys = ON")


def _begin(connection: Connection) -> None:
    """Begin a transaction; one that writes takes its place at once, and so waits for its turn."""
    connection.exec_driver_sql("BEGIN IMMEDIATE" if connection.get_execution_options().get(_WRITING) else "BEGIN")


def _migrate(connection: Connection) -> None:
    """Take the steps that are missing, in the transaction that is open."""
    from alembic import command  # noqa: PLC0415 - only a database that lacks a step needs it
    from alembic.config import Config  # noqa: PLC0415

    config = Config(attributes={"connection": connection})
    config.set_main_option("script_location", str(Path(__file__).parent / "migrations").replace("%", "%%"))
    command.upgrade(config, "head")
