"""The four ways in which devices hand their points over, each on a table of registers that plays the device."""

import struct
from binascii import crc_hqx
from collections.abc import Callable

import numpy as np
import pytest

from drivers.codecs.register_account import AS_IT_BEGAN
from drivers.codecs.register_decoder import RegisterDecoder
from drivers.maps import shipped_map
from drivers.source import HARMLESS_REASONS, OLDER_THAN_THE_SCAN, Arrival, ScanClosed, ScanOpened
from tests.drivers.codecs.register_tables import LATEST, RING, Gocator, Ring, Table, turns, without_sent
from tests.drivers.codecs.streams import account, crc_bitwise


def test_golden_bytes_of_a_ring_entry() -> None:
    """By hand from the map: number 7, 1500 us, (1.5, -2.25, 0.125) mm = 000249F0, FFFC9118, 000030D4, flags 0; checksum bit by bit."""
    ring = Ring()
    ring.registers[100:110] = [7, 0, 1500, 0x0002, 0x49F0, 0xFFFC, 0x9118, 0x0000, 0x30D4, 0]
    ring.seal(100)
    assert ring.registers[110] == crc_bitwise(ring.registers[100:110].astype(">u2").tobytes()) == 0x6FA4
    ring.status(state=1, written=1)
    book = account(turns(RegisterDecoder(RING), ring))
    assert book.points_mm == [(1.5, -2.25, 0.125)]
    assert book.time_s == [0.0015]
    assert book.lost == 7


def test_a_ring_is_followed_over_its_edge() -> None:
    ring, decoder = Ring(), RegisterDecoder(RING)
    arrivals: list[Arrival] = []
    for count in (1, 0, 11, 488, 12, 300, 499):
        ring.write(count)
        arrivals += turns(decoder, ring)
    book = account(arrivals)
    assert book.sequence == list(range(1311))
    np.testing.assert_allclose(book.points_mm, np.outer(np.arange(1311), [1e-3, -1e-3, 5e-4]))
    np.testing.assert_allclose(book.time_s, np.arange(1311) * 1e-3)
    assert not book.counts


def test_the_end_of_the_scan_and_a_lost_tail() -> None:
    ring, decoder = Ring(), RegisterDecoder(RING)
    arrivals = turns(decoder, ring)
    ring.write(20)
    ring.registers[100 + 19 * 11 + 5] ^= 1
    ring.status(state=2)
    book = account(arrivals + turns(decoder, ring) + turns(decoder, ring))
    assert book.others == [ScanOpened("generic ring", "", 1000), ScanClosed(20)]
    assert (len(book.sequence), book.lost) == (19, 1)
    assert book.counts["Damaged", "point with a wrong checksum"] == 3 * 22  # read again twice


def test_a_point_damaged_on_the_way_is_read_again_and_not_lost() -> None:
    ring, decoder = Ring(), RegisterDecoder(RING)
    ring.write(20)
    decoder.feed(ring.answer(decoder.request()))
    answer = bytearray(ring.answer(decoder.request()))
    answer[7 + 22 * 4 + 6] ^= 0x10
    arrivals = decoder.feed(bytes(answer))
    assert account(arrivals).sequence == [0, 1, 2, 3]
    book = account(arrivals + turns(decoder, ring))
    assert (book.sequence, book.lost) == (list(range(20)), 0)
    assert book.counts == {("Damaged", "point with a wrong checksum"): 22}


def test_an_overrun_ring_loses_and_counts_what_was_overrun() -> None:
    ring, decoder = Ring(), RegisterDecoder(RING)
    ring.write(10)
    arrivals = turns(decoder, ring)
    ring.write(900)
    book = account(arrivals + turns(decoder, ring))
    assert book.sequence == [*range(10), *range(410, 910)]
    assert book.lost == 400


def test_points_the_device_dropped_are_lost() -> None:
    ring, decoder = Ring(), RegisterDecoder(RING)
    ring.write(10)
    ring.write(5, skip=3)
    book = account(turns(decoder, ring))
    assert book.sequence == [*range(10), *range(13, 18)]
    assert book.lost == 3


