"""A sample of the calls that fail once, and of the moments at which a run is killed; `make faults` tries all of them."""

import os
from pathlib import Path

import pytest

from tests.integration.fail_once import COMMANDS, attempt, killed, prepared
from tests.integration.failing_calls import Faults

SAMPLE = [
    ("run", "sqlite INSERT", 3),
    ("run", "sqlite COMMIT", 4),
    ("run", "thread start", 2),
    ("run", "thread start", 3),
    ("run", "socket recv", 4),
    ("run", "open to read", 8),
    ("export", "file write", 9),
    ("verify", "sqlite SELECT", 4),
    ("show", "file close", 1),
    ("show", "stat", 8),
    ("replay", "thread start", 2),
    ("replay", "sqlite SELECT", 18),
    ("verify", "sqlite SELECT", 6),
    ("ct", "thread start", 2),
    ("ct", "thread start", 3),
    ("ct", "file read", 3),
    ("inspect", "statvfs", 1),
    ("inspect", "listdir", 1),
    ("run", "listdir", 1),
    ("run-asked", "replace", 2),
]


BEFORE_ANOTHER_RUN = {command: (call, number) for command, call, number in SAMPLE}  # the last of each command: one is enough here
PORTS = [("stat", 10), ("stat", 20), ("write", 1), ("read", 2)]


@pytest.fixture(scope="module")
def records(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return prepared(tmp_path_factory.mktemp("prepared") / "folder")


@pytest.mark.parametrize(("command", "call", "number"), SAMPLE)
def test_a_call_that_fails_ends_as_documented_and_costs_nothing_that_was_acknowledged(
    records: Path, command: str, call: str, number: int
) -> None:
    is_tried_again = BEFORE_ANOTHER_RUN[command] == (call, number)
    trial = attempt(COMMANDS[command], Faults(number, only=call), records, again=is_tried_again)
    assert trial.faults.failed == call
    assert not trial.wrong


@pytest.mark.skipif(not hasattr(os, "openpty"), reason="a port is played by a pseudo-terminal")
@pytest.mark.parametrize(("call", "number"), PORTS)
def test_a_call_to_a_port_that_fails_is_told_as_what_it_is(records: Path, call: str, number: int) -> None:
    trial = attempt(COMMANDS["run-port"], Faults(number, only=call), records, again=False)
    assert trial.faults.failed == call
    assert not trial.wrong


@pytest.mark.skipif(not hasattr(os, "fork"), reason="a process is killed at a call of its own on POSIX systems only")
@pytest.mark.parametrize(
    ("command", "call", "number"),
    [("run", "sqlite INSERT", 2), ("run", "sqlite COMMIT", 3), ("run", "socket recv", 5), ("run-asked", "replace", 2)],
)
def test_a_run_that_is_killed_at_a_call_has_kept_what_was_acknowledged(records: Path, command: str, call: str, number: int) -> None:
    trial = killed(COMMANDS[command], Faults(number, only=call), records)
    assert trial.faults.failed
    assert not trial.wrong
