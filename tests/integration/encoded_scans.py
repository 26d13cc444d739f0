"""Every source of points: a scan as its device puts it on the wire, with the faults of the catalogue, and as the driver reads it.

The encoders are those of `simulators`, which share no line with `drivers`; nothing here opens a link. What passed over the wire is
kept as a transcript, so that the same bytes can be read again in other pieces.
"""

import asyncio
import itertools
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from drivers.codecs import decoder
from drivers.codecs.register_decoder import RegisterDecoder
from drivers.codecs.register_map import RegisterMap
from drivers.errors import DeviceError, LinkError
from drivers.links.axis import Beam, ConstantFeed, Delivery, merge
from drivers.maps import shipped_map
from drivers.source import Arrival, Decoder, LinkDown, LinkUp, PointBatch, ScanClosed, WireBytes
from simulators.devices.ascii_scanner import AsciiDevice
from simulators.devices.binary_scanner import BinaryDevice, BlockDevice
from simulators.devices.gocator import Gocator
from simulators.devices.modbus_generic import FifoDevice, RingDevice
from simulators.devices.optoncdt_scanner import OptoncdtDevice
from simulators.devices.riftek_registers import RiftekRegisters
from simulators.devices.riftek_scanner import RiftekAsciiDevice, RiftekDevice
from simulators.faults import Fault, Injector
from simulators.motion import Motion, Walk
from simulators.registers import READ_FIFO, RegisterDevice, RegisterService, Words
from simulators.settings import SimulatorSettings
from simulators.stream import Device, StreamedScan
from tests.integration.listed import Listed

Array = NDArray[np.float64]
Transcript = list[bytes | None]  # what passed over the wire, a read each; None where the link was lost

RATE_HZ = 1000.0
TICK_S = 2e-5
MOST_REQUESTS = 1500
ALONG_X = Beam((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0))


@dataclass(frozen=True, slots=True)
class Source:
    """One kind of source.

    encode   : a transcript of the scan, given as the points (n, 3) that the device takes, with faults and a seed of theirs
    decoder  : what reads it, given the number of points and the distance between them
    flat     : the device measures distances y while the part is fed along x
    follows  : the position x comes from a device of its own
    sound    : damage to the bytes shows, so that no point is ever a wrong one
    upright  : the section's y comes as z
    faults   : the faults that it may meet; empty: those that all streams, or all registers, may meet
    comes_back : a lost link is tried again while the run goes on
    """

    encode: Callable[[Array, Sequence[Fault], int], Transcript]
    decoder: Callable[[int], Decoder]
    flat: bool = False
    follows: bool = False
    sound: bool = False
    upright: bool = False
    faults: tuple[str, ...] = ()
    comes_back: bool = True


def ticks() -> Callable[[], float]:
    """A clock that goes on by as much whenever it is asked: what passes over the wire does not depend on how busy this computer is."""
    asked = itertools.count(1)
    return lambda: next(asked) * TICK_S


def walk_of(points_mm: Array) -> Walk:
    return Walk(np.arange(len(points_mm)) / RATE_HZ, points_mm)


class ScanEndedError(Exception):
    """The driver has closed the link, as the scan is over."""


class Wire:
    """A line whose other end is a decoder: it hears every byte at once and says what the driver would send."""

    address = "wire"
    is_read_live = True

    def __init__(self, made: Decoder) -> None:
        self.transcript: Transcript = []
        self._decoder = made
        self._plugged = True

    def is_connected(self) -> bool:
        return self._plugged

    def send(self, data: bytes) -> bool:
        if self._plugged and data:
            self.transcript.append(data)
            if any(isinstance(arrival, ScanClosed) for arrival in self._decoder.feed(data)):
                raise ScanEndedError
        return self._plugged

    def receive(self, wait_s: float) -> bytes:
        return self._decoder.request() if self._plugged else b""

    def unplug(self) -> None:
        self._plugged = False
        self.transcript.append(None)
        self._decoder.break_off()

    def plug(self) -> None:
        self._plugged = True

    def close(self) -> None:
        self._plugged = False


def streaming(device: Callable[[], Device], made: Callable[[int], Decoder]) -> Callable[[Array, Sequence[Fault], int], Transcript]:
    """Encode by the engine of the streaming devices."""

    def encode(points_mm: Array, faults: Sequence[Fault], seed: int) -> Transcript:
        wire = Wire(made(len(points_mm)))
        scan = StreamedScan(wire, device(), walk_of(points_mm), Injector(faults, seed), paced=False, clock=ticks())
        with suppress(SystemExit, DeviceError, ScanEndedError):  # the device died, or the driver is through: what follows is not heard
            scan.run()
        return wire.transcript

    return encode


