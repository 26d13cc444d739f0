"""Every scan ends when no more points come, whatever else a device answers: over real sockets, against counter-parties of our own."""

import math
import socket
import struct
import threading
import time
from binascii import crc_hqx
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager, ExitStack, contextmanager, suppress
from dataclasses import dataclass, field

import pytest

from drivers.codecs import decoder
from drivers.codecs.ascii_frames import AsciiDecoder
from drivers.codecs.register_decoder import RegisterDecoder
from drivers.codecs.register_map import RegisterMap
from drivers.errors import DeviceError
from drivers.links.link_settings import LinkSettings
from drivers.links.modbus_scanner import ModbusScanner
from drivers.links.serial_scanner import SerialScanner
from drivers.source import Arrival, PointBatch, ScanSource

SILENCE_S, RECONNECT_S = 1.5, 0.6  # a busy machine takes a second to say the first words
PATIENCE_S = 20.0  # of these tests: who goes on for longer goes on for ever
FOR_EVER_S = 1000.0  # longer than a test may take
SETTINGS = LinkSettings(9600, "N", SILENCE_S, RECONNECT_S)
POINTS = 20
Serve = Callable[[socket.socket], None]


@contextmanager
def served(serve: Serve) -> Iterator[str]:
    """Serve every client, one after the other, until the end of the block."""
    with socket.create_server(("127.0.0.1", 0)) as server:

        def run() -> None:
            with suppress(OSError):
                while True:
                    client = server.accept()[0]
                    with client, suppress(OSError):
                        serve(client)

        thread = threading.Thread(target=run, daemon=True)
        thread.start()
        yield f"127.0.0.1:{server.getsockname()[1]}"
        server.shutdown(socket.SHUT_RDWR)
        server.close()
    thread.join(timeout=10.0)


def sealed(text: str) -> bytes:
    return b"%b*%04X\r\n" % (text.encode(), crc_hqx(text.encode(), 0xFFFF))


OPENING = sealed("S,d,1,mm,300")


def say_for_ever(*texts: bytes) -> Serve:
    """Points to the first client, and the same texts for ever to every one."""
    points = [OPENING, *(sealed(f"P,{n},{n},1,2,3,0") for n in range(POINTS))]

    def serve(client: socket.socket) -> None:
        client.recv(16)  # it is asked to begin once the link is open
        while points:
            client.sendall(points.pop(0))
        while True:
            for text in texts:
                client.sendall(text)
                time.sleep(0.02)

    return serve


def one_byte_and_gone(client: socket.socket) -> None:
    client.sendall(b"S")


def say_and_go(text: bytes) -> Serve:
    def serve(client: socket.socket) -> None:
        client.sendall(text)

    return serve


def not_a_word(client: socket.socket) -> None:
    while client.recv(1000):
        pass


def registers(then: Callable[[bytes], bytes]) -> Serve:
    """Points 1 to 20 of a device with one point in its registers; `then` answers every further request by the last value.

    Who connects anew did not wait for the last answer, as on a busy machine, and is given it again.
    """
    asked = 0

    def serve(client: socket.socket) -> None:
        nonlocal asked
        asked = max(asked - 1, 0) if asked <= POINTS + 1 else asked
        while request := client.recv(1000):
            point = struct.pack(">HHH", min(asked, POINTS), 10 * min(asked, POINTS), 7)
            unit = bytes([request[7], len(point)]) + point if asked <= POINTS else then(bytes([request[7], len(point)]) + point)
            asked += 1
            client.sendall(request[:4] + struct.pack(">HB", len(unit) + 1, request[6]) + unit)

    return serve


LATEST = RegisterMap.model_validate(
    {
        "device": "d",
        "pattern": "latest",
        "points": {"at": 0, "fields": {n: {"at": at, "type": "uint16"} for at, n in enumerate(("sequence", "x", "y"))}},
    }
)


def serial(address: str) -> ScanSource:
    return SerialScanner(address, AsciiDecoder(), SETTINGS)


def binary(address: str) -> ScanSource:
    return SerialScanner(address, decoder("binary"), SETTINGS)


def optoncdt(address: str) -> ScanSource:
    return SerialScanner(address, decoder("optoncdt", range_mm=50, rate_hz=1000, count=300), SETTINGS)


def riftek(address: str) -> ScanSource:
    return SerialScanner(address, decoder("riftek", range_mm=50, rate_hz=1000, count=300), SETTINGS)


def modbus(address: str, timeout_s: float = 0.3) -> ScanSource:
    return ModbusScanner(address, RegisterDecoder(LATEST, count=300), SETTINGS, timeout_s=timeout_s)


def patient(address: str) -> ScanSource:
    return modbus(address, FOR_EVER_S)


def for_ever(*texts: bytes) -> Serve:
    """The same texts as fast as they are taken, and not one point."""

    def serve(client: socket.socket) -> None:
        while True:
            for text in texts:
                client.sendall(text)

    return serve


def gone_at_once(client: socket.socket) -> None:
    client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))  # closed with a reset


def trickle(client: socket.socket) -> None:
    while True:
        client.sendall(b"\0")
        time.sleep(0.05)


def other_transactions(client: socket.socket) -> None:
    while request := client.recv(1000):
        number = (int.from_bytes(request[:2], "big") + 1) & 0xFFFF
        client.sendall(20 * (struct.pack(">HHHBBB", number, 0, 5, request[6], request[7], 2) + b"\0\1"))


