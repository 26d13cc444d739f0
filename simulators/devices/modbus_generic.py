"""Simulated generic Modbus scanners: points in a ring of holding registers, or handed over by function 24.

Registers 0 on: magic (uint32), points written (uint32), state (0 waiting, 1 scanning, 2 finished), overflow, heartbeat,
points announced (uint32), points taken (uint32), checksum. A point: number (uint16), time in us (uint32), x, y, z
(int32, 1e-5 mm), then in the ring flags, then a checksum. Checksums are CRC-16/CCITT-FALSE.
"""

from binascii import crc_hqx

import numpy as np

from simulators.faults import Injector
from simulators.motion import Walk
from simulators.registers import READ_FIFO, RegisterDevice, Words, serve_registers
from simulators.settings import Announce, SimulatorSettings

RING_AT, ENTRIES = 100, 500
FIFO_AT, FIFO_DEPTH, FIFO_MOST = 100, 300, 31
NO_VALUE = 0x80000000


class RingDevice(RegisterDevice):
    """500 points of 11 registers each from register 100 on."""

    magic = 0x434D4D31
    with_flags = True

    def __init__(self, scan: Walk, injector: Injector, swapped: bool) -> None:
        super().__init__(scan, injector, swapped=swapped)
        self.size = RING_AT + ENTRIES * 11
        self.stored: list[int] = []  # numbers of the points that were written
        self.entries = np.zeros((self.count, 11 if self.with_flags else 10), dtype=np.uint16)
        self.ring = np.zeros((ENTRIES, self.entries.shape[1]), dtype=np.uint16)
        self._encode()

    def take(self, taken: int) -> None:
        """Write the points up to `taken`, but those the device drops."""
        dropped = self.injector.strike("overflow", taken)
        for index in range(self.taken, taken):
            for number in self.injector.points_stored_at(index):
                self.ring[len(self.stored) % ENTRIES] = self.entries[number]
                self.stored.append(number)
        if dropped:
            self.overflow = 1
            del self.stored[-int(dropped) :]
        self.taken = taken

    def points_appearing(self, function: int, address: int, count: int) -> int:
        """Let points appear when the status is read, but for the first time, and not while the ring is."""
        return 40 if address == 0 and self.heartbeat > 1 else 0

    def read(self, table: int, address: int, count: int) -> Words:
        """Return status and ring."""
        if address >= RING_AT and self.with_flags:
            return self.ring.reshape(-1)[address - RING_AT : address - RING_AT + count]
        registers = np.zeros(address + count + 12, dtype=np.uint16)
        registers[:12] = self._status()
        return registers[address : address + count]

    def _status(self) -> Words:
        state = 2 if self.taken >= self.count else 1
        self.done |= state == 2
        status = np.zeros(12, dtype=np.uint16)
        for at, value in ((0, self.magic), (2, len(self.stored)), (7, self.count), (9, self.taken)):
            status[at : at + 2] = self.numbers(np.array([value]), ">u4")[0]
        status[4:7] = state, self.overflow, self.heartbeat
        status[11] = crc_hqx(status[:11].astype(">u2").tobytes(), 0xFFFF)
        return status

    def _encode(self) -> None:
        index = np.arange(self.count)
        units = np.round(self.scan.points_mm * 1e5).astype(np.int64) & 0xFFFFFFFF
        units[[i for i in range(self.count) if self.injector.lacks_value(i)], 1] = NO_VALUE
        self.entries[:, 0] = index % 65536
        self.entries[:, 1:3] = self.numbers(np.round(self.scan.time_s * 1e6).astype(np.int64) % 2**32, ">u4")
        for axis in range(3):
            self.entries[:, 3 + 2 * axis : 5 + 2 * axis] = self.numbers(units[:, axis], ">u4")
        if self.with_flags:
            self.entries[:, 9] = [self.injector.marks_invalid(i) for i in range(self.count)]
        rows = self.entries[:, :-1].astype(">u2")
        self.entries[:, -1] = [crc_hqx(row.tobytes(), 0xFFFF) for row in rows]


class FifoDevice(RingDevice):
    """A queue of 300 points of 10 registers at address 100."""

    magic = 0x434D4D32
    with_flags = False

    def __init__(self, scan: Walk, injector: Injector, swapped: bool) -> None:
        super().__init__(scan, injector, swapped)
        self._handed_over = 0

    def points_appearing(self, function: int, address: int, count: int) -> int:
        """Let as many points appear as one request hands over."""
        return FIFO_MOST // 10 if function == READ_FIFO else 0

    def take_fifo(self, address: int) -> Words:
        """Hand over the oldest points; those that found no room are lost."""
        if address != FIFO_AT:
            return np.zeros(0, dtype=np.uint16)
        if len(self.stored) - self._handed_over > FIFO_DEPTH:
            self.overflow = 1
            self._handed_over = len(self.stored) - FIFO_DEPTH
        oldest = self.stored[self._handed_over : self._handed_over + FIFO_MOST // 10]
        self._handed_over += len(oldest)
        return self.entries[oldest].reshape(-1)


def serve_ring(settings: SimulatorSettings, announce: Announce) -> None:
    """Serve one scan in a ring."""
    serve_registers(settings, announce, RingDevice)


def serve_fifo(settings: SimulatorSettings, announce: Announce) -> None:
    """Serve one scan through a queue."""
    serve_registers(settings, announce, FifoDevice)


DEVICES = {"modbus-ring": serve_ring, "modbus-fifo": serve_fifo}