@pytest.mark.parametrize("bad", [{3}, {2, 3}, {0}, {1}, {0, 3}, {0, 1, 2}])
def test_what_a_ring_wrote_and_never_came_soundly_is_lost_at_the_end(bad: set[int]) -> None:
    ring, decoder = Ring(), RegisterDecoder(without_sent())
    ring.write(4)
    for place in bad:
        ring.registers[100 + 11 * place + 5] ^= 1
    arrivals = turns(decoder, ring)
    ring.status(state=2)
    book = account(arrivals + turns(decoder, ring))
    assert book.sequence == sorted({0, 1, 2, 3} - bad)
    assert book.lost == len(bad)
    assert book.others == [ScanOpened("generic ring", "", 1000), ScanClosed(None)]


def test_a_ring_of_which_nothing_came_soundly_is_lost_as_a_whole() -> None:
    ring, decoder = Ring(), RegisterDecoder(without_sent())
    arrivals = turns(decoder, ring)
    ring.write(2)
    for place in range(2):
        ring.registers[100 + 11 * place + 5] ^= 1
    ring.status(state=2)
    book = account(arrivals + turns(decoder, ring))
    assert (book.sequence, book.lost) == ([], 2)


def test_the_end_of_a_ring_counts_what_the_device_dropped_and_what_was_overrun_once() -> None:
    ring, decoder = Ring(), RegisterDecoder(without_sent())
    ring.write(510)  # ten are overrun before the first reading
    arrivals = turns(decoder, ring)
    ring.write(5, skip=3)
    ring.registers[100 + 11 * 14 + 5] ^= 1
    ring.status(state=2)
    book = account(arrivals + turns(decoder, ring))
    assert book.sequence == [*range(10, 510), *range(513, 517)]
    assert book.lost == 10 + 3 + 1


def test_old_points_read_once_more_at_the_end_do_not_stand_for_the_last_ones() -> None:
    ring, decoder = Ring(), RegisterDecoder(without_sent())
    ring.write(4)
    arrivals = turns(decoder, ring)
    old = ring.answer(bytes.fromhex("03 0064 000B"))[5:]
    ring.write(1)
    ring.status(state=2)
    arrivals += decoder.feed(ring.answer(decoder.request()))
    arrivals += decoder.feed(decoder.request() + old)
    book = account(arrivals + turns(decoder, ring))
    assert (book.sequence, book.counts["Rejected", "point repeated"], book.lost) == ([0, 1, 2, 3], 1, 1)


def test_the_latest_point_is_taken_once_and_gaps_are_counted() -> None:
    table, decoder = Table(), RegisterDecoder(LATEST)
    arrivals: list[Arrival] = []
    for sequence in (4, 4, 5, 5, 6, 6, 9):
        table.registers[10:12] = sequence, 2 * sequence
        arrivals += decoder.feed(table.answer(decoder.request()))
    book = account(arrivals)
    assert book.sequence == [5, 6, 9]
    assert book.points_mm == [(6.0, 0.0, 0.0), (7.0, 0.0, 0.0), (10.0, 0.0, 0.0)]
    assert book.lost == 2
    assert book.counts["Rejected", OLDER_THAN_THE_SCAN] == 1


@pytest.mark.parametrize("goes_on", [False, True])
def test_a_ring_that_was_finished_when_the_run_began_is_no_scan_of_it(goes_on: bool) -> None:
    ring, decoder = Ring(), RegisterDecoder(without_sent())
    ring.write(30)
    ring.status(state=2)
    arrivals = turns(decoder, ring) + turns(decoder, ring)
    if not goes_on:
        ring = Ring()
    first = ring.written
    ring.write(20)
    arrivals += turns(decoder, ring)
    ring.status(state=2)
    book = account(arrivals + turns(decoder, ring))
    assert (book.sequence, book.lost, book.counts) == (list(range(first, first + 20)), 0, {})
    assert [type(other) for other in book.others] == [ScanOpened, ScanClosed]


@pytest.mark.parametrize("began_meanwhile", [False, True])
def test_what_waited_in_a_queue_when_the_run_began_is_no_point_of_it(began_meanwhile: bool) -> None:
    table, decoder = Gocator(), RegisterDecoder(shipped_map("gocator"))
    table.registers[300] = 0
    table.queue = [(5, 1000, 1), (6, 2000, 2)]
    arrivals = [arrival for _ in range(3) for arrival in decoder.feed(table.answer(decoder.request()))]  # status, and one message
    table.registers[300] = int(began_meanwhile)
    arrivals += turns(decoder, table) + turns(decoder, table)
    table.registers[300] = 1
    arrivals += turns(decoder, table)
    table.queue = [(7, 3000, 3)]
    arrivals += turns(decoder, table)
    book = account(arrivals)
    unknown, older = book.counts["Rejected", AS_IT_BEGAN], book.counts["Rejected", OLDER_THAN_THE_SCAN]
    assert (book.sequence, unknown, older) == (([6, 7], 1, 0) if began_meanwhile else ([7], 0, 2))
    assert AS_IT_BEGAN not in HARMLESS_REASONS


