"""Soak: a station as an operator runs it, for as long as asked: a scanner on a socket, the console, its record, and a page.

`python -m tests.integration.soak SECONDS [RATE]` starts `cmmlink console` as a process of its own, opens its one-time address as a
page would, starts a run, and reads everything that the page is sent, while a scanner of this file's own sends RATE points a second in
the counted binary format. Prints, at every sample, what the station holds in memory and what it says; at the end what was sent, received
and lost, the latency, and whether the record holds every point. Exit status 1 where a point is missing.
"""

import json
import platform
import re
import socket
import sqlite3
import struct
import subprocess
import sys
import tempfile
import threading
import time
from binascii import crc32, crc_hqx
from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
from websockets import Origin
from websockets.sync.client import ClientConnection, connect

from tests.cmmlink.oval_part import oval_points, write_nominal

BLOCK = 100  # points
AFTER_S = 1200.0  # the longest that a station may take to finish, record and answer when the scan is over
ROOT = Path(__file__).resolve().parents[2]
PLAN = """\
part: {{name: soak, serial_number: 1}}
nominal: {{file: oval.yaml}}
tolerance: {{lower_mm: -0.05, upper_mm: 0.05}}
device: {{type: serial, format: binary, address: "{address}"}}
registration: {{datum: {{}}}}
"""


class Scanner:
    """Sends points around the oval, with one of a thousand at 0.03 mm, in blocks, at its rate by the clock; counts what it sent."""

    def __init__(self, rate_hz: float, seconds: float) -> None:
        self.rate_hz, self.total = rate_hz, int(rate_hz * seconds) // BLOCK * BLOCK
        self.sent, self.latest_s, self.done = 0, 0.0, threading.Event()
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.address = f"127.0.0.1:{self._listener.getsockname()[1]}"
        threading.Thread(target=self._serve, daemon=True).start()

    def _serve(self) -> None:
        while self.sent < self.total:
            link, _ = self._listener.accept()
            with link:
                if link.recv(1):  # a device test connects and asks as well
                    self._scan(link)
        self._listener.close()

    def _scan(self, link: socket.socket) -> None:
        units = np.column_stack([np.rint(oval_points(0.01) * 1e5), np.zeros(360)]).astype("<i4")
        link.sendall(_frame(0, struct.pack("<IQ", 7, self.total)))
        began_s = time.monotonic()
        for first in range(0, self.total, BLOCK):
            due_s = began_s + (first + BLOCK) / self.rate_hz
            if (wait_s := due_s - time.monotonic()) > 0:
                time.sleep(wait_s)
            self.latest_s = max(self.latest_s, -wait_s)
            link.sendall(_block(first, int(1e6 * first / self.rate_hz), units[np.arange(first, first + BLOCK) % 360]))
            self.sent += BLOCK
        link.sendall(_frame(3, struct.pack("<Q4x", self.total)))
        self.done.set()
        link.recv(1)  # until the station has closed


def _frame(kind: int, payload: bytes) -> bytes:
    head = struct.pack("<BBBBHI", 0xA5, 0x5A, kind, 0, 0, 0) + payload
    return head + struct.pack("<H", crc_hqx(head, 0xFFFF))


def _block(seq: int, t_us: int, units: np.ndarray[tuple[int, int], np.dtype[np.int32]]) -> bytes:
    head = struct.pack("<BBHIQ", 0xA5, 0x5B, len(units), seq & 0xFFFFFFFF, t_us)
    head += struct.pack("<H", crc_hqx(head, 0xFFFF))
    points = np.zeros(len(units), dtype=[("dt", "<u4"), ("xyz", "<i4", 3), ("flags", "<u2")])
    points["dt"], points["xyz"] = np.arange(len(units)), units
    body = head + points.tobytes()
    return body + struct.pack("<I", crc32(body))


@dataclass
class Page:
    """What a page was told: the newest state of the run, the latency of every message with points, and its bytes."""

    run: dict[str, object] = field(default_factory=dict)
    latency_ms: list[float] = field(default_factory=list)
    waited_ms: list[float] = field(default_factory=list)
    bytes: int = 0
    complaints: list[str] = field(default_factory=list)

    def read(self, live: ClientConnection) -> None:
        """Read until the connection is closed."""
        for message in live:
            self.bytes += len(message)
            if isinstance(message, bytes):
                kind, _, _, _, time_ms, _ = struct.unpack_from("<4I2d", message)
                if kind == 1 and time_ms:
                    self.latency_ms.append(1e3 * time.time() - time_ms)
                continue
            said = json.loads(message)
            if said["type"] == "run" and said["run"]:
                self.run = said["run"]
                if said["run"]["latency_s"] is not None:
                    self.waited_ms.append(1e3 * said["run"]["latency_s"])
            elif said["type"] == "answer" and not said["ok"]:
                self.complaints.append(said["message"])
            elif said["type"] == "alarms":
                self.complaints += [f"{alarm['what']}: {alarm['detail']}" for alarm in said["alarms"] if alarm["severity"] == "fault"]


@contextmanager
def console(folder: Path) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """Run the console over a folder of plans; gives the process and its one-time address."""
    command = [sys.executable, "-m", "cmmlink", "console", str(folder), "--port", "0", "--no-browser", "--records", str(folder / "records")]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, cwd=ROOT) as process:
        assert process.stdout is not None
        try:
            for line in process.stdout:
                if found := re.search(r"http://\S+", line):
                    break
            else:
                raise AssertionError("the console gave no address")
            threading.Thread(target=process.stdout.read, daemon=True).start()
            yield process, found[0]
        finally:
            process.terminate()


