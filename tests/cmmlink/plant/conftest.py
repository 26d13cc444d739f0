"""Where results are stored in tests: a file of SQLite, and a PostgreSQL server where there is one."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.cmmlink.plant.postgres import PostgresServer, programs


@pytest.fixture(scope="module")
def server(request: pytest.FixtureRequest) -> Iterator[PostgresServer]:
    """A PostgreSQL server that the tests of a file share."""
    if programs() is None and not request.config.getoption("--require-postgresql"):
        pytest.skip("PostgreSQL is not installed here")
    started = PostgresServer()
    yield started
    started.close()


@pytest.fixture(params=["sqlite", "postgresql"])
def address(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    """The address of an empty database."""
    if request.param == "sqlite":
        return str(tmp_path / "plant.sqlite")
    server: PostgresServer = request.getfixturevalue("server")
    server.query("DROP SCHEMA public CASCADE; CREATE SCHEMA public")
    return server.address
