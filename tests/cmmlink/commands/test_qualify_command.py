"""The command `qualify`: its certificate, its exit status, and what results and the doctor say afterwards."""

import errno
import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pypdf
import pytest

import cmmlink.reference
import cmmlink.report
from cmmlink import installation
from cmmlink.commands import setup
from cmmlink.installation import Installation
from cmmlink.last_qualification import LastQualification, keep_as_last, last_qualification
from cmmlink.qualification import certificate, is_unaltered, wire
from cmmlink.qualification.wire import RATE_HZ, WireToVerdict, scan_on_the_wire
from cmmlink.qualification_keys import Qualified
from cmmlink.reference import ReferenceCase
from tests.cmmlink.command import cmmlink as run
from tests.cmmlink.qualification.few_cases import NAMES, case_named


@pytest.fixture
def station(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A station with a small reference set, whose installation is told and not read."""
    here = Installation({"Python": "3", "processor": "any"})

    def few_cases() -> Iterator[ReferenceCase]:
        return map(case_named, NAMES)

    def short_scan(folder: Path, _: int) -> WireToVerdict:
        return scan_on_the_wire(folder, 300)

    def read(_: Path) -> Installation:
        return here

    folder = tmp_path / "station"
    monkeypatch.setattr(installation, "station_folder", lambda: folder)
    monkeypatch.setattr(installation, "read_installation", read)
    monkeypatch.setattr(cmmlink.reference, "reference_cases", few_cases)
    monkeypatch.setattr(certificate, "scan_on_the_wire", short_scan)
    return folder


def test_a_sound_installation_passes_and_its_certificate_tells_why(station: Path, tmp_path: Path) -> None:
    ended = run("qualify", "--out", tmp_path / "out")
    assert (ended.code, ended.err) == (0, "")
    lines = ended.out.splitlines()
    assert lines[0].split() == ["kind", "what", "values", "largest", "median", "limit"]
    assert lines[-2] == "PASSED"
    assert not any("OUTSIDE" in line for line in lines)
    [written] = (tmp_path / "out").glob("qualification-*.json")
    told = json.loads(written.read_bytes())
    Qualified.model_validate_json(json.dumps(told))
    assert is_unaltered(told)
    assert (told["result"], told["outside"], told["set"]["cases"]) == ("passed", [], len(NAMES))
    wire_told = told["wire"]
    assert (wire_told["rate_hz"], wire_told["sent"], wire_told["received"]) == (RATE_HZ, 300, 300)
    assert 0 <= wire_told["latency_ms"]["median"] <= wire_told["latency_ms"]["p99"] <= wire_told["latency_ms"]["largest"]
    last = last_qualification(station)
    assert last is not None
    assert (last.result, last.certificate_sha256, last.certificate) == ("passed", told["certificate_sha256"], str(written))
    pages = pypdf.PdfReader(written.with_suffix(".pdf")).pages
    first = pages[0].extract_text()
    assert "PASSED" in first
    assert "Every error is inside its limit." in first
    assert told["certificate_sha256"] in first
    assert told["set"]["sha256"] in first
    for line in told["budget"]:
        assert line["kind"] in first


@pytest.mark.parametrize("key", ["date", "result", "budget", "installation", "set"])
def test_a_certificate_that_was_altered_shows_it(key: str) -> None:
    told = {"date": "2026", "result": "failed", "budget": [], "installation": {}, "set": {"cases": 3}}
    told["certificate_sha256"] = certificate._hash_of(told)
    assert is_unaltered(told)
    assert not is_unaltered({**told, key: "other"})
    assert not is_unaltered({name: value for name, value in told.items() if name != key})


def test_an_installation_outside_a_limit_fails_with_status_1_and_that_is_the_last_one(
    station: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    keep_as_last(LastQualification("2026-03-14T15:09:26.000Z", "passed", (), "f" * 64, "q.json", Installation({})), station)

    def no_process(*_: object) -> None:
        raise OSError("no process can be started")

    monkeypatch.setattr(wire, "simulated_device", no_process)
    monkeypatch.setattr(cmmlink.reference, "reference_cases", tuple)
    ended = run("qualify", "--json")
    told = ended.json()
    every = ["deviation", "pose", "zone", "filter", "characteristics", "wire to verdict"]
    assert (ended.code, told["result"], told["outside"]) == (1, "failed", every), "of what was not looked at nothing is known"
    assert told["problems"] == ["wire: no process can be started"]
    Qualified.model_validate_json(json.dumps(told))
    last = last_qualification(station)
    assert last is not None
    assert (last.result, list(last.outside)) == ("failed", every)


def test_one_that_is_broken_off_leaves_the_last_one_in_its_place(station: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before = LastQualification("2026-03-14T15:09:26.000Z", "passed", (), "f" * 64, "q.json", Installation({}))
    keep_as_last(before, station)

    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(certificate, "errors_of_case", interrupt)
    assert run("qualify").code == 130
    assert last_qualification(station) == replace(before, outside=[])


def test_a_certificate_that_cannot_be_written_leaves_the_last_one_in_its_place(
    station: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cmmlink.reference, "reference_cases", tuple)
    monkeypatch.setattr(wire, "simulated_device", None)
    (tmp_path / "certificates").mkdir()

    def fill(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device", str(tmp_path / "certificates"))

    monkeypatch.setattr(cmmlink.report, "write_certificate", fill)
    assert "the certificate cannot be kept: No space left" in run("qualify", "--out", tmp_path / "certificates").failed(5)
    assert last_qualification(station) is None


def test_a_place_that_takes_no_certificate_is_refused_first(station: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setattr(cmmlink.reference, "reference_cases", None)  # which cannot be asked for cases
    assert "the certificate cannot be kept" in run("qualify", "--out", tmp_path / "file").failed(5)
    assert last_qualification(station) is None


def test_the_doctor_names_the_last_qualification_and_how_to_make_one(station: Path) -> None:
    assert setup._words_on_qualification() == "none was made; `cmmlink qualify` makes one in about a minute"
    here = Installation({"Python": "3", "processor": "any"})
    passed = LastQualification("2026-03-14T15:09:26.000Z", "passed", (), "f" * 64, "q.json", here)
    keep_as_last(passed, station)
    assert setup._words_on_qualification() == "passed on 2026-03-14; the installation is the same (certificate q.json)"
    keep_as_last(replace(passed, installation=Installation({"Python": "2", "processor": "any"})), station)
    assert setup._words_on_qualification() == (
        "passed on 2026-03-14; the installation changed since (Python) (certificate q.json); `cmmlink qualify` makes a new one"
    )
