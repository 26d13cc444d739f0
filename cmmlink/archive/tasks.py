"""What a process is asked to judge again, and what it answers: paths, ids and rows go to and fro, and never points."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

if TYPE_CHECKING:
    from cmmlink.record import Judgement

MOST_RUNS = 25  # of a task: what a cluster needs for a task is then small beside the work
MOST_POINTS = 2_000_000  # of a task, some seconds of work: so long may the operator who stops it have to wait
_POINTS_OF_A_RUN = 50_000  # where the record does not tell


@dataclass(frozen=True, slots=True)
class RunAsked:
    """A run that is to be judged again.

    chain_sha256 : the hash of its end, by which a worker knows that it reads the same records
    known        : the means by which it was judged again before, which are on record
    sections     : of a stack of sections, which is asked for by its id, the runs of these; the hash is that of the last one
    """

    run: str
    chain_sha256: str
    known: frozenset[str] = frozenset()
    sections: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Task:
    """Runs that one worker judges one after another.

    file     : the file of records that holds them
    settings : keys of the plan with what is to stand behind them
    deaths   : how many workers ended while they were at it
    """

    file: Path
    settings: Mapping[str, str]
    runs: tuple[RunAsked, ...]
    deaths: int = 0

    def apart(self) -> list["Task"]:
        """A task for each of its runs, after a worker ended: whichever run was the reason takes no other with it again."""
        return [replace(self, runs=(one,), deaths=self.deaths + 1) for one in self.runs]


@dataclass(frozen=True, slots=True)
class Failure:
    """Why a run cannot be judged again. kind: unusable for what was asked of it, no-record for its record, defect for the program."""

    kind: Literal["unusable", "no-record", "defect"]
    message: str


@dataclass(frozen=True, slots=True, eq=False)
class Outcome:
    """What came of a run: a judgement, the means of one that is on record, or a failure.

    is_same : nothing was changed for it, so that there is nothing to keep
    stack   : of a stack of sections, what it is by the recorded plan and by the changed one, in the words of a row
    node : the name of the computer that judged
    """

    run: str
    judgement: "Judgement | None" = None
    known: str = ""
    failure: Failure | None = None
    node: str = ""
    is_same: bool = False
    stack: tuple[Mapping[str, Any], Mapping[str, Any]] | None = None


def tasks_of(file: Path, settings: Mapping[str, str], asked: Sequence[tuple[RunAsked, int | None]], workers: int) -> list[Task]:
    """The runs in tasks, in their order, each with the number of its points as far as that is known. Few runs are shared out evenly."""
    most = max(1, min(MOST_RUNS, -(-len(asked) // workers)))
    tasks, begun, points = list[Task](), list[RunAsked](), 0
    for one, received in asked:
        more = _POINTS_OF_A_RUN if received is None else received
        if begun and (len(begun) == most or points + more > MOST_POINTS):
            tasks.append(Task(file, settings, tuple(begun)))
            begun, points = [], 0
        begun.append(one)
        points += more
    return [*tasks, Task(file, settings, tuple(begun))] if begun else tasks
