"""The server of the page: static files, one socket, and who may do what.

Safe by default: only the addresses it was told to serve, only pages it served itself (Host and Origin are checked), only
browsers that know the token. Of the machine's files it reads none but its own page; plans and records come through the station.
"""

import asyncio
import contextlib
import hmac
import json
import secrets
import socket
import sys
import tempfile
import threading
import time
from collections.abc import Awaitable, Callable, Iterator, Mapping
from dataclasses import dataclass, field
from importlib import resources
from pathlib import Path
from typing import Any

import anyio.to_thread
import uvicorn
from starlette.applications import Starlette
from starlette.background import BackgroundTask
from starlette.datastructures import Headers, MutableHeaders
from starlette.requests import Request
from starlette.responses import FileResponse, PlainTextResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.types import ASGIApp, Receive, Scope, Send
from starlette.types import Message as AsgiMessage
from starlette.websockets import WebSocket, WebSocketDisconnect

from cmmlink.console.drawing import nominal_message, points_message
from cmmlink.console.protocol import TOO_MANY_PAGES, WRONG_TOKEN, Alive, Answer, Control, Hello, History, Message, ShownRun, json_of
from cmmlink.console.station import Refused, Station
from cmmlink.extremes import PointsVersion
from cmmlink.run_view import RunView

_PERIOD_S = 1 / 30  # at most so often a page is sent something
_ALIVE_S = 0.5
_TOKEN_WITHIN_S = 5.0
_LARGEST_COMMAND = 16 * 1024
_MOST_PAGES = 16
_MOST_HISTORY = 500
_MOST_ALARMS = 50
_NOTHING_SEEN = PointsVersion(-1, 0)
_LOOPBACK = ("127.0.0.1", "::1", "localhost")
_MEDIA = {
    "html": "text/html; charset=utf-8",
    "css": "text/css; charset=utf-8",
    "js": "text/javascript; charset=utf-8",
    "svg": "image/svg+xml",
}
_HEADERS = {
    "content-security-policy": "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; connect-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    "x-content-type-options": "nosniff",
    "x-frame-options": "DENY",
    "referrer-policy": "no-referrer",
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
    "cache-control": "no-store",
}


@dataclass(eq=False)
class _Page:
    """One connected browser: what it was sent, and what it looks at."""

    socket: WebSocket
    number: int
    opened: RunView | None = None
    nominal_of: RunView | None = None
    seen: PointsVersion = _NOTHING_SEEN
    generation: int = 0
    sent: dict[str, str] = field(default_factory=dict)
    sending: asyncio.Lock = field(default_factory=asyncio.Lock)

    def forget(self) -> None:
        """Take it that the page knows nothing, so that it is sent everything."""
        self.sent.clear()
        self.nominal_of = None


