"""The process that pushes the results of every run to the plant's database, and what pages and alarms are told of it.

It is a `cmmlink plant push --stay` with the least urgency, which looks at the file of records by itself: a run hands nothing over to it
and waits for nothing. It ends with the console: nothing comes through its standard input any more.
"""

import json
import subprocess
import threading
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from datetime import datetime
from pathlib import Path
from typing import Any

from cmmlink.console.alarms import Alarms
from cmmlink.console.paper_process import BELOW_NORMAL, this_program
from cmmlink.console.protocol import ResultsState
from cmmlink.console.refused import without_folders
from cmmlink.record import FILE_NAME
from cmmlink.words import local_words

_PAUSE_S = 60.0  # before a process that ended is started again: its settings may have been mended
_LOOK_S, _ENDS_S = 2.0, 5.0


class PushedResults:
    """What was pushed, and what waits. Written by one thread; readers of `state` take the newest and wait for nobody."""

    def __init__(self, alarms: Alarms) -> None:
        self._alarms = alarms
        self._is_late, self._known = False, set[str]()
        self.state = ResultsState("", 0, "", "", 0)

    def hear(self, told: Mapping[str, Any]) -> None:
        """Take an answer of the process: an outbox, or why it cannot work."""
        if "error" in told:
            self._fail(str(told["error"]["message"]))
            return
        since = local_words(datetime.fromisoformat(told["since"])) if told["since"] else ""
        problem = without_folders(told["problem"] or "")
        self.state = ResultsState(_without_folder(told["address"]), told["waiting"], since, problem, self.state.added + told["added"])
        for one in told["alarms"]:
            whose = one["serial_number"] or one["run"]
            self._alarms.raise_alarm("warning", "The process has changed", f"{one['characteristic']} ({whose}): {one['rule']}")
        if told["late"] and not self._is_late:
            self._alarms.raise_alarm("warning", "Results wait to be pushed", f"since {since}: {problem}")
        self._is_late = told["late"]
        for run in (*(one["run"] for one in told["unreadable"]), *told["others"]):
            if run not in self._known:
                self._known.add(run)
                self._alarms.raise_alarm("warning", "The results of a run are not pushed", f"{run}: `cmmlink plant status` says why")

    def _fail(self, problem: str) -> None:
        problem = without_folders(problem)
        if self.state.problem != problem:
            self._alarms.raise_alarm("warning", "Results cannot be pushed", problem)
        self.state = ResultsState(self.state.address, self.state.waiting, self.state.since, problem, self.state.added)


def _without_folder(address: str) -> str:
    """An address as a page is shown it: of a file its name alone."""
    return address if "://" in address else Path(address).name


@contextmanager
def pushing(records: Path | None, pushed: PushedResults, pause_s: float = _PAUSE_S) -> Iterator[None]:
    """While this is entered, another process pushes the results of the records in a folder; None: none does."""
    if records is None:
        yield
        return
    ended = threading.Event()
    thread = threading.Thread(target=_keep_pushing, args=(records, pushed, ended, pause_s), name="results", daemon=True)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join(2 * _ENDS_S)


def _keep_pushing(records: Path, pushed: PushedResults, ended: threading.Event, pause_s: float) -> None:
    """Run the process, and start it again after a pause where it ended by itself."""
    command = this_program(["plant", "push", "--stay", "--json", "--records", str(records)])
    while not (records / FILE_NAME).exists():  # nothing was recorded yet
        if ended.wait(_LOOK_S):
            return
    while not ended.is_set():
        with suppress(OSError):  # the system starts no process just now
            _push_once(command, pushed, ended)
        ended.wait(pause_s)


def _push_once(command: Sequence[str], pushed: PushedResults, ended: threading.Event) -> None:
    """Hear what one process tells, until it ends or has to."""
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=subprocess.DEVNULL, text=True, creationflags=BELOW_NORMAL) as child:
        threading.Thread(target=_end_with, args=(child, ended), name="end of results", daemon=True).start()
        assert child.stdout is not None
        for line in child.stdout:
            with suppress(ValueError, KeyError, TypeError):  # a line that was cut off when the process was killed
                pushed.hear(json.loads(line))


def _end_with(child: "subprocess.Popen[str]", ended: threading.Event) -> None:
    """Close the standard input of a process once it has to end; kill it where it does not. Returns when it has ended by itself, too."""
    while not ended.wait(0.2):
        if child.poll() is not None:
            return
    assert child.stdin is not None
    with suppress(OSError):
        child.stdin.close()
    try:
        child.wait(_ENDS_S)
    except subprocess.TimeoutExpired:
        child.kill()
