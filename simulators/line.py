"""The line a simulated device is reached on: a pseudo-terminal (POSIX) or a TCP server (any system), one client at a time."""

import os
import select
import socket
import sys
import tempfile
import time
from typing import Protocol

if sys.platform != "win32":
    import tty

POLL_S = 0.02


class Line(Protocol):
    """Bytes to and from the client, if there is one; what is sent without a client is gone, as on a real line."""

    address: str

    def is_connected(self) -> bool:
        """Take a new client if one is waiting, and tell whether there is one."""

    def send(self, data: bytes) -> bool:
        """Send all, waiting while the client is slow; return False if the client is gone."""

    def receive(self, wait_s: float) -> bytes:
        """Return what the client sent, at the latest after `wait_s`."""

    def unplug(self) -> None:
        """Take the line away, for the client and for everybody who knocks."""

    def plug(self) -> None:
        """Bring the line back under the same address."""

    def close(self) -> None:
        """Give up the address."""


def open_line(address: str) -> Line:
    """Open `pty` or `host:port` (port 0: any free one)."""
    if address == "pty":
        return PtyLine()
    return TcpLine(*host_and_port(address))


def host_and_port(address: str) -> tuple[str, int]:
    """Take `host:port` apart. Raises ValueError where a host or a port is missing: none would serve every network."""
    host, _, port = address.rpartition(":")
    if not host or "/" in host or not (port.isascii() and port.isdigit()) or int(port) > 65535:
        raise ValueError(f"address {address!r}: expected pty or host:port")
    return host, int(port)


class TcpLine:
    """A TCP server with one client."""

    def __init__(self, host: str, port: int) -> None:
        self._server = socket.create_server((host, port), backlog=1)
        self._client: socket.socket | None = None
        self._host_port = (host, int(self._server.getsockname()[1]))
        self.address = f"{host}:{self._host_port[1]}"

    def is_connected(self) -> bool:
        """Take a new client if one is waiting, and tell whether there is one."""
        if self._client is None and self._server.fileno() >= 0 and select.select([self._server], [], [], 0)[0]:
            self._client = self._server.accept()[0]
            self._client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._client.setblocking(False)
        return self._client is not None

    def send(self, data: bytes) -> bool:
        """Send all, waiting while the client is slow; return False if the client is gone."""
        view = memoryview(data)
        while view and self._client is not None:
            if not select.select([], [self._client], [], POLL_S)[1]:
                continue
            try:
                view = view[self._client.send(view) :]
            except BlockingIOError:
                continue
            except OSError:
                self._drop()
        return self._client is not None

    def receive(self, wait_s: float) -> bytes:
        """Return what the client sent, at the latest after `wait_s`."""
        if self._client is None:
            time.sleep(wait_s)
            return b""
        if not select.select([self._client], [], [], wait_s)[0]:
            return b""
        try:
            data = self._client.recv(4096)
        except OSError:
            data = b""
        if not data:
            self._drop()
        return data

    def unplug(self) -> None:
        """Close everything; knocking clients are refused."""
        self._drop()
        self._server.close()

    def plug(self) -> None:
        """Listen again."""
        self._server = socket.create_server(self._host_port, backlog=1)

    def close(self) -> None:
        """Give up the address."""
        self.unplug()

    def _drop(self) -> None:
        if self._client is not None:
            self._client.close()
            self._client = None


class PtyLine:
    """A pseudo-terminal; the client opens its address like a serial port.

    The address is a link to the terminal of the moment, so that it can vanish and come back as a USB port does.
    """

    def __init__(self) -> None:
        if sys.platform == "win32":
            raise ValueError("pseudo-terminals exist on POSIX systems only; serve host:port instead")
        self._folder = tempfile.TemporaryDirectory(prefix="simulated-port-")
        self.address = os.path.join(self._folder.name, "port")
        self._master: int | None = None
        self.plug()

    def is_connected(self) -> bool:
        """Tell whether a client holds the other end."""
        if sys.platform == "win32" or self._master is None:
            return False
        poll = select.poll()
        poll.register(self._master, 0)
        return not any(event & select.POLLHUP for _, event in poll.poll(0))

    def send(self, data: bytes) -> bool:
        """Send all, waiting while the client is slow; return False if the client is gone."""
        view = memoryview(data)
        while view and self._master is not None and self.is_connected():
            if not select.select([], [self._master], [], POLL_S)[1]:
                continue
            try:
                view = view[os.write(self._master, view) :]
            except BlockingIOError:
                continue
        return self.is_connected()

    def receive(self, wait_s: float) -> bytes:
        """Return what the client sent, at the latest after `wait_s`."""
        if self._master is None or not self.is_connected():
            time.sleep(wait_s)
            return b""
        if not select.select([self._master], [], [], wait_s)[0]:
            return b""
        try:
            return os.read(self._master, 4096)
        except OSError:
            return b""

    def unplug(self) -> None:
        """Close the terminal; its name is gone."""
        if self._master is not None:
            os.unlink(self.address)
            os.close(self._master)
            self._master = None

    def plug(self) -> None:
        """Open a terminal under the same address."""
        if sys.platform == "win32":
            return
        self._master, slave = os.openpty()
        tty.setraw(slave)
        os.symlink(os.ttyname(slave), self.address)
        os.close(slave)  # so that the master shows whether a client holds the other end
        os.set_blocking(self._master, False)

    def close(self) -> None:
        """Give up the address."""
        self.unplug()
        self._folder.cleanup()
