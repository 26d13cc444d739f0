"""The RF60x's input registers, against the example of its manual: 02A5h of a 50 mm sensor is 2.066 mm."""

import numpy as np

from simulators.devices.riftek_registers import RiftekRegisters
from simulators.faults import Injector
from simulators.motion import Walk


def test_the_value_register_follows_the_distance() -> None:
    points_mm = np.array([[0.0, 2.066, 0.0], [0.1, 50.0, 0.0], [0.2, 70.0, 0.0]])
    device = RiftekRegisters(Walk(np.arange(3) / 100.0, points_mm), Injector([], seed=1), swapped=False)
    device.take(1)
    assert device.read(4, 6, 1).tolist() == [0x02A5]
    assert not device.done
    device.take(2)
    assert device.read(4, 5, 2).tolist() == [50, 16384]
    device.take(3)
    assert device.read(4, 6, 1).tolist() == [16384]  # a target behind the range reads as its end
    assert device.done
    assert device.read(3, 6, 1).tolist() == [0]  # holding registers hold nothing
