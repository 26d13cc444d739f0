"""How many connections the station holds, for how long, and how much it keeps for each, so that a measurement never lacks anything.

Whoever has not shown the token yet is a stranger. Strangers are few: when one more comes the oldest goes, and is gone before another is
taken. A request's head must arrive within seconds, and a stranger is gone soon whatever it does. Files that a run opens have descriptors
of their own left over.
Every answer carries the security headers, also those that the libraries below give by themselves.
"""

import asyncio
import contextlib
import logging
import socket
import sys
from collections.abc import Iterable
from functools import partial
from typing import Any

import h11
import uvicorn
from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from websockets.frames import Frame
from websockets.http11 import Response
from websockets.server import ServerProtocol

from cmmlink.console.guard import HEADERS
from cmmlink.console.listening import Encryption

LARGEST_COMMAND = 16 * 1024
LARGEST_HEAD = 16 * 1024
_RESERVED_FILES = 128  # descriptors for the measurement, its record and its results, and for the pages that are open
_MOST_STRANGERS, _FEWEST_STRANGERS = 64, 8
_HEAD_WITHIN_S = 5.0
_STRANGER_S = 20.0  # as long as a page may take to load and to show the token
_CLOSED_WITHIN_S = 2.0  # after the station has said that it closes a page's socket
_OUT_OF_FILES_S = 0.1
_MOST_FRAMES = 64  # that one message may come in
_MOST_UNSENT = 16 << 20  # bytes that wait for a page; the longest message, of a whole surface, has about 8 MB


def strangers_allowed() -> int:
    """How many strangers there is room for beside a measurement, by the number of files that this process may open."""
    if sys.platform == "win32":
        return _MOST_STRANGERS
    import resource  # noqa: PLC0415 - POSIX only

    limit, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    if limit == resource.RLIM_INFINITY:
        return _MOST_STRANGERS
    return min(max(limit - _RESERVED_FILES, _FEWEST_STRANGERS), _MOST_STRANGERS)


class Strangers:
    """Those who have not shown the token, the oldest first; there is a place for each until its socket is closed or it is admitted."""

    def __init__(self, most: int) -> None:
        self._staying: dict[Visitor, None] = {}
        self._places = asyncio.Semaphore(most)

    def __len__(self) -> int:
        return len(self._staying)

    async def find_place(self) -> None:
        """Take a place; where none is free the oldest stranger goes, and its socket is waited for."""
        if self._places.locked():
            self.turn_out_oldest()
        await self._places.acquire()

    def enter(self, visitor: "Visitor") -> None:
        """Note who takes the place that was found."""
        self._staying[visitor] = None

    def turn_out_oldest(self) -> None:
        """End the connection of whoever has been a stranger for longest."""
        oldest = next(iter(self._staying), None)
        if oldest is not None:
            oldest.abort()

    def turn_out_all(self) -> None:
        """End the connection of every stranger."""
        while self._staying:
            self.turn_out_oldest()

    def forget(self, visitor: "Visitor") -> None:
        """Somebody was told to go, or was admitted."""
        self._staying.pop(visitor, None)

    def free_place(self) -> None:
        """A stranger's socket is closed, or it was admitted."""
        self._places.release()


class Visitor:
    """One connection from its beginning to its end."""

    def __init__(self, connected: socket.socket, strangers: Strangers, loop: asyncio.AbstractEventLoop) -> None:
        self._socket, self._strangers, self._loop = connected, strangers, loop
        self._transport: asyncio.Transport | None = None
        self._end: asyncio.TimerHandle | None = None
        self._has_place = True
        strangers.enter(self)
        self.end_within(_STRANGER_S)

    def connect(self, transport: asyncio.Transport) -> None:
        """Note the transport that it talks through from now on."""
        self._transport = transport

    def admit(self, longest_s: float | None = None) -> None:
        """It has shown the token: it is no stranger any more, and stays at most `longest_s`."""
        self.leave()
        if longest_s is not None:
            self.end_within(longest_s)

    def end_within(self, seconds: float) -> None:
        """End the connection then, unless it has ended by itself."""
        self._stop_waiting()
        self._end = self._loop.call_later(seconds, self.abort)

    def abort(self) -> None:
        """End the connection at once, whatever was still to be sent."""
        self._strangers.forget(self)
        self._stop_waiting()
        if self._transport is not None:
            self._transport.abort()
        else:  # it is still agreeing on its encryption
            with contextlib.suppress(OSError):
                self._socket.shutdown(socket.SHUT_RDWR)

    def leave(self) -> None:
        """Its socket is closed, or it is admitted: it is no stranger any more."""
        self._strangers.forget(self)
        self._stop_waiting()
        if self._has_place:
            self._has_place = False
            self._strangers.free_place()

    def _stop_waiting(self) -> None:
        if self._end is not None:
            self._end.cancel()
            self._end = None


