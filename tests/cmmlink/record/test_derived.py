"""A recorded run judged again with something changed leaves who, when and why in the chain, and never touches the run."""

import json
import shutil
import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cmmlink.record.chain import Draft
from cmmlink.record.store import Store
from tests.cmmlink.command import cmmlink
from tests.cmmlink.oval_part import oval_points, write_nominal, write_points


@pytest.fixture(scope="module")
def measured(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any]]:
    """One run that does not conform by a bump of 0.06 mm, and its result."""
    folder = tmp_path_factory.mktemp("derived")
    deviation_mm = np.zeros(360)
    deviation_mm[100:110] = 0.06
    nominal, points = write_nominal(folder / "oval.yaml"), write_points(folder / "scan.csv", oval_points(deviation_mm))
    asked = ("inspect", points, "--nominal", nominal, "--tolerance", -0.05, 0.05, "--fit", "none", "--records", folder / "records")
    shown = cmmlink(*asked, "--json").json()
    (folder / "result.json").write_text(json.dumps(shown), encoding="utf-8")
    return folder, shown


def again(folder: Path, *asked: object) -> Any:
    return cmmlink("replay", "last", "--records", folder / "records", *asked)


def test_any_key_of_the_plan_may_be_another_and_that_is_on_record(measured: tuple[Path, dict[str, Any]]) -> None:
    folder, shown = measured
    why = "concession 4711: limit of the drawing raised"
    ended = again(folder, "--set", "tolerance.upper_mm=0.08", "--set", "gap_max_mm=2", "--reason", why, "--operator", "Ada", "--json")
    told = ended.json()
    assert (ended.code, told["verdict"], shown["verdict"]) == (0, "conform", "nonconform")
    assert {(change["key"], change["recorded"], change["replayed"]) for change in told["changed"]} == {
        ("tolerance.upper_mm", 0.05, 0.08),
        ("gap_max_mm", None, 2.0),
    }
    described = cmmlink("show", "last", "--records", folder / "records", "--json").json()
    (kept,) = described["derived"]
    assert (kept["who"], kept["why"], kept["verdict"]) == ("Ada", why, "conform")
    assert kept["when"] == told["derived"]["when"] > described["ended"]
    assert kept["changed"] == told["changed"]
    assert kept["chain_sha256"] == told["derived"]["chain_sha256"]
    assert f"by Ada: CONFORM; gap_max_mm None -> 2.0, tolerance.upper_mm 0.05 -> 0.08; {why}" in _lines(folder)
    assert described["verdict"] == "nonconform"
    assert cmmlink("verify", "--records", folder / "records", "--json").json()["state"] == "intact and signed"
    assert cmmlink("verify", "--records", folder / "records", "--against", folder / "result.json").code == 0
    assert again(folder, "--json").json()["identical"] is True


def _lines(folder: Path) -> str:
    out = cmmlink("show", "last", "--records", folder / "records").out
    head, _, changes = next(line for line in out.splitlines() if line.startswith("judged again")).partition(" by ")
    who, listed, why = changes.split("; ")
    return f"{head} by {who}; {', '.join(sorted(listed.split(', ')))}; {why}"


def test_notes_are_those_of_the_plan_that_judged(measured: tuple[Path, dict[str, Any]]) -> None:
    folder, shown = measured
    warm = ("--set", "temperature={part_c: 23, cte_per_k: 1.15e-5, compensate: true, fixed_mm: [0, 0]}", "--reason", "the part was warm")
    told = again(folder, *warm, "--json").json()
    assert [note for note in told["notes"] if "23" in note]
    assert told["max_deviation_mm"] < shown["max_deviation_mm"]
    assert again(folder, "--json").json()["notes"] == shown["notes"]


def test_a_judgement_that_was_altered_is_found(measured: tuple[Path, dict[str, Any]]) -> None:
    folder, _ = measured
    again(folder, "--tolerance", -0.07, 0.07, "--reason", "what if")
    with closing(sqlite3.connect(folder / "records" / "station.sqlite")) as connection:
        ((number, body),) = connection.execute(
            "SELECT number, body FROM record WHERE kind = 'derived' ORDER BY number DESC LIMIT 1"
        ).fetchall()
        forged = json.dumps(json.loads(body) | {"who": "Eve"}).encode()
        connection.execute("UPDATE record SET body = ? WHERE number = ?", (forged, number))
        connection.commit()
        assert f"record {number} (derived" in cmmlink("verify", "--records", folder / "records").failed(5)
        connection.execute("UPDATE record SET body = ? WHERE number = ?", (body, number))
        connection.commit()
    assert cmmlink("verify", "--records", folder / "records").code == 0


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        (("--set", "tolerance.upper_mm=0.08"), "expected --reason TEXT"),
        (("--reason", "none"), "something changed"),
        (("--set", "tolerance.upper_mm", "--reason", "r"), "expected KEY=VALUE"),
        (("--set", "rule=best-fit", "--set", "rule=best-fit", "--reason", "r"), "rule is given twice"),
        (("--set", "tolerance.uper_mm=0.08", "--reason", "r"), "tolerance.uper_mm is no key of a plan"),
        (("--set", "tolerance.upper_mm=wide", "--reason", "r"), "tolerance.upper_mm is 'wide'; expected a number"),
        (("--set", "tolerance.upper_mm.more=1", "--reason", "r"), "there are no keys below tolerance.upper_mm"),
        (("--set", "characteristics.3.upper_mm=1", "--reason", "r"), "there is no 3 among 0"),
        (("--set", "device.file=other.csv", "--reason", "r"), "device.file cannot be changed"),
        (("--set", "nominal.file=other.yaml", "--reason", "r"), "nominal.file cannot be changed"),
        (("--set", "rule=[", "--reason", "r"), "not valid YAML"),
        (("--set", "temperature.part_c=23", "--reason", "r"), "temperature.cte_per_k is missing"),
    ],
)
def test_what_cannot_be_changed_is_told_and_leaves_nothing(
    measured: tuple[Path, dict[str, Any]], asked: tuple[str, ...], words: str
) -> None:
    folder, _ = measured
    before = (folder / "records" / "station.sqlite").read_bytes()
    assert words in again(folder, *asked).refused()
    assert (folder / "records" / "station.sqlite").read_bytes() == before


@pytest.mark.parametrize(
    ("kind", "forged"),
    [
        ("derived", {"changed": [{"key": "rule"}]}),
        ("derived", {"when": "yesterday"}),
        ("derived", {"result": {"verdict": "excellent"}}),
        ("derived", {"who": None}),
        ("origin", {"file": "f", "first": 1, "records": 1, "previous": "", "chain_sha256": "", "merged": "yesterday"}),
        ("origin", {"file": "f"}),
    ],
)
def test_a_document_that_nobody_wrote_is_told_in_words(
    measured: tuple[Path, dict[str, Any]], tmp_path: Path, kind: Any, forged: dict[str, Any]
) -> None:
    """Under a chain that fits: its hashes are computed anew."""
    folder, shown = measured
    again(folder, "--tolerance", -0.08, 0.08, "--reason", "r")
    shutil.copytree(folder / "records", tmp_path / "records")
    with Store(tmp_path / "records", writing=True, epoch_s=lambda: 12.5) as store:
        (*_, last) = store.records(shown["run"], "derived")
        whole = json.loads(last.body) if kind == "derived" else {}
        store.append([Draft(shown["run"], kind, json.dumps(whole | forged).encode())])
    told = cmmlink("show", "last", "--records", tmp_path / "records").failed(5)
    assert f"({kind} of run {shown['run']}) cannot be read" in told
