"""Scanners played by threads of this process, on a socket or a port; they share no line with the simulators of the project.

Over a new link each goes on behind what it has sent. Their threads bear the name of those whose calls never fail.
"""

import os
import socket
import struct
import threading
import time
from abc import ABC, abstractmethod
from binascii import crc_hqx
from contextlib import closing, suppress
from selectors import EVENT_READ, DefaultSelector

from tests.cmmlink.oval_part import oval_points
from tests.drivers.codecs.register_tables import Ring
from tests.drivers.codecs.wire_bytes import ascii_line
from tests.integration.failing_calls import NOT_OURS

POLL_S = 0.02


def lines_of(deviation_mm: float) -> list[bytes]:
    """The oval's points as lines of the ASCII format."""
    points = oval_points(deviation_mm)
    told = [ascii_line(f"P,{i},{1000 * i},{x:.9f},{y:.9f},0,0") for i, (x, y) in enumerate(points.tolist())]
    return [ascii_line(f"S,oval scanner,1,mm,{len(points)}"), *told, ascii_line(f"E,{len(points)}")]


class CounterParty(ABC):
    """A device that is there while its context is entered."""

    address: str

    def __init__(self) -> None:
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._serve, name=NOT_OURS, daemon=True)
        self._thread.start()

    def __enter__(self) -> "CounterParty":
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        self._thread.join(10.0)

    @abstractmethod
    def _serve(self) -> None:
        """Answer until it is over."""


class _OnSocket(CounterParty):
    def __init__(self) -> None:
        self._listener = socket.create_server(("127.0.0.1", 0))
        self._listener.settimeout(POLL_S)
        self.address = f"127.0.0.1:{self._listener.getsockname()[1]}"
        super().__init__()

    def _serve(self) -> None:
        with self._listener:
            while not self._over.is_set():
                try:
                    link, _ = self._listener.accept()
                except TimeoutError:
                    continue
                with link, suppress(OSError):
                    link.settimeout(2.0)
                    self._talk(link)

    @abstractmethod
    def _talk(self, link: socket.socket) -> None:
        """Answer over one link until it breaks."""


class LineScanner(_OnSocket):
    """Lines of the ASCII format over TCP, so many pieces a scan."""

    def __init__(self, lines: list[bytes], pieces: int = 6) -> None:
        self._opening, self._points, self._closing = lines[0], lines[1:-1], lines[-1]
        self._step, self._sent = -(-len(self._points) // pieces), 0
        super().__init__()

    def _talk(self, link: socket.socket) -> None:
        if not link.recv(16):
            return
        link.sendall(self._opening)
        while self._sent < len(self._points):
            link.sendall(b"".join(self._points[self._sent : self._sent + self._step]))
            self._sent += self._step
            time.sleep(0.003)
        link.sendall(self._closing)
        link.recv(16)  # until the host has closed


class PortScanner(CounterParty):
    """The same lines over a pseudo-terminal, where the system has one."""

    def __init__(self, lines: list[bytes], pieces: int = 6) -> None:
        self._opening, self._points, self._closing = lines[0], lines[1:-1], lines[-1]
        self._step = -(-len(self._points) // pieces)
        self._ours, self._theirs = os.openpty()  # the host's end stays open here too, so that ours lives on while the host is away
        self._selector = DefaultSelector()
        self.address = os.ttyname(self._theirs)
        super().__init__()

    def _serve(self) -> None:
        sent = 0
        host, ours = (os.fdopen(descriptor, "r+b", buffering=0) for descriptor in (self._theirs, self._ours))
        with closing(host), closing(ours) as line, self._selector as selector:
            selector.register(line, EVENT_READ)
            while not self._over.is_set():
                if not selector.select(POLL_S) or b"G" not in line.read(16):
                    continue
                line.write(self._opening)
                while sent < len(self._points) and not selector.select(0.003):
                    line.write(b"".join(self._points[sent : sent + self._step]))
                    sent += self._step
                if sent >= len(self._points):
                    line.write(self._closing)


class RingScanner(_OnSocket):
    """The generic ring over Modbus TCP: it writes so many points before each answer, and says at last that it has finished."""

    def __init__(self, count: int = 360, step: int = 60) -> None:
        self._ring, self._count, self._step = Ring(), count, step
        self._points = oval_points(0.01)
        super().__init__()

    def _talk(self, link: socket.socket) -> None:
        while head := link.recv(8, socket.MSG_WAITALL):
            number, _, size, unit, _ = struct.unpack(">HHHBB", head)
            request = head[7:] + link.recv(size - 2, socket.MSG_WAITALL)
            self._write()
            answer = self._ring.answer(request)[len(request) :]
            link.sendall(struct.pack(">HHHB", number, 0, 1 + len(answer), unit) + answer)

    def _write(self) -> None:
        ring = self._ring
        for _ in range(min(self._step, self._count - ring.written)):
            number = ring.written
            ring.write(1)
            at = 100 + number % 500 * 11
            for axis, value in enumerate([*self._points[number].tolist(), 0.0]):
                ring.put(at + 3 + 2 * axis, "i", round(value * 1e5))
            ring.seal(at)
        ring.status(state=2 if ring.written == self._count else 1)
        ring.put(7, "I", self._count)
        ring.registers[11] = crc_hqx(ring.registers[:11].astype(">u2").tobytes(), 0xFFFF)
