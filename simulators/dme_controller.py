"""A simulated I++ DME server without any input or output: what it answers to each line, and what its machine does meanwhile.

A command is acknowledged when it is heard and carried out when those before it are done. What takes time comes in steps: how long each
takes, and the data that it brings. From an error of severity 2 on everything that waits is given up, and nothing but the clearing of
errors is taken.
"""

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass

from simulators.dme_answers import CARRIED_OUT, KNOWN
from simulators.dme_language import ERRORS, LONGEST, Call, Refused, parse, split_tag
from simulators.dme_part import Part
from simulators.dme_scans import Step
from simulators.dme_state import State

_ABORT = "AbortE"
_OUTSIDE = ("StartSession", "EndSession", "ClearAllErrors")
_LET_THROUGH = ("ClearAllErrors", "GetErrStatusE", "GetXtdErrStatus", "EndSession", _ABORT, "GetErrorInfo")
_FAST = frozenset({_ABORT, "GetErrStatusE", "GetPropE", "OnMoveReportE"})


@dataclass(frozen=True, slots=True)
class Line:
    """One line of the server. `of` is the command that it answers, `points` are those of a scan that it holds."""

    tag: str
    sign: str
    data: str = ""
    of: str = ""
    points: int = 0

    @property
    def text(self) -> str:
        """The line as it is sent, without its end."""
        return f"{self.tag} {self.sign} {self.data}" if self.data else f"{self.tag} {self.sign}"


@dataclass(frozen=True, slots=True)
class _Waiting:
    tag: str
    call: Call
    steps: Iterator[Step]


class Controller:
    """The server. Its machine begins without a session; for the other arguments see `State`."""

    def __init__(self, part: Part, *, homed: bool = False, tool: str = "NoTool", points_a_line: int = 10, point_s: float = 0.0) -> None:
        self.machine = State(part, homed=homed, tool=tool, points_a_line=points_a_line, point_s=point_s)
        self.bare_causes = False
        self._queue: deque[_Waiting] = deque()

    @property
    def is_busy(self) -> bool:
        """Whether something is to be done."""
        return bool(self._queue)

    def hear(self, line: str) -> list[Line]:
        """Take one line of the client; return what is said to it at once."""
        if len(line) > LONGEST or not line.isascii() or not line.isprintable():
            return [self._event_error(7, line[:40])]
        try:
            tag, text = split_tag(line)
        except Refused as refused:
            return [self._event_error(refused.code, line[:40])]
        name = text.partition("(")[0]
        heard = Line(tag, "&", of=name)
        try:
            call = parse(text)
            self._require_tag(call, tag)
            self._require_state(call)
        except Refused as refused:
            if tag.startswith("E"):
                return [heard, *self._refuse(tag, name, refused.code)]
            call = Call(name, ())
            self._queue.append(_Waiting(tag, call, _refusal(refused.code)))  # it has its turn, as what can be carried out has
            return [heard]
        if call.name == _ABORT:
            return [heard, *self._abort(tag, call)]
        waiting = _Waiting(tag, call, CARRIED_OUT[call.name](self.machine, tag, call))
        if call.name in _FAST:
            return [heard, *self._fast(waiting)]
        self._queue.append(waiting)
        return [heard]

    def work(self) -> tuple[float, list[Line]]:
        """Do the next piece; return how long it takes and what is said after it."""
        waiting = self._queue[0]
        name = waiting.call.name
        try:
            step = next(waiting.steps)
        except StopIteration:
            self._queue.popleft()
            return 0.0, [Line(waiting.tag, "%", of=name)]
        except Refused as refused:
            self._queue.popleft()
            return 0.0, self._refuse(waiting.tag, name, refused.code)
        lines = [Line(waiting.tag, "#", step.data, name, step.points)] if step.data else []
        reports = [Line(tag, "#", data) for tag, data in self.machine.reports]
        self.machine.reports.clear()
        return step.seconds, reports + lines

    def break_down(self, code: int, cause: str) -> list[Line]:
        """Let something happen that no command asked for, like an emergency stop: what waits is given up."""
        return [self._event_error(code, cause), *self._give_up()]

    def fail(self, code: int) -> list[Line]:
        """Let the command that is carried out fail."""
        waiting = self._queue.popleft()
        return self._refuse(waiting.tag, waiting.call.name, code)

    def leave(self) -> None:
        """The client is gone without a word: what it asked for is given up, its session stays."""
        self._queue.clear()
        self.machine.daemons.clear()

    def error(self, code: int, cause: str) -> str:
        """Spell an error. No quote may stand in the quoted cause."""
        severity, text = ERRORS[code]
        quoted = cause if self.bare_causes else f'"{cause.replace(chr(34), "#")}"'
        return f'Error({severity}, {code:04d}, {quoted}, "{text}")'

    def _require_tag(self, call: Call, tag: str) -> None:
        """Raise Refused where a fast command has no event tag, or another command has one."""
        known = call.name in CARRIED_OUT or call.name in KNOWN or call.name == _ABORT
        if known and (call.name in _FAST) != tag.startswith("E"):
            raise Refused(1)

    def _require_state(self, call: Call) -> None:
        """Raise Refused for a command that cannot be taken now."""
        if call.name not in CARRIED_OUT and call.name != _ABORT:
            raise Refused(501 if call.name in KNOWN else 507)
        if not self.machine.in_session and call.name not in _OUTSIDE:
            raise Refused(507)
        if self.machine.in_error and self.machine.in_session and call.name not in _LET_THROUGH:
            raise Refused(514)

    def _event_error(self, code: int, cause: str) -> Line:
        self.machine.in_error = self.machine.in_error or ERRORS[code][0] >= 2
        return Line("E0000", "!", self.error(code, cause))

    def _refuse(self, tag: str, name: str, code: int) -> list[Line]:
        """Tell an error of a command; from severity 2 on everything that waits goes with it."""
        lines = [Line(tag, "!", self.error(code, name), name), Line(tag, "%", of=name)]
        if ERRORS[code][0] < 2:
            return lines
        self.machine.in_error = True
        return lines + self._give_up()

    def _give_up(self) -> list[Line]:
        lines: list[Line] = []
        while self._queue:
            waiting = self._queue.popleft()
            name = waiting.call.name
            lines += [Line(waiting.tag, "!", self.error(6, name), name), Line(waiting.tag, "%", of=name)]
            self.machine.in_error = True
        return lines

    def _abort(self, tag: str, call: Call) -> list[Line]:
        if call.arguments:
            return self._refuse(tag, call.name, 502)
        return [*self._give_up(), Line(tag, "%", of=call.name)]

    def _fast(self, waiting: _Waiting) -> list[Line]:
        name = waiting.call.name
        try:
            data = [Line(waiting.tag, "#", step.data, name) for step in waiting.steps]
        except Refused as refused:
            return self._refuse(waiting.tag, name, refused.code)
        return [*data, Line(waiting.tag, "%", of=name)]


def _refusal(code: int) -> Iterator[Step]:
    yield from ()
    raise Refused(code)
