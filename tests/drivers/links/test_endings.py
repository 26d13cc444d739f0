"""Every scan ends when no more points come, whatever else a device answers: over real sockets, against counter-parties of our own."""

import socket
import struct
import threading
import time
from binascii import crc_hqx
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

import pytest

from drivers.codecs.ascii_frames import AsciiDecoder
from drivers.codecs.register_decoder import RegisterDecoder
from drivers.codecs.register_map import RegisterMap
from drivers.errors import DeviceError
from drivers.links.link_settings import LinkSettings
from drivers.links.modbus_scanner import ModbusScanner
from drivers.links.serial_scanner import SerialScanner
from drivers.source import Arrival, PointBatch, ScanSource

SILENCE_S, RECONNECT_S, GRACE_S = 1.0, 1.0, 2.0
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
        time.sleep(0.3)  # a link that opens throws away what it finds in its buffer
        while points:
            client.sendall(points.pop(0))
        while True:
            for text in texts:
                client.sendall(text)
                time.sleep(0.02)

    return serve


def one_byte_and_gone(client: socket.socket) -> None:
    client.sendall(b"S")


def not_a_word(client: socket.socket) -> None:
    while client.recv(1000):
        pass


def registers(then: Callable[[bytes], bytes]) -> Serve:
    """Points 1 to 20 of a device with one point in its registers; `then` answers every further request by the last value."""
    asked = 0

    def serve(client: socket.socket) -> None:
        nonlocal asked
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


def modbus(address: str) -> ScanSource:
    return ModbusScanner(address, RegisterDecoder(LATEST, count=300), SETTINGS, timeout_s=0.3)


CASES: dict[str, tuple[Callable[[str], ScanSource], Serve, int]] = {
    "the opening again and again": (serial, say_for_ever(OPENING), POINTS),
    "the last point again and again": (serial, say_for_ever(sealed(f"P,{POINTS - 1},19,1,2,3,0")), POINTS),
    "junk between openings": (serial, say_for_ever(OPENING, b"junk\r\n"), POINTS),
    "one byte and gone": (serial, one_byte_and_gone, 0),
    "not a word": (serial, not_a_word, 0),
    "the same registers for ever": (modbus, registers(lambda unit: unit), POINTS),
    "busy for ever": (modbus, registers(lambda unit: bytes([unit[0] | 0x80, 6])), POINTS),
    "a gateway without its device": (modbus, registers(lambda unit: bytes([unit[0] | 0x80, 11])), POINTS),
    "another function": (modbus, registers(lambda unit: bytes([4]) + unit[1:]), POINTS),
    "another length": (modbus, registers(lambda unit: bytes([unit[0], 2, 0, 1])), POINTS),
    "no answer": (modbus, not_a_word, 0),
}


def listen(source: ScanSource, arrivals: list[Arrival], heard_s: list[float]) -> None:
    """Note what arrives, and when the points did; stop where it takes too long."""
    for arrival in source.arrivals():
        arrivals.append(arrival)
        if isinstance(arrival, PointBatch):
            heard_s.append(time.monotonic())
        if time.monotonic() - heard_s[-1] > SILENCE_S + RECONNECT_S + GRACE_S:
            return


@pytest.mark.parametrize("name", CASES)
def test_a_scan_ends_when_no_more_points_come(name: str) -> None:
    make, serve, points = CASES[name]
    with served(serve) as address:
        arrivals: list[Arrival] = []
        heard_s = [time.monotonic()]
        with pytest.raises(DeviceError):
            listen(make(address), arrivals, heard_s)
        assert time.monotonic() - heard_s[-1] < SILENCE_S + RECONNECT_S + GRACE_S
    assert sum(len(arrival) for arrival in arrivals if isinstance(arrival, PointBatch)) == points
