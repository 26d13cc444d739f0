"""Register blocks to arrivals, without any line: a small table of registers plays the device."""

import struct
from binascii import crc_hqx
from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest

from drivers.codecs.register_decoder import RegisterDecoder
from drivers.codecs.register_map import RegisterMap, load_map
from drivers.errors import DeviceRefused, ProtocolError
from drivers.source import Arrival, Heartbeat, Lost, ScanClosed, ScanOpened
from tests.drivers.codecs.streams import account, crc_bitwise

RING = load_map("generic-ring")


class Table:
    """Registers that answer requests."""

    def __init__(self) -> None:
        self.registers = np.zeros(65536, dtype=np.uint16)
        self.fifo: list[int] = []

    def put(self, at: int, code: str, value: float) -> None:
        data = struct.pack(">" + code, value)
        self.registers[at : at + len(data) // 2] = np.frombuffer(data, dtype=">u2")

    def answer(self, request: bytes) -> bytes:
        address = int.from_bytes(request[1:3], "big")
        if request[0] == 24:
            words, self.fifo = self.fifo[:31], self.fifo[31:]
            return request + struct.pack(f">BHH{len(words)}H", 24, 2 + 2 * len(words), len(words), *words)
        count = int.from_bytes(request[3:5], "big")
        data = self.registers[address : address + count].astype(">u2").tobytes()
        return request + bytes([request[0], len(data)]) + data


class Ring(Table):
    """The generic ring, as its map describes it."""

    def __init__(self) -> None:
        super().__init__()
        self.written = 0
        self.status(state=1)

    def status(self, state: int, written: int | None = None, overflow: int = 0, heartbeat: int = 0) -> None:
        self.put(0, "I", 0x434D4D31)
        self.put(2, "I", self.written if written is None else written)
        self.registers[4:7] = state, overflow, heartbeat
        self.put(7, "I", 1000)
        self.put(9, "I", self.written)
        self.registers[11] = crc_hqx(self.registers[:11].astype(">u2").tobytes(), 0xFFFF)

    def write(self, count: int, skip: int = 0) -> None:
        """Write points (n, -n, 0.5 n) um at n ms; `skip` numbers first."""
        for _ in range(count):
            number, at = self.written + skip, 100 + self.written % 500 * 11
            self.registers[at] = number % 65536
            self.put(at + 1, "I", number * 1000)
            for axis, units in enumerate((100 * number, -100 * number, 50 * number)):
                self.put(at + 3 + 2 * axis, "i", units)
            self.registers[at + 9] = 0
            self.seal(at)
            self.written += 1
        self.status(state=1)

    def seal(self, at: int) -> None:
        self.registers[at + 10] = crc_hqx(self.registers[at : at + 10].astype(">u2").tobytes(), 0xFFFF)


def turns(decoder: RegisterDecoder, table: Table, most: int = 200) -> list[Arrival]:
    """Ask and answer until there is nothing new."""
    arrivals: list[Arrival] = []
    for _ in range(most):
        arrivals += decoder.feed(table.answer(decoder.request()))
        if decoder.idle or any(isinstance(arrival, ScanClosed) for arrival in arrivals):
            return arrivals
    raise AssertionError("never idle")


def test_golden_bytes_of_a_reading() -> None:
    """Laid out as in the Modbus Application Protocol V1.1b3, 6.4: function, address, count; function, byte count, data."""
    decoder = RegisterDecoder(load_map("riftek-rf60x"))
    assert decoder.request() == bytes.fromhex("04 0006 0001")
    # RF602 manual p. 17: value 02A5h of a 50 mm sensor is 2.066 mm
    book = account(decoder.feed(bytes.fromhex("04 0006 0001  04 02 02A5")))
    assert book.points_mm == [(0.0, 0.0, 677 * 50 / 16384)]


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
    ring.write(20)
    ring.registers[100 + 19 * 11 + 5] ^= 1
    ring.status(state=2)
    book = account(turns(decoder, ring) + turns(decoder, ring))
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


def test_sequence_and_written_wrap() -> None:
    ring, decoder = Ring(), RegisterDecoder(RING, first=2**32 - 30)
    ring.written = 2**32 - 30
    put = ring.put
    ring.put = lambda at, code, value: put(at, code, value % 2**32 if code == "I" else 0)  # type: ignore[method-assign]
    ring.write(60)
    book = account(turns(decoder, ring))
    assert book.sequence == list(range(2**32 - 30, 2**32 + 30))


def test_sentinel_flag_and_not_a_number_are_rejected_by_their_reasons() -> None:
    ring = Ring()
    ring.write(4)
    for place, (at, code, value) in enumerate([(5, "I", 0x80000000), (9, "H", 1), (9, "H", 2)]):
        ring.put(100 + 11 * place + at, code, value)
        ring.seal(100 + 11 * place)
    book = account(turns(RegisterDecoder(RING), ring))
    assert book.sequence == [2, 3]
    assert dict(book.counts) == {("Rejected", "y holds no value"): 1, ("Rejected", "marked invalid by the device"): 1}
    nan = RegisterMap.model_validate(
        {"device": "d", "pattern": "latest", "points": {"at": 0, "fields": {"x": {"at": 0, "type": "float32"}}}}
    )
    table = Table()
    table.put(0, "f", float("nan"))
    assert account(turns(RegisterDecoder(nan), table)).counts == {("Rejected", "x is no number"): 1}


def test_swapped_words_and_another_device_are_called_so() -> None:
    ring = Ring()
    swapped = ring.registers.copy()
    swapped[[0, 1]] = ring.registers[[1, 0]]
    swapped[11] = crc_hqx(swapped[:11].astype(">u2").tobytes(), 0xFFFF)
    ring.registers = swapped
    with pytest.raises(ProtocolError, match="set word_order: low-first in the map"):
        turns(RegisterDecoder(RING), ring)
    ring.put(0, "I", 0x12345678)
    ring.registers[11] = crc_hqx(ring.registers[:11].astype(">u2").tobytes(), 0xFFFF)
    with pytest.raises(ProtocolError, match="register 0 holds 0x12345678, not 0x434d4d31: another device"):
        turns(RegisterDecoder(RING), ring)


def test_the_swapped_map_reads_the_swapped_device() -> None:
    ring = Ring()
    ring.write(3)
    for at in (0, 2, 7, 9, *(100 + 11 * place + k for place in range(3) for k in (1, 3, 5, 7))):
        ring.registers[[at, at + 1]] = ring.registers[[at + 1, at]]
    for place in range(3):
        ring.seal(100 + 11 * place)
    ring.registers[11] = crc_hqx(ring.registers[:11].astype(">u2").tobytes(), 0xFFFF)
    book = account(turns(RegisterDecoder(RING.model_copy(update={"word_order": "low-first"})), ring))
    np.testing.assert_allclose(book.points_mm, np.outer(np.arange(3), [1e-3, -1e-3, 5e-4]))


def test_a_damaged_status_is_read_again() -> None:
    ring, decoder = Ring(), RegisterDecoder(RING)
    ring.write(3)
    good = ring.registers[3]
    ring.registers[3] ^= 0x0100
    book = account(decoder.feed(ring.answer(decoder.request())))
    assert book.counts == {("Damaged", "status with a wrong checksum"): 24}
    ring.registers[3] = good
    assert account(turns(decoder, ring)).sequence == [0, 1, 2]


def test_an_answer_meant_for_another_request_is_no_point() -> None:
    """What RTU does after a time-out: the late answer comes for the next request."""
    ring, decoder = Ring(), RegisterDecoder(RING)
    ring.write(30)
    ask_status = decoder.request()
    decoder.feed(ring.answer(ask_status))
    ask_points = decoder.request()
    late = ring.answer(ask_status)[5:]
    book = account(decoder.feed(ask_points + late))
    assert book.counts == {("Damaged", "answer of another length than asked for"): 24}
    book = account(turns(decoder, ring))
    assert (book.sequence, book.lost) == (list(range(30)), 0)
    ring.write(11)
    old = ring.answer(bytes.fromhex("03 0064 0079"))[5:]  # points 0 to 10 once more
    decoder.feed(ring.answer(decoder.request()))
    book = account(decoder.feed(decoder.request() + old))
    assert (book.sequence, book.counts["Rejected", "point repeated"]) == ([], 11)


def test_a_restarted_device_opens_a_new_scan_after_three_agreeing_answers() -> None:
    ring, decoder = Ring(), RegisterDecoder(RING)
    ring.write(50)
    turns(decoder, ring)
    fresh = Ring()
    fresh.write(5)
    arrivals = [arrival for _ in range(3) for arrival in decoder.feed(fresh.answer(decoder.request()))]
    book = account(arrivals + turns(decoder, fresh))
    assert book.sequence == list(range(5))
    assert book.others == [ScanOpened("generic ring", "", 1000)]
    assert not book.counts


def test_heartbeat_and_overflow_are_told_once_each() -> None:
    ring, decoder = Ring(), RegisterDecoder(RING)
    arrivals: list[Arrival] = []
    for beat, overflow in ((0, 0), (1, 0), (1, 1), (2, 1)):
        ring.status(state=1, heartbeat=beat, overflow=overflow)
        arrivals += decoder.feed(ring.answer(decoder.request()))
    assert arrivals.count(Heartbeat()) == 2
    assert [arrival.count for arrival in arrivals if isinstance(arrival, Lost)] == [0]


def test_a_refusal_names_the_registers_and_the_way_out() -> None:
    decoder = RegisterDecoder(RING)
    with pytest.raises(DeviceRefused, match=r"exception 2 \(no such registers\) to function 3 at register 0, count 12; check the map"):
        decoder.feed(decoder.request() + b"\x83\x02")


@pytest.mark.parametrize("cut", ["whole", "bytes", "random"])
def test_the_record_is_read_the_same_however_it_is_cut(cut: str) -> None:
    ring, decoder = Ring(), RegisterDecoder(RING)
    record, arrivals = b"", []
    for count in (3, 30, 400, 0, 200):
        ring.write(count)
        for _ in range(60):
            pair = ring.answer(decoder.request())
            record += pair
            arrivals += decoder.feed(pair)
            if decoder.idle:
                break
    live = account(arrivals)
    edges = {
        "whole": [0, len(record)],
        "bytes": list(range(len(record) + 1)),
        "random": [0, *sorted(np.random.default_rng(1).integers(0, len(record), 50).tolist()), len(record)],
    }[cut]
    again = RegisterDecoder(RING)
    replayed = account(arrival for a, b in pairwise(edges) for arrival in again.feed(record[a:b]))
    assert replayed == live
    assert len(live.sequence) == 633


LATEST = RegisterMap.model_validate(
    {
        "device": "latest",
        "pattern": "latest",
        "points": {
            "at": 10,
            "fields": {"sequence": {"at": 0, "type": "uint16"}, "x": {"at": 1, "type": "int16", "scale": 0.5, "offset": 1.0}},
        },
    }
)


def test_the_latest_point_is_taken_once_and_gaps_are_counted() -> None:
    table, decoder = Table(), RegisterDecoder(LATEST)
    arrivals: list[Arrival] = []
    for sequence in (5, 5, 6, 6, 9):
        table.registers[10:12] = sequence, 2 * sequence
        arrivals += decoder.feed(table.answer(decoder.request()))
    book = account(arrivals)
    assert book.sequence == [5, 6, 9]
    assert book.points_mm == [(6.0, 0.0, 0.0), (7.0, 0.0, 0.0), (10.0, 0.0, 0.0)]
    assert book.lost == 2


def test_the_latest_counter_wraps() -> None:
    table, decoder = Table(), RegisterDecoder(LATEST)
    arrivals: list[Arrival] = []
    for sequence in (65530, 65533, 2, 4):
        table.registers[10] = sequence
        arrivals += decoder.feed(table.answer(decoder.request()))
    book = account(arrivals)
    assert book.sequence == [65530, 65533, 65538, 65540]
    assert book.lost == 2 + 4 + 1


class Gocator(Table):
    """Stamp and one measurement; reading 976 takes a message out of the queue."""

    def __init__(self) -> None:
        super().__init__()
        self.queue: list[tuple[int, int, int]] = []  # frame, encoder, um
        self.registers[300] = 1

    def answer(self, request: bytes) -> bytes:
        address, count = struct.unpack(">HH", request[1:5])
        if address <= 976 < address + count and self.queue:
            frame, encoder, um = self.queue.pop(0)
            self.put(988, "q", encoder)
            self.put(992, "q", frame * 500)
            self.put(996, "q", frame)
            self.put(1000, "I", um & 0xFFFFFFFF)
            self.registers[1002] = 1 if um != 0x80000000 else 2
        self.registers[977] = len(self.queue)
        return super().answer(request)


def test_a_queue_is_popped_before_it_is_read_and_never_read_twice() -> None:
    table, decoder = Gocator(), RegisterDecoder(load_map("gocator"))
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
    fifo_map, table = load_map("generic-fifo"), Table()
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


def without_sent() -> RegisterMap:
    """The generic ring of a device that does not tell how many points it sent."""
    document = RING.model_dump()
    del document["status"]["fields"]["sent"]
    return RegisterMap.model_validate(document)


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


def overflows(arrivals: list[Arrival]) -> int:
    return sum(isinstance(arrival, Lost) and "overflowed" in arrival.reason for arrival in arrivals)


def test_an_overflow_told_with_the_latest_point_is_heard_even_when_the_point_is_not_new() -> None:
    document = LATEST.model_dump()
    document["points"]["fields"]["overflow"] = {"at": 2, "type": "uint16"}
    table, decoder = Table(), RegisterDecoder(RegisterMap.model_validate(document))
    heard = []
    for sequence, overflow in ((5, 0), (5, 1), (6, 1), (7, 0), (8, 2)):
        table.registers[10:13] = sequence, 0, overflow
        heard.append(overflows(decoder.feed(table.answer(decoder.request()))))
    assert heard == [0, 1, 0, 0, 1]


def test_an_overflow_told_with_the_points_of_a_ring_is_heard_once_each_time_and_only_where_it_is_sound() -> None:
    document = RING.model_dump()
    document["points"]["fields"]["overflow"] = document["points"]["fields"].pop("flags")
    document["points"]["fields"]["overflow"]["invalid_bits"] = 0
    ring, decoder = Ring(), RegisterDecoder(RegisterMap.model_validate(document))
    ring.write(9)
    for place in (1, 2, 5, 7):
        ring.registers[100 + 11 * place + 9] = 1
        if place != 7:
            ring.seal(100 + 11 * place)
    arrivals = turns(decoder, ring)
    assert overflows(arrivals) == 2  # points 1 and 2 tell of one, and of point 7 the checksum is wrong
    ring.status(state=1, overflow=1)
    arrivals = turns(decoder, ring)
    ring.write(1)
    ring.status(state=1, overflow=1)
    assert overflows(arrivals + turns(decoder, ring)) == 1  # the points' own register does not take back what the status says
