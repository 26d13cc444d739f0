"""The characteristics of the sections of a stack, evaluated beforehand by other processes.

Each section still takes the path that every scan takes, one after the other, in this process. What it needs at its end is known by then:
another process has sent the same points down the same path. It is taken over only where all that it rests on is the same to the last bit;
whatever else becomes of the other process, the section is evaluated here.
"""

import hashlib
from collections import deque
from collections.abc import Iterator, Sequence
from concurrent.futures import Future
from contextlib import suppress
from dataclasses import dataclass
from threading import Event
from time import monotonic
from types import TracebackType
from typing import Self, TypeVar

from cmmlink.events import RunStarted
from cmmlink.other_processes import OtherProcesses, answer_all, processes_here
from cmmlink.plan import CtPlan, Plan
from cmmlink.section_run import measure_section
from cmmlink.stack_characteristics import StackQuestions
from cmmlink.stack_inputs import StackProfiles
from drivers.surface import Contour, ContourSource
from inspection import (
    Characteristic,
    CharacteristicResult,
    Evaluation,
    InspectionResult,
    Missing,
    SectionCharacteristic,
    Terms,
    evaluate,
    with_found,
)

_WORTH_A_PROCESS = 400  # characteristics of sections: about eight seconds, of which a process takes three to load what it evaluates with
_SURFACE = "surface"  # nothing of what is found holds its name


@dataclass(frozen=True, slots=True)
class _Asked:
    """A section to be evaluated: the plan of its stack and its own, and the contours that are judged."""

    stack: CtPlan
    section: Plan
    judged: tuple[Contour, ...]


@dataclass(frozen=True, slots=True)
class _Basis:
    """What the evaluation of a section rests on, and `sha256` of all that is numbers."""

    missing: Missing
    complete: bool
    sha256: str

    @classmethod
    def of(cls, result: InspectionResult, terms: Terms, missing: Missing, complete: bool) -> Self:
        """That of one evaluation."""
        pose, points = result.registration.nominal_from_section, result.section_at(slice(None))
        rows = (points, result.station_mm, result.deviation_mm, result.verdicts, result.rejection)
        told = hashlib.sha256()
        for array in (terms.nominal.points_mm, pose.translation_mm, *rows):
            told.update(array.tobytes())
        told.update(repr((pose.rotation_rad, terms.zone, result.verdict, result.reasons)).encode())
        return cls(missing, complete, told.hexdigest())


@dataclass(frozen=True, slots=True, eq=False)
class _Foreseen:
    """What was found of a section: of its characteristics, and of what its stack needs beside."""

    basis: _Basis
    characteristics: tuple[CharacteristicResult, ...]
    numbers: tuple[CharacteristicResult, ...]


class Foresight:
    """Evaluates sections beforehand, in other processes once these were started. They end with the context.

    ahead : how many sections it should be asked for before the first of them is needed
    taken : how many evaluations were taken over from other processes
    """

    def __init__(self) -> None:
        self.ahead = self.taken = 0
        self._processes: OtherProcesses | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        if self._processes is not None:
            self._processes.close()

    def expect(self, sections: int, characteristics: int) -> None:
        """Start the processes that are worth it for so many sections with so many characteristics each; none where fewer than two are."""
        count = min(processes_here(), sections * characteristics // _WORTH_A_PROCESS)
        if count > 1:
            with suppress(OSError):  # the system starts none: all is evaluated here
                self._processes = OtherProcesses(count, __name__)
                self.ahead = 2 * count

    def begin(self, stack: CtPlan, section: Plan, judged: tuple[Contour, ...]) -> Evaluation:
        """Let another process evaluate a section, where there is one. Gives what evaluates it in the end."""
        if self._processes is None:
            return evaluate
        return self._evaluation(self._processes.ask(_Asked(stack, section, judged)))

    def _evaluation(self, answer: "Future[_Foreseen | None]") -> Evaluation:
        def take_over(
            asked: Sequence[Characteristic],
            result: InspectionResult,
            terms: Terms,
            missing: Missing,
            complete: bool,
            numbers: Sequence[SectionCharacteristic],
        ) -> InspectionResult:
            foreseen = answer.result()
            if foreseen is None or foreseen.basis != _Basis.of(result, terms, missing, complete):
                return evaluate(asked, result, terms, missing, complete, numbers)
            self.taken += 1
            return with_found(result, foreseen.characteristics, foreseen.numbers)

        return take_over


Item = TypeVar("Item")


def look_ahead(items: Iterator[Item], count: int) -> Iterator[Item]:
    """The same items, so many of them made before the one that is given. What goes wrong in making one is raised when its turn comes."""
    waiting: deque[Item] = deque()
    while True:
        try:
            while len(waiting) <= count:
                waiting.append(next(items))
        except StopIteration:
            yield from waiting
            return
        except Exception:  # whatever it is, the items before it come first
            yield from waiting
            raise
        yield waiting.popleft()


def serve() -> None:
    """Run as the other process: evaluate what comes."""
    answer_all(_Seer)


class _Seer:
    """What evaluates sections, with the nominals of the stack they are of."""

    def __init__(self) -> None:
        self._stack: CtPlan | None = None
        self._profiles: StackProfiles
        self._questions: StackQuestions

    def __call__(self, asked: _Asked) -> _Foreseen | None:
        """What is found of a section; None where its points cannot be brought onto the nominal."""
        if asked.stack != self._stack:
            self._profiles, self._questions, self._stack = StackProfiles(asked.stack), StackQuestions(asked.stack), asked.stack
        profile, characteristics = self._profiles.of(asked.section)
        numbers = self._questions.numbers(profile)
        found: list[_Foreseen] = []

        def keep(
            asked: Sequence[Characteristic],
            result: InspectionResult,
            terms: Terms,
            missing: Missing,
            complete: bool,
            numbers: Sequence[SectionCharacteristic],
        ) -> InspectionResult:
            basis, done = _Basis.of(result, terms, missing, complete), evaluate(asked, result, terms, missing, complete, numbers)
            found.append(_Foreseen(basis, done.characteristics, done.numbers))
            return done

        started = RunStarted(asked.section.part.name, "", "", _SURFACE, simulated=False)
        source = ContourSource(asked.judged, _SURFACE)
        measure_section(
            source,
            asked.section,
            profile,
            characteristics,
            started,
            None,
            doubt=None,
            clock=monotonic,
            stop=Event(),
            numbers=numbers,
            evaluation=keep,
        )
        return found[0] if found else None
