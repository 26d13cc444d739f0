"""The command `console` as a process of its own: its address, its token, its end."""

import http.client
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from urllib.parse import urlsplit

import pytest

from cmmlink.console.launch import kept_token

from .played import write_plan

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="ends the process as Ctrl-C does, which needs POSIX signals")


@contextmanager
def started(folder: Path, *arguments: str) -> Iterator[subprocess.Popen[str]]:
    """The command with a home of its own."""
    home = {name: str(folder / "home") for name in ("HOME", "XDG_DATA_HOME")}
    command = [sys.executable, "-m", "cmmlink", "console", "--no-browser", "--records", str(folder / "records"), *arguments]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env={**os.environ, **home}) as process:
        try:
            yield process
        finally:
            process.kill()


def told_address(process: subprocess.Popen[str]) -> str:
    assert process.stderr is not None
    words = process.stderr.readline().split()
    assert words[0] == "console:", words
    return words[1]


def test_console_serves_its_page_until_it_is_interrupted_and_keeps_its_token(tmp_path: Path) -> None:
    write_plan(tmp_path)
    tokens = []
    for _ in range(2):
        with started(tmp_path, "--port", "0", str(tmp_path)) as process:
            address = urlsplit(told_address(process))
            assert address.hostname == "127.0.0.1"
            assert len(address.fragment) >= 32
            tokens.append(address.fragment)
            connection = http.client.HTTPConnection("127.0.0.1", address.port, timeout=20)
            connection.request("GET", "/")
            assert connection.getresponse().status == 200
            connection.close()
            process.send_signal(signal.SIGINT)
            assert process.wait(20) == 0
            assert process.stderr is not None
            assert process.stderr.read() == ""
    assert tokens[0] == tokens[1]


def test_port_that_is_taken_is_told_without_a_traceback(tmp_path: Path) -> None:
    with started(tmp_path, "--port", "0", str(tmp_path)) as first:
        port = urlsplit(told_address(first)).port
        with started(tmp_path, "--port", str(port), str(tmp_path)) as second:
            assert second.wait(20) == 2
            assert second.stderr is not None
            said = second.stderr.read()
    assert said.startswith(f"cmmlink: the console cannot be served at 127.0.0.1:{port} (")
    assert "choose another with --host and --port" in said
    assert "Traceback" not in said


def test_folder_that_is_missing_is_told(tmp_path: Path) -> None:
    with started(tmp_path, str(tmp_path / "nowhere")) as process:
        assert process.wait(20) == 2
        assert process.stderr is not None
        assert process.stderr.read().startswith(f"cmmlink: {tmp_path / 'nowhere'}: there is no such folder")


def test_token_is_kept_and_readable_by_its_owner_alone(tmp_path: Path) -> None:
    folder = tmp_path / "data"
    token = kept_token(folder)
    assert len(token) >= 32
    assert kept_token(folder) == token
    assert (folder / "console-token").stat().st_mode & 0o077 == 0
    (folder / "console-token").write_text("short", encoding="ascii")
    assert len(kept_token(folder)) >= 32
    assert kept_token(tmp_path / "other") != token


def test_console_open_to_the_network_warns(tmp_path: Path) -> None:
    with started(tmp_path, "--host", "0.0.0.0", "--port", "0", str(tmp_path)) as process:
        assert told_address(process).startswith("http://127.0.0.1:")
        assert process.stderr is not None
        assert process.stderr.readline().startswith("WARNING: the console is open to the network")
