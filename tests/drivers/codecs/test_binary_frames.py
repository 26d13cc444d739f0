"""The counted binary format, single frames and blocks, against golden bytes, any cut, and damage."""

import struct
from binascii import crc32, crc_hqx
from collections.abc import Sequence
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.codecs.binary_frames import BLOCK_POINT, FRAME, HEAD, BinaryDecoder
from drivers.source import Heartbeat, ScanClosed, ScanOpened
from simulators.devices.binary_scanner import BinaryDevice, BlockDevice
from simulators.stream import Sample
from tests.drivers.codecs.streams import account, any_cut_is_the_same, decoded, flipped, only_sent_points
from tests.drivers.codecs.wire_bytes import binary_frame

# Written by hand from the format's definition, checksums with a bit-by-bit CRC (check values 29B1 and CBF43926):
# opening of device 4711 with 3 points; point 0 at 1000 us (1.5, -2.25, 0.125) mm; heartbeat "1 sent";
# a block of two points, numbers 1 and 2, at 2000 and 2500 us, (1, 2, 3) and (-1, -2, -3) mm, the second marked invalid; closing "3 sent".
GOLDEN = bytes.fromhex(
    "a55a 00 00 0000 00000000 67120000 0300000000000000 45e2"
    "a55a 01 00 0000 e8030000 f0490200 1891fcff d4300000 e8cf"
    "a55a 02 00 0100 dc050000 0100000000000000 00000000 7dff"
    "a55b 0200 01000000 d007000000000000 6c76"
    "00000000 a0860100 400d0300 e0930400 0000"
    "f4010000 6079feff c0f2fcff 206cfbff 0100 7142e1b7"
    "a55a 03 00 0300 00000000 0300000000000000 00000000 2d3f"
)


@cache
def single(count: int, first: int = 0) -> tuple[bytes, np.ndarray[tuple[int, int], np.dtype[np.float64]]]:
    """A whole scan of single frames, made with numpy, and its points."""
    rng = np.random.default_rng(count)
    units = rng.integers(-(10**7), 10**7, (count, 3))
    frames = np.zeros(count, dtype=FRAME)
    number = first + np.arange(count)
    frames["sync"], frames["type"], frames["seq"], frames["t_us"], frames["xyz"] = 0x5AA5, 1, number % 65536, number * 100, units
    raw = frames.tobytes()
    body = b"".join(raw[i : i + 22] + struct.pack("<H", crc_hqx(raw[i : i + 22], 0xFFFF)) for i in range(0, len(raw), 24))
    device = BinaryDevice()
    return device.opening(count) + body + device.closing(first + count), units / 1e5


def blocks(count: int, size: int) -> tuple[bytes, np.ndarray[tuple[int, int], np.dtype[np.float64]]]:
    rng = np.random.default_rng(count)
    units = rng.integers(-(10**7), 10**7, (count, 3))
    parts = []
    for first in range(0, count, size):
        chunk = units[first : first + size]
        head = struct.pack("<2sHIQ", b"\xa5\x5b", len(chunk), first, first * 10)
        points = np.zeros(len(chunk), dtype=BLOCK_POINT)
        points["dt_us"], points["xyz"] = np.arange(len(chunk)) * 10, chunk
        data = head + struct.pack("<H", crc_hqx(head, 0xFFFF)) + points.tobytes()
        parts.append(data + struct.pack("<I", crc32(data)))
    device = BlockDevice()
    return device.opening(count) + b"".join(parts) + device.closing(count), units / 1e5


def test_sizes_are_those_of_the_format() -> None:
    assert (FRAME.itemsize, HEAD.itemsize, BLOCK_POINT.itemsize) == (24, 18, 18)


def test_golden_bytes() -> None:
    book = any_cut_is_the_same(BinaryDecoder, GOLDEN)
    assert book.sequence == [0, 1]
    assert book.time_s == [0.001, 0.002]
    assert book.points_mm == [(1.5, -2.25, 0.125), (1.0, 2.0, 3.0)]
    assert dict(book.counts) == {("Rejected", "marked invalid by the device"): 1}
    assert book.others == [ScanOpened("counted binary frames", "4711", 3), Heartbeat(), ScanClosed(3)]


def test_the_simulated_devices_write_the_golden_bytes() -> None:
    one, many = BinaryDevice(), BlockDevice()
    assert one.opening(3)[:24] == GOLDEN[:24]
    assert one.frame([Sample(0, 0.001, (1.5, -2.25, 0.125))]) == GOLDEN[24:48]
    assert one.heartbeat(1, 0.0015) == GOLDEN[48:72]
    assert many.frame([Sample(1, 0.002, (1, 2, 3)), Sample(2, 0.0025, (-1, -2, -3), invalid=True)]) == GOLDEN[72:-24]
    assert one.closing(3)[:24] == GOLDEN[-24:]


