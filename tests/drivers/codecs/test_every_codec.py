"""What every wire format keeps, found by its name: no cut of the bytes changes what is decoded, and no bytes cost memory or time."""

import sys
from collections import deque
from collections.abc import Callable
from itertools import pairwise
from random import Random

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.codecs import decoder, decoders
from drivers.codecs.register_decoder import RegisterDecoder
from drivers.codecs.register_map import RegisterMap
from drivers.errors import DeviceError
from drivers.maps import shipped_map
from drivers.source import Arrival, Damaged, Decoder, Lost, PointBatch, Rejected
from tests.drivers.codecs import wire_bytes
from tests.drivers.codecs.wire_bytes import PIECES, TURNS, Registers, cuttings, damaged

PATTERN = "N(?P<seq>[0-9]+) X(?P<x>[-+ .0-9]+) Y(?P<y>[-+ .0-9]+)"
OPTIONS: dict[str, list[dict[str, object]]] = {
    "ascii": [{}, {"unit": "mm"}],
    "binary": [{}],
    "optoncdt": [{"range_mm": 50.0}, {"range_mm": 50.0, "rate_hz": 1000.0, "largest_step_mm": 0.5, "count": 20}],
    "riftek": [{"range_mm": 50.0, "rate_hz": 1000.0}, {"range_mm": 50.0, "rate_hz": 1000.0, "count": 12, "largest_step_mm": 0.5}],
    "riftek-ascii": [{"rate_hz": 100.0}, {"rate_hz": 100.0, "count": 9, "largest_step_mm": 1.0}],
    "g800": [{"unit": "mm"}, {"unit": "inch", "tip_radius_mm": 38.1, "set_name": "B"}, {"unit": "mm", "tip_radius_mm": 1.0}],
    "pattern": [
        {"pattern": PATTERN, "unit": "mm", "points": 25},
        {"pattern": PATTERN, "unit": "mm", "end": "M30", "pass_over": "[(].*"},
    ],
}
MAPS = {
    "latest": RegisterMap.model_validate(wire_bytes.LATEST_MAP),
    **{name: shipped_map(name) for name in ("generic-ring", "generic-fifo", "gocator")},
}
NAMES = [*PIECES, *TURNS]
MOST_BYTES = 40_000  # that any decoder may hold back: a block of 1024 points takes 18,454
Event = tuple[object, ...]


def events(arrivals: list[Arrival]) -> list[Event]:
    """Everything that happened, in its order: points one by one, and like counts that follow one another as their sum."""
    found: list[Event] = []
    for arrival in arrivals:
        match arrival:
            case PointBatch():
                columns = arrival.sequence.tolist(), arrival.time_s.tolist(), arrival.points_mm.tolist()
                found += [(number, time_s, *point) for number, time_s, point in zip(*columns, strict=True)]
            case Damaged(byte_count, reason) | Rejected(byte_count, reason) | Lost(byte_count, reason):
                kind = (type(arrival).__name__, reason)
                before = int(str(found.pop()[2])) if found and found[-1][:2] == kind else 0
                found.append((*kind, byte_count + before))
            case _:
                found.append((arrival,))
    return found


def outcome(make: Callable[[], Decoder], data: bytes, cuts: list[int], lost_at: int) -> tuple[list[Event], str]:
    """What is decoded of the bytes cut at the given places, and what ended it; the link is lost once, at a place of its own."""
    made, failure = make(), ""
    arrivals: list[Arrival] = []
    try:
        for first, last in pairwise([0, *sorted([*cuts, lost_at]), len(data)]):
            arrivals += made.feed(data[first:last])
            arrivals += made.break_off() if first < last == lost_at else []
    except DeviceError as error:
        failure = str(error)
    return events(arrivals + made.break_off()), failure


def talk(register_map: RegisterMap, device: Registers, rng: Random) -> list[bytes]:
    """Let a decoder ask a device some times; gives the bytes of each request with its answer."""
    asking, pieces = RegisterDecoder(register_map), list[bytes]()
    for _ in range(rng.randint(1, 25)):
        request = asking.request()
        pieces.append(request + device.answer(request, rng))
        try:
            asking.feed(pieces[-1])
        except DeviceError:
            break
    return pieces


def wire_of(name: str, rng: Random) -> tuple[Callable[[], Decoder], bytes]:
    """Make a decoder's maker, and bytes for it."""
    if name in PIECES:
        options = rng.choice(OPTIONS[name])
        return lambda: decoder(name, **options), damaged(PIECES[name](rng), rng)
    pieces = talk(MAPS[name], Registers(TURNS[name], strange=rng.random() < 0.5), rng)
    return lambda: RegisterDecoder(MAPS[name]), b"".join(pieces) if rng.random() < 0.6 else damaged(pieces, rng)


def test_every_format_is_tried() -> None:
    assert set(PIECES) == set(decoders()), "give every format pieces in wire_bytes.py"


@pytest.mark.parametrize("name", NAMES)
@given(seed=st.integers(0, 2**32))
@settings(max_examples=30)
def test_no_cut_changes_what_is_decoded_nor_its_order(name: str, seed: int) -> None:
    rng = Random(seed)
    make, wire = wire_of(name, rng)
    lost_at = rng.choice([0, 0, rng.randint(0, len(wire))])
    whole, *others = [outcome(make, wire, cuts, lost_at) for cuts in cuttings(len(wire), rng)]
    assert all(other == whole for other in others)


