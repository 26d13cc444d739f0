"""The hand-over: bounded, in order, nothing dropped, and honest about its peak and its stalls."""

import threading

import pytest

from cmmlink.buffer import Buffer

PATIENCE_S = 30.0


def given_later(buffer: Buffer[int], results: list[bool], *gifts: tuple[int, int]) -> threading.Thread:
    """Give from another thread; the results are what `give` returned."""
    giver = threading.Thread(target=lambda: results.extend(buffer.give(item, size) for item, size in gifts), daemon=True)
    giver.start()
    return giver


def until_stalled(buffer: Buffer[int], giver: threading.Thread) -> None:
    """Return once the giver waits; a giver that never does fails by the test's time limit."""
    while not buffer.stalls:
        giver.join(0.001)
        assert giver.is_alive(), "the giver was not held"


def ended(thread: threading.Thread) -> None:
    thread.join(PATIENCE_S)
    assert not thread.is_alive()


def test_everything_comes_out_once_and_in_order() -> None:
    buffer: Buffer[int] = Buffer(100)
    assert all(buffer.give(item, 10) for item in range(5))
    assert buffer.take(0.0) == [0, 1, 2, 3, 4]
    assert buffer.take(0.0) == []


def test_waiting_and_peak_count_points_and_not_items() -> None:
    buffer: Buffer[int] = Buffer(100)
    for size in (30, 40, 0):
        buffer.give(0, size)
    assert (buffer.waiting, buffer.peak, buffer.stalls) == (70, 70, 0)
    buffer.take(0.0)
    buffer.give(0, 20)
    assert (buffer.waiting, buffer.peak, buffer.stalls) == (20, 70, 0)


def test_a_part_can_be_taken_and_the_rest_waits() -> None:
    buffer: Buffer[int] = Buffer(100)
    for item, size in enumerate((30, 40, 0, 20)):
        buffer.give(item, size)
    assert buffer.take(0.0, 31) == [0, 1]
    assert (buffer.waiting, buffer.peak) == (20, 90)
    assert buffer.take(0.0, 1000) == [2, 3]
    assert (buffer.waiting, buffer.take(0.0, 5)) == (0, [])


def test_exactly_full_is_not_a_stall() -> None:
    buffer: Buffer[int] = Buffer(100)
    buffer.give(0, 60)
    buffer.give(0, 40)
    assert (buffer.waiting, buffer.peak, buffer.stalls) == (100, 100, 0)


def test_a_full_buffer_holds_the_giver_until_something_is_taken() -> None:
    buffer: Buffer[int] = Buffer(10)
    given: list[bool] = []
    giver = given_later(buffer, given, (1, 10), (2, 1))
    until_stalled(buffer, giver)
    assert (given, buffer.waiting, buffer.peak, buffer.stalls) == ([True], 10, 10, 1)
    assert buffer.take(0.0) == [1]
    ended(giver)
    assert given == [True, True]
    assert buffer.take(0.0) == [2]
    assert (buffer.peak, buffer.stalls) == (10, 1)


def test_an_item_larger_than_the_buffer_passes_alone() -> None:
    buffer: Buffer[int] = Buffer(10)
    assert buffer.give(1, 25)
    assert (buffer.waiting, buffer.peak) == (25, 25)
    assert buffer.take(0.0) == [1]


def test_what_has_no_size_passes_a_full_buffer_in_order() -> None:
    buffer: Buffer[int] = Buffer(10)
    buffer.give(1, 10)
    assert buffer.give(2, 0)
    assert buffer.take(0.0) == [1, 2]


def test_close_lets_a_waiting_giver_go_and_refuses_from_then_on() -> None:
    buffer: Buffer[int] = Buffer(10)
    given: list[bool] = []
    giver = given_later(buffer, given, (1, 10), (2, 10))
    until_stalled(buffer, giver)
    buffer.close()
    ended(giver)
    assert given == [True, False]
    assert not buffer.give(3, 1)
    assert buffer.take(0.0) == [1]


def test_take_wakes_as_soon_as_something_comes() -> None:
    buffer: Buffer[int] = Buffer(10)
    given: list[bool] = []
    giver = given_later(buffer, given, (7, 1))
    assert buffer.take(PATIENCE_S) == [7]
    ended(giver)


def test_two_threads_hand_over_every_item_within_the_bound() -> None:
    buffer: Buffer[int] = Buffer(7)
    given: list[bool] = []
    giver = given_later(buffer, given, *((item, 1 + item % 3) for item in range(3000)))
    received: list[int] = []
    while len(received) < 3000:
        received += buffer.take(PATIENCE_S)
    ended(giver)
    assert received == list(range(3000))
    assert given == [True] * 3000
    assert buffer.waiting == 0
    assert 0 < buffer.peak <= 7


@pytest.mark.parametrize("capacity", [0, -1])
def test_a_buffer_that_holds_nothing_is_refused(capacity: int) -> None:
    with pytest.raises(ValueError, match=f"at least one point, not {capacity}"):
        Buffer(capacity)
