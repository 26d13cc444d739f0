"""Hands tasks to workers and takes what comes back, until all is judged or somebody stops it.

A task whose worker ended is done again, each of its runs by itself: so nothing is lost, and a run that ends its worker again is named.
"""

from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from threading import Event
from typing import Protocol

from cmmlink.archive.tasks import Failure, Outcome, Task

MOST_DEATHS = 2  # of workers at one run, before it counts as the reason
_LOOK_S = 0.2  # how long Ctrl-C may go unseen on a system where it does not end waiting
Judge = Callable[[Task], list[Outcome]]


class Workers(Protocol):
    """Whoever judges: this process, others on this computer, or a cluster. What submits tasks like `concurrent.futures` can be one."""

    @property
    def places(self) -> int:
        """How many tasks they take at once."""

    @property
    def deaths(self) -> tuple[type[BaseException], ...]:
        """The errors by which a task tells that its worker ended."""

    def submit(self, judge: Judge, task: Task) -> Future[list[Outcome]]:
        """Let a worker judge the runs of a task."""


def judge_all(tasks: Sequence[Task], workers: Workers, take: Callable[[list[Outcome]], None], stop: Event, judge: Judge) -> int:
    """Have all tasks done, and `take` what comes of each, in this thread. Returns how many runs are left because it was stopped.

    stop : no further task is begun once it is set; those that were begun are done
    """
    waiting, doing = deque(tasks), dict[Future[list[Outcome]], Task]()
    while doing or (waiting and not stop.is_set()):
        _begin(waiting, doing, workers, stop, judge)
        done, _ = wait(doing, _LOOK_S, FIRST_COMPLETED)
        ended = [(future, doing.pop(future)) for future in done]
        found = [outcomes for future, task in ended if (outcomes := _found_by(future, task, workers, waiting))]
        _begin(waiting, doing, workers, stop, judge)  # before anything is kept: no worker waits for the disk
        for outcomes in found:
            take(outcomes)
    return sum(len(task.runs) for task in waiting)


def _begin(waiting: deque[Task], doing: dict[Future[list[Outcome]], Task], workers: Workers, stop: Event, judge: Judge) -> None:
    while waiting and len(doing) < workers.places and not stop.is_set():
        task = waiting.popleft()
        doing[workers.submit(judge, task)] = task


def _found_by(future: Future[list[Outcome]], task: Task, workers: Workers, waiting: deque[Task]) -> list[Outcome]:
    """What came of a task. Where its worker ended its runs wait again, or the one that it was is named."""
    try:
        return future.result()
    except workers.deaths:
        if len(task.runs) == 1 and task.deaths + 1 >= MOST_DEATHS:
            why = f"{MOST_DEATHS} workers ended while they judged it: killed, out of memory, or by a defect of cmmlink"
            return [Outcome(task.runs[0].run, failure=Failure("defect", why))]
        waiting.extendleft(reversed(task.apart()))
        return []
