r"""The ASCII line format, defined here, and its decoder.

Every line ends with `*`, the CRC-16/CCITT-FALSE of all bytes before the `*` as four upper-case hexadecimal digits,
carriage return and line feed. Decimal point only, no exponent, no blanks.

    S,<device>,<serial number>,<unit>,<count>   opens a scan. Names: printable characters but comma and asterisk.
                                                Unit: mm, um, cm, m, inch. Count: points to come; empty if unknown.
    P,<seq>,<t_us>,<x>,<y>,<z>,<flags>          one point. seq: 0 for the first point of a scan, wraps after 4294967295.
                                                t_us: microseconds by the device's clock, wraps after 4294967295.
                                                flags: decimal 0 to 255; bit 0 set: the device marks the point invalid;
                                                the other bits are free for the device and not judged here.
    H,<seq>,<t_us>                              heartbeat: alive, nothing to send; seq: number of the next point.
    E,<count>                                   closes the scan; count: points sent, so that a lost tail shows.

The device may repeat S before the first point and E after the last one, so that one damaged line does not cost the
scan; repeats change nothing. The host sends `G` CR LF when it opens the link; a device that waits for a host
begins (or goes on) then, others need not listen. Points without a scan header have no unit and are rejected,
unless the unit is given to the decoder. S after points means that the device began anew.
"""

import re
from binascii import crc_hqx

import numpy as np

from drivers.codecs.outbox import Outbox
from drivers.codecs.sequence import SequenceCounter, WrappingClock
from drivers.errors import ProtocolError
from drivers.source import ANOTHER_CONTENT, FRAME_REPEATED, Arrival, Damaged, Heartbeat, PointBatch, Rejected, ScanClosed, ScanOpened

MM_PER_UNIT = {"mm": 1.0, "um": 1e-3, "cm": 10.0, "m": 1000.0, "inch": 25.4}
LONGEST_LINE = 256  # bytes before the line feed; anything longer is garbage
WRAP = 1 << 32
INVALID = 1  # bit 0 of flags

FIRST_LETTERS = (b"S,", b"P,", b"H,", b"E,")
NUMBER = rb"-?[0-9]{1,12}(?:\.[0-9]{1,12})?"
POINT = re.compile(rb"P,([0-9]{1,10}),([0-9]{1,10}),(%b),(%b),(%b),([0-9]{1,3})" % (NUMBER, NUMBER, NUMBER))
HEARTBEAT = re.compile(rb"H,([0-9]{1,10}),([0-9]{1,10})")
OPENING = re.compile(rb"S,([ -)+\x2d-~]*),([ -)+\x2d-~]*),([ -)+\x2d-~]*),([0-9]{0,10})")
CLOSING = re.compile(rb"E,([0-9]{1,10})")


