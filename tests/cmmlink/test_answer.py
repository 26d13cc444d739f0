"""What a machine is told of a run: the numbers of the answer, whose request it answers, and that nothing passes a part but its record."""

from datetime import UTC, datetime
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Literal, cast

import numpy as np
import pytest

from cmmlink.answer import NOT_RECORDED, NOT_TOLD, STILL_STANDING, MachineAnswer
from cmmlink.events import Answered, Arrived, Event, RunStarted
from cmmlink.pipeline import RunOutcome
from cmmlink.plan import Answer
from drivers import DeviceError, ScanOpened
from inspection import Verdict
from simulators.answers import variables_set_by

NOON = datetime(2026, 3, 14, 15, 9, 26, tzinfo=UTC)
RUN = "20260314-150926-0042"
STARTED = RunStarted("blade", "", "", "lines", False)
DELIVERED = b"""\
O9100 (CMMLINK ANSWER)\r
(RUN 20260314-150926-0042)\r
#150=1. (1 CONFORM 2 NOT CONFORM 3 NOT PROVEN 9 NOT JUDGED)\r
#151=-0.0231 (WORST DEVIATION MM)\r
#160=79.0569 (CHORD -LE-TE-)\r
#161=99999. (TWIST)\r
#152=7. (REQUEST)\r
M99\r
"""


def outcome_of(
    verdict: Verdict | None, ending: Literal["complete", "aborted", "interrupted"] = "complete", failure: DeviceError | None = None
) -> RunOutcome:
    """How a run ended, as far as a machine is told of it."""
    found = [
        SimpleNamespace(name="chord (LE-TE)", value=79.05691, unit="mm"),
        SimpleNamespace(name="twist", value=float("nan"), unit="deg"),
    ]
    worst = SimpleNamespace(deviation_mm=np.array([-0.02309]))
    result = None if verdict is None else SimpleNamespace(verdict=verdict, worst_row=worst, characteristics=found)
    return RunOutcome(ending, cast("Any", result), cast("Any", None), failure, None)


class Told:
    """A machine's answer, with a list of what was told of it."""

    def __init__(self, file: Path, unit: str = "mm", **more: Any) -> None:
        self.file, self.events, self.kept, self.no_room = file, list[Event](), list[Answered](), ""
        answer = Answer(file=file, characteristics={"chord (LE-TE)": 160, "twist": 161}, **more)
        self.sink = MachineAnswer(answer, unit, self.events.append, lambda: NOON)

    def run(self, *requests: int | None, outcome: RunOutcome, run: str = RUN) -> Answered:
        self.sink(STARTED)
        for request in requests:
            self.sink(Arrived(0.0, ScanOpened("G800", "", None, request)))
        return self.sink.deliver(outcome, run, self.keep)

    def keep(self, answered: Answered) -> str:
        """Stand in for the records, which hold an answer before anybody else is told of it."""
        assert answered not in self.events
        self.kept.append(answered)
        return self.no_room

    @property
    def variables(self) -> dict[int, float]:
        """What a control has in its variables after it called the file."""
        found = variables_set_by(self.file.read_text(encoding="ascii"))
        assert found is not None
        return found


@pytest.fixture
def told(tmp_path: Path) -> Told:
    return Told(tmp_path / "O9100.nc")


def test_an_answer_is_a_program_of_assignments_byte_for_byte(told: Told) -> None:
    answered = told.run(7, outcome=outcome_of(Verdict.CONFORM))
    assert told.file.read_bytes() == DELIVERED
    assert answered == Answered("sent", 7, NOON, "", Verdict.CONFORM, DELIVERED.decode("ascii")) == told.events[-1] == told.kept[0]


@pytest.mark.parametrize(("verdict", "code"), [(Verdict.CONFORM, 1), (Verdict.NONCONFORM, 2), (Verdict.UNCERTAIN, 3), (None, 3)])
def test_every_verdict_has_its_code(verdict: Verdict | None, code: int, told: Told) -> None:
    told.run(7, outcome=outcome_of(verdict))
    assert (told.variables[150], told.variables[152]) == (code, 7)


