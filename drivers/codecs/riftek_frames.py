"""RIFTEK RF60x distance sensors: the binary stream of nibbles, and the ASCII lines; decoders.

Facts: manuals of RF602 (2019), p. 12-19, and RF605 (2011), p. 15-17. Request: address byte (bit 7 clear), then
`80 | code`; codes: 1 identify, 6 one result, 7 stream of results, 8 stop. A result is a burst of four bytes
`1 SB CNT1 CNT0 D3 D2 D1 D0`, low nibble first; CNT is the same within a burst and counts bursts modulo 4; SB set:
renewed since the last transmission. Distance = value * range / 16384. ASCII: a request line, answered by a line.

What this format cannot tell, and therefore nobody behind it: there is no checksum, so a flipped data bit is a wrong
distance unless `largest_step_mm` gives it away; CNT counts modulo 4, so a loss of 4, 8, ... bursts in a row goes
unseen, and the time, which is the number of the burst over the rate, is then wrong. After a lost link it would be
anybody's guess: the scan has to begin anew. The ASCII lines carry no counter at all.

Points are (0, 0, distance); an axis puts them where they belong.
"""

import re

from drivers.codecs.distances import Distances
from drivers.errors import ProtocolError
from drivers.source import Arrival, Damaged

FULL_SCALE = 16384
STREAM, STOP = 7, 8
LONGEST_LINE = 64
NUMBER = re.compile(rb"-?[0-9]{1,6}(\.[0-9]{1,6})?")


def _distances(rate_hz: float, count: int | None, largest_step_mm: float | None, gap: str) -> Distances:
    """Return an account whose clock is the number of the burst over the rate."""
    return Distances(lambda numbers: numbers / rate_hz, gap=gap, count=count, largest_step_mm=largest_step_mm)


class RiftekDecoder:
    """Bytes of a RIFTEK RF60x distance sensor, its binary stream, to arrivals.

    range_mm, address   the sensor's measuring range and network address
    rate_hz             its sampling rate: the only clock there is
    count               the scan ends after so many bursts; None: it goes on
    largest_step_mm     a larger step from burst to burst is rejected; None: everything is believed
    """

    def __init__(
        self, range_mm: float, rate_hz: float, *, address: int = 1, count: int | None = None, largest_step_mm: float | None = None
    ) -> None:
        if not (range_mm > 0 and rate_hz > 0 and 1 <= address <= 127):
            raise ValueError(f"range {range_mm} mm and rate {rate_hz} Hz must be positive, address {address} between 1 and 127")
        self._range_mm = range_mm
        self._address = address
        self._distances = _distances(rate_hz, count, largest_step_mm, "gap in the burst counter")
        self._out = self._distances.out
        self._burst = b""
        self._last_count: int | None = None
        self._asked = self._away = False

    def request(self) -> bytes:
        """Ask, once, for the stream of results; for its end once the scan is over."""
        if self._asked and not self._distances.closed:
            return b""
        self._asked = True
        return bytes([self._address, 0x80 | (STOP if self._distances.closed else STREAM)])

    def feed(self, data: bytes) -> list[Arrival]:
        """Decode the next bytes; a burst counts once the next one begins, so that an inserted byte shows, but the last one at once."""
        if self._away:
            raise ProtocolError("the RIFTEK burst counter cannot tell what was lost while the link was away; begin the scan anew")
        for byte in data:
            if self._distances.closed:
                break
            if byte < 0x80:
                self._end_burst()
                self._out.append(Damaged(1, "byte of no answer"))
            elif self._burst and (byte ^ self._burst[0]) & 0x70:
                self._end_burst()
                self._burst = bytes([byte])
            elif len(self._burst) < 64:
                self._burst += bytes([byte])
            else:
                self._out.append(Damaged(1, "burst without end"))
            if len(self._burst) == 4 and self._distances.would_end(self._distances.expected + self._lost_before(self._burst)):
                self._end_burst()
        return self._out.hand_over()

    def break_off(self) -> list[Arrival]:
        """Take a burst that is whole, and count a begun one as damaged."""
        if len(self._burst) == 4:
            self._end_burst()
        elif self._burst:
            self._out.append(Damaged(len(self._burst), "burst cut off where the link ended"))
        self._burst = b""
        self._asked = self._away = self._last_count is not None  # before the first burst nothing can be lost: the stream is asked for again
        return self._out.hand_over()

    def _end_burst(self) -> None:
        bursts, self._burst = self._burst, b""
        if len(bursts) % 4:
            self._out.append(Damaged(len(bursts), "burst of a wrong length"))
            return
        for start in range(0, len(bursts), 4):  # more than one where three in a row were lost between them
            self._take_result(bursts[start : start + 4])

    def _lost_before(self, burst: bytes) -> int:
        """Return how many bursts its counter says are missing before this one."""
        return 0 if self._last_count is None else ((burst[0] >> 4 & 3) - self._last_count - 1) % 4

    def _take_result(self, burst: bytes) -> None:
        counter = burst[0] >> 4 & 3
        lost = self._lost_before(burst)
        self._last_count = counter
        value = sum((byte & 15) << 4 * place for place, byte in enumerate(burst))
        refusal = "" if burst[0] & 0x40 else "not renewed since the last transmission"
        if value > FULL_SCALE:
            refusal = "outside the measuring range"
        number = self._distances.expected + lost
        self._distances.take(number, number, value * self._range_mm / FULL_SCALE, lost=lost, refusal=refusal)


