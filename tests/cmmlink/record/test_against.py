"""What the chain inside the file cannot show, a result file that was kept elsewhere does; of runs that nobody signed."""

import json
import shutil
import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cmmlink.demo import plan_file
from tests.cmmlink.command import cmmlink
from tests.cmmlink.recorded import scan_arrivals
from tests.integration.damaged import chain_anew

PLAN = """part: {{name: blade, serial_number: '{serial}'}}
nominal: {{file: '{nominal}'}}
tolerance: {{lower_mm: -0.05, upper_mm: 0.05}}
probe: {{tip_radius_mm: 1}}
discretisation: {{samples: 1000}}
device: {{type: file, file: points.npy}}
records: {{folder: kept, key: absent.pem}}
"""


@pytest.fixture(scope="module")
def station(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three runs on record, with their results in 1, 2 and 3."""
    folder = tmp_path_factory.mktemp("station")
    np.save(folder / "points.npy", np.concatenate([arrival.points_mm for arrival in scan_arrivals() if hasattr(arrival, "points_mm")]))
    for serial in "123":
        plan = folder / "plan.yaml"
        plan.write_text(PLAN.format(serial=serial, nominal=plan_file().with_name("nominal.csv").as_posix()), encoding="utf-8")
        assert cmmlink("run", plan, "--headless", "--out", folder / serial).code == 0
    return folder


@pytest.fixture
def kept(station: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(station / "kept", tmp_path / "kept"))


def verify(kept: Path, result: Path, *more: str) -> tuple[int, str]:
    ended = cmmlink("verify", *more, "--records", kept, "--against", result)
    return ended.code, ended.out + ended.err


def changed(kept: Path, *statements: str) -> None:
    with closing(sqlite3.connect(kept / "station.sqlite")) as connection:
        for statement in statements:
            connection.execute(statement)
        chain_anew(connection)


def test_a_result_and_its_records_agree(station: Path, kept: Path) -> None:
    for serial in "123":
        code, words = verify(kept, station / serial / "result.json")
        assert code == 0
        assert "agree" in words
    run = json.loads((station / "2" / "result.json").read_text(encoding="utf-8"))["run"]
    assert verify(kept, station / "2" / "result.json", run)[0] == 0
    assert verify(kept, station / "2" / "result.json", "last")[0] == 2


LAST = "(SELECT run FROM record WHERE kind = 'run' ORDER BY number DESC LIMIT 1)"
CUT_OFF = (f"DELETE FROM record WHERE run = {LAST}", "UPDATE sqlite_sequence SET seq = (SELECT max(number) FROM record)")
FORGED = "UPDATE record SET body = CAST(replace(CAST(body AS TEXT), {}) AS BLOB) WHERE kind = '{}'"


@pytest.mark.parametrize(
    ("statements", "against", "says"),
    [
        (CUT_OFF, "3", "it was deleted or cut off"),
        (
            (
                "DELETE FROM record WHERE kind = 'end' AND number = (SELECT max(number) FROM record)",
                "UPDATE sqlite_sequence SET seq = (SELECT max(number) FROM record)",
            ),
            "3",
            "the end of run",
        ),
        ((FORGED.format('\'"verdict":"conform"\', \'"verdict":"nonconform"\'', "result"),), "1", 'verdict is "nonconform" in the records'),
        ((FORGED.format('\'"verdict":"conform"\', \'"verdict":"nonconform"\'', "end"),), "1", "the chain of run"),
        ((FORGED.format("'blade', 'wing'", "run"),), "2", 'part is "wing" in the records, "blade" in the result'),
        ((FORGED.format("'0.05', '0.06'", "plan"),), "2", "plan_sha256 is"),
        (("UPDATE record SET body = zeroblob(length(body)) WHERE kind = 'deviations'",), "2", "deviations of run"),
        (("UPDATE record SET body = zeroblob(length(body)) WHERE kind = 'points' AND run LIKE '%-0001'",), "3", "the chain of run"),
        (("UPDATE record SET time_s = time_s + 1 WHERE kind = 'run' AND run LIKE '%-0001'",), "1", "the chain of run"),
    ],
    ids=["last run", "last record", "verdict", "end", "part", "plan", "deviations", "an earlier run", "time"],
)
def test_what_was_written_anew_hashes_and_all_is_found(
    station: Path, kept: Path, statements: tuple[str, ...], against: str, says: str
) -> None:
    changed(kept, *statements)
    plain = cmmlink("verify", "--records", kept)
    assert plain.code == 0, "this is what a chain without an anchor cannot show, and verify has to say so"
    assert "It does not show a file that was written anew" in plain.out
    code, words = verify(kept, station / against / "result.json")
    assert code == 5
    assert says in words
    told = cmmlink("verify", "--records", kept, "--against", station / against / "result.json", "--json")
    assert told.code == 5
    assert json.loads(told.out)["against"]["disagreements"]


def test_a_result_of_before_covers_nothing_that_came_later(station: Path, kept: Path) -> None:
    changed(kept, *CUT_OFF)
    code, words = verify(kept, station / "2" / "result.json")
    assert code == 0
    assert "What was recorded later is not covered" in words


@pytest.mark.parametrize(
    "change",
    [
        lambda result: result | {"verdict": "nonconform"},
        lambda result: result | {"max_deviation_mm": result["max_deviation_mm"] * (1 + 1e-15)},
        lambda result: result | {"worst": result["worst"] | {"station_mm": 0.0}},
        lambda result: {key: value for key, value in result.items() if key != "lost"},
        lambda result: result | {"chain_sha256": "0" * 64},
        lambda result: result | {"serial_number": "7"},
        lambda result: result | {"run": "20000101-000000-0001"},
        lambda result: result | {"ending": "aborted"},
    ],
)
def test_a_result_that_was_changed_is_found(
    station: Path, kept: Path, tmp_path: Path, change: Callable[[dict[str, Any]], dict[str, Any]]
) -> None:
    forged = tmp_path / "result.json"
    forged.write_text(json.dumps(change(json.loads((station / "2" / "result.json").read_text(encoding="utf-8")))), encoding="utf-8")
    assert verify(kept, forged)[0] == 5


@pytest.mark.parametrize("content", [b"", b"{}", b"[]", b"7", b"\xff\xfe", b"[" * 9000, b'{"run": "x"}', b'{"run": 7, "chain_sha256": 7}'])
def test_what_is_no_result_is_one_message(kept: Path, tmp_path: Path, content: bytes) -> None:
    file = tmp_path / "result.json"
    file.write_bytes(content)
    assert str(file) in cmmlink("verify", "--records", kept, "--against", file).refused()
    assert "cannot be read" in cmmlink("verify", "--records", kept, "--against", tmp_path / "none").refused()


def test_altered_records_are_named_first(station: Path, kept: Path) -> None:
    with closing(sqlite3.connect(kept / "station.sqlite")) as connection, connection:
        connection.execute("UPDATE record SET count = count + 1 WHERE number = 2")
    code, words = verify(kept, station / "3" / "result.json")
    assert code == 5
    assert "record 2" in words