class LatestDevice(RegisterDevice):
    """A device that shows its newest point, with a counter, and nothing of the past; the counter is 0 until it measures."""

    def __init__(self, scan: Walk, injector: Injector, swapped: bool) -> None:
        super().__init__(scan, injector, swapped=swapped)
        self._reads = 0
        self._shown: int | None = None

    def points_appearing(self, function: int, address: int, count: int) -> int:
        self._reads += 1
        return int(self._reads > 1)  # the first read finds what stood there before

    def take(self, taken: int) -> None:
        for index in range(self.taken, taken):
            for number in self.injector.points_stored_at(index):
                self._shown = number
        self.taken = taken

    def read(self, table: int, address: int, count: int) -> Words:
        registers = np.zeros(16, dtype=np.uint16)
        self.done |= self.taken >= self.count
        if (number := self._shown) is not None:
            registers[0] = number + 1
            units = np.round(self.scan.points_mm[number] * 1e5).astype(np.int64) & 0xFFFFFFFF
            registers[1:7] = self.numbers(units, ">u4").reshape(-1)
            registers[7] = self.injector.marks_invalid(number)
        return registers[address : address + count]


_XYZ = {axis: {"at": 1 + 2 * place, "type": "int32", "scale": 1e-5} for place, axis in enumerate("xyz")}
LATEST = RegisterMap.model_validate(
    {
        "device": "latest",
        "pattern": "latest",
        "points": {
            "at": 0,
            "fields": {"sequence": {"at": 0, "type": "uint16"}, **_XYZ, "flags": {"at": 7, "type": "uint16", "invalid_bits": 1}},
        },
    }
)


def registers(
    device: Callable[[Walk, Injector, bool], RegisterDevice], made: Callable[[int], Decoder]
) -> Callable[[Array, Sequence[Fault], int], Transcript]:
    """Encode by the engine of the Modbus devices: requests and answers, as they pass behind a link that checks its frames."""

    def encode(points_mm: Array, faults: Sequence[Fault], seed: int) -> Transcript:
        settings = SimulatorSettings("memory:0", points_mm[:2], Motion(1.0, RATE_HZ, seed=seed), tuple(faults), paced=False)
        service = RegisterService(settings, lambda _: None, device, walk_of(points_mm), ticks())
        return asyncio.run(_asked(service, made(len(points_mm)), Injector(faults, seed + 1)))

    return encode


async def _asked(service: RegisterService, reader: Decoder, line: Injector) -> Transcript:
    transcript: Transcript = []
    for _ in range(MOST_REQUESTS):
        request = reader.request()
        answer = await _answer(service, request)
        line.note_progress(service.device.taken)
        damaged = line.damage(answer[2:])
        if len(damaged) == len(answer) - 2:  # an answer of another length never comes through the link: the same is asked again
            pair = request + answer[:2] + damaged
            transcript.append(pair)
            try:
                found = reader.feed(pair)
            except DeviceError:
                return transcript
            if any(isinstance(arrival, ScanClosed) for arrival in found):
                return transcript
        if service.is_going_away():
            transcript.append(None)
            reader.break_off()
    return transcript


async def _answer(service: RegisterService, request: bytes) -> bytes:
    function, address, count = request[0], int.from_bytes(request[1:3], "big"), int.from_bytes(request[3:5], "big")
    if function == READ_FIFO:
        words = np.array(await service.take_fifo(address), dtype=">u2")
        return bytes([function]) + (2 + 2 * len(words)).to_bytes(2, "big") + len(words).to_bytes(2, "big") + words.tobytes()
    words = np.array(await service.read(function, address, count), dtype=">u2")
    return bytes([function, 2 * len(words)]) + words.tobytes()


def decode(source: Source, transcript: Transcript, count: int, cuts: np.random.Generator | None = None) -> list[Arrival | Exception]:
    """What the driver makes of a transcript, its bytes cut anew where a generator is given, and the error that ended it."""
    made = source.decoder(count)
    arrivals: list[Arrival | Exception] = []
    try:
        for number, data in enumerate(_cut_anew(transcript, cuts)):
            if data is None and not source.comes_back:
                return [*arrivals, *made.break_off(), LinkError("the link was lost")]
            if data is None:
                arrivals += [*made.break_off(), LinkDown("the link was lost"), LinkUp(0.1)]
                continue
            arrivals += [WireBytes(number / RATE_HZ, data), *made.feed(data)]
            if any(isinstance(arrival, ScanClosed) for arrival in arrivals[-8:]):
                break
        else:
            arrivals += [*made.break_off(), LinkError("silent")]
    except DeviceError as error:
        arrivals += [*made.break_off(), error]
    return arrivals


