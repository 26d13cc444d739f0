"""Registers read for their own sake, over and over, while somebody looks among them for the points of a device; no input or output.

Nothing is written to the device. Yet a device may take a message out of its queue when a register is read: that is how its maker made it.
"""

from collections.abc import Mapping
from typing import Literal

import numpy as np

from drivers.codecs.register_map import MOST_REGISTERS, NUMPY_TYPES
from drivers.codecs.register_pdus import EXCEPTIONS, first_exchange, read_request, size_of_strange_head
from drivers.errors import DeviceRefused, ProtocolError
from drivers.source import Arrival, Heartbeat, ScanClosed

Table = Literal["holding", "input"]
WordOrder = Literal["high-first", "low-first"]

KINDS = tuple(NUMPY_TYPES)  # of numbers in registers
TABLES: tuple[Table, ...] = ("holding", "input")
WORD_ORDERS: tuple[WordOrder, ...] = ("high-first", "low-first")
FUNCTIONS: Mapping[Table, int] = {"holding": 3, "input": 4}
_OTHER: Mapping[Table, Table] = {"holding": "input", "input": "holding"}
_NO_FUNCTION = 1
_ABOUT_THE_RANGE = frozenset({2, 3, 4})  # exceptions of devices that lack a register of the range, or bear a shorter one only


class RegisterSurvey:
    """Reads a range of registers in as few blocks as the device bears.

    A block that the device refuses is halved until the registers that it lacks are known; these are not asked for again.

    table, first, count : which registers, counted from 0 as on the wire
    passes : how often all of them are read; None: on and on
    device : how messages call it
    words  : what each register held when it was read last
    missing : the registers that the device does not have
    done   : how often all of them were read
    """

    def __init__(self, table: Table, first: int, count: int, *, passes: int | None = None, device: str = "the device") -> None:
        """Raises ValueError for a range that is none."""
        if not 1 <= count <= MOST_REGISTERS:
            raise ValueError(f"at most {MOST_REGISTERS} registers, which is what one answer carries, not {count}")
        if not 0 <= first <= 65536 - count:
            raise ValueError(f"registers {first} to {first + count - 1}: expected some of 0 to 65535")
        self.table, self.first, self.count = table, first, count
        self.words: dict[int, int] = {}
        self.missing: set[int] = set()
        self.done = 0
        self._passes = passes
        self._device = device
        self._blocks = [(first, count)]  # that the device bears, as far as is known
        self._next = 0
        self._refusal = 0
        self._pending = b""

    @property
    def idle(self) -> bool:
        """Whether all was read, so that the next request may wait a little."""
        return self._next == 0

    def request(self) -> bytes:
        """Return the protocol data unit of the next request."""
        return read_request(FUNCTIONS[self.table], *self._blocks[self._next])

    def feed(self, data: bytes) -> list[Arrival]:
        """Take the next pairs of request and answer. Raises DeviceRefused, ProtocolError."""
        self._pending += data
        arrivals: list[Arrival] = []
        if size_of_strange_head(self._pending):
            raise ProtocolError(f"{self._device}: answers another function than it is asked for; is it really a Modbus device?")
        while exchange := first_exchange(self._pending):
            self._pending = self._pending[exchange.size :]
            if exchange.exception:
                self._halve(exchange.exception)
            else:
                self._take(exchange.registers)
            arrivals.append(Heartbeat())
            if self._passes is not None and self.done >= self._passes:
                return [*arrivals, ScanClosed(None)]
        return arrivals

    def break_off(self) -> list[Arrival]:
        """Forget a pair that was cut off; begin to read from the first block."""
        self._pending, self._next = b"", 0
        return []

    def _take(self, registers: bytes) -> None:
        at, count = self._blocks[self._next]
        if len(registers) != 2 * count:
            raise ProtocolError(
                f"{self._device}: answers {len(registers) // 2} registers where {count} were asked for, from register {at} on"
            )
        self.words.update(zip(range(at, at + count), np.frombuffer(registers, dtype=">u2").tolist(), strict=True))
        self._go_on(self._next + 1)

    def _halve(self, exception: int) -> None:
        at, count = self._blocks[self._next]
        words = EXCEPTIONS.get(exception, "unknown exception")
        if exception == _NO_FUNCTION:
            raise DeviceRefused(
                f"{self._device}: has no {self.table} registers: it answers exception 1 ({words}); try the table {_OTHER[self.table]}"
            )
        if exception not in _ABOUT_THE_RANGE:
            raise DeviceRefused(f"{self._device}: answers exception {exception} ({words}) to the {self.table} registers from {at} on")
        self._refusal = exception
        half = count // 2
        if half:
            self._blocks[self._next : self._next + 1] = [(at, half), (at + half, count - half)]
            return
        self.missing.add(at)
        self.words.pop(at, None)
        del self._blocks[self._next]
        if not self._blocks:
            last = self.first + self.count - 1
            raise DeviceRefused(
                f"{self._device}: has none of the {self.table} registers {self.first} to {last}: it answers exception {self._refusal} "
                f"({EXCEPTIONS[self._refusal]}); try others, or the table {_OTHER[self.table]}"
            )
        self._go_on(self._next)

    def _go_on(self, place: int) -> None:
        is_over = place >= len(self._blocks)
        self.done += is_over
        self._next = 0 if is_over else place


def stored_number(words: Mapping[int, int], at: int, kind: str, order: WordOrder) -> int | float | None:
    """The number of a type that begins at a register, its words in an order; None where one of its registers is not there.

    words : register -> what it holds
    """
    size = np.dtype(NUMPY_TYPES[kind]).itemsize // 2
    found = [words.get(at + place) for place in range(size)]
    if any(word is None for word in found):
        return None
    parts = np.array(found if order == "high-first" else found[::-1], dtype=">u2")
    number: int | float = parts.view(NUMPY_TYPES[kind])[0].item()
    return number


def registers_of(kind: str) -> int:
    """How many registers a number of a type takes."""
    return np.dtype(NUMPY_TYPES[kind]).itemsize // 2
