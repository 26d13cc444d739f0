"""Processes that answer: all answers in the order of the questions, none where a process failed or was ended, and nothing left running."""

from contextlib import closing
from pathlib import Path

import pytest

from cmmlink.other_processes import OtherProcesses, _Process

ANSWERING = "tests.cmmlink.answering"


@pytest.fixture
def begun(monkeypatch: pytest.MonkeyPatch) -> list[_Process]:
    """The processes that were started."""
    processes: list[_Process] = []
    start = _Process.__init__

    def note(process: _Process, serving: str) -> None:
        start(process, serving)
        processes.append(process)

    monkeypatch.setattr(_Process, "__init__", note)
    return processes


def test_answers_are_those_of_the_questions_and_what_fails_has_none(begun: list[_Process]) -> None:
    with closing(OtherProcesses(2, ANSWERING)) as processes:
        answers = [processes.ask(question) for question in (1, 2, "no number", 4)]
        assert [answer.result(60) for answer in answers] == [2, 4, None, 8]
    assert all(process._child.returncode is not None for process in begun)


def test_an_ended_process_takes_no_questions_from_the_others_and_without_any_there_is_no_answer(begun: list[_Process]) -> None:
    with closing(OtherProcesses(2, ANSWERING)) as processes:
        begun[0]._child.kill()
        begun[0]._child.wait()
        answers = [processes.ask(number).result(60) for number in range(1, 9)]
        assert answers.count(None) <= 1
        assert [answer for answer in answers if answer is not None] == [2 * k for k, answer in enumerate(answers, 1) if answer is not None]
        begun[1]._child.kill()
        begun[1]._child.wait()
        assert [processes.ask(number).result(60) for number in range(20)] == [None] * 20


def test_a_process_that_cannot_even_begin_gives_no_answer(tmp_path: Path) -> None:
    with closing(OtherProcesses(1, "no.such.file")) as processes:
        assert processes.ask(1).result(60) is None
