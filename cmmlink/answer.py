"""The verdict told to the machine tool that asked for it, as a program of assignments that its control calls.

A control waits for the number of its own request, so that no earlier answer passes a part. Before the first point an earlier answer is
replaced by one that passes nothing, and CONFORM is told only of a run whose record holds it: whatever breaks off in between, the machine
finds no part passed. What cannot be told is an alarm, and changes no verdict.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path

from cmmlink.answer_file import replace_answer, withdraw_answer
from cmmlink.errors import AnswerError
from cmmlink.events import Answered, Arrived, Event, RunStarted, Sink
from cmmlink.pipeline import RunOutcome
from cmmlink.plan import Answer
from drivers import ScanOpened
from inspection import Verdict

CODE_OF = {Verdict.CONFORM: 1, Verdict.NONCONFORM: 2, Verdict.UNCERTAIN: 3}
NOT_JUDGED = 9
NO_VALUE = 99_999.0  # no limit lets it pass, which an empty variable might do
NOT_TOLD = (
    "the machine told no number of a request (REQUEST) before its points, so that it could not know the answer for its own; "
    "let its program print one"
)
STILL_STANDING = "; an earlier answer may stand there still"
NOT_RECORDED = "the run is not on record, and the machine is told nothing that no record shows"
_MM_PER_INCH = 25.4
_DECIMALS = {"mm": 4, "inch": 5}
_LONGEST_COMMENT = 40


@dataclass(frozen=True, slots=True)
class _Told:
    """The numbers of one answer: worst deviation and lengths in mm, characteristics by name with their units; NaN where there is none."""

    code: int = NOT_JUDGED
    request: int = 0
    worst_mm: float = math.nan
    values: Sequence[tuple[str, float, str]] = ()
    run: str = ""


class MachineAnswer:
    """What a machine is told of one run: a sink that hears its request, and withdraws the answer to an earlier one before anything comes.

    tell : takes what came of it, as every sink does
    """

    def __init__(self, answer: Answer, unit: str, tell: Sink, now: Callable[[], datetime]) -> None:
        """`unit` is that of the control's lines, mm or inch; `now` tells date and time of day."""
        self._answer, self._unit, self._tell, self._now = answer, unit, tell, now
        self._request: int | None = None
        self._standing = ""  # why an earlier answer could not be withdrawn

    def __call__(self, event: Event) -> None:
        """Take one event of the run."""
        if isinstance(event, RunStarted):
            self._withdraw()
        elif isinstance(event, Arrived) and isinstance(event.arrival, ScanOpened):
            self._request = event.arrival.request

    def deliver(self, outcome: RunOutcome, run: str, keep: Callable[[Answered], str]) -> Answered:
        """Tell the machine the verdict, once the run is on record under its id (empty where it is not), and tell what came of it.

        keep : adds what came of it to the records of the run, before anybody else is told; returns why it could not, nothing where it did
        """
        verdict = _verdict_of(outcome)
        problem, text = NOT_RECORDED if not run else NOT_TOLD if self._request is None else "", ""
        if not problem and self._request is not None:
            text = answer_text(self._answer, self._unit, _told_of(outcome, verdict, self._request, run))
            problem = self._put(replace_answer, text)
        if problem and self._standing:
            problem += STILL_STANDING
        sent = not problem
        answered = Answered("sent" if sent else "not sent", self._request, self._now(), problem, verdict if sent else None, text)
        if run:
            answered = replace(answered, unrecorded=keep(answered))
        self._tell(answered)
        return answered

    def _withdraw(self) -> None:
        self._standing = self._put(withdraw_answer, answer_text(self._answer, self._unit, _Told()))
        if self._standing:
            self._tell(Answered("not withdrawn", None, self._now(), self._standing))

    def _put(self, put: Callable[[Path, bytes], None], text: str) -> str:
        """Put an answer there; returns why it is not, nothing where it is."""
        try:
            put(self._answer.file, text.encode("ascii"))
        except AnswerError as error:
            return str(error)
        return ""


def _verdict_of(outcome: RunOutcome) -> Verdict:
    """The verdict that a machine is told. Only a run that came to its end can have passed its part."""
    verdict = Verdict.UNCERTAIN if outcome.result is None else outcome.result.verdict
    broke_off = outcome.ending != "complete" or outcome.failure is not None
    return Verdict.UNCERTAIN if verdict == Verdict.CONFORM and broke_off else verdict


def _told_of(outcome: RunOutcome, verdict: Verdict, request: int, run: str) -> _Told:
    result = outcome.result
    if result is None:
        return _Told(CODE_OF[verdict], request, run=run)
    worst = result.worst_row
    values = tuple((found.name, found.value, found.unit) for found in result.characteristics)
    return _Told(CODE_OF[verdict], request, math.nan if worst is None else float(worst.deviation_mm[0]), values, run)


def answer_text(answer: Answer, unit: str, told: _Told) -> str:
    """The program that sets the variables. The number of the request comes last: a program that was cut off sets none that fits."""
    return "".join(f"{line}\r\n" for line in _lines(answer, unit, told))


def _lines(answer: Answer, unit: str, told: _Told) -> Iterator[str]:
    values = {name: (value, of) for name, value, of in told.values}
    yield f"O{answer.program} (CMMLINK ANSWER)"
    yield f"({_comment(f'RUN {told.run}' if told.run else 'NO RUN')})"
    yield f"#{answer.variables.verdict}={told.code}. (1 CONFORM 2 NOT CONFORM 3 NOT PROVEN 9 NOT JUDGED)"
    yield f"#{answer.variables.worst}={_number(told.worst_mm, 'mm', unit)} (WORST DEVIATION {unit.upper()})"
    for name, variable in answer.characteristics.items():
        value, of = values.get(name, (math.nan, "mm"))
        yield f"#{variable}={_number(value, of, unit)} ({_comment(name)})"
    yield f"#{answer.variables.request}={told.request}. (REQUEST)"
    yield "M99"


def _number(value: float, of: str, unit: str) -> str:
    """A number as controls read it, with its point; lengths in the unit of the control."""
    if not math.isfinite(value):
        return f"{NO_VALUE:.0f}."
    return f"{value / _MM_PER_INCH if (of, unit) == ('mm', 'inch') else value:.{_DECIMALS[unit]}f}"


def _comment(text: str) -> str:
    """A text as a comment of a program holds it: capitals and digits, without brackets, which would end it."""
    plain = "".join(sign if sign.isascii() and (sign.isalnum() or sign in " -.+") else "-" for sign in text.upper())
    return plain[:_LONGEST_COMMENT]
