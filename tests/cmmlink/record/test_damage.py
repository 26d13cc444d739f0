"""Whatever a disk or a person did to the file of records: every command answers in words, and verify never calls it sound."""

import itertools
import shutil
import sqlite3
import time
from collections.abc import Iterator
from contextlib import closing, suppress
from pathlib import Path

import pytest

from cmmlink.console.past_runs import PastRuns
from cmmlink.console.protocol import History, ShownRun, json_of
from cmmlink.console.refused import Refused, answer_errors
from cmmlink.run_view import RunView
from drivers.source import WireBytes
from tests.cmmlink.command import cmmlink
from tests.cmmlink.recorded import Script, decoder_of, record, scan_arrivals, today
from tests.integration.damaged import Damage, damages_of_bytes, damages_of_documents, damages_of_values


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of records with one run, all of it in the file itself."""
    folder = tmp_path_factory.mktemp("sound")
    record(folder, Script(WireBytes(0.1, b"abc"), *scan_arrivals(120)))
    with closing(sqlite3.connect(folder / "station.sqlite")) as connection:
        connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")
    return folder


def rows_of(folder: Path) -> list[tuple[object, ...]] | None:
    """What the table holds, None where it cannot be read."""
    try:
        with closing(sqlite3.connect(folder / "station.sqlite")) as connection:
            connection.text_factory = bytes
            return connection.execute("SELECT * FROM record ORDER BY number").fetchall()
    except sqlite3.Error:
        return None


def spread(damages: Iterator[tuple[str, Damage]], most: int) -> list[tuple[str, Damage]]:
    """So many of them, from the first to the last."""
    found = list(damages)
    return found[:: max(len(found) // most, 1)]


def require_words(folder: Path, tmp_path: Path, name: str) -> None:
    """Every command on the records ends with one of its exit codes and never with a defect; what steers a terminal is spelled out."""
    commands: list[tuple[object, ...]] = [
        ("verify",),
        ("verify", "last"),
        ("runs",),
        ("show", "last"),
        ("export", "last", "--out", tmp_path),
    ]
    for command in commands:
        ended = cmmlink(*command, "--records", shutil.copytree(folder, tmp_path / "copy"))
        shutil.rmtree(tmp_path / "copy")
        said = ended.out + ended.err
        assert ended.code in (0, 1, 2, 3, 5), (name, command, said)
        assert "Traceback" not in said, (name, command)
        assert "defect" not in said, (name, command)
        assert "\x1b" not in said, (name, command)
        assert said.strip(), (name, command)
    on_page = PastRuns(shutil.copytree(folder, tmp_path / "copy"), decoder_of, time.monotonic, today)
    with suppress(Refused), answer_errors():
        for row in on_page.runs():
            json_of(History((row,)))
        opened = on_page.open_run("last")
        view = RunView(opened.context("", "recorded"), time.monotonic, today)
        view.recall(opened.started, opened.ended)
        json_of(ShownRun(view.state(), recorded=True))
    shutil.rmtree(tmp_path / "copy")
    assert not list(tmp_path.parent.glob("*evil*"))


@pytest.mark.parametrize("kind", ["bytes", "values", "documents"])
def test_every_command_answers_in_words_on_damaged_records(kind: str, sound: Path, tmp_path: Path, request: pytest.FixtureRequest) -> None:
    """So many damages of each kind as `--damages` says, spread over all that there are; `make damage` tries every one."""
    makers = {"bytes": lambda file: damages_of_bytes(file, seed=5), "values": damages_of_values, "documents": damages_of_documents}
    before = rows_of(sound)
    for number, (name, damage) in enumerate(spread(makers[kind](sound / "station.sqlite"), request.config.getoption("--damages"))):
        place = tmp_path / str(number)
        place.mkdir()
        damaged = Path(shutil.copytree(sound, place / "records"))
        damage(damaged / "station.sqlite")
        if kind != "documents" and rows_of(damaged) != before:
            assert cmmlink("verify", "--records", damaged).code in (2, 5), name
        require_words(damaged, place, name)
        shutil.rmtree(place)


@pytest.mark.parametrize(
    "statement",
    [
        "UPDATE sqlite_sequence SET seq = 'many'",
        "CREATE TRIGGER t AFTER INSERT ON record BEGIN DELETE FROM record; END",
        "CREATE VIEW v AS SELECT * FROM record",
        "INSERT INTO record SELECT 0, run, kind, time_s, count, body, crc32, sha256 FROM record WHERE number = 1",
        "INSERT INTO record SELECT -7, 'other', kind, time_s, count, body, crc32, sha256 FROM record WHERE number = 1",
    ],
)
def test_what_the_chain_does_not_hold_is_found_beside_it(statement: str, sound: Path, tmp_path: Path) -> None:
    damaged = Path(shutil.copytree(sound, tmp_path / "records"))
    with closing(sqlite3.connect(damaged / "station.sqlite")) as connection, connection:
        connection.execute(statement)
    assert cmmlink("verify", "--records", damaged).code == 5


NAMES = (
    "../../evil",
    "..\\..\\evil",
    "/etc/evil",
    "C:\\evil",
    "CON",
    "nul.csv",
    "a:b",
    "",
    ".",
    "..",
    "x\0y",
    "\u202egnp.exe",
    "e" * 5000,
    "a/b/\u20ac.csv",
)


def test_the_name_of_a_recorded_nominal_leaves_no_folder_and_no_trace(sound: Path, tmp_path: Path) -> None:
    damages = damages_of_documents(sound / "station.sqlite", names=NAMES)
    for number, (_, damage) in enumerate(itertools.islice(damages, len(NAMES))):
        damaged = Path(shutil.copytree(sound, tmp_path / str(number) / "records"))
        damage(damaged / "station.sqlite")
        out = tmp_path / str(number) / "deep" / "out"
        assert cmmlink("export", "last", "--records", damaged, "--out", out).code == 0
        (nominal,) = out.glob("nominal-*")
        assert nominal.name.isascii()
        assert len(nominal.name) <= 120
        assert not set(nominal.name) & set('<>:"|?*\\/')
        assert nominal.name == nominal.name.rstrip(" .")
        assert sorted(path.name for path in (tmp_path / str(number)).iterdir()) == ["deep", "records"]
