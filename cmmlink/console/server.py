"""The server of the page: its files, one socket a page, and which page is in control.

Safe by default: only the addresses it was told to serve and only pages it served itself (guard.py), only browsers that know the token
(keys.py), and of those and all others only so many (connections.py). Of the machine's files it reads none but its own page; plans and
records come through the station.

Its event loop waits for nothing but its sockets: it reads snapshots that the station has published, and whatever takes time - a
command, packing what is drawn, looking for plans - is done by other threads.
"""

import asyncio
import json
import logging
import threading
import time
from collections.abc import Awaitable, Callable, Iterator
from contextlib import suppress
from dataclasses import asdict, replace
from importlib import resources
from typing import Any

import anyio.to_thread
import uvicorn
from starlette.applications import Starlette
from starlette.requests import HTTPConnection, Request
from starlette.responses import PlainTextResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.types import ASGIApp
from starlette.websockets import WebSocket, WebSocketDisconnect

from cmmlink.characteristic_rows import MOST_ROWS, Characteristics, most_shown
from cmmlink.console.commands import Received, action_of, read_json, receive, search_of
from cmmlink.console.connections import LARGEST_COMMAND, LARGEST_HEAD, BoundedServer, PageProtocol, Visitor
from cmmlink.console.guard import Guard
from cmmlink.console.keys import Keys
from cmmlink.console.listening import Access, encryption_of, listen_at
from cmmlink.console.open_page import NOTHING_SOUGHT, OpenPage
from cmmlink.console.plan_post import POST_S, Posts
from cmmlink.console.protocol import (
    TOO_MANY_PAGES,
    WRONG_TOKEN,
    Admitted,
    Alive,
    Answer,
    CharacteristicList,
    Control,
    Device,
    Hello,
    Message,
    OfRun,
    OpenSection,
    Plain,
    Search,
    ShownRun,
    json_of,
)
from cmmlink.console.refused import Refused, without_folders, words_of
from cmmlink.console.run_file import EXPORT_S, RunFiles
from cmmlink.console.station import Station
from cmmlink.console.trend_answers import LOOK_S, TrendAnswers
from cmmlink.console.unseen import Onlooker
from cmmlink.run_state import RunState

_log = logging.getLogger(__name__)

_PERIOD_S = 1 / 30  # at most so often a page is sent something
_ALIVE_S = 0.5
_LIST_PLANS_S = 1.0
_LOOK_ON_S = 0.5
_TOKEN_WITHIN_S = 5.0
_MOST_PAGES = 16
_MOST_COMMANDS = 200  # a page may send within a second
_TOO_MANY_COMMANDS = 1008  # close code
_BROKEN_DOWN = 1011  # close code: the page connects again and is sent everything
_MEDIA = {
    "html": "text/html; charset=utf-8",
    "css": "text/css; charset=utf-8",
    "js": "text/javascript; charset=utf-8",
    "json": "application/json; charset=utf-8",
    "svg": "image/svg+xml",
}


