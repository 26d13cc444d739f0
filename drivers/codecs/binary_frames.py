"""The counted binary format, defined here, and its decoder.

All numbers are little-endian. A frame has 24 bytes:

    A5 5A | type u8 | flags u8 | seq u16 | t_us u32 | 12 bytes | CRC-16/CCITT-FALSE u16 over the 22 bytes before it

    type 0  opens a scan: serial number u32, announced count u64 (0: unknown). seq and t_us mean nothing.
    type 1  one point: x, y, z i32 in 1e-5 mm. seq: 0 for the first point of a scan, wraps. t_us: the device's clock, wraps.
            flags bit 0: the device marks the point invalid; the other bits are free for the device.
    type 2  heartbeat: number of points sent so far u64, 4 bytes free. seq: number of the next point.
    type 3  closes the scan: number of points sent u64, 4 bytes free.

A fast scanner sends its points in blocks instead, between the same opening, heartbeats and closing:

    A5 5B | n u16 | seq u32 | t_us u64 | CRC-16/CCITT-FALSE u16 over the 16 bytes before it
    n times: dt_us u32 since t_us | x, y, z i32 in 1e-5 mm | flags u16
    CRC-32 (IEEE 802.3) u32 over all bytes before it; n at most 1024

Opening and closing may be repeated, as a damaged one is else not made up for. A 16-bit counter wraps within a link
that was away for long: the clock then tells how often, and the next heartbeat or the closing corrects it. Devices
send a heartbeat at least every 30,000 points.
"""

from binascii import crc32, crc_hqx

import numpy as np
from numpy.typing import NDArray

from drivers.codecs.outbox import Outbox
from drivers.codecs.sequence import MOST_POINTS, SequenceCounter, WrappingClock, contents_of
from drivers.source import ANOTHER_CONTENT, FRAME_REPEATED, Arrival, Damaged, Heartbeat, PointBatch, Rejected, ScanClosed, ScanOpened

FRAME = np.dtype([("sync", "<u2"), ("type", "u1"), ("flags", "u1"), ("seq", "<u2"), ("t_us", "<u4"), ("xyz", "<i4", 3), ("crc", "<u2")])
HEAD = np.dtype([("sync", "<u2"), ("n", "<u2"), ("seq", "<u4"), ("t_us", "<u8"), ("crc", "<u2")])
BLOCK_POINT = np.dtype([("dt_us", "<u4"), ("xyz", "<i4", 3), ("flags", "<u2")])
SIZE, CHECKED = FRAME.itemsize, FRAME.itemsize - 2
SYNC, FRAME_SYNC, BLOCK_SYNC = b"\xa5", 0x5AA5, 0x5BA5
LARGEST_BLOCK = 1024
OPENING, POINT, HEARTBEAT, CLOSING = range(4)
INVALID = 1
UNITS_PER_MM = 1e5
RUN = 256  # frames looked at together at most
PACE_POINTS = 256  # of which the pace of a device is learned
PAUSE = 4.0  # times the usual time from point to point, and the device has paused
SHORTEST_RUN = 4  # and where runs keep breaking off, so that a frame costs a few checksums, whatever stands behind it


