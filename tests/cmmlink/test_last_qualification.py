"""Results name the last qualification, say nothing more where it holds or none was made, and warn once where the installation changed."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from cmmlink import last_qualification as named
from cmmlink.errors import StoreError
from cmmlink.events import RunStarted
from cmmlink.installation import Installation
from cmmlink.last_qualification import LastQualification, keep_as_last, qualification_here
from cmmlink.record.shapes import Header, checked
from cmmlink.report.further_pages import qualification_words
from cmmlink.report.speech import Speech
from tests.cmmlink.command import cmmlink
from tests.cmmlink.oval_part import oval_points, write_nominal, write_points

HERE = Installation({"Python": "3.13", "files of inspection": "a" * 64}, {"rows.1.nbc": "c" * 64})
PASSED = LastQualification("2026-03-14T15:09:26.000Z", "passed", (), "f" * 64, "/certificates/q.json", HERE)
FAILED = replace(PASSED, result="failed", outside=("zone", "filter"))
CHANGED = {
    "a kernel": replace(HERE, parts={**HERE.parts, "files of inspection": "b" * 64}),
    "compiled code": replace(HERE, compiled={"rows.1.nbc": "d" * 64}),
    "a library more": replace(HERE, parts={**HERE.parts, "scipy": "1.17"}),
    "a library less": replace(HERE, parts={"files of inspection": "a" * 64}),
}


@pytest.mark.parametrize("made", [PASSED, FAILED])
@pytest.mark.parametrize("changes", [(), ("Python",), ("Python", "numba", "numpy", "scipy")])
def test_whatever_is_said_of_it_has_its_german_words(made: LastQualification, changes: tuple[str, ...]) -> None:
    for said in filter(None, [made.words(changes), made.warning(changes)]):
        german = Speech("de").sentence(said)
        assert german != said
        assert not {"installation", "qualification", "changed", "makes"} & set(german.split())


@pytest.fixture
def station(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(named, "station_folder", lambda: tmp_path / "station")
    monkeypatch.setattr(named, "installation_here", lambda: HERE)
    return tmp_path / "station"


def _inspect(folder: Path, *more: object) -> tuple[object, ...]:
    nominal = write_nominal(folder / "oval.yaml")
    return ("inspect", write_points(folder / "points.csv", oval_points(0.01)), "--nominal", nominal, "--tolerance", -0.05, 0.05, *more)


def test_where_none_was_made_nothing_is_looked_for_and_nothing_said(station: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse() -> Installation:
        raise AssertionError("looked at the installation")

    monkeypatch.setattr(named, "installation_here", refuse)
    assert qualification_here() == (None, "")


def test_one_that_holds_is_named_without_a_warning(station: Path) -> None:
    keep_as_last(PASSED, station)
    told, warning = qualification_here()
    assert warning == ""
    assert told == {
        "date": PASSED.date, "result": "passed", "certificate_sha256": "f" * 64, "same_installation": True,
        "words": "passed on 2026-03-14; the installation is the same",
    }  # fmt: skip


@pytest.mark.parametrize("change", CHANGED)
@pytest.mark.parametrize("last", [PASSED, FAILED], ids=["passed", "failed"])
def test_any_change_of_the_installation_is_said(
    station: Path, monkeypatch: pytest.MonkeyPatch, last: LastQualification, change: str
) -> None:
    keep_as_last(last, station)
    monkeypatch.setattr(named, "installation_here", lambda: CHANGED[change])
    told, warning = qualification_here()
    assert told is not None
    assert told["same_installation"] is False
    assert "; the installation changed since (" in told["words"]
    assert warning.startswith("the installation changed since its qualification of 2026-03-14 (")
    assert warning.endswith("`cmmlink qualify` makes a new one")


def test_a_failed_one_is_the_last_one_and_says_so(station: Path) -> None:
    keep_as_last(PASSED, station)
    keep_as_last(FAILED, station)
    told, warning = qualification_here()
    assert told is not None
    assert (told["result"], told["words"]) == ("failed", "failed (zone, filter) on 2026-03-14; the installation is the same")
    assert warning == "the qualification of this installation failed on 2026-03-14 (zone, filter); `cmmlink qualify` makes a new one"


@pytest.mark.parametrize("content", [b"", b"[]", b"{}", b'{"installation": {}}', b"\xff", b'{"installation": 7}'])
def test_one_that_cannot_be_read_is_none(station: Path, content: bytes) -> None:
    station.mkdir()
    (station / "last.json").write_bytes(content)
    assert qualification_here() == (None, "")


def test_a_run_says_it_once_and_its_record_says_the_same(station: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    keep_as_last(PASSED, station)
    monkeypatch.setattr(named, "installation_here", lambda: CHANGED["a kernel"])
    records = ("--records", tmp_path / "records")
    words = cmmlink(*_inspect(tmp_path, "--no-record"))
    assert words.code == 0
    assert words.out.count("the installation changed since its qualification of 2026-03-14 (files of inspection)") == 1
    found = cmmlink(*_inspect(tmp_path, *records, "--json")).json()
    assert found["qualification"]["same_installation"] is False
    assert sum("the installation changed" in note for note in found["notes"]) == 1
    assert cmmlink("show", "last", *records, "--json").json()["qualification"] == found["qualification"]
    cmmlink("export", "last", *records, "--format", "json", "--out", tmp_path / "exported")
    [exported] = (tmp_path / "exported").glob("*.json")
    assert json.loads(exported.read_bytes())["qualification"] == found["qualification"]
    for qualification, code in ((found["qualification"], 0), ({**found["qualification"], "same_installation": True}, 5)):
        (tmp_path / "result.json").write_text(json.dumps({**found, "qualification": qualification}))
        assert cmmlink("verify", *records, "--against", tmp_path / "result.json").code == code


def test_a_report_names_it_in_its_language(station: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    same, changed = "die Installation ist dieselbe", "die Installation hat sich seither ge\u00e4ndert (scipy)"
    for last, came in ((PASSED, "bestanden"), (FAILED, "nicht bestanden (zone, filter)")):
        keep_as_last(last, station)
        for here, holds in ((HERE, same), (CHANGED["a library more"], changed)):
            monkeypatch.setattr(named, "installation_here", lambda here=here: here)
            told, _ = qualification_here()
            assert told is not None
            german = qualification_words({"qualification": told}, Speech("de"))
            assert german == f"{came} am 2026-03-14; {holds}; Zertifikat {'f' * 64}"
            assert qualification_words({"qualification": told}, Speech()) == f"{told['words']}; certificate {'f' * 64}"
    assert qualification_words({"qualification": None}, Speech()) == "none was made"
    assert qualification_words({}, Speech()) == "", "of a run that an earlier version recorded, nothing is known"


def test_a_result_without_one_holds_null_and_no_further_note(station: Path, tmp_path: Path) -> None:
    found = cmmlink(*_inspect(tmp_path, "--no-record", "--json")).json()
    assert found["qualification"] is None
    assert not any("qualif" in note for note in found["notes"])


def test_a_header_that_names_one_otherwise_is_damaged() -> None:
    header = {
        "run": "1", "started": PASSED.date, "clock_s": 0.0, "part": "p", "serial_number": "", "operator": "", "device": "d",
        "simulated": False, "software": {}, "nominal": "n",
    }  # fmt: skip
    named_well = {"date": PASSED.date, "result": "passed", "certificate_sha256": "", "same_installation": True, "words": "passed"}
    assert checked(Header, {**header, "qualification": named_well})
    for key in named_well:
        with pytest.raises(StoreError, match=f"qualification.{key}"):
            checked(Header, {**header, "qualification": {name: value for name, value in named_well.items() if name != key}})


def test_records_of_earlier_versions_name_none() -> None:
    header = {"part": "p", "serial_number": "", "operator": "", "device": "d", "simulated": False, "notes": []}
    assert RunStarted.from_header(header).qualification is None
