"""Keeping a link up: what every source does when its link is lost.

A lost link is opened again after 0.1 s, 0.2 s, ... up to 2 s between two tries, for as long as the plan allows;
the run goes on with the gap marked. The link counts as up again with the first thing that arrives over it.
"""

import threading
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from typing import TypeVar

from drivers.errors import LinkError
from drivers.source import Arrival, LinkDown, LinkUp

FIRST_WAIT_S = 0.1
LONGEST_WAIT_S = 2.0

Link = TypeVar("Link")


def keep_up(
    open_link: Callable[[], AbstractContextManager[Link]],
    scan: Callable[[Link], Iterator[Arrival]],
    *,
    reconnect_s: float,
    stopped: threading.Event,
    clock: Callable[[], float],
) -> Iterator[Arrival]:
    """Yield what `scan` yields over the link that `opened` opens, again and again while either raises `LinkError`.

    Give up, with the last `LinkError`, when nothing has arrived for `reconnect_s` seconds; 0: at the first one.
    """
    down_since_s: float | None = None
    wait_s = FIRST_WAIT_S
    while not stopped.is_set():
        try:
            with open_link() as link:
                for arrival in scan(link):
                    if down_since_s is not None:
                        yield LinkUp(clock() - down_since_s)
                        down_since_s, wait_s = None, FIRST_WAIT_S
                    yield arrival
                return
        except LinkError as error:
            if reconnect_s <= 0:
                raise
            if down_since_s is None:
                down_since_s = clock()
                yield LinkDown(str(error))
            if clock() - down_since_s + wait_s > reconnect_s:
                raise LinkError(f"{error}; tried again in vain for {reconnect_s:g} s") from error
        stopped.wait(wait_s)
        wait_s = min(2 * wait_s, LONGEST_WAIT_S)
