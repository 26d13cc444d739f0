"""What pymodbus raises and returns, and what becomes of it; and the wire as a server of our own sees it."""

import socket
import struct
import threading
from collections.abc import Iterator

import pytest
from pymodbus.client import ModbusTcpClient
from pymodbus.exceptions import ConnectionException, ModbusIOException
from pymodbus.pdu import ExceptionResponse, ModbusPDU
from pymodbus.pdu.register_message import ReadInputRegistersResponse

from drivers.codecs.register_decoder import RegisterDecoder
from drivers.errors import DeviceRefused, LinkError
from drivers.links import modbus_scanner
from drivers.links.modbus_scanner import FifoAnswer, ModbusScanner
from drivers.maps import shipped_map
from drivers.source import PointBatch, ScanClosed
from tests.drivers.codecs.streams import account

RIFTEK = shipped_map("riftek-rf60x")


def answers(monkeypatch: pytest.MonkeyPatch, replies: list[ModbusPDU | Exception]) -> Iterator[object]:
    """Run a source whose library gives these replies, the last one again and again."""

    def read(*_: object, **__: object) -> ModbusPDU:
        reply = replies.pop(0) if len(replies) > 1 else replies[0]
        if isinstance(reply, Exception):
            raise reply
        return reply

    monkeypatch.setattr(modbus_scanner._TcpClient, "connect", lambda _: True)
    monkeypatch.setattr(ModbusTcpClient, "read_input_registers", read)
    return ModbusScanner("127.0.0.1:1", RegisterDecoder(RIFTEK, count=3), poll_s=0.0, timeout_s=0.0).arrivals()


def value(number: int) -> ModbusPDU:
    return ReadInputRegistersResponse(registers=[number])


@pytest.mark.parametrize("failure", [ConnectionException("gone"), ConnectionResetError(104, "reset by peer"), BrokenPipeError()])
def test_a_lost_connection_is_a_lost_link(monkeypatch: pytest.MonkeyPatch, failure: Exception) -> None:
    with pytest.raises(LinkError, match=r"127\.0\.0\.1:1: the link was lost"):
        list(answers(monkeypatch, [value(1), failure]))


def test_one_missing_answer_is_asked_for_again_three_are_a_lost_link(monkeypatch: pytest.MonkeyPatch) -> None:
    missing = ModbusIOException("no response")
    arrivals = list(answers(monkeypatch, [value(1), missing, missing, value(2), value(3)]))
    assert account(arrivals).sequence == [0, 1, 2]  # type: ignore[arg-type]
    with pytest.raises(LinkError, match="3 times in a row"):
        list(answers(monkeypatch, [value(1), missing]))


def test_a_busy_device_is_asked_again_and_a_refusal_is_passed_on(monkeypatch: pytest.MonkeyPatch) -> None:
    busy = ExceptionResponse(4, 6)
    arrivals = list(answers(monkeypatch, [busy, value(1), busy, busy, value(2), value(3)]))
    assert isinstance(arrivals[-1], ScanClosed)
    with pytest.raises(DeviceRefused, match="exception 2"):
        list(answers(monkeypatch, [ExceptionResponse(4, 2)]))


@pytest.mark.parametrize("code", [4, 5, 6, 10, 11])
def test_an_exception_that_passes_costs_no_point(monkeypatch: pytest.MonkeyPatch, code: int) -> None:
    passing = ExceptionResponse(4, code)
    arrivals = list(answers(monkeypatch, [value(1), passing, passing, value(2), value(3)]))
    assert account(arrivals).sequence == [0, 1, 2]  # type: ignore[arg-type]
    with pytest.raises(LinkError, match=rf"answers exception {code} \(.*\) for 0\.[0-9] s, 3 times in a row"):
        list(answers(monkeypatch, [value(1), passing]))


def test_a_failure_before_any_point_is_final(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(DeviceRefused, match=r"exception 4 \(device failure\)"):
        list(answers(monkeypatch, [ExceptionResponse(4, 4)]))


def test_function_24_over_rtu_has_its_true_length() -> None:
    """Modbus Application Protocol V1.1b3, 6.18, its example: two values 01B8h and 1284h; address and checksum make it an RTU frame."""
    unit = bytes.fromhex("18 0006 0002 01B8 1284")
    assert FifoAnswer.calculateRtuFrameSize(b"\x01" + unit) == 1 + len(unit) + 2
    answer = FifoAnswer()
    answer.decode(unit[1:])
    assert answer.values == [0x01B8, 0x1284]


class OneByOne(threading.Thread):
    """A Modbus TCP server that notes whether a second request ever came before the first was answered."""

    def __init__(self) -> None:
        super().__init__(daemon=True)
        self.server = socket.create_server(("127.0.0.1", 0))
        self.address = f"127.0.0.1:{self.server.getsockname()[1]}"
        self.lengths: list[int] = []

    def run(self) -> None:
        client, _ = self.server.accept()
        with client, self.server:
            while request := client.recv(1000):
                self.lengths.append(len(request))
                client.sendall(request[:4] + struct.pack(">HBBBH", 5, request[6], request[7], 2, len(self.lengths)))


def test_one_request_is_in_flight() -> None:
    """The library's server answers only the first of several requests in one segment; others may do the same."""
    server = OneByOne()
    server.start()
    arrivals = list(ModbusScanner(server.address, RegisterDecoder(RIFTEK, count=50), poll_s=0.0).arrivals())
    server.join(timeout=10.0)
    assert server.lengths == [12] * 50
    assert sum(len(arrival) for arrival in arrivals if isinstance(arrival, PointBatch)) == 50