@pytest.mark.parametrize("ending", ["aborted", "interrupted"])
def test_a_run_that_did_not_come_to_its_end_passes_no_part(ending: Literal["aborted", "interrupted"], told: Told) -> None:
    told.run(7, outcome=outcome_of(Verdict.CONFORM, ending))
    assert told.variables[150] == 3


def test_a_failed_device_passes_no_part(told: Told) -> None:
    told.run(7, outcome=outcome_of(Verdict.CONFORM, failure=DeviceError("the cable")))
    assert told.variables[150] == 3


def test_an_earlier_answer_is_withdrawn_before_the_first_point(told: Told) -> None:
    told.run(7, outcome=outcome_of(Verdict.CONFORM))
    told.sink(STARTED)
    assert (told.variables[150], told.variables[152]) == (9, 0)


@pytest.mark.parametrize(("requests", "answered"), [((7,), 7), ((None, 8), 8), ((7, 8), 8), ((7, None), None), ((), None)])
def test_the_newest_request_is_answered_and_none_that_was_not_told(
    requests: tuple[int | None, ...], answered: int | None, told: Told
) -> None:
    found = told.run(*requests, outcome=outcome_of(Verdict.NONCONFORM))
    assert (found.state, found.problem) == (("sent", "") if answered else ("not sent", NOT_TOLD))
    assert (told.variables[150], told.variables[152]) == ((2, answered) if answered else (9, 0))


def test_a_run_that_is_not_on_record_passes_no_part(told: Told) -> None:
    answered = told.run(7, outcome=outcome_of(Verdict.CONFORM), run="")
    assert (answered.problem, answered.text, told.kept) == (NOT_RECORDED, "", [])
    assert told.variables[150] == 9


def test_an_answer_that_the_records_do_not_hold_was_sent_all_the_same_and_that_is_told(told: Told) -> None:
    told.no_room = "the disk is full"
    answered = told.run(7, outcome=outcome_of(Verdict.CONFORM))
    assert (answered.state, answered.unrecorded, answered) == ("sent", "the disk is full", told.events[-1])
    assert told.file.read_bytes() == DELIVERED


def test_lengths_are_in_the_unit_of_the_control_and_angles_are_not(tmp_path: Path) -> None:
    told = Told(tmp_path / "O9100.nc", "inch")
    told.run(7, outcome=outcome_of(Verdict.CONFORM))
    assert b"#151=-0.00091 (WORST DEVIATION INCH)" in told.file.read_bytes()
    assert told.variables[160] == pytest.approx(79.05691 / 25.4, abs=5e-6)


def test_variables_and_program_are_those_of_the_plan(tmp_path: Path) -> None:
    told = Told(tmp_path / "O9100.nc", program=8000, variables={"verdict": 500, "worst": 501, "request": 502})
    told.run(7, outcome=outcome_of(Verdict.CONFORM))
    assert told.file.read_bytes().startswith(b"O8000 (CMMLINK ANSWER)\r\n")
    assert set(told.variables) == {500, 501, 502, 160, 161}


def test_an_answer_that_was_cut_off_on_its_way_answers_no_request_but_as_a_whole() -> None:
    """Carried out line by line, by a control that does not miss the end: the number of the request comes last, behind all others."""
    for cut in range(len(DELIVERED)):
        assert variables_set_by(DELIVERED[:cut].decode("ascii")) is None or DELIVERED[:cut].strip().endswith(b"M99")
        found = variables_set_by(DELIVERED[:cut].decode("ascii") + "\r\nM99\r\n") or {}
        assert 152 not in found or (found[152], found[150], found[151]) == (7, 1, -0.0231)


def test_what_cannot_be_told_is_told_to_everybody_else(tmp_path: Path) -> None:
    told = Told(tmp_path / "gone" / "O9100.nc")
    answered = told.run(7, outcome=outcome_of(Verdict.CONFORM))
    states = [event.state for event in told.events if isinstance(event, Answered)]
    assert states == ["not withdrawn", "not sent"]
    assert "there is no folder" in answered.problem
    assert answered.problem.endswith(STILL_STANDING)
    assert answered.verdict is None
    assert told.kept == [answered]


def test_two_values_never_share_a_variable() -> None:
    with pytest.raises(ValueError, match="#150 stands twice"):
        Answer(file=Path("O9100.nc"), characteristics={"chord": 150})
