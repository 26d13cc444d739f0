"""The doors of the server, tried without a browser: what a hostile page, program or network could send."""

import errno
import http.client
import json
import struct
import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from socket import create_connection
from time import monotonic
from typing import Any

import pytest
from websockets import Origin
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection, connect

from cmmlink.console import server as console_server
from cmmlink.console.listening import Access
from cmmlink.console.protocol import NOMINAL, POINTS
from cmmlink.console.server import ConsoleServer
from cmmlink.console.station import Station
from cmmlink.from_plan import profile_of
from cmmlink.plan.scan import load_plan
from cmmlink.run_context import RunContext
from cmmlink.run_view import RunView

from .played import UNREAD, Device, setup_of, write_plan

TOKEN = "a-token-for-this-test-of-32-characters"
HELLO = json.dumps({"token": TOKEN})


@pytest.fixture
def server(tmp_path: Path) -> Iterator[ConsoleServer]:
    server = ConsoleServer(Station(setup_of({"blade.yaml": write_plan(tmp_path)}, Device().connect)), "test", token=TOKEN)
    server.start()
    yield server
    server.stop()


def got(server: ConsoleServer, path: str, **headers: str) -> http.client.HTTPResponse:
    connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=10)
    connection.request("GET", path, headers=headers)
    answer = connection.getresponse()
    answer.read()
    connection.close()
    return answer


@contextmanager
def joined(
    server: ConsoleServer, origin: str | None = "", first: str = json.dumps({"token": TOKEN}), **more: Any
) -> Iterator[ClientConnection]:
    """A socket with a token sent; without `origin`, one that says it comes from the page."""
    told = f"http://127.0.0.1:{server.port}" if origin == "" else origin
    with connect(f"ws://127.0.0.1:{server.port}/live", origin=Origin(told) if told else None, max_queue=UNREAD, **more) as socket:
        socket.send(first)
        yield socket


def closing_code(socket: ClientConnection) -> int | None:
    """Why the server closes the socket, whatever it says before."""
    try:
        while True:
            socket.recv(timeout=10)
    except ConnectionClosed as closed:
        return closed.rcvd.code if closed.rcvd else None


def answered(socket: ClientConnection, command: Any) -> dict[str, Any]:
    socket.send(command if isinstance(command, str) else json.dumps(command))
    while True:
        message = socket.recv(timeout=10)
        if isinstance(message, str) and (told := json.loads(message))["type"] == "answer":
            return dict(told)


def test_page_and_its_files_are_served_with_the_security_headers(server: ConsoleServer) -> None:
    for path, media in (("/", "text/html"), ("/main.js", "text/javascript"), ("/console.css", "text/css"), ("/icon.svg", "image/svg+xml")):
        answer = got(server, path)
        assert answer.status == 200
        assert (answer.getheader("content-type") or "").startswith(media)
        policy = answer.getheader("content-security-policy") or ""
        assert "default-src 'none'" in policy
        assert "script-src 'self'" in policy
        assert "unsafe" not in policy
        assert answer.getheader("x-content-type-options") == "nosniff"
        assert answer.getheader("x-frame-options") == "DENY"
        assert answer.getheader("referrer-policy") == "no-referrer"


def test_page_asks_nothing_of_other_hosts() -> None:
    static = Path(__file__).parents[3] / "cmmlink" / "console" / "static"
    for file in static.iterdir():
        text = file.read_text(encoding="utf-8").replace("http://www.w3.org/2000/svg", "")
        assert "http://" not in text.replace("`http://", "")
        assert "https://" not in text
        assert "eval(" not in text


@pytest.mark.parametrize(
    "path",
    [
        "/../server.py",
        "/..%2fserver.py",
        "/%2e%2e/%2e%2e/etc/passwd",
        "/static/main.js",
        "//etc/passwd",
        "/blade.yaml",
        "/__init__.py",
        "/server.py",
        "/main.js%00.html",
        "/.",
    ],
)
def test_no_other_file_can_be_read(server: ConsoleServer, path: str) -> None:
    assert got(server, path).status == 404


