"""Distances and axis positions to points, against closed forms."""

from collections.abc import Iterator, Sequence

import numpy as np
import pytest

from drivers.errors import LinkError, ProtocolError
from drivers.links.axis import Beam, ConstantFeed, Delivery, FollowedAxis, merge
from drivers.source import Arrival, Damaged, Lost, PointBatch, ScanClosed, WireBytes
from tests.drivers.codecs.streams import account

BEAM = Beam(origin_mm=(1.0, 2.0, 3.0), distance_direction=(0.0, -1.0, 0.0), axis_direction=(0.6, 0.0, 0.8))

ALONG_X = Beam((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0))


def deliveries(axis: Sequence[Arrival], sensor: Sequence[Arrival]) -> list[Delivery]:
    """Say all of the axis, then all of the sensor, then the sensor's end: threads would make it another order each time."""
    return [*(Delivery(True, said) for said in axis), *(Delivery(False, said) for said in sensor), Delivery(False, None)]


class Listed:
    """A source that says what it was given."""

    def __init__(self, arrivals: list[Arrival | Exception]) -> None:
        self._arrivals = arrivals

    def arrivals(self) -> Iterator[Arrival]:
        for arrival in self._arrivals:
            if isinstance(arrival, Exception):
                raise arrival
            yield arrival

    def stop(self) -> None:
        self._arrivals = []


def batch(first: int, times_s: list[float], values: list[float], column: int) -> PointBatch:
    points_mm = np.zeros((len(values), 3))
    points_mm[:, column] = values
    return PointBatch(first + np.arange(len(values)), np.array(times_s), points_mm)


def test_constant_feed() -> None:
    sensor = Listed([batch(0, [5.0, 5.5], [10.0, 11.0], 2), Lost(1, "gap"), batch(3, [6.5], [12.0], 2), ScanClosed(None)])
    book = account(ConstantFeed(sensor, BEAM, speed_mm_s=10.0).arrivals())
    np.testing.assert_allclose(book.points_mm, [[1, -8, 3], [1 + 3, -9, 3 + 4], [1 + 9, -10, 3 + 12]])
    assert (book.sequence, book.lost, book.others) == ([0, 1, 3], 1, [ScanClosed(None)])


def test_a_sensor_without_a_clock_cannot_be_placed_by_a_constant_feed() -> None:
    sensor = Listed([batch(0, [0.0], [10.0], 2), batch(1, [0.0], [11.0], 2)])
    with pytest.raises(ProtocolError, match="clock stands still"):
        list(ConstantFeed(sensor, BEAM, speed_mm_s=10.0).arrivals())


def test_what_the_axis_lost_is_not_what_the_sensor_lost() -> None:
    axis: list[Arrival] = [WireBytes(100.0, b"axis"), Lost(7, "gap"), Damaged(3, "noise"), batch(0, [0.0], [0.0], 0)]
    sensor: list[Arrival] = [WireBytes(100.0, b"sensor"), batch(0, [1.0], [1.0], 2), ScanClosed(1)]
    book = account(merge(deliveries(axis, sensor), BEAM))
    assert dict(book.counts) == {("Damaged", "noise"): 3, ("WireBytes", ""): 6}
    assert len(book.points_mm) == 1


def test_a_direction_must_be_a_unit_vector() -> None:
    with pytest.raises(ValueError, match="axis direction"):
        Beam((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), (1.0, 1.0, 0.0))


def test_positions_of_a_second_source_are_interpolated_and_never_extrapolated() -> None:
    """The axis moves at 4 mm/s from clock time 100; the sensor's clock runs from elsewhere, its last point of a batch is now."""
    axis: list[Arrival] = [WireBytes(100.0 + i, b"") if k == 0 else batch(i, [0.0], [4.0 * i], 0) for i in range(6) for k in range(2)]
    sensor: list[Arrival] = [WireBytes(101.0, b""), batch(0, [7.0, 8.5], [1.0, 2.0], 2), WireBytes(103.5, b""), batch(2, [11.0], [3.0], 2)]
    book = account(merge(deliveries(axis, sensor), ALONG_X))
    assert book.points_mm == [(4.0 * 1.0, 0.0, 2.0), (4.0 * 3.5, 0.0, 3.0)]
    assert book.counts["Rejected", "taken before the axis told its position"] == 1


def test_points_without_a_later_position_are_rejected() -> None:
    axis: list[Arrival] = [WireBytes(100.0, b""), batch(0, [0.0], [0.0], 0), WireBytes(101.0, b""), batch(1, [1.0], [5.0], 0)]
    sensor: list[Arrival] = [
        WireBytes(100.5, b""),
        batch(0, [1.0], [1.0], 2),
        WireBytes(102.0, b""),
        batch(1, [2.5], [1.0], 2),
        ScanClosed(2),
    ]
    book = account(merge(deliveries(axis, sensor), ALONG_X))
    assert book.points_mm == [(2.5, 0.0, 1.0)]
    assert book.counts["Rejected", "taken after the axis last told its position"] == 1
    assert book.others == [ScanClosed(2)]


def test_two_threads_deliver_and_end() -> None:
    axis: list[Arrival | Exception] = [WireBytes(0.0, b""), batch(0, [0.0, 100.0], [0.0, 100.0], 0)]
    sensor: list[Arrival | Exception] = [WireBytes(0.0, b""), batch(0, [0.0], [1.0], 2), LinkError("unplugged")]
    source = FollowedAxis(Listed(sensor), Listed([*axis, LinkError("unplugged")]), BEAM)
    with pytest.raises(LinkError, match="unplugged"):
        list(source.arrivals())


def test_an_axis_that_ends_too_early_is_a_lost_link() -> None:
    forever: list[Arrival | Exception] = [WireBytes(0.0, b"")] * 100
    source = FollowedAxis(Listed([*forever, LinkError("axis gone, sensor stopped")]), Listed([]), BEAM)
    with pytest.raises(LinkError, match="axis"):
        list(source.arrivals())
