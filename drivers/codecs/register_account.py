"""What the counters of a Modbus device say of its points: new, repeated, lost, or counted anew. Every pattern keeps this one account."""

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from drivers.codecs.outbox import LARGEST_MM, NO_PART, Outbox
from drivers.codecs.register_map import Entries, RegisterField, RegisterMap, equals_pattern
from drivers.codecs.sequence import MOST_POINTS, SequenceCounter, WrappingClock
from drivers.source import ANOTHER_CONTENT, OLDER_THAN_THE_SCAN, POINT_REPEATED, Heartbeat, PointBatch, Rejected, ScanClosed

AS_IT_BEGAN = "came as the scan began: whether they are of it or older is not known"
PATIENCE = 3  # answers in a row that contradict what was read before, until the device is believed to have begun anew
TINIEST = 1e-30  # of a stored number that a device means: what lies nearer to zero is read from the wrong registers
WIDEST = 62  # bits of a counter that are unwrapped

Columns = Mapping[str, NDArray[np.generic]]


class RegisterAccount:
    """The account of one scan.

    seen, senseless, sensible_swapped   how many new points came, how many of them no part can have, and how many of these it could
                                        have with the registers of their numbers swapped
    count        the scan ends after so many points by the device's counter, for devices that tell no end; None: it goes on
    first        number of the first point; None: the first that arrives, or 0 where the device tells how many it sent
    begin_anew   called when the device has begun anew; it has to call `begin`
    """

    def __init__(
        self, register_map: RegisterMap, out: Outbox, *, count: int | None, first: int | None, begin_anew: Callable[[], None]
    ) -> None:
        self._fields: dict[str, RegisterField] = {**(register_map.pop.fields if register_map.pop else {}), **register_map.points.fields}
        self._state = register_map.status.fields.get("state") if register_map.status else None
        self._out = out
        self._count = count
        self._begin_anew = begin_anew
        self._heartbeat: int | None = None
        self.seen = self.senseless = self.sensible_swapped = 0
        self._ran = self._is_over = False  # whether the device was seen scanning, and whether it last said that its scan is over
        self._held = 0  # points that came while it said so and had not run: the next status tells whether they are older
        self._overflow: dict[str, bool] = {}  # of each block: what one says is not taken back by another
        self.begin(first)

    def begin(self, first: int | None = None) -> None:
        """Begin a scan; `first` is the number of its first point, if it is known."""
        sequence, time = self._fields.get("sequence"), self._fields.get("time")
        self._counter = SequenceCounter(1 << _bits(sequence) if sequence else 1 << WIDEST, first or 0)
        self._clock = WrappingClock(1 << _bits(time), 1.0 / time.scale) if time else None
        self._first = first
        self._sent: int | None = None
        self._finished = self._closed = False
        self._backward = 0

    @property
    def ends_without_count(self) -> bool:
        """Whether the device has just told its end, and not how many points it sent."""
        return self._finished and not self._closed and self._sent is None

    def hear_status(self, values: Mapping[str, int]) -> None:
        """Take note of how many points the device sent, whether its scan is over, and whether it is alive."""
        if "heartbeat" in values and values["heartbeat"] != self._heartbeat:
            if self._heartbeat is not None:
                self._out.append(Heartbeat())
            self._heartbeat = values["heartbeat"]
        self._sent = values.get("sent")
        over = self._state is not None and self._state.finished is not None and values["state"] == self._state.finished
        self._ran |= not over
        self._is_over = over
        self._finished = over and not self.is_before_the_scan
        held, self._held = self._held, 0
        if held:
            self._out.append(Rejected(held, OLDER_THAN_THE_SCAN if self.is_before_the_scan else AS_IT_BEGAN))

    @property
    def is_before_the_scan(self) -> bool:
        """Whether the device said that its scan is over and was not seen scanning in this run: what it holds is of an older scan."""
        return self._is_over and not self._ran and self._first is None

    def hold(self, count: int) -> None:
        """Take note of points that came before the scan, as far as is known yet."""
        self._held += count

    def hear_overflow(self, where: str, read: Entries) -> None:
        """Take note of the device's own losses, which it tells in a block once or with every point of it."""
        if "overflow" not in read.values:
            return
        for overflow in (read.values["overflow"][read.sound] != 0).tolist():
            if overflow and not self._overflow.get(where):
                self._out.append_overflow()
            self._overflow[where] = overflow

    def is_repeated(self, counter: int) -> bool:
        """Tell whether a point with this counter is the last one that arrived."""
        return self._first is not None and self._counter.unwrap(counter) == self._counter.expected - 1

    def tells_running(self, counter: int | None) -> bool:
        """Tell whether the device's status says that the point with this counter was taken in a scan that is not over."""
        return counter is not None and not self._finished and self._sent is not None and 0 <= counter < self._sent

    def contradicts(self, *, backward: bool) -> bool:
        """Tell whether an answer goes back behind an earlier one; several in a row mean that the device began anew."""
        if not backward:
            self._backward = 0
            return False
        self._backward += 1
        if self._backward >= PATIENCE:
            self._begin_anew()
        return True

    def number(self, values: Columns, count: int) -> NDArray[np.int64]:
        """Account for `count` points; return their unwrapped numbers, (count,), -1 for repetitions."""
        expected = self._counter.expected + np.arange(count)
        if "sequence" not in values:
            self._first = self._first or 0
            self._counter.expected += count
            return expected
        counters, contents = values["sequence"].astype(np.int64), _contents(values, count)
        if self._first is not None and np.array_equal(counters, expected % self._counter.modulus):
            self._counter.take(contents)
            return expected
        return np.array(
            [self._number_of(int(counter), content) for counter, content in zip(counters, contents, strict=True)], dtype=np.int64
        )

    def hand_over(self, values: Columns, numbers: NDArray[np.int64]) -> None:
        """Hand over the points that are no repetitions and that the device does not mark invalid."""
        usable = numbers >= 0
        self._suspect_word_order(values, usable & ~self._find_marked(values, len(usable)))
        usable[usable] = ~self._find_invalid({name: column[usable] for name, column in values.items()}, int(usable.sum()))
        if usable.any():
            self._out.append(PointBatch(numbers[usable], self._seconds(values, usable), self._points_mm(values, usable)))
        if self._count is not None and self._first is not None and self._counter.expected - self._first >= self._count:
            self._close()

    def _find_marked(self, values: Columns, count: int) -> NDArray[np.bool_]:
        """Tell of which of `count` points the device itself says that they hold no value: these say nothing of the map."""
        marked = np.zeros(count, dtype=np.bool_)
        for name, column in values.items():
            field = self._fields[name]
            if field.invalid is not None:
                marked |= equals_pattern(column, field.invalid, field.type)
            if field.invalid_bits:
                marked |= column.astype(np.int64) & field.invalid_bits != 0
        return marked

    def _suspect_word_order(self, values: Columns, new: NDArray[np.bool_]) -> None:
        """Remember of how many new points no coordinate makes sense, and of how many of these it would with the words swapped."""
        if not new.any():
            return
        names = [name for name in "xyz" if name in values]
        read = np.array([_makes_sense(self._fields[name], values[name][new]) for name in names]).all(axis=0)
        swapped = np.array([_makes_sense(self._fields[name], _swapped(values[name][new])) for name in names]).all(axis=0)
        self.senseless += int((~read).sum())
        self.sensible_swapped += int((~read & swapped).sum())
        self.seen += int(new.sum())

    def end_if_finished(self) -> None:
        """Close the scan if the device has told its end."""
        if self._finished:
            self._close()

    def _close(self) -> None:
        if self._closed:
            return
        self._closed = True
        if self._sent is not None:
            self._out.append_loss(self._counter.reach(self._sent))
        self._out.append(ScanClosed(self._sent))

    def _number_of(self, counter: int, content: int) -> int:
        """Account for one point by its counter and what it holds; return its number, or -1 if it is a repetition."""
        if self._first is None:
            # a device that tells how many it sent begins with 0
            self._first = 0 if self._sent is not None else counter % self._counter.modulus
            self._counter = SequenceCounter(self._counter.modulus, self._first)
        ahead = self._counter.unwrap(counter) - self._counter.expected
        if self._counter.expected + ahead - self._first > MOST_POINTS:
            self._out.append(Rejected(1, "number that no scan reaches"))
            return -1
        place = self._counter.place(counter, content=content)
        if place.repeated:
            self._out.append(Rejected(1, POINT_REPEATED if place.same else ANOTHER_CONTENT))
            return -1
        self._out.append_loss(place.lost)
        return place.sequence

    def _find_invalid(self, values: Columns, count: int) -> NDArray[np.bool_]:
        """Tell which of `count` points the device marks invalid, and count them by their reasons."""
        invalid = np.zeros(count, dtype=np.bool_)
        for name, column in values.items():
            field = self._fields[name]
            for reason, struck in (
                (f"{name} holds no value", equals_pattern(column, field.invalid, field.type) if field.invalid is not None else None),
                ("marked invalid by the device", column.astype(np.int64) & field.invalid_bits != 0 if field.invalid_bits else None),
                (f"{name} is no number", ~np.isfinite(column) if field.type.startswith("float") else None),
                (NO_PART, ~_makes_sense(field, column) if name in "xyz" else None),
            ):
                if struck is not None and (new := struck & ~invalid).any():
                    self._out.append(Rejected(int(new.sum()), reason))
                    invalid |= new
        return invalid

    def _seconds(self, values: Columns, usable: NDArray[np.bool_]) -> NDArray[np.float64]:
        """Return the times of the usable points; a device without a clock always says 0."""
        time = self._fields.get("time")
        if self._clock is None or time is None:
            return np.zeros(int(usable.sum()))
        if time.type.startswith("float"):
            with np.errstate(over="ignore"):  # what is no time is rejected where it leaves
                return np.asarray(values["time"][usable].astype(np.float64) * time.scale)
        return self._clock.seconds(values["time"][usable].astype(np.int64))

    def _points_mm(self, values: Columns, usable: NDArray[np.bool_]) -> NDArray[np.float64]:
        points_mm = np.zeros((int(usable.sum()), 3))
        for axis, name in enumerate("xyz"):
            if name in self._fields:
                points_mm[:, axis] = self._fields[name].to_unit(values[name][usable].astype(np.float64))
        return points_mm


