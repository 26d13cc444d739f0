"""How fast the console is: Chromium draws a run while points arrive.

    python -m tests.benchmarks.console_benchmark [--seconds 60] [--rate 10000] [--held 100000] [--endure MINUTES]

Prints frames per second, the time from a verdict to its drawing, and the memory of page and server. Everything, browser
included, runs on two cores without a GPU (Linux; elsewhere on all). With --endure the server's share of the run is the
console alone: no inspection, whose rows grow by design, stands between the points and the page.
"""

import argparse
import multiprocessing
import os
import platform
import shutil
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from datetime import datetime
from multiprocessing.connection import Connection
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from playwright.sync_api import CDPSession, Page, sync_playwright

from cmmlink.console.server import ConsoleServer
from cmmlink.console.station import Station
from cmmlink.devices import Connected
from cmmlink.events import Counts, Judged, RunStarted
from cmmlink.from_plan import inspection_of, profile_of
from cmmlink.plan.scan import Plan, load_plan
from cmmlink.plan.whole_surface import SurfacePlan
from cmmlink.run_context import RunContext
from cmmlink.run_view import RunView
from drivers.source import Arrival, PointBatch
from inspection import LiveUpdate, NominalProfile
from tests.cmmlink.console.conftest import FLAGS
from tests.cmmlink.console.played import PLAN, measured, opened, setup_of, write_plan

BATCH_S = 0.01
ROUNDS = 10
DATUM = "registration: {datum: {rotation_deg: -22.918311805232928, translation_mm: [210, 145]}}\n"  # where `measured` puts the part
FRAMES = """(seconds) => new Promise(done => {
    const gaps = [];
    let last = performance.now();
    const end = last + 1000 * seconds;
    const frame = () => {
        const now = performance.now();
        gaps.push(now - last);
        last = now;
        now < end ? requestAnimationFrame(frame) : done(gaps);
    };
    requestAnimationFrame(frame);
})"""
TIMES = {"latency_ms": "verdict to drawn", "oldest_ms": "oldest of a batch", "drawing_ms": "drawing one frame"}


