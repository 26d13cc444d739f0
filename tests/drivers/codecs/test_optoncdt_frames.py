"""optoNCDT 1420 against words worked out by hand, any cut, replies in the stream, and damage."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.codecs.optoncdt_frames import BEFORE_THE_OUTPUTS, ERRORS, OptoncdtDecoder
from drivers.errors import DeviceRefused, ProtocolError
from drivers.source import ANOTHER_CONTENT, HARMLESS_REASONS, OLDER_THAN_THE_SCAN, ScanClosed, ScanOpened
from simulators.devices.optoncdt_scanner import FIRST_COUNT, OptoncdtDevice
from simulators.stream import Sample
from tests.drivers.codecs.streams import Account, account, any_cut_is_the_same, decoded, flipped

INFO = b"GETOUTINFO_RS422 DIST1 COUNTER TIMESTAMPLO TIMESTAMPHI\r\n->"
# By hand from the manual's layout (ILD1420 p. 84): 32760 = 0111 111111 111000 is 38 7F 87;
# by its formula (p. 65) 50/100 * (51 - 1) = 25 mm.
# Counter 5: 05 40 C0. Time 0x00012345 ticks of 10 us: low word 2345h is 05 4D C2, high word 1 is 01 40 C0.
GOLDEN_BLOCK = bytes.fromhex("387F87 0540C0 054DC2 0140C0")


def make() -> OptoncdtDecoder:
    return OptoncdtDecoder(range_mm=50.0)


def word(value: int, further: bool) -> bytes:
    return bytes([value & 63, 64 | value >> 6 & 63, 128 | further << 6 | value >> 12 & 63])


def block(index: int, distance: int) -> bytes:
    ticks = index * 100
    further = [(7 + index) % (1 << 18), ticks & 0xFFFF, ticks >> 16 & 0xFFFF]
    return word(distance, False) + b"".join(word(value, True) for value in further)


def distances(book: Account) -> list[float]:
    return [z for _, _, z in book.points_mm]


def millimetres(distance: int) -> float:
    return 0.5 * (102.0 / 65520.0 * distance - 1.0)


def test_golden_bytes() -> None:
    book = any_cut_is_the_same(make, INFO + GOLDEN_BLOCK)
    assert distances(book) == [25.0]
    assert book.sequence == [0]
    assert book.time_s == [0x12345 / 1e5]
    assert book.others == [ScanOpened("optoNCDT 1420", "", None)]
    assert not book.counts


def test_the_ends_of_the_range() -> None:
    book = decoded(make(), INFO + block(0, 643) + block(1, 64877) + block(2, 642) + block(3, 64878))
    np.testing.assert_allclose(distances(book), [0.0, 50.0], atol=0.5 * 102 / 65520)
    assert book.counts == {("Rejected", "outside the measuring range"): 2}


def test_the_simulated_sensor_speaks_alike() -> None:
    device = OptoncdtDevice()
    replies = device.answer(make().request())
    assert INFO in replies
    assert device.told_to_begin()
    frame = device.frame([Sample(0, 0.74565, (0.0, 25.0, 0.0))])
    assert frame[:3] == GOLDEN_BLOCK[:3]
    assert frame[3:6] == word(FIRST_COUNT, True)
    assert frame[6:] == GOLDEN_BLOCK[6:]
    book = decoded(make(), replies + frame)
    assert distances(book) == [25.0]
    assert not book.counts


def test_replies_in_the_middle_of_the_stream_are_neither_points_nor_damage() -> None:
    replies = [b"\r\n->", b"GETINFO\r\nName: ILD1420-50\r\nSerial: 1234\r\n->", b"W05 warning\r\n->"]
    parts = [block(i, 30_000 + i) + replies[i % 3] for i in range(60)]
    book = any_cut_is_the_same(make, INFO + b"".join(parts))
    assert distances(book) == [millimetres(30_000 + i) for i in range(60)]
    assert not book.counts


def test_error_words_are_rejected_by_their_name() -> None:
    book = any_cut_is_the_same(make, INFO + b"".join(block(i, value) for i, value in enumerate(ERRORS)))
    assert book.counts == {("Rejected", reason): 1 for reason in ERRORS.values()}


def test_the_counter_wraps_and_shows_a_loss() -> None:
    device = OptoncdtDevice()
    opening = device.answer(make().request())
    frames = [device.frame([Sample(i, i * 1e-3, (0.0, 20.0, 0.0))]) for i in range(400)]
    book = any_cut_is_the_same(make, opening + b"".join(frames[:100] + frames[130:]))
    assert FIRST_COUNT + 400 > 1 << 18
    assert book.sequence == [*range(100), *range(130, 400)]
    assert book.lost == 30
    np.testing.assert_allclose(book.time_s, np.array(book.sequence) * 1e-3, atol=1e-9)


def test_values_before_the_order_is_known_are_counted() -> None:
    book = any_cut_is_the_same(make, block(0, 30_000) + b"\r\n->" + block(1, 30_000) + INFO + block(2, 30_000))
    assert book.counts == {("Rejected", OLDER_THAN_THE_SCAN): 1, ("Rejected", BEFORE_THE_OUTPUTS): 1}
    assert len(book.sequence) == 1
    assert BEFORE_THE_OUTPUTS not in HARMLESS_REASONS


def test_values_without_any_answer_are_not_taken_for_older_ones() -> None:
    book = any_cut_is_the_same(make, block(0, 30_000) + block(1, 30_000))
    assert book.counts == {("Rejected", BEFORE_THE_OUTPUTS): 2}


def test_other_outputs_are_followed_in_the_order_told() -> None:
    info = b"GETOUTINFO_RS422\r\nDIST1 TIMESTAMP INTENSITY COUNTER\r\n->"
    words = word(32760, False) + word(0x2345, True) + word(1, True) + word(40_000, True) + word(9, True)
    book = any_cut_is_the_same(make, info + words)
    assert (distances(book), book.time_s) == ([25.0], [0x12345 / 1e5])


def test_a_sensor_without_counter_is_refused() -> None:
    with pytest.raises(ProtocolError, match="COUNTER and TIMESTAMP are needed"):
        make().feed(b"GETOUTINFO_RS422 DIST1\r\n->")


def test_a_refusal_of_the_sensor_is_passed_on() -> None:
    with pytest.raises(DeviceRefused, match="E01 unknown command"):
        make().feed(b"E01 unknown command\r\n->")


@given(seed=st.integers(0, 2**32), edges=st.lists(st.integers(0, 1500), max_size=30))
@settings(max_examples=60, deadline=None)
def test_any_cut_of_a_damaged_stream_gives_the_same(seed: int, edges: list[int]) -> None:
    data = INFO + b"".join(block(i, 30_000 + i) for i in range(120))
    damaged = flipped(data, 0.005, np.random.default_rng(seed), first=len(INFO))
    try:
        whole = decoded(make(), damaged)
    except (DeviceRefused, ProtocolError):
        return  # flipped into a refusal
    assert decoded(make(), damaged, [min(edge, len(damaged)) for edge in edges]) == whole


@pytest.mark.parametrize("bit", range(6))
def test_a_first_value_whose_counter_is_flipped_costs_itself_alone(bit: int) -> None:
    """The values after it agree with each other and contradict it: they are points, not repetitions of lost ones."""
    data = bytearray(b"".join(block(i, 30_000 + i) for i in range(40)))
    data[4] ^= 1 << bit
    book = any_cut_is_the_same(make, INFO + bytes(data))
    assert distances(book) == [millimetres(30_000 + i) for i in range(1, 40)]
    assert book.sequence == list(range(39))
    assert book.counts == {("Damaged", "counter or clock contradicted by the next value"): 12}


def test_values_whose_counter_went_back_are_counted_however_the_bytes_are_cut() -> None:
    first, again = (b"".join(block(i, 30_000 + i) for i in range(40, 80)), b"".join(block(i, 30_000 + i) for i in range(30)))
    book = any_cut_is_the_same(make, INFO + first + again)
    assert len(book.sequence) == 40
    assert book.counts == {("Rejected", ANOTHER_CONTENT): 30}
    assert ANOTHER_CONTENT not in HARMLESS_REASONS


@pytest.mark.parametrize("at", range(12))
def test_a_lost_byte_costs_one_value(at: int) -> None:
    data = b"".join(block(i, 30_000 + i) for i in range(40))
    struck = 12 * 20 + at
    book = any_cut_is_the_same(make, INFO + data[:struck] + data[struck + 1 :])
    assert (len(book.sequence), book.lost) == (39, 1)
    assert distances(book) == [millimetres(30_000 + i) for i in book.sequence]


def test_thousands_of_flipped_bits_make_no_wrong_distance() -> None:
    """Marking bits, counter and clock may flip as they like; a flipped distance bit stays within the step that is allowed."""
    count, step_mm, begun = 100_000, 0.02, 200_000  # the counter wraps once
    index = begun + np.arange(count)
    value = (32_000 + 20_000 * np.sin(index / 5000)).astype(np.int64)
    words = np.stack([value, (7 + index) % (1 << 18), index * 100 & 0xFFFF, index * 100 >> 16 & 0xFFFF], axis=1)
    parts = [words & 63, 64 | words >> 6 & 63, 128 | np.array([0, 64, 64, 64]) | words >> 12 & 63]
    data = INFO + np.stack(parts, axis=2).astype(np.uint8).tobytes()
    tail = b"".join(block(begun + count + i, 30_000) for i in range(3))
    damaged = flipped(data, 3e-4, np.random.default_rng(4), first=len(INFO) + 24)
    decoder = OptoncdtDecoder(50.0, rate_hz=1000.0, count=count, largest_step_mm=step_mm)
    book = decoded(decoder, damaged + tail, range(1024, len(damaged), 1024))
    sequence = np.array(book.sequence)
    inside = sequence < count
    off_mm = np.abs(np.array(distances(book))[inside] - 0.5 * (102.0 / 65520.0 * value[sequence[inside]] - 1.0))
    assert off_mm.max() <= step_mm + 0.5 * 102.0 / 65520.0 * np.abs(np.diff(value)).max()
    np.testing.assert_allclose(np.array(book.time_s)[inside], (begun + sequence[inside]) * 1e-3, atol=0.51e-3)
    assert book.lost + book.total("Rejected") + len(sequence) == count
    assert book.others[-1] == ScanClosed(None)


def test_the_scan_ends_by_the_counter() -> None:
    decoder = OptoncdtDecoder(50.0, count=5)
    book = account(decoder.feed(INFO + b"".join(block(i, 30_000) for i in range(9))))
    assert book.sequence == list(range(5))
    assert book.others == [ScanOpened("optoNCDT 1420", "", 5), ScanClosed(None)]
