"""Backups hold all that was acknowledged, restoring changes nothing that is there, and merged runs keep what they were."""

import json
import shutil
import sqlite3
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest

from cmmlink.errors import PlanError, RunError, StationBusyError, StoreError
from cmmlink.record.backup import back_up, merge, restore
from cmmlink.record.chain import Draft, Record
from cmmlink.record.origin import original_chain_sha256
from cmmlink.record.reader import check_chain, open_to_read
from cmmlink.record.store import FILE_NAME, Store
from tests.cmmlink.command import cmmlink
from tests.cmmlink.oval_part import oval_points, write_nominal, write_points
from tests.cmmlink.recorded import today

HEADER = {
    "started": "2026-03-14T15:09:26.000Z",
    "clock_s": 0.0,
    "part": "p",
    "serial_number": "",
    "operator": "",
    "device": "d",
    "simulated": False,
    "software": {},
    "nominal": "n",
}
END = {"state": "complete", "message": "", "ended": "2026-03-14T15:09:27.000Z", "received": 3, "verdict": "conform"}


def opened(folder: Path, *, writing: bool = False) -> Store:
    return Store(folder, writing=writing, epoch_s=lambda: 12.5)


def add_run(folder: Path, run: str, *, points: bytes = b"points", ended: bool = True) -> None:
    """Add a small run, as far as reading its list needs it."""
    with opened(folder, writing=True) as store:
        drafts = [Draft(run, "run", json.dumps({"run": run, **HEADER}).encode()), Draft(run, "points", points)]
        store.append(drafts + ([Draft(run, "end", json.dumps(END).encode())] if ended else []))


def everything(folder: Path) -> list[Record]:
    with opened(folder) as store:
        return list(store.records_from(1))


def change(file: Path, statement: str) -> None:
    with closing(sqlite3.connect(file)) as connection, connection:
        connection.execute(statement)


@pytest.fixture
def station(tmp_path: Path) -> Path:
    folder = tmp_path / "station"
    for run in ("a-0001", "b-0002"):
        add_run(folder, run)
    return folder


@pytest.fixture
def made(station: Path, tmp_path: Path) -> Path:
    back_up(station, tmp_path / "kept.sqlite", today)
    return tmp_path / "kept.sqlite"


def test_a_backup_is_one_file_with_every_record(station: Path, made: Path) -> None:
    restored = made.parent / "elsewhere"
    told = restore(made, restored, today)
    assert everything(restored) == everything(station)
    assert (told.runs, told.records, told.added) == (2, 6, ("a-0001", "b-0002"))
    assert sorted(path.name for path in made.parent.iterdir()) == ["elsewhere", "kept.sqlite", "station"]


def test_a_backup_made_while_a_run_is_recorded_holds_what_was_acknowledged(station: Path, tmp_path: Path) -> None:
    with opened(station, writing=True) as recording:
        recording.append([Draft("c-0003", "run", json.dumps({"run": "c-0003", **HEADER}).encode())])
        told = back_up(station, tmp_path / "kept.sqlite", today)
        recording.append([Draft("c-0003", "points", b"later")])
    assert (told.runs, told.records, told.unfinished) == (3, 7, ("c-0003",))
    assert len(everything(station)) == 8