@given(seed=st.integers(0, 2**32), edges=st.lists(st.integers(0, 6000), max_size=30), many=st.booleans())
@settings(max_examples=60, deadline=None)
def test_any_cut_of_a_damaged_stream_gives_the_same(seed: int, edges: list[int], many: bool) -> None:
    data, _ = blocks(200, 16) if many else single(200)
    damaged = flipped(data, 3e-3, np.random.default_rng(seed))
    cuts = [min(edge, len(damaged)) for edge in edges]
    assert decoded(BinaryDecoder(), damaged, cuts) == decoded(BinaryDecoder(), damaged)


@given(st.binary(max_size=2000), st.lists(st.integers(0, 2000), max_size=10))
@settings(max_examples=100, deadline=None)
def test_every_byte_of_noise_is_counted(noise: bytes, edges: list[int]) -> None:
    noisy = noise.replace(b"\xff", b"\xa5").replace(b"\xfe", b"\xa5\x5a").replace(b"\xfd", b"\xa5\x5b")
    book = decoded(BinaryDecoder(), noisy, [min(edge, len(noisy)) for edge in edges])
    assert book.counts == ({("Damaged", "no valid frame"): len(noisy)} if noisy else {})


@pytest.mark.parametrize("lost_byte", [0, 1, 11, 23])
def test_a_lost_byte_costs_one_point(lost_byte: int) -> None:
    data, sent_mm = single(100)
    at = 72 + 50 * 24 + lost_byte
    book = any_cut_is_the_same(BinaryDecoder, data[:at] + data[at + 1 :])
    assert (len(book.sequence), book.lost) == (99, 1)
    assert book.counts["Damaged", "no valid frame"] == 23
    only_sent_points(book, sent_mm, within_mm=0.0)


def test_lost_repeated_and_late_frames() -> None:
    data, sent_mm = single(10)
    head, frames, tail = data[:72], [data[72 + 24 * i : 96 + 24 * i] for i in range(10)], data[-72:]
    order = [0, 1, 1, 4, 3, 5, 6]
    book = any_cut_is_the_same(BinaryDecoder, head + b"".join(frames[i] for i in order) + tail)
    assert book.sequence == [0, 1, 4, 3, 5, 6]
    assert book.lost == 10 - 6
    assert book.counts["Rejected", "frame repeated"] == 1
    only_sent_points(book, sent_mm, within_mm=0.0)


def test_late_and_repeated_blocks() -> None:
    data, sent_mm = blocks(40, 10)
    size = 18 + 10 * 18 + 4
    parts = [data[72 + size * i : 72 + size * (i + 1)] for i in range(4)]
    book = any_cut_is_the_same(BinaryDecoder, data[:72] + parts[1] + parts[0] + parts[1] + parts[3] + data[-72:])
    assert book.sequence == [*range(10, 20), *range(10), *range(30, 40)]
    assert book.lost == 10
    assert book.counts["Rejected", "frame repeated"] == 10
    only_sent_points(book, sent_mm, within_mm=0.0)


def test_the_counter_wraps() -> None:
    data, sent_mm = single(150_000)
    book = decoded(BinaryDecoder(), data, range(1000, len(data), 1000))
    assert book.sequence == list(range(150_000))
    only_sent_points(book, sent_mm, within_mm=0.0)


@pytest.mark.parametrize("away", [10, 40_000, 70_000, 200_000])
def test_a_gap_longer_than_the_counter_is_told_by_the_clock(away: int) -> None:
    data, sent_mm = single(300_000)
    cut = 72 + 5000 * 24
    decoder = BinaryDecoder()
    first = decoder.feed(data[:cut]) + decoder.break_off()
    book = account(first + decoder.feed(data[cut + away * 24 :]))
    assert book.lost == away
    assert book.sequence[5000] == 5000 + away
    only_sent_points(book, sent_mm, within_mm=0.0)