def _cut_anew(transcript: Transcript, cuts: np.random.Generator | None) -> Iterator[bytes | None]:
    """The same bytes in other pieces; a lost link stays where it was."""
    if cuts is None:
        yield from transcript
        return
    joined = b""
    for place, data in enumerate([*transcript, None]):
        if data is not None:
            joined += data
            continue
        edges = np.sort(cuts.integers(0, len(joined) + 1, 1 + len(joined) // 400))
        yield from (joined[first:stop] for first, stop in pairwise([0, *edges.tolist(), len(joined)]) if stop > first)
        joined = b""
        if place < len(transcript):
            yield None


def placed(source: Source, arrivals: list[Arrival | Exception], step_mm: float) -> Listed:
    """The arrivals as a source; distances along the axis that feeds the part."""
    if not source.flat:
        return Listed(arrivals)
    if not source.follows:
        return Listed(ConstantFeed(Listed(arrivals), ALONG_X, step_mm * RATE_HZ).arrivals())
    return Listed(merge(_beside_an_axis(arrivals, step_mm), ALONG_X))


def _beside_an_axis(arrivals: list[Arrival | Exception], step_mm: float) -> Iterator[Delivery]:
    """An axis that tells where it is before and after every reading of the sensor; it moves a step from one reading to the next."""
    taken = 0
    for arrival in arrivals:
        if isinstance(arrival, PointBatch):
            for row in range(len(arrival)):
                at_s = taken / RATE_HZ
                for time_s in (at_s, at_s + 1e-9):
                    yield Delivery(True, WireBytes(time_s, b""))
                    yield Delivery(True, PointBatch(np.array([taken]), np.array([time_s]), np.array([[taken * step_mm, 0.0, 0.0]])))
                yield Delivery(False, WireBytes(at_s, b""))
                one = slice(row, row + 1)
                yield Delivery(False, PointBatch(arrival.sequence[one].copy(), np.array([at_s]), arrival.points_mm[one].copy()))
                taken += 1
        else:
            yield Delivery(False, arrival)
    yield Delivery(False, None)


def _stream(device: Callable[[], Device], made: Callable[[int], Decoder], *, flat: bool = False, sound: bool = False) -> Source:
    return Source(streaming(device, made), made, flat=flat, sound=sound)


def _registers(
    device: Callable[[Walk, Injector, bool], RegisterDevice],
    made: Callable[[int], Decoder],
    *,
    flat: bool = False,
    follows: bool = False,
    sound: bool = False,
    upright: bool = False,
) -> Source:
    return Source(registers(device, made), made, flat, follows, sound, upright)


SOURCES: dict[str, Source] = {
    "ascii": _stream(AsciiDevice, lambda _: decoder("ascii"), sound=True),
    "binary": _stream(BinaryDevice, lambda _: decoder("binary"), sound=True),
    "binary blocks": _stream(BlockDevice, lambda _: decoder("binary"), sound=True),
    "optoncdt": _stream(OptoncdtDevice, lambda count: decoder("optoncdt", range_mm=50.0, rate_hz=RATE_HZ, count=count), flat=True),
    "riftek": _stream(RiftekDevice, lambda count: decoder("riftek", range_mm=50.0, rate_hz=RATE_HZ, count=count), flat=True),
    "riftek ascii": _stream(RiftekAsciiDevice, lambda count: decoder("riftek-ascii", rate_hz=RATE_HZ, count=count), flat=True),
    "modbus ring": _registers(RingDevice, lambda _: RegisterDecoder(shipped_map("generic-ring")), sound=True),
    "modbus fifo": _registers(FifoDevice, lambda _: RegisterDecoder(shipped_map("generic-fifo")), sound=True),
    "modbus latest": _registers(LatestDevice, lambda count: RegisterDecoder(LATEST, count=count)),
    "gocator": _registers(Gocator, lambda _: RegisterDecoder(shipped_map("gocator")), upright=True),
    "riftek registers": _registers(
        RiftekRegisters, lambda count: RegisterDecoder(shipped_map("riftek-rf60x"), count=count), flat=True, follows=True
    ),
}
