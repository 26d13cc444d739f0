"""Other processes that answer questions, while this one does what comes before and beside them.

A process answers one question at a time. It ends with this one, however that ends: nothing comes through its pipe any more. What it has
not answered is left to the one that asked, which comes to the same answer by itself, or to the error that it tells of.
"""

import os
import pickle
import signal
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack, closing, suppress
from pathlib import Path
from queue import SimpleQueue
from threading import Lock, Semaphore
from typing import Any

_MOST_PROCESSES = 4  # each holds a hundred megabytes
_WAITING = 2  # questions for each process, so that a stack of thousands does not fill the memory with them
_CHILD = "import sys; sys.path.append(sys.argv[1]); from importlib import import_module; import_module(sys.argv[2]).serve()"


def processes_here() -> int:
    """How many processes can work at once on this computer; none on one with a single core, where nothing runs beside."""
    cores = os.cpu_count() or 1
    return min(cores, _MOST_PROCESSES) if cores > 1 else 0


class OtherProcesses:
    """So many processes, each with a thread that waits for it. Raises OSError where the system starts none.

    serving : the file whose `serve` they run, which calls `answer_all`
    """

    def __init__(self, count: int, serving: str) -> None:
        with ExitStack() as opened:
            self._threads = ThreadPoolExecutor(count)
            opened.callback(self._threads.shutdown)  # the threads end once their processes have
            self._idle: SimpleQueue[_Process | None] = SimpleQueue()
            for _ in range(count):
                self._idle.put(opened.enter_context(closing(_Process(serving))))
            opened.callback(self._threads.shutdown, wait=False, cancel_futures=True)
            self._left, self._counted = count, Lock()
            self._room = Semaphore((1 + _WAITING) * count)
            self._opened = opened.pop_all()

    def ask(self, question: object) -> "Future[Any]":
        """Ask one of the processes, once one is free. Gives its answer, None where that failed; waits while too many wait."""
        self._room.acquire()
        answer = self._threads.submit(self._ask, question)
        answer.add_done_callback(lambda _: self._room.release())
        return answer

    def _ask(self, question: object) -> Any:
        process = self._idle.get()
        if process is None:  # all have ended, which every thread has to see
            self._idle.put(None)
            return None
        answer = process.ask(question)
        if not process.ended:
            self._idle.put(process)
            return answer
        with self._counted:
            self._left -= 1
            if not self._left:
                self._idle.put(None)
        return None

    def close(self) -> None:
        """End the processes; what was not answered is left."""
        self._opened.close()


class _Process:
    """A process that answers what comes through its pipe. It knows nothing of the program that started it, least of all its main script."""

    def __init__(self, serving: str) -> None:
        command = [sys.executable, "-P", "-c", _CHILD, str(Path(__file__).resolve().parents[1]), serving]
        self._child = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
        self.ended = False

    def ask(self, question: object) -> Any:
        """Ask, and wait for the answer; None where there is none, for which the process may have `ended`."""
        assert self._child.stdin is not None
        assert self._child.stdout is not None
        try:
            self._child.stdin.write(pickle.dumps(question))
            self._child.stdin.flush()
            return pickle.load(self._child.stdout)
        except (
            OSError,
            ValueError,
            EOFError,
            pickle.UnpicklingError,
        ):  # it was ended, or its pipes closed
            self.ended = True
            return None

    def close(self) -> None:
        self._child.kill()
        self._child.wait()
        for pipe in (self._child.stdin, self._child.stdout):
            assert pipe is not None
            with suppress(OSError):  # what was still to be sent has no receiver any more
                pipe.close()


def answer_all(begin: Callable[[], Callable[[Any], object]]) -> None:
    """Run as the other process: answer what comes, until the pipe closes. Ctrl-C is the business of the one that waits for the answers.

    begin : makes what answers, before the first question comes
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    asked, told = sys.stdin.buffer, os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what libraries print must not get among the answers
    answer = begin()
    with suppress(EOFError, OSError):
        while True:
            question = pickle.load(asked)
            told.write(_answer_to(question, answer))
            told.flush()


def _answer_to(question: object, answer: Callable[[Any], object]) -> bytes:
    try:
        return pickle.dumps(answer(question))
    except Exception:  # whatever it is, the process that asked meets it again and tells of it
        return pickle.dumps(None)
