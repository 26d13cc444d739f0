"""What a run without a page does last: its results are pushed where the station's settings name a results database, within seconds.

It is a `cmmlink plant push` in a process of its own, as the console has one. Whatever becomes of it, the verdict, standard output and the
exit status of the run stay as they are, and what is not there by then waits in the records, which are the outbox.
"""

import json
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cmmlink.commands.exit_codes import say
from cmmlink.commands.output import stop_on_ctrl_c
from cmmlink.commands.progress import progress
from cmmlink.errors import PlantError

if TYPE_CHECKING:
    from cmmlink.record import RecordReference

_LONGEST_S, _LOOK_S = 6.0, 0.1


@contextmanager
def pushing_after(records: Path | None) -> Iterator[list["RecordReference | None"]]:
    """Push when this is left what was recorded while it was entered; who records puts into the list what ties each run to its record.

    records : the folder of the records; None records nothing
    """
    recorded: list[RecordReference | None] = []
    try:
        yield recorded
    except Exception:
        _push(records, recorded)
        raise
    _push(records, recorded)


def _push(records: Path | None, recorded: Sequence["RecordReference | None"]) -> None:
    """Push where there is something to push and a database is named, and say in one line what came of it."""
    runs = [one.run for one in recorded if one is not None]
    if records is None or not runs:
        return
    with suppress(OSError, ValueError):  # who reads the verdict waits for nothing
        sys.stdout.flush()
    from cmmlink.plant_push import named_address

    try:
        if named_address(records) is None:
            return
        with progress("pushing results"):
            told = _told_by_push(records)
    except (PlantError, OSError) as error:
        told = {"error": {"message": str(error)}}
    _say(told, runs)


def _told_by_push(records: Path) -> Mapping[str, Any]:
    """The answer of a process that pushes; it is ended when it takes too long, and by Ctrl-C. Raises OSError where none can be started."""
    from cmmlink.console.paper_process import BELOW_NORMAL, this_program

    command, quiet = this_program(["plant", "push", "--json", "--records", str(records)]), subprocess.DEVNULL
    until_s, answer = time.monotonic() + _LONGEST_S, b""
    with (
        stop_on_ctrl_c() as stop,
        subprocess.Popen(command, stdin=quiet, stdout=subprocess.PIPE, stderr=quiet, creationflags=BELOW_NORMAL) as child,
    ):
        while not answer and not stop.is_set() and time.monotonic() < until_s:
            with suppress(subprocess.TimeoutExpired):
                answer = child.communicate(timeout=_LOOK_S)[0] or b"{}"
        if not answer:
            child.kill()
    with suppress(ValueError):
        told = json.loads(answer)
        if isinstance(told, dict) and ("error" in told or "waiting" in told):
            return told
    why = "stopped by the operator" if stop.is_set() else f"nothing was answered within {_LONGEST_S:g} s" if not answer else "it failed"
    return {"error": {"message": why}}


def _say(told: Mapping[str, Any], runs: Sequence[str]) -> None:
    """Say where the results are, or why they wait; and what the runs have changed in the trends of their parts."""
    problem = told["error"]["message"] if "error" in told else told["problem"]
    if problem:
        say(f"kept in the outbox: {problem}; `cmmlink plant push` brings it there")
        return
    elsewhere = {name.rpartition(" ")[2] for name in told["others"]} | {one["run"] for one in told["unreadable"]}
    if elsewhere.intersection(runs):
        say(f"not pushed to {told['address']}: `cmmlink plant status` says why")
    else:
        say(f"pushed to {told['address']}")
    for one in told["alarms"]:
        whose = one["serial_number"] or one["run"]
        say(f"the process has changed: {one['part']} {whose}, {one['characteristic']}: {one['rule']}")
