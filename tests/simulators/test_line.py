"""Lines as a client sees them: over loopback, and as a pseudo-terminal where there are any."""

import os
import socket
import sys
import time
from collections.abc import Iterator

import pytest

from simulators.line import Line, open_line


class Client:
    """What connects to a line, by socket or by opening a terminal."""

    def __init__(self, address: str) -> None:
        host, _, port = address.rpartition(":")
        self._socket = socket.create_connection((host, int(port)), timeout=5.0) if host else None
        self._terminal = None if self._socket else os.open(address, os.O_RDWR | os.O_NOCTTY)

    def send(self, data: bytes) -> None:
        if self._socket is not None:
            self._socket.sendall(data)
        elif self._terminal is not None:
            os.write(self._terminal, data)

    def receive(self) -> bytes:
        if self._socket is not None:
            return self._socket.recv(100)
        assert self._terminal is not None
        return os.read(self._terminal, 100)

    def close(self) -> None:
        if self._socket is not None:
            self._socket.close()
        elif self._terminal is not None:
            os.close(self._terminal)


@pytest.fixture(params=["127.0.0.1:0", pytest.param("pty", marks=pytest.mark.skipif(sys.platform == "win32", reason="POSIX only"))])
def line(request: pytest.FixtureRequest) -> Iterator[Line]:
    opened = open_line(request.param)
    yield opened
    opened.close()


def until(line: Line, connected: bool) -> None:
    """Look, as the engine does between two points, until the line has noticed."""
    end_s = time.monotonic() + 10.0
    while line.is_connected() != connected and time.monotonic() < end_s:
        line.receive(0.01)
    assert line.is_connected() == connected


def test_bytes_go_both_ways(line: Line) -> None:
    client = Client(line.address)
    until(line, connected=True)
    client.send(b"G\r\n")
    assert line.receive(5.0) == b"G\r\n"
    assert line.send(b"P,0")
    assert client.receive() == b"P,0"
    client.close()
    until(line, connected=False)


def test_what_is_sent_without_a_client_is_gone(line: Line) -> None:
    assert not line.send(b"lost")
    client = Client(line.address)
    until(line, connected=True)
    assert line.send(b"here")
    assert client.receive() == b"here"
    client.close()


def test_an_unplugged_line_is_gone_and_comes_back_under_its_address(line: Line) -> None:
    address = line.address
    line.unplug()
    with pytest.raises(OSError, match=r"refused|No such file"):
        Client(address)
    line.plug()
    client = Client(address)
    until(line, connected=True)
    client.close()


def test_an_address_that_is_none_is_refused() -> None:
    for address in ("", "host", "host:port", ":5", "spy://x?file=y:5", "host:\u0665", "host:65536", "host:-1"):
        with pytest.raises(ValueError, match="expected pty or host:port"):
            open_line(address)