def test_foreign_host_is_refused_everywhere(server: ConsoleServer) -> None:
    for host in ("evil.example", f"evil.example:{server.port}", "127.0.0.1:1", "", f"127.0.0.1.evil.example:{server.port}"):
        assert got(server, "/", Host=host).status == 400
    with pytest.raises(InvalidStatus) as refusal, joined(server, additional_headers={"Host": "evil.example"}):
        pass
    assert refusal.value.response.status_code in (400, 403)
    assert got(server, "/", Host=f"localhost:{server.port}").status == 200


@pytest.mark.parametrize("origin", ["http://evil.example", "null", "https://127.0.0.1", "http://127.0.0.1:1", None])
def test_foreign_or_missing_origin_is_refused(server: ConsoleServer, origin: str | None) -> None:
    with pytest.raises(InvalidStatus) as refusal, joined(server, origin):
        pass
    assert refusal.value.response.status_code == 403
    assert server.pages == 0


@pytest.mark.parametrize("first", ["", "hello", "[]", '{"token": null}', '{"token": "guess"}', '{"do": "abort"}', "[" * 5000])
def test_wrong_token_closes_with_4401_and_tells_nothing(server: ConsoleServer, first: str) -> None:
    with joined(server, first=first) as socket:
        assert closing_code(socket) == 4401


def test_one_time_address_is_exchanged_for_the_token_once(server: ConsoleServer) -> None:
    once = json.dumps({"once": server.new_address().partition("#")[2]})
    with joined(server, first=once) as socket:
        assert json.loads(socket.recv(timeout=10)) == {"token": TOKEN, "type": "admitted"}
        assert json.loads(socket.recv(timeout=10))["type"] == "hello"
        with joined(server, first=once) as second:
            assert closing_code(second) == 4401
        assert heard(socket, "alarms")
    assert [alarm.what for alarm in server.station.alarms.newest_first()] == ["An address was used twice"]


@pytest.mark.parametrize("code", ["guessed", "", None, 7, [TOKEN], TOKEN])
def test_what_is_no_code_opens_nothing(server: ConsoleServer, code: object) -> None:
    with joined(server, first=json.dumps({"once": code, "token": TOKEN})) as socket:
        assert closing_code(socket) == 4401
    assert server.station.alarms.newest_first() == []


def test_an_open_page_gets_an_address_for_one_more(server: ConsoleServer) -> None:
    with joined(server) as socket, joined(server) as watching:
        heard(socket, "control")
        for page in (socket, watching):
            code = answered(page, {"do": "another page"})["message"]
            with joined(server, first=json.dumps({"once": code})) as other:
                assert heard(other, "hello")


def test_a_new_token_turns_every_page_out(server: ConsoleServer) -> None:
    with joined(server) as socket:
        heard(socket, "alive")
        server.renew()
        assert closing_code(socket) == 4401
    with joined(server) as socket:
        assert closing_code(socket) == 4401
    assert got(server, "/export/last", Authorization=f"Bearer {TOKEN}").status == 401
    with joined(server, first=json.dumps({"once": server.new_address().partition("#")[2]})) as socket:
        assert heard(socket, "hello")


