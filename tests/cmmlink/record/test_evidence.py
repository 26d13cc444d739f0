"""An exported run is judged again from its folder alone, and nothing of it can be altered without being found."""

import csv
import hashlib
import json
import random
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from cmmlink.errors import PlanError, StoreError
from cmmlink.record.evidence import BODIES, CHAIN, open_evidence
from tests.cmmlink.command import cmmlink
from tests.cmmlink.oval_part import oval_points, write_nominal, write_points
from tests.cmmlink.recorded import today

Rows = list[dict[str, str]]


def measured(folder: Path) -> tuple[dict[str, Any], Path]:
    """A run behind another one, judged again with a reason, between two later ones: its result, and the folder of its export."""
    nominal, points = write_nominal(folder / "oval.yaml"), write_points(folder / "scan.csv", oval_points(0.04))
    asked = ("inspect", points, "--nominal", nominal, "--fit", "none", "--json", "--records", folder / "records", "--tolerance")
    cmmlink(*asked, -0.05, 0.05)
    result = cmmlink(*asked, -0.03, 0.03).json()
    cmmlink(*asked, -0.05, 0.05)
    changed = ("--set", "tolerance.upper_mm=0.05", "--reason", "concession", "--operator", "Ada")
    assert cmmlink("replay", result["run"], *changed, "--records", folder / "records").code == 0
    assert cmmlink("export", result["run"], "--out", folder / "evidence", "--records", folder / "records").code == 0
    return result, folder / "evidence"


@pytest.fixture(scope="module")
def exported(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, Any], Path]:
    return measured(tmp_path_factory.mktemp("station"))


@pytest.fixture
def folder(exported: tuple[dict[str, Any], Path], tmp_path: Path) -> Path:
    """A copy that may be altered."""
    return Path(shutil.copytree(exported[1], tmp_path / "evidence"))


def rows_of(folder: Path) -> Rows:
    with (folder / CHAIN).open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def write_rows(folder: Path, rows: Rows) -> None:
    with (folder / CHAIN).open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)


def hashed_anew(folder: Path, rows: Rows) -> None:
    """Give every row the hashes that somebody would who knows how they are made."""
    bodies, offset = (folder / BODIES).read_bytes(), 0
    run, previous = json.loads(bodies[: int(rows[0]["bytes"])])["run"], rows[0]["previous_sha256"]
    for row in rows:
        body = bodies[offset : offset + int(row["bytes"])]
        offset += len(body)
        row["previous_sha256"] = previous
        head = f"{int(row['number'])}\n{run}\n{row['kind']}\n{float(row['time_s'])!r}\n{int(row['count'])}\n{len(body)}\n"
        previous = row["sha256"] = hashlib.sha256(bytes.fromhex(previous) + head.encode() + body).hexdigest()
    write_rows(folder, rows)


def refusal(folder: Path) -> str:
    with pytest.raises(StoreError) as caught, open_evidence(folder, today):
        pass
    assert "Export the run anew" in str(caught.value)
    return str(caught.value)


def test_an_exported_run_is_judged_again_without_records(exported: tuple[dict[str, Any], Path], tmp_path: Path) -> None:
    result, folder = exported
    before = {file.name: file.read_bytes() for file in folder.iterdir()}
    ended = cmmlink("replay", folder, "--json", "--records", tmp_path / "none")
    again = ended.json()
    assert (ended.code, again["identical"], again["changed"], again["differs"]) == (1, True, [], [])
    assert (again["replay_of"], again["chain_sha256"], again["verdict"]) == (result["run"], result["chain_sha256"], "nonconform")
    with open_evidence(folder, today) as evidence:
        (end,) = evidence.store.records(evidence.run, "end")
        assert again["result_sha256"] == json.loads(end.body)["result_sha256"]
        assert evidence.records == len(rows_of(folder))
    assert {"station", "records"} >= {path.name for path in tmp_path.iterdir()}
    assert {file.name: file.read_bytes() for file in folder.iterdir()} == before
    words = cmmlink("replay", folder)
    assert "to the last bit" in words.out
    assert again["result_sha256"] in words.out
    assert result["chain_sha256"] in words.out
    other = cmmlink("replay", folder, "--tolerance", -0.05, 0.05, "--json")
    assert (other.code, other.json()["identical"]) == (0, False)
    assert other.json()["result_sha256"] != again["result_sha256"]


