"""What the tests of every decoder need: one account of arrivals, and streams of bytes cut and damaged."""

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from drivers.source import Arrival, Damaged, Decoder, Lost, PointBatch, Rejected, WireBytes


@dataclass(slots=True)
class Account:
    """Points in order, and the sums of everything counted."""

    sequence: list[int] = field(default_factory=list)
    time_s: list[float] = field(default_factory=list)
    points_mm: list[tuple[float, ...]] = field(default_factory=list)
    counts: Counter[tuple[str, str]] = field(default_factory=Counter)
    others: list[Arrival] = field(default_factory=list)

    def total(self, name: str) -> int:
        return sum(count for (kind, _), count in self.counts.items() if kind == name)

    @property
    def lost(self) -> int:
        return self.total("Lost")


def account(arrivals: Iterable[Arrival]) -> Account:
    book = Account()
    batches: list[PointBatch] = []
    for arrival in arrivals:
        match arrival:
            case PointBatch():
                batches.append(arrival)
            case Damaged():
                book.counts["Damaged", arrival.reason] += arrival.byte_count
            case Rejected() | Lost():
                book.counts[type(arrival).__name__, arrival.reason] += arrival.count
            case WireBytes():
                book.counts["WireBytes", ""] += len(arrival.data)
            case _:
                book.others.append(arrival)
    if batches:
        book.sequence = np.concatenate([batch.sequence for batch in batches]).tolist()
        book.time_s = np.concatenate([batch.time_s for batch in batches]).tolist()
        book.points_mm = list(map(tuple, np.concatenate([batch.points_mm for batch in batches]).tolist()))
    return book


def decoded(decoder: Decoder, data: bytes, cuts: Sequence[int] = ()) -> Account:
    """Feed `data` cut at the given places."""
    edges = [0, *sorted(cuts), len(data)]
    arrivals = [arrival for a, b in pairwise(edges) for arrival in decoder.feed(data[a:b])]
    return account(arrivals + decoder.break_off())


def any_cut_is_the_same(make: Callable[[], Decoder], data: bytes, seed: int = 0) -> Account:
    """Check whole, byte by byte and fifty random cuttings against each other; return the account."""
    whole = decoded(make(), data)
    assert decoded(make(), data, range(1, len(data))) == whole
    rng = np.random.default_rng(seed)
    for _ in range(50):
        assert decoded(make(), data, rng.integers(0, len(data) + 1, rng.integers(1, 20)).tolist()) == whole
    return whole


def flipped(data: bytes, per_byte: float, rng: np.random.Generator, first: int = 0) -> bytes:
    """Turn over one random bit in a share of the bytes from `first` on."""
    array = np.frombuffer(data, dtype=np.uint8).copy()
    struck = first + np.flatnonzero(rng.random(len(array) - first) < per_byte)
    array[struck] ^= (1 << rng.integers(0, 8, len(struck))).astype(np.uint8)
    return array.tobytes()


def only_sent_points(book: Account, sent_mm: NDArray[np.float64], within_mm: float) -> None:
    """Check that every accepted point is the one that was sent under its number."""
    got = np.array(book.points_mm).reshape(-1, sent_mm.shape[1])
    wrong = np.abs(got - sent_mm[np.array(book.sequence, dtype=int)]).max(axis=1) > within_mm
    assert not wrong.any(), f"{wrong.sum()} wrong points of {len(got)}"


def crc_bitwise(data: bytes) -> int:
    """CRC-16/CCITT-FALSE bit by bit, as its definition says; no library is asked."""
    crc = 0xFFFF
    for byte in data:
        crc ^= byte << 8
        for _ in range(8):
            crc = ((crc << 1) ^ 0x1021 if crc & 0x8000 else crc << 1) & 0xFFFF
    return crc
