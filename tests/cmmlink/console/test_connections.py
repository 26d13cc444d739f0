"""Strangers cannot take the station away from its page: counter-parties on real sockets, with time limits made short."""

import asyncio
import http.client
import json
import os
import socket
import ssl
import struct
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

import pytest
import uvicorn
from websockets import Origin
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect

from cmmlink.console import connections, open_page
from cmmlink.console import server as console_server
from cmmlink.console.listening import Access
from cmmlink.console.server import ConsoleServer
from cmmlink.console.station import Station

from .played import UNREAD, Device, setup_of, write_plan

TOKEN = "a-token-for-this-test-of-32-characters"
DATA = Path(__file__).parent / "data"
HALF = b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n"
Attack = Callable[[int], socket.socket]


@contextmanager
def served(folder: Path, access: Access | None = None) -> Iterator[ConsoleServer]:
    server = ConsoleServer(Station(setup_of({"blade.yaml": write_plan(folder)}, Device().connect)), "test", access, token=TOKEN)
    server.start()
    try:
        yield server
    finally:
        server.stop()


@contextmanager
def page(server: ConsoleServer) -> Iterator[ClientConnection]:
    """A page that is let in and has heard its hello."""
    with connect(f"ws://127.0.0.1:{server.port}/live", origin=Origin(f"http://127.0.0.1:{server.port}"), max_queue=UNREAD) as joined:
        joined.send(json.dumps({"token": TOKEN}))
        assert json.loads(joined.recv(timeout=10))["type"] == "hello"
        yield joined


def got(port: int) -> int:
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=10)
    connection.request("GET", "/")
    status = connection.getresponse().status
    connection.close()
    return status


def ends(caller: socket.socket, within_s: float) -> bool:
    """Whether the station ends the connection in time, whatever it says before."""
    caller.settimeout(within_s)
    try:
        while caller.recv(65536):
            pass
    except TimeoutError:
        return False
    except OSError:
        pass
    return True


def is_cut_off(caller: socket.socket, words: bytes, pause_s: float) -> bool:
    """Whether the station ends the connection while the same words are said again and again, for 20 s."""
    caller.settimeout(20.0)
    until_s = time.monotonic() + 20.0
    while time.monotonic() < until_s:
        try:
            caller.sendall(words)
        except TimeoutError:
            return False
        except OSError:
            return True
        time.sleep(pause_s)
    return False


def caller_that_says(port: int, words: bytes) -> socket.socket:
    caller = socket.create_connection(("127.0.0.1", port), timeout=10)
    with suppress(OSError):  # it may be turned out already
        caller.sendall(words)
    return caller


def silence(port: int) -> socket.socket:
    return caller_that_says(port, b"")


def half_request(port: int) -> socket.socket:
    return caller_that_says(port, HALF)


def body_that_never_comes(port: int) -> socket.socket:
    return caller_that_says(port, f"POST /export/x HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nContent-Length: 1000000\r\n\r\nx".encode())


def socket_without_token(port: int) -> socket.socket:
    own = f"127.0.0.1:{port}"
    caller = caller_that_says(
        port,
        f"GET /live HTTP/1.1\r\nHost: {own}\r\nOrigin: http://{own}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
        "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n\r\n".encode(),
    )
    with suppress(OSError):
        caller.recv(4096)
    return caller


ATTACKS = (silence, half_request, socket_without_token, body_that_never_comes)


@pytest.mark.parametrize("attack", ATTACKS, ids=lambda attack: attack.__name__)
def test_hundreds_of_strangers_leave_the_station_to_its_page(attack: Attack, tmp_path: Path) -> None:
    with served(tmp_path) as server, page(server) as open_page, ExitStack() as strangers:
        for _ in range(200):
            strangers.enter_context(attack(server.port))
        assert got(server.port) == 200
        with page(server):
            pass
        open_page.send(json.dumps({"do": "live", "number": 7}))
        while json.loads(open_page.recv(timeout=10)).get("number") != 7:
            pass
        assert len(server._server._strangers) <= connections._MOST_STRANGERS


