"""The commands on records: what they print, what they write, what they exit with."""

import hashlib
import json
import os
import re
import sqlite3
import subprocess
import sys
from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any
from zlib import crc32

import numpy as np
import pytest

from cmmlink.demo import plan_file
from cmmlink.errors import StoreError
from cmmlink.record.reader import default_folder
from cmmlink.record.store import FILE_NAME
from drivers.source import WireBytes
from tests.cmmlink.command import cmmlink
from tests.cmmlink.recorded import Script, record, scan_arrivals


@dataclass(frozen=True, slots=True)
class Station:
    """A folder of records with one run that `cmmlink run` made from a file of points, and the files of its result."""

    records: Path
    out: Path
    plan: Path
    points_mm: np.ndarray[Any, np.dtype[np.float64]]


def told(*arguments: str | Path, code: int = 0) -> Any:
    ended = cmmlink(*arguments, "--json")
    assert ended.code == code, ended.err
    return json.loads(ended.out)


@pytest.fixture(scope="module")
def station(tmp_path_factory: pytest.TempPathFactory) -> Station:
    folder = tmp_path_factory.mktemp("station")
    batches: Sequence[Any] = [arrival for arrival in scan_arrivals() if hasattr(arrival, "points_mm")]
    points = np.concatenate([batch.points_mm for batch in batches])
    np.save(folder / "points.npy", points)
    plan = folder / "plan.yaml"
    plan.write_text(
        "part: {name: blade, serial_number: '0012'}\noperator: Ada\n"
        f"nominal: {{file: '{plan_file().with_name('nominal.csv').as_posix()}'}}\n"
        "tolerance: {lower_mm: -0.05, upper_mm: 0.05}\nprobe: {tip_radius_mm: 1}\n"
        "discretisation: {samples: 1000}\ndevice: {type: file, file: points.npy}\n"
        "records: kept\n"
    )
    facts = told("run", plan, "--headless", "--out", folder / "out")
    assert facts["verdict"] == "conform"
    return Station(folder / "kept", folder / "out", plan, points)


def test_runs_lists_the_run_with_the_promised_keys(station: Station) -> None:
    (entry,) = told("runs", "--records", station.records)["runs"]
    assert re.fullmatch(r"\d{8}-\d{6}-0001", entry.pop("run"))
    assert re.match(r"\d{4}-\d\d-\d\dT", entry.pop("started"))
    said = {"part": "blade", "serial_number": "0012", "operator": "Ada", "plan_file": "plan.yaml"}
    assert entry == said | {"state": "complete", "received": 600, "verdict": "conform"}
    words = cmmlink("runs", "--records", station.records).out
    assert "complete" in words
    assert "  CONFORM  " in words
    assert "blade 0012" in words


def test_runs_are_searched_and_sorted(station: Station) -> None:
    def serials(*options: str) -> list[str]:
        return [entry["serial_number"] for entry in told("runs", "--records", station.records, *options)["runs"]]

    day = datetime.now().astimezone().date()
    found = ("--part", "LADE", "--serial", "12", "--operator", "ada", "--plan", "plan.y", "--verdict", "conform", "--until", str(day))
    assert serials(*found) == serials("--sort", "verdict") == ["0012"]
    for absent in (("--operator", "Bob"), ("--verdict", "none"), ("--since", str(day + timedelta(1)))):
        assert serials(*found, *absent) == []
    assert "no such run was recorded" in cmmlink("runs", "--records", station.records, "--operator", "Bob").out
    assert cmmlink("runs", "--records", station.records, "--since", "yesterday").code == 2


def test_runs_where_nothing_was_recorded_is_empty_and_writes_nothing(tmp_path: Path) -> None:
    assert told("runs", "--records", tmp_path) == {"runs": []}
    assert list(tmp_path.iterdir()) == []


