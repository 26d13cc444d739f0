"""A machine that connects to this computer is awaited, and no other beside it."""

import socket
from itertools import count
from threading import Event, Thread

import pytest

from drivers.links.listener import Listener


def free_address() -> str:
    with socket.create_server(("127.0.0.1", 0)) as free:
        return f"127.0.0.1:{free.getsockname()[1]}"


def connected(address: str) -> socket.socket:
    """Connect as soon as somebody listens."""
    host, _, port = address.rpartition(":")
    while True:
        try:
            return socket.create_connection((host, int(port)), timeout=5.0)
        except OSError:
            continue


def test_the_machine_is_heard_and_others_are_refused_meanwhile() -> None:
    address, machines = free_address(), list[socket.socket]()
    calling = Thread(target=lambda: machines.append(connected(address)), daemon=True)
    calling.start()
    line = Listener(address).open(10.0, Event())
    calling.join(10.0)
    host, _, port = address.rpartition(":")
    with machines[0] as machine:
        machine.sendall(b"START\r\n")
        assert line.read() == b"START\r\n"
        with pytest.raises(ConnectionRefusedError):
            socket.create_connection((host, int(port)), timeout=5.0)
    line.close()


def test_a_machine_that_does_not_come_is_waited_for_no_longer_than_told() -> None:
    with pytest.raises(TimeoutError, match="no machine connected within 3 s"):
        Listener(free_address(), clock=count().__next__).open(3.0, Event())


def test_waiting_ends_when_the_scan_is_stopped() -> None:
    stopped = Event()
    stopped.set()
    with pytest.raises(InterruptedError, match="stopped"):
        Listener(free_address()).open(60.0, stopped)


@pytest.mark.parametrize("address", ["COM3", "127.0.0.1", "127.0.0.1:0"])
def test_an_address_that_is_none_of_a_computer_is_refused(address: str) -> None:
    with pytest.raises(ValueError, match="port"):
        Listener(address)
