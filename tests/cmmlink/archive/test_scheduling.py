"""Tasks are done whatever happens to workers: nothing is lost, nothing is done twice over, and who ends workers is named."""

from collections import Counter
from concurrent.futures import Future
from pathlib import Path
from threading import Event

import pytest

from cmmlink.archive import Here, Outcome, Processes, RunAsked, Task, judge_all
from cmmlink.archive.scheduling import Judge
from cmmlink.archive.tasks import MOST_POINTS, Failure, tasks_of
from tests.cmmlink.archive.fragile import judge_marked


def asked(*runs: str) -> tuple[RunAsked, ...]:
    return tuple(RunAsked(run, "") for run in runs)


def task(folder: Path, *runs: str) -> Task:
    return Task(folder, {}, asked(*runs))


def messages(outcomes: list[Outcome]) -> dict[str, str]:
    return {one.run: one.failure.message for one in outcomes if one.failure is not None}


def test_runs_are_shared_out_in_their_order_into_tasks_that_take_seconds() -> None:
    runs = [(RunAsked(str(k), ""), 50_000) for k in range(200)]
    shared = tasks_of(Path("f"), {}, runs, 2)
    assert [len(one.runs) for one in shared] == [25] * 8
    assert [one.run for each in shared for one in each.runs] == [str(k) for k in range(200)]
    assert [len(one.runs) for one in tasks_of(Path("f"), {}, runs[:10], 4)] == [3, 3, 3, 1]
    long = [(RunAsked(str(k), ""), MOST_POINTS // 2) for k in range(5)]
    assert [len(one.runs) for one in tasks_of(Path("f"), {}, long, 1)] == [2, 2, 1]
    assert tasks_of(Path("f"), {}, [], 2) == []


def test_a_killed_process_loses_nothing_and_a_run_that_kills_twice_is_named(tmp_path: Path) -> None:
    tasks = [task(tmp_path, "a", "once-b", "c"), task(tmp_path, "d", "deadly", "e"), task(tmp_path, "f", "g")]
    taken = list[Outcome]()
    with Processes(2) as workers:
        assert judge_all(tasks, workers, taken.extend, Event(), judge_marked) == 0
    assert Counter(one.run for one in taken) == Counter(["a", "once-b", "c", "d", "deadly", "e", "f", "g"])
    told = messages(taken)
    assert "2 workers ended while they judged it" in told["deadly"]
    assert all(told[run].startswith(f"{run} at ") for run in told if run != "deadly")


def test_what_was_begun_is_done_when_it_is_stopped_and_the_rest_is_left(tmp_path: Path) -> None:
    stop, taken = Event(), list[Outcome]()

    def take(outcomes: list[Outcome]) -> None:
        taken.extend(outcomes)
        stop.set()

    tasks = [task(tmp_path, f"{k}", f"{k}'") for k in range(5)]
    left = judge_all(tasks, Here(), take, stop, judge_marked)
    assert (len(taken), left) == (4, 6)  # one more was begun before the first was taken
    stop.clear()
    assert judge_all([], Here(), take, stop, judge_marked) == 0


class Dying:
    """Workers of whom each one ends a few times over, as a cluster tells it."""

    places, deaths = 3, (ConnectionError,)

    def __init__(self, deaths: int) -> None:
        self._left = deaths

    def submit(self, judge: Judge, task: Task) -> Future[list[Outcome]]:
        done: Future[list[Outcome]] = Future()
        if "deadly" in [one.run for one in task.runs] and self._left:
            self._left -= 1
            done.set_exception(ConnectionError("gone"))
        else:
            done.set_result([Outcome(one.run, failure=Failure("unusable", "done")) for one in task.runs])
        return done


@pytest.mark.parametrize(("deaths", "words"), [(1, "done"), (2, "2 workers ended")])
def test_each_run_of_a_task_is_done_again_by_itself(tmp_path: Path, deaths: int, words: str) -> None:
    taken = list[Outcome]()
    judge_all([task(tmp_path, "a", "deadly", "b"), task(tmp_path, "c")], Dying(deaths), taken.extend, Event(), judge_marked)
    told = messages(taken)
    assert sorted(told) == ["a", "b", "c", "deadly"]
    assert words in told["deadly"]
    assert {told[run] for run in ("a", "b", "c")} == {"done"}