def test_show_tells_what_the_run_rests_on(station: Station) -> None:
    found = told("show", "last", "--records", station.records)
    assert (found["operator"], found["part"], found["serial_number"], found["simulated"]) == ("Ada", "blade", "0012", False)
    assert found["plan_sha256"] == hashlib.sha256(found["plan"].encode()).hexdigest()
    assert found["nominal_sha256"] == hashlib.sha256(plan_file().with_name("nominal.csv").read_bytes()).hexdigest()
    assert found["software"]["cmmlink"]
    assert found["recorded"]["points"] == 600
    assert found["recorded"]["events"] == {"ScanOpened": 1, "ScanClosed": 1}
    words = cmmlink("show", found["run"], "--records", station.records).out
    assert words.startswith("CONFORM   blade 0012\n")
    assert "conform" in words
    assert "lower_mm: -0.05" in words


def test_result_files_carry_run_chain_software_and_plan(station: Station) -> None:
    result = json.loads((station.out / "result.json").read_text())
    shown = told("show", "last", "--records", station.records)
    for key in ("run", "chain_sha256", "plan_sha256", "nominal_sha256", "software"):
        assert result[key] == shown[key]
    assert result["chain_sha256"] == told("verify", result["run"], "--records", station.records)["chain_sha256"]


def test_export_writes_files_that_hold_the_run(station: Station, tmp_path: Path) -> None:
    files = told("export", "last", "--records", station.records, "--out", tmp_path)["files"]
    assert {Path(file).name for file in files} == {path.name for path in tmp_path.iterdir()}
    rows = np.load(tmp_path / "points.npy")
    np.testing.assert_array_equal(rows[:, 2:], station.points_mm, strict=True)
    np.testing.assert_array_equal(np.loadtxt(tmp_path / "points.csv", delimiter=",", skiprows=1), rows)
    assert (tmp_path / "deviations.csv").read_bytes() == (station.out / "deviations.csv").read_bytes()
    result = json.loads((tmp_path / "result.json").read_text())
    assert result.items() <= json.loads((station.out / "result.json").read_text()).items()
    assert (tmp_path / "nominal-nominal.csv").read_bytes() == plan_file().with_name("nominal.csv").read_bytes()
    assert "lower_mm: -0.05" in (tmp_path / "plan.yaml").read_text()
    assert json.loads((tmp_path / "run.json").read_text())["part"] == "blade"


def test_raw_bytes_are_exported_as_they_arrived(tmp_path: Path) -> None:
    pieces = [bytes([number]) * number for number in range(1, 40)]
    reads = [WireBytes(number / 3, piece) for number, piece in enumerate(pieces)]
    record(tmp_path / "records", Script(*reads, *scan_arrivals(count=120)))
    told("export", "last", "--records", tmp_path / "records", "--out", tmp_path / "out")
    assert (tmp_path / "out" / "wire.bin").read_bytes() == b"".join(pieces)
    table = np.loadtxt(tmp_path / "out" / "wire.csv", delimiter=",", skiprows=1)
    assert table[:, 0].tolist() == [read.time_s for read in reads]
    assert table[:, 2].tolist() == list(range(1, 40))


def test_replay_says_identical_or_what_is_not(station: Station) -> None:
    same = told("replay", "last", "--records", station.records)
    assert (same["identical"], same["changed"], same["differs"]) == (True, [], [])
    assert "to the last bit" in cmmlink("replay", "last", "--records", station.records).out
    other = told("replay", "last", "--records", station.records, "--tolerance", "0.01", "0.02", code=1)
    assert [change["key"] for change in other["changed"]] == ["tolerance.lower_mm", "tolerance.upper_mm"]
    assert {"key": "verdict", "recorded": "conform", "replayed": "nonconform"} in other["differs"]


