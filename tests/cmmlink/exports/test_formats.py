"""What holds of every format: written at once or from the record it is the same file, whatever ended a run, and it carries its hash."""

import json
import re
import threading
import zipfile
from pathlib import Path

import numpy as np
import pytest

from cmmlink.result_folder import make_room
from tests.cmmlink.command import cmmlink
from tests.cmmlink.exports.conftest import Measured
from tests.cmmlink.exports.schemas import check_qif, check_result
from tests.cmmlink.exports.tables_of import sheets_of
from tests.cmmlink.oval_part import oval_points, write_nominal
from tests.cmmlink.record.test_old_records import RECORD
from tests.cmmlink.recorded import Script, record, scan_arrivals
from tests.drivers.surface.meshes import binary_stl, tube, write

FORMATS = ("qif", "dfq", "xlsx", "csv", "json")
FILES = ("result.qif", "result.dfq", "result.xlsx", "result.csv", "result-characteristics.csv", "result-points.csv")

NAMES_OF_A_SECTION = ("profile", "largest deviation", "smallest deviation")
STACK = """
part: {name: blade}
mesh: {file: a.stl}
nominal: {file: oval.yaml}
tolerance: {lower_mm: -0.05, upper_mm: 0.05}
registration: {datum: {}}
sections: {heights_mm: [3, 6]}
stack_characteristics: [{name: bent, type: displacement, upper_mm: 0.05}]
cut: {cutter: numpy}
records: records
out: {folder: out, formats: [qif, dfq, xlsx]}
"""


def test_a_run_writes_the_formats_of_its_plan_and_the_record_gives_the_same_bytes(measured: Measured, tmp_path: Path) -> None:
    run = measured.result["run"]
    written = {path.name: path for path in measured.exported(tmp_path, *FORMATS)}
    assert set(written) == {name.replace("result", run) for name in (*FILES, "result.json")}
    for name in FILES:
        assert written[name.replace("result", run)].read_bytes() == (measured.out / name).read_bytes(), name
    again = json.loads(written[f"{run}.json"].read_text(encoding="utf-8"))
    assert again == json.loads((measured.out / "result.json").read_text(encoding="utf-8")) == measured.result


@pytest.mark.parametrize("name", [*FILES, "result.json"])
def test_every_file_carries_the_hash_of_the_record(measured: Measured, name: str) -> None:
    content = (measured.out / name).read_bytes()
    if name.endswith(".xlsx"):
        with zipfile.ZipFile(measured.out / name) as book:
            content = b"".join(book.read(member) for member in book.namelist())
    assert measured.result["chain_sha256"].encode() in content


def test_the_files_of_an_earlier_run_make_way(tmp_path: Path) -> None:
    for name in FILES:
        (tmp_path / name).write_text("earlier", encoding="utf-8")
    aside = make_room(tmp_path)
    assert aside is not None
    assert {path.name for path in aside.iterdir()} == set(FILES)


@pytest.mark.parametrize(("points", "ending"), [(2, "complete"), (300, "complete"), (300, "aborted")])
def test_a_run_without_a_verdict_is_told_as_such_in_every_format(tmp_path: Path, points: int, ending: str) -> None:
    arrivals, stop = scan_arrivals(points), threading.Event()
    script = Script(*arrivals[:-2], stop.set, *arrivals[-2:]) if ending == "aborted" else Script(*arrivals)
    record(tmp_path, script, stop=stop)
    told = cmmlink("export", "last", "--format", ",".join(FORMATS), "--out", tmp_path / "out", "--records", tmp_path, "--json").json()
    files = {Path(file).suffix: Path(file) for file in told["files"] if "-characteristics" not in file and "-points" not in file}
    result = json.loads(files[".json"].read_text(encoding="utf-8"))
    assert (result["verdict"], result["ending"]) == ("uncertain", ending)
    check_result(result)
    statuses = check_qif(files[".qif"])
    assert "PASS" not in statuses
    assert "FAIL" not in statuses
    assert ",uncertain,uncertain," in files[".csv"].read_text(encoding="utf-8-sig")
    values = re.findall(r"K0002/\d+ (\d+)", files[".dfq"].read_text(encoding="utf-8"))
    assert values == {2: [], 300: ["255" if ending == "aborted" else "0"] * 3}[points]