class ConsoleServer:
    """Serves one station to browsers, in a thread of its own.

    host, port : where to listen; port 0 takes a free one
    token      : what a page must know; it stands in the address's fragment, which browsers do not send
    version    : of the software; a page of another version loads itself anew
    """

    def __init__(self, station: Station, version: str, host: str = "127.0.0.1", port: int = 0, token: str | None = None) -> None:
        self.station, self._version = station, version
        self.token = token or secrets.token_urlsafe(24)
        self.remote = host not in _LOOPBACK
        self._host, self._socket = host, _listening(host, port)
        self.port: int = self._socket.getsockname()[1]
        self._pages: list[_Page] = []
        self._controller: _Page | None = None
        self._seen = 0
        self._ever = threading.Event()
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

    def stop(self) -> None:
        """Tell every page, and end."""
        self._server.should_exit = True
        if self._thread.is_alive():
            self._thread.join(5.0)
        self._socket.close()

    def wait_for_page(self, timeout_s: float) -> bool:
        """Wait until a browser has connected."""
        return self._ever.wait(timeout_s)

    def _application(self) -> ASGIApp:
        files = {path.name: (path.read_bytes(), _MEDIA[path.name.rpartition(".")[2]]) for path in _static_files()}
        app = Starlette(
            routes=[
                Route("/", lambda _: _served(files["index.html"])),
                Route("/export/{run}", self._export),
                Route("/{name}", lambda request: _served(files.get(request.path_params["name"]))),
                WebSocketRoute("/live", self._live),
            ]
        )
        return _Guard(app, self._hosts())

    def _hosts(self) -> Callable[[str], bool]:
        """Which Host headers are ours: names of this machine, with our port."""
        names = {"127.0.0.1", "localhost", "[::1]"} | ({socket.gethostname().lower(), self._host.lower()} if self.remote else set())
        own = {f"{name}:{self.port}" for name in names} | (names if self.port == 80 else set())

        def ours(host: str) -> bool:
            # A foreign name that resolves to us (rebinding) is never a bare address, so addresses may pass where we serve others.
            return host.lower() in own or (self.remote and _is_address(host, self.port))

        return ours

    async def _export(self, request: Request) -> Response:
        given = request.headers.get("authorization", "").removeprefix("Bearer ")
        if not self._knows(given):
            return PlainTextResponse("the token is wrong or missing", 401)
        folder = tempfile.TemporaryDirectory()
        try:
            archive = await anyio.to_thread.run_sync(self.station.exported, request.path_params["run"], Path(folder.name))
        except Refused as refusal:
            folder.cleanup()
            return PlainTextResponse(str(refusal), 404)
        return FileResponse(archive, media_type="application/zip", background=BackgroundTask(folder.cleanup))

    def _knows(self, token: object) -> bool:
        return isinstance(token, str) and hmac.compare_digest(token.encode(), self.token.encode())

    async def _live(self, websocket: WebSocket) -> None:
        """One page, from its token to its end."""
        await websocket.accept()
        if not await self._introduced(websocket):
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
        showing = asyncio.create_task(self._show(page))
        try:
            await self._listen(page)
        finally:
            showing.cancel()
            with contextlib.suppress(asyncio.CancelledError, WebSocketDisconnect, RuntimeError, OSError):
                await showing
            self._pages.remove(page)
            if self._controller is page:
                self._controller = None

    async def _introduced(self, websocket: WebSocket) -> bool:
        try:
            first = _parsed(await asyncio.wait_for(websocket.receive_text(), _TOKEN_WITHIN_S))
        except (TimeoutError, WebSocketDisconnect, KeyError):
            return False
        return self._knows(first.get("token"))

    async def _listen(self, page: _Page) -> None:
        while True:
            try:
                command = _parsed(await page.socket.receive_text())
            except (WebSocketDisconnect, KeyError):
                return
            number = command.get("number")
            try:
                ok, message = True, await self._obey(page, command)
            except Refused as refusal:
                ok, message = False, str(refusal)
            answer = Answer(number if isinstance(number, int) else None, str(command.get("do"))[:40], ok, message)
            await _send(page, json_of(answer))

    async def _obey(self, page: _Page, command: Mapping[str, Any]) -> str:
        """Carry out one command; its answer in words. Raises Refused."""
        do = command.get("do")
        if do == "take control":
            self._controller = page
            return "this page is in control"
        if do == "everything":
            page.forget()
            return "everything is sent again"
        if do == "live":
            page.opened = None
            return "the station as it is now"
        if do == "open":
            page.opened = await anyio.to_thread.run_sync(self.station.opened, _text(command, "run"))
            return "opened"
        if do == "section":
            index = _maybe_number(command, "section")
            page.opened = await anyio.to_thread.run_sync(self.station.section, -1 if index is None else index)
            return "opened"
        if do == "devices":
            return json.dumps(await anyio.to_thread.run_sync(self.station.devices))
        work = self._work(command)
        if work is None:
            raise Refused(f"there is no command {str(do)[:40]!r}")
        if self._controller is None:
            self._controller = page
        if self._controller is not page:
            raise Refused("another page is in control; this one watches")
        page.opened = None if do in ("start", "replay") else page.opened
        return await anyio.to_thread.run_sync(work)

    def _work(self, command: Mapping[str, Any]) -> Callable[[], str] | None:
        """What a command of the one in control asks of the station."""
        station = self.station
        works: dict[str, Callable[[], str]] = {
            "choose": lambda: station.choose(_text(command, "plan")),
            "enter": lambda: station.enter(*(_maybe_text(command, key) for key in ("serial_number", "operator", "address"))),
            "start": station.start,
            "end": station.end_scan,
            "abort": station.abort,
            "test": station.test_device,
            "acknowledge": lambda: station.acknowledge(_maybe_number(command, "alarm")),
            "replay": lambda: station.replay(_text(command, "run")),
            "import": lambda: station.import_ct(_text(command, "plan")),
        }
        return works.get(str(command.get("do")))

    async def _show(self, page: _Page) -> None:
        """Send what changed, never more than the newest, at most 30 times a second."""
        await _send(page, json_of(Hello(self._version, page.number, self.remote)))
        alive_s = 0.0
        while True:
            began_s = time.monotonic()
            await self._show_points(page)
            for message in self._newest(page):
                text = json_of(message)
                if page.sent.get(message.type) != text:
                    page.sent[message.type] = text
                    await _send(page, text)
            if began_s - alive_s >= _ALIVE_S:
                alive_s = began_s
                await _send(page, json_of(Alive(self.station.now_ms())))
            await asyncio.sleep(max(_PERIOD_S - (time.monotonic() - began_s), 0.005))

    def _newest(self, page: _Page) -> Iterator[Message]:
        """What the page is shown now, without what it certainly knows already."""
        station, view = self.station, page.opened or self.station.view
        yield Control(self._controller is page, self._controller is not None, len(self._pages))
        yield station.state()
        yield station.alarms.snapshot(_MOST_ALARMS)
        yield ShownRun(view.state() if view else None, page.opened is not None)
        if _anew(page, "history version", station.history_version):
            yield History(station.history[:_MOST_HISTORY])
        if _anew(page, "ct version", station.ct.version):
            yield station.ct.snapshot()

    async def _show_points(self, page: _Page) -> None:
        view = page.opened or self.station.view
        if view is None:
            return
        if page.nominal_of is not view:
            await _send(page, await anyio.to_thread.run_sync(nominal_message, view.context.profile))
            page.nominal_of, page.seen = view, _NOTHING_SEEN
        if page.seen == view.newest_points:
            return
        changed, verdict_at = view.points_since(page.seen)
        page.generation += changed.seen.generation != page.seen.generation  # for this page alone: runs number theirs alike
        page.seen = changed.seen
        await _send(page, points_message(changed, page.generation, verdict_at))


