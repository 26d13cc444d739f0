"""Register blocks to arrivals, without any line: a small table of registers plays the device."""

from binascii import crc_hqx
from itertools import pairwise

import numpy as np
import pytest

from drivers.codecs.register_decoder import RegisterDecoder
from drivers.codecs.register_map import RegisterMap
from drivers.errors import DeviceRefused, ProtocolError
from drivers.maps import shipped_map
from drivers.source import Arrival, PointBatch
from tests.drivers.codecs.register_tables import RING, Gocator, Ring, Table, turns
from tests.drivers.codecs.streams import account


def test_golden_bytes_of_a_reading() -> None:
    """Laid out as in the Modbus Application Protocol V1.1b3, 6.4: function, address, count; function, byte count, data."""
    decoder = RegisterDecoder(shipped_map("riftek-rf60x"))
    assert decoder.request() == bytes.fromhex("04 0006 0001")
    # RF602 manual p. 17: value 02A5h of a 50 mm sensor is 2.066 mm
    book = account(decoder.feed(bytes.fromhex("04 0006 0001  04 02 02A5")))
    assert book.points_mm == [(0.0, 0.0, 677 * 50 / 16384)]


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


def test_an_answer_of_another_function_costs_itself_alone() -> None:
    ring, decoder = Ring(), RegisterDecoder(RING)
    ring.write(40)
    arrivals: list[Arrival] = []
    for strange in (b"\x04\x02\x00\x07", b"\x18\x00\x06\x00\x02\x01\xb8\x12\x84", b"\x84\x02", b"\x2b" + bytes(300)):
        arrivals += decoder.feed(decoder.request() + strange)
        arrivals += decoder.feed(ring.answer(decoder.request()))
    book = account(arrivals + turns(decoder, ring))
    assert book.sequence == list(range(40))
    assert book.counts == {("Damaged", "answer of another function than asked for"): 4 * 5 + 4 + 9 + 2 + 301}


FLOATS = {
    "device": "d",
    "pattern": "latest",
    "points": {
        "at": 0,
        "fields": {"sequence": {"at": 0, "type": "uint16"}, "x": {"at": 1, "type": "float32"}, "y": {"at": 3, "type": "float32"}},
    },
}


def test_swapped_words_are_named_when_most_points_make_no_sense() -> None:
    table, decoder = Table(), RegisterDecoder(RegisterMap.model_validate(FLOATS | {"word_order": "low-first"}))
    decoder.feed(table.answer(decoder.request()))
    arrivals: list[Arrival] = []

    def scan() -> None:
        for number in range(1, 300):
            table.registers[0] = number
            table.put(1, "f", 303.8695 + 0.1 * number)
            table.put(3, "f", 179.1953 - 0.1 * number)
            arrivals.extend(decoder.feed(table.answer(decoder.request())))

    with pytest.raises(ProtocolError, match=r"8 of \d+ points .* come swapped: set word_order: high-first in the map"):
        scan()
    for arrival in arrivals:
        assert not isinstance(arrival, PointBatch) or np.abs(arrival.points_mm).max() <= 1e6


@pytest.mark.parametrize("value", [1e9, 3.4e38, -1e7, 1e-41, float("inf"), float("nan")])
def test_a_coordinate_that_no_part_can_have_is_rejected_and_counted(value: float) -> None:
    table, decoder = Table(), RegisterDecoder(RegisterMap.model_validate(FLOATS))
    arrivals = decoder.feed(table.answer(decoder.request()))
    for number in range(1, 101):
        table.registers[0] = number
        table.put(1, "f", value if number % 10 == 0 else 1.0)
        table.put(3, "f", 2.0)
        arrivals += decoder.feed(table.answer(decoder.request()))
    book = account(arrivals)
    assert set(book.points_mm) == {(1.0, 2.0, 0.0)}
    assert (len(book.sequence), book.total("Rejected"), book.lost) == (90, 10 + 1, 0)


@pytest.mark.parametrize("value", [1e200, -1e308])
def test_a_float64_no_part_can_have_is_no_defect(value: float) -> None:
    document = {"device": "d", "pattern": "latest", "points": {"at": 0, "fields": {"x": {"at": 0, "type": "float64", "scale": 1e10}}}}
    table, decoder = Table(), RegisterDecoder(RegisterMap.model_validate(document))
    table.put(0, "d", value)
    assert account(decoder.feed(table.answer(decoder.request()))).total("Rejected") == 1


def test_counters_as_large_as_registers_hold_are_no_defect() -> None:
    document = {
        "device": "d",
        "pattern": "latest",
        "points": {"at": 0, "fields": {"sequence": {"at": 0, "type": "uint64"}, "x": {"at": 4, "type": "int16"}}},
    }
    table, decoder = Table(), RegisterDecoder(RegisterMap.model_validate(document))
    arrivals: list[Arrival] = []
    for sequence in (1, 5, 2**63, 2**64 - 1, 2**62, 2**61, 2**63 + 5, 6):
        table.put(0, "Q", sequence)
        table.registers[4] = 3
        arrivals += decoder.feed(table.answer(decoder.request()))
    assert 0 <= account(arrivals).lost <= 2**48


@pytest.mark.parametrize("kind", ["float32", "float64"])
def test_a_counter_that_is_no_whole_number_is_refused_with_the_map(kind: str) -> None:
    """Not a number has no whole number: a reading of it must not end in a traceback."""
    document = {
        "device": "d",
        "pattern": "latest",
        "points": {"at": 0, "fields": {"sequence": {"at": 0, "type": kind}, "x": {"at": 4, "type": "int16"}}},
    }
    with pytest.raises(ValueError, match=f"whole numbers for the field sequence, which counts or marks, not {kind}"):
        RegisterMap.model_validate(document)


def test_points_that_the_device_itself_calls_empty_do_not_put_the_map_in_doubt() -> None:
    """A profiler that sees nothing on most of its way is no profiler read wrongly."""
    table, decoder = Gocator(), RegisterDecoder(shipped_map("gocator"))
    arrivals = turns(decoder, table)
    table.queue = [(number, number, 0x80000000 if number % 4 else 250) for number in range(80, 160)]
    book = account(arrivals + turns(decoder, table))
    assert (len(book.sequence), book.counts["Rejected", "z holds no value"]) == (20, 60)
