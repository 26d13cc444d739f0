"""What the counters in registers say: wraps, repetitions, losses, a device that began anew."""

from drivers.codecs.register_decoder import RegisterDecoder
from drivers.codecs.register_map import RegisterMap
from drivers.source import Arrival, Heartbeat, Lost, ScanOpened
from tests.drivers.codecs.register_tables import LATEST, RING, Ring, Table, turns
from tests.drivers.codecs.streams import account


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


def test_the_latest_counter_wraps() -> None:
    table, decoder = Table(), RegisterDecoder(LATEST)
    arrivals: list[Arrival] = []
    for sequence in (65529, 65530, 65533, 2, 4):
        table.registers[10] = sequence
        arrivals += decoder.feed(table.answer(decoder.request()))
    book = account(arrivals)
    assert book.sequence == [65530, 65533, 65538, 65540]
    assert book.lost == 2 + 4 + 1