class _Guard:
    """Refuses requests that are not meant for us, and puts the security headers on every answer."""

    def __init__(self, app: ASGIApp, ours: Callable[[str], bool]) -> None:
        self._app, self._ours = app, ours

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        headers = Headers(scope=scope)
        host, origin = headers.get("host", ""), headers.get("origin")
        refusal: Response | None = None
        if not self._ours(host):
            refusal = PlainTextResponse("this address is not served here", 400)
        elif (scope["type"] == "websocket" or origin is not None) and origin != f"http://{host}":
            refusal = PlainTextResponse("pages of other origins are not served", 403)
        if scope["type"] == "websocket":
            await (WebSocket(scope, receive, send).send_denial_response(refusal) if refusal else self._app(scope, receive, send))
            return
        await (refusal or self._app)(scope, receive, _with_headers(send))


def _with_headers(send: Send) -> Send:
    async def sending(message: AsgiMessage) -> None:
        if message["type"] == "http.response.start":
            MutableHeaders(scope=message).update(_HEADERS)
        await send(message)

    return sending


def _static_files() -> list[Any]:
    folder = resources.files("cmmlink.console").joinpath("static")
    return [path for path in folder.iterdir() if path.name.rpartition(".")[2] in _MEDIA]


def _served(file: tuple[bytes, str] | None) -> Response:
    return Response(file[0], media_type=file[1]) if file else PlainTextResponse("there is no such page", 404)


def _listening(host: str, port: int) -> socket.socket:
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


def _is_address(host: str, port: int) -> bool:
    name, _, given = host.rpartition(":")
    if given != str(port):
        return False
    for family, text in ((socket.AF_INET, name), (socket.AF_INET6, name.strip("[]"))):
        with contextlib.suppress(OSError):
            socket.inet_pton(family, text)
            return True
    return False


async def _send(page: _Page, message: str | bytes) -> None:
    async with page.sending:
        sent: Awaitable[None] = page.socket.send_text(message) if isinstance(message, str) else page.socket.send_bytes(message)
        await sent


def _anew(page: _Page, what: str, version: int) -> bool:
    """Whether the page was not told this version yet; from now on it was."""
    before, page.sent[what] = page.sent.get(what), str(version)
    return before != str(version)


def _parsed(text: str) -> dict[str, Any]:
    """A JSON object, or an empty one where the text is none."""
    try:
        value = json.loads(text)
    except (ValueError, RecursionError):
        return {}
    return value if isinstance(value, dict) else {}


def _text(command: Mapping[str, Any], key: str) -> str:
    value = command.get(key)
    if not isinstance(value, str):
        raise Refused(f"the command needs a text {key!r}")
    return value


def _maybe_text(command: Mapping[str, Any], key: str) -> str | None:
    return _text(command, key) if command.get(key) is not None else None


def _maybe_number(command: Mapping[str, Any], key: str) -> int | None:
    value = command.get(key)
    if value is not None and not isinstance(value, int):
        raise Refused(f"the command needs a whole number {key!r}")
    return value
