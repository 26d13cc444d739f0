"""Counters against a model that knows what was sent."""

from hypothesis import given
from hypothesis import strategies as st

from drivers.codecs.sequence import CONTENTS_REMEMBERED, Place, SequenceCounter


def test_in_order_nothing_is_lost() -> None:
    counter = SequenceCounter(8)
    assert [counter.place(i % 8) for i in range(20)] == [Place(i, 0, repeated=False) for i in range(20)]


def test_gap_late_and_repeated() -> None:
    counter = SequenceCounter(256)
    counter.place(0)
    assert counter.place(4) == Place(4, 3, repeated=False)
    assert counter.place(2) == Place(2, -1, repeated=False)
    assert counter.place(2) == Place(2, 0, repeated=True)
    assert counter.place(4) == Place(4, 0, repeated=True)
    assert counter.place(1) == Place(1, -1, repeated=False)


def test_a_gap_longer_than_the_counter_needs_a_hint() -> None:
    counter = SequenceCounter(256)
    counter.place(0)
    assert counter.place(1000 % 256, near=1003) == Place(1000, 999, repeated=False)


def test_reach_counts_the_tail_once() -> None:
    counter = SequenceCounter(65536)
    counter.place(0)
    assert counter.reach(5) == 4
    assert counter.reach(5) == 0
    assert counter.place(3) == Place(3, -1, repeated=False)


def test_a_repetition_is_told_from_another_frame_with_an_old_number() -> None:
    counter = SequenceCounter(65536)
    counter.take([10, 11, 12])
    assert counter.place(5, content=15) == Place(5, 2, repeated=False)
    assert counter.place(4, content=14) == Place(4, -1, repeated=False)
    for number, content in ((0, 10), (2, 12), (4, 14), (5, 15)):
        assert counter.place(number, content=content) == Place(number, 0, repeated=True, same=True)
        assert counter.place(number, content=99) == Place(number, 0, repeated=True, same=False)
    counter.take(range(2 * CONTENTS_REMEMBERED))
    assert counter.place(0, content=10) == Place(0, 0, repeated=True, same=False)  # too old to be known
    newest = counter.expected - 1
    assert counter.place(newest, content=2 * CONTENTS_REMEMBERED - 1).same


def test_a_late_frame_from_before_the_first_one_is_no_repetition() -> None:
    counter = SequenceCounter(256, first=18)
    counter.place(18, content=7)
    assert not counter.place(17, content=7).same


@given(st.lists(st.tuples(st.booleans(), st.booleans(), st.booleans()), max_size=300))
def test_received_and_lost_make_up_what_was_sent(fates: list[tuple[bool, bool, bool]]) -> None:
    """Each frame: lost?, repeated?, swapped with the next?"""
    order = [i for i, (lost, repeated, _) in enumerate(fates) if not lost for _ in range(1 + repeated)]
    for i in range(len(order) - 1):
        if fates[order[i]][2]:
            order[i], order[i + 1] = order[i + 1], order[i]
    counter = SequenceCounter(16)
    arrived, lost = [], 0
    hint = 0
    for number in order:
        place = counter.place(number % 16, near=number)
        hint = number
        assert place.sequence == number
        assert place.repeated == (number in arrived)
        lost += place.lost
        arrived += [] if place.repeated else [number]
    lost += counter.reach(len(fates) % 16, near=len(fates))
    assert hint <= len(fates)
    assert len(arrived) + lost == len(fates)
