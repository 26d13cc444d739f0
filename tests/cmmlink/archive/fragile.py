"""Judges for the tests: they load nothing of the inspection, and some end the process that they run in."""

import os
import time
from pathlib import Path

from cmmlink.archive.tasks import Failure, Outcome, Task


def judge_marked(task: Task) -> list[Outcome]:
    """Answer with the name of each run; one called `deadly` ends the process, and `once-...` does so the first time."""
    return [_answer(task.file, one.run) for one in task.runs]


def _answer(folder: Path, run: str) -> Outcome:
    if run == "deadly":
        os._exit(9)
    if run.startswith("once-") and not (mark := folder / run).exists():
        mark.touch()
        os._exit(9)
    return Outcome(run, failure=Failure("unusable", f"{run} at {os.getpid()}"))


def judge_forever(task: Task) -> list[Outcome]:
    """Tell the process in a file, and never answer."""
    (task.file / "pid").write_text(str(os.getpid()))
    while True:
        time.sleep(60)
