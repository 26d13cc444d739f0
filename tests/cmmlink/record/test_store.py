"""The station file and its chain: what was written is read, what was altered is found, one process writes."""

import hashlib
import json
import shutil
import sqlite3
import subprocess
import sys
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from cmmlink.errors import StoreError
from cmmlink.record.chain import GENESIS, Alteration, Draft
from cmmlink.record.reader import check_chain, list_runs, open_to_read
from cmmlink.record.store import FILE_NAME, MIGRATIONS, Store
from tests.cmmlink.recorded import TODAY, Script, record, scan_arrivals, today

ADD = "INSERT INTO record SELECT * FROM t"
BODIES = (b"first", b"", b"\x00\xff" * 1000)


def opened(folder: Path, *, writing: bool = True) -> Store:
    return Store(folder, writing=writing, epoch_s=lambda: 12.5)


def filled(folder: Path) -> None:
    with opened(folder) as store:
        store.append([Draft("A", "run", b"{}"), *(Draft("A", "wire", body) for body in BODIES)])
        store.append([Draft("A", "end", b"{}")])


@pytest.fixture(scope="module")
def recorded_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two whole runs, the first with every kind of record but wire."""
    folder = tmp_path_factory.mktemp("recorded")
    record(folder, Script(*scan_arrivals()))
    record(folder, Script(*scan_arrivals(count=120)))
    return folder


@pytest.fixture
def records_copy(recorded_folder: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(recorded_folder, tmp_path / "records"))


def change(folder: Path, *statements: str, parameters: tuple[object, ...] = ()) -> None:
    with closing(sqlite3.connect(folder / FILE_NAME)) as connection, connection:
        for statement in statements:
            connection.execute(statement, parameters if "?" in statement else ())


def rows(folder: Path, query: str) -> list[tuple[Any, ...]]:
    with closing(sqlite3.connect(folder / FILE_NAME)) as connection:
        return connection.execute(query).fetchall()


def alteration(folder: Path, run: str | None = None) -> Alteration:
    with open_to_read(folder, today, close_interrupted=False) as store:
        found = store.first_alteration(run)[0]
    assert found is not None
    return found


def test_what_was_appended_is_read_in_order(tmp_path: Path) -> None:
    filled(tmp_path)
    with opened(tmp_path, writing=False) as store:
        assert [record.body for record in store.records("A", "wire")] == list(BODIES)
        assert [record.number for record in store.records("A")] == [1, 2, 3, 4, 5]
        assert store.totals("A") == {"run": (1, 1), "wire": (3, 3), "end": (1, 1)}


def test_the_hash_is_that_of_the_documented_bytes(tmp_path: Path) -> None:
    """Computed here from the definition, by hashlib alone."""
    filled(tmp_path)
    with opened(tmp_path, writing=False) as store:
        first, second = list(store.records("A"))[:2]
    expected = hashlib.sha256(GENESIS + b"1\nA\nrun\n12.5\n1\n2\n" + b"{}").digest()
    assert first.sha256 == expected
    assert second.sha256 == hashlib.sha256(expected + b"2\nA\nwire\n12.5\n1\n5\n" + b"first").digest()


def test_nothing_altered_is_said_of_untouched_records(recorded_folder: Path) -> None:
    with open_to_read(recorded_folder, today) as store:
        whole = check_chain(store, None)
        ends = [end for _, end in store.begins_and_ends()]
        parts = [check_chain(store, end.run) for end in ends if end is not None]
    assert [part["altered"] for part in (whole, *parts)] == [False] * 3
    assert whole["records"] == sum(part["records"] for part in parts)
    assert [part["chain_sha256"] for part in parts] == [end.sha256.hex() for end in ends if end is not None]
    assert whole["chain_sha256"] == parts[-1]["chain_sha256"]


def test_a_flipped_bit_in_any_column_of_any_record_is_found_and_named(records_copy: Path) -> None:
    """The first, a middle and the last byte of every value, in a record of every kind."""
    kinds = {kind: number for number, _, kind in rows(records_copy, "SELECT number, run, kind FROM record ORDER BY number DESC")}
    assert set(kinds) == {"run", "plan", "nominal", "points", "events", "registration", "deviations", "result", "end"}
    path = records_copy / FILE_NAME
    sound = path.read_bytes()
    for kind, number in kinds.items():
        for column in ("run", "kind", "time_s", "count", "body", "crc32", "sha256"):
            with closing(sqlite3.connect(path)) as connection:
                (value,) = connection.execute(f"SELECT {column} FROM record WHERE number = ?", (number,)).fetchone()
            for altered in flips(value):
                change(records_copy, f"UPDATE record SET {column} = ? WHERE number = {number}", parameters=(altered,))
                found = alteration(records_copy)
                assert found.number == number, (kind, column)
                path.write_bytes(sound)


def foreign(path: Path) -> None:
    with closing(sqlite3.connect(path)) as connection, connection:
        connection.execute("CREATE TABLE record (number INTEGER)")


def flips(value: object) -> list[object]:
    if isinstance(value, bytes):
        places = {0, len(value) // 2, len(value) - 1}
        return [value[:place] + bytes([value[place] ^ 1]) + value[place + 1 :] for place in places]
    if isinstance(value, str):
        return [value[:-1] + chr(ord(value[-1]) ^ 1), chr(ord(value[0]) ^ 1) + value[1:]]
    assert isinstance(value, int | float)
    return [value + 1, str(value) + "x", b"x"] if isinstance(value, int) else [value + 2**-20]


def test_a_byte_flipped_in_the_file_itself_is_found_and_named(records_copy: Path) -> None:
    """Not through SQLite: the byte on the disk, in the plan's and in an event's text."""
    path = records_copy / FILE_NAME
    sound = path.read_bytes()
    for text, kind in ((b"NACA 4512 section\n", "plan"), (b"frame repeated", "events"), (b'"verdict":"uncertain"', "")):
        place = sound.index(text)
        path.write_bytes(sound[:place] + bytes([sound[place] ^ 1]) + sound[place + 1 :])
        found = alteration(records_copy)
        assert found.number > 0
        assert found.kind == kind or not kind


@pytest.mark.parametrize(
    ("statements", "number"),
    [
        pytest.param(["DELETE FROM record WHERE number = 5"], 5, id="one in the middle"),
        pytest.param(["DELETE FROM record WHERE number = 1"], 1, id="the first"),
        pytest.param(["DELETE FROM record WHERE run LIKE '%-0002'"], None, id="the last run"),
        pytest.param(["DELETE FROM record WHERE kind = 'end' AND run LIKE '%-0002'"], None, id="the last record"),
        pytest.param(["DELETE FROM record"], 1, id="all"),
        pytest.param(["DELETE FROM record WHERE number = 5", "UPDATE record SET number = number - 1 WHERE number > 5"], 5, id="gap closed"),
        pytest.param(
            [
                "UPDATE record SET number = -1 WHERE number = 5",
                "UPDATE record SET number = 5 WHERE number = 6",
                "UPDATE record SET number = 6 WHERE number = -1",
            ],
            5,
            id="two exchanged",
        ),
        pytest.param(
            ["INSERT INTO record SELECT number + 1000, run, kind, time_s, count, body, crc32, sha256 FROM record"], None, id="added"
        ),
    ],
)
def test_deleted_moved_and_added_records_are_found(records_copy: Path, statements: list[str], number: int | None) -> None:
    (last,) = rows(records_copy, "SELECT max(number), '', '' FROM record")
    (begin,) = rows(records_copy, "SELECT min(number), '', '' FROM record WHERE run LIKE '%-0002'")
    change(records_copy, *statements)
    with Store(records_copy, writing=False, epoch_s=TODAY.timestamp) as store:
        found = store.first_alteration()[0]
    assert found is not None
    assert found.number in ([number] if number else [begin[0], last[0], last[0] + 1])


def test_one_altered_run_leaves_the_others_provable(records_copy: Path) -> None:
    change(records_copy, "UPDATE record SET body = x'00' WHERE kind = 'points' AND run LIKE '%-0001'")
    with open_to_read(records_copy, today) as store:
        first, second = (begin.run for begin, _ in store.begins_and_ends())
        assert check_chain(store, first)["first"]["kind"] == "points"
        assert not check_chain(store, second)["altered"]


def test_a_run_without_its_last_records_is_found(records_copy: Path) -> None:
    (end,) = rows(records_copy, "SELECT number, run, kind FROM record WHERE kind = 'end' AND run LIKE '%-0001'")
    change(records_copy, f"DELETE FROM record WHERE number = {end[0]}")
    with Store(records_copy, writing=False, epoch_s=TODAY.timestamp) as store:
        found = store.first_alteration(end[1])[0]
    assert found is not None
    assert found.number == end[0]


def test_a_damaged_record_is_not_read_as_if_it_were_sound(records_copy: Path) -> None:
    change(records_copy, "UPDATE record SET body = x'00' WHERE kind = 'plan'")
    with open_to_read(records_copy, today) as store:
        run = store.begins_and_ends()[0][0].run
        with pytest.raises(StoreError, match=r"record 2 \(plan of run .*\) is damaged"):
            list(store.records(run))


def test_a_second_writer_is_told_who_writes(tmp_path: Path) -> None:
    program = (
        "import sys; from pathlib import Path; from cmmlink.record.store import Store\n"
        f"store = Store(Path({str(tmp_path)!r}), writing=True, epoch_s=lambda: 0.0)\n"
        "print('open', flush=True); sys.stdin.readline()"
    )
    root = Path(__file__).resolve().parents[2]
    with subprocess.Popen([sys.executable, "-c", program], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, cwd=root) as other:
        assert other.stdout is not None
        assert other.stdout.readline() == "open\n"
        with pytest.raises(StoreError, match=rf"another process \({other.pid}\) records at this station already; .*--records DIR"):
            opened(tmp_path)
        opened(tmp_path, writing=False).close()
        other.kill()
    filled(tmp_path)  # a killed process leaves no lock behind


def test_a_newer_file_is_refused(tmp_path: Path) -> None:
    filled(tmp_path)
    change(tmp_path, f"PRAGMA user_version = {len(MIGRATIONS) + 1}")
    with pytest.raises(StoreError, match=rf"newer cmmlink \(schema {len(MIGRATIONS) + 1}; this one knows up to {len(MIGRATIONS)}\)"):
        opened(tmp_path)


@pytest.mark.parametrize("writing", [True, False])
def test_an_older_file_is_migrated_and_its_chain_stays_whole(tmp_path: Path, writing: bool) -> None:
    filled(tmp_path)
    newer = (*MIGRATIONS, "ALTER TABLE record ADD COLUMN note TEXT", "CREATE TABLE station (name TEXT)")
    with Store(tmp_path, writing=writing, epoch_s=lambda: 0.0, migrations=newer) as store:
        assert store.first_alteration() == (None, 5, store.first_alteration()[2])
    assert rows(tmp_path, "PRAGMA user_version") == [(len(newer),)]
    assert rows(tmp_path, "SELECT note, 0, 0 FROM record LIMIT 1") == [(None, 0, 0)]
    with pytest.raises(StoreError, match="newer"):
        opened(tmp_path)


def test_a_migration_that_fails_leaves_the_file_as_it_was(tmp_path: Path) -> None:
    filled(tmp_path)
    with pytest.raises(StoreError):
        Store(tmp_path, writing=True, epoch_s=lambda: 0.0, migrations=(*MIGRATIONS, "CREATE TABLE half (x); SELECT no_such_function()"))
    with opened(tmp_path) as store:
        assert store.first_alteration()[0] is None
    assert rows(tmp_path, "SELECT count(*), '', '' FROM sqlite_master WHERE name = 'half'") == [(0, "", "")]


@pytest.mark.parametrize("spoil", [lambda path: path.write_bytes(b"not a database" * 100), foreign])
def test_a_file_that_is_not_ours_is_refused_and_left_alone(tmp_path: Path, spoil: Callable[[Path], None]) -> None:
    path = tmp_path / FILE_NAME
    spoil(path)
    before = path.read_bytes()
    with pytest.raises(StoreError, match="--records DIR"):
        opened(tmp_path)
    assert path.read_bytes() == before


def test_a_folder_that_cannot_be_made_is_one_message(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(StoreError, match="cannot be opened"):
        opened(tmp_path / "file" / "records")


def test_results_carry_the_hashes_of_what_is_recorded(tmp_path: Path) -> None:
    _, recorder = record(tmp_path, Script(*scan_arrivals(count=120)))
    assert recorder.evidence is not None
    with open_to_read(tmp_path, today) as store:
        found = {record.kind: record for record in store.records(recorder.run)}
    header = json.loads(found["run"].body)
    assert recorder.evidence.chain_sha256 == found["end"].sha256.hex()
    assert recorder.evidence.plan_sha256 == header["plan_sha256"] == hashlib.sha256(found["plan"].body).hexdigest()
    assert recorder.evidence.nominal_sha256 == header["nominal_sha256"] == hashlib.sha256(found["nominal"].body).hexdigest()


def test_verify_adds_nothing_and_a_damaged_run_does_not_keep_the_others_from_being_listed(records_copy: Path) -> None:
    change(records_copy, "UPDATE record SET body = x'7b' WHERE kind IN ('run', 'events') AND run LIKE '%-0001'")
    change(records_copy, "UPDATE record SET kind = 'eng' WHERE kind = 'end' AND run LIKE '%-0001'")
    before = rows(records_copy, "SELECT max(number), '', '' FROM record")
    assert alteration(records_copy).number == 1
    assert rows(records_copy, "SELECT max(number), '', '' FROM record") == before
    first, second = list_runs(records_copy, today)
    assert (first["state"], first["part"], first["received"]) == ("damaged", None, None)
    assert (second["state"], second["received"]) == ("complete", 123)
    record(records_copy, Script(*scan_arrivals(count=120)))  # and the station still measures
    assert [entry["state"] for entry in list_runs(records_copy, today)] == ["damaged", "complete", "complete"]