def test_the_sections_of_a_surface_are_one_part(tmp_path: Path) -> None:
    write_nominal(tmp_path / "oval.yaml")
    write(tmp_path / "a.stl", binary_stl(tube(oval_points(0.0), np.array([0.0, 9.0]))))
    (tmp_path / "plan.yaml").write_text(STACK, encoding="utf-8")
    result = cmmlink("ct", tmp_path / "plan.yaml", "--no-pictures", "--json").json()
    check_result(result)
    assert check_qif(tmp_path / "out" / "result.qif") == ["PASS", "PASS", "PASS", "PASS", "PASS"]
    rows = sheets_of(tmp_path / "out" / "result.xlsx")
    assert [(row["height_mm"], row["run"], row["chain_sha256"]) for row in rows["runs"]] == [
        (section["height_mm"], section["run"], section["chain_sha256"]) for section in result["slices"]
    ]
    values = [one["value"] for section in result["slices"] for one in section["characteristics"]] + [result["characteristics"][0]["value"]]
    assert [row["value"] for row in rows["characteristics"]] == pytest.approx(values, rel=1e-15)
    names = re.findall(r"K2002/\d+ (.*)", (tmp_path / "out" / "result.dfq").read_text(encoding="utf-8"))
    assert names == [f"{name} at {height}" for height in ("3.000", "6.000") for name in NAMES_OF_A_SECTION] + ["bent"]


def test_a_run_of_an_earlier_version_is_exported_with_its_own_numbers(tmp_path: Path) -> None:
    told = cmmlink("export", "last", "--format", ",".join(FORMATS), "--out", tmp_path, "--records", RECORD, "--json").json()
    result = json.loads((tmp_path / f"{told['run']}.json").read_text(encoding="utf-8"))
    check_result(result)
    assert (result["verdict"], result["rule"], result["zone_error_mm"]) == ("nonconform", "best-fit", result["profile_error_mm"])
    assert result["notes"][-1].startswith("judged by an earlier version of cmmlink")
    (profile,) = result["characteristics"]
    assert (profile["name"], profile["value"], profile["worst"]) == ("profile", result["zone_error_mm"], result["worst"])
    assert check_qif(tmp_path / f"{told['run']}.qif") == ["FAIL", "FAIL", "FAIL"]
    assert cmmlink("report", "last", "--records", RECORD, "-o", tmp_path / "a.pdf").code == 0


def test_the_command_says_what_it_cannot_do(measured: Measured, tmp_path: Path) -> None:
    records = ("--records", measured.folder / "records")
    assert "--format pdf: expected one of qif, dfq" in cmmlink("export", "last", "--format", "pdf", *records).refused()
    assert "--out DIR" in cmmlink("export", "last", *records).refused()
    assert "one run at a time" in cmmlink("export", "last", "last", "--out", tmp_path, *records).refused()
    (tmp_path / "file").write_text("", encoding="utf-8")
    refused = cmmlink("export", "last", "--format", "csv", "--out", tmp_path / "file" / "a", *records).refused()
    assert "the results cannot be written there" in refused


def test_the_file_is_named_by_the_run_or_as_it_was_asked_for(measured: Measured, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    run, records = measured.result["run"], ("--records", measured.folder / "records")
    assert cmmlink("export", run, "--format", "QIF", *records).out == f"{run}.qif\n"
    assert cmmlink("export", run, "--format", "qif", "--out", "new/blade.qif", *records).out == f"{Path('new/blade.qif')}\n"
    assert (tmp_path / "new" / "blade.qif").read_bytes() == (measured.out / "result.qif").read_bytes()


def test_of_an_altered_record_nothing_is_exported(measured: Measured, tmp_path: Path) -> None:
    content = (measured.folder / "records" / "station.sqlite").read_bytes()
    (tmp_path / "station.sqlite").write_bytes(content.replace(b"nonconform", b"uncertainX", 1))
    assert cmmlink("export", "last", "--format", "csv", "--out", tmp_path / "out", "--records", tmp_path).code == 5
    assert not (tmp_path / "out").exists()