class ConsoleServer:
    """Serves one station to browsers, in a thread of its own.

    version : of the software; a page of another version loads itself anew
    access  : where to listen, and how
    token   : what a page must know; a new one where none is given. No address holds it (keys.py)
    """

    def __init__(self, station: Station, version: str, access: Access | None = None, token: str | None = None) -> None:
        """Raises PlanError where the access is not allowed, OSError where the address cannot be had."""
        self.station, self._version = station, version
        self._access = access or Access()
        self._keys = Keys(time.monotonic, token)
        certificate = self._access.certificate
        self.encryption = None if certificate is None else encryption_of(certificate, self._access.key)
        self._socket, self.remote = listen_at(self._access)
        self.port: int = self._socket.getsockname()[1]
        self._pages: list[OpenPage] = []
        self._controller: OpenPage | None = None
        self._seen = 0
        self._ever = threading.Event()
        self._stopped = threading.Event()
        config = uvicorn.Config(
            self._application(),
            log_config=None,
            log_level="critical",
            access_log=False,
            server_header=False,
            ws=PageProtocol,
            ws_max_size=LARGEST_COMMAND,
            ws_per_message_deflate=False,
            h11_max_incomplete_event_size=LARGEST_HEAD,
            lifespan="off",
            timeout_graceful_shutdown=1,
            proxy_headers=False,
        )
        self._server = BoundedServer(config, self._socket, self.encryption)
        self._thread = threading.Thread(target=self._server.run, name="console", daemon=True)
        self._lister = threading.Thread(target=self._keep_listing_plans, name="plans", daemon=True)
        self._onlooker = threading.Thread(target=self._keep_looking_on, name="onlooker", daemon=True)

    def new_address(self) -> str:
        """What to open in a browser: an address that opens one page, once, within a minute."""
        return f"{self._place}/#{self._keys.new_code()}"

    def renew(self) -> None:
        """Turn out every page, and let none in that was in before; each needs a new address."""
        self._keys.renew()
        for page in tuple(self._pages):
            page.expelled = True

    @property
    def _place(self) -> str:
        host = self._access.host.strip().strip("[]")
        shown = "127.0.0.1" if host in ("0.0.0.0", "::", "localhost") else f"[{host}]" if ":" in host else host
        return f"{'https' if self.encryption else 'http'}://{shown}:{self.port}"

    @property
    def pages(self) -> int:
        """Browsers connected now."""
        return len(self._pages)

    def start(self) -> None:
        """Serve until `stop`."""
        self._thread.start()
        self._lister.start()
        self._onlooker.start()

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

    def _keep_looking_on(self) -> None:
        """Stop what moves when no page is open any more."""
        onlooker = Onlooker(self.station, time.monotonic)
        while not self._stopped.wait(_LOOK_ON_S):
            onlooker.look(self.pages)

    def _application(self) -> ASGIApp:
        files = {path.name: (path.read_bytes(), _MEDIA[path.name.rpartition(".")[2]]) for path in _static_files()}
        runs, posts, trends = RunFiles(self.station), Posts(self.station, self._let_control), TrendAnswers(self.station)
        app = Starlette(
            routes=[
                Route("/", lambda _: _file_response(files["index.html"])),
                Route("/export/{run}", self._with_token(runs.export, EXPORT_S)),
                Route("/report/{run}", self._with_token(runs.report, EXPORT_S)),
                Route("/compare/{first}/{second}", self._with_token(runs.compare, EXPORT_S)),
                Route("/trends", self._with_token(trends.choices, LOOK_S)),
                Route("/trend", self._with_token(trends.trend, LOOK_S)),
                Route("/trend-file", self._with_token(runs.trend, EXPORT_S)),
                Route("/nominal", self._with_token(posts.understand_nominal, POST_S), methods=["POST"]),
                Route("/plan", self._with_token(posts.save_plan, POST_S), methods=["POST"]),
                Route("/{name}", lambda request: _file_response(files.get(request.path_params["name"]))),
                WebSocketRoute("/live", self._live),
            ]
        )
        return Guard(app, self._access.host.strip(), self.port, self.remote)

    def _with_token(self, answer: Callable[[Request], Awaitable[Response]], longest_s: float) -> Callable[[Request], Awaitable[Response]]:
        """Answer whoever shows the token, for at most so long."""

        async def answer_admitted(request: Request) -> Response:
            if not self._keys.knows(request.headers.get("authorization", "").removeprefix("Bearer ")):
                return PlainTextResponse("the token is wrong or missing", 401)
            _visitor(request).admit(longest_s)
            return await answer(request)

        return answer_admitted

    def _let_control(self, number: str) -> None:
        """Let the page of a number control the station, unless another one does. Raises Refused."""
        page = next((page for page in self._pages if str(page.number) == number), None)
        if page is None:
            raise Refused("the page is not connected to the station")
        self._take_control(page)

    async def _live(self, websocket: WebSocket) -> None:
        """One page, from its token to its end."""
        await websocket.accept()
        if not await self._admits(websocket):
            await websocket.close(WRONG_TOKEN, "this address was used, or is too old")
            return
        visitor = _visitor(websocket)
        visitor.admit()
        if len(self._pages) >= _MOST_PAGES:
            await websocket.close(TOO_MANY_PAGES, "too many pages are open")
            return
        self._seen += 1
        page = OpenPage(websocket, visitor, self._seen)
        self._pages.append(page)
        self._controller = self._controller or page
        self._ever.set()
        try:
            await self._serve(page)
        finally:
            self._pages.remove(page)
            if self._controller is page:
                self._controller = None

    async def _admits(self, websocket: WebSocket) -> bool:
        """Whether the first message holds the token, or the code of a one-time address, which is answered with the token."""
        try:
            first = read_json(await asyncio.wait_for(websocket.receive_text(), _TOKEN_WITHIN_S))
            if "once" not in first:
                return self._keys.knows(first.get("token"))
            redeemed = self._keys.redeem(first["once"])
            if redeemed == "used":
                what = "Two pages were opened at an address that opens one. If the other is not yours, restart the console"
                self.station.alarms.raise_alarm("warning", "An address was used twice", what)
            if redeemed != "opened":
                return False
            await websocket.send_text(json_of(Admitted(self._keys.token)))
        except (TimeoutError, WebSocketDisconnect, KeyError, RuntimeError):
            return False
        return True

    async def _serve(self, page: OpenPage) -> None:
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

    async def _listen(self, page: OpenPage) -> None:
        began_s, commands = time.monotonic(), 0
        while True:
            try:
                received = receive(await page.socket.receive_text())
            except (WebSocketDisconnect, KeyError):
                return
            now_s, commands = time.monotonic(), commands + 1
            if now_s - began_s > 1.0:
                began_s, commands = now_s, 1
            if commands > _MOST_COMMANDS:
                await page.socket.close(_TOO_MANY_COMMANDS, "too many commands in a second")
                return
            try:
                ok, message = True, await self._obey(page, received)
            except Refused as refusal:
                ok, message = False, str(refusal)
            except OSError as error:
                _log.exception("command %r failed", received.do)
                ok, message = False, words_of(error)
            await page.send(json_of(Answer(received.number, received.do, ok, message)))

    async def _obey(self, page: OpenPage, received: Received) -> str:
        """Carry out one command; returns its answer in words. Raises Refused."""
        command = received.command()
        action = action_of(command, self.station)
        if action is not None:
            self._take_control(page)
            page.opened = None if received.do in ("start", "replay") else page.opened
            return await anyio.to_thread.run_sync(action)
        if isinstance(command, OfRun):
            page.opened = await anyio.to_thread.run_sync(self.station.open_run, command.run)
        elif isinstance(command, OpenSection):
            page.opened = await anyio.to_thread.run_sync(self.station.open_section, command.section)
        elif isinstance(command, Search):
            page.search, page.found, page.searched_in = search_of(command), NOTHING_SOUGHT, None
            await page.look_for_runs(self.station.history, self.station.find_runs)
            return "all runs" if page.search is None else f"{page.found.total} runs found"
        elif isinstance(command, Plain):
            return await self._obey_plain(page, command)
        return "opened"

    def _take_control(self, page: OpenPage) -> None:
        """Let a page control the station, unless another one does. Raises Refused."""
        self._controller = self._controller or page
        if self._controller is not page:
            raise Refused("another page is in control; this one watches")

    async def _obey_plain(self, page: OpenPage, command: Plain) -> str:
        """Carry out what any page may ask of the server."""
        if command.do == "take control":
            self._controller = page
            return "this page is in control"
        if command.do == "live":
            page.opened = None
            return "the station as it is now"
        if command.do == "another page":
            return self._keys.new_code()
        found = await anyio.to_thread.run_sync(self.station.devices)
        return json.dumps([asdict(Device(address, description)) for address, description in found])

    async def _show(self, page: OpenPage) -> None:
        """Send what changed, never more than the newest, at most 30 times a second."""
        await page.send(json_of(Hello(self._version, page.number, self.remote)))
        alive_s = 0.0
        while not page.expelled:
            began_s = time.monotonic()
            await page.show_points(page.opened or self.station.view)
            with suppress(Refused):  # the records cannot be read just now, of which there is an alarm
                await page.look_for_runs(self.station.history, self.station.find_runs)
            for message in self._newest(page):
                if page.sent.get(message.type) != message:
                    page.sent[message.type] = message
                    await page.send(await anyio.to_thread.run_sync(json_of, message))
            if began_s - alive_s >= _ALIVE_S:
                alive_s = began_s
                await page.send(json_of(Alive(self.station.now_ms())))
            await asyncio.sleep(max(_PERIOD_S - (time.monotonic() - began_s), 0.005))
        await page.socket.close(WRONG_TOKEN, "the console was given a new token")

    def _newest(self, page: OpenPage) -> Iterator[Message]:
        """What the page is shown now: snapshots that the station has published."""
        station, view = self.station, page.opened or self.station.view
        yield Control(self._controller is page, self._controller is not None, len(self._pages))
        yield station.state
        yield station.pushed.state
        yield station.alarms.shown
        state, shown = (view.state(), view.characteristics) if view else (None, Characteristics())
        yield ShownRun(_for_page(state) if state else None, page.opened is not None)
        is_final = state is not None and state.phase == "finished"
        yield CharacteristicList(most_shown(shown.rows), max(len(shown.rows) - MOST_ROWS, 0), shown.uncertainty, is_final)
        yield station.history
        yield page.found
        yield station.ct.state
        yield station.registers.state


def _for_page(run: RunState) -> RunState:
    """The state of a run as pages see it: what went wrong is told without the folders that files lie in."""
    return replace(run, message=without_folders(run.message), remark=without_folders(run.remark))


def _static_files() -> list[Any]:
    folder = resources.files("cmmlink.console").joinpath("static")
    return [path for path in folder.iterdir() if path.name.rpartition(".")[2] in _MEDIA]


def _file_response(file: tuple[bytes, str] | None) -> Response:
    return Response(file[0], media_type=file[1]) if file else PlainTextResponse("there is no such page", 404)


def _visitor(connection: HTTPConnection) -> Visitor:
    """The connection that a request came over."""
    visitor = connection.scope["state"]["visitor"]
    assert isinstance(visitor, Visitor)
    return visitor
