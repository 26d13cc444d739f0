"""The command `console` as a process of its own: its addresses, its end."""

import json
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from websockets import Origin
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from ..command import cmmlink
from .played import UNREAD, write_plan

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="ends the process as Ctrl-C does, which needs POSIX signals")


@contextmanager
def started(folder: Path, *arguments: str, browser: str = "") -> Iterator[subprocess.Popen[str]]:
    """The command with a home of its own, and without a browser unless one is given."""
    own = {name: str(folder / "home") for name in ("HOME", "XDG_DATA_HOME")} | ({"BROWSER": browser} if browser else {})
    options = [] if browser else ["--no-browser"]
    command = [sys.executable, "-m", "cmmlink", "console", *options, "--records", str(folder / "records"), *arguments]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env={**os.environ, **own}) as process:
        try:
            yield process
        finally:
            process.kill()


def told_address(process: subprocess.Popen[str]) -> str:
    assert process.stderr is not None
    words = process.stderr.readline().split()
    assert words[0] == "console:", words
    return words[1]


def opens(address: str) -> bool:
    """Whether an address opens a page."""
    place, _, code = address.partition("/#")
    with connect(place.replace("http", "ws", 1) + "/live", origin=Origin(place), max_queue=UNREAD) as socket:
        socket.send(json.dumps({"once": code}))
        try:
            return bool(json.loads(socket.recv(timeout=20))["type"] == "admitted")
        except ConnectionClosed:
            return False


def test_console_serves_its_page_until_it_is_interrupted_and_keeps_no_token(tmp_path: Path) -> None:
    write_plan(tmp_path)
    with started(tmp_path, "--port", "0", str(tmp_path)) as process:
        address = told_address(process)
        assert urlsplit(address).hostname == "127.0.0.1"
        assert opens(address)
        assert not opens(address)
        assert process.stdin is not None
        process.stdin.write("\n")
        process.stdin.flush()
        second = told_address(process)
        assert opens(second)
        process.stdin.write("\nnew\n")
        process.stdin.flush()
        third, fourth = told_address(process), told_address(process)
        assert len({address, second, third, fourth}) == 4
        assert not opens(third)
        assert opens(fourth)
        process.send_signal(signal.SIGINT)
        assert process.wait(20) == 0
        assert process.stderr is not None
        assert process.stderr.read() == ""
    assert [path.name for path in (tmp_path / "home").rglob("*") if "token" in path.name] == []


def test_the_browser_is_given_an_address_of_its_own_and_never_the_token(tmp_path: Path) -> None:
    write_plan(tmp_path)
    told = tmp_path / "told"
    browser = tmp_path / "browser.sh"
    browser.write_text(f'#!/bin/sh\necho "$1" >> {told}.part && mv {told}.part {told}\n', encoding="ascii")
    browser.chmod(0o755)
    with started(tmp_path, "--port", "0", str(tmp_path), browser=f"{browser} %s") as process:
        printed = told_address(process)
        until_s = time.monotonic() + 20.0
        while not told.exists() and time.monotonic() < until_s:
            time.sleep(0.05)
        given = told.read_text(encoding="ascii").strip()
        assert given.partition("#")[0] == printed.partition("#")[0]
        assert given != printed
        assert opens(given)
        assert not opens(given)
        assert opens(printed)


def test_port_that_is_taken_is_told_without_a_traceback(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        with started(tmp_path, "--port", str(port), str(tmp_path)) as second:
            assert second.wait(20) == 2
            assert second.stderr is not None
            said = second.stderr.read()
    assert said.startswith(f"cmmlink: the console cannot be served at 127.0.0.1:{port} (")
    assert "choose another with --host and --port" in said
    assert "Traceback" not in said


def test_folder_that_is_missing_is_told(tmp_path: Path) -> None:
    assert cmmlink("console", tmp_path / "nowhere").refused().startswith(f"{tmp_path / 'nowhere'}: there is no such folder")


def test_console_is_opened_to_the_network_only_when_asked_twice(tmp_path: Path) -> None:
    for host in ("0.0.0.0", "", "::"):
        assert cmmlink("console", "--host", host, "--port", 0, "--no-browser", tmp_path).refused().startswith("--host ")
    with started(tmp_path, "--host", "0.0.0.0", "--unencrypted", "--port", "0", str(tmp_path)) as process:
        assert told_address(process).startswith("http://127.0.0.1:")
        assert process.stderr is not None
        assert process.stderr.readline().startswith("WARNING: the console is open to the network, unencrypted")


def test_encrypted_console_tells_its_fingerprint(tmp_path: Path) -> None:
    data = Path(__file__).parent / "data"
    with_key = ("--certificate", str(data / "certificate.pem"), "--key", str(data / "key.pem"))
    with started(tmp_path, "--host", "0.0.0.0", *with_key, "--port", "0", str(tmp_path)) as process:
        assert told_address(process).startswith("https://127.0.0.1:")
        assert process.stderr is not None
        fingerprint = (data / "fingerprint.txt").read_text(encoding="ascii").strip()
        assert process.stderr.readline() == f"certificate: SHA-256 {fingerprint}\n"
    assert cmmlink("console", "--key", data / "key.pem", tmp_path).refused().startswith("--key belongs to a certificate")
