"""Register blocks of a Modbus device to arrivals: what to read next, and what was read; no input or output.

The bytes are what passed over the wire: the protocol data units of request and answer, one after the other. Nothing in
an answer but function 24's and the checksums of a map says to which request it belongs: the points' own counter does.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.codecs.register_map import MOST_REGISTERS, Block, Columns, RegisterMap, columns, equals_pattern
from drivers.codecs.sequence import SequenceCounter, WrappingClock
from drivers.errors import DeviceRefused, ProtocolError
from drivers.source import Arrival, Damaged, Heartbeat, Lost, PointBatch, Rejected, ScanClosed, ScanOpened

READ_FIFO = 24
EXCEPTIONS = {1: "function not supported", 2: "no such registers", 3: "value not allowed", 4: "device failure", 6: "device busy"}
PATIENCE = 3  # answers in a row that contradict what was read before, until the device is believed to have begun anew


class RegisterDecoder:
    """Decides what to read next, and turns what was read into arrivals; no input or output.

    count   the scan ends after so many points by the device's counter, for devices that tell no end; None: it goes on
    """

    def __init__(self, register_map: RegisterMap, *, count: int | None = None) -> None:
        self._map = register_map
        self._count = count
        self._function = 3 if register_map.table == "holding" else 4
        self._pending = b""
        self._out: list[Arrival] = []
        self._opened = False
        self._heartbeat: int | None = None
        self._overflow: dict[str, bool] = {}  # of each block: what one says is not taken back by another
        self.idle = False
        self._begin()

    def _begin(self) -> None:
        sequence = self._map.points.fields.get("sequence") or (self._map.pop.fields.get("sequence") if self._map.pop else None)
        self._counter = SequenceCounter(1 << min(62, 16 * sequence.registers) if sequence else 1 << 62)
        time = self._map.points.fields.get("time") or (self._map.pop.fields.get("time") if self._map.pop else None)
        self._time = time
        self._clock = WrappingClock(1 << min(62, 16 * time.registers), 1.0 / time.scale) if time else None
        self._first: int | None = None
        self._read = 0
        self._written = 0
        self._finished = self._closed = self._ran = False
        self._backward = self._rereads = 0
        self._sent: int | None = None
        self._first_place: int | None = None  # of a ring: the first place whose point was received, and the one after the last
        self._next_place = 0
        self._step = "status" if self._map.status else ("pop" if self._map.pop else "points")
        self._popped: dict[str, NDArray[np.generic]] = {}

    def request(self) -> bytes:
        """Return the protocol data unit of the next request; `idle` tells that it may wait a little."""
        block = {"status": self._map.status, "pop": self._map.pop, "points": self._map.points}[self._step]
        assert block is not None
        if self._step != "points" or self._map.pattern in {"latest", "queue"}:
            return _pdu(self._function, block.at, block.size)
        if self._map.pattern == "fifo":
            return _pdu(READ_FIFO, block.at, None)
        place, room = self._read % block.entries, MOST_REGISTERS // block.size
        count = min(self._written - self._read, block.entries - place, room)
        return _pdu(self._function, block.at + place * block.size, count * block.size)

    def feed(self, data: bytes) -> list[Arrival]:
        """Decode the next pairs of request and answer."""
        self._pending += data
        while pair := _pair(self._pending):
            self._pending = self._pending[pair.size :]
            self._answer(pair)
        out, self._out = self._out, []
        return out

    def interrupted(self) -> list[Arrival]:
        """Forget a pair that was cut off; begin the next turn with the status."""
        self._pending = b""
        self._step = "status" if self._map.status else ("pop" if self._map.pop else "points")
        return []

    def _answer(self, pair: "_Pair") -> None:
        if pair.exception:
            what = EXCEPTIONS.get(pair.exception, "unknown exception")
            raise DeviceRefused(
                f"{self._map.device} answers exception {pair.exception} ({what}) to function {pair.function} at register "
                f"{pair.address}, count {pair.count}; check the map and the device id"
            )
        if pair.function != READ_FIFO and len(pair.registers) != 2 * pair.count:
            self._out.append(Damaged(len(pair.registers), "answer of another length than asked for"))
        elif self._step == "status":
            self._take_status(pair.registers)
        elif self._step == "pop":
            self._take_pop(pair.registers)
        else:
            self._take_points(pair.registers)

    def _take_status(self, registers: bytes) -> None:
        block = self._map.status
        assert block is not None
        read = columns(block, self._map.word_order, registers)
        if not read.sound.all():
            self._out.append(Damaged(len(registers), "status with a wrong checksum"))
            return
        values = {name: int(column[0]) for name, column in read.values.items()}
        self._check_magic(block, values, registers)
        if not self._opened:
            self._opened = True
            self._out.append(ScanOpened(self._map.device, "", values.get("announced") or None))
        self._hear_heartbeat(values)
        self._hear_overflow("status", read)
        self._sent = values.get("sent")
        state = block.fields.get("state")
        over = state is not None and state.finished is not None and values["state"] == state.finished
        self._ran |= not over
        self._finished = over and (self._ran or self._first is not None)  # a device that has not begun yet is not finished
        if self._map.pattern == "ring":
            self._plan_ring(values["written"], 1 << 16 * block.fields["written"].registers)
        else:
            self._step, self.idle = "pop" if self._map.pop else "points", False

    def _check_magic(self, block: Block, values: dict[str, int], registers: bytes) -> None:
        for name, field in block.fields.items():
            if field.equals is None or values[name] == field.equals:
                continue
            other = "low-first" if self._map.word_order == "high-first" else "high-first"
            if int(columns(block, other, registers).values[name][0]) == field.equals:
                raise ProtocolError(f"{self._map.device}: the two halves of its numbers come swapped; set word_order: {other} in the map")
            raise ProtocolError(
                f"{self._map.device}: register {block.at + field.at} holds {values[name]:#x}, not {field.equals:#x}: another device"
            )

    def _hear_heartbeat(self, values: dict[str, int]) -> None:
        if "heartbeat" in values and values["heartbeat"] != self._heartbeat:
            if self._heartbeat is not None:
                self._out.append(Heartbeat())
            self._heartbeat = values["heartbeat"]

    def _hear_overflow(self, where: str, read: Columns) -> None:
        """Take note of the device's own losses, told in a block once or with every point of it."""
        if "overflow" not in read.values:
            return
        for overflow in (read.values["overflow"][read.sound] != 0).tolist():
            if overflow and not self._overflow.get(where):
                self._out.append(Lost(0, "the device says that its buffer overflowed; its counter shows how many"))
            self._overflow[where] = overflow

    def _plan_ring(self, written: int, modulus: int) -> None:
        ahead = (written - self._written + modulus // 2) % modulus - modulus // 2
        if self._contradicts(ahead < 0):
            return
        self._written += ahead
        entries = self._map.points.entries
        self._read = max(self._read, self._written - entries)  # what was overrun is lost: the sequence numbers will say so
        if self._written > self._read:
            self._step, self.idle = "points", False
        else:
            self.idle = True
            self._end_ring_if_finished()

    def _end_ring_if_finished(self) -> None:
        """A device that does not tell how many points it sent has sent those it wrote; the sequence shows only gaps between two."""
        if self._finished and not self._closed and self._sent is None:
            before, last = (self._written, self._written) if self._first_place is None else (self._first_place, self._next_place)
            if lost := before + self._written - last:
                self._out.append(Lost(lost, "written by the device, never received soundly"))
        self._end_if_finished(self._finished)

    def _contradicts(self, backward: bool) -> bool:
        """Tell whether an answer goes back behind an earlier one; several in a row mean that the device began anew."""
        if not backward:
            self._backward = 0
            return False
        self._backward += 1
        if self._backward >= PATIENCE:
            self._begin()
            self._opened = False
        return True

    def _take_pop(self, registers: bytes) -> None:
        assert self._map.pop is not None
        popped = columns(self._map.pop, self._map.word_order, registers)
        self._popped = popped.values
        self._hear_overflow("pop", popped)
        sequence = self._map.pop.fields.get("sequence")
        counter = int(self._popped["sequence"][0]) if sequence else None
        if sequence is not None and counter is not None and (counter == sequence.invalid or not self._is_new(counter)):
            self._turn_ends()
        else:
            self._step, self.idle = "points", False

    def _is_new(self, counter: int) -> bool:
        return self._first is None or self._counter.unwrap(counter) != self._counter.expected - 1

    def _turn_ends(self) -> None:
        """Nothing new was there."""
        self.idle = True
        self._end_if_finished(self._finished)
        self._step = "status" if self._map.status else ("pop" if self._map.pop else "points")

    def _take_points(self, registers: bytes) -> None:
        block, pattern = self._map.points, self._map.pattern
        if not self._opened:
            self._opened = True
            self._out.append(ScanOpened(self._map.device, "", self._count))
        whole = len(registers) // (2 * block.size) * 2 * block.size
        if len(registers) > whole:
            self._out.append(Damaged(len(registers) - whole, "part of a point"))
        if not whole:
            self._turn_ends()
            return
        read = columns(block, self._map.word_order, registers[:whole])
        damaged = int((~read.sound).sum())
        place = self._read
        if pattern == "ring":
            taken = self._worth_taking(read.sound)
            self._read += taken
            read = Columns({name: column[:taken] for name, column in read.values.items()}, read.sound[:taken])
        self._hear_overflow("points", read)
        values = {**self._popped, **read.values}
        if pattern == "latest" and "sequence" in values and not self._is_new(int(values["sequence"][0])):
            self._turn_ends()
            return
        if damaged:
            self._out.append(Damaged(2 * block.size * damaged, "point with a wrong checksum"))
        numbers = self._points({name: column[read.sound] for name, column in values.items()}, int(read.sound.sum()))
        if pattern == "ring":
            self._note_places(place + np.flatnonzero(read.sound)[numbers >= 0])
        self.idle = pattern == "latest"
        self._step = "points" if pattern == "ring" and self._read < self._written else self._next_turn()

    def _note_places(self, places: NDArray[np.int64]) -> None:
        """Note the places of a ring whose points were received: neither damaged nor repeated."""
        if len(places):
            self._first_place = int(places[0]) if self._first_place is None else self._first_place
            self._next_place = int(places[-1]) + 1

    def _worth_taking(self, sound: NDArray[np.bool_]) -> int:
        """Return how many points of a ring to take: up to a damaged one, which is read again, but not for ever."""
        self._rereads = 0 if sound.all() else self._rereads + 1
        if 0 < self._rereads < PATIENCE:
            return int(sound.argmin())
        self._rereads = 0
        return len(sound)

    def _next_turn(self) -> str:
        if self._map.pop:
            return "pop"  # the status again only when the queue is empty
        return "points" if self._map.pattern == "fifo" or not self._map.status else "status"

    def _points(self, values: dict[str, NDArray[np.generic]], count: int) -> NDArray[np.int64]:
        """Hand over sound points; return their numbers, -1 for repetitions."""
        numbers = self._numbers(values, count)
        usable = numbers >= 0
        if count and not usable.any() and self._map.pattern != "ring" and self._contradicts(backward=True):
            return numbers
        self._backward = 0 if self._map.pattern != "ring" else self._backward
        usable[usable] = ~self._invalid({name: column[usable] for name, column in values.items()}, int(usable.sum()))
        if usable.any():
            self._out.append(PointBatch(numbers[usable], self._seconds(values, usable), self._points_mm(values, usable)))
        if self._count is not None and self._first is not None and self._counter.expected - self._first >= self._count:
            self._end_if_finished(finished=True)
        return numbers

    def _numbers(self, values: dict[str, NDArray[np.generic]], count: int) -> NDArray[np.int64]:
        """Return the unwrapped numbers of the points, -1 for repetitions."""
        expected = self._counter.expected + np.arange(count)
        if "sequence" not in values:
            self._first = self._first or 0
            self._counter.expected += count
            return expected
        counters = values["sequence"].astype(np.int64)
        if self._first is not None and np.array_equal(counters, expected % self._counter.modulus):
            self._counter.expected += count
            return expected
        return np.array([self._number(int(counter)) for counter in counters], dtype=np.int64)

    def _number(self, counter: int) -> int:
        """Account for one point by its counter; return its number, or -1 if it is a repetition."""
        if self._first is None:
            self._first = 0 if self._sent is not None else counter  # a device that tells how many it sent begins with 0
            self._counter.expected = self._first
        place = self._counter.place(counter)
        if place.repeated:
            self._out.append(Rejected(1, "point repeated"))
            return -1
        if place.lost:
            self._out.append(Lost(place.lost, "gap in the sequence numbers" if place.lost > 0 else "arrived late after all"))
        return place.sequence

    def _invalid(self, values: dict[str, NDArray[np.generic]], count: int) -> NDArray[np.bool_]:
        """Tell which points the device marks invalid, and count them by their reasons."""
        invalid = np.zeros(count, dtype=np.bool_)
        fields = {**(self._map.pop.fields if self._map.pop else {}), **self._map.points.fields}
        for name, column in values.items():
            field = fields[name]
            for reason, struck in (
                (f"{name} holds no value", equals_pattern(column, field.invalid, field.type) if field.invalid is not None else None),
                ("marked invalid by the device", column.astype(np.int64) & field.invalid_bits != 0 if field.invalid_bits else None),
                (f"{name} is no number", ~np.isfinite(column) if field.type.startswith("float") else None),
            ):
                if struck is not None and (new := struck & ~invalid).any():
                    self._out.append(Rejected(int(new.sum()), reason))
                    invalid |= new
        return invalid

    def _seconds(self, values: dict[str, NDArray[np.generic]], usable: NDArray[np.bool_]) -> NDArray[np.float64]:
        """A device without a clock always says 0."""
        if self._clock is None or self._time is None:
            return np.zeros(int(usable.sum()))
        if self._time.type.startswith("float"):
            return np.asarray(values["time"][usable].astype(np.float64) * self._time.scale)
        return self._clock.seconds(values["time"][usable].astype(np.int64))

    def _points_mm(self, values: dict[str, NDArray[np.generic]], usable: NDArray[np.bool_]) -> NDArray[np.float64]:
        points_mm = np.zeros((int(usable.sum()), 3))
        for block in (self._map.pop, self._map.points):
            for axis, name in enumerate("xyz"):
                if block is not None and name in block.fields:
                    field = block.fields[name]
                    points_mm[:, axis] = field.scaled(values[name][usable].astype(np.float64))
        return points_mm

    def _end_if_finished(self, finished: bool) -> None:
        if not finished or self._closed:
            return
        self._closed = True
        if self._sent is not None and (lost := self._counter.reach(self._sent)):
            self._out.append(Lost(lost, "gap in the sequence numbers"))
        self._out.append(ScanClosed(self._sent))


@dataclass(frozen=True, slots=True)
class _Pair:
    """A request and its answer."""

    function: int
    address: int
    count: int
    exception: int
    registers: bytes
    size: int


def _pdu(function: int, address: int, count: int | None) -> bytes:
    head = bytes([function]) + address.to_bytes(2, "big")
    return head if count is None else head + count.to_bytes(2, "big")


def _pair(data: bytes) -> _Pair | None:
    """Read the first pair of data units, if it is there as a whole."""
    if not data:
        return None
    function = data[0]
    asked = 3 if function == READ_FIFO else 5
    if len(data) < asked + 2:
        return None
    address, count = int.from_bytes(data[1:3], "big"), int.from_bytes(data[3:asked], "big")
    if data[asked] == function | 0x80:
        return _Pair(function, address, count, data[asked + 1], b"", asked + 2)
    if function == READ_FIFO:
        start, length = asked + 5, int.from_bytes(data[asked + 1 : asked + 3], "big") - 2
    else:
        start, length = asked + 2, data[asked + 1]
    if len(data) < start + length:
        return None
    return _Pair(function, address, count, 0, data[start : start + length], start + length)
