"""What every wire format keeps, found by its name: no cut of the bytes changes what is decoded, and no bytes cost memory."""

from collections import deque
from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.codecs import decoder, decoders
from drivers.codecs.register_decoder import RegisterDecoder
from drivers.errors import DeviceError
from drivers.source import Arrival, Decoder, PointBatch
from tests.drivers.codecs.register_tables import RING, Ring
from tests.drivers.codecs.streams import Account, account
from tests.drivers.codecs.test_ascii_frames import stream
from tests.drivers.codecs.test_binary_frames import single
from tests.drivers.codecs.test_optoncdt_frames import INFO, block
from tests.drivers.codecs.test_riftek_frames import bursts

OPTIONS: dict[str, dict[str, object]] = {
    "optoncdt": {"range_mm": 50.0},
    "riftek": {"range_mm": 50.0, "rate_hz": 1000.0},
    "riftek-ascii": {"rate_hz": 100.0},
}
MOST_BYTES = 20_000  # that any decoder may hold back


def ring_stream() -> bytes:
    ring, asking = Ring(), RegisterDecoder(RING)
    ring.write(30)
    data = b""
    for _ in range(8):
        answer = ring.answer(asking.request())
        asking.feed(answer)
        data += answer
    return data


SOUND: dict[str, bytes] = {
    "ascii": stream(12)[0] + stream(3)[0],
    "binary": single(12)[0] + single(3)[0],
    "optoncdt": INFO + b"".join(block(i, 30_000 + i) for i in range(20)) + b"OUTPUT RS422\r\n->" + block(20, 30_000),
    "riftek": bursts(list(range(30))),
    "riftek-ascii": b"1.5\r\n-2.25\r\nOK\r\n3\r\n" * 8,
    "registers": ring_stream(),
}
NAMES = [*sorted(decoders()), "registers"]


def make_of(name: str) -> Callable[[], Decoder]:
    return (lambda: RegisterDecoder(RING)) if name == "registers" else (lambda: decoder(name, **OPTIONS.get(name, {})))


def outcome(make: Callable[[], Decoder], data: bytes, edges: list[int]) -> tuple[Account, str]:
    """What is decoded of the bytes cut at the edges, and what ended it."""
    made, failure = make(), ""
    arrivals: list[Arrival] = []
    cuts = [0, *sorted(edge % (len(data) + 1) for edge in edges), len(data)]
    try:
        for first, last in pairwise(cuts):
            arrivals += made.feed(data[first:last])
    except DeviceError as error:
        failure = str(error)
    arrivals += made.break_off()
    if failure:  # what was pending where it ended is not what was decoded
        arrivals = [arrival for arrival in arrivals if isinstance(arrival, PointBatch)]
    return account(arrivals), failure


@st.composite
def damaged(draw: st.DrawFn, sound: bytes) -> bytes:
    """Sound bytes with pieces taken out, put in, turned over or said twice; or bytes of any kind."""
    data = draw(st.sampled_from([sound, sound, sound, b""]))
    for _ in range(draw(st.integers(0, 6))):
        at, size = draw(st.integers(0, len(data))), draw(st.integers(0, 40))
        piece = draw(st.one_of(st.binary(max_size=80), st.sampled_from([b"->", b"\r\n", b"-", b"S,", data[at : at + size], 5000 * b"x"])))
        data = data[:at] + piece + data[at + draw(st.sampled_from([0, 1, size])) :]
    return data


def test_every_format_is_tried() -> None:
    assert set(SOUND) == set(NAMES), "give every format sound bytes here"


@pytest.mark.parametrize("name", NAMES)
@given(data=st.data())
@settings(max_examples=150, deadline=None)
def test_no_cut_changes_what_is_decoded(name: str, data: st.DataObject) -> None:
    wire = data.draw(damaged(SOUND[name]))
    edges = data.draw(st.lists(st.integers(0, 10_000), max_size=12))
    make = make_of(name)
    whole = outcome(make, wire, [])
    assert outcome(make, wire, edges) == whole
    if len(wire) < 2000:
        assert outcome(make, wire, list(range(len(wire)))) == whole


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("kind", ["letters", "zeros", "ones", "random", "heads"])
def test_no_bytes_cost_memory(name: str, kind: str) -> None:
    rng = np.random.default_rng(1)
    heads = SOUND[name][: max(2, len(SOUND[name]) // 40)] + bytes([SOUND[name][0]])
    piece = {"letters": 4096 * b"x", "zeros": bytes(4096), "ones": 4096 * b"\xff", "random": rng.bytes(4096), "heads": 300 * heads}[kind]
    made = make_of(name)()
    for _ in range(50):
        try:
            made.feed(piece)
        except DeviceError:
            break
    assert held(made, set()) < MOST_BYTES + 300 * len(heads)


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