class RiftekAsciiDecoder:
    """Lines of a RIFTEK RF60x distance sensor to arrivals; each request is answered by one distance, and the next one follows it."""

    def __init__(self, rate_hz: float, *, request_line: str = "R1", count: int | None = None, largest_step_mm: float | None = None) -> None:
        if not rate_hz > 0:
            raise ValueError(f"rate {rate_hz} Hz must be positive")
        self._line = request_line.encode("ascii") + b"\r\n"
        self._distances = _distances(rate_hz, count, largest_step_mm, "answer that is no distance")
        self._out = self._distances.out
        self._pending = b""
        self._overlong = False
        self._waiting = 0

    def request(self) -> bytes:
        """Ask for the next distance when the last one is there, or has been waited for twenty times in vain."""
        self._waiting = (self._waiting + 1) % 20
        return self._line if self._waiting == 1 and not self._distances.closed else b""

    def feed(self, data: bytes) -> list[Arrival]:
        """Decode the next bytes."""
        lines = (self._pending + data).split(b"\n")
        self._pending = lines.pop()
        for line in lines:
            self._take_line(self._drop_excess(line))
            self._waiting, self._overlong = 0, False
        self._pending = self._drop_excess(self._pending)
        return self._out.hand_over()

    def _take_line(self, line: bytes) -> None:
        """Take one answer. One that is no distance is a distance lost, but for greetings before the first one."""
        if line.endswith(b"\r") and NUMBER.fullmatch(line[:-1]) and not self._overlong:
            number = self._distances.expected
            self._distances.take(number, number, float(line[:-1]))
            return
        self._out.append(Damaged(len(line) + 1, "line that is no distance"))
        if self._distances.expected:
            self._distances.miss()

    def _drop_excess(self, line: bytes) -> bytes:
        """Count what no answer can hold as damage at fixed places, however the bytes are cut."""
        while len(line) > LONGEST_LINE:
            self._out.append(Damaged(LONGEST_LINE, "no line end in time"))
            line, self._overlong = line[LONGEST_LINE:], True
        return line

    def break_off(self) -> list[Arrival]:
        """Count the begun line as damaged."""
        if self._pending:
            self._out.append(Damaged(len(self._pending), "line cut off where the link ended"))
        self._pending, self._overlong, self._waiting = b"", False, 0
        return self._out.hand_over()


UNSEEN = {
    "riftek": "values are counted modulo 4 and carry no checksum: a loss of 4, 8, ... in a row does not show and shifts those behind it, "
    "and a flipped bit shows only as a jump (largest_step_mm)",
    "riftek-ascii": "values carry neither counter nor checksum: one that is lost whole does not show, a flipped digit only as a jump "
    "(largest_step_mm)",
}
AXES = {"riftek": ("z",), "riftek-ascii": ("z",)}  # a distance
DECODERS = {"riftek": RiftekDecoder, "riftek-ascii": RiftekAsciiDecoder}
