"""The ASCII line format against golden bytes, any cut, and damage."""

from binascii import crc_hqx

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.codecs.ascii_frames import LONGEST_LINE, AsciiDecoder
from drivers.errors import ProtocolError
from drivers.source import ANOTHER_CONTENT, FRAME_REPEATED, Damaged, Heartbeat, ScanClosed, ScanOpened
from simulators.devices.ascii_scanner import AsciiDevice
from simulators.stream import Sample
from tests.drivers.codecs.streams import account, any_cut_is_the_same, crc_bitwise, decoded, flipped, only_sent_points

# Written by hand from the format's definition; the checksums by the bitwise CRC-16/CCITT-FALSE below, not by the decoder's library call.
GOLDEN = (
    b"S,ACME scanner,SN-7,mm,3*4F2A\r\n"
    b"P,0,1000,1.5,-2.25,0.125,0*B8C0\r\n"
    b"P,1,1500,1.50001,-2.25001,0.12501,0*B195\r\n"
    b"H,2,2000*F518\r\n"
    b"P,2,2500,10,20,30,1*C4E8\r\n"
    b"E,3*7F7A\r\n"
)


def line(text: str) -> bytes:
    return b"%b*%04X\r\n" % (text.encode(), crc_bitwise(text.encode()))


def stream(points: int, unit: str = "mm") -> tuple[bytes, list[tuple[float, float, float]]]:
    rng = np.random.default_rng(points)
    xyz = [tuple(row) for row in np.round(rng.uniform(-100, 100, (points, 3)), 5).tolist()]
    lines = [line(f"S,dev,1,{unit},{points}")]
    lines += [line(f"P,{i},{500 * i},{x:.5f},{y:.5f},{z:.5f},0") for i, (x, y, z) in enumerate(xyz)]
    return b"".join([*lines, line(f"E,{points}")]), xyz


def test_the_checksum_is_crc_16_ccitt_false() -> None:
    assert crc_bitwise(b"123456789") == 0x29B1  # check value in the catalogue of parametrised CRC algorithms


def test_golden_bytes() -> None:
    book = any_cut_is_the_same(AsciiDecoder, GOLDEN)
    assert book.sequence == [0, 1]
    assert book.time_s == [0.001, 0.0015]
    assert book.points_mm == [(1.5, -2.25, 0.125), (1.50001, -2.25001, 0.12501)]
    assert dict(book.counts) == {("Rejected", "marked invalid by the device"): 1}
    assert book.others == [ScanOpened("ACME scanner", "SN-7", 3), Heartbeat(), ScanClosed(3)]


def test_the_simulated_device_writes_the_golden_bytes() -> None:
    device = AsciiDevice()
    point = device.frame([Sample(1, 0.0015, (1.50001, -2.25001, 0.12501))])
    assert decoded(AsciiDecoder("mm"), point).points_mm == [(1.50001, -2.25001, 0.12501)]
    assert point == line("P,1,1500,1.500010,-2.250010,0.125010,0")
    assert device.heartbeat(2, 0.002) == b"H,2,2000*F518\r\n"
    assert device.closing(3) == 3 * b"E,3*7F7A\r\n"


@given(seed=st.integers(0, 2**32), edges=st.lists(st.integers(0, 2000), max_size=30))
@settings(max_examples=60, deadline=None)
def test_any_cut_of_a_damaged_stream_gives_the_same(seed: int, edges: list[int]) -> None:
    data, _ = stream(60)
    damaged = flipped(data, 3e-3, np.random.default_rng(seed))
    cuts = [min(edge, len(damaged)) for edge in edges]
    assert decoded(AsciiDecoder("mm"), damaged, cuts) == decoded(AsciiDecoder("mm"), damaged)


@given(st.binary(max_size=3000), st.lists(st.integers(0, 3000), max_size=10))
@settings(max_examples=100, deadline=None)
def test_every_byte_of_noise_is_counted(noise: bytes, edges: list[int]) -> None:
    book = decoded(AsciiDecoder("mm"), noise, [min(edge, len(noise)) for edge in edges])
    assert not book.sequence
    assert book.total("Damaged") == len(noise)


def test_units_are_converted() -> None:
    for unit, factor in (("mm", 1.0), ("um", 1e-3), ("cm", 10.0), ("m", 1000.0), ("inch", 25.4)):
        data, xyz = stream(20, unit)
        np.testing.assert_allclose(decoded(AsciiDecoder(), data).points_mm, np.array(xyz) * factor, rtol=1e-15)


def test_an_unknown_unit_is_refused_with_the_way_out() -> None:
    with pytest.raises(ProtocolError, match=r"dev 1 sends points in 'furlong'; set the device to one of mm, um"):
        AsciiDecoder().feed(line("S,dev,1,furlong,5"))


