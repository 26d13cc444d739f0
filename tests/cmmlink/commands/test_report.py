"""The command `report`, and the report in the folder of results: one file, whether it is written at once or from the record."""

from pathlib import Path

import pytest
from pypdf import PdfReader

from cmmlink.record.store import FILE_NAME
from tests.cmmlink.command import cmmlink
from tests.cmmlink.commands.oval_files import TOLERANCE
from tests.cmmlink.judged_oval import bumped
from tests.cmmlink.oval_part import oval_points, write_nominal, write_points
from tests.cmmlink.recorded import Script, record, scan_arrivals


@pytest.fixture(scope="module")
def measured(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the results of a recorded inspection; its record lies beside it."""
    folder = tmp_path_factory.mktemp("measured")
    points, nominal = write_points(folder / "points.csv", oval_points(bumped())), write_nominal(folder / "oval.yaml")
    out = folder / "out"
    assert cmmlink("inspect", points, "--nominal", nominal, *TOLERANCE, "--out", out, "--records", folder, "--json").code == 1
    return out


def test_the_report_from_the_record_has_the_bytes_of_the_one_written_at_once(measured: Path, tmp_path: Path) -> None:
    said = cmmlink("report", "last", "-o", tmp_path / "new" / "a.pdf", "--records", measured.parent)
    assert (said.code, said.out) == (0, f"{tmp_path / 'new' / 'a.pdf'}\n")
    assert (tmp_path / "new" / "a.pdf").read_bytes() == (measured / "report.pdf").read_bytes()


def test_language_paper_and_company_are_options(measured: Path, tmp_path: Path) -> None:
    look = ("--language", "de", "--paper", "letter", "--company", "M\u00fcller & S\u00f6hne")
    said = cmmlink("report", "last", *look, "-o", tmp_path / "a.pdf", "--records", measured.parent, "--json").json()
    first = PdfReader(said["file"]).pages[0]
    assert "NICHT KONFORM" in first.extract_text()
    assert "M\u00fcller & S\u00f6hne" in first.extract_text()
    assert first.mediabox[2:] == [612, 792]


def test_a_replay_says_that_it_is_one(measured: Path, tmp_path: Path) -> None:
    cmmlink("replay", "last", "--tolerance", -0.3, 0.3, "--out", tmp_path / "again", "--records", measured.parent)
    told = PdfReader(tmp_path / "again" / "report.pdf").pages[0].extract_text()
    assert "judged again" in told
    assert "NOT CONFORM" not in told


@pytest.mark.parametrize("points", [2, 300])
def test_a_run_that_was_aborted_or_too_short_has_a_report(tmp_path: Path, points: int) -> None:
    record(tmp_path, Script(*scan_arrivals(points)[:-2]))
    assert cmmlink("report", "last", "-o", tmp_path / "a.pdf", "--records", tmp_path).code == 0
    told = PdfReader(tmp_path / "a.pdf").pages[0].extract_text()
    assert ("NOT MEASURED" if points == 2 else "NOT PROVEN") in told
    assert "CONFORM\n" not in told.replace("NOT PROVEN", "")


def test_of_an_altered_record_there_is_no_report(measured: Path, tmp_path: Path) -> None:
    content = (measured.parent / FILE_NAME).read_bytes()
    (tmp_path / FILE_NAME).write_bytes(content.replace(b"nonconform", b"uncertainX", 1))
    said = cmmlink("report", "last", "-o", tmp_path / "a.pdf", "--records", tmp_path)
    assert said.code != 0
    assert not (tmp_path / "a.pdf").exists()


def test_what_cannot_be_used_is_named(measured: Path, tmp_path: Path) -> None:
    assert "there is no such picture" in cmmlink("report", "last", "--logo", tmp_path / "none.png", "--records", measured.parent).refused()
    (tmp_path / "file").write_text("", encoding="utf-8")
    refused = cmmlink("report", "last", "-o", tmp_path / "file" / "a.pdf", "--records", measured.parent).refused()
    assert "the report cannot be written there" in refused
