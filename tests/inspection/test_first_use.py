"""Values made on first use: once, whoever asks first, and never half made."""

from concurrent.futures import ThreadPoolExecutor
from threading import Barrier, Event

import pytest

from inspection.first_use import OnFirstUse


def test_nothing_is_made_before_it_is_asked_for() -> None:
    made: list[int] = []

    def make() -> int:
        made.append(7)
        return 7

    value = OnFirstUse(make)
    assert not made
    assert (value.value, value.value, made) == (7, 7, [7])


def test_threads_that_ask_at_once_get_one_value_made_once() -> None:
    together, begun, made = Barrier(8), Event(), []

    def make() -> object:
        made.append(1)
        begun.wait(0.05)  # time for the others to come in; nobody sets it
        return object()

    value = OnFirstUse(make)

    def ask(_: int) -> object:
        together.wait()
        return value.value

    with ThreadPoolExecutor(8) as pool:
        given = list(pool.map(ask, range(8)))
    assert len(made) == 1
    assert all(one is given[0] for one in given)


def test_a_value_that_cannot_be_made_says_so_every_time() -> None:
    tries: list[int] = []

    def make() -> int:
        tries.append(1)
        if len(tries) < 3:
            raise ValueError("not yet")
        return 7

    value = OnFirstUse(make)
    for _ in range(2):
        with pytest.raises(ValueError, match="not yet"):
            _ = value.value
    assert value.value == 7
