from drivers.codecs.outbox import Outbox
from drivers.source import Arrival, Damaged, Heartbeat, Lost, Rejected


def test_what_was_collected_stands_before_what_happened_next() -> None:
    collected: list[Arrival] = [Damaged(1, "first"), Damaged(2, "second")]
    out = Outbox(lambda: collected.pop(0) if collected else None)
    out.append(Heartbeat())
    assert out.hand_over() == [Damaged(1, "first"), Heartbeat(), Damaged(2, "second")]
    assert out.hand_over() == []


def test_a_loss_is_named_by_its_gap_and_taken_back_by_a_late_arrival() -> None:
    out = Outbox()
    out.append_loss(3)
    out.append_loss(0)
    out.append_loss(2, "gap in the burst counter")
    out.append_loss(-1, "gap in the burst counter")
    assert out.hand_over() == [
        Lost(3, "gap in the sequence numbers"),
        Lost(2, "gap in the burst counter"),
        Lost(-1, "arrived late after all"),
    ]


def test_flushing_hands_nothing_over_twice() -> None:
    pending: list[Arrival | None] = [Rejected(1, "repeated"), None]
    out = Outbox(lambda: pending.pop(0) if pending else None)
    out.flush()
    out.flush()
    assert out.hand_over() == [Rejected(1, "repeated")]