def test_verify_exits_0_only_when_nothing_was_altered(tmp_path: Path) -> None:
    record(tmp_path, Script(*scan_arrivals(count=120)))
    assert told("verify", "--records", tmp_path)["altered"] is False
    assert "nothing was altered" in cmmlink("verify", "last", "--records", tmp_path).out
    with closing(sqlite3.connect(tmp_path / "station.sqlite")) as connection, connection:
        (body,) = connection.execute("SELECT body FROM record WHERE kind = 'result'").fetchone()
        forged = body.replace(b'"lost":3', b'"lost":0')
        assert forged != body
        connection.execute("UPDATE record SET body = ?, crc32 = ? WHERE kind = 'result'", (forged, crc32(forged)))
    found = told("verify", "--records", tmp_path, code=5)
    assert (found["altered"], found["first"]["kind"]) == (True, "result")
    words = cmmlink("verify", "--records", tmp_path)
    assert words.code == 5
    assert f"record {found['first']['number']} (result of run" in words.err
    refused = cmmlink("replay", "last", "--records", tmp_path)
    assert refused.code == 5
    assert "was altered" in refused.err


@pytest.mark.parametrize(
    "command", [["show", "20991231"], ["replay", "20991231"], ["verify", "20991231"], ["export", "20991231", "--out", "x"]]
)
def test_an_unknown_run_is_one_message_and_exit_code_2(station: Station, command: list[str]) -> None:
    ended = cmmlink(*command, "--records", station.records)
    assert ended.code == 2
    assert len(ended.err.splitlines()) == 1
    assert "there is no run '20991231'" in ended.err


def test_a_folder_without_records_is_one_message_and_exit_code_2(tmp_path: Path) -> None:
    ended = cmmlink("verify", "--records", tmp_path)
    assert ended.code == 2
    assert "there are no records here" in ended.err


def test_a_run_whose_record_cannot_be_kept_does_not_begin(station: Station, tmp_path: Path) -> None:
    (tmp_path / "records").write_text("a file where the folder should be")
    ended = cmmlink("run", station.plan, "--headless", "--records", tmp_path / "records")
    assert ended.code == 5
    assert len(ended.err.splitlines()) == 1
    assert "--records DIR" in ended.err


def test_records_on_a_write_protected_medium_can_be_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    record(tmp_path, Script(*scan_arrivals(count=120)))
    before = {path.name: path.stat().st_mtime_ns for path in tmp_path.iterdir()}
    monkeypatch.setattr("cmmlink.record.store.os.access", lambda _, mode: mode != os.W_OK)  # what the system says of such a medium
    assert told("runs", "--records", tmp_path)["runs"][0]["state"] == "complete"
    assert told("verify", "--records", tmp_path)["altered"] is False
    assert {path.name: path.stat().st_mtime_ns for path in tmp_path.iterdir()} == before
    with pytest.raises(StoreError, match="--records DIR"):
        record(tmp_path, Script(*scan_arrivals(count=120)))


def test_records_that_cannot_be_read_whole_are_not_said_to_be_sound(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    record(tmp_path, Script(*scan_arrivals(count=120)))
    file = tmp_path / FILE_NAME
    with monkeypatch.context() as patch:
        patch.setattr("cmmlink.record.store.os.access", lambda _, mode: mode != os.W_OK)
        left = tmp_path / f"{FILE_NAME}-wal"
        left.write_bytes(b"what a killed recorder left behind")
        for command in ("runs", "verify"):
            ended = cmmlink(command, "--records", tmp_path)
            assert ended.code == 5
            assert "copy the whole folder to a disk that can be written" in ended.err
        left.unlink()
    file.write_bytes(b"")
    for command in ("runs", "verify"):
        ended = cmmlink(command, "--records", tmp_path)
        assert ended.code == 5
        assert "the file is empty: what was recorded in it is gone" in ended.err


def test_runs_are_kept_in_the_users_data_folder_unless_told_otherwise(station: Station, tmp_path: Path) -> None:
    plan = tmp_path / "plan.yaml"
    points = (station.plan.parent / "points.npy").as_posix()
    plan.write_text(station.plan.read_text().replace("records: kept\n", "").replace("points.npy", f"'{points}'") + "out: null\n")
    command = [sys.executable, "-m", "cmmlink", "run", str(plan), "--headless", "--json"]  # a process of its own: no folder in place
    ended = subprocess.run(command, capture_output=True, text=True, cwd=Path(__file__).resolve().parents[2], check=True)
    assert json.loads(ended.stdout)["run"] == told("runs", "--records", default_folder())["runs"][-1]["run"]
