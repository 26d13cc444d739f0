"""A simulated RIFTEK RF60x distance sensor on Modbus RTU (or TCP): input registers as in its manual.

1 type, 2 firmware, 3 serial number, 4 base distance, 5 range, 6 value: distance * 16384 / range. No counter, no clock.
"""

import numpy as np

from simulators.faults import Injector
from simulators.motion import Walk, feed_under
from simulators.registers import RegisterDevice, Words, serve_registers
from simulators.settings import Announce, SimulatorSettings

RANGE_MM = 50
IDENTITY = (603, 90, 17185, 80, RANGE_MM)
INPUT_REGISTERS = 4


class RiftekRegisters(RegisterDevice):
    """Six input registers."""

    size = 64

    def __init__(self, scan: Walk, injector: Injector, swapped: bool) -> None:
        super().__init__(scan, injector, swapped=swapped)

    def read(self, table: int, address: int, count: int) -> Words:
        """Return the registers; holding registers read 0 here."""
        registers = np.zeros(self.size + count, dtype=np.uint16)
        if table == INPUT_REGISTERS:
            distance_mm = self.scan.points_mm[max(0, self.taken - 1), 1]
            registers[1:6] = IDENTITY
            registers[6] = min(max(round(distance_mm * 16384 / RANGE_MM), 0), 16384)
        self.done |= self.taken >= self.count
        return registers[address : address + count]


def serve(settings: SimulatorSettings, announce: Announce) -> None:
    """Serve the sensor while the part is fed under it."""
    serve_registers(settings, announce, RiftekRegisters, move=feed_under)


DEVICES = {"riftek-modbus": serve}
