import numpy as np

from drivers.codecs.outbox import NO_PART, NO_TIME, Outbox
from drivers.source import Arrival, Damaged, Heartbeat, Lost, PointBatch, Rejected, ScanClosed


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


def test_a_point_that_no_part_can_have_is_rejected_where_it_arrives() -> None:
    outbox = Outbox()
    points_mm = np.zeros((6, 3))
    points_mm[[0, 2, 3], [0, 1, 2]] = np.nan, 1.1e6, -np.inf
    time_s = np.zeros(6)
    time_s[[3, 4]] = np.inf
    outbox.append(PointBatch(np.arange(6), time_s, points_mm))
    rejected, untimed, batch = outbox.hand_over()
    assert (rejected, untimed) == (Rejected(3, NO_PART), Rejected(1, NO_TIME))
    assert isinstance(batch, PointBatch)
    assert batch.sequence.tolist() == [1, 5]


def test_the_end_of_the_scan_is_the_last_thing() -> None:
    outbox = Outbox()
    outbox.append(ScanClosed(1))
    outbox.append(Rejected(1, "late"))
    assert outbox.hand_over() == [ScanClosed(1)]
    assert outbox.hand_over() == []