def test_an_exported_run_is_merged_with_its_origin(exported: tuple[dict[str, Any], Path], tmp_path: Path) -> None:
    result, folder = exported
    records = ("--records", tmp_path / "archive")
    assert f"added: {result['run']}" in cmmlink("merge", folder, *records).out
    assert cmmlink("merge", folder, *records, "--json").json()["added"] == []
    (tmp_path / "result.json").write_text(json.dumps(result), encoding="utf-8")
    assert cmmlink("verify", "--against", tmp_path / "result.json", *records, "--json").json()["against"]["taken_over"] is True
    shown = cmmlink("show", result["run"], *records, "--json").json()
    assert (shown["origin"]["chain_sha256"], shown["origin"]["file"]) == (result["chain_sha256"], "evidence")
    assert [judged["why"] for judged in shown["derived"]] == ["concession"]
    assert cmmlink("replay", "last", *records, "--json").json()["identical"] is True
    cmmlink("export", "last", *records, "--out", tmp_path / "evidence")
    again = cmmlink("replay", tmp_path / "evidence", "--json").json()
    assert (again["identical"], again["chain_sha256"]) == (True, shown["chain_sha256"])
    assert cmmlink("merge", tmp_path / "evidence", "--records", tmp_path / "third").code == 0
    origin = cmmlink("show", "last", "--records", tmp_path / "third", "--json").json()["origin"]
    assert origin == shown["origin"], "the first origin is kept"


