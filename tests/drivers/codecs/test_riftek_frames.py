"""RIFTEK RF60x against the examples of its manual, any cut, and damage."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.codecs.riftek_frames import RiftekAsciiDecoder, RiftekDecoder
from drivers.errors import ProtocolError
from drivers.source import Arrival, ScanClosed
from simulators.devices.riftek_scanner import RiftekDevice
from simulators.stream import Sample
from tests.drivers.codecs.streams import Account, account, any_cut_is_the_same, decoded, flipped

# Manual RF602 rev. 1.2.0, p. 17: request 01 86 is answered F5 FA F2 F0, which is 677, 2.066 mm of a range of 50 mm.
GOLDEN_RESULT = bytes.fromhex("F5FAF2F0")
# Manual RF602 rev. 1.2.0, p. 16: request 01 81 is answered by type 3Fh, firmware 90h, serial number 4321h, base 0050h, range 0032h.
GOLDEN_IDENTITY = bytes.fromhex("9F93 9099 91929394 90959090 92939090")


def make() -> RiftekDecoder:
    return RiftekDecoder(range_mm=50.0, rate_hz=1000.0)


def bursts(values: list[int]) -> bytes:
    return b"".join(bytes(0xC0 | (i & 3) << 4 | value >> 4 * k & 15 for k in range(4)) for i, value in enumerate(values))


def distances(book: Account) -> list[float]:
    return [z for _, _, z in book.points_mm]


def test_the_result_of_the_manual() -> None:
    book = any_cut_is_the_same(make, GOLDEN_RESULT + bytes.fromhex("C0"))
    assert distances(book) == [677 * 50 / 16384]
    assert round(distances(book)[0], 3) == 2.066


def test_the_simulated_sensor_answers_like_the_manual() -> None:
    device = RiftekDevice()
    assert device.answer(bytes.fromhex("0181")) == GOLDEN_IDENTITY
    device.frame([Sample(0, 0.0, (0.0, 677 * 50 / 16384, 0.0))])
    assert device.answer(bytes.fromhex("0186")) == GOLDEN_RESULT
    assert not device.told_to_begin()
    assert device.answer(RiftekDecoder(50.0, 1000.0).request()) == b""
    assert device.told_to_begin()


def test_the_stream_is_asked_for_once_and_stopped_at_the_end() -> None:
    decoder = RiftekDecoder(50.0, 1000.0, address=5, count=2)
    assert (decoder.request(), decoder.request()) == (b"\x05\x87", b"")
    assert account(decoder.feed(bursts([1, 2, 3]))).others == [ScanClosed(None)]
    assert decoder.request() == b"\x05\x88"


def test_time_is_the_number_of_the_burst_over_the_rate() -> None:
    book = decoded(make(), bursts(list(range(100))))
    assert book.sequence == list(range(100))
    np.testing.assert_allclose(book.time_s, np.arange(100) / 1000.0)


@pytest.mark.parametrize("lost", [1, 2, 3])
def test_lost_bursts_show_in_the_counter(lost: int) -> None:
    data = bursts(list(range(40)))
    book = any_cut_is_the_same(make, data[: 4 * 10] + data[4 * (10 + lost) :])
    assert book.lost == lost
    assert book.sequence == [*range(10), *range(10 + lost, 40)]


@pytest.mark.parametrize("at", range(40, 44))
def test_a_lost_byte_costs_one_burst(at: int) -> None:
    data = bursts([1000 + i for i in range(30)])
    book = any_cut_is_the_same(make, data[:at] + data[at + 1 :])
    assert (len(book.sequence), book.lost) == (29, 1)
    assert distances(book) == [(1000 + i) * 50 / 16384 for i in book.sequence]


@given(st.integers(40, 43), st.integers(0, 255))
@settings(max_examples=200, deadline=None)
def test_an_inserted_byte_never_makes_a_wrong_distance(at: int, byte: int) -> None:
    data = bursts([1000 + i for i in range(30)])
    book = decoded(make(), data[:at] + bytes([byte]) + data[at:])
    assert distances(book) == [(1000 + i) * 50 / 16384 for i in book.sequence]


@given(seed=st.integers(0, 2**32), edges=st.lists(st.integers(0, 800), max_size=30))
@settings(max_examples=60, deadline=None)
def test_any_cut_of_a_damaged_stream_gives_the_same(seed: int, edges: list[int]) -> None:
    damaged = flipped(bursts(list(range(0, 4000, 20))), 0.01, np.random.default_rng(seed))
    assert decoded(make(), damaged, [min(edge, len(damaged)) for edge in edges]) == decoded(make(), damaged)


def test_hundreds_of_flipped_bits_make_no_wrong_distance() -> None:
    """Flips of the four marking bits never give a wrong distance; flips of data bits stay within the step that is allowed."""
    count = 100_000
    values = (8000 + 4000 * np.sin(np.arange(count + 1) / 5000)).astype(np.int64)
    nibbles = np.stack([values >> 4 * k & 15 for k in range(4)], axis=1)
    clean = (0xC0 | (np.arange(count + 1) & 3)[:, None] << 4 | nibbles).astype(np.uint8)
    rng = np.random.default_rng(4)
    struck = np.argwhere(rng.random(clean.shape) < 4e-4)
    for marking_only in (True, False):
        damaged = clean.copy()
        damaged[struck[:, 0], struck[:, 1]] ^= (1 << rng.integers(4 if marking_only else 0, 8, len(struck))).astype(np.uint8)
        step_mm = 0.01
        decoder = RiftekDecoder(50.0, 1000.0, count=count, largest_step_mm=step_mm)
        data = damaged.tobytes()
        book = decoded(decoder, data, range(1024, len(data), 1024))
        off_mm = np.abs(np.array(distances(book)) - values[book.sequence] * 50 / 16384)
        true_step_mm = np.abs(np.diff(values)).max() * 50 / 16384
        assert off_mm.max() <= (0.0 if marking_only else step_mm + true_step_mm)
        assert book.lost + book.total("Rejected") + len(book.sequence) == count
        assert book.others == [ScanClosed(None)]


def test_values_not_renewed_or_out_of_range_are_rejected() -> None:
    data = bytearray(bursts([5, 6, 20000, 8, 9]))
    data[4:8] = bytes(byte & ~0x40 for byte in data[4:8])
    book = any_cut_is_the_same(make, bytes(data))
    assert book.sequence == [0, 3, 4]
    assert dict(book.counts) == {
        ("Rejected", "not renewed since the last transmission"): 1,
        ("Rejected", "outside the measuring range"): 1,
    }


def test_after_a_lost_link_the_scan_has_to_begin_anew() -> None:
    decoder = make()
    decoder.feed(bursts([1, 2, 3]))
    decoder.break_off()
    with pytest.raises(ProtocolError, match="begin the scan anew"):
        decoder.feed(bursts([4]))


def test_ascii_lines() -> None:
    book = any_cut_is_the_same(lambda: RiftekAsciiDecoder(100.0), b"2.066\r\n-0.5\r\nOK\r\n3\r\n7.")
    assert distances(book) == [2.066, -0.5, 3.0]
    assert book.total("Damaged") == 4 + 2
    assert (book.sequence, book.lost) == ([0, 1, 3], 1)  # the answer that is none was the third


def test_an_ascii_line_too_long_is_no_distance_however_it_is_cut() -> None:
    book = any_cut_is_the_same(lambda: RiftekAsciiDecoder(100.0), b"1.0\r\n" + 64 * b"x" + b"7.0\r\n2.0\r\n")
    assert (distances(book), book.sequence) == ([1.0, 2.0], [0, 2])


@pytest.mark.parametrize("count", [500, None])
def test_the_last_burst_is_taken(count: int | None) -> None:
    book = any_cut_is_the_same(lambda: RiftekDecoder(50.0, 1000.0, count=count), bursts(list(range(500))))
    assert (len(book.sequence), book.others) == (500, [] if count is None else [ScanClosed(None)])


def test_ascii_asks_again_after_each_answer_and_when_none_comes() -> None:
    decoder = RiftekAsciiDecoder(100.0, count=2)
    assert [decoder.request() for _ in range(3)] == [b"R1\r\n", b"", b""]
    assert decoder.feed(b"1.0") == []
    assert decoder.request() == b""
    decoder.feed(b"\r\n")
    assert decoder.request() == b"R1\r\n"
    assert b"".join(decoder.request() for _ in range(20)) == b"R1\r\n"
    arrivals: list[Arrival] = decoder.feed(b"2.0\r\n")
    assert account(arrivals).others == [ScanClosed(None)]
    assert decoder.request() == b""
