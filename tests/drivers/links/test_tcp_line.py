"""A connection opens within its time whatever the network's names do, and says why it did not."""

import socket
import threading
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from drivers.codecs import decoder
from drivers.codecs.register_decoder import RegisterDecoder
from drivers.errors import LinkError
from drivers.links.address import HostPort
from drivers.links.link_settings import LinkSettings
from drivers.links.modbus_scanner import ModbusScanner
from drivers.links.serial_scanner import SerialScanner
from drivers.links.tcp_line import open_tcp
from drivers.maps import shipped_map

NAMED = HostPort("scanner.example", 4000)


def answer_names(monkeypatch: pytest.MonkeyPatch, answer: Callable[[], list[Any]]) -> None:
    """Let the network's names be answered so; addresses of numbers are none of its business."""

    def look_up(host: str, port: int, flags: int = 0, **_: object) -> list[Any]:
        if flags & socket.AI_NUMERICHOST:
            raise socket.gaierror(socket.EAI_NONAME, "Name or service not known")
        return answer()

    monkeypatch.setattr(socket, "getaddrinfo", look_up)


@pytest.fixture
def silent_names(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """A network that does not answer what a name means until the test is over."""
    over = threading.Event()

    def wait() -> list[Any]:
        over.wait(60.0)
        return []

    answer_names(monkeypatch, wait)
    yield
    over.set()


@pytest.mark.usefixtures("silent_names")
def test_a_name_that_nobody_answers_costs_no_longer_than_a_connection_may() -> None:
    with pytest.raises(TimeoutError, match=r"did not say within 0\.1 s which address scanner\.example has"):
        open_tcp(NAMED, 0.1, threading.Event())


@pytest.mark.usefixtures("silent_names")
def test_a_name_that_nobody_answers_does_not_keep_a_run_from_its_stop() -> None:
    stopped = threading.Event()
    stopped.set()
    with pytest.raises(LinkError, match="told to stop"):
        open_tcp(NAMED, 60.0, stopped)


def test_a_name_that_is_answered_opens_the_connection(monkeypatch: pytest.MonkeyPatch) -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        found = [(socket.AF_INET, socket.SOCK_STREAM, 6, "", server.getsockname())]
        answer_names(monkeypatch, lambda: found)
        with open_tcp(NAMED, 5.0, threading.Event()) as connection:
            assert connection.getpeername() == server.getsockname()


@pytest.mark.parametrize("kind", ["serial", "modbus"])
@pytest.mark.parametrize(
    "failure",
    [
        socket.gaierror(socket.EAI_AGAIN, "Temporary failure in name resolution"),
        OSError(24, "Too many open files"),
        UnicodeError("label too long"),
    ],
)
def test_a_link_that_does_not_open_says_why(monkeypatch: pytest.MonkeyPatch, kind: str, failure: Exception) -> None:
    def fail() -> list[Any]:
        raise failure

    answer_names(monkeypatch, fail)
    settings, address = LinkSettings(19_200, "N", silence_s=0.5), f"{NAMED.host}:{NAMED.port}"
    source = (
        SerialScanner(address, decoder("ascii"), settings)
        if kind == "serial"
        else ModbusScanner(address, RegisterDecoder(shipped_map("generic-ring")), settings)
    )
    with pytest.raises(LinkError, match=str(failure.args[-1])):
        list(source.arrivals())