def test_what_the_system_refuses_in_a_command_is_answered(server: ConsoleServer, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> str:
        raise OSError(errno.EMFILE, "Too many open files", "/home/operator/records")

    for name in ("start", "choose", "open_run", "devices"):
        monkeypatch.setattr(server.station, name, refuse)
    commands = ({"do": "start"}, {"do": "choose", "plan": "x"}, {"do": "open", "run": "x"}, {"do": "devices"})
    with joined(server) as socket:
        for command in commands:
            answer = answered(socket, command)
            assert not answer["ok"]
            assert answer["message"] == "the station's computer refuses it: Too many open files"


def test_a_page_that_floods_the_station_is_closed(server: ConsoleServer, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(console_server, "_MOST_COMMANDS", 20)  # a busy station may take less than the usual 200 within a second
    with joined(server) as socket:
        with suppress(ConnectionClosed):
            for _ in range(2000):
                socket.send('{"do": "live"}')
        assert closing_code(socket) == 1008
    with joined(server) as socket:
        assert heard(socket, "hello")


SECURITY = ("content-security-policy", "x-content-type-options", "x-frame-options", "referrer-policy", "cross-origin-resource-policy")


def test_every_refusal_carries_the_security_headers(server: ConsoleServer) -> None:
    upgrade = "Upgrade: websocket\r\nConnection: Upgrade\r\n"
    key = "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
    ours = f"Host: 127.0.0.1:{server.port}\r\nOrigin: http://127.0.0.1:{server.port}\r\n"
    version = "Sec-WebSocket-Version: 13\r\n"
    cases = {
        f"GET /live HTTP/1.1\r\nHost: evil.example\r\n{upgrade}{key}{version}\r\n": 400,
        f"GET /live HTTP/1.1\r\nHost: 127.0.0.1:{server.port}\r\nOrigin: null\r\n{upgrade}{key}{version}\r\n": 403,
        f"GET /elsewhere HTTP/1.1\r\n{ours}{upgrade}{key}{version}\r\n": 403,
        f"GET /live HTTP/1.1\r\n{ours}{upgrade}{version}\r\n": 400,
        f"GET /live HTTP/1.1\r\n{ours}{upgrade}{key}Sec-WebSocket-Version: 7\r\n\r\n": 400,
        f"GET /live HTTP/1.1\r\n{ours}{upgrade}{key}{version}\r\n": 101,
        f"GET /nowhere HTTP/1.1\r\n{ours}\r\n": 404,
        f"POST / HTTP/1.1\r\n{ours}Content-Length: 0\r\n\r\n": 405,
        f"GET /export/x HTTP/1.1\r\n{ours}\r\n": 401,
        "GET / HTTP/1.1\r\n\r\n": 400,
        "no request at all\r\n\r\n": 400,
        "GET / HTTP/1.1\r\n" + "x" * 40_000: 400,
    }
    for request, status in cases.items():
        with create_connection(("127.0.0.1", server.port), timeout=10) as caller:
            caller.sendall(request.encode())
            answer = http.client.HTTPResponse(caller)
            answer.begin()
        assert answer.status == status, request
        for name in SECURITY:
            assert answer.headers.get_all(name) is not None, (request[:60], name)
            assert len(answer.headers.get_all(name) or []) == 1


def test_message_too_large_is_refused(server: ConsoleServer) -> None:
    with joined(server) as socket:
        socket.send('{"do": "' + "x" * 100_000 + '"}')
        assert closing_code(socket) == 1009


@pytest.mark.parametrize(
    ("command", "says"),
    [
        ("no json", "no command"),
        ("[1, 2]", "no command"),
        ({"do": "format"}, "no command 'format'"),
        ({"do": ["start"]}, "no command"),
        ({"do": "choose"}, "needs a text 'plan'"),
        ({"do": "choose", "plan": "../../etc/passwd"}, "there is no plan"),
        ({"do": "choose", "plan": "/etc/passwd"}, "there is no plan"),
        ({"do": "acknowledge", "alarm": "all"}, "needs a whole number"),
        ({"do": "enter", "serial_number": "x" * 500}, "at most 120 characters"),
        ({"do": "enter", "operator": "a\u0000b"}, "printable"),
        ({"do": "start"}, "choose a plan first"),
        ({"do": "abort"}, "nothing is being measured"),
        ({"do": "end"}, "nothing is being measured"),
        ({"do": "open", "run": "../../station"}, "keeps no records"),
        ({"do": "replay", "run": 7}, "needs a text 'run'"),
    ],
)
def test_command_that_makes_no_sense_is_answered_in_words(server: ConsoleServer, command: Any, says: str) -> None:
    with joined(server) as socket:
        answer = answered(socket, command)
    assert answer["ok"] is False
    assert says in answer["message"]


def test_export_needs_the_token(server: ConsoleServer) -> None:
    assert got(server, "/export/last").status == 401
    assert got(server, "/export/last", Authorization="Bearer guess").status == 401
    assert got(server, "/export/last", Authorization=f"Bearer {TOKEN}").status == 404
    assert got(server, "/export/..%2f..%2fetc", Authorization=f"Bearer {TOKEN}").status == 404


def test_pages_are_limited_in_number(server: ConsoleServer) -> None:
    with ExitStack() as open_ones:
        for _ in range(16):
            open_ones.enter_context(joined(server)).recv(timeout=10)
        with joined(server) as one_more:
            assert closing_code(one_more) == 1013


def test_server_is_bound_to_this_machine_alone(server: ConsoleServer) -> None:
    assert server._socket.getsockname()[0] == "127.0.0.1"
    assert not server.remote
    address = server.new_address()
    assert address.startswith(f"http://127.0.0.1:{server.port}/#")
    assert TOKEN not in address


def test_open_server_takes_addresses_but_no_foreign_names(tmp_path: Path) -> None:
    server = ConsoleServer(Station(setup_of({}, Device().connect)), "test", Access("0.0.0.0", unencrypted=True), token=TOKEN)
    server.start()
    assert server.remote
    assert got(server, "/", Host=f"192.0.2.7:{server.port}").status == 200
    assert got(server, "/", Host=f"[2001:db8::7]:{server.port}").status == 200
    assert got(server, "/", Host=f"evil.example:{server.port}").status == 400
    assert got(server, "/", Host="192.0.2.7:1").status == 400
    server.stop()


def heard(socket: ClientConnection, kind: str, times: int = 1) -> dict[str, Any]:
    """The message of a kind, after so many of them."""
    while True:
        message = socket.recv(timeout=10)
        if isinstance(message, str) and (content := json.loads(message))["type"] == kind:
            times -= 1
            if not times:
                return dict(content)


def test_pages_hear_of_the_station_while_a_command_and_the_folder_of_plans_take_long(tmp_path: Path) -> None:
    """Nothing that the event loop does waits for a plan that is checked, or for a folder that does not answer."""
    released, listing, checking = threading.Event(), threading.Event(), threading.Event()
    plan = write_plan(tmp_path)
    blocked = [False]

    def plans() -> dict[str, Path]:
        if blocked[0]:
            (listing if threading.current_thread().name == "plans" else checking).set()
            assert released.wait(60.0)
        return {"blade.yaml": plan}

    station = Station(replace(setup_of({}, Device().connect), plans=plans))
    server = ConsoleServer(station, "test", token=TOKEN)
    server.start()
    try:
        with joined(server) as page, joined(server) as other:
            blocked[0] = True
            page.send(json.dumps({"do": "choose", "plan": "blade.yaml", "number": 1}))
            assert checking.wait(20.0)
            assert listing.wait(20.0)
            for socket in (page, other):
                heard(socket, "alive", times=3)
            assert answered(other, {"do": "live"})["ok"]
            blocked[0] = False
            released.set()
            assert heard(page, "answer")["ok"]
    finally:
        released.set()
        server.stop()


def test_every_connection_begins_with_a_hello_and_everything(server: ConsoleServer) -> None:
    """What a page knows ends with its connection, on both sides: the hello says so, and all of it follows."""
    kinds = ("hello", "control", "station", "results", "alarms", "run", "characteristics", "history", "found", "ct")
    heard_of = []
    for _ in range(2):
        with joined(server) as socket:
            heard_of.append([json.loads(socket.recv(timeout=10)) for _ in kinds])
    assert [[message["type"] for message in messages] for messages in heard_of] == [list(kinds)] * 2
    assert heard_of[0][1:] == heard_of[1][1:]


def test_points_of_another_run_are_another_generation_for_the_page(server: ConsoleServer, tmp_path: Path) -> None:
    """Every view numbers its generations from 0: what the page drew of one run must not stay under the next."""
    plan = load_plan(write_plan(tmp_path))
    context = RunContext("1", "", profile_of(plan), plan.zone, 0.95, 1000, datetime(2026, 11, 22, 12))
    kinds: list[tuple[int, int]] = []
    with joined(server) as socket:
        for expected in (2, 4):
            server.station.show(RunView(context, monotonic, datetime.now))
            while len(kinds) < expected:
                message = socket.recv(timeout=10)
                if isinstance(message, bytes):
                    kinds.append(struct.unpack("<2I", message[:8]))
    assert kinds == [(NOMINAL, 0), (POINTS, 1), (NOMINAL, 0), (POINTS, 2)]


def test_page_that_cannot_be_shown_is_closed_to_connect_again(server: ConsoleServer, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken() -> float:
        raise ValueError("no time")

    with joined(server) as socket:
        heard(socket, "alive")
        monkeypatch.setattr(server.station, "now_ms", broken)
        assert closing_code(socket) == 1011
    monkeypatch.undo()
    assert [alarm.detail for alarm in server.station.alarms.newest_first()] == ["ValueError('no time')"]
    with joined(server) as socket:
        heard(socket, "alive")