def test_a_station_with_few_files_to_open_keeps_some_for_the_measurement(tmp_path: Path) -> None:
    """The same in a process that may open 192 files: strangers take none of those that a run needs."""
    if sys.platform == "win32":
        pytest.skip("Windows has no such limit")
    write_plan(tmp_path)
    program = (
        "import resource, sys; resource.setrlimit(resource.RLIMIT_NOFILE, (192, 192));"
        "from cmmlink.commands import main; sys.argv = ['cmmlink', 'console', '--no-browser', '--port', '0', sys.argv[1]]; main()"
    )
    environment = {**os.environ, "HOME": str(tmp_path / "home"), "XDG_DATA_HOME": str(tmp_path / "home")}
    command = [sys.executable, "-c", program, str(tmp_path)]
    with subprocess.Popen(command, stdin=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, env=environment) as process:
        try:
            assert process.stderr is not None
            port = int(process.stderr.readline().partition("/#")[0].rpartition(":")[2])
            with ExitStack() as opened:
                strangers = [opened.enter_context(half_request(port)) for _ in range(400)]
                deadline_s = time.monotonic() + 20.0
                while sum(map(is_turned_out, strangers)) < 400 - 64 and time.monotonic() < deadline_s:
                    time.sleep(0.05)
                assert sockets_of(process.pid) <= 64 + 8  # the listening one, the event loop's
                assert got(port) == 200
        finally:
            process.kill()


def test_a_rush_is_let_in_no_faster_than_strangers_are_turned_out(tmp_path: Path) -> None:
    """Those who have called while the station was busy hold for no moment more sockets than the station spares."""
    held: list[int] = []
    with served(tmp_path) as server, page(server), ExitStack() as strangers:
        loop = next(iter(server._server._tasks)).get_loop()
        rushed, before = threading.Event(), sockets_of(os.getpid())

        def count() -> None:
            held.append(sockets_of(os.getpid()))
            if len(held) < 1000:
                loop.call_soon(count)

        loop.call_soon_threadsafe(rushed.wait, 20.0)
        loop.call_soon_threadsafe(count)
        for _ in range(120):  # no more than wait in front of a listening socket
            strangers.enter_context(half_request(server.port))
        rushed.set()
        assert got(server.port) == 200
    assert max(held) <= before + 120 + connections._MOST_STRANGERS + 4


def is_turned_out(caller: socket.socket) -> bool:
    """Whether the station has answered a caller or left it; it says nothing to one that it still waits for."""
    caller.setblocking(False)
    try:
        caller.recv(1, socket.MSG_PEEK)
    except BlockingIOError:
        return False
    except OSError:
        return True
    return True


def sockets_of(process: int) -> int:
    """Sockets that a process holds open, where the system tells (Linux)."""
    folder = Path(f"/proc/{process}/fd")
    if not folder.is_dir():
        return 0
    found = 0
    for link in folder.iterdir():
        try:
            found += os.readlink(link).startswith("socket:")
        except OSError:
            continue
    return found


