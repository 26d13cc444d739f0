"""Register blocks to arrivals, without any line: a small table of registers plays the device."""

from binascii import crc_hqx
from itertools import pairwise

import numpy as np
import pytest

from drivers.codecs.register_decoder import RegisterDecoder
from drivers.errors import DeviceRefused, ProtocolError
from drivers.maps import shipped_map
from tests.drivers.codecs.register_tables import RING, Ring, turns
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