@pytest.mark.parametrize("jitter_us", [0, 90])
@pytest.mark.parametrize("away", [30_000, 70_000, 250_000])
def test_how_the_bytes_were_cut_changes_nothing_of_what_the_clock_tells(away: int, jitter_us: int) -> None:
    """Points at an uneven pace, a pause among them, a few late ones: each frame is an own piece, or all are one, or any pieces."""
    rng = np.random.default_rng(away + jitter_us)
    times = 100 * np.arange(400) + rng.integers(-jitter_us // 2, jitter_us // 2 + 1, 400) + 5_000_000 * (np.arange(400) >= 250)
    numbers = [*range(120), 121, 120, *range(122, 400)]
    before = [binary_frame(1, n, int(times[n]), struct.pack("<iii", n, -n, 0)) for n in numbers]
    after = [binary_frame(1, n, int(times[399]) + 100 * (n - 399), struct.pack("<iii", n, -n, 0)) for n in (400 + away, 401 + away)]

    def decoded_of(pieces: list[bytes]) -> tuple[list[int], int]:
        made = BinaryDecoder()
        arrivals = [arrival for piece in pieces for arrival in made.feed(piece)]
        book = account([*arrivals, *made.break_off(), *made.feed(b"".join(after))])
        return book.sequence, book.lost

    wire = b"".join(before)
    whole = decoded_of([wire])
    assert whole == ([*numbers, 400 + away, 401 + away], away)
    cuts = [0, *sorted(rng.integers(0, len(wire), 40).tolist()), len(wire)]
    assert decoded_of(before) == whole
    assert decoded_of([wire[first:stop] for first, stop in pairwise(cuts)]) == whole


def test_a_heartbeat_puts_a_wrong_guess_right() -> None:
    data, _ = single(3000)
    decoder = BinaryDecoder()
    arrivals = decoder.feed(data[: 72 + 1000 * 24]) + decoder.break_off()
    late = BinaryDevice().frame([Sample(1000, 1000 * 1e-4 + 100_000 * 1e-4, (0, 0, 0))])  # paused for as long as 100,000 points take
    beat = BinaryDevice().heartbeat(1001, 0.0)
    assert account(arrivals + decoder.feed(late)).lost == 65536 * 2
    assert account(decoder.feed(beat)).lost == -65536 * 2


@pytest.mark.parametrize("size", [1, 64])
def test_thousands_of_flipped_bits_give_no_wrong_point_and_the_true_loss(size: int) -> None:
    count = 60_000
    data, sent_mm = single(count) if size == 1 else blocks(count, size)
    damaged = data[:72] + flipped(data[72:-72], 5e-4, np.random.default_rng(4)) + data[-72:]
    book = decoded(BinaryDecoder(), damaged, range(1024, len(damaged), 1024))
    only_sent_points(book, sent_mm, within_mm=0.0)
    assert len(set(book.sequence)) == len(book.sequence)
    assert 600 < book.lost == count - len(book.sequence)


def test_a_point_marked_invalid_in_any_frame_is_rejected() -> None:
    device = BlockDevice()
    rows: Sequence[Sample] = [Sample(i, i * 1e-3, (i, 0, 0), invalid=i % 3 == 0) for i in range(10)]
    book = any_cut_is_the_same(BinaryDecoder, device.opening(10) + device.frame(rows) + device.closing(10))
    assert book.sequence == [1, 2, 4, 5, 7, 8]
    assert book.points_mm == [(float(i), 0.0, 0.0) for i in book.sequence]
    assert (book.total("Rejected"), book.lost) == (4, 0)


def heartbeat(total: int, t_us: int = 0) -> bytes:
    head = struct.pack("<2sBBHI", b"\xa5\x5a", 2, 0, total % 65536, t_us) + struct.pack("<QI", total, 0)
    return head + struct.pack("<H", crc_hqx(head, 0xFFFF))


@pytest.mark.parametrize("total", [2**63, 2**64 - 1, 2**48 + 1])
def test_a_count_that_no_scan_has_is_damage_and_costs_no_point(total: int) -> None:
    data, _ = single(800)
    book = any_cut_is_the_same(BinaryDecoder, data[:-72] + heartbeat(total) + data[-72:])
    assert (len(book.sequence), book.lost) == (800, 0)
    assert book.counts == {("Damaged", "count of points that no scan has"): 24}


@pytest.mark.parametrize("total", [0, 1, 799])
def test_a_device_has_sent_what_arrived_whatever_it_says(total: int) -> None:
    data, _ = single(800)
    book = any_cut_is_the_same(BinaryDecoder, data[:-72] + heartbeat(total, 5) + data[-72:])
    assert (len(book.sequence), book.lost) == (800, 0)


def test_an_opening_said_again_within_the_scan_loses_nothing() -> None:
    data, _ = single(1500)
    book = any_cut_is_the_same(BinaryDecoder, data[: 72 + 700 * 24] + data[:24] + data[72 + 700 * 24 :])
    assert (book.sequence, book.lost) == (list(range(1500)), 0)
    assert [type(arrival) for arrival in book.others] == [ScanOpened, ScanClosed]


def test_nothing_behind_the_end_is_of_the_scan() -> None:
    data, _ = single(30)
    assert any_cut_is_the_same(BinaryDecoder, data + single(20)[0] + b"junk") == decoded(BinaryDecoder(), data)


def test_an_opening_behind_points_whose_first_copy_was_damaged_loses_none_of_them() -> None:
    data, size = single(8)[0], FRAME.itemsize
    opening, body = data[:size], data[3 * size :]
    book = any_cut_is_the_same(BinaryDecoder, body[: 3 * size] + opening + body[3 * size :])
    assert (book.sequence, book.lost, book.counts) == (list(range(8)), 0, {})
