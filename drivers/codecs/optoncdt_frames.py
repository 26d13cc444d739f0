"""Micro-Epsilon optoNCDT 1420 on RS422: three-byte words between ASCII replies; decoder.

Facts: manual ILD1420, p. 65-66, 84, 97-98. A value is three bytes, low, middle, high: `00 D5..D0`, `01 D11..D6`,
`1f DD D15..D12`; f clear: first value (the distance) of a new block, f set: a further value of it; DD: D17 D16. The
bits f and DD were read from a page whose layout is damaged: to be confirmed on a sensor. Distance of the 16-bit,
unmastered output: 643 to 64877 is the measuring range, d = range / 100 * (102 / 65520 * value - 1). Values from 262075
on are errors. The sensor answers commands in ASCII, ending with the prompt `->`, on the same wire while it streams.

Which further values come, and in which order, is asked of the sensor (GETOUTINFO_RS422), never assumed; the counter
(18 bits) must be among them, as nothing else shows a loss. There is no checksum: a flipped data bit is a wrong
distance unless `largest_step_mm` gives it away. Counter and clock are believed when two values in a row agree.

Points are (0, 0, distance); an axis puts them where they belong.
"""

import re

import numpy as np
from numpy.typing import NDArray

from drivers.codecs.sequence import SequenceCounter, WrappingClock
from drivers.errors import DeviceRefused, ProtocolError
from drivers.source import Arrival, Damaged, Lost, PointBatch, Rejected, ScanClosed, ScanOpened

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
COUNTER_RANGE, CLOCK_RANGE, TICKS_PER_SECOND = 1 << 18, 1 << 32, 1e5
TAGS = np.array([192, 192, 192], dtype=np.uint8)
RUN = 1024  # blocks looked at together
PROMPT = b"->"
SHORTEST_REPLY, LONGEST_REPLY = 3, 4096
OUTPUTS = re.compile(r"\b(DIST1|DIST_RAW|DIST|SHUTTER|COUNTER|TIMESTAMP(?:_?LO|_?HI)?|INTENSITY|STATE)\b")
WORDS = re.compile(rb"[\x00-\x3f][\x40-\x7f][\x80-\xff]")


def _ticks(values: dict[str, int]) -> int:
    return (values["TIMESTAMPHI"] & 0xFFFF) << 16 | (values["TIMESTAMPLO"] & 0xFFFF)


