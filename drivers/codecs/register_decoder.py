"""Register blocks of a Modbus device to arrivals: what to read next, and what was read; no input or output.

The bytes are what passed over the wire: the protocol data units of request and answer, one after the other. Nothing in
an answer but function 24's and the checksums of a map says to which request it belongs: the points' own counter does.
"""

from drivers.codecs.outbox import Outbox
from drivers.codecs.register_account import RegisterAccount
from drivers.codecs.register_map import Block, RegisterMap, entries_of
from drivers.codecs.register_patterns import PATTERN_OF
from drivers.codecs.register_pdus import EXCEPTIONS, READ_FIFO, Exchange, first_exchange, size_of_strange_head
from drivers.errors import DeviceRefused, ProtocolError
from drivers.source import Arrival, Damaged, ScanOpened

ENOUGH = 8  # senseless points, before the map is doubted


class RegisterDecoder:
    """Decides what to read next, and turns what was read into arrivals.

    count   the scan ends after so many points by the device's counter, for devices that tell no end; None: it goes on
    first   number of the first point; None: the first that arrives, or 0 where the device tells how many it sent
    """

    def __init__(self, register_map: RegisterMap, *, count: int | None = None, first: int | None = None) -> None:
        self._map = register_map
        self._count = count
        self._pending = b""
        self._strange = 0  # bytes of an answer of another function that are no longer kept
        self._opened = False
        self._out = Outbox()
        self._account = RegisterAccount(register_map, self._out, count=count, first=first, begin_anew=self._begin_anew)
        self._pattern = PATTERN_OF[register_map.pattern](register_map, self._account, self._out, first or 0)

    @property
    def idle(self) -> bool:
        """Whether nothing new was there, so that the next request may wait a little."""
        return self._pattern.idle

    def request(self) -> bytes:
        """Return the protocol data unit of the next request."""
        return self._pattern.request()

    def feed(self, data: bytes) -> list[Arrival]:
        """Decode the next pairs of request and answer, up to the end of the scan."""
        self._pending += data
        while not self._out.closed and self._step_over_strange_answer() and (exchange := first_exchange(self._pending)):
            self._pending = self._pending[exchange.size :]
            self._take(exchange)
        if self._out.closed:
            self._pending = b""
        return self._out.hand_over()

    def break_off(self) -> list[Arrival]:
        """Forget a pair that was cut off; begin the next turn with the status."""
        if self._strange:
            self._count_strange(len(self._pending))
        self._pending = b""
        self._pattern.begin_turn()
        return self._out.hand_over()

    def _step_over_strange_answer(self) -> bool:
        """Leave an answer of another function out, with its request; tell whether what is pending now is in step.

        Where it ends, nothing in it says. But as nothing was learnt from it, the same is asked again: it ends where that stands.
        """
        while self._strange or (head := size_of_strange_head(self._pending)):
            asked = self._pattern.request()
            skipped = 0 if self._strange else head
            found = self._pending.find(asked, skipped)
            end = found if found >= 0 else max(skipped, len(self._pending) - len(asked) + 1)
            self._strange += end
            self._pending = self._pending[end:]
            if found < 0:
                return False
            self._count_strange(0)
        return True

    def _count_strange(self, byte_count: int) -> None:
        self._out.append(Damaged(self._strange + byte_count, "answer of another function than asked for"))
        self._strange = 0

    def _begin_anew(self) -> None:
        """Forget the scan, because the device has begun another one."""
        self._account.begin()
        self._pattern.begin()
        self._opened = False

    def _take(self, exchange: Exchange) -> None:
        if exchange.exception:
            what = EXCEPTIONS.get(exchange.exception, "unknown exception")
            raise DeviceRefused(
                f"{self._map.device} answers exception {exchange.exception} ({what}) to function {exchange.function} at register "
                f"{exchange.address}, count {exchange.count}; check the map and the device id"
            )
        if exchange.function != self._pattern.request()[0]:
            self._out.append(Damaged(exchange.size, "answer of another function than asked for"))
        elif exchange.function != READ_FIFO and len(exchange.registers) != 2 * self._pattern.count_due(exchange.count):
            self._out.append(Damaged(len(exchange.registers), "answer of another length than asked for"))
        elif self._pattern.step == "status":
            self._take_status(exchange.registers)
        elif self._pattern.step == "pop":
            self._pattern.take_pop(exchange.registers)
        else:
            self._take_points(exchange.registers)

    def _take_status(self, registers: bytes) -> None:
        block = self._map.status
        assert block is not None
        read = entries_of(block, self._map.word_order, registers)
        if not read.sound.all():
            self._out.append(Damaged(len(registers), "status with a wrong checksum"))
            return
        values = {name: int(column[0]) for name, column in read.values.items()}
        self._refuse_another_device(block, values, registers)
        self._open(values.get("announced") or None)
        self._account.hear_status(values)
        self._account.hear_overflow("status", read)
        self._pattern.hear_status(values)

    def _refuse_another_device(self, block: Block, values: dict[str, int], registers: bytes) -> None:
        for name, field in block.fields.items():
            if field.equals is None or values[name] == field.equals:
                continue
            other = "low-first" if self._map.word_order == "high-first" else "high-first"
            if int(entries_of(block, other, registers).values[name][0]) == field.equals:
                raise ProtocolError(f"{self._map.device}: the two halves of its numbers come swapped; set word_order: {other} in the map")
            raise ProtocolError(
                f"{self._map.device}: register {block.at + field.at} holds {values[name]:#x}, not {field.equals:#x}: another device"
            )

    def _take_points(self, registers: bytes) -> None:
        self._open(self._count)
        block = self._map.points
        whole = len(registers) // (2 * block.size) * 2 * block.size
        if len(registers) > whole:
            self._out.append(Damaged(len(registers) - whole, "part of a point"))
        if whole:
            self._pattern.take_points(entries_of(block, self._map.word_order, registers[:whole]))
            self._refuse_senseless_points()
        else:
            self._pattern.end_turn()

    def _refuse_senseless_points(self) -> None:
        """Raise ProtocolError when most of the points that came are such as no part can have."""
        account = self._account
        if account.senseless < ENOUGH or 2 * account.senseless <= account.seen:
            return
        found = f"{self._map.device}: {account.senseless} of {account.seen} points have coordinates that no part can have"
        if 2 * account.sensible_swapped > account.senseless:
            other = "low-first" if self._map.word_order == "high-first" else "high-first"
            raise ProtocolError(f"{found}; the two halves of its numbers come swapped: set word_order: {other} in the map")
        raise ProtocolError(f"{found}; are word_order, type and scale of the map right?")

    def _open(self, expected: int | None) -> None:
        if not self._opened:
            self._opened = True
            self._out.append(ScanOpened(self._map.device, "", expected))