@pytest.mark.parametrize("name", TURNS)
@pytest.mark.parametrize("seed", range(4))
def test_strange_answers_cost_themselves_alone(name: str, seed: int) -> None:
    """An answer of another function, even one that holds the request again, must not put the decoder out of step."""
    rng, asking = Random(seed), RegisterDecoder(MAPS[name])
    device, arrivals = Registers(TURNS[name], strange=True), list[Arrival]()
    for _ in range(150):
        request = asking.request()
        arrivals += asking.feed(request + device.answer(request, rng))
    device.strange = False
    for _ in range(20):
        request = asking.request()
        arrivals += asking.feed(request + device.answer(request, rng))
    strange = [at for at, event in enumerate(events(arrivals)) if event[:2] == ("Damaged", "answer of another function than asked for")]
    points = [at for at, event in enumerate(events(arrivals)) if len(event) == 5]
    assert strange
    assert points[-1] > strange[-1]


def endless(name: str, kind: str, rng: Random) -> bytes:
    """4096 bytes that may come for ever: of no form, of one letter, or half of what the format has."""
    _, wire = wire_of(name, Random(1))
    half = b"".join(piece[: max(1, len(piece) - 2)] for piece in (PIECES[name](rng) if name in PIECES else [wire[:40]]))
    heads = wire_bytes.binary_block(0, 0, 1024 * [(0, 0, 0, 0)])[:18] if name == "binary" else wire[:3]
    kinds = {"letters": b"x", "digits": b"7", "zeros": b"\0", "ones": b"\xff", "halves": half, "heads": heads}
    return ((kinds[kind] if kind in kinds else rng.randbytes(4096)) * 4096)[:4096]


def calls_to_feed(made: Decoder, pieces: list[bytes]) -> int:
    """Count the calls of functions, of C as of Python, that it takes to feed the pieces."""
    count = 0

    def note(frame: object, event: str, argument: object) -> None:
        nonlocal count
        count += event in ("call", "c_call")

    sys.setprofile(note)
    try:
        feed(made, pieces)
    finally:
        sys.setprofile(None)
    return count


def feed(made: Decoder, pieces: list[bytes]) -> None:
    """Feed the pieces one after the other, with a new link after each that is refused."""
    for piece in pieces:
        try:
            made.feed(piece)
        except DeviceError:
            made.break_off()


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("kind", ["letters", "digits", "zeros", "ones", "random", "halves", "heads"])
def test_no_bytes_cost_memory_or_time(name: str, kind: str) -> None:
    """What is held stays small, with every feed copied at most once, and as many bytes again cost as many calls again."""
    piece, (make, _) = endless(name, kind, Random(2)), wire_of(name, Random(1))
    made = make()
    feed(made, 8 * [piece])  # until a block that never ends is longer than any
    calls = [calls_to_feed(made, 8 * [piece]) for _ in range(2)]
    assert held(made, set()) < MOST_BYTES
    assert calls[1] <= 1.5 * calls[0] + 200
    small = [bytes([byte]) for byte in piece[:600]]
    singly = [calls_to_feed(made, small) for _ in range(3)]
    assert max(singly[1:]) <= 1.5 * singly[0] + 200
    assert held(made, set()) < MOST_BYTES


SPECIAL: dict[str, Callable[[int], bytes]] = {
    "ascii": lambda i: wire_bytes.ascii_line(f"P,{i},{i},1,1,1,{i % 2}"),
    "binary": lambda i: wire_bytes.binary_frame(1, i, i, bytes(12), flags=i % 2),
    "optoncdt": lambda i: b"".join(
        wire_bytes.optoncdt_word(value, first=not k) for k, value in enumerate((30_000 if i % 2 else 262_076, i, 100 * i % 2**16, 0))
    ),
    "riftek": lambda i: bytes((0xC0 if i % 2 else 0x80) | (i & 3) << 4 | 5 for _ in range(4)),
    "riftek-ascii": lambda i: b"1.5\r\n" if i % 2 else b"-\r\n",
    "g800": lambda i: b"G801 N%d X1. Y2. Z3. R%d.\r\n" % (i + 1, i % 2),
    "pattern": lambda i: b"N%d X1 Y%d\r" % (i + 1, i) if i % 2 else b"(A)\r",
}


@pytest.mark.parametrize("name", SPECIAL)
def test_a_stream_whose_every_second_point_is_special_costs_as_much_per_point_however_much_comes_at_once(name: str) -> None:
    """Nothing that stands behind a point is looked at again for each of them."""
    first = b"GETOUTINFO_RS422 DIST1 COUNTER TIMESTAMPLO TIMESTAMPHI\r\n->" if name == "optoncdt" else b""
    stream = first + b"".join(SPECIAL[name](i) for i in range(1200))

    def make() -> Decoder:
        return decoder(name, **OPTIONS[name][0])

    sixth = len(stream) // 6
    few = calls_to_feed(make(), [stream[at : at + 240] for at in range(0, sixth, 240)])
    many = calls_to_feed(make(), [stream])
    assert many <= 1.3 * 6 * few


def held(thing: object, seen: set[int]) -> int:
    """Bytes, and entries of lists, that a decoder and its parts hold."""
    if id(thing) in seen:
        return 0
    seen.add(id(thing))
    if isinstance(thing, bytes | bytearray):
        return len(thing)
    if isinstance(thing, np.ndarray):
        return int(thing.nbytes)
    if isinstance(thing, list | tuple | set | dict | deque):
        parts = list(thing.values()) if isinstance(thing, dict) else list(thing)
        return len(parts) + sum(held(part, seen) for part in parts)
    if type(thing).__module__.startswith("drivers."):
        return sum(held(part, seen) for part in getattr(thing, "__dict__", {}).values())
    return 0
