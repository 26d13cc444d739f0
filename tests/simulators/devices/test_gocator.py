"""The Gocator's registers as its manual lays them out, read as any client would."""

import numpy as np

from simulators.devices.gocator import FIRST_FRAME, Gocator
from simulators.faults import Fault, Injector
from simulators.motion import Walk

POINTS_MM = np.array([[1.0, -0.25, 0.0], [2.0, 0.5, 0.0], [3.0, 0.75, 0.0]])


def gocator(*faults: str) -> Gocator:
    scan = Walk(np.array([0.0, 0.0005, 0.001]), POINTS_MM)
    return Gocator(scan, Injector([Fault.parse(text) for text in faults], seed=1), swapped=False)


def test_reading_register_976_takes_the_oldest_message_and_nothing_else_does() -> None:
    device = gocator()
    device.take(2)
    assert device.read(3, 977, 1).tolist() == [2]
    assert device.read(3, 976, 2).tolist() == [0, 1]
    for _ in range(2):
        assert device.read(3, 988, 4).tolist() == [0, 0, 0, 1000]  # the encoder, 1 um a tick
        assert device.read(3, 996, 4).tolist() == [0, 0, 0, FIRST_FRAME]
        assert device.read(3, 1000, 3).tolist() == [0xFFFF, 0xFF06, 1]  # -250 um, and its decision: good
    device.read(3, 976, 1)
    assert device.read(3, 988, 4).tolist() == [0, 0, 0, 2000]
    assert device.read(3, 977, 1).tolist() == [0]


def test_the_sensor_runs_until_its_queue_is_empty() -> None:
    device = gocator()
    device.take(3)
    assert device.read(3, 300, 1).tolist() == [1]
    for _ in range(3):
        device.read(3, 976, 1)
    assert device.read(3, 300, 1).tolist() == [0]
    assert device.done


def test_a_measurement_without_a_value_holds_the_manuals_sentinel() -> None:
    device = gocator("sentinel:1")
    device.take(1)
    device.read(3, 976, 1)
    assert device.read(3, 1000, 3).tolist() == [0x8000, 0x0000, 2]


def test_a_queue_that_ran_over_says_so_and_keeps_its_oldest() -> None:
    device = gocator("overflow:2@3")
    device.take(3)
    assert device.read(3, 977, 2).tolist() == [1, 1]
    device.read(3, 976, 1)
    assert device.read(3, 988, 4).tolist() == [0, 0, 0, 1000]
