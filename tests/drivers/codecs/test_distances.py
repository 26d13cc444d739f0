import numpy as np
import pytest

from drivers.codecs.distances import JUMP, Distances
from drivers.source import Lost, PointBatch, Rejected, ScanClosed
from tests.drivers.codecs.streams import account


def distances(count: int | None = None, largest_step_mm: float | None = None) -> Distances:
    return Distances(lambda readings: readings / 100.0, gap="gap", count=count, largest_step_mm=largest_step_mm)


def test_a_distance_becomes_a_point_on_the_z_axis_at_the_time_of_its_reading() -> None:
    scan = distances()
    scan.take(0, 250, 12.5)
    scan.take(1, 260, 12.75)
    [batch] = scan.out.hand_over()
    assert isinstance(batch, PointBatch)
    assert batch.points_mm.tolist() == [[0.0, 0.0, 12.5], [0.0, 0.0, 12.75]]
    assert (batch.sequence.tolist(), batch.time_s.tolist()) == ([0, 1], [2.5, 2.6])


def test_a_loss_comes_before_the_distance_behind_it() -> None:
    scan = distances()
    scan.take(0, 0, 1.0)
    scan.take(4, 4, 1.0, lost=3)
    first, lost, second = scan.out.hand_over()
    assert lost == Lost(3, "gap")
    assert account([first]).sequence == [0]
    assert account([second]).sequence == [4]
    assert scan.expected == 5


def test_a_jump_is_rejected_and_the_next_distance_is_compared_with_it() -> None:
    scan = distances(largest_step_mm=0.5)
    for number, distance_mm in enumerate([1.0, 1.5, 2.1, 2.2, 1.0]):
        scan.take(number, number, distance_mm)
    book = account(scan.out.hand_over())
    assert [z for _, _, z in book.points_mm] == [1.0, 1.5, 2.2]
    assert book.counts == {("Rejected", JUMP): 2}


def test_a_value_that_is_no_distance_is_no_step() -> None:
    scan = distances(largest_step_mm=0.5)
    scan.take(0, 0, 1.0)
    scan.take(1, 1, None, refusal="no peak")
    scan.take(2, 2, 1.4)
    book = account(scan.out.hand_over())
    assert (book.sequence, book.counts) == ([0, 2], {("Rejected", "no peak"): 1})


@pytest.mark.parametrize("many", [True, False])
def test_many_at_once_are_the_same_as_one_by_one(many: bool) -> None:
    steps = np.random.default_rng(3).normal(0.0, 0.1, 200)
    distance_mm, readings = 20.0 + np.cumsum(steps), np.arange(0, 2000, 10)
    scan = distances(count=150, largest_step_mm=0.25)
    at = 0
    while at < len(distance_mm):
        good = scan.are_steady(distance_mm[at:]) if many else np.zeros(1, dtype=bool)
        run = scan.room(len(good) if good.all() else int(good.argmin())) if not scan.closed else 0
        if run:
            scan.take_many(readings[at : at + run], distance_mm[at : at + run])
            at += run
        else:
            scan.take(at, int(readings[at]), float(distance_mm[at]))
            at += 1
    book = account(scan.out.hand_over())
    jumps = np.flatnonzero(np.abs(np.diff(distance_mm[:150])) > 0.25) + 1
    assert len(jumps) >= 2
    assert book.sequence == [number for number in range(150) if number not in jumps]
    assert book.counts == {("Rejected", JUMP): len(jumps)}
    assert book.others == [ScanClosed(None)]


def test_the_end_of_the_scan_comes_once_and_nothing_after_it() -> None:
    scan = distances(count=2)
    for number in range(4):
        scan.take(number, number, 1.0)
    arrivals = scan.out.hand_over()
    assert arrivals[-1] == ScanClosed(None)
    assert len(account(arrivals).sequence) == 2
    assert not [arrival for arrival in arrivals if isinstance(arrival, Rejected)]
