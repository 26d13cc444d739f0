"""A PostgreSQL server of a test's own: on a free port of this computer's loopback, with its data in a temporary folder.

Debian's package brings it. The server refuses to run as root, which then becomes the user `postgres`.
"""

import os
import shutil
import signal
import socket
import subprocess
import tempfile
from contextlib import suppress
from pathlib import Path

# Nothing has to outlive the computer: a test waits for no disk.
_QUICK = ("fsync=off", "synchronous_commit=off", "full_page_writes=off", "shared_buffers=16MB", "max_connections=20")


def programs() -> Path | None:
    """The folder of the server's programs, None where there are none."""
    places = sorted(Path("/usr/lib/postgresql").glob("*/bin"), reverse=True)
    found = shutil.which("initdb")
    places += [Path(found).resolve().parent] if found else []
    return next((place for place in places if (place / "initdb").exists() and (place / "postgres").exists()), None)


class PostgresServer:
    """A server that can be killed and started again. `quick` gives up what only a power cut needs."""

    def __init__(self, quick: bool = True) -> None:
        found = programs()
        assert found is not None, "there is no PostgreSQL here"
        self._programs, self._quick = found, quick
        self._folder = Path(tempfile.mkdtemp(prefix="cmmlink-postgres-", dir="/tmp"))
        self._server: subprocess.Popen[bytes] | None = None
        self.port = _free_port()
        if self._user is not None:
            shutil.chown(self._folder, self._user)
        self._run("initdb", "--auth=trust", "--username=cmm", "--no-sync", "--encoding=UTF8", "--locale=C", f"--pgdata={self._data}")
        self.start()

    @property
    def address(self) -> str:
        """The address of its database."""
        return f"postgresql://cmm@127.0.0.1:{self.port}/postgres"

    @property
    def _data(self) -> Path:
        return self._folder / "data"

    @property
    def _user(self) -> str | None:
        return "postgres" if hasattr(os, "geteuid") and os.geteuid() == 0 else None

    def start(self) -> None:
        """Start it, and wait until it answers."""
        settings = [f"port={self.port}", "listen_addresses=127.0.0.1", "unix_socket_directories="]
        settings += _QUICK if self._quick else []
        options = [word for setting in settings for word in ("-c", setting)]
        log = (self._folder / "log").open("ab")
        with log:
            command = [str(self._programs / "postgres"), "-D", str(self._data), *options]
            self._server = subprocess.Popen(command, stdout=log, stderr=log, user=self._user, cwd=self._folder, start_new_session=True)
        self._run("pg_isready", "--quiet", "--host=127.0.0.1", f"--port={self.port}", wait=True)

    def kill(self) -> None:
        """End it without a warning, whichever process started it."""
        number = int((self._data / "postmaster.pid").read_text().split()[0])
        with suppress(ProcessLookupError):
            os.kill(number, signal.SIGKILL)
        if self._server is not None:
            self._server.wait()
        (self._data / "postmaster.pid").unlink()  # its parent, if another process, may not have noticed yet
        self._server = None

    def close(self) -> None:
        """End it, and remove its data."""
        with suppress(FileNotFoundError):
            self.kill()
        shutil.rmtree(self._folder, ignore_errors=True)

    def query(self, text: str) -> str:
        """What a query gives, by PostgreSQL's own program: not through the library that is tested."""
        words = ["psql", "--host=127.0.0.1", f"--port={self.port}", "--username=cmm", "--no-align", "--tuples-only", "--command", text]
        return self._run(*words, "postgres").strip()

    def _run(self, program: str, *words: str, wait: bool = False) -> str:
        """Run one of its programs; with `wait` until it succeeds."""
        while True:
            ended = subprocess.run(
                [str(self._programs / program), *words], capture_output=True, text=True, user=self._user, cwd=self._folder, check=False
            )
            if ended.returncode == 0:
                return ended.stdout
            assert wait, ended.stderr
            assert self._server is None or self._server.poll() is None, (self._folder / "log").read_text()


def _free_port() -> int:
    with socket.socket() as listening:
        listening.bind(("127.0.0.1", 0))
        return int(listening.getsockname()[1])
