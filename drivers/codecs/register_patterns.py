"""The four ways in which Modbus devices hand their points over: what to ask for next, and which of the points read to take.

Each pattern asks turn by turn. A turn begins with the status, if the device has one, and ends when nothing new was there.
What the points' counters say is one account, whatever the pattern.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from drivers.codecs.outbox import Outbox
from drivers.codecs.register_account import PATIENCE, Columns, RegisterAccount
from drivers.codecs.register_map import MOST_REGISTERS, Block, Entries, RegisterMap, entries_of
from drivers.codecs.register_pdus import fifo_request, read_request
from drivers.source import OLDER_THAN_THE_SCAN, Damaged, Rejected

Step = Literal["status", "pop", "points"]


class Pattern:
    """What the patterns have in common.

    step   the block to be read next
    idle   whether nothing new was there, so that the next request may wait a little
    """

    def __init__(self, register_map: RegisterMap, account: RegisterAccount, out: Outbox, first: int = 0) -> None:
        self._map = register_map
        self._function = 3 if register_map.table == "holding" else 4
        self._account = account
        self._out = out
        self.idle = False
        self.step: Step = "status"
        self.begin(first)

    def begin(self, first: int = 0) -> None:
        """Forget what was read, because a scan begins whose first point has the number `first`."""
        self.begin_turn()

    def begin_turn(self) -> None:
        """Read the status next, or the points of a device that has none."""
        self.step = "status" if self._map.status else self._step_after_status()

    def request(self) -> bytes:
        """Return the next request."""
        block = {"status": self._map.status, "pop": self._map.pop}.get(self.step)
        return self._read(block) if block else self._points_request()

    def count_due(self, asked: int) -> int:
        """Return how many registers an answer to the next request carries, of which `asked` were asked for as the bytes say."""
        block = {"status": self._map.status, "pop": self._map.pop}.get(self.step) or self._map.points
        return asked if block is self._map.points and block.entries > 1 else block.size

    def hear_status(self, values: Mapping[str, int]) -> None:
        """Decide from the fields of a sound status what to read next."""
        self.step, self.idle = self._step_after_status(), False

    def take_pop(self, registers: bytes) -> None:
        """Take the block that takes a message out of a queue."""
        raise NotImplementedError

    def take_points(self, read: Entries) -> None:
        """Take at least one point."""
        raise NotImplementedError

    def end_turn(self) -> None:
        """End a turn in which nothing new was there; the next one may wait a little."""
        self.idle = True
        self._account.end_if_finished()
        self.begin_turn()

    def _step_after_status(self) -> Step:
        return "pop" if self._map.pop else "points"

    def _points_request(self) -> bytes:
        return self._read(self._map.points)

    def _read(self, block: Block) -> bytes:
        return read_request(self._function, block.at, block.size)

    def _hand_over(self, values: Columns, sound: NDArray[np.bool_]) -> None:
        """Hand over the sound ones of the points read, unless all of them go back behind earlier ones, or are older than the scan."""
        self._count_damage(sound)
        if self._account.is_before_the_scan:
            self._account.hold(int(sound.sum()))
            return
        values, count = {name: column[sound] for name, column in values.items()}, int(sound.sum())
        numbers = self._account.number(values, count)
        if not self._account.contradicts(backward=count > 0 and not (numbers >= 0).any()):
            self._account.hand_over(values, numbers)

    def _count_damage(self, sound: NDArray[np.bool_]) -> None:
        if damaged := int((~sound).sum()):
            self._out.append(Damaged(2 * self._map.points.size * damaged, "point with a wrong checksum"))


class Latest(Pattern):
    """The points block holds one point, which is new when its sequence has changed; without a sequence every reading counts.

    What the block holds when the run begins is older than the scan until its sequence changes, or until there are coordinates.
    """

    def begin(self, first: int = 0) -> None:
        """Forget what was read."""
        self.begin_turn()
        self._old: tuple[int | None, bytes] | None = None
        self._is_running = False

    def take_points(self, read: Entries) -> None:
        """Take the point if it is a new one."""
        self._account.hear_overflow("points", read)
        if read.sound[0] and self._is_older_than_the_scan(read):
            self.end_turn()
            return
        if "sequence" in read.values and self._account.is_repeated(int(read.values["sequence"][0])):
            self.end_turn()
            return
        self._hand_over(read.values, read.sound)
        self.idle = True
        self.begin_turn()

    def _is_older_than_the_scan(self, read: Entries) -> bool:
        """Tell whether the block still holds what it held when the run began."""
        counter = int(read.values["sequence"][0]) if "sequence" in read.values else None
        held = b"".join(read.values[name].tobytes() for name in ("x", "y", "z") if name in read.values)
        if not self._is_running and self._old is None:
            # Without a sequence a reading is a measurement of this moment, unless nothing was ever measured.
            self._is_running = self._account.tells_running(counter) or (counter is None and any(held))
            if not self._is_running:
                self._old = counter, held
                self._out.append(Rejected(1, OLDER_THAN_THE_SCAN))
        elif not self._is_running and self._old is not None:
            # A device that counts from 0 shows its first point only by its coordinates, where none stood before.
            self._is_running = counter != self._old[0] or (any(held) and not any(self._old[1]))
        return not self._is_running


class Ring(Pattern):
    """Point number n lies in place n modulo entries, and `written` runs ahead; points that were overrun are lost, and counted.

    What a device wrote whose scan is over when the run begins is older than the scan, and is not read.

    The first read tries to get a damaged point sound, since a ring can be read again; after a few tries it is lost.
    """

    def begin(self, first: int = 0) -> None:
        """Forget what was read."""
        self.begin_turn()
        self._read_so_far = self._written = first
        self._older: int | None = None  # what was written when the run began and the device's scan was over
        self._base = first  # the place of the scan's first point
        self._rereads = 0
        self._first_place: int | None = None  # the first place whose point was received, and the one after the last
        self._next_place = 0

    def hear_status(self, values: Mapping[str, int]) -> None:
        """Read on up to what is written, if it has moved."""
        assert self._map.status is not None
        if self._account.is_before_the_scan:  # whatever is written is of an older scan; the next one goes on there, or begins with 0
            self._read_so_far = self._written = self._base = self._older = values["written"]
            self.idle = True
            return
        if self._older is not None and values["written"] < self._older:
            self._read_so_far = self._written = self._base = 0
        self._older = None
        modulus = 1 << 16 * self._map.status.fields["written"].registers
        ahead = (values["written"] - self._written + modulus // 2) % modulus - modulus // 2
        if self._account.contradicts(backward=ahead < 0):
            return
        self._written += ahead
        overrun = self._written - self._map.points.entries
        self._read_so_far = max(self._read_so_far, overrun)  # what was overrun is lost: the sequence numbers will say so
        if self._written > self._read_so_far:
            self.step, self.idle = "points", False
        else:
            self.idle = True
            self._end_if_finished()

    def take_points(self, read: Entries) -> None:
        """Take the points up to a damaged one, which is read again."""
        place, taken = self._read_so_far, self._count_worth_taking(read.sound)
        self._read_so_far += taken
        part = read.head(taken)
        self._account.hear_overflow("points", part)
        self._count_damage(read.sound)
        values = {name: column[part.sound] for name, column in part.values.items()}
        numbers = self._account.number(values, int(part.sound.sum()))
        self._account.hand_over(values, numbers)
        self._note_places(place + np.flatnonzero(part.sound)[numbers >= 0])
        self.idle = False
        self.step = "points" if self._read_so_far < self._written else "status"

    def _points_request(self) -> bytes:
        """Ask for what is written and not read, up to the end of the ring and to what one answer carries."""
        block = self._map.points
        place, room = self._read_so_far % block.entries, MOST_REGISTERS // block.size
        count = min(self._written - self._read_so_far, block.entries - place, room)
        return read_request(self._function, block.at + place * block.size, count * block.size)

    def _count_worth_taking(self, sound: NDArray[np.bool_]) -> int:
        """Return how many points to take: up to a damaged one, which is read again, but not for ever."""
        self._rereads = 0 if sound.all() else self._rereads + 1
        if 0 < self._rereads < PATIENCE:
            return int(sound.argmin())
        self._rereads = 0
        return len(sound)

    def _note_places(self, places: NDArray[np.int64]) -> None:
        """Note the places whose points were received: neither damaged nor repeated."""
        if len(places):
            self._first_place = int(places[0]) if self._first_place is None else self._first_place
            self._next_place = int(places[-1]) + 1

    def _end_if_finished(self) -> None:
        """Close the scan if the device has told its end.

        A device that does not tell how many points it sent has sent those it wrote; what is lost before the first point and after
        the last one does not show in their counters.
        """
        if self._account.ends_without_count:
            before, last = (self._written, self._written) if self._first_place is None else (self._first_place, self._next_place)
            self._out.append_loss(before - self._base + self._written - last, "written by the device, never received soundly")
        self._account.end_if_finished()


class Queue(Pattern):
    """Reading the block `pop` takes the oldest message out of the device's queue; the points block, read after it, belongs to it."""

    def begin(self, first: int = 0) -> None:
        """Forget what was read."""
        self.begin_turn()
        self._message: Columns = {}
        self._older: int | None = None  # the counter of the last message before the scan, which is shown until the next one comes

    def take_pop(self, registers: bytes) -> None:
        """Read the rest of the message, if it is a new one."""
        assert self._map.pop is not None
        popped = entries_of(self._map.pop, self._map.word_order, registers)
        self._message = popped.values
        self._account.hear_overflow("pop", popped)
        sequence = self._map.pop.fields.get("sequence")
        counter = int(self._message["sequence"][0]) if sequence else None
        if (
            sequence is not None
            and counter is not None
            and (counter in (sequence.invalid, self._older) or self._account.is_repeated(counter))
        ):
            self.end_turn()
            return
        self._older = counter if self._account.is_before_the_scan else None
        self.step, self.idle = "points", False

    def take_points(self, read: Entries) -> None:
        """Take the message; the status is read again when the queue is empty, or while the scan has not begun."""
        self._account.hear_overflow("points", read)
        self._hand_over({**self._message, **read.values}, read.sound)
        self.idle = False
        self.step = "status" if self._account.is_before_the_scan else "pop"


class Fifo(Pattern):
    """Function 24 at the address of the points block hands over up to 31 registers, and the device forgets them."""

    def take_points(self, read: Entries) -> None:
        """Take the points; the status is read again when the queue is empty, or while the scan has not begun."""
        self._account.hear_overflow("points", read)
        self._hand_over(read.values, read.sound)
        self.idle = False
        self.step = "status" if self._account.is_before_the_scan else "points"

    def _points_request(self) -> bytes:
        return fifo_request(self._map.points.at)


PATTERN_OF: Mapping[str, type[Pattern]] = MappingProxyType({"latest": Latest, "ring": Ring, "queue": Queue, "fifo": Fifo})
