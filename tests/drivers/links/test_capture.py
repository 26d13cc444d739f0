"""A recorded scan played again gives what the source gave: decoded anew, or as recorded; with the same end."""

from binascii import crc_hqx
from collections.abc import Iterable, Iterator

import numpy as np
import pytest

from drivers.codecs.ascii_frames import AsciiDecoder
from drivers.errors import DeviceError, ProtocolError
from drivers.links.capture import Capture
from drivers.source import Arrival, Damaged, LinkDown, LinkUp, PointBatch, WireBytes
from simulators.devices.ascii_scanner import AsciiDevice
from simulators.faults import Fault, Injector
from simulators.stream import Sample

COUNT = 300


def scan_bytes(*faults: str) -> bytes:
    device, injector = AsciiDevice(), Injector([Fault.parse(fault) for fault in faults], seed=3)
    points = np.random.default_rng(3).normal(size=(COUNT, 3)).tolist()
    samples = [Sample(index, index * 1e-3, tuple(point)) for index, point in enumerate(points)]
    frames = (injector.pass_on(sample.index, device.frame([sample])) for sample in samples)
    return device.opening(COUNT) + b"".join(map(injector.damage, frames)) + device.closing(COUNT)


def cut(data: bytes, seed: int) -> Iterator[bytes]:
    rng = np.random.default_rng(seed)
    while data:
        size = int(rng.integers(1, 200))
        yield data[:size]
        data = data[size:]


def as_a_source_gives_it(data: bytes, seed: int, broken_after: int | None = None) -> list[Arrival]:
    """Arrivals of a scan; the link is lost and found again after so many reads."""
    decoder = AsciiDecoder()
    found: list[Arrival] = []
    for index, piece in enumerate(cut(data, seed)):
        if index == broken_after:
            found += [*decoder.break_off(), LinkDown("unplugged"), LinkUp(0.5)]
        found += [WireBytes(float(index), piece), *decoder.feed(piece)]
    return found


def comparable(arrivals: Iterable[Arrival]) -> list[object]:
    return [
        (arrival.sequence.tobytes(), arrival.time_s.tobytes(), arrival.points_mm.tobytes()) if isinstance(arrival, PointBatch) else arrival
        for arrival in arrivals
    ]


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("broken_after", [None, 17])
def test_wire_bytes_decoded_anew_give_every_arrival_again(seed: int, broken_after: int | None) -> None:
    data = scan_bytes("flip:0.001", "lost-frames:0.05", "repeated-frames:0.05", "reordered-frames:0.05")
    recorded = as_a_source_gives_it(data, seed, broken_after)
    assert sum(isinstance(arrival, Damaged) for arrival in recorded) > 1
    again = comparable(Capture(recorded, AsciiDecoder()).arrivals())
    assert again == comparable(recorded)
    assert comparable(Capture(recorded, None).arrivals()) == again


def test_what_was_decoded_then_does_not_count_only_the_bytes_do() -> None:
    recorded = as_a_source_gives_it(scan_bytes(), 0)
    bytes_alone = [arrival for arrival in recorded if isinstance(arrival, WireBytes)]
    assert comparable(Capture(bytes_alone, AsciiDecoder()).arrivals()) == comparable(recorded)


@pytest.mark.parametrize("decoder", [AsciiDecoder(), None])
def test_a_scan_that_failed_fails_again_with_its_begun_frame_accounted_for(decoder: AsciiDecoder | None) -> None:
    recorded = as_a_source_gives_it(scan_bytes()[:-70], 1)
    recorded.extend([Damaged(6, "line cut off where the link ended")])
    arrivals: list[Arrival] = []
    with pytest.raises(DeviceError, match="the link was lost: unplugged"):
        arrivals.extend(Capture(recorded, decoder, "the link was lost: unplugged").arrivals())
    assert sum(isinstance(arrival, PointBatch) for arrival in arrivals) > 10
    assert isinstance(arrivals[-1], Damaged)
    assert sum(isinstance(arrival, Damaged) for arrival in arrivals) == 1


def test_what_the_decoder_refuses_it_refuses_again() -> None:
    line = AsciiDevice().opening(1).replace(b",mm,", b",furlong,")
    sound = line[: line.index(b"*")]
    data = b"%b*%04X\r\n" % (sound, crc_hqx(sound, 0xFFFF))
    with pytest.raises(ProtocolError, match="furlong"):
        list(Capture([WireBytes(0.0, data)], AsciiDecoder()).arrivals())


def test_stop_ends_the_replay() -> None:
    recorded = as_a_source_gives_it(scan_bytes(), 0)
    capture = Capture(recorded, None)
    arrivals = capture.arrivals()
    assert next(arrivals) is recorded[0]
    capture.stop()
    assert list(arrivals) == []
