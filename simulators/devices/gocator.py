"""A simulated LMI Gocator, firmware 4 to 6, on Modbus TCP: registers as in its manual, traps included.

The sensor moves along x, told by its encoder at 1 um a tick, and measures y as measurement 0 in um. Reading register
976 takes the oldest message out of a queue of 100; without it the same message is read again and again; a queue
that runs over sets register 978, which stays set. Command 1 starts, 0 stops; the scan starts by itself here.
"""

import numpy as np

from simulators.faults import Injector
from simulators.motion import Walk
from simulators.registers import RegisterDevice, Words, serve_registers
from simulators.settings import Announce, SimulatorSettings

STATE_AT, STAMP_AT, MEASUREMENTS_AT = 300, 976, 1000
QUEUE = 100
FIRST_FRAME = 17  # the frame index does not begin at 0
NO_VALUE = 0x80000000


class Gocator(RegisterDevice):
    """State, stamp and one measurement."""

    size = 2000

    def __init__(self, scan: Walk, injector: Injector, swapped: bool) -> None:
        super().__init__(scan, injector, swapped=swapped)
        self._queue: list[int] = []
        self._message: int | None = None

    def take(self, taken: int) -> None:
        """Queue the messages up to `taken`."""
        dropped = self.injector.strike("overflow", taken)
        for index in range(self.taken, taken):
            self._queue += self.injector.points_stored_at(index)
        if dropped or len(self._queue) > QUEUE:
            self.overflow = 1
            self._queue = self._queue[: max(0, min(QUEUE, len(self._queue) - int(dropped or 0)))]
        self.taken = taken

    def points_appearing(self, function: int, address: int, count: int) -> int:
        """Let one message appear for each one taken."""
        return int(address <= STAMP_AT < address + count)

    def read(self, table: int, address: int, count: int) -> Words:
        """Return the registers; reading 976 advances the queue."""
        if address <= STAMP_AT < address + count and self._queue:
            self._message = self._queue.pop(0)
        registers = np.zeros(max(self.size, address + count), dtype=np.uint16)
        registers[STATE_AT] = self.taken < self.count or bool(self._queue)
        self.done |= not registers[STATE_AT]
        registers[STAMP_AT + 1 : STAMP_AT + 3] = len(self._queue), self.overflow
        if self._message is not None:
            self._show(registers, self._message)
        return registers[address : address + count]

    def _show(self, registers: Words, index: int) -> None:
        x, y, _ = self.scan.points_mm[index]
        for at, value in ((988, round(x * 1000)), (992, round(self.scan.time_s[index] * 1e6)), (996, FIRST_FRAME + index)):
            registers[at : at + 4] = self.numbers(np.array([value]), ">i8")[0]
        invalid = self.injector.lacks_value(index)
        value = NO_VALUE if invalid else round(y * 1000) & 0xFFFFFFFF
        registers[MEASUREMENTS_AT : MEASUREMENTS_AT + 2] = self.numbers(np.array([value]), ">u4")[0]
        registers[MEASUREMENTS_AT + 2] = 2 if invalid else 1


def serve(settings: SimulatorSettings, announce: Announce) -> None:
    """Serve one scan."""
    serve_registers(settings, announce, Gocator)


DEVICES = {"gocator": serve}
