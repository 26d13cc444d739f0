"""Small tables of registers that play Modbus devices, without any line."""

import struct
from binascii import crc_hqx

import numpy as np

from drivers.codecs.register_decoder import RegisterDecoder
from drivers.codecs.register_map import RegisterMap
from drivers.maps import shipped_map
from drivers.source import Arrival, ScanClosed

RING = shipped_map("generic-ring")


class Table:
    """Registers that answer requests."""

    def __init__(self) -> None:
        self.registers = np.zeros(65536, dtype=np.uint16)
        self.fifo: list[int] = []

    def put(self, at: int, code: str, value: float) -> None:
        data = struct.pack(">" + code, value)
        self.registers[at : at + len(data) // 2] = np.frombuffer(data, dtype=">u2")

    def answer(self, request: bytes) -> bytes:
        address = int.from_bytes(request[1:3], "big")
        if request[0] == 24:
            words, self.fifo = self.fifo[:31], self.fifo[31:]
            return request + struct.pack(f">BHH{len(words)}H", 24, 2 + 2 * len(words), len(words), *words)
        count = int.from_bytes(request[3:5], "big")
        data = self.registers[address : address + count].astype(">u2").tobytes()
        return request + bytes([request[0], len(data)]) + data


class Ring(Table):
    """The generic ring, as its map describes it."""

    def __init__(self) -> None:
        super().__init__()
        self.written = 0
        self.status(state=1)

    def status(self, state: int, written: int | None = None, overflow: int = 0, heartbeat: int = 0) -> None:
        self.put(0, "I", 0x434D4D31)
        self.put(2, "I", self.written if written is None else written)
        self.registers[4:7] = state, overflow, heartbeat
        self.put(7, "I", 1000)
        self.put(9, "I", self.written)
        self.registers[11] = crc_hqx(self.registers[:11].astype(">u2").tobytes(), 0xFFFF)

    def write(self, count: int, skip: int = 0) -> None:
        """Write points (n, -n, 0.5 n) um at n ms; `skip` numbers first."""
        for _ in range(count):
            number, at = self.written + skip, 100 + self.written % 500 * 11
            self.registers[at] = number % 65536
            self.put(at + 1, "I", number * 1000)
            for axis, units in enumerate((100 * number, -100 * number, 50 * number)):
                self.put(at + 3 + 2 * axis, "i", units)
            self.registers[at + 9] = 0
            self.seal(at)
            self.written += 1
        self.status(state=1)

    def seal(self, at: int) -> None:
        self.registers[at + 10] = crc_hqx(self.registers[at : at + 10].astype(">u2").tobytes(), 0xFFFF)


class Gocator(Table):
    """Stamp and one measurement; reading 976 takes a message out of the queue."""

    def __init__(self) -> None:
        super().__init__()
        self.queue: list[tuple[int, int, int]] = []  # frame, encoder, um
        self.registers[300] = 1

    def answer(self, request: bytes) -> bytes:
        address, count = struct.unpack(">HH", request[1:5])
        if address <= 976 < address + count and self.queue:
            frame, encoder, um = self.queue.pop(0)
            self.put(988, "q", encoder)
            self.put(992, "q", frame * 500)
            self.put(996, "q", frame)
            self.put(1000, "I", um & 0xFFFFFFFF)
            self.registers[1002] = 1 if um != 0x80000000 else 2
        self.registers[977] = len(self.queue)
        return super().answer(request)


def turns(decoder: RegisterDecoder, table: Table, most: int = 200) -> list[Arrival]:
    """Ask and answer until there is nothing new."""
    arrivals: list[Arrival] = []
    for _ in range(most):
        arrivals += decoder.feed(table.answer(decoder.request()))
        if decoder.idle or any(isinstance(arrival, ScanClosed) for arrival in arrivals):
            return arrivals
    raise AssertionError("never idle")


LATEST = RegisterMap.model_validate(
    {
        "device": "latest",
        "pattern": "latest",
        "points": {
            "at": 10,
            "fields": {"sequence": {"at": 0, "type": "uint16"}, "x": {"at": 1, "type": "int16", "scale": 0.5, "offset": 1.0}},
        },
    }
)


def without_sent() -> RegisterMap:
    """The generic ring of a device that does not tell how many points it sent."""
    document = RING.model_dump()
    del document["status"]["fields"]["sent"]
    return RegisterMap.model_validate(document)
