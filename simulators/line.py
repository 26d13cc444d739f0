"""The line a simulated device is reached on: a pseudo-terminal (POSIX) or a TCP server (any system), one client at a time.

Controls of machine tools can do more: connect to whoever listens, or write into a file.
"""

import os
import select
import socket
import sys
import tempfile
import time
from pathlib import Path
from typing import Protocol

if sys.platform != "win32":
    import tty

POLL_S = 0.02


class Line(Protocol):
    """Bytes to and from the client, if there is one; what is sent without a client is gone, as on a real line."""

    address: str
    is_read_live: bool  # whether the client has to be there still when the last bytes are sent

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


def open_line_of_control(address: str) -> Line:
    """Open `pty`, `host:port`, `to:host:port` for whoever listens there, or `file:PATH`."""
    kind, _, rest = address.partition(":")
    if kind == "file" and rest:
        return FileLine(Path(rest))
    return CallingLine(*host_and_port(rest)) if kind == "to" else open_line(address)


def host_and_port(address: str) -> tuple[str, int]:
    """Take `host:port` apart. Raises ValueError where a host or a port is missing: none would serve every network."""
    host, _, port = address.rpartition(":")
    if not host or "/" in host or not (port.isascii() and port.isdigit()) or int(port) > 65535:
        raise ValueError(f"address {address!r}: expected pty or host:port")
    return host, int(port)


class TcpLine:
    """A TCP server with one client."""

    is_read_live = True

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

    is_read_live = True

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


class CallingLine(TcpLine):
    """A TCP client that calls until somebody answers. What was sent is on its way, so it may hang up when it has said all."""

    is_read_live = False

    def __init__(self, host: str, port: int) -> None:
        self._client = None
        self._host_port = (host, port)
        self._may_call = True
        self.address = f"{host}:{port}"

    def is_connected(self) -> bool:
        """Call if nobody has answered yet, and tell whether somebody did."""
        if self._client is None and self._may_call:
            try:
                self._client = socket.create_connection(self._host_port, timeout=POLL_S)
            except OSError:
                return False
            self._client.setblocking(False)
        return self._client is not None

    def unplug(self) -> None:
        """Hang up, and call no more."""
        self._drop()
        self._may_call = False

    def plug(self) -> None:
        """Call again."""
        self._may_call = True


class FileLine:
    """A file into which the control prints, line by line; it needs no client."""

    is_read_live = False

    def __init__(self, path: Path) -> None:
        self._file = path.open("ab", buffering=0)
        self._plugged = True
        self.address = str(path)

    def is_connected(self) -> bool:
        """Nobody has to be there."""
        return True

    def send(self, data: bytes) -> bool:
        """Write all, unless the disk is away."""
        if self._plugged:
            self._file.write(data)
        return self._plugged

    def receive(self, wait_s: float) -> bytes:
        """Nobody says anything."""
        time.sleep(wait_s)
        return b""

    def unplug(self) -> None:
        """Take the disk away."""
        self._plugged = False

    def plug(self) -> None:
        """Bring it back."""
        self._plugged = True

    def close(self) -> None:
        """Close the file."""
        self._file.close()
