"""Pushes whenever the records have grown: what the console's pusher does, in a process of its own with the least urgency.

It knows of no run: it looks every two seconds whether the file of records was written to. So a run hands nothing over and waits for
nothing. After an attempt that failed it waits, each time twice as long, up to five minutes, give or take a fifth, so that the stations
of a plant do not all come at once when their server is back.
"""

import os
import random
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from datetime import datetime
from pathlib import Path

from cmmlink.plant_push.pushing import Outbox, push
from cmmlink.record import FILE_NAME

LOOK_S = 2.0
_FIRST_PAUSE_S, _LONGEST_PAUSE_S, _SPREAD = 5.0, 300.0, 0.2


def follow(
    folder: Path,
    tell: Callable[[Outbox], None],
    *,
    now: Callable[[], datetime],
    clock: Callable[[], float],
    wait: Callable[[float], bool],
    chance: Callable[[], float] = random.random,
) -> None:
    """Push until told to end.

    tell   : what came of an attempt, where that is news
    clock  : monotonic seconds
    wait   : waits so many seconds; True ends this
    chance : a number from 0 to 1, for the pauses

    Raises PlantError where the settings cannot be used, StoreError where the records cannot be read.
    """
    seen: object = None
    told: Outbox | None = None
    pause_s, not_before_s = 0.0, clock()
    while True:
        stamp = _stamp(folder)
        if clock() >= not_before_s and (stamp != seen or pause_s):
            outbox = push(folder, now)
            seen = stamp  # what was added meanwhile has changed it
            if outbox.added or told != outbox:
                tell(outbox)
            told = replace(outbox, added=0)
            pause_s = min(max(2 * pause_s, _FIRST_PAUSE_S), _LONGEST_PAUSE_S) if outbox.problem else 0.0
            not_before_s = clock() + pause_s * (1 + _SPREAD * (2 * chance() - 1))
        if wait(LOOK_S):
            return


def be_last_in_line() -> None:
    """Leave the processor to whatever else wants it: on Linux this process gets what nobody else needs, elsewhere less than others."""
    with suppress(OSError):
        getattr(os, "nice", int)(19)
    if hasattr(os, "SCHED_IDLE"):
        with suppress(OSError):
            os.sched_setscheduler(0, os.SCHED_IDLE, os.sched_param(0))


def _stamp(folder: Path) -> object:
    """What changes whenever something is recorded."""
    found = []
    for name in (FILE_NAME, f"{FILE_NAME}-wal"):
        try:
            told = os.stat(folder / name)
            found.append((told.st_mtime_ns, told.st_size))
        except OSError:
            found.append((0, 0))
    return found
