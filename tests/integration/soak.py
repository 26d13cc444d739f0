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
MOST_GROWTH_MB = 16.0  # of the station's own memory, from the end of the first quarter of the scan to its last point
MOST_FILES_MB = 256.0  # of files that are in memory: code of libraries, and the newest rows of a scan
SLOWER = 3.0  # times as long as in the first tenth half the verdicts of the last may take, and
SLOWER_MS = 3.0  # so much longer on top: the machine does other work as well
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
    waited_at: list[int] = field(default_factory=list)  # points received, of each of these
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
                    self.waited_at.append(said["run"]["received"])
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


@dataclass(frozen=True, slots=True)
class Sample:
    """What a station held when so many points had been sent: memory of its own, and of files that are mapped into it, in MB."""

    sent: int
    own_mb: float
    files_mb: float


def sample_of(process: int, sent: int) -> Sample:
    """What a process holds now. NaN on systems that do not tell."""
    if sys.platform != "linux":
        return Sample(sent, float("nan"), float("nan"))
    words = Path(f"/proc/{process}/smaps_rollup").read_text(encoding="ascii")
    held, own = (int(re.findall(rf"^{name}:\s+(\d+) kB", words, re.M)[0]) / 1e3 for name in ("Rss", "Anonymous"))
    return Sample(sent, own, held - own)


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
                samples.append(sample_of(process.pid, scanner.sent))
            most_mb = max(sample.own_mb for sample in samples)
            print(f"finished {time.monotonic() - ended_s:.1f} s after the last point; most memory of its own {most_mb:.0f} MB")
        return _judge(folder, scanner, page, samples)


def _sample(process: int, scanner: Scanner, page: Page, seconds: float) -> list[Sample]:
    """Sample forty times while the scan goes on."""
    samples: list[Sample] = []
    while not scanner.done.wait(max(1.0, seconds / 40)):
        samples.append(sample_of(process, scanner.sent))
        lost, received = page.run.get("lost"), page.run.get("received")
        waited, drawn = (max(values[-200:] or [float("nan")]) for values in (page.waited_ms, page.latency_ms))
        print(
            f"  sent {scanner.sent:>11,}  received {received!s:>11}  lost {lost}  own {samples[-1].own_mb:6.1f} MB  "
            f"files {samples[-1].files_mb:6.1f} MB  verdict {waited:6.1f} ms  page {drawn:6.1f} ms",
            flush=True,
        )
    return [*samples, sample_of(process, scanner.sent)]


def _tell_memory(samples: list[Sample]) -> bool:
    """Print what the station held while points were sent; False where that grew."""
    scan = [sample for at, sample in enumerate(samples) if sample.sent and (not at or sample.sent > samples[at - 1].sent)]
    later = [sample for sample in scan if sample.sent >= scan[-1].sent / 4]
    growth_mb = max(sample.own_mb for sample in later) - later[0].own_mb
    files_mb = max(sample.files_mb for sample in scan)
    told = ", ".join(f"{sample.own_mb:.1f} MB at {sample.sent:,} points" for sample in (scan[0], later[0], later[-1]))
    print(f"own memory: {told}; grown by at most {growth_mb:.1f} MB since the first quarter; of files at most {files_mb:.0f} MB in memory")
    return not (growth_mb > MOST_GROWTH_MB or files_mb > MOST_FILES_MB)


def _tell_tenths(page: Page, total: int) -> bool:
    """Print how long verdicts took in the first and in the last tenth of the scan; False where they became slower."""
    waited, at = np.array(page.waited_ms), np.array(page.waited_at)
    halves = []
    for words, part in (("first", waited[at <= total / 10]), ("last", waited[(at >= total * 9 / 10) & (at < total)])):
        p50, p99, most = np.percentile(part if len(part) else np.array([float("nan")]), [50, 99, 100])
        print(f"wire to verdict in the {words} tenth: p50 {p50:.2f}, p99 {p99:.1f}, most {most:.1f} ms of {len(part)}")
        halves.append(p50)
    return bool(halves[1] <= SLOWER * halves[0] + SLOWER_MS)


def _judge(folder: Path, scanner: Scanner, page: Page, samples: list[Sample]) -> int:
    with closing(sqlite3.connect(folder / "records" / "station.sqlite")) as connection:
        (kept,) = connection.execute("SELECT sum(count) FROM record WHERE kind = 'points'").fetchone()
        size_mb = sum(path.stat().st_size for path in (folder / "records").iterdir()) / 1e6
    command = [sys.executable, "-m", "cmmlink", "verify", "--records", str(folder / "records")]
    verified = subprocess.run(command, capture_output=True, text=True, check=False, cwd=ROOT)
    facts = {key: page.run.get(key) for key in ("received", "judged", "rejected", "lost", "stalls", "buffer_peak", "ending")}
    verdict = page.run.get("verdict")
    print(f"sent {scanner.sent:,} points, the latest {1e3 * scanner.latest_s:.0f} ms after it was due; the page says {facts}, {verdict}")
    print(f"record: {kept:,} points, {size_mb:.0f} MB; verify ends with {verified.returncode}: {verified.stdout.strip()[:60]}")
    is_flat, is_quick = _tell_memory(samples), _tell_tenths(page, scanner.total)
    for words, values in (("wire to verdict", page.waited_ms), ("verdict to page", page.latency_ms)):
        p50, p99, most = np.percentile(np.array(values or [float("nan")]), [50, 99, 100])
        print(f"{words}: p50 {p50:.1f}, p99 {p99:.1f}, most {most:.1f} ms of {len(values)} messages")
    print(f"read by the page: {page.bytes / 1e6:.0f} MB")
    print("complaints:", "; ".join(dict.fromkeys(page.complaints)) or "none")
    whole = facts["received"] == facts["judged"] == kept == scanner.sent == scanner.total and facts["lost"] == 0
    is_kept = whole and verified.returncode == 0 and facts["ending"] == "complete"
    print(f"whole: {is_kept}; memory flat: {is_flat}; verdicts as quick as at first: {is_quick}")
    return 0 if is_kept and is_flat and is_quick else 1


if __name__ == "__main__":
    sys.exit(soak(float(sys.argv[1]), float(sys.argv[2]) if len(sys.argv) > 2 else 10_000.0))