class OptoncdtDecoder:
    """Bytes of the sensor to arrivals.

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
        self._largest_step_mm = largest_step_mm
        self._asked = False
        self._text = b""
        self._outputs: list[str] | None = None
        self._block: list[int] = []
        self._last: dict[str, int] | None = None
        self._held: dict[str, int] | None = None
        self._counter: SequenceCounter | None = None
        self._first = 0
        self._clock = WrappingClock(CLOCK_RANGE, TICKS_PER_SECOND)
        self._before_mm: float | None = None
        self._closed = False
        self._out: list[Arrival] = []
        self._rows: list[tuple[int, int, float]] = []

    def request(self) -> bytes:
        """Ask, each time the link opens, for counter and clock beside the distance, for the order of the values, and for the stream."""
        if self._asked:
            return b""
        self._asked = True
        return b"OUTPUT NONE\nOUTADD_RS422 COUNTER TIMESTAMP\nGETOUTINFO_RS422\nOUTPUT RS422\n"

    def feed(self, data: bytes) -> list[Arrival]:
        """Decode the next bytes."""
        data = self._text + data
        at = 0
        while True:
            at += self._run(data, at)
            found = WORDS.search(data, at)
            if found is None:
                break
            self._other_bytes(data[at : found.start()])
            self._word(*found.group())
            at = found.end()
        self._text = self._replies(data[at:])
        return self._handed_over()

    def interrupted(self) -> list[Arrival]:
        """Count what was begun as damaged; ask again when the link is back."""
        pending = len(self._text) + 3 * len(self._block)
        if pending:
            self._say(Damaged(pending, "cut off where the link ended"))
        self._text, self._block, self._asked = b"", [], False
        return self._handed_over()

    def _run(self, data: bytes, start: int) -> int:
        """Take whole, sound blocks that follow on, many at once; return the number of bytes used."""
        if self._outputs is None or self._last is None or self._held or self._block or self._closed or self._counter is None:
            return 0
        words = len(self._outputs)
        count = min((len(data) - start) // (3 * words), RUN)
        if self._count is not None:
            count = min(count, int(self._count) - 1 - (self._counter.expected - self._first))
        if count < 2:
            return 0
        raw = np.frombuffer(data, np.uint8, count * 3 * words, start).reshape(count, words, 3)
        tags = np.array([[0, 64, 128]] + (words - 1) * [[0, 64, 192]])  # the first word of a block, and the further ones
        sound = ((raw & TAGS) == tags).all(axis=(1, 2))
        values = (raw.astype(np.int64) & 63) @ (1, 1 << 6, 1 << 12)  # (count, words)
        place = {name: index for index, name in enumerate(self._outputs)}
        counters = values[:, place["COUNTER"]]
        ticks = (values[:, place["TIMESTAMPHI"]] & 0xFFFF) << 16 | (values[:, place["TIMESTAMPLO"]] & 0xFFFF)
        steps = np.diff(ticks, prepend=_ticks(self._last)) % CLOCK_RANGE
        good = sound & (np.diff(counters, prepend=self._last["COUNTER"]) % COUNTER_RANGE == 1)
        if self._rate_hz is not None:
            good &= np.abs(steps * self._rate_hz / TICKS_PER_SECOND - 1.0) <= 0.5
        distance = values[:, 0]
        good &= (distance >= FIRST_IN_RANGE) & (distance <= LAST_IN_RANGE)
        distance_mm = np.asarray(self._range_mm / 100.0 * (SCALE * distance - 1.0), dtype=np.float64)
        if self._largest_step_mm is not None:
            before_mm = distance_mm[0] if self._before_mm is None else self._before_mm
            good &= np.abs(np.diff(distance_mm, prepend=before_mm)) <= self._largest_step_mm
        count = count if good.all() else int(good.argmin())
        if count:
            self._take_run(count, ticks[:count], distance_mm[:count])
            self._last = dict(zip(self._outputs, values[count - 1].tolist(), strict=True))
        return count * 3 * words

    def _take_run(self, count: int, ticks: NDArray[np.int64], distance_mm: NDArray[np.float64]) -> None:
        assert self._counter is not None
        self._flush()
        first = self._counter.expected
        self._counter.expected = first + count
        self._before_mm = float(distance_mm[-1])
        points_mm = np.zeros((count, 3))
        points_mm[:, 2] = distance_mm
        self._out.append(PointBatch(first - self._first + np.arange(count), self._clock.seconds(ticks), points_mm))

    def _other_bytes(self, data: bytes) -> None:
        """Take what stands between two words: replies, or damage."""
        rest = self._replies(data)
        if rest:
            self._say(Damaged(len(rest), "neither value nor reply"))

    def _replies(self, data: bytes) -> bytes:
        """Read the replies that end with a prompt; return what follows the last one."""
        *replies, rest = data.split(PROMPT)
        for reply in replies:
            if len(reply) + len(PROMPT) < SHORTEST_REPLY or not reply.replace(b"\r", b"").replace(b"\n", b"").isascii():
                self._say(Damaged(len(reply) + len(PROMPT), "neither value nor reply"))
            else:
                self._reply(reply.decode("ascii"))
        while len(rest) > LONGEST_REPLY:
            self._say(Damaged(LONGEST_REPLY, "neither value nor reply"))
            rest = rest[LONGEST_REPLY:]
        return rest

    def _reply(self, text: str) -> None:
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
            self._say(ScanOpened("optoNCDT 1420", "", self._count))
        self._outputs = outputs

    def _word(self, low: int, middle: int, high: int) -> None:
        value = (low & 63) | (middle & 63) << 6 | (high & 63) << 12
        if self._outputs is None:
            self._say(Rejected(0 if high & 0x40 else 1, "came before the sensor told its outputs"))
            return
        if not high & 0x40 and self._block:
            self._incomplete()
        if high & 0x40 and not self._block:
            self._say(Damaged(3, "value of no block"))
            return
        self._block.append(value)
        if len(self._block) == len(self._outputs):
            block, self._block = self._block, []
            self._complete(dict(zip(self._outputs, block, strict=True)))

    def _incomplete(self) -> None:
        self._say(Damaged(3 * len(self._block), "block with values missing"))
        self._block = []

    def _complete(self, values: dict[str, int]) -> None:
        """Accept a block that follows on; hold any other until the next one confirms or contradicts its counter and clock."""
        if self._last is None or self._follows(self._last, values):
            self._contradicted()
            self._accept(values)
        elif self._held is not None and self._follows(self._held, values):
            held, self._held = self._held, None
            self._accept(held)
            self._accept(values)
        else:
            self._contradicted()
            self._held = values

    def _contradicted(self) -> None:
        if self._held is not None:
            self._say(Damaged(3 * len(self._held), "counter or clock contradicted by the next value"))
            self._held = None

    def _follows(self, before: dict[str, int], values: dict[str, int]) -> bool:
        if (values["COUNTER"] - before["COUNTER"]) % COUNTER_RANGE != 1:
            return False
        ticks = (_ticks(values) - _ticks(before)) % CLOCK_RANGE
        return self._rate_hz is None or abs(ticks * self._rate_hz / TICKS_PER_SECOND - 1.0) <= 0.5

    def _accept(self, values: dict[str, int]) -> None:
        if self._closed:
            return
        self._last = values
        if self._counter is None:
            self._first = values["COUNTER"]
            self._counter = SequenceCounter(COUNTER_RANGE, self._first)
        place = self._counter.place(values["COUNTER"])
        if place.lost:
            self._say(Lost(place.lost, "gap in the sensor's counter" if place.lost > 0 else "arrived late after all"))
        reason, distance_mm = ("value repeated", 0.0) if place.repeated else self._distance(values["DIST1"])
        if reason:
            self._say(Rejected(1, reason))
        else:
            self._rows.append((place.sequence - self._first, _ticks(values), distance_mm))
        if self._count is not None and self._counter.expected - self._first >= self._count:
            self._say(ScanClosed(None))
            self._closed = True

    def _distance(self, value: int) -> tuple[str, float]:
        """Return why a value is no distance, or the distance."""
        if value in ERRORS:
            return ERRORS[value], 0.0
        if not FIRST_IN_RANGE <= value <= LAST_IN_RANGE:
            return "outside the measuring range", 0.0
        distance_mm = self._range_mm / 100.0 * (SCALE * value - 1.0)
        before_mm, self._before_mm = self._before_mm, distance_mm
        if self._largest_step_mm is not None and before_mm is not None and abs(distance_mm - before_mm) > self._largest_step_mm:
            return "jump larger than the plan allows", 0.0
        return "", distance_mm

    def _say(self, arrival: Arrival) -> None:
        self._flush()
        self._out.append(arrival)

    def _flush(self) -> None:
        if not self._rows:
            return
        sequence, ticks, distance_mm = (np.array(column) for column in zip(*self._rows, strict=True))
        self._rows = []
        points_mm = np.zeros((len(sequence), 3))
        points_mm[:, 2] = distance_mm
        self._out.append(PointBatch(sequence.astype(np.int64), self._clock.seconds(ticks.astype(np.int64)), points_mm))

    def _handed_over(self) -> list[Arrival]:
        self._flush()
        out, self._out = self._out, []
        return out


DECODERS = {"optoncdt": OptoncdtDecoder}
