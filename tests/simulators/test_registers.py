import numpy as np
import pytest

from simulators.faults import Injector
from simulators.motion import Walk
from simulators.registers import RegisterDevice

WALK = Walk(np.zeros(1), np.zeros((1, 3)))


@pytest.mark.parametrize(
    ("swapped", "expected"), [(False, [[0x1234, 0x5678], [0xFFFF, 0xFFFE]]), (True, [[0x5678, 0x1234], [0xFFFE, 0xFFFF]])]
)
def test_numbers_lie_high_word_first_unless_they_come_swapped(swapped: bool, expected: list[list[int]]) -> None:
    device = RegisterDevice(WALK, Injector([], seed=0), swapped=swapped)
    assert device.numbers(np.array([0x12345678, 0xFFFFFFFE]), ">u4").tolist() == expected