def test_what_is_recorded_while_pages_are_copied_is_not_half_in_the_backup(
    station: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Another connection commits between any two pages of the copy."""
    monkeypatch.setattr("cmmlink.record.store._PAGES_AT_ONCE", 1)
    count = iter(range(1000))
    with opened(station, writing=True) as recording, opened(station) as reading:

        def commit(_: float) -> None:
            recording.append([Draft("c", "wire", b"x" * 9000 + b"%d" % next(count))])

        reading.back_up(tmp_path / FILE_NAME, commit)
    assert next(count) > 3
    with opened(tmp_path) as copy:
        assert copy.first_alteration()[:2] == (None, 6)


def test_a_backup_is_not_written_over_by_mistake_and_stays_until_the_new_one_is_sound(station: Path, made: Path) -> None:
    before = made.read_bytes()
    with pytest.raises(PlanError, match="--replace"):
        back_up(station, made, today)
    change(station / FILE_NAME, "UPDATE record SET body = x'00' WHERE number = 2")
    with pytest.raises(StoreError, match=r"record 2 .* was altered.*nothing was copied"):
        back_up(station, made, today, replace=True)
    assert made.read_bytes() == before
    assert not made.with_name("kept.sqlite.part").exists()


def test_where_there_are_no_records_there_is_no_backup(tmp_path: Path) -> None:
    with pytest.raises(RunError, match="no records here"):
        back_up(tmp_path, tmp_path / "kept.sqlite", today)
    with pytest.raises(PlanError, match="no records here"):
        restore(tmp_path / "kept.sqlite", tmp_path / "there", today)


def test_the_records_are_no_backup_of_themselves(station: Path) -> None:
    with pytest.raises(PlanError, match="the records themselves"):
        back_up(station, station / FILE_NAME, today, replace=True)


def test_restoring_adds_what_the_backup_has_beyond(station: Path, made: Path) -> None:
    older = Path(shutil.copytree(station, made.parent / "older"))
    add_run(station, "c-0003")
    back_up(station, made, today, replace=True)
    told = restore(made, older, today)
    assert told.added == ("c-0003",)
    assert everything(older) == everything(station)
    assert restore(made, older, today).added == ()
    assert check_chain(opened(older), None)["altered"] is False


def test_records_that_went_on_since_the_backup_stay(station: Path, made: Path) -> None:
    add_run(station, "c-0003")
    before = everything(station)
    assert restore(made, station, today).added == ()
    assert everything(station) == before


def test_records_that_went_on_otherwise_are_not_touched(station: Path, made: Path) -> None:
    other = Path(shutil.copytree(station, made.parent / "other"))
    add_run(station, "c-0003")
    add_run(other, "d-0003")
    back_up(station, made, today, replace=True)
    before = everything(other)
    with pytest.raises(PlanError, match="nothing was restored"):
        restore(made, other, today)
    assert everything(other) == before


def test_damaged_records_are_moved_aside_and_kept(station: Path, made: Path) -> None:
    good = everything(station)
    change(station / FILE_NAME, "UPDATE record SET body = x'00' WHERE number = 2")
    with pytest.raises(StoreError, match="record 2"):
        restore(made, station, today)
    told = restore(made, station, today, replace=True)
    assert everything(station) == good
    assert told.aside is not None
    with closing(sqlite3.connect(told.aside)) as kept:
        assert kept.execute("SELECT hex(body) FROM record WHERE number = 2").fetchone() == ("00",)


@pytest.mark.parametrize("statement", ["UPDATE record SET body = x'00' WHERE number = 4", "DELETE FROM record WHERE number = 6"])
def test_an_altered_backup_restores_and_merges_nothing(made: Path, tmp_path: Path, statement: str) -> None:
    change(made, statement)
    with pytest.raises(StoreError, match=r"record \d"):
        restore(made, tmp_path / "new", today)
    with pytest.raises(StoreError, match=r"record \d"):
        merge(made, tmp_path / "archive", today)
    assert not (tmp_path / "new" / FILE_NAME).exists()


@pytest.fixture
def recording(station: Path) -> Iterator[Store]:
    with opened(station, writing=True) as store:
        yield store


def test_nothing_is_restored_or_merged_while_a_run_is_recorded(recording: Store, tmp_path: Path) -> None:
    add_run(tmp_path / "other", "x-0001")
    back_up(tmp_path / "other", tmp_path / "other.sqlite", today)
    for bring in (restore, merge):
        with pytest.raises(StationBusyError):
            bring(tmp_path / "other.sqlite", recording.path.parent, today)
    with pytest.raises(StationBusyError):
        restore(tmp_path / "other.sqlite", recording.path.parent, today, replace=True)


def test_merged_runs_keep_their_records_and_their_place_in_the_chain_they_come_from(station: Path, tmp_path: Path) -> None:
    archive = tmp_path / "archive"
    add_run(archive, "x-0001")
    told = merge(station, archive, today)
    assert told.added == ("a-0001", "b-0002")
    with opened(archive) as store, opened(station) as source:
        assert store.first_alteration()[0] is None
        for run in told.added:
            kept = [record for record in store.records(run) if record.kind != "origin"]
            told_there = [(record.kind, record.time_s, record.count, record.body) for record in source.records(run)]
            assert [(record.kind, record.time_s, record.count, record.body) for record in kept] == told_there
            assert original_chain_sha256(store, run) == bytes(list(source.records(run))[-1].sha256).hex()
        assert original_chain_sha256(store, "x-0001") is None
    assert merge(station, archive, today).added == ()


def test_a_run_merged_on_and_on_keeps_its_first_origin(station: Path, tmp_path: Path) -> None:
    merge(station, tmp_path / "second", today)
    add_run(tmp_path / "third", "x-0001")
    merge(tmp_path / "second", tmp_path / "third", today)
    with opened(tmp_path / "third") as store, opened(station) as source:
        assert original_chain_sha256(store, "b-0002") == bytes(list(source.records("b-0002"))[-1].sha256).hex()
    assert merge(station, tmp_path / "third", today).added == ()


def test_two_runs_of_one_id_are_not_merged_into_one(station: Path, tmp_path: Path) -> None:
    add_run(tmp_path / "other", "z-0001")
    add_run(tmp_path / "other", "a-0001", points=b"other points")
    with pytest.raises(StoreError, match="run a-0001 is there with another content"):
        merge(station, tmp_path / "other", today)
    with opened(tmp_path / "other") as store:
        assert store.count_runs() == 2


def test_a_run_without_an_end_is_left_out_and_told(station: Path, tmp_path: Path) -> None:
    add_run(station, "c-0003", ended=False)
    told = merge(station, tmp_path / "archive", today)
    assert (told.added, told.unfinished) == (("a-0001", "b-0002"), ("c-0003",))


def test_a_result_of_another_station_is_held_against_the_merged_run(tmp_path: Path) -> None:
    """Over the commands: merged into other records a run verifies against its result, until that is altered."""
    nominal, points = write_nominal(tmp_path / "oval.yaml"), write_points(tmp_path / "scan.csv", oval_points(0.0))
    add_run(tmp_path / "one", "x-0001")
    asked = ("inspect", points, "--nominal", nominal, "--tolerance", -0.05, 0.05, "--fit", "none", "--json")
    shown = cmmlink(*asked, "--records", tmp_path / "two").json()
    (tmp_path / "result.json").write_text(json.dumps(shown), encoding="utf-8")
    copied = cmmlink("backup", tmp_path / "two.sqlite", "--records", tmp_path / "two", "--json").json()
    found = cmmlink("verify", "last", "--records", tmp_path / "two", "--json").json()
    assert (found["chain_sha256"], found["records"]) == (shown["chain_sha256"], copied["records"])
    assert f"added: {shown['run']}" in cmmlink("merge", tmp_path / "two.sqlite", "--records", tmp_path / "one").out
    against = ("verify", "--records", tmp_path / "one", "--against", tmp_path / "result.json")
    ended = cmmlink(*against)
    assert ended.code == 0
    assert "merged from another station" in ended.out
    assert cmmlink(*against, "--json").json()["against"]["taken_over"] is True
    assert cmmlink("show", shown["run"], "--records", tmp_path / "one", "--json").json()["origin"]["chain_sha256"] == shown["chain_sha256"]
    assert cmmlink("replay", shown["run"], "--records", tmp_path / "one", "--json").json()["identical"] is True
    forged = shown | {"chain_sha256": "0" * 64}
    (tmp_path / "forged.json").write_text(json.dumps(forged), encoding="utf-8")
    assert "the chain of run" in cmmlink(*against[:-1], tmp_path / "forged.json").failed(5)


def test_open_to_read_takes_a_restored_folder(made: Path, tmp_path: Path) -> None:
    restore(made, tmp_path / "new", today)
    add_run(tmp_path / "new", "c-0003")
    with open_to_read(tmp_path / "new", today) as store:
        assert store.count_runs() == 3
        assert store.first_alteration()[0] is None


@pytest.mark.parametrize("content", [b"no database at all, but long enough to be one" * 40, b"SQLite format 3\x00" + bytes(200), b""])
def test_what_is_no_backup_is_told_as_that(content: bytes, tmp_path: Path) -> None:
    (tmp_path / "given.sqlite").write_bytes(content)
    for bring in (restore, merge):
        with pytest.raises(PlanError, match=r"given[.]sqlite: .*expected a backup of records"):
            bring(tmp_path / "given.sqlite", tmp_path / "there", today)
    assert not (tmp_path / "there" / FILE_NAME).exists()


def test_a_database_of_another_program_is_no_backup(tmp_path: Path) -> None:
    change(tmp_path / "given.sqlite", "CREATE TABLE other (x)")
    with pytest.raises(PlanError, match="no file of records of cmmlink; expected a backup"):
        merge(tmp_path / "given.sqlite", tmp_path / "there", today)


def test_records_are_not_restored_or_merged_into_themselves(station: Path) -> None:
    for bring in (restore, merge):
        with pytest.raises(PlanError, match="these are the records themselves"):
            bring(station, station, today)
