"""Every row of the database is held against the records: what was altered in either, is missing, or was added is named."""

import logging
import shutil
import sqlite3
from contextlib import closing
from pathlib import Path

import pytest

from cmmlink.plant_push import push, verify_plant
from cmmlink.record.reader import open_to_record
from tests.cmmlink.command import cmmlink
from tests.cmmlink.recorded import today


@pytest.fixture(scope="module")
def pushed_once(measured: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Records whose results were pushed."""
    folder = Path(shutil.copytree(measured / "records", tmp_path_factory.mktemp("pushed-once") / "records"))
    push(folder, today)
    return folder


@pytest.fixture
def pushed(pushed_once: Path, tmp_path: Path) -> Path:
    """A copy of them."""
    return Path(shutil.copytree(pushed_once, tmp_path / "records"))


def change(records: Path, *statements: str) -> None:
    """Change what the database holds behind the program's back."""
    with closing(sqlite3.connect(records / "plant.sqlite")) as connection, connection:
        for statement in statements:
            assert connection.execute(statement).rowcount >= 1, statement


def test_what_was_pushed_agrees(pushed: Path) -> None:
    ended = cmmlink("plant", "verify", "--records", pushed)
    assert (ended.code, "2 of 2 runs are there as the records have them" in ended.out) == (0, True)


def test_whatever_was_altered_in_a_row_is_named(pushed: Path) -> None:
    change(
        pushed,
        "UPDATE run SET verdict = 'conform', chain_sha256 = 'ab', serial_number = '7', started = started + 1 WHERE id = 1",
        "UPDATE characteristic_value SET value = value / 2, upper = 9 WHERE run_id = 1",
        "UPDATE profile_strip SET worst_mm = mean_mm WHERE run_id = 1",
        "UPDATE event SET words = 'conform'",
    )
    found = verify_plant(pushed, today)
    altered, judgement = found.altered
    for told in (
        "verdict conform, the record says nonconform",
        "chain_sha256 ab, the record says ",
        "serial_number 7, the record says ",
        "started 20",
        "upper 9.0, uncertainty 0.0), the record says nonconform (value 0.",
        "its deviations along the profile are others",
    ):
        assert told in altered.what
    assert judgement.what.startswith("its judgement is 'conform', the record says 'conform: tolerance.upper_mm")
    assert (found.sound, found.agree, found.missing, found.extra) == (False, 1, (), ())


def test_what_is_missing_is_named_and_can_be_pushed_again(pushed: Path) -> None:
    assert push(pushed, today).added == 0, "all of it was there"
    change(
        pushed,
        "DELETE FROM characteristic_value WHERE run_id = 1",
        "DELETE FROM profile_strip WHERE run_id = 1",
        "DELETE FROM characteristic_value",
        "DELETE FROM profile_strip",
        "DELETE FROM run WHERE id = 2",
        "DELETE FROM event",
    )
    found = verify_plant(pushed, today)
    (altered,) = found.altered
    assert "profile: nothing, the record says nonconform" in altered.what
    assert "its deviations along the profile are missing" in altered.what
    assert [row.what.partition(" of ")[0] for row in found.missing] == ["is not in the database", "its judgement"]
    assert push(pushed, today).added == 0, "it is known to have been there"
    assert push(pushed, today, again=True).added == 1
    assert verify_plant(pushed, today).missing == ()


def test_a_run_that_the_records_have_not_got_is_named(pushed: Path) -> None:
    change(pushed, "UPDATE run SET run = 'invented' WHERE id = 2")
    ended = cmmlink("plant", "verify", "--records", pushed, "--json")
    told = ended.json()
    assert (ended.code, told["sound"], len(told["missing"])) == (1, False, 1)
    assert [(row["run"], row["what"]) for row in told["extra"]] == [("invented", "the records have no such run")]


def test_records_that_were_altered_prove_nothing(pushed: Path) -> None:
    with open_to_record(pushed, today) as store:
        store._connection.execute("UPDATE record SET body = x'00' WHERE kind = 'result' AND number < 10")
        store._connection.execute("UPDATE record SET time_s = 0 WHERE number = 2")
    found = verify_plant(pushed, today)
    assert "was altered" in found.record
    assert not found.sound


def test_no_password_comes_into_the_log(records: Path, caplog: pytest.LogCaptureFixture) -> None:
    lines = list[str]()

    class Listening(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            lines.append(record.getMessage())

    listening = Listening()
    logging.getLogger("cmmlink").addHandler(listening)
    try:
        refused = cmmlink("plant", "address", "postgresql://cmm:geheim@db/plant", "--records", records).refused()
    finally:
        logging.getLogger("cmmlink").removeHandler(listening)
    assert "a password in an address" in refused
    assert any("plant address postgresql://cmm:...@db/plant" in line for line in lines)
    assert "geheim" not in refused + "".join(lines)


def test_a_database_that_is_away_is_a_failure_of_the_link(records: Path) -> None:
    assert "Connection refused" in cmmlink("plant", "address", "postgresql://cmm@127.0.0.1:1/x", "--records", records).failed(4)
    (records / "plant.yaml").write_text("address: postgresql://cmm@127.0.0.1:1/x\n", encoding="utf-8")
    ended = cmmlink("plant", "push", "--records", records)
    assert ended.code == 4
    assert "2 runs waiting, the oldest since" in ended.out
    assert "nothing is lost: the records keep it for the next time" in ended.err
    assert cmmlink("plant", "status", "--records", records, "--json").json()["away"] is False
