"""The server of the page: its files, one socket a page, and which page is in control.

Safe by default: only the addresses it was told to serve, only pages it served itself, only browsers that know the token
(guard.py). Of the machine's files it reads none but its own page; plans and records come through the station.

Its event loop waits for nothing but its sockets: it reads snapshots that the station has published, and whatever takes time - a
command, packing what is drawn, looking for plans - is done by other threads.
"""

import asyncio
import json
import secrets
import socket
import sys
import tempfile
import threading
import time
from collections.abc import Awaitable, Iterator
from dataclasses import asdict, dataclass, field
from importlib import resources
from pathlib import Path
from typing import Any, NamedTuple

import anyio.to_thread
import uvicorn
from starlette.applications import Starlette
from starlette.background import BackgroundTask
from starlette.requests import Request
from starlette.responses import FileResponse, PlainTextResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.types import ASGIApp
from starlette.websockets import WebSocket, WebSocketDisconnect

from cmmlink.console.commands import Received, action_of, read_json, receive
from cmmlink.console.drawing import nominal_message, points_message
from cmmlink.console.guard import Guard, is_remote, knows_token
from cmmlink.console.protocol import (
    TOO_MANY_PAGES,
    WRONG_TOKEN,
    Alive,
    Answer,
    Control,
    Device,
    Hello,
    Message,
    OfRun,
    OpenSection,
    Plain,
    ShownRun,
    json_of,
)
from cmmlink.console.refused import Refused
from cmmlink.console.station import Station
from cmmlink.extremes import PointsVersion
from cmmlink.run_view import RunView

_PERIOD_S = 1 / 30  # at most so often a page is sent something
_ALIVE_S = 0.5
_LIST_PLANS_S = 1.0
_TOKEN_WITHIN_S = 5.0
_LARGEST_COMMAND = 16 * 1024
_MOST_PAGES = 16
_BROKEN_DOWN = 1011  # close code: the page connects again and is sent everything
_UNSEEN = PointsVersion(-1, 0)
_MEDIA = {
    "html": "text/html; charset=utf-8",
    "css": "text/css; charset=utf-8",
    "js": "text/javascript; charset=utf-8",
    "svg": "image/svg+xml",
}


@dataclass(eq=False)
class _Page:
    """One connected browser: what it was sent, and what it looks at. Belongs to the event loop.

    generation : of the points it was sent last; counted for each page, because runs number theirs alike
    """

    socket: WebSocket
    number: int
    opened: RunView | None = None
    nominal_of: RunView | None = None
    seen: PointsVersion = _UNSEEN
    generation: int = 0
    sent: dict[str, Message] = field(default_factory=dict)
    sending: asyncio.Lock = field(default_factory=asyncio.Lock)


