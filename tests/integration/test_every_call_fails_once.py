"""A sample of the calls that fail once, and of the moments at which a run is killed; `make faults` tries all of them."""

import os
from pathlib import Path

import pytest

from tests.integration.fail_once import COMMANDS, attempt, killed, prepared

SAMPLE = [
    ("run", "sqlite INSERT", 3),
    ("run", "sqlite COMMIT", 4),
    ("run", "thread start", 2),
    ("run", "thread start", 3),
    ("run", "socket recv", 4),
    ("run", "open to read", 8),
    ("export", "file write", 9),
    ("verify", "sqlite SELECT", 4),
]


@pytest.fixture(scope="module")
def records(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return prepared(tmp_path_factory.mktemp("prepared") / "folder")


@pytest.mark.parametrize(("command", "call", "number"), SAMPLE)
def test_a_call_that_fails_ends_as_documented_and_costs_nothing_that_was_acknowledged(
    records: Path, command: str, call: str, number: int
) -> None:
    trial = attempt(COMMANDS[command], number, records, only=call)
    assert trial.faults.failed == call
    assert not trial.wrong


@pytest.mark.skipif(not hasattr(os, "fork"), reason="a process is killed at a call of its own on POSIX systems only")
@pytest.mark.parametrize(("call", "number"), [("sqlite INSERT", 2), ("sqlite COMMIT", 3), ("socket recv", 5)])
def test_a_run_that_is_killed_at_a_call_has_kept_what_was_acknowledged(records: Path, call: str, number: int) -> None:
    trial = killed(COMMANDS["run"], number, records, only=call)
    assert trial.faults.failed
    assert not trial.wrong
