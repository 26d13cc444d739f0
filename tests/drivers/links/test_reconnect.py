"""Back-off and resumption with a clock of our own."""

import threading
from collections.abc import Iterator
from contextlib import nullcontext

import pytest

from drivers.errors import LinkError, ProtocolError
from drivers.links.reconnect import keep_up
from drivers.source import Arrival, Damaged, Heartbeat, LinkDown, LinkUp, Lost, Rejected, ScanClosed, ScanOpened, WireBytes


class Waits(threading.Event):
    """An event that never waits but notes how long it should have, and moves its own clock."""

    def __init__(self) -> None:
        super().__init__()
        self.now_s = 0.0
        self.waits_s: list[float] = []

    def wait(self, timeout: float | None = None) -> bool:
        self.waits_s.append(timeout or 0.0)
        self.now_s += timeout or 0.0
        return self.is_set()


def run(opens: list[bool], scans: list[list[Arrival | Exception]], reconnect_s: float, stopped: Waits) -> Iterator[Arrival]:
    tries, links = iter(opens), iter(scans)

    def opened(until_s: float) -> nullcontext[int]:
        if not next(tries):
            raise LinkError("no such port")
        return nullcontext(1)

    def scan(_: int, until_s: float) -> Iterator[Arrival]:
        for arrival in next(links):
            if isinstance(arrival, Exception):
                raise arrival
            yield arrival

    return keep_up(opened, scan, reconnect_s=reconnect_s, stopped=stopped, clock=lambda: stopped.now_s)


DATA, END = WireBytes(0.0, b"x"), ScanClosed(1)


def test_without_reconnection_the_first_loss_ends_it() -> None:
    arrivals = run([True], [[DATA, LinkError("gone")]], 0.0, Waits())
    assert next(arrivals) == DATA
    with pytest.raises(LinkError, match=r"^gone$"):
        next(arrivals)


def test_a_lost_link_comes_back_with_the_gap_marked() -> None:
    stopped = Waits()
    arrivals = list(run([True, False, False, True], [[DATA, LinkError("gone")], [DATA, END]], 60.0, stopped))
    assert stopped.waits_s == [0.1, 0.2, 0.4]
    assert [type(arrival) for arrival in arrivals] == [WireBytes, LinkDown, WireBytes, LinkUp, ScanClosed]
    assert isinstance(arrivals[3], LinkUp)
    assert arrivals[3].gap_s == pytest.approx(0.7)


def test_the_wait_grows_to_two_seconds_and_the_patience_ends() -> None:
    stopped = Waits()
    arrivals = run([True] + 30 * [False], [[DATA, LinkError("gone")]], 10.0, stopped)
    assert [next(arrivals), next(arrivals)] == [DATA, LinkDown("gone")]
    with pytest.raises(LinkError, match="no such port; tried again in vain for 10 s"):
        next(arrivals)
    assert stopped.waits_s == [0.1, 0.2, 0.4, 0.8, 1.6, 2.0, 2.0, 2.0]


def test_a_link_over_which_nothing_arrives_is_not_up() -> None:
    stopped = Waits()
    arrivals = list(run(4 * [True], [[DATA, LinkError("gone")], [LinkError("silent")], [LinkError("silent")], [END]], 60.0, stopped))
    assert [type(arrival) for arrival in arrivals] == [WireBytes, LinkDown, LinkUp, ScanClosed]


def test_a_link_that_was_never_there_is_tried_again_too() -> None:
    assert list(run([False, True], [[END]], 5.0, Waits())) == [LinkDown("no such port"), LinkUp(0.1), END]


def test_stop_ends_the_waiting() -> None:
    stopped = Waits()
    arrivals = run([True], [[DATA, LinkError("gone")]], 60.0, stopped)
    assert [next(arrivals), next(arrivals)] == [DATA, LinkDown("gone")]
    stopped.set()
    assert list(arrivals) == []


def test_a_wrong_protocol_is_not_tried_again() -> None:
    with pytest.raises(ProtocolError):
        list(run([True], [[ProtocolError("not this device")]], 60.0, Waits()))


@pytest.mark.parametrize("chatter", [DATA, Damaged(1, "junk"), ScanOpened("d", "1", 3), Rejected(1, "frame repeated"), Lost(0, "gap")])
def test_a_link_over_which_no_point_comes_is_given_up_whatever_else_does(chatter: Arrival) -> None:
    stopped = Waits()
    said: list[Arrival | Exception] = [chatter, LinkError("closed")]
    arrivals = run(1000 * [True], 1000 * [said], 10.0, stopped)
    with pytest.raises(LinkError, match="closed; tried again in vain for 10 s"):
        list(arrivals)
    assert stopped.now_s <= 10.0


@pytest.mark.parametrize("news", [Heartbeat(), Rejected(1, "marked invalid by the device"), END])
def test_news_ends_an_outage(news: Arrival) -> None:
    arrivals = list(run([True, True], [[DATA, LinkError("gone")], [DATA, news]], 10.0, Waits()))
    assert [type(arrival) for arrival in arrivals] == [WireBytes, LinkDown, WireBytes, LinkUp, type(news)]