def test_any_byte_of_the_records_that_was_altered_is_found(folder: Path) -> None:
    sound, numbers = (folder / BODIES).read_bytes(), random.Random(19)
    for place in [0, len(sound) - 1, *(numbers.randrange(len(sound)) for _ in range(30))]:
        altered = bytearray(sound)
        altered[place] ^= 1 << numbers.randrange(8)
        (folder / BODIES).write_bytes(altered)
        refusal(folder)
    for left in (sound[:-1], sound[: len(sound) // 2], b"", sound + b"x"):
        (folder / BODIES).write_bytes(left)
        assert "cut off" in refusal(folder)


def test_any_place_in_the_chain_that_was_altered_is_found(folder: Path) -> None:
    sound, values = rows_of(folder), ["", "x", "7", "-1", "9" * 30, "points", "0" * 64]
    for place in range(len(sound)):
        for at, column in enumerate(sound[0]):
            rows = [dict(row) for row in sound]
            value = values[(place + at) % len(values)]
            rows[place][column] = value if rows[place][column] != value else "8"
            write_rows(folder, rows)
            refusal(folder)


def _without(place: int) -> Callable[[Rows], Rows]:
    return lambda rows: rows[:place] + rows[place + 1 :]


@pytest.mark.parametrize(
    "alter",
    [
        *(_without(place) for place in (0, 3, 5)),
        lambda rows: [rows[1], rows[0], *rows[2:]],
        lambda rows: [*rows[:3], *rows[2:]],
        lambda rows: [*rows[:2], rows[3], rows[2], *rows[4:]],
        lambda rows: [],
    ],
)
def test_records_that_are_missing_doubled_or_moved_are_found(folder: Path, alter: Callable[[Rows], Rows]) -> None:
    sound, bodies = rows_of(folder), (folder / BODIES).read_bytes()
    for row in sound:
        row["at"], bodies = bodies[: int(row["bytes"])].hex(), bodies[int(row["bytes"]) :]
    rows = alter(sound)
    (folder / BODIES).write_bytes(b"".join(bytes.fromhex(row["at"]) for row in rows))
    if rows:
        write_rows(folder, rows)
    else:
        (folder / CHAIN).write_text(",".join(sound[0]) + "\n", encoding="utf-8")
    refusal(folder)


def test_points_behind_the_end_of_a_run_are_no_part_of_it(folder: Path) -> None:
    rows, bodies = rows_of(folder), (folder / BODIES).read_bytes()
    points = next(k for k, row in enumerate(rows) if row["kind"] == "points")
    begin = sum(int(row["bytes"]) for row in rows[:points])
    added = {**rows[points], "number": str(int(rows[-1]["number"]) + 5)}
    (folder / BODIES).write_bytes(bodies + bodies[begin : begin + int(added["bytes"])])
    hashed_anew(folder, [*rows, added])
    assert "(points) does not follow" in refusal(folder)


def test_numbers_that_no_record_has_are_refused_with_sound_hashes(folder: Path) -> None:
    sound = rows_of(folder)
    for column, value in (("count", str(2**63)), ("count", "-1"), ("number", str(2**64)), ("number", "0"), ("time_s", "x")):
        rows = [dict(row) for row in sound]
        rows[0 if column == "number" else 3][column] = value
        if column == "time_s":
            write_rows(folder, rows)
        else:
            hashed_anew(folder, rows)
        refusal(folder)


@pytest.mark.parametrize("name", ["plan.yaml", "nominal-oval.yaml", "result.json"])
def test_a_file_that_says_otherwise_than_the_records_is_named(folder: Path, name: str) -> None:
    file = folder / name
    text = file.read_text(encoding="utf-8")
    old, new = {"plan.yaml": ("0.03", "0.05"), "nominal-oval.yaml": ("8.0", "8.1"), "result.json": ("nonconform", "conform")}[name]
    assert old in text
    file.write_text(text.replace(old, new), encoding="utf-8")
    assert name in refusal(folder)
    assert name in cmmlink("replay", folder).failed(5)
    file.unlink()
    with open_evidence(folder, today):
        pass


def test_a_run_whose_end_is_cut_off_says_so(folder: Path) -> None:
    rows = rows_of(folder)
    kept = next(k for k, row in enumerate(rows) if row["kind"] == "end")
    (folder / BODIES).write_bytes((folder / BODIES).read_bytes()[: sum(int(row["bytes"]) for row in rows[:kept])])
    write_rows(folder, rows[:kept])
    again = cmmlink("replay", folder, "--json").json()
    assert again["identical"] is None
    assert again["verdict"] != "conform"
    assert "the end of the run is not among them" in again["notes"][-1]


def test_a_folder_is_told_from_a_run(
    exported: tuple[dict[str, Any], Path], folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    result, evidence = exported
    records = ("--records", evidence.parent / "records")
    monkeypatch.chdir(tmp_path)
    folder.rename(tmp_path / result["run"])
    assert "exported records" not in cmmlink("replay", result["run"], *records).out, "a run of the records comes first"
    assert "exported records" in cmmlink("replay", f"./{result['run']}", *records).out
    assert "exported records" in cmmlink("replay", result["run"]).out
    assert "no exported run is here" in cmmlink("replay", tmp_path).refused()
    assert "no exported run is here" in cmmlink("replay", "./absent").refused()
    assert "there is no run" in cmmlink("replay", "absent", *records).refused()
    asked = ("--tolerance", -0.05, 0.05, "--reason", "concession")
    assert "cmmlink merge" in cmmlink("replay", evidence, *asked).refused()


def test_what_cannot_be_read_is_said(folder: Path) -> None:
    (folder / CHAIN).write_bytes(b"\xff\xfe\x00")
    assert "no table of records" in refusal(folder)
    (folder / CHAIN).unlink()
    (folder / CHAIN).mkdir()
    with pytest.raises(PlanError, match="no exported run"), open_evidence(folder, today):
        pass