class ConsoleServer:
    """Serves one station to browsers, in a thread of its own.

    host, port : where to listen; port 0 takes a free one
    token      : what a page must know; it stands in the address's fragment, which browsers do not send
    version    : of the software; a page of another version loads itself anew
    """

    def __init__(self, station: Station, version: str, host: str = "127.0.0.1", port: int = 0, token: str | None = None) -> None:
        self.station, self._version = station, version
        self.token = token or secrets.token_urlsafe(24)
        self.remote = is_remote(host)
        self._host, self._socket = host, _listen_at(host, port)
        self.port: int = self._socket.getsockname()[1]
        self._pages: list[_Page] = []
        self._controller: _Page | None = None
        self._seen = 0
        self._ever = threading.Event()
        self._stopped = threading.Event()
        config = uvicorn.Config(
            self._application(),
            log_config=None,
            log_level="critical",
            access_log=False,
            server_header=False,
            ws="websockets-sansio",
            ws_max_size=_LARGEST_COMMAND,
            ws_per_message_deflate=False,
            lifespan="off",
            timeout_graceful_shutdown=1,
            proxy_headers=False,
        )
        self._server = uvicorn.Server(config)
        self._thread = threading.Thread(target=self._server.run, kwargs={"sockets": [self._socket]}, name="console", daemon=True)
        self._lister = threading.Thread(target=self._keep_listing_plans, name="plans", daemon=True)

    @property
    def address(self) -> str:
        """What to open in a browser, token included."""
        shown = "127.0.0.1" if self._host in ("0.0.0.0", "::", "localhost") else f"[{self._host}]" if ":" in self._host else self._host
        return f"http://{shown}:{self.port}/#{self.token}"

    @property
    def pages(self) -> int:
        """Browsers connected now."""
        return len(self._pages)

    def start(self) -> None:
        """Serve until `stop`."""
        self._thread.start()
        self._lister.start()

    def stop(self) -> None:
        """Close every page's socket, and end."""
        self._stopped.set()
        self._server.should_exit = True
        if self._thread.is_alive():
            self._thread.join(5.0)
        self._socket.close()

    def wait_for_page(self, timeout_s: float) -> bool:
        """Wait until a browser has connected."""
        return self._ever.wait(timeout_s)

    def _keep_listing_plans(self) -> None:
        """Look for plans now and then while a page is open. A thread of its own: a folder on a network may not answer for long."""
        while not self._stopped.wait(_LIST_PLANS_S):
            if self._pages:
                self.station.list_plans()

    def _application(self) -> ASGIApp:
        files = {path.name: (path.read_bytes(), _MEDIA[path.name.rpartition(".")[2]]) for path in _static_files()}
        app = Starlette(
            routes=[
                Route("/", lambda _: _file_response(files["index.html"])),
                Route("/export/{run}", self._export),
                Route("/{name}", lambda request: _file_response(files.get(request.path_params["name"]))),
                WebSocketRoute("/live", self._live),
            ]
        )
        return Guard(app, self._host, self.port)

    async def _export(self, request: Request) -> Response:
        if not knows_token(request.headers.get("authorization", "").removeprefix("Bearer "), self.token):
            return PlainTextResponse("the token is wrong or missing", 401)
        try:
            archive, folder = await anyio.to_thread.run_sync(self._pack_run, request.path_params["run"])
        except Refused as refusal:
            return PlainTextResponse(str(refusal), 404)
        return FileResponse(archive, media_type="application/zip", background=BackgroundTask(folder.cleanup))

    def _pack_run(self, run: str) -> tuple[Path, tempfile.TemporaryDirectory[str]]:
        """Write a run as an archive into a folder that is to be cleaned up. Raises Refused."""
        folder = tempfile.TemporaryDirectory()
        try:
            return self.station.export_run(run, Path(folder.name)), folder
        except Refused:
            folder.cleanup()
            raise

    async def _live(self, websocket: WebSocket) -> None:
        """One page, from its token to its end."""
        await websocket.accept()
        if not await self._gives_token(websocket):
            await websocket.close(WRONG_TOKEN, "wrong token")
            return
        if len(self._pages) >= _MOST_PAGES:
            await websocket.close(TOO_MANY_PAGES, "too many pages are open")
            return
        self._seen += 1
        page = _Page(websocket, self._seen)
        self._pages.append(page)
        self._controller = self._controller or page
        self._ever.set()
        try:
            await self._serve(page)
        finally:
            self._pages.remove(page)
            if self._controller is page:
                self._controller = None

    async def _gives_token(self, websocket: WebSocket) -> bool:
        try:
            first = read_json(await asyncio.wait_for(websocket.receive_text(), _TOKEN_WITHIN_S))
        except (TimeoutError, WebSocketDisconnect, KeyError):
            return False
        return knows_token(first.get("token"), self.token)

    async def _serve(self, page: _Page) -> None:
        """Show and listen until the page is gone; a defect in showing closes its socket, so that it connects again."""
        tasks = [asyncio.create_task(self._show(page)), asyncio.create_task(self._listen(page))]
        try:
            await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        finally:
            for task in tasks:
                task.cancel()
            ends = await asyncio.gather(*tasks, return_exceptions=True)
        for defect in ends:
            if isinstance(defect, Exception) and not isinstance(defect, (WebSocketDisconnect, RuntimeError, OSError)):
                self.station.alarms.raise_alarm("fault", "Defect in the program", repr(defect))
                await page.socket.close(_BROKEN_DOWN, "the station cannot show this page")

    async def _listen(self, page: _Page) -> None:
        while True:
            try:
                received = receive(await page.socket.receive_text())
            except (WebSocketDisconnect, KeyError):
                return
            try:
                ok, message = True, await self._obey(page, received)
            except Refused as refusal:
                ok, message = False, str(refusal)
            await _send(page, json_of(Answer(received.number, received.do, ok, message)))

    async def _obey(self, page: _Page, received: Received) -> str:
        """Carry out one command; returns its answer in words. Raises Refused."""
        command = received.command()
        action = action_of(command, self.station)
        if action is not None:
            self._controller = self._controller or page
            if self._controller is not page:
                raise Refused("another page is in control; this one watches")
            page.opened = None if received.do in ("start", "replay") else page.opened
            return await anyio.to_thread.run_sync(action)
        if isinstance(command, OfRun):
            page.opened = await anyio.to_thread.run_sync(self.station.open_run, command.run)
        elif isinstance(command, OpenSection):
            page.opened = await anyio.to_thread.run_sync(self.station.open_section, command.section)
        elif isinstance(command, Plain):
            return await self._obey_plain(page, command)
        return "opened"

    async def _obey_plain(self, page: _Page, command: Plain) -> str:
        """Carry out what any page may ask of the server."""
        if command.do == "take control":
            self._controller = page
            return "this page is in control"
        if command.do == "live":
            page.opened = None
            return "the station as it is now"
        found = await anyio.to_thread.run_sync(self.station.devices)
        return json.dumps([asdict(Device(address, description)) for address, description in found])

    async def _show(self, page: _Page) -> None:
        """Send what changed, never more than the newest, at most 30 times a second."""
        await _send(page, json_of(Hello(self._version, page.number, self.remote)))
        alive_s = 0.0
        while True:
            began_s = time.monotonic()
            await self._show_points(page)
            for message in self._newest(page):
                if page.sent.get(message.type) != message:
                    page.sent[message.type] = message
                    await _send(page, await anyio.to_thread.run_sync(json_of, message))
            if began_s - alive_s >= _ALIVE_S:
                alive_s = began_s
                await _send(page, json_of(Alive(self.station.now_ms())))
            await asyncio.sleep(max(_PERIOD_S - (time.monotonic() - began_s), 0.005))

    def _newest(self, page: _Page) -> Iterator[Message]:
        """What the page is shown now: snapshots that the station has published."""
        station, view = self.station, page.opened or self.station.view
        yield Control(self._controller is page, self._controller is not None, len(self._pages))
        yield station.state
        yield station.alarms.shown
        yield ShownRun(view.state() if view else None, page.opened is not None)
        yield station.history
        yield station.ct.state

    async def _show_points(self, page: _Page) -> None:
        view = page.opened or self.station.view
        if view is None:
            return
        if page.nominal_of is not view:
            page.nominal_of, page.seen = view, _UNSEEN
            await _send(page, await anyio.to_thread.run_sync(nominal_message, view.context.profile))
        if page.seen != view.newest_points:
            packed = await anyio.to_thread.run_sync(_pack_changes, view, page.seen, page.generation)
            page.seen, page.generation = packed.seen, packed.generation
            await _send(page, packed.message)


