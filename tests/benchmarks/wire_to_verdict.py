"""From the last byte of a point on the wire to its verdict event: p50, p99, largest, at 1,000, 10,000 and 50,000 points/s.

Each is measured without anybody looking on and with a page open, which another process reads as fast as it is sent.

    python -m tests.benchmarks.wire_to_verdict

A process of its own sends counted binary frames over TCP loopback, each written when it is due, and notes when it wrote
them; the run reads, decodes, hands over and judges against a known pose. Both read the same monotonic clock, which
Linux and macOS share between processes. Goal: p99 below 10 ms at 10,000 points/s.
"""

import json
import multiprocessing
import platform
import socket
import struct
import sys
import threading
import time
from binascii import crc_hqx
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext, suppress
from multiprocessing.connection import Connection

import numpy as np
from numpy.typing import NDArray
from websockets import Origin
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from cmmlink.console.server import ConsoleServer
from cmmlink.console.station import Station
from cmmlink.events import Event, Judged, RunStarted, Sink
from cmmlink.pipeline import run_inspection
from cmmlink.run_context import RunContext
from cmmlink.run_view import RunView
from drivers.codecs.binary_frames import BinaryDecoder
from drivers.links.link_settings import LinkSettings
from drivers.links.serial_scanner import SerialScanner
from inspection import LiveInspection, NominalProfile, NurbsCurve, RigidTransform, ToleranceZone, discretize
from tests.cmmlink.console.played import Device, setup_of
from tests.cmmlink.recorded import today

SECONDS = 4.0
RATES_HZ = (1_000, 10_000, 50_000)
BUFFER_POINTS = 500_000
ZONE = ToleranceZone(-0.05, 0.05)
WARM_UP = 0.25  # share of the points left out: compilation and caches


def part() -> NurbsCurve:
    turn = np.linspace(0.0, 2.0 * np.pi, 200, endpoint=False)
    return NurbsCurve.interpolate(np.column_stack([40.0 * np.cos(turn) + 4.0 * np.cos(2.0 * turn), 15.0 * np.sin(turn)]), closed=True)


def frames(points_mm: NDArray[np.float64], rate_hz: int) -> list[bytes]:
    made = []
    for index, (x, y) in enumerate(np.round(points_mm * 1e5).astype(int).tolist()):
        body = struct.pack("<2sBBHI3i", b"\xa5\x5a", 1, 0, index % 65536, round(index * 1e6 / rate_hz) % 2**32, x, y, 0)
        made.append(body + struct.pack("<H", crc_hqx(body, 0xFFFF)))
    return made


def latencies_ms(rate_hz: int, looked_at: bool = False) -> NDArray[np.float64]:
    """How long each point took, the first left out. `looked_at`: a page is open."""
    curve = part()
    nominal = discretize(curve)
    count = int(rate_hz * SECONDS)
    points_mm = curve.point(np.linspace(*curve.domain, count, endpoint=False))
    ours, theirs = multiprocessing.Pipe()
    context = multiprocessing.get_context("spawn")
    sender = context.Process(target=serve, args=(frames(points_mm, rate_hz), rate_hz, theirs))
    sender.start()
    port = ours.recv()
    judged_s: list[tuple[float, int]] = []

    def note(event: Event) -> None:
        if isinstance(event, Judged):
            judged_s.append((time.monotonic(), event.counts.judged))

    live = LiveInspection(nominal, ZONE, datum=RigidTransform(0.0, np.zeros(2)), fit="none")
    source = SerialScanner(f"127.0.0.1:{port}", BinaryDecoder(), LinkSettings(115_200, "N", silence_s=30.0))
    started = RunStarted("benchmark", "", "", "TCP", simulated=True)
    with page_of(nominal) if looked_at else nullcontext(()) as shown:
        sinks: list[Sink] = [note, *shown]
        outcome = run_inspection(source, live, sinks, started, buffer_points=BUFFER_POINTS, clock=time.monotonic, stop=threading.Event())
    written_s = ours.recv()
    sender.join()
    assert outcome.counts.judged == count, outcome
    times_s, totals = np.array([t for t, _ in judged_s]), np.array([n for _, n in judged_s])
    verdict_s = times_s[np.searchsorted(totals, np.arange(1, count + 1))]
    return np.asarray((verdict_s - written_s)[int(WARM_UP * count) :] * 1e3)


@contextmanager
def page_of(nominal: NominalProfile) -> Iterator[tuple[Sink]]:
    """What a run is shown by to a page that is open."""
    view = RunView(RunContext("1", "benchmark", nominal, ZONE, 0.95, BUFFER_POINTS, today()), time.monotonic, today)
    station = Station(setup_of({}, Device().connect))
    station.show(view)
    server = ConsoleServer(station, "benchmark")
    server.start()
    page = multiprocessing.get_context("spawn").Process(target=look_on, args=(server.new_address(),))
    page.start()
    try:
        assert server.wait_for_page(30.0)
        yield (view,)
    finally:
        server.stop()
        page.join()


def look_on(address: str) -> None:
    """Read what the page at an address is sent, until it is closed."""
    place, _, code = address.partition("/#")
    with connect(f"{place.replace('http', 'ws')}/live", origin=Origin(place)) as socket, suppress(ConnectionClosed):
        socket.send(json.dumps({"once": code}))
        while True:
            socket.recv()


def serve(made: list[bytes], rate_hz: int, back: Connection) -> None:
    """Serve one client with the frames, each written when it is due."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        back.send(server.getsockname()[1])
        link, _ = server.accept()
    with link:
        link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        link.recv(1)  # the host asks to begin
        written_s, sent, start_s = np.zeros(len(made)), 0, time.monotonic()
        while sent < len(made):
            due = min(len(made), int((time.monotonic() - start_s) * rate_hz))
            if due > sent:
                link.sendall(b"".join(made[sent:due]))
                written_s[sent:due] = time.monotonic()
                sent = due
            time.sleep(min(1e-3, 1.0 / rate_hz))
        total = struct.pack("<2sBBHIQI", b"\xa5\x5a", 3, 0, sent % 65536, 0, sent, 0)
        link.sendall(total + struct.pack("<H", crc_hqx(total, 0xFFFF)))
        back.send(written_s)
        link.recv(1)


if __name__ == "__main__":
    sys.stdout.write(f"wire to verdict, ms, {SECONDS:g} s each; Python {platform.python_version()}, {platform.machine()}\n")
    for rate in RATES_HZ:
        for looked_at in (False, True):
            p50, p99, largest = np.percentile(latencies_ms(rate, looked_at), [50, 99, 100])
            words = "a page open" if looked_at else ""
            sys.stdout.write(f"{rate:>7} points/s {words:12} p50 {p50:7.2f}   p99 {p99:7.2f}   largest {largest:7.2f}\n")