def test_points_without_a_scan_header_are_rejected_unless_the_unit_is_known() -> None:
    data, xyz = stream(5)
    headless = data[data.index(b"P") :]
    assert decoded(AsciiDecoder(), headless).counts == {("Rejected", "no scan header arrived: the unit is unknown"): 5}
    assert decoded(AsciiDecoder("mm"), headless).points_mm == xyz


def test_lost_frames_and_a_lost_tail_are_counted() -> None:
    data, xyz = stream(10)
    lines = data.splitlines(keepends=True)
    book = decoded(AsciiDecoder(), b"".join(lines[:3] + lines[6:9] + lines[-1:]))
    assert book.sequence == [0, 1, 5, 6, 7]
    assert book.points_mm == [xyz[i] for i in book.sequence]
    assert book.lost == 3 + 2


def test_a_repeated_frame_is_rejected() -> None:
    data, _ = stream(4)
    lines = data.splitlines(keepends=True)
    book = decoded(AsciiDecoder(), b"".join(lines[:3] + lines[2:]))
    assert (book.sequence, book.lost) == ([0, 1, 2, 3], 0)
    assert book.counts["Rejected", "frame repeated"] == 1


def test_a_late_frame_is_a_point_and_no_longer_lost() -> None:
    data, xyz = stream(6)
    lines = data.splitlines(keepends=True)
    lines[3], lines[4] = lines[4], lines[3]
    book = any_cut_is_the_same(AsciiDecoder, b"".join(lines))
    assert (book.sequence, book.lost) == ([0, 1, 3, 2, 4, 5], 0)
    assert book.points_mm == [xyz[i] for i in book.sequence]
    assert book.time_s == [i * 500e-6 for i in book.sequence]


def test_a_heartbeat_tells_of_points_lost_before_a_pause() -> None:
    decoder = AsciiDecoder("mm")
    decoder.feed(line("P,0,0,0,0,0,0"))
    assert account(decoder.feed(line("H,4,2000"))).lost == 3


def test_sequence_and_clock_wrap() -> None:
    decoder = AsciiDecoder("mm")
    for sent in (2_000_000_000, 4_000_000_000, 2**32 - 2):  # heartbeats pass over what is too long for a test
        decoder.feed(line(f"H,{sent},0"))
    book = account(decoder.feed(b"".join(line(f"P,{(2**32 - 2 + i) % 2**32},{(2**32 - 600 + 500 * i) % 2**32},0,0,0,0") for i in range(4))))
    assert book.sequence == [2**32 - 2, 2**32 - 1, 2**32, 2**32 + 1]
    np.testing.assert_allclose(np.diff(book.time_s), 500e-6, rtol=0, atol=1e-9)


def test_garbage_without_a_line_end_is_counted_and_needs_no_memory() -> None:
    decoder = AsciiDecoder("mm")
    found = [arrival for _ in range(1000) for arrival in decoder.feed(b"x" * 1000)]
    assert set(found) == {Damaged(LONGEST_LINE, "no line end in time")}
    assert 0 < 1_000_000 - account(found).total("Damaged") <= 2 * LONGEST_LINE  # that much and no more waits for its line end
    rest = decoder.feed(b"\n" + line("P,0,0,1,2,3,0"))
    assert account(found + rest).total("Damaged") == 1_000_001
    assert account(rest).points_mm == [(1.0, 2.0, 3.0)]


@pytest.mark.parametrize("text", ["P,0,0,1e5,0,0,0", "P,0,0,nan,0,0,0", "P,0,0,1_0,0,0,0", "P,0,0, 1,0,0,0", "P,0,0,1,0,0", "Q,1", ""])
def test_sound_lines_of_another_form_are_damage(text: str) -> None:
    data = line(text)
    assert decoded(AsciiDecoder("mm"), data).counts == {("Damaged", "sound line of unknown form"): len(data)}


def test_a_line_cut_off_by_the_end_of_the_link_is_counted_and_the_next_is_read() -> None:
    decoder = AsciiDecoder("mm")
    decoder.feed(b"P,0,0,1,2")
    assert account(decoder.break_off()).total("Damaged") == 9
    assert account(decoder.feed(line("P,1,0,1,2,3,0"))).sequence == [1]


def test_a_device_that_begins_anew_opens_again() -> None:
    data, _ = stream(3)
    lines = data.splitlines(keepends=True)
    book = decoded(AsciiDecoder(), b"".join(lines[:3]) + data)
    assert book.others == [ScanOpened("dev", "1", 3), ScanOpened("dev", "1", 3), ScanClosed(3)]
    assert (book.sequence, book.lost) == ([0, 1, 0, 1, 2], 0)


def test_nothing_behind_the_end_is_of_the_scan() -> None:
    data, _ = stream(3)
    whole = decoded(AsciiDecoder(), data)
    next_part = line("S,dev,2,furlong,9") + line("P,0,0,1,2,3,0") + b"junk"
    assert any_cut_is_the_same(AsciiDecoder, data + line("E,3") + line("P,3,0,1,2,3,0") + next_part) == whole