def _makes_sense(field: RegisterField, column: NDArray[np.generic]) -> NDArray[np.bool_]:
    """Tell of each value whether it can be a coordinate: neither too large nor, but for 0, so small that it is another number's bits."""
    with np.errstate(all="ignore"):
        value_mm = np.abs(field.to_unit(column.astype(np.float64)))
        tiny = (column != 0) & (np.abs(column.astype(np.float64)) < TINIEST) if field.type.startswith("float") else np.False_
        return np.asarray((value_mm <= LARGEST_MM) & ~tiny)


def _contents(values: Columns, count: int) -> list[int]:
    """Return of each of `count` points a number that points which differ in a coordinate do not share, but for a rare chance."""
    raw = [values[name].tobytes() for name in "xyz" if name in values]
    sizes = [len(data) // count for data in raw] if count else []
    return [hash(b"".join(data[i * size : (i + 1) * size] for data, size in zip(raw, sizes, strict=True))) for i in range(count)]


def _swapped(column: NDArray[np.generic]) -> NDArray[np.generic]:
    """Return values whose registers come in the other order."""
    words = np.ascontiguousarray(column).view(">u2").reshape(len(column), column.itemsize // 2)
    return np.ascontiguousarray(words[:, ::-1]).view(column.dtype)[:, 0]


def _bits(field: RegisterField) -> int:
    return min(WIDEST, 16 * field.registers)
