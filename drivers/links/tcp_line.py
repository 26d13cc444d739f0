"""A TCP connection that opens within a stated time, may be given up at any moment, and stands for a serial line.

Operating systems wait a minute or more for a host that never answers, and libraries have limits of their own: neither knows how
long a scan may be silent.
"""

import errno
import os
import queue
import selectors
import socket
import threading
import time
from collections.abc import Sequence

from drivers.errors import LinkError
from drivers.links.address import HostPort

POLL_S = 0.05  # how long a read waits before it looks whether to stop
WRITE_S = 1.0
LARGEST_READ = 1 << 16
Address = tuple[socket.AddressFamily, socket.SocketKind, int, str, tuple[str, int] | tuple[str, int, int, int] | tuple[int, bytes]]
UNDER_WAY = (0, errno.EINPROGRESS, errno.EWOULDBLOCK, errno.EAGAIN)


def open_tcp(place: HostPort, within_s: float, stopped: threading.Event) -> socket.socket:
    """Connect to the first address of a host that answers, each of them with its share of the time.

    Raises OSError where none answers, or none is found, and LinkError when told to stop.
    """
    end_s = time.monotonic() + within_s
    found = _addresses_of(place, within_s, stopped)
    failure: OSError = TimeoutError(f"no answer within {within_s:.2g} s")
    for left, (family, kind, protocol, _, address) in zip(range(len(found), 0, -1), found, strict=True):
        connection = socket.socket(family, kind, protocol)
        try:
            _connect(connection, address, (end_s - time.monotonic()) / left, stopped)
        except (OSError, LinkError) as error:
            connection.close()
            if not isinstance(error, OSError):
                raise
            failure = error if not isinstance(error, TimeoutError) else failure
            continue
        return connection
    raise failure


def _addresses_of(place: HostPort, within_s: float, stopped: threading.Event) -> Sequence[Address]:
    """Look a host up, in a thread of its own: the system may wait much longer for a server of names than a scan may be silent."""
    host = place.host.strip("[]")
    try:
        return socket.getaddrinfo(host, place.port, type=socket.SOCK_STREAM, flags=socket.AI_NUMERICHOST)
    except socket.gaierror as error:
        if error.errno != socket.EAI_NONAME:
            raise
    answers: queue.SimpleQueue[Sequence[Address] | OSError] = queue.SimpleQueue()

    def look_up() -> None:
        try:
            answers.put(socket.getaddrinfo(host, place.port, type=socket.SOCK_STREAM))
        except OSError as error:
            answers.put(error)
        except UnicodeError as error:
            answers.put(OSError(str(error)))

    try:
        threading.Thread(target=look_up, name="look-up", daemon=True).start()
    except RuntimeError as error:
        raise OSError(f"{error}; close other programs") from error
    end_s = time.monotonic() + within_s
    while True:
        try:
            found = answers.get(timeout=POLL_S)
        except queue.Empty:
            if stopped.is_set():
                raise LinkError("told to stop before the host was found") from None
            if time.monotonic() >= end_s:
                raise TimeoutError(f"the network did not say within {within_s:.2g} s which address {host} has") from None
            continue
        if isinstance(found, OSError):
            raise found
        return found


def _connect(connection: socket.socket, address: tuple[object, ...], within_s: float, stopped: threading.Event) -> None:
    """Connect without blocking for longer than a look at whether to stop takes."""
    connection.setblocking(False)
    end_s = time.monotonic() + within_s
    code = connection.connect_ex(address)
    if code not in UNDER_WAY:
        raise OSError(code, os.strerror(code))
    with selectors.DefaultSelector() as selector:
        selector.register(connection, selectors.EVENT_WRITE)
        while not selector.select(POLL_S):
            if stopped.is_set():
                raise LinkError("told to stop before the connection was there")
            if time.monotonic() >= end_s:
                raise TimeoutError
    code = connection.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR)
    if code:
        raise OSError(code, os.strerror(code))


class TcpLine:
    """A connection that is read and written like a serial port."""

    def __init__(self, connection: socket.socket) -> None:
        self._connection = connection
        self._waits_s: float | None = None  # set where it changes alone: each time another thread may take the interpreter

    def read(self) -> bytes:
        """Return what is there, at the latest after POLL_S. Raises OSError where the connection is at its end."""
        self._wait_at_most(POLL_S)
        try:
            data = self._connection.recv(LARGEST_READ)
        except TimeoutError:
            return b""
        if not data:
            raise ConnectionResetError("the other end closed the connection")
        return data

    def write(self, data: bytes) -> None:
        """Send all of the data. Raises OSError where it is not taken within WRITE_S."""
        self._wait_at_most(WRITE_S)
        self._connection.sendall(data)

    def close(self) -> None:
        """Close the connection."""
        self._connection.close()

    def _wait_at_most(self, seconds: float) -> None:
        if seconds != self._waits_s:
            self._waits_s = seconds
            self._connection.settimeout(seconds)