def test_an_opening_said_again_within_the_scan_loses_nothing() -> None:
    data, xyz = stream(1500)
    lines = data.splitlines(keepends=True)
    book = any_cut_is_the_same(AsciiDecoder, b"".join([*lines[:701], lines[0], *lines[701:]]))
    assert (book.sequence, book.lost) == (list(range(1500)), 0)
    assert book.points_mm == xyz
    assert book.others == [ScanOpened("dev", "1", 1500), ScanClosed(1500)]


def test_another_opening_begins_anew() -> None:
    data, _ = stream(3)
    book = decoded(AsciiDecoder(), b"".join(data.splitlines(keepends=True)[:3]) + line("S,dev,2,mm,1") + line("P,0,0,1,2,3,0"))
    assert (book.sequence, book.lost) == ([0, 1, 0], 0)


@pytest.mark.parametrize("junk", [b"boot", b"*1234\r", b"P,7,S,S,", b"\x00\xff" * 300, b"P,0,1,2,3,4,0*0000\r"])
@pytest.mark.parametrize("place", [0, 1, 5])
def test_a_sound_line_is_found_behind_junk_in_the_same_line(junk: bytes, place: int) -> None:
    data, xyz = stream(20)
    lines = data.splitlines(keepends=True)
    lines[place] = junk + lines[place]
    book = any_cut_is_the_same(AsciiDecoder, b"".join(lines))
    assert (book.points_mm, book.lost, book.total("Damaged"), book.total("Rejected")) == (xyz, 0, len(junk), 0)


def test_line_ends_of_another_kind_are_named() -> None:
    data, _ = stream(20)
    data = data.replace(b"\r\n", b"\n")
    reason = "line that ends with line feed alone, not with carriage return and line feed"
    assert any_cut_is_the_same(AsciiDecoder, data).counts == {("Damaged", reason): len(data)}


@pytest.mark.parametrize("unit", ["IN", "furlong", "", "Zoll 2"])
def test_a_unit_that_is_none_is_named(unit: str) -> None:
    with pytest.raises(ProtocolError, match=f"sends points in '{unit}'; set the device to one of mm, um"):
        AsciiDecoder().feed(line(f"S,dev,1,{unit},3"))


def test_thousands_of_flipped_bits_give_no_wrong_point_and_the_true_loss() -> None:
    count = 60_000
    device, rng = AsciiDevice(), np.random.default_rng(4)
    sent_mm = np.round(rng.uniform(-100, 100, (count, 3)), 3)
    opening = device.opening(count)
    texts = (b"P,%d,%d,%.3f,%.3f,%.3f,0" % (i, 100 * i, x, y, z) for i, (x, y, z) in enumerate(sent_mm.tolist()))
    body = b"".join(b"%b*%04X\r\n" % (text, crc_hqx(text, 0xFFFF)) for text in texts)
    damaged = flipped(opening + body, 5e-4, rng, first=len(opening)) + device.closing(count)
    book = decoded(AsciiDecoder(), damaged, range(1024, len(damaged), 1024))
    only_sent_points(book, sent_mm, within_mm=0.0)
    assert len(set(book.sequence)) == len(book.sequence)
    assert 1200 < book.lost == count - len(book.sequence)


def test_an_opening_behind_points_whose_first_copy_was_damaged_loses_none_of_them() -> None:
    lines = stream(8)[0].splitlines(keepends=True)
    damaged = lines[0].replace(b"dev", b"dxv")
    book = any_cut_is_the_same(lambda: AsciiDecoder("mm"), b"".join([damaged, *lines[1:4], lines[0], *lines[4:]]))
    assert (book.sequence, book.lost) == (list(range(8)), 0)
    assert book.counts == {("Damaged", "checksum wrong"): len(damaged)}


def test_an_opening_behind_points_of_an_older_scan_begins_anew() -> None:
    older, data = stream(20)[0].splitlines(keepends=True)[5:9], stream(8)[0]
    book = any_cut_is_the_same(lambda: AsciiDecoder("mm"), b"".join([*older, data]))
    assert book.sequence == [*range(4, 8), *range(8)]
    assert book.others[-2:] == [ScanOpened("dev", "1", 8), ScanClosed(8)]


def test_another_point_under_an_old_number_is_no_repetition() -> None:
    lines = stream(8)[0].splitlines(keepends=True)
    book = any_cut_is_the_same(AsciiDecoder, b"".join([*lines[:6], lines[3], line("P,2,1000,1,2,3,0"), *lines[6:]]))
    assert (book.sequence, book.lost) == (list(range(8)), 0)
    assert book.counts == {("Rejected", FRAME_REPEATED): 1, ("Rejected", ANOTHER_CONTENT): 1}