@contextmanager
def joined(address: str) -> Iterator[ClientConnection]:
    """Open the one-time address as a page does: with its code, which is answered with the token."""
    place, _, code = address.partition("#")
    origin = place.rstrip("/")
    with connect(origin.replace("http", "ws", 1) + "/live", origin=Origin(origin), max_size=None) as live:
        live.send(json.dumps({"once": code.rpartition("=")[2]}))
        yield live


def resident_mb(process: int) -> float:
    """Memory that a process holds now."""
    if sys.platform != "linux":
        return float("nan")
    words = Path(f"/proc/{process}/status").read_text(encoding="ascii")
    found = re.search(r"VmRSS:\s+(\d+) kB", words)
    return int(found[1]) / 1e3 if found else float("nan")


def soak(seconds: float, rate_hz: float) -> int:
    """Run the soak; returns 1 where anything is missing."""
    print(
        f"{datetime.now(UTC):%Y-%m-%d %H:%M} UTC, {platform.machine()} {platform.system()}, Python {platform.python_version()}", flush=True
    )
    with tempfile.TemporaryDirectory() as place:
        folder, scanner, page = Path(place), Scanner(rate_hz, seconds), Page()
        write_nominal(folder / "oval.yaml")
        (folder / "soak.yaml").write_text(PLAN.format(address=scanner.address), encoding="utf-8")
        with console(folder) as (process, address), joined(address) as live:
            threading.Thread(target=page.read, args=(live,), daemon=True).start()
            for number, command in enumerate(({"do": "choose", "plan": "soak.yaml"}, {"do": "start"})):
                time.sleep(3.0)  # the page of an operator, who reads before the next command
                live.send(json.dumps(command | {"number": number}))
            samples = _sample(process.pid, scanner, page, seconds)
            ended_s = time.monotonic()
            while page.run.get("ending") is None and time.monotonic() - ended_s < AFTER_S:
                time.sleep(0.5)
                samples.append((scanner.sent, resident_mb(process.pid)))
            print(f"finished {time.monotonic() - ended_s:.1f} s after the last point; most memory {max(mb for _, mb in samples):.0f} MB")
        return _judge(folder, scanner, page, samples)


def _sample(process: int, scanner: Scanner, page: Page, seconds: float) -> list[tuple[int, float]]:
    """Sample twenty times while the scan goes on."""
    samples: list[tuple[int, float]] = []
    while not scanner.done.wait(max(1.0, seconds / 20)):
        samples.append((scanner.sent, resident_mb(process)))
        lost, received = page.run.get("lost"), page.run.get("received")
        recent = page.latency_ms[-200:] or [float("nan")]
        print(
            f"  sent {scanner.sent:>11,}  received {received!s:>11}  lost {lost}  {samples[-1][1]:7.1f} MB  page {max(recent):6.1f} ms",
            flush=True,
        )
    return [*samples, (scanner.sent, resident_mb(process))]


def _judge(folder: Path, scanner: Scanner, page: Page, samples: list[tuple[int, float]]) -> int:
    with closing(sqlite3.connect(folder / "records" / "station.sqlite")) as connection:
        (kept,) = connection.execute("SELECT sum(count) FROM record WHERE kind = 'points'").fetchone()
        size_mb = sum(path.stat().st_size for path in (folder / "records").iterdir()) / 1e6
    command = [sys.executable, "-m", "cmmlink", "verify", "--records", str(folder / "records")]
    verified = subprocess.run(command, capture_output=True, text=True, check=False, cwd=ROOT)
    facts = {key: page.run.get(key) for key in ("received", "judged", "rejected", "lost", "stalls", "buffer_peak", "ending")}
    verdict = page.run.get("verdict")
    scan = [sample for at, sample in enumerate(samples) if not at or sample[0] > samples[at - 1][0]]  # while points were sent
    half = scan[len(scan) // 2 :]
    growth = (half[-1][1] - half[0][1]) * 1e6 / max(1, half[-1][0] - half[0][0])
    print(f"sent {scanner.sent:,} points, the latest {1e3 * scanner.latest_s:.0f} ms after it was due; the page says {facts}, {verdict}")
    print(f"record: {kept:,} points, {size_mb:.0f} MB; verify ends with {verified.returncode}: {verified.stdout.strip()[:60]}")
    first_mb, last_mb = samples[0][1], half[-1][1]
    print(f"memory: {first_mb:.0f} MB at first, {last_mb:.0f} MB when the last point came; {growth:.1f} bytes a point in the second half")
    for words, values in (("wire to verdict", page.waited_ms), ("verdict to page", page.latency_ms)):
        p50, p99, most = np.percentile(np.array(values or [float("nan")]), [50, 99, 100])
        print(f"{words}: p50 {p50:.1f}, p99 {p99:.1f}, most {most:.1f} ms of {len(values)} messages")
    print(f"read by the page: {page.bytes / 1e6:.0f} MB")
    print("complaints:", "; ".join(dict.fromkeys(page.complaints)) or "none")
    whole = facts["received"] == facts["judged"] == kept == scanner.sent == scanner.total and facts["lost"] == 0
    return 0 if whole and verified.returncode == 0 and facts["ending"] == "complete" else 1


if __name__ == "__main__":
    sys.exit(soak(float(sys.argv[1]), float(sys.argv[2]) if len(sys.argv) > 2 else 10_000.0))
