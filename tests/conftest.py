"""Options that point the tests of devices at hardware, and those of the console at a browser; what all tests of a process share."""

import sys
import threading
from collections.abc import Iterator

import pytest
from hypothesis import settings

settings.register_profile("no deadline", deadline=None)  # machines are noisy: no test asserts a time
settings.register_profile("laws", deadline=None, max_examples=3000)  # of `make laws`
settings.load_profile("no deadline")


def pytest_addoption(parser: pytest.Parser) -> None:
    group = parser.getgroup("hardware", "tests/integration/test_any_device.py on a real device")
    group.addoption("--device", metavar="ADDRESS", help="port name or host:port of the device")
    group.addoption("--format", default="ascii", help="wire format of a streaming device")
    group.addoption("--option", action="append", default=[], metavar="NAME=NUMBER", help="option of the format, like range_mm=50")
    group.addoption("--map", metavar="FILE", help="register map of a Modbus device: a file, or the name of a shipped one")
    group.addoption("--points", type=int, default=100, help="points to read (default 100)")
    group.addoption("--baud-rate", type=int, default=115_200)
    group.addoption("--parity", default="N", choices=["N", "E", "O"])
    group.addoption("--dme-sessions", metavar="FOLDER", help="logs of I++ DME clients of the NIST test suite, for test_dme_recorded.py")
    group = parser.getgroup("damage", "tests/cmmlink/record/test_damage.py")
    group.addoption("--damages", type=int, default=5, metavar="N", help="kinds of damage to the records to try (default 5)")
    group = parser.getgroup("browser", "tests/cmmlink/console in Chromium")
    group.addoption("--require-browser", action="store_true", help="fail where the tests in a browser would be skipped")
    group.addoption("--require-open3d", action="store_true", help="fail where the tests with Open3D would be skipped")
    group.addoption("--require-cad", action="store_true", help="fail where the tests with Open CASCADE would be skipped")
    group.addoption("--require-postgresql", action="store_true", help="fail where the tests with a PostgreSQL server would be skipped")
    group.addoption("--screenshots", metavar="DIR", help="keep pictures of the console's pages in this folder")
    parser.getgroup("quick").addoption("--first-case", action="store_true", help="run the first case only of tests that have several")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mix the files of all packages, so that tests that wait for a device run beside tests that compute."""
    items.sort(key=lambda item: (item.path.name, str(item.path)))
    if config.getoption("--first-case"):
        first = {item.nodeid.partition("[")[0]: item for item in reversed(items)}
        others = [item for item in items if first[item.nodeid.partition("[")[0]] is not item]
        config.hook.pytest_deselected(items=others)
        items[:] = [item for item in items if first[item.nodeid.partition("[")[0]] is item]


@pytest.fixture(autouse=True, scope="session")
def _records_of_their_own(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Keep the records and logs of tests that name no folder out of the user's own; wider fixtures run commands, too."""
    with pytest.MonkeyPatch.context() as patch:
        for name in ("XDG_DATA_HOME", "XDG_STATE_HOME", "WIN_PD_OVERRIDE_LOCAL_APPDATA"):
            patch.setenv(name, str(tmp_path_factory.mktemp("user-data")))
        yield


@pytest.fixture(autouse=True, scope="session")
def _preparations_made_once() -> Iterator[None]:
    """Discretise a nominal, and rehearse on it, once for all runs of a process: half their time goes there, and both have tests."""
    if "cmmlink.run" not in sys.modules:  # no test that was collected runs anything
        yield
        return
    from tests.cmmlink.prepared import pictures_drawn_here, preparations_made_once

    with preparations_made_once(), pictures_drawn_here():
        yield


OURS = {"acquisition", "console", "plans", "proof", "record"}  # what the program calls its own threads


@pytest.fixture(autouse=True, scope="module")
def _no_thread_left() -> Iterator[None]:
    """Let no file of tests leave a run or a server behind: later tests of the process would measure beside it."""
    before = set(threading.enumerate())
    yield
    assert not [thread.name for thread in set(threading.enumerate()) - before if thread.name in OURS]