@contextmanager
def full_backlog() -> Iterator[str]:
    """A server that never accepts, whose queue of connections is full: a further client gets no answer at all."""
    with socket.create_server(("127.0.0.1", 0), backlog=0) as server, ExitStack() as stack:
        for _ in range(4):
            client = stack.enter_context(socket.socket())
            client.setblocking(False)
            client.connect_ex(server.getsockname())
        yield f"127.0.0.1:{server.getsockname()[1]}"


@contextmanager
def nobody() -> Iterator[str]:
    with socket.create_server(("127.0.0.1", 0)) as server:
        address = f"127.0.0.1:{server.getsockname()[1]}"
    yield address


def by(serve: Serve) -> Callable[[], AbstractContextManager[str]]:
    return lambda: served(serve)


Case = tuple[Callable[[str], ScanSource], Callable[[], AbstractContextManager[str]], int]
CASES: dict[str, Case] = {
    "the opening again and again": (serial, by(say_for_ever(OPENING)), POINTS),
    "the last point again and again": (serial, by(say_for_ever(sealed(f"P,{POINTS - 1},19,1,2,3,0"))), POINTS),
    "junk between openings": (serial, by(say_for_ever(OPENING, b"junk\r\n")), POINTS),
    "an opening, one byte and gone": (serial, by(say_and_go(OPENING)), 0),
    "junk as fast as it is taken": (serial, by(for_ever(b"P,1,0,0,0,0\n", b"\0" * 5000)), 0),
    "openings as fast as they are taken": (serial, by(for_ever(100 * OPENING)), 0),
    "one byte and gone": (serial, by(one_byte_and_gone), 0),
    "a byte now and then": (serial, by(trickle), 0),
    "gone at once": (serial, by(gone_at_once), 0),
    "not a word": (serial, by(not_a_word), 0),
    "never let in": (serial, full_backlog, 0),
    "nobody there": (serial, nobody, 0),
    "binary: the same byte for ever": (binary, by(for_ever(b"\xaa" * 1000)), 0),
    "optoNCDT: bytes that never begin a value": (optoncdt, by(for_ever(b"\xff" * 1000)), 0),
    "RIFTEK: one byte and gone": (riftek, by(one_byte_and_gone), 0),
    "RIFTEK: not a word": (riftek, by(not_a_word), 0),
    "registers: the same for ever": (modbus, by(registers(lambda unit: unit)), POINTS),
    "registers: busy for ever": (modbus, by(registers(lambda unit: bytes([unit[0] | 0x80, 6]))), POINTS),
    "registers: a gateway without its device": (modbus, by(registers(lambda unit: bytes([unit[0] | 0x80, 11]))), POINTS),
    "registers: another function": (modbus, by(registers(lambda unit: bytes([4]) + unit[1:])), POINTS),
    "registers: another length": (modbus, by(registers(lambda unit: bytes([unit[0], 2, 0, 1]))), POINTS),
    "registers: no answer": (modbus, by(not_a_word), 0),
    "registers: one byte and gone": (modbus, by(one_byte_and_gone), 0),
    "registers: gone at once": (modbus, by(gone_at_once), 0),
    "registers: an answer that trickles in": (modbus, by(trickle), 0),
    "registers: junk as fast as it is taken": (modbus, by(for_ever(b"\xff" * 4000)), 0),
    "registers: answers to other requests": (modbus, by(other_transactions), 0),
    "registers: never let in": (modbus, full_backlog, 0),
    "registers: nobody there": (modbus, nobody, 0),
    "registers: patience longer than the silence": (patient, by(trickle), 0),
}


@dataclass
class Heard:
    """What came of one scan: its arrivals, how it ended, and how long after the last point (or the beginning) it did."""

    arrivals: list[Arrival] = field(default_factory=list)
    failure: DeviceError | None = None
    after_s: float = math.inf


def listen(name: str) -> Heard:
    """Carry out one scan to its end; stop where it would go on for ever."""
    make, serve, _ = CASES[name]
    heard = Heard()
    with serve() as address:
        last_s = time.monotonic()
        try:
            for arrival in make(address).arrivals():
                heard.arrivals.append(arrival)
                if isinstance(arrival, PointBatch):
                    last_s = time.monotonic()
                if time.monotonic() - last_s > PATIENCE_S:
                    return heard
        except DeviceError as error:
            heard.failure = error
        heard.after_s = time.monotonic() - last_s
    return heard


@pytest.fixture(scope="module")
def endings() -> dict[str, Heard]:
    """All scans, side by side: they wait for most of their time."""
    with ThreadPoolExecutor(len(CASES)) as pool:
        return dict(zip(CASES, pool.map(listen, CASES), strict=True))


@pytest.mark.parametrize("name", CASES)
def test_a_scan_ends_when_no_more_points_come(endings: dict[str, Heard], name: str) -> None:
    heard = endings[name]
    assert isinstance(heard.failure, DeviceError)
    assert heard.after_s < PATIENCE_S
    assert sum(len(arrival) for arrival in heard.arrivals if isinstance(arrival, PointBatch)) == CASES[name][2]


@pytest.mark.parametrize("kind", ["serial", "modbus"])
def test_a_link_that_does_not_open_is_given_up_when_told_to_stop(kind: str) -> None:
    """Nothing but the stop ends it within the time that a test may take."""
    settings = LinkSettings(9600, "N", silence_s=FOR_EVER_S)
    with full_backlog() as address:
        source = (
            SerialScanner(address, AsciiDecoder(), settings)
            if kind == "serial"
            else ModbusScanner(address, RegisterDecoder(LATEST), settings, timeout_s=FOR_EVER_S)
        )
        threading.Timer(0.2, source.stop).start()
        assert list(source.arrivals()) == []
