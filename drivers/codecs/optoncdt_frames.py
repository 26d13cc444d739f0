"""Micro-Epsilon optoNCDT 1420 on RS422: three-byte words between ASCII replies; decoder.

Facts: manual ILD1420, p. 65-66, 84, 97-98. A value is three bytes, low, middle, high: `00 D5..D0`, `01 D11..D6`,
`1f DD D15..D12`; f clear: first value (the distance) of a new block, f set: a further value of it; DD: D17 D16. The
bits f and DD were read from a page whose layout is damaged: to be confirmed on a sensor. Distance of the 16-bit,
unmastered output: 643 to 64877 is the measuring range, d = range / 100 * (102 / 65520 * value - 1). Values from 262075
on are errors. The sensor answers commands in ASCII, ending with the prompt `->`, on the same wire while it streams.

Which further values come, and in which order, is asked of the sensor (GETOUTINFO_RS422), never assumed; the counter
(18 bits) must be among them, as nothing else shows a loss. The sensor is told to be silent first: values before its
first answer are older than the scan, those between that answer and the order of the values are lost to it. There is no
checksum: a flipped data bit is a wrong distance unless `largest_step_mm` gives it away. Counter and clock are believed
when two values in a row agree.

Points are (0, 0, distance); an axis puts them where they belong.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from drivers.codecs.distances import Distances
from drivers.codecs.sequence import SequenceCounter, WrappingClock
from drivers.errors import DeviceRefused, ProtocolError
from drivers.source import ANOTHER_CONTENT, OLDER_THAN_THE_SCAN, VALUE_REPEATED, Arrival, Damaged, Rejected, ScanOpened

ERRORS = {
    262075: "too much data for the baud rate",
    262076: "no peak",
    262077: "before the measuring range",
    262078: "behind the measuring range",
    262080: "not computable",
    262081: "peak too large",
    262082: "laser off",
}
FIRST_IN_RANGE, LAST_IN_RANGE = 643, 64877
SCALE = 102.0 / 65520.0
BEFORE_THE_OUTPUTS = "came before the sensor told its outputs"
COUNTER_RANGE, CLOCK_RANGE, TICKS_PER_SECOND = 1 << 18, 1 << 32, 1e5
TAGS = np.array([192, 192, 192], dtype=np.uint8)
RUN = 1024  # blocks looked at together at most
SHORTEST_RUN = 4  # and where runs keep breaking off, so that a block costs about the same, whatever stands behind it
PROMPT = b"->"
SHORTEST_REPLY, LONGEST_REPLY = 3, 4096
OUTPUTS = re.compile(r"\b(DIST1|DIST_RAW|DIST|SHUTTER|COUNTER|TIMESTAMP(?:_?LO|_?HI)?|INTENSITY|STATE)\b")
Whole = int | NDArray[np.int64]
Number = TypeVar("Number", float, NDArray[np.float64])
WORDS = re.compile(rb"(?:[\x00-\x3d\x3f]|(?<!-)>)[\x40-\x7f][\x80-\xff]")  # a prompt is never the beginning of one


@dataclass(frozen=True, slots=True)
class _Block:
    """The values that the sensor sends together, of one block or, as arrays (m,), of many."""

    distance: Whole
    counter: Whole
    ticks: Whole

    def follows(self, counter: Whole, ticks: Whole, rate_hz: float | None) -> bool | NDArray[np.bool_]:
        """Tell whether each block comes next after one with this counter and clock."""
        next_one = (self.counter - counter) % COUNTER_RANGE == 1
        if rate_hz is None:
            return next_one
        periods = np.asarray((self.ticks - ticks) % CLOCK_RANGE, dtype=np.float64) * rate_hz / TICKS_PER_SECOND
        return np.asarray(next_one & (np.abs(periods - 1.0) <= 0.5))

    def is_in_range(self) -> bool | NDArray[np.bool_]:
        """Tell whether each distance lies in the measuring range."""
        return (self.distance >= FIRST_IN_RANGE) & (self.distance <= LAST_IN_RANGE)


class OptoncdtDecoder:
    """Bytes of a Micro-Epsilon optoNCDT 1420 distance sensor to arrivals.

    range_mm          the measuring range: 10, 25, 50, 100, 200 or 500 mm
    rate_hz           the measuring rate; if given, a clock that contradicts it is damage
    count             the scan ends after so many values by the sensor's counter; None: it goes on
    largest_step_mm   a larger step from value to value is rejected; None: everything is believed
    """

    def __init__(
        self, range_mm: float, *, rate_hz: float | None = None, count: int | None = None, largest_step_mm: float | None = None
    ) -> None:
        if not range_mm > 0:
            raise ValueError(f"range {range_mm} mm must be positive")
        self._range_mm = range_mm
        self._rate_hz = rate_hz
        self._count = count
        self._clock = WrappingClock(CLOCK_RANGE, TICKS_PER_SECOND)
        self._distances = Distances(self._clock.seconds, gap="gap in the sensor's counter", count=count, largest_step_mm=largest_step_mm)
        self._out = self._distances.out
        self._asked = False
        self._most = RUN  # blocks to look at together: twice as many as were good the last time
        self._text = b""
        self._outputs: list[str] | None = None
        self._before_answer = 0  # values before the sensor's first answer
        self._has_answered = False
        self._places: list[int] = []  # where counter and clock stand among them
        self._words: list[int] = []
        self._last: _Block | None = None  # the last one that was accepted
        self._held: _Block | None = None  # the last one that waits for the next to confirm it
        self._counter: SequenceCounter | None = None
        self._first = 0

    def request(self) -> bytes:
        """Ask, each time the link opens, for counter and clock beside the distance, for the order of the values, and for the stream."""
        if self._asked:
            return b""
        self._asked = True
        return b"OUTPUT NONE\nOUTADD_RS422 COUNTER TIMESTAMP\nGETOUTINFO_RS422\nOUTPUT RS422\n"

    def feed(self, data: bytes) -> list[Arrival]:
        """Decode the next bytes."""
        data, self._text = self._text + data, b""
        at = 0
        while not self._out.closed:
            at += self._take_run(data, at)
            found = WORDS.search(data, at)
            if found is None:
                break
            self._take_other_bytes(data[at : found.start()])
            self._take_word(*found.group())
            at = found.end()
        self._text = b"" if self._out.closed else self._take_replies(data[at:])
        return self._out.hand_over()

    def break_off(self) -> list[Arrival]:
        """Count what was begun as damaged; ask again when the link is back."""
        if self._before_answer:  # no answer ever said that they are older
            self._out.append(Rejected(self._before_answer, BEFORE_THE_OUTPUTS))
            self._before_answer = 0
        pending = len(self._text) + 3 * len(self._words)
        if pending:
            self._out.append(Damaged(pending, "cut off where the link ended"))
        if self._last is None and self._held is not None:  # the only one there is: nothing contradicts it
            held, self._held = self._held, None
            self._accept(held)
        self._text, self._words, self._asked = b"", [], False
        return self._out.hand_over()

    def _take_run(self, data: bytes, start: int) -> int:
        """Take blocks that are whole, sound and next in order, many at once; return the number of bytes used."""
        if self._last is None or self._counter is None or self._held or self._words or self._distances.closed:
            return 0
        values = self._values_ahead(data, start)
        if len(values) < 2:
            return 0
        blocks = self._block_of(values.T)
        distance_mm = self._distance_mm(np.asarray(blocks.distance, dtype=np.float64))
        good = self._are_next(blocks) & blocks.is_in_range() & self._distances.are_steady(distance_mm)
        count = len(good) if good.all() else int(good.argmin())
        self._most = min(RUN, max(SHORTEST_RUN, 2 * count))
        if count:
            self._distances.take_many(np.asarray(blocks.ticks)[:count], distance_mm[:count])
            self._counter.take(np.asarray(blocks.distance)[:count])
            self._last = self._block_of(values[count - 1].tolist())
        return int(count * 3 * values.shape[1])

    def _values_ahead(self, data: bytes, start: int) -> NDArray[np.int64]:
        """Return the values (m, words) of the blocks ahead, up to the first whose words do not stand where they belong."""
        words = len(self._outputs or ())
        count = self._distances.room(min((len(data) - start) // (3 * words), self._most))
        if count < 2:
            return np.empty((0, words), dtype=np.int64)
        raw = np.frombuffer(data, np.uint8, count * 3 * words, start).reshape(count, words, 3)
        tags = np.array([[0, 64, 128]] + (words - 1) * [[0, 64, 192]])  # the first word of a block, and the further ones
        sound = ((raw & TAGS) == tags).all(axis=(1, 2))
        values = (raw.astype(np.int64) & 63) @ (1, 1 << 6, 1 << 12)
        return np.asarray(values if sound.all() else values[: int(sound.argmin())])

    def _are_next(self, blocks: _Block) -> NDArray[np.bool_]:
        """Tell of each of many blocks whether it follows the one before it and is the one that the counter expects."""
        assert self._last is not None
        assert self._counter is not None
        counter, ticks = np.asarray(blocks.counter), np.asarray(blocks.ticks)
        before = [np.concatenate([[first], column[:-1]]) for first, column in ((self._last.counter, counter), (self._last.ticks, ticks))]
        expected = (self._counter.expected + np.arange(len(counter))) % COUNTER_RANGE
        return np.asarray(blocks.follows(before[0], before[1], self._rate_hz) & (counter == expected))

    def _block_of(self, values: Sequence[int] | NDArray[np.int64]) -> _Block:
        """Pick distance, counter and clock out of the values of a block, or out of the columns (words, m) of many blocks."""
        counter, low, high = self._places
        return _Block(values[0], values[counter], (values[high] & 0xFFFF) << 16 | (values[low] & 0xFFFF))

    def _distance_mm(self, value: Number) -> Number:
        return self._range_mm / 100.0 * (SCALE * value - 1.0)

    def _take_other_bytes(self, data: bytes) -> None:
        """Take what stands between two words: replies, or damage."""
        rest = self._take_replies(data)
        if rest:
            self._out.append(Damaged(len(rest), "neither value nor reply"))

    def _take_replies(self, data: bytes) -> bytes:
        """Read the replies that end with a prompt; return what follows the last one."""
        *replies, rest = data.split(PROMPT)
        for reply in map(self._drop_excess, replies):
            if len(reply) + len(PROMPT) < SHORTEST_REPLY or not reply.replace(b"\r", b"").replace(b"\n", b"").isascii():
                self._out.append(Damaged(len(reply) + len(PROMPT), "neither value nor reply"))
            else:
                self._take_reply(reply.decode("ascii"))
        return self._drop_excess(rest, PROMPT[:1])

    def _drop_excess(self, text: bytes, open_end: bytes = b"") -> bytes:
        """Count what no reply can hold as damage at fixed places, however the bytes are cut; `open_end` may be a prompt's beginning."""
        while len(text.removesuffix(open_end)) > LONGEST_REPLY:
            self._out.append(Damaged(LONGEST_REPLY, "neither value nor reply"))
            text = text[LONGEST_REPLY:]
        return text

    def _take_reply(self, text: str) -> None:
        self._has_answered = True
        if self._before_answer:
            self._out.append(Rejected(self._before_answer, OLDER_THAN_THE_SCAN))
            self._before_answer = 0
        error = re.search(r"\bE\d{2}\b.*", text)
        if error:
            raise DeviceRefused(f"the sensor answered {error[0].strip()!r}; check its firmware and settings")
        if "GETOUTINFO_RS422" not in text and not OUTPUTS.match(text.strip()):
            return
        outputs: list[str] = []
        for name in OUTPUTS.findall(text):
            outputs += {"DIST": ["DIST1"], "TIMESTAMP": ["TIMESTAMPLO", "TIMESTAMPHI"]}.get(name, [name.replace("_", "")])
        if outputs[:1] != ["DIST1"] or not {"COUNTER", "TIMESTAMPLO", "TIMESTAMPHI"} <= set(outputs):
            raise ProtocolError(f"the sensor sends {' '.join(outputs) or 'nothing'}; DIST1, COUNTER and TIMESTAMP are needed")
        if self._outputs is None:
            self._out.append(ScanOpened("optoNCDT 1420", "", self._count))
        self._outputs = outputs
        self._places = [outputs.index(name) for name in ("COUNTER", "TIMESTAMPLO", "TIMESTAMPHI")]

    def _take_word(self, low: int, middle: int, high: int) -> None:
        value = (low & 63) | (middle & 63) << 6 | (high & 63) << 12
        if self._outputs is None:
            self._take_value_of_unknown_order(is_first=not high & 0x40)
            return
        if not high & 0x40 and self._words:
            self._out.append(Damaged(3 * len(self._words), "block with values missing"))
            self._words = []
        if high & 0x40 and not self._words:
            self._out.append(Damaged(3, "value of no block"))
            return
        self._words.append(value)
        if len(self._words) == len(self._outputs):
            words, self._words = self._words, []
            self._take_block(self._block_of(words))

    def _take_value_of_unknown_order(self, *, is_first: bool) -> None:
        """Count a block that comes before the order of its values is known."""
        if not self._has_answered:
            self._before_answer += is_first
        elif is_first:
            self._out.append(Rejected(1, BEFORE_THE_OUTPUTS))

    def _take_block(self, block: _Block) -> None:
        """Accept a block that follows on; hold any other until the next one confirms or contradicts its counter and clock."""
        held, self._held = self._held, None
        if self._confirms(block, self._last):
            self._drop(held)
            self._accept(block)
        elif held is not None and self._confirms(block, held):
            self._accept(held)
            self._accept(block)
        else:
            self._drop(held)
            self._held = block

    def _confirms(self, block: _Block, before: _Block | None) -> bool:
        return before is not None and bool(block.follows(before.counter, before.ticks, self._rate_hz))

    def _drop(self, held: _Block | None) -> None:
        if held is not None:
            self._out.append(Damaged(3 * len(self._outputs or ()), "counter or clock contradicted by the next value"))

    def _accept(self, block: _Block) -> None:
        if self._distances.closed:
            return
        self._last = block
        counter, ticks, value = int(block.counter), int(block.ticks), int(block.distance)
        if self._counter is None:
            self._first = counter
            self._counter = SequenceCounter(COUNTER_RANGE, self._first)
        place = self._counter.place(counter, content=value)
        repeated = VALUE_REPEATED if place.same else ANOTHER_CONTENT
        refusal = repeated if place.repeated else self._refusal(block)
        distance_mm = None if refusal else self._distance_mm(float(value))
        self._distances.take(place.sequence - self._first, ticks, distance_mm, lost=place.lost, refusal=refusal)

    def _refusal(self, block: _Block) -> str:
        """Return why a value is no distance, or nothing if it is one."""
        if block.distance in ERRORS:
            return ERRORS[int(block.distance)]
        return "" if block.is_in_range() else "outside the measuring range"


UNSEEN = {"optoncdt": "values carry no checksum: a flipped bit shows only as a jump (largest_step_mm)"}
AXES = {"optoncdt": ("z",)}  # a distance
DECODERS = {"optoncdt": OptoncdtDecoder}