class BoundedServer(uvicorn.Server):
    """A server that takes its connections itself: it counts them from the first moment, before they have said a word."""

    def __init__(self, config: uvicorn.Config, listening: socket.socket, encryption: Encryption | None) -> None:
        super().__init__(config)
        self._listening, self._encryption = listening, encryption
        self._strangers = Strangers(strangers_allowed())
        self._tasks: set[asyncio.Task[None]] = set()

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Begin to take connections."""
        self.servers = []
        self._begin(self._take_connections())
        self.started = True

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Take no more connections, and end those that there are."""
        for task in tuple(self._tasks):
            task.cancel()
        self._strangers.turn_out_all()
        await super().shutdown(sockets)

    def _begin(self, work: Any) -> "asyncio.Task[None]":
        task = asyncio.get_running_loop().create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        return task

    async def _take_connections(self) -> None:
        loop = asyncio.get_running_loop()
        while True:
            try:
                connected, _ = await loop.sock_accept(self._listening)
            except OSError:  # no descriptor is left, or the connection is gone already
                self._strangers.turn_out_oldest()
                await asyncio.sleep(_OUT_OF_FILES_S)
                continue
            try:
                await self._strangers.find_place()
            except asyncio.CancelledError:
                connected.close()
                raise
            visitor = Visitor(connected, self._strangers, loop)
            self._begin(self._welcome(connected, visitor)).add_done_callback(partial(_close_unwelcomed, connected, visitor))

    async def _welcome(self, connected: socket.socket, visitor: Visitor) -> None:
        loop = asyncio.get_running_loop()
        context = self._encryption.context if self._encryption else None
        try:
            connected.setblocking(False)
            await loop.connect_accepted_socket(
                lambda: _RequestProtocol(visitor, self.config, self.server_state),
                connected,
                ssl=context,
                ssl_handshake_timeout=_HEAD_WITHIN_S if context else None,
            )
        except OSError:
            visitor.leave()
            connected.close()


def _close_unwelcomed(connected: socket.socket, visitor: Visitor, welcome: "asyncio.Task[None]") -> None:
    """Close a connection whose welcome was broken off, be it before it began: nobody else would."""
    if welcome.cancelled():
        visitor.leave()
        connected.close()


class _RequestProtocol(H11Protocol):
    """Reads requests; the head of each has to be there within seconds."""

    def __init__(self, visitor: Visitor, config: uvicorn.Config, server_state: Any) -> None:
        super().__init__(config, server_state, {"visitor": visitor})
        self.conn = _AnsweringRequests(h11.SERVER, LARGEST_HEAD)
        self._visitor = visitor
        self._head: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.Transport)
        super().connection_made(transport)
        self._visitor.connect(transport)
        self._watch_head()

    def connection_lost(self, exc: Exception | None) -> None:
        self._visitor.leave()
        self._stop_watching()
        super().connection_lost(exc)

    def handle_events(self) -> None:
        super().handle_events()
        self._watch_head()

    def _watch_head(self) -> None:
        """Give a head that is on its way its time, and not a moment more when another byte of it has come."""
        if self.conn.their_state is not h11.IDLE or self.transport.is_closing():
            self._stop_watching()
        elif self._head is None:
            self._head = self.loop.call_later(_HEAD_WITHIN_S, self._visitor.abort)

    def _stop_watching(self) -> None:
        if self._head is not None:
            self._head.cancel()
            self._head = None


class PageProtocol(WebSocketsSansIOProtocol):
    """The socket of a page, which can neither fill the memory with what it sends nor by not reading."""

    def __init__(self, config: uvicorn.Config, server_state: Any, app_state: dict[str, Any]) -> None:
        super().__init__(config, server_state, app_state)
        self.conn = _AnsweringPages(max_size=LARGEST_COMMAND, logger=logging.getLogger("uvicorn.error"))
        self._visitor: Visitor = app_state["visitor"]

    def connection_lost(self, exc: Exception | None) -> None:
        """The other side, or the station, has ended it."""
        self._visitor.leave()
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Take what has come, unless too much waits for the page already: pings are answered at once, read or not."""
        super().data_received(data)
        if self.transport.get_write_buffer_size() > _MOST_UNSENT:
            self._visitor.abort()

    async def send(self, message: Any) -> None:
        """Send a message; what is still open a while after the last one is ended."""
        await super().send(message)
        if message["type"] == "websocket.close":
            self._visitor.end_within(_CLOSED_WITHIN_S)

    def keepalive_timeout(self) -> None:
        """End a connection whose other side is silent, also where something was still to be sent."""
        super().keepalive_timeout()
        self._visitor.abort()

    def handle_cont(self, event: Frame) -> None:
        """Take one more piece of a message, up to a number: pieces without content are not counted by their size."""
        super().handle_cont(event)
        if len(self.frames) > _MOST_FRAMES:
            self._visitor.abort()


class _AnsweringRequests(h11.Connection):
    """What is said over a connection with requests; every answer gets the security headers."""

    def send_with_data_passthrough(self, event: h11.Event) -> list[bytes] | None:
        if isinstance(event, h11.Response):
            named = {name.decode("latin-1") for name, _ in event.headers}
            more = [(name.encode(), value.encode()) for name, value in _missing(named)]
            event = h11.Response(
                status_code=event.status_code, headers=[*event.headers, *more], http_version=event.http_version, reason=event.reason
            )
        return super().send_with_data_passthrough(event)


class _AnsweringPages(ServerProtocol):
    """What is said over the socket of a page; the answer to its first request gets the security headers."""

    def send_response(self, response: Response) -> None:
        for name, value in _missing(name.lower() for name in response.headers):
            response.headers[name] = value
        super().send_response(response)


def _missing(named: Iterable[str]) -> list[tuple[str, str]]:
    there = set(named)
    return [(name, value) for name, value in HEADERS.items() if name not in there]
