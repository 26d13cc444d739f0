"""A run without a page pushes its results where a database is named; what becomes of that changes neither its answer nor its status."""

import sys
from pathlib import Path

import pytest

from cmmlink.commands import pushed
from cmmlink.console import paper_process
from cmmlink.plant import ResultsDatabase
from cmmlink.plant_push import keep_address
from cmmlink.record import RecordReference
from tests.cmmlink.commands.oval_files import inspect_oval, one_off
from tests.cmmlink.oval_part import write_nominal

QUIET = {"address": "plant.sqlite", "waiting": 0, "problem": None, "unreadable": [], "others": [], "alarms": []}


@pytest.fixture
def nominal(tmp_path: Path) -> Path:
    """A nominal beside records whose station names a database."""
    keep_address(tmp_path / "records", "results.sqlite")
    return write_nominal(tmp_path / "oval.yaml")


def inspected(nominal: Path) -> tuple[str, str]:
    """The id of a run that does not conform, whatever becomes of its results, and what was said beside its answer."""
    ended = inspect_oval(nominal, one_off(0.08), "--records", nominal.parent / "records", "--json")
    assert ended.code == 1
    return ended.json()["run"], ended.err.replace("\\", "/")


def test_the_results_of_a_run_are_pushed_by_itself(nominal: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pushed, "_LONGEST_S", 60.0)  # however busy this computer is
    run, said = inspected(nominal)
    file = nominal.parent / "records" / "results.sqlite"
    assert said == f"cmmlink: pushed to {file.as_posix()}\n"
    with ResultsDatabase(file, is_made=False) as results:
        assert [found.run for found in results.search()] == [run]


def test_a_server_that_refuses_changes_neither_the_answer_nor_the_status(nominal: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    said = "cmmlink: kept in the outbox: db: refused; `cmmlink plant push` brings it there\n"
    pushing_by(monkeypatch, 'print(\'{"error": {"message": "db: refused"}}\')')
    assert inspected(nominal)[1] == said


def pushing_by(monkeypatch: pytest.MonkeyPatch, child: str, longest_s: float = 60.0) -> None:
    """Let this program push, in place of ours."""
    monkeypatch.setattr(paper_process, "this_program", lambda words: [sys.executable, "-c", child])
    monkeypatch.setattr(pushed, "_LONGEST_S", longest_s)


def said_after(records: Path, capsys: pytest.CaptureFixture[str]) -> str:
    with pushed.pushing_after(records) as recorded:
        recorded.append(RecordReference("0001", "", "", "", {}))
    return capsys.readouterr().err


@pytest.mark.parametrize(
    ("child", "longest_s", "why"),
    [("import threading; threading.Event().wait()", 0.3, "nothing was answered within 0.3 s"), ("", 60.0, "it failed")],
)
def test_what_cannot_be_pushed_waits_in_the_outbox(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, child: str, longest_s: float, why: str
) -> None:
    keep_address(tmp_path, "results.sqlite")
    pushing_by(monkeypatch, child, longest_s)
    assert said_after(tmp_path, capsys) == f"cmmlink: kept in the outbox: {why}; `cmmlink plant push` brings it there\n"


def test_settings_that_cannot_be_used_are_told_and_without_any_nothing_is_pushed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    pushing_by(monkeypatch, "raise SystemExit('nobody is to be asked')")
    assert said_after(tmp_path, capsys) == ""
    (tmp_path / "plant.yaml").write_text("adress: x", encoding="utf-8")
    assert "plant.yaml: line 1: adress is not a known key" in said_after(tmp_path, capsys)


def test_a_run_that_is_not_taken_and_a_trend_that_changes_are_told(capsys: pytest.CaptureFixture[str]) -> None:
    pushed._say({**QUIET, "others": ["hall-1 0001"]}, ["0001"])
    alarm = {"part": "blade", "run": "0002", "serial_number": "SN 2", "characteristic": "chord", "rule": "one value beyond"}
    pushed._say({**QUIET, "others": ["hall-1 0001"], "alarms": [alarm]}, ["0002"])
    assert capsys.readouterr().err.splitlines() == [
        "cmmlink: not pushed to plant.sqlite: `cmmlink plant status` says why",
        "cmmlink: pushed to plant.sqlite",
        "cmmlink: the process has changed: blade SN 2, chord: one value beyond",
    ]
