"""The generic ring and queue against registers written by hand from their maps' description."""

from binascii import crc_hqx

import numpy as np
import pytest
from numpy.typing import NDArray

from simulators.devices.modbus_generic import FIFO_DEPTH, FifoDevice, RingDevice
from simulators.faults import Fault, Injector
from simulators.motion import Walk

POINTS_MM = np.array([[1.5, -2.25, 0.125], [0.0, 0.00001, -1.0], [3.0, 4.0, 5.0]])
ENTRY_0 = [0, 0x0000, 0x05DC, 0x0002, 0x49F0, 0xFFFC, 0x9118, 0x0000, 0x30D4]  # number 0, 1500 us, then 150000, -225000, 12500


def walk(points_mm: NDArray[np.float64] = POINTS_MM) -> Walk:
    return Walk(0.0015 + 0.001 * np.arange(len(points_mm), dtype=np.float64), points_mm)


def sealed(words: list[int]) -> list[int]:
    return [*words, crc_hqx(np.array(words, dtype=">u2").tobytes(), 0xFFFF)]


def ring(*faults: str) -> RingDevice:
    return RingDevice(walk(), Injector([Fault.parse(text) for text in faults], seed=1), swapped=False)


def test_golden_registers_of_an_entry_and_of_the_status() -> None:
    device = ring()
    device.take(1)
    assert device.read(3, 100, 11).tolist() == sealed([*ENTRY_0, 0])
    status = [0x434D, 0x4D31, 0, 1, 1, 0, 0, 0, 3, 0, 1]
    assert device.read(3, 0, 12).tolist() == sealed(status)
    device.take(3)
    assert device.read(3, 4, 1).tolist() == [2]
    assert device.done


def test_a_swapped_ring_holds_the_low_halves_first() -> None:
    device = RingDevice(walk(), Injector([], seed=1), swapped=True)
    device.take(1)
    assert device.read(3, 101, 4).tolist() == [0x05DC, 0x0000, 0x49F0, 0x0002]


def test_a_ring_is_written_over_after_500_points() -> None:
    device = RingDevice(walk(np.zeros((502, 3))), Injector([], seed=1), swapped=False)
    device.take(502)
    assert device.read(3, 100, 1).tolist() == [500]
    assert device.read(3, 100 + 11 * 2, 1).tolist() == [2]


def test_faults_of_registers_show_in_the_registers() -> None:
    device = ring("sentinel:1", "invalid:1")
    device.take(1)
    entry = device.read(3, 100, 11).tolist()
    assert entry[5:7] == [0x8000, 0x0000]
    assert entry[9] == 1


def test_the_queue_hands_its_oldest_points_over_once() -> None:
    device = FifoDevice(walk(), Injector([], seed=1), swapped=False)
    device.take(3)
    handed = device.take_fifo(100).tolist()
    assert len(handed) == 30
    assert handed[:10] == sealed(ENTRY_0)
    assert device.take_fifo(100).tolist() == []
    assert device.take_fifo(7).tolist() == []


@pytest.mark.parametrize(("waiting", "first"), [(FIFO_DEPTH, 0), (FIFO_DEPTH + 5, 5)])
def test_points_that_found_no_room_in_the_queue_are_lost_and_told(waiting: int, first: int) -> None:
    device = FifoDevice(walk(np.zeros((400, 3))), Injector([], seed=1), swapped=False)
    device.take(waiting)
    assert device.take_fifo(100)[0] == first
    assert device.read(3, 5, 1).tolist() == [int(first > 0)]
