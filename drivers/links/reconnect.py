"""Keeping a link up: what every source does when its link is lost.

A lost link is opened again after 0.1 s, 0.2 s, ... up to 2 s between two tries, for as long as the plan allows;
the run goes on with the gap marked. The link counts as up again with the first news over it: bytes alone are none.
"""

import threading
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from math import inf
from typing import TypeVar

from drivers.errors import LinkError
from drivers.links.watch import is_news
from drivers.source import Arrival, LinkDown, LinkUp, ScanOpened

FIRST_WAIT_S = 0.1
LONGEST_WAIT_S = 2.0

Link = TypeVar("Link")


def keep_up(
    open_link: Callable[[float], AbstractContextManager[Link]],
    scan: Callable[[Link, float], Iterator[Arrival]],
    *,
    reconnect_s: float,
    stopped: threading.Event,
    clock: Callable[[], float],
) -> Iterator[Arrival]:
    """Yield what `scan` yields over the link that `open_link` opens, again and again while either raises `LinkError`.

    Both are told until when, by the clock, they may wait, for the link to open and for news. Give up, with the last `LinkError`, when
    there were none for `reconnect_s` seconds; 0: at the first one. What arrived over a link that brought no news is marked by a
    further `LinkDown`. A link that was told to stop before it was open raises nothing.
    """
    down_since_s: float | None = None
    wait_s = FIRST_WAIT_S
    while not stopped.is_set():
        heard, entered, opened = False, False, list[Arrival]()
        until_s = inf if down_since_s is None else down_since_s + reconnect_s
        try:
            with open_link(until_s) as link:
                entered = True
                for arrival in scan(link, until_s):
                    heard = True
                    if down_since_s is not None and is_news(arrival):
                        yield LinkUp(clock() - down_since_s)
                        down_since_s, wait_s = None, FIRST_WAIT_S
                    if down_since_s is not None and isinstance(arrival, ScanOpened):
                        yield from opened
                        opened = [arrival]  # it belongs behind the link's being up, if news follow
                        continue
                    yield from (*opened, arrival) if down_since_s is None else (arrival,)
                    opened = opened if down_since_s is not None else []
                return
        except LinkError as error:
            if stopped.is_set() and not entered:
                return
            if reconnect_s <= 0:
                raise
            yield from opened
            if heard or down_since_s is None:
                yield LinkDown(str(error))
            down_since_s = clock() if down_since_s is None else down_since_s
            if clock() - down_since_s + wait_s > reconnect_s:
                raise LinkError(f"{error}; tried again in vain for {reconnect_s:g} s") from error
        stopped.wait(wait_s)
        wait_s = min(2 * wait_s, LONGEST_WAIT_S)
