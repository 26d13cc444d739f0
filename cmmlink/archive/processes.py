"""Workers on this computer: this process itself, or processes of the standard library's pool."""

import multiprocessing
import os
import signal
import threading
from collections.abc import Iterator
from concurrent.futures import BrokenExecutor, Future, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import connection

from cmmlink.archive.scheduling import Judge
from cmmlink.archive.tasks import Outcome, Task


class Here:
    """No other process: the one that asks judges, one task after another."""

    places = 1
    deaths: tuple[type[BaseException], ...] = ()

    def submit(self, judge: Judge, task: Task) -> Future[list[Outcome]]:
        """Judge the runs of a task now."""
        done: Future[list[Outcome]] = Future()
        done.set_result(judge(task))
        return done


class Processes:
    """So many processes, each a pool of its own: where one is killed, it is known what it did, and the others go on.

    They know nothing of one another and end with this process, however that ends.
    """

    deaths: tuple[type[BaseException], ...] = (BrokenExecutor,)

    def __init__(self, count: int) -> None:
        self.places = count
        self._idle = [_pool() for _ in range(count)]
        self._busy: dict[Future[list[Outcome]], ProcessPoolExecutor] = {}

    def __enter__(self) -> "Processes":
        return self

    def __exit__(self, *_: object) -> None:
        self._take_back()
        for pool in (*self._idle, *self._busy.values()):
            pool.shutdown(wait=not self._busy, cancel_futures=True)

    def submit(self, judge: Judge, task: Task) -> Future[list[Outcome]]:
        """Let a process that is idle judge the runs of a task. There has to be one: fewer tasks are begun than there are processes."""
        self._take_back()
        pool = self._idle.pop()
        with _deaf_to_ctrl_c():
            try:
                future = pool.submit(judge, task)
            except BrokenExecutor:  # it was killed while it was idle
                pool.shutdown(wait=False)
                pool = _pool()
                future = pool.submit(judge, task)
        self._busy[future] = pool
        return future

    def _take_back(self) -> None:
        for future in [future for future in self._busy if future.done()]:
            pool = self._busy.pop(future)
            if not future.cancelled() and isinstance(future.exception(), BrokenExecutor):
                pool.shutdown(wait=False)
                pool = _pool()
            self._idle.append(pool)


def _pool() -> ProcessPoolExecutor:
    """One process, which starts with its first task. It is started anew rather than split off: threads of this one hold locks."""
    return ProcessPoolExecutor(1, multiprocessing.get_context("spawn"), _begin_to_work)


def _begin_to_work() -> None:
    """Ctrl-C is the business of the process that takes the results; a worker ends when that one does."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, name="end with parent", daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        connection.wait([parent.sentinel])
        os._exit(1)


@contextmanager
def _deaf_to_ctrl_c() -> Iterator[None]:
    """While this is entered, Ctrl-C is ignored, as it is then by a process that is started: also before that has come to say so."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