@pytest.mark.parametrize("attack", ATTACKS, ids=lambda attack: attack.__name__)
def test_a_stranger_is_gone_within_its_time(attack: Attack, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(connections, "_HEAD_WITHIN_S", 0.2)
    monkeypatch.setattr(connections, "_STRANGER_S", 0.4)
    with served(tmp_path) as server, attack(server.port) as caller:
        assert ends(caller, 10.0)


def test_bytes_one_by_one_win_no_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(connections, "_HEAD_WITHIN_S", 0.4)
    with served(tmp_path) as server, silence(server.port) as caller:
        assert is_cut_off(caller, b"x", pause_s=0.02)
        monkeypatch.undo()  # who asks next has the usual time
        assert got(server.port) == 200


def test_a_second_request_over_the_same_connection_has_its_time_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with served(tmp_path) as server, silence(server.port) as caller:
        for _ in range(2):
            caller.sendall(f"GET /icon.svg HTTP/1.1\r\nHost: 127.0.0.1:{server.port}\r\n\r\n".encode())
            answer = http.client.HTTPResponse(caller)
            answer.begin()
            answer.read()
            assert answer.status == 200
            monkeypatch.setattr(connections, "_HEAD_WITHIN_S", 0.4)  # from the second answer on: what is asked before has the usual time
        assert is_cut_off(caller, b"G", pause_s=0.02)


def test_a_page_is_no_stranger_and_stays(tmp_path: Path) -> None:
    with served(tmp_path) as server, silence(server.port), page(server):
        (visitor,) = [page.visitor for page in server._pages]
        assert visitor not in server._server._strangers._staying
        assert visitor._end is None, "no time runs against it"


def test_a_page_that_does_not_read_loses_its_place_and_the_control(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(open_page, "_SENT_WITHIN_S", 0.3)
    monkeypatch.setattr(console_server, "_ALIVE_S", 0.0)
    with served(tmp_path) as server, socket_without_token(server.port) as caller:
        monkeypatch.setattr(console_server, "json_of", lambda _: "7" * 1_000_000)
        body = json.dumps({"token": TOKEN}).encode()
        caller.sendall(bytes([0x81, 0x80 | len(body), 0, 0, 0, 0]) + body)
        assert server.wait_for_page(10.0)
        until_s = time.monotonic() + 20.0
        while server.pages and time.monotonic() < until_s:
            time.sleep(0.05)
        assert server.pages == 0
        assert server._controller is None


def frame(opcode: int, body: bytes = b"", *, final: bool = True) -> bytes:
    return bytes([(0x80 if final else 0) | opcode, 0x80 | len(body), 0, 0, 0, 0]) + body


@pytest.mark.parametrize(
    ("name", "flood"),
    [
        ("a message of endless pieces", frame(0x1, b"x", final=False) + frame(0x0, b"", final=False) * 5000),
        ("a message of large pieces", frame(0x1, b"x", final=False) + frame(0x0, b"y" * 120, final=False) * 200),
        ("no masks", b"\x81\x05hello"),
        ("a kind that is reserved", frame(0x3)),
        ("a ping that is too long", struct.pack("!BBHI", 0x89, 0xFE, 200, 0) + bytes(200)),
        ("no text", frame(0x1, b"\xff\xfe")),
        ("bytes", frame(0x2, b"\0" * 100)),
    ],
)
def test_what_no_browser_sends_ends_the_connection(name: str, flood: bytes, tmp_path: Path) -> None:
    with served(tmp_path) as server:
        with socket_without_token(server.port) as caller:
            with suppress(OSError):
                caller.sendall(flood)
            assert ends(caller, 10.0), name
        assert got(server.port) == 200


def test_pings_that_nobody_reads_the_answers_of_do_not_pile_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(connections, "_MOST_UNSENT", 1 << 20)
    with served(tmp_path) as server, socket_without_token(server.port) as caller:
        assert is_cut_off(caller, frame(0x9, b"x" * 125) * 1000, pause_s=0.0)


def test_encrypted_station_is_reached_with_its_certificate_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    trusting = ssl.create_default_context(cafile=DATA / "certificate.pem")
    access = Access("0.0.0.0", certificate=DATA / "certificate.pem", key=DATA / "key.pem")
    with served(tmp_path, access) as server:
        assert server.new_address().startswith(f"https://127.0.0.1:{server.port}/#")
        own = Origin(f"https://127.0.0.1:{server.port}")
        with connect(f"wss://127.0.0.1:{server.port}/live", ssl=trusting, origin=own, max_queue=UNREAD) as joined:
            joined.send(json.dumps({"token": TOKEN}))
            assert json.loads(joined.recv(timeout=10))["type"] == "hello"
        with half_request(server.port) as plain:
            assert ends(plain, 10.0)
        with ExitStack() as strangers:  # that never begin to agree on an encryption
            for _ in range(100):
                strangers.enter_context(silence(server.port))
            connection = http.client.HTTPSConnection("127.0.0.1", server.port, timeout=10, context=trusting)
            connection.request("GET", "/")
            assert connection.getresponse().status == 200
            connection.close()
            monkeypatch.setattr(connections, "_HEAD_WITHIN_S", 0.4)  # not before: a busy machine takes long to agree on an encryption
            with silence(server.port) as last:
                assert ends(last, 10.0)


def test_a_station_that_ends_closes_whom_it_has_not_welcomed_yet() -> None:
    async def end_at_the_door(listening: socket.socket) -> None:
        server = connections.BoundedServer(uvicorn.Config(lambda _: None), listening, None)
        await server.startup()
        while len(server._tasks) == 1:  # looked at in every turn of the loop: the second task has not begun
            await asyncio.sleep(0)
        for task in tuple(server._tasks):
            task.cancel()
        while server._tasks:
            await asyncio.sleep(0)

    with socket.create_server(("127.0.0.1", 0)) as listening, silence(listening.getsockname()[1]) as caller:
        listening.setblocking(False)
        asyncio.run(end_at_the_door(listening))
        assert ends(caller, 10.0)


def test_the_station_ends_with_strangers_at_its_door(tmp_path: Path) -> None:
    with ExitStack() as strangers:
        with served(tmp_path) as server:
            for attack in ATTACKS:
                for _ in range(10):
                    strangers.enter_context(attack(server.port))
            server.stop()
            server._thread.join(20.0)
            assert not server._thread.is_alive()
        with pytest.raises((OSError, ConnectionClosed)), page(server):
            pass