class _Packed(NamedTuple):
    """Points packed for one page, and what the page has seen with them."""

    message: bytes
    seen: PointsVersion
    generation: int


def _pack_changes(view: RunView, seen: PointsVersion, generation: int) -> _Packed:
    """Pack the points that changed after what a page has `seen`; `generation` is that of the message before."""
    changed, verdict_at = view.points_since(seen)
    generation += changed.seen.generation != seen.generation
    return _Packed(points_message(changed, generation, verdict_at), changed.seen, generation)


def _static_files() -> list[Any]:
    folder = resources.files("cmmlink.console").joinpath("static")
    return [path for path in folder.iterdir() if path.name.rpartition(".")[2] in _MEDIA]


def _file_response(file: tuple[bytes, str] | None) -> Response:
    return Response(file[0], media_type=file[1]) if file else PlainTextResponse("there is no such page", 404)


def _listen_at(host: str, port: int) -> socket.socket:
    """A bound socket. Raises OSError when the address is taken or is none of this machine."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    listening = socket.socket(family, socket.SOCK_STREAM)
    try:
        if sys.platform != "win32":  # there it would let another program take over the port
            listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listening.bind((host, port))
        listening.listen()  # from here on nobody is turned away, though it may take a moment until somebody answers
    except OSError:
        listening.close()
        raise
    return listening


async def _send(page: _Page, message: str | bytes) -> None:
    async with page.sending:
        sent: Awaitable[None] = page.socket.send_text(message) if isinstance(message, str) else page.socket.send_bytes(message)
        await sent