@pytest.mark.parametrize("first", [0, 1])
def test_what_stood_in_the_registers_before_the_scan_is_no_point_of_it(first: int) -> None:
    """Zeros until the device measures; its count may begin with 0 or 1."""
    table, decoder = Table(), RegisterDecoder(LATEST, count=20)
    arrivals = [arrival for _ in range(5) for arrival in decoder.feed(table.answer(decoder.request()))]
    for number in range(20):
        table.registers[10:12] = first + number, 100 + number
        arrivals += decoder.feed(table.answer(decoder.request()))
    book = account(arrivals)
    assert book.sequence == list(range(first, first + 20))
    assert (book.lost, book.counts) == (0, {("Rejected", OLDER_THAN_THE_SCAN): 1})
    assert book.others[-1] == ScanClosed(None)


def test_a_point_of_the_part_before_is_no_point_of_the_scan() -> None:
    table, decoder = Table(), RegisterDecoder(LATEST)
    arrivals: list[Arrival] = []
    for sequence, x in ((299, 7), (299, 7), (299, 8), (0, 50), (1, 51)):
        table.registers[10:12] = sequence, x
        arrivals += decoder.feed(table.answer(decoder.request()))
    book = account(arrivals)
    assert (book.sequence, book.lost) == ([0, 1], 0)


def test_a_queue_is_popped_before_it_is_read_and_never_read_twice() -> None:
    table, decoder = Gocator(), RegisterDecoder(shipped_map("gocator"))
    arrivals = turns(decoder, table)
    table.queue = [(17, 1000, -250), (18, 2000, 0x80000000), (21, 3000, 250)]
    table.registers[978] = 1
    arrivals += turns(decoder, table)
    arrivals += turns(decoder, table)
    table.registers[300] = 0
    arrivals += turns(decoder, table)
    book = account(arrivals)
    assert book.sequence == [17, 21]
    assert book.points_mm == [(1.0, 0.0, -0.25), (3.0, 0.0, 0.25)]
    assert book.time_s == [17 * 500e-6, 21 * 500e-6]
    assert book.lost == 2
    assert book.counts["Rejected", "z holds no value"] == 1
    assert book.others == [ScanOpened("LMI Gocator", "", None), ScanClosed(None)]


def test_a_fifo_hands_over_whole_points() -> None:
    fifo_map, table = shipped_map("generic-fifo"), Table()
    decoder = RegisterDecoder(fifo_map)

    def entry(number: int) -> list[int]:
        data = struct.pack(">HIiii", number, number * 1000, number, 0, -number)
        words = [int(word) for word in np.frombuffer(data, dtype=">u2")]
        return [*words, crc_hqx(data, 0xFFFF)]

    def status(state: int) -> None:
        table.put(0, "I", 0x434D4D32)
        table.registers[4] = state
        table.put(9, "I", 9)
        table.registers[11] = crc_hqx(table.registers[:11].astype(">u2").tobytes(), 0xFFFF)

    status(1)
    table.fifo = [word for number in (0, 1, 2, 3, 5) for word in entry(number)]
    arrivals: list[Arrival] = []
    original: Callable[[bytes], bytes] = table.answer

    def whole(request: bytes) -> bytes:
        if request[0] != 24:
            return original(request)
        words, table.fifo = table.fifo[:30], table.fifo[30:]
        return request + struct.pack(f">BHH{len(words)}H", 24, 2 + 2 * len(words), len(words), *words)

    table.answer = whole  # type: ignore[method-assign]
    arrivals += turns(decoder, table)
    status(2)
    arrivals += turns(decoder, table)
    book = account(arrivals)
    assert book.sequence == [0, 1, 2, 3, 5]
    assert book.lost == 1 + 3
    assert book.others == [ScanOpened("generic fifo", "", None), ScanClosed(9)]