class AsciiDecoder:
    """Bytes of the ASCII line format to arrivals in millimetres."""

    def __init__(self, unit: str | None = None) -> None:
        if unit is not None and unit not in MM_PER_UNIT:
            raise ValueError(f"unit {unit!r} is none of {', '.join(MM_PER_UNIT)}")
        self._mm_per_unit = None if unit is None else MM_PER_UNIT[unit]
        self._opening = b"", ScanOpened("", "", None)  # the line as it came, and what it says
        self._pending = b""
        self._overlong = False
        self._out = Outbox(self._batch)
        self._asked = False
        self._begin()

    def request(self) -> bytes:
        """Tell a device that waits for its host, once after each opening of the link, to begin."""
        asked, self._asked = self._asked, True
        return b"" if asked else b"G\r\n"

    def feed(self, data: bytes) -> list[Arrival]:
        """Decode the next bytes, up to the end of the scan."""
        if self._out.closed:
            return []
        lines = (self._pending + data).split(b"\n")
        self._pending = lines.pop()
        self._take_lines(lines)
        self._pending = self._drop_excess(self._pending)
        return self._out.hand_over()

    def break_off(self) -> list[Arrival]:
        """Count the begun line, if any, as damaged."""
        if self._pending:
            self._damage(len(self._pending), "line cut off where the link ended")
        self._pending, self._overlong, self._asked = b"", False, False
        return self._out.hand_over()

    def _begin(self) -> None:
        self._counter = SequenceCounter(WRAP)
        self._said_again = False
        self._clock = WrappingClock(WRAP, 1e6)
        self._sequence: list[int] = []
        self._raw_us: list[int] = []
        self._xyz: list[float] = []

    def _take_lines(self, lines: list[bytes]) -> None:
        """Take whole lines: points in sequence here, where speed counts, everything else elsewhere."""
        counter = self._counter
        expected, contents = counter.expected, list[int]()
        for line in lines:
            body = line[:-6]
            found = POINT.fullmatch(body)
            if found is not None and not self._overlong and line[-6:] == b"*%04X\r" % crc_hqx(body, 0xFFFF):
                sequence, raw_us, x, y, z, flags = found.groups()
                if int(sequence) == expected and flags == b"0" and not self._said_again:
                    self._sequence.append(expected)
                    self._raw_us.append(int(raw_us))
                    self._xyz += (float(x), float(y), float(z))
                    contents.append(hash(body))
                    expected += 1
                    continue
            counter.take(contents)
            self._take_other_line(line)
            if self._out.closed:
                return
            counter = self._counter
            expected, contents = counter.expected, []
        counter.take(contents)

    def _take_other_line(self, line: bytes) -> None:
        """Take a line that is not simply the next good point."""
        rest = self._drop_excess(line)
        overlong, self._overlong = self._overlong, False
        start = _start_of_sound_line(rest)
        if start is None:
            self._damage(len(rest) + 1, "no line end in time" if overlong else _flaw(rest))
            return
        if start:
            self._damage(start, "bytes before a sound line")
        body = rest[start:-6]
        if found := POINT.fullmatch(body):
            self._hear_counter(int(found[1]))
            self._take_point(found)
        elif found := HEARTBEAT.fullmatch(body):
            self._hear_counter(int(found[1]))
            self._out.append_loss(self._counter.reach(int(found[1])))
            self._out.append(Heartbeat())
        elif found := OPENING.fullmatch(body):
            self._open(body, found)
        elif found := CLOSING.fullmatch(body):
            self._hear_counter(int(found[1]))
            self._close(int(found[1]))
        else:
            self._damage(len(rest) - start + 1, "sound line of unknown form")

    def _hear_counter(self, counter: int) -> None:
        """Decide by the first counter after a repeated opening whether it was only said again, or the device began anew."""
        if self._said_again and counter < abs(self._counter.unwrap(counter) - self._counter.expected):
            self._begin_with(*self._opening)
        self._said_again = False

    def _take_point(self, found: re.Match[bytes]) -> None:
        sequence, raw_us, x, y, z, flags = found.groups()
        place = self._counter.place(int(sequence), content=hash(found[0]))
        if place.repeated:
            self._out.append(Rejected(1, FRAME_REPEATED if place.same else ANOTHER_CONTENT))
            return
        self._out.append_loss(place.lost)
        if int(flags) & INVALID:
            self._out.append(Rejected(1, "marked invalid by the device"))
            return
        self._sequence.append(place.sequence)
        self._raw_us.append(int(raw_us))
        self._xyz += (float(x), float(y), float(z))

    def _open(self, body: bytes, found: re.Match[bytes]) -> None:
        device, serial_number, unit, count = (group.decode("ascii") for group in found.groups())
        if unit not in MM_PER_UNIT:
            known = ", ".join(MM_PER_UNIT)
            raise ProtocolError(f"{device} {serial_number} sends points in {unit!r}; set the device to one of {known}")
        opening = body, ScanOpened(device, serial_number, int(count) if count else None)
        if self._counter.expected and not self._opening[0]:
            self._out.flush()  # points came before it: an earlier copy was damaged, or they are of another scan
            self._name(*opening)
        if body == self._opening[0]:
            self._said_again = self._counter.expected > 0  # what it means, the next counter says
        else:
            self._begin_with(*opening)

    def _begin_with(self, body: bytes, opened: ScanOpened) -> None:
        self._out.flush()
        self._begin()
        self._name(body, opened)

    def _name(self, body: bytes, opened: ScanOpened) -> None:
        self._opening = body, opened
        self._mm_per_unit = MM_PER_UNIT[body.split(b",")[3].decode("ascii")]
        self._out.append(opened)

    def _close(self, count: int) -> None:
        self._out.append_loss(self._counter.reach(count % WRAP))
        self._out.append(ScanClosed(count))

    def _drop_excess(self, line: bytes) -> bytes:
        """Count what no line can hold as damage at fixed places, so that garbage without a line end needs no memory."""
        while len(line) > 2 * LONGEST_LINE:  # a sound line that ends here is in what is left
            self._damage(LONGEST_LINE, "no line end in time")
            line = line[LONGEST_LINE:]
            self._overlong = True
        return line

    def _damage(self, byte_count: int, reason: str) -> None:
        self._out.append(Damaged(byte_count, reason))

    def _batch(self) -> Arrival | None:
        """Return the points collected so far as one batch."""
        if not self._sequence:
            return None
        sequence, raw_us, xyz = self._sequence, self._raw_us, self._xyz
        self._sequence, self._raw_us, self._xyz = [], [], []
        if self._mm_per_unit is None:
            return Rejected(len(sequence), "no scan header arrived: the unit is unknown")
        points_mm = np.array(xyz).reshape(-1, 3)
        if self._mm_per_unit != 1.0:
            points_mm = points_mm * self._mm_per_unit
        time_s = np.array(self._clock.ticks(raw_us)) / 1e6
        return PointBatch(np.array(sequence), time_s, points_mm)


def _start_of_sound_line(line: bytes) -> int | None:
    """Return where a line with a right checksum begins in `line`, at its first byte or behind junk; None: nowhere."""
    if line[-6:-5] != b"*" or not line.endswith(b"\r"):
        return None
    checksum = line[-5:-1]
    first = max(0, len(line) - LONGEST_LINE)
    starts = (start for start in range(first, len(line) - 5) if start == 0 or line[start : start + 2] in FIRST_LETTERS)
    return next((start for start in starts if checksum == b"%04X" % crc_hqx(line[start:-6], 0xFFFF)), None)


def _flaw(line: bytes) -> str:
    """Say what is wrong with a line that has no right checksum."""
    if line[-5:-4] == b"*" and line[-4:] == b"%04X" % crc_hqx(line[:-5], 0xFFFF):
        return "line that ends with line feed alone, not with carriage return and line feed"
    return "checksum wrong" if len(line) > 6 and line[-6:-5] == b"*" else "not a whole line"


DECODERS = {"ascii": AsciiDecoder}
