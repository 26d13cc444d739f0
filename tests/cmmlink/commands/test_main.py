"""The command line as a whole: version, help, missing arguments, broken streams."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from cmmlink import __version__
from tests.cmmlink.command import Ended, cmmlink
from tests.cmmlink.commands.oval_files import TOLERANCE
from tests.cmmlink.oval_part import oval_points, write_points

COMMANDS = ["demo", "run", "inspect", "nominal", "check", "ports", "simulate"]


AS_PROCESS = (sys.executable, "-m", "cmmlink")
ROOT = Path(__file__).resolve().parents[3]


def inspection(nominal: Path, out: Path | None, name: str = "points.csv") -> list[str]:
    points = write_points(nominal.parent / name, oval_points(0.01))
    to = ("--out", out) if out else ()
    return [*AS_PROCESS, *map(str, ("inspect", points, "--nominal", nominal, *TOLERANCE, "--fit", "none", *to))]


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no full device on this system")
def test_an_answer_that_cannot_be_written_is_not_taken_for_nonconform_and_loses_no_result(nominal: Path, tmp_path: Path) -> None:
    with open("/dev/full", "w", encoding="utf-8") as full:
        ended = subprocess.run(inspection(nominal, tmp_path / "a"), cwd=ROOT, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert ended.returncode == 2
    assert ended.stderr.splitlines()[-1].startswith("cmmlink: the answer or a file could not be written or read: ")
    assert "Traceback" not in ended.stderr
    reading, writing = os.pipe()
    os.close(reading)  # a pipe that nobody reads
    unread = subprocess.run(inspection(nominal, tmp_path / "b"), cwd=ROOT, stdout=writing, stderr=subprocess.PIPE, text=True, check=False)
    os.close(writing)
    assert (unread.returncode, "Traceback" in unread.stderr) == (2, False)
    for folder in ("a", "b"):
        assert json.loads((tmp_path / folder / "result.json").read_text())["verdict"] == "conform"


def test_a_name_that_the_terminal_has_no_letters_for_costs_no_verdict(nominal: Path) -> None:
    latin = os.environ | {"PYTHONUTF8": "0", "PYTHONIOENCODING": "cp1252:strict"}
    ended = subprocess.run(inspection(nominal, None, "\u53f6\u7247.csv"), cwd=ROOT, env=latin, capture_output=True, check=False)
    assert ended.returncode == 0
    assert ended.stdout.startswith(b"CONFORM   ??, file ??.csv")


def test_what_is_missing_is_named(nominal: Path) -> None:
    assert cmmlink("inspect").refused() == "Missing argument 'POINTS...'; `cmmlink inspect --help` shows what is allowed"
    assert cmmlink("inspect", "p.csv", *TOLERANCE).refused().startswith("Missing option '--nominal'; ")
    assert cmmlink("inspect", "p.csv", "--nominal", nominal).refused().startswith("Missing option '--tolerance'; ")
    assert cmmlink("inspect", "p.csv", "--nominal", nominal, "--tolerance", -0.05).refused().startswith("Option '--tolerance' requires 2")
    assert cmmlink("run").refused().startswith("Missing argument 'PLAN.yaml'; `cmmlink run --help`")


@pytest.mark.parametrize(
    ("words", "kind"),
    [(("inspect", "--json"), "usage"), (("no-such-command", "--json"), "usage"), (("runs", "--json", "--no-such"), "usage")],
)
def test_a_mistake_in_the_command_is_told_in_json_where_that_was_asked_for(words: tuple[str, ...], kind: str) -> None:
    ended = cmmlink(*words)
    error = ended.json()["error"]
    assert (ended.code, error["kind"], error["exit_status"]) == (2, kind, 2)
    assert ended.err == f"cmmlink: {error['message']}\n"


def test_what_the_system_refuses_is_told_in_json(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise PermissionError(13, "Permission denied", "/records")

    monkeypatch.setattr("cmmlink.record.list_runs", refuse)
    ended = cmmlink("runs", "--json")
    assert ended.json()["error"] == {"kind": "system", "message": "[Errno 13] Permission denied: '/records'", "exit_status": 2}
    assert cmmlink("runs").out == ""


@pytest.mark.parametrize(
    ("typed", "offered"),
    [
        ("cmmlink re", ["registers", "report", "replay", "rejudge", "reference", "restore"]),
        ("cmmlink replay la", ["last"]),
        ("cmmlink replay x", []),
    ],
)
def test_a_shell_is_offered_commands_and_runs(typed: str, offered: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    for name, value in (("_CMMLINK_COMPLETE", "complete_bash"), ("COMP_WORDS", typed), ("COMP_CWORD", str(typed.count(" ")))):
        monkeypatch.setenv(name, value)
    ended = cmmlink()
    assert (ended.code, ended.out.split()) == (0, offered)


def test_an_unknown_command_is_named_and_the_near_one_offered() -> None:
    assert re.match(r"No such command 'inspcet'\. Did you mean 'inspect'\?", cmmlink("inspcet").refused())


def test_garbage_is_looked_for_late_for_the_first_time_and_often_from_then_on() -> None:
    code = """
import gc, sys
from cmmlink.__main__ import main
sys.argv = ["cmmlink", "--version"]
try:
    main()
except SystemExit:
    print(gc.isenabled(), gc.get_threshold()[0], len(gc.callbacks))
gc.collect()
print(gc.get_threshold()[0], len(gc.callbacks))
"""
    told = subprocess.run([sys.executable, "-c", code], cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True).stdout
    assert told.splitlines()[-2:] == ["True 400000 1", "10000 0"]


def test_version() -> None:
    assert cmmlink("--version") == Ended(0, f"cmmlink {__version__}\n", "")


@pytest.mark.parametrize("option", ["--help", "-h"])
def test_help_lists_every_command_with_its_meaning(option: str) -> None:
    ended = cmmlink(option)
    assert ended.code == 0
    for command in COMMANDS:
        assert re.search(rf"^  {command} +[A-Z].*[a-z]\.$", ended.out, re.MULTILINE), command
    assert "0 conform, 1 nonconform, 3 uncertain" in ended.out
    assert not re.search(r"[a-z,]\.\.\.$", ended.out, re.MULTILINE)  # every meaning is whole


def test_no_command_shows_the_help_and_is_no_success() -> None:
    ended = cmmlink()
    assert ended.code == 2
    assert ended.out == cmmlink("--help").out


@pytest.mark.parametrize("command", COMMANDS)
def test_help_of_a_command_says_how_to_call_it(command: str) -> None:
    ended = cmmlink(command, "--help")
    assert (ended.code, ended.err) == (0, "")
    assert f"cmmlink {command} " in ended.out.splitlines()[0]
    assert max(map(len, ended.out.splitlines())) <= 120