def main() -> None:
    """Measure, and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--rate", type=int, default=10_000)
    parser.add_argument("--held", type=int, default=100_000)
    parser.add_argument("--endure", type=float, metavar="MINUTES", default=0.0)
    asked = parser.parse_args()
    if sys.platform == "linux":
        os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:2])
    print(f"{datetime.now():%Y-%m-%d}, {platform.machine()} {platform.system()}, {cores()} cores, python {platform.python_version()}")
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe()
    server = context.Process(target=serve, args=(theirs, asked.rate, asked.held, asked.endure > 0), daemon=True)
    server.start()
    try:
        measure(ours, asked.seconds if not asked.endure else 60 * asked.endure, asked.endure > 0)
    finally:
        ours.send("end")
        server.join(10.0)


def cores() -> int:
    return len(os.sched_getaffinity(0)) if sys.platform == "linux" else os.cpu_count() or 0


def measure(server: Connection, seconds: float, endure: bool) -> None:
    """Drive Chromium and print what it and the server tell."""
    address = server.recv()
    chromium = shutil.which("chromium")
    assert chromium, "no chromium on this machine"
    with sync_playwright() as playwright, playwright.chromium.launch(executable_path=chromium, args=FLAGS) as browser:
        page = browser.new_page(viewport={"width": 1280, "height": 800})
        page.goto(address)
        page.locator("body[data-view=live]").wait_for(timeout=60_000)
        server.send("held")
        print(f"{server.recv()}; {browser.browser_type.name} {browser.version}, 1280 x 800")
        session = page.context.new_cdp_session(page)
        samples = [sample(session, server)]
        step_s = min(30.0, seconds / 4)
        gaps: list[float] = []
        before = page.evaluate("timing().bytes")
        for _ in range(round(seconds / step_s)):
            gaps += page.evaluate(FRAMES, step_s)
            samples.append(sample(session, server))
        show_frames(page, gaps, before, seconds)
        show_memory(samples, step_s, endure)


def show_frames(page: Page, gaps: list[float], before: int, seconds: float) -> None:
    figures = page.evaluate("timing()")
    gap = np.array(gaps)
    p50, p99 = np.percentile(gap, [50, 99])
    print(f"{'frames per second':<20} {1000 * len(gap) / gap.sum():.1f}; gap p50 {p50:.1f}, p99 {p99:.1f} ms")
    for name, words in TIMES.items():
        p50, p99, most = np.percentile(np.array(figures[name]), [50, 99, 100])
        print(f"{words:<20} p50 {p50:.1f}, p99 {p99:.1f}, max {most:.1f} ms (the last {len(figures[name])})")
    print(f"{'received by the page':<20} {(figures['bytes'] - before) / seconds / 1e3:.0f} kB/s; bins with points {figures['held']}")


def show_memory(samples: list[tuple[float, float, str]], step_s: float, endure: bool) -> None:
    print(f"memory every {step_s:g} s: script heap of the page MB, resident of the server MB, points received")
    if not endure:
        print("  (the server holds the inspection too, which keeps every point)")
    shown = samples[:: max(1, len(samples) // 12)]
    for heap, resident, points in [*shown, samples[-1]]:
        print(f"  {heap:6.2f}  {resident:7.1f}  {points}")


def sample(session: CDPSession, server: Connection) -> tuple[float, float, str]:
    """Script heap of the page after collection, resident memory of the server, MB; and the points received."""
    session.send("HeapProfiler.collectGarbage")
    heap = session.send("Runtime.getHeapUsage")["usedSize"] / 1e6
    server.send("memory")
    resident, points = server.recv()
    return heap, resident / 1e6, points


def resident_bytes() -> int:
    if sys.platform != "linux":
        return 0
    return int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1]) * os.sysconf("SC_PAGE_SIZE")


def serve(answer: Connection, rate: int, held: int, alone: bool) -> None:
    """Serve a run that goes on until told to end."""
    with tempfile.TemporaryDirectory() as folder:
        plan_file = write_plan(Path(folder), text=PLAN + DATUM)
        source = Rated(profile_of(load_plan(plan_file)), rate, held)
        station = Station(setup_of({"blade.yaml": plan_file}, source.connect))
        server = ConsoleServer(station, "benchmark")
        server.start()
        station.choose("blade.yaml")
        if alone:
            station.show(Alone(plan_file, source).start())
        else:
            station.start()
        answer.send(server.new_address())
        while (question := answer.recv()) != "end":
            assert station.view is not None
            received = station.view.state().received
            while question == "held" and received < held:
                time.sleep(0.05)
                received = station.view.state().received
            answer.send((resident_bytes(), f"{received:,}") if question == "memory" else f"{received:,} points held, {rate:,} points/s")
        source.stop()
        server.stop()


class Rated:
    """A source that gives `held` points at once and then so many a second, around and around the profile.

    The noise grows by a third with every round, so that what arrives goes on changing what is drawn.
    """

    def __init__(self, profile: NominalProfile, rate: int, held: int) -> None:
        self.held, self.size = held, round(rate * BATCH_S)
        self.points = measured(profile, held, seed=1, defect_mm=0.06, at_mm=90.0)
        moved = measured(profile, held, seed=1, defect_mm=0.06, at_mm=90.0, excess_mm=1.0)
        self.outward = moved - self.points
        self.rng = np.random.default_rng(2)
        self.ended = False

    def connect(self, plan: Plan | SurfacePlan) -> AbstractContextManager[Connected]:
        return nullcontext(Connected(self, "benchmark", True))

    def stop(self) -> None:
        self.ended = True

    def arrivals(self) -> Iterator[Arrival]:
        yield opened(0)
        for rows in self.paced():
            noise = self.noise(rows)[:, None]
            yield PointBatch(
                rows, np.asarray(rows * 1e-4, dtype=np.float64), self.points[rows % self.held] + noise * self.outward[rows % self.held]
            )

    def noise(self, rows: NDArray[np.int64]) -> NDArray[np.float64]:
        """Noise in mm, from 1 um in the first round to about 13 um in the tenth; then it begins anew."""
        growth = 1.33 ** ((rows // self.held) % ROUNDS)
        return np.asarray(self.rng.normal(0.0, 0.001, len(rows)) * growth)

    def paced(self) -> Iterator[NDArray[np.int64]]:
        """Numbers of the points of each batch, when it is due."""
        for first in range(0, self.held, 4000):
            yield np.arange(first, min(first + 4000, self.held))
        began_s, batch = time.monotonic(), 0
        while not self.ended:
            time.sleep(max(0.0, began_s + batch * BATCH_S - time.monotonic()))
            first = self.held + batch * self.size
            yield np.arange(first, first + self.size)
            batch += 1


def now() -> datetime:
    return datetime.now().astimezone()


class Alone:
    """The console alone: verdicts at the same rate without an inspection; everything is told anew every ten rounds."""

    def __init__(self, plan_file: Path, source: Rated) -> None:
        plan = load_plan(plan_file)
        profile = profile_of(plan)
        self.whole = inspection_of(plan, profile).add(source.points)
        self.source = source
        self.view = RunView(RunContext("1", "blade.yaml", profile, plan.zone, 0.95, 500_000, now()), time.monotonic, now)

    def start(self) -> RunView:
        self.view(RunStarted("endurance", "", "", "benchmark", True))
        threading.Thread(target=self.run, daemon=True).start()
        return self.view

    def run(self) -> None:
        total, told = 0, 0
        for rows in self.source.paced():
            total += len(rows)
            anew = total // (ROUNDS * self.source.held) > told
            told += anew
            update = replace(self.whole, first=0) if anew else self.part(rows)
            self.view(Judged(time.monotonic(), 0.0, update, Counts(total, total)))

    def part(self, rows: NDArray[np.int64]) -> LiveUpdate:
        """The update of these points, their deviations with fresh noise."""
        whole, noise = self.whole, self.source.noise(rows)
        rows = rows % self.source.held
        arrays = {name: getattr(whole, name)[rows] for name in ("foot_mm", "station_mm", "verdicts")}
        normal = (whole.actual_mm[rows] - whole.foot_mm[rows]) / whole.deviation_mm[rows][:, None]
        deviation = whole.deviation_mm[rows] + noise
        actual = arrays["foot_mm"] + deviation[:, None] * normal
        return replace(whole, first=1, stop=1 + len(rows), deviation_mm=deviation, actual_mm=actual, **arrays)


if __name__ == "__main__":
    main()