class BinaryDecoder:
    """Bytes of the counted binary format to arrivals in millimetres."""

    def __init__(self) -> None:
        self._pending = b""
        self._out = Outbox(self._take_damage)
        self._asked = False
        self._most = RUN  # frames to look at together: twice as many as were good the last time
        self._damage = 0
        self._away = False
        self._opening = b""
        self._begin()

    def request(self) -> bytes:
        """Tell a device that waits for its host, once after each opening of the link, to begin."""
        asked, self._asked = self._asked, True
        return b"" if asked else b"G"

    def feed(self, data: bytes) -> list[Arrival]:
        """Decode the next bytes, up to the end of the scan."""
        data = self._pending + data
        at = 0
        while not self._out.closed:
            while run := self._take_run(data, at):
                at += run
            used = self._take_one(data, at)
            if not used:
                break
            at += used
        self._pending = b"" if self._out.closed else data[at:]
        return self._out.hand_over()

    def break_off(self) -> list[Arrival]:
        """Count a begun frame as damaged; the counter may have wrapped when the link comes back."""
        self._damage += len(self._pending)
        self._pending, self._away, self._asked = b"", True, False
        return self._out.hand_over()

    def _begin(self) -> None:
        self._counter = SequenceCounter(1 << 16)
        self._clock = WrappingClock(1 << 32, 1e6)
        self._in_blocks = self._said_again = False
        self._newest = np.empty((0, 2), dtype=np.int64)  # number and time of the newest points, at most PACE_POINTS

    def _take_run(self, data: bytes, start: int) -> int:
        """Take good points in sequence, many at once; return the number of bytes used."""
        count = min((len(data) - start) // SIZE, self._most)
        if count < 2 or self._away or self._said_again or self._damage:
            return 0
        frames = np.frombuffer(data, dtype=FRAME, count=count, offset=start)
        places = range(start, start + count * SIZE, SIZE)
        crc = np.array([crc_hqx(data[at : at + CHECKED], 0xFFFF) for at in places], dtype=np.uint16)
        expected = (self._counter.expected + np.arange(count)) & 0xFFFF
        plain = (frames["sync"] == FRAME_SYNC) & (frames["type"] == POINT) & (frames["flags"] == 0)
        good = plain & (frames["crc"] == crc) & (frames["seq"] == expected)
        count = count if good.all() else int(good.argmin())
        self._most = min(RUN, max(SHORTEST_RUN, 2 * count))
        if not count:
            return 0
        frames = frames[:count]
        self._append_batch(self._counter.expected + np.arange(count), frames["t_us"].astype(np.int64), frames["xyz"])
        self._counter.take(frames["crc"].astype(np.int64))
        return count * SIZE

    def _take_one(self, data: bytes, at: int) -> int:
        """Take one frame, or step over bytes that are none; return the number of bytes used, 0 if more are needed."""
        left = len(data) - at
        if left and data[at] != SYNC[0]:
            found = data.find(SYNC, at)
            return self._skip((found if found >= 0 else len(data)) - at)
        if left < 2:
            return 0
        if data[at + 1] == FRAME_SYNC >> 8:
            return self._take_frame(data[at : at + SIZE])
        if data[at + 1] == BLOCK_SYNC >> 8:
            return self._take_block(data, at)
        return self._skip(1)

    def _take_frame(self, frame: bytes) -> int:
        if len(frame) < SIZE:
            return 0
        fields = np.frombuffer(frame, dtype=FRAME)[0]
        if int(fields["crc"]) != crc_hqx(frame[:CHECKED], 0xFFFF) or fields["type"] > CLOSING:
            return self._skip(1)
        self._out.flush()
        kind, total = int(fields["type"]), int.from_bytes(frame[10:18], "little")
        if kind == POINT:
            self._take_point(fields)
        elif kind == OPENING:
            self._open(frame)
        elif total > MOST_POINTS:
            self._out.append(Damaged(SIZE, "count of points that no scan has"))
        elif kind == HEARTBEAT:
            self._reach(total)
            self._out.append(Heartbeat())
        else:
            self._reach(total)
            self._out.append(ScanClosed(total))
        return SIZE

    def _take_point(self, fields: np.void) -> None:
        raw_us = int(fields["t_us"])
        near = self._counter.expected + (self._estimate_missed(raw_us) if self._away else 0)
        self._away = False
        sequence = self._hear_counter(int(fields["seq"]), self._counter.unwrap(int(fields["seq"]), near), near)
        if self._account_for(sequence, int(fields["flags"]), int(fields["crc"])):
            self._append_batch(np.array([self._placed]), np.array([raw_us]), fields["xyz"][None])

    def _account_for(self, sequence: int, flags: int, content: int) -> bool:
        """Account for one frame; tell whether it is a point to hand on."""
        place = self._counter.place(sequence, near=sequence, content=content)
        self._placed = place.sequence
        if place.repeated:
            self._out.append(Rejected(1, FRAME_REPEATED if place.same else ANOTHER_CONTENT))
            return False
        self._out.append_loss(place.lost)
        if flags & INVALID:
            self._out.append(Rejected(1, "marked invalid by the device"))
            return False
        return True

    def _take_block(self, data: bytes, at: int) -> int:
        if len(data) - at < HEAD.itemsize:
            return 0
        head = np.frombuffer(data, dtype=HEAD, count=1, offset=at)[0]
        count, body = int(head["n"]), at + HEAD.itemsize
        if int(head["crc"]) != crc_hqx(data[at : body - 2], 0xFFFF) or not 0 < count <= LARGEST_BLOCK:
            return self._skip(1)
        end = body + count * BLOCK_POINT.itemsize
        if len(data) < end + 4:
            return 0
        if int.from_bytes(data[end : end + 4], "little") != crc32(data[at:end]):
            return self._skip(1)
        self._out.flush()
        points = np.frombuffer(data, dtype=BLOCK_POINT, count=count, offset=body)
        first = self._hear_counter(int(head["seq"]), self._unwrap_32(int(head["seq"])), self._counter.expected)
        self._take_block_points(first, int(head["t_us"]) + points["dt_us"].astype(np.int64), points)
        return end + 4 - at

    def _take_block_points(self, first: int, t_us: NDArray[np.int64], points: NDArray[np.void]) -> None:
        self._away, self._in_blocks = False, True  # the clock of blocks does not wrap
        count, contents = len(points), contents_of(t_us, points["xyz"])
        if first >= self._counter.expected and not points["flags"].any():
            self._out.append_loss(self._counter.place(first, near=first, content=int(contents[0])).lost)
            self._counter.take(contents[1:])
            self._append_batch(first + np.arange(count), t_us, points["xyz"])
            return
        keep = np.array([self._account_for(first + i, int(points["flags"][i]), int(contents[i])) for i in range(count)])
        if keep.any():
            self._append_batch((first + np.arange(count))[keep], t_us[keep], points["xyz"][keep])

    def _unwrap_32(self, seq: int) -> int:
        anchor, half = self._counter.expected, 1 << 31
        return anchor + (seq - anchor + half) % (1 << 32) - half

    def _open(self, frame: bytes) -> None:
        body = frame[10:CHECKED]
        if self._counter.expected and not self._opening:
            self._name(body)  # points came before it: an earlier copy was damaged, or they are of another scan
        if body == self._opening:
            self._said_again = self._counter.expected > 0  # what it means, the next counter says
        else:
            self._begin_with(body)

    def _begin_with(self, body: bytes) -> None:
        self._begin()
        self._name(body)

    def _name(self, body: bytes) -> None:
        self._opening = body
        count = int.from_bytes(body[4:], "little")
        self._out.append(ScanOpened("counted binary frames", str(int.from_bytes(body[:4], "little")), count or None))

    def _hear_counter(self, counter: int, sequence: int, near: int) -> int:
        """Decide by the first counter after a repeated opening whether it was only said again, or the device began anew.

        Returns `sequence`, which is `counter` unwrapped to the number closest to `near`, or the counter of a scan begun anew.
        """
        anew = self._said_again and counter < abs(sequence - near)
        self._said_again = False
        if anew:
            self._begin_with(self._opening)
        return counter if anew else sequence

    def _append_batch(self, sequence: NDArray[np.int64], t_us: NDArray[np.int64], xyz: NDArray[np.int32]) -> None:
        newest = np.column_stack([sequence[-PACE_POINTS:], t_us[-PACE_POINTS:]])
        self._newest = np.concatenate([self._newest[len(newest) - PACE_POINTS :], newest]) if len(newest) < PACE_POINTS else newest
        time_s = t_us / 1e6 if self._in_blocks else self._clock.seconds(t_us)
        self._out.append(PointBatch(sequence, time_s, xyz / UNITS_PER_MM))

    def _estimate_missed(self, raw_us: int) -> int:
        """Estimate from the clock how many points were taken while the link was away, by the pace of the points before it.

        Which points those are does not depend on how the bytes were cut. A pause of the device is no part of its pace.
        """
        points, us = np.diff(self._newest, axis=0).T
        us = us[points > 0] % (1 << 32)
        points = points[points > 0]
        if not len(points):
            return 0
        usual = us / points <= PAUSE * np.median(us / points)
        us_per_point = us[usual].sum() / points[usual].sum()
        away_us = (raw_us - int(self._newest[-1, 1])) % (1 << 32)
        return round(away_us / us_per_point) - 1 if us_per_point else 0

    def _reach(self, total: int) -> None:
        self._hear_counter(total, total, self._counter.expected)
        self._out.append_loss(self._counter.reach_total(total))

    def _skip(self, count: int) -> int:
        self._damage += count
        return count

    def _take_damage(self) -> Arrival | None:
        """Return what bytes since the last sound frame are damaged."""
        damage, self._damage = self._damage, 0
        return Damaged(damage, "no valid frame") if damage else None


DECODERS = {"binary": BinaryDecoder}
