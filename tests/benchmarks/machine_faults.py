"""A million points with faults by I++ DME and by text lines: no wrong point, and what is missing is told where it is missing.

    python -m tests.benchmarks.machine_faults [POINTS]

Both machines are simulated ones in processes of their own, behind real sockets. I++ numbers no points, so between any two points that do
not follow each other at the machine the driver must have told of damage or of a rejected point. Lines of a machine tool are numbered:
points, rejected ones and lost ones make up the whole scan to the last one. Anything else fails this.
"""

import sys
import tempfile
import time
from contextlib import AbstractContextManager
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from drivers import decoder
from drivers.codecs.dme_commands import curve_density, scans_on_curve
from drivers.codecs.dme_points import PointCheck
from drivers.codecs.dme_session import DmeJob
from drivers.links.dme_machine import DmeMachine
from drivers.links.link_settings import LinkSettings
from drivers.links.serial_scanner import SerialScanner
from drivers.source import Arrival, Damaged, PointBatch, Rejected, ScanClosed
from simulators.motion import Motion, walk
from tests.benchmarks.machine import machine
from tests.drivers.codecs.streams import account
from tests.integration.simulated import SEED, Simulated, simulated

RADIUS_MM, STEP_MM, RATE_HZ, NOISE_MM, SILENCE_S = 1.5, 0.0002, 10_000.0, 0.01, 600.0
IN_MACHINE = ("split-points:0.02", "wrong-tag:0.005", "lone-lf:0.005", "invalid:0.001", "torn-line:1400", "jog-key@1000")
_OF_LINES = ("no-contact:0.0005", "lost-frames:0.0005", "repeated-frames:0.0005", "mislabelled:0.001")
IN_LINES = ("parity", "flip:2e-6@10", "burst:300@5000", *_OF_LINES)
OUTLINE = 1000  # corners of the part: its course goes in one line of I++
Array = NDArray[np.float64]


def round_part(points: int) -> tuple[Array, Array, Motion]:
    """A path (k, 2) so long that a step of STEP_MM gives so many points, its course (k, 6), and the scan."""
    angle = np.linspace(0.0, 2.0 * np.pi, OUTLINE, endpoint=False)
    outward = np.column_stack([np.cos(angle), np.sin(angle)])
    path_mm = np.round(points * STEP_MM / (2.0 * OUTLINE * np.sin(np.pi / OUTLINE)) * outward, 6)
    flat = np.zeros((OUTLINE, 1))
    length_mm = float(np.hypot(*np.diff(np.vstack([path_mm, path_mm[:1]]), axis=0).T).sum())
    motion = Motion(STEP_MM * RATE_HZ, RATE_HZ, round(length_mm / STEP_MM), noise_mm=NOISE_MM, tip_radius_mm=RADIUS_MM, seed=SEED)
    return path_mm, np.hstack([path_mm, flat, outward, flat]), motion


def keys_of(points_mm: Array, decimals: int) -> NDArray[np.int64]:
    """One number for each point (n, 3) of a plane, as it is spelled."""
    x, y = np.rint(points_mm[:, :2] * 10.0**decimals).astype(np.int64).T
    return np.asarray(x * 2**31 + y, dtype=np.int64)


def places_of(found_mm: Array, sent_mm: Array, decimals: int) -> NDArray[np.int64]:
    """Which sent point each found one is, -1 for one that was never sent. No two of the sent ones may be alike."""
    keys = keys_of(sent_mm, decimals)
    order = np.argsort(keys)
    assert (np.diff(keys[order]) > 0).all(), "two points are spelled alike: take another seed"
    wanted = keys_of(found_mm, decimals)
    at = np.minimum(np.searchsorted(keys[order], wanted), len(keys) - 1)
    return np.where(keys[order][at] == wanted, order[at], -1)


def by_machine(points: int, folder: Path) -> tuple[list[str], bool]:
    """What was found over I++ DME, and whether all is well."""
    path_mm, course, motion = round_part(points)
    job = DmeJob(PointCheck(RADIUS_MM, 0.001, 50.0), scans_on_curve(course, closed=True), preparations=(curve_density(STEP_MM, 10.0),))
    sent_mm = walk(path_mm, motion).points_mm
    batches, told, received, rejected, is_closed = list[Array](), set[int](), 0, 0, False
    began_s = time.monotonic()
    with device("dme", folder, path_mm, motion, IN_MACHINE) as served:
        for arrival in DmeMachine(served.address, job, SILENCE_S).arrivals():
            if isinstance(arrival, PointBatch):
                batches.append(arrival.points_mm)
                received += len(arrival)
            elif isinstance(arrival, Damaged | Rejected):
                told.add(received)
                rejected += arrival.count if isinstance(arrival, Rejected) else 0
            is_closed |= isinstance(arrival, ScanClosed)
        tally = served.tally()
    took_s = time.monotonic() - began_s
    places = places_of(np.vstack(batches), sent_mm, decimals=6)
    edges = np.concatenate([[-1], places, [len(sent_mm)]])
    holes = np.flatnonzero(np.diff(edges) > 1)
    silent = [int(hole) for hole in holes if int(hole) not in told]
    wrong = int((places < 0).sum())
    out_of_order = int((np.diff(edges) < 1).sum())
    lines = [
        f"I++ DME: {len(sent_mm):,} points measured in {took_s:.0f} s: {received:,} received, {rejected:,} rejected, "
        f"{len(sent_mm) - received - rejected:,} in lines that were damaged; {len(holes):,} places at which points are missing",
        f"  wrong points {wrong}, out of order {out_of_order}, missing without a word {len(silent)}; faults that struck: {tally}",
    ]
    return lines, not (wrong or out_of_order or silent) and is_closed and tally["points"] == len(sent_mm)


def by_lines(points: int, folder: Path) -> tuple[list[str], bool]:
    """What was found in the lines of a machine tool, and whether all is well."""
    path_mm, _, motion = round_part(points)
    sent_mm = walk(path_mm, motion).points_mm
    began_s = time.monotonic()
    with device("machine-tool", folder, path_mm, motion, IN_LINES) as served:
        reading = decoder("g800", unit="mm", tip_radius_mm=RADIUS_MM, parity="even")
        arrivals: list[Arrival] = list(SerialScanner(served.address, reading, LinkSettings(9600, "N", SILENCE_S, 0.0)).arrivals())
        tally = served.tally()
    took_s, book = time.monotonic() - began_s, account(arrivals)
    found = np.array(book.points_mm)
    wrong = int((np.abs(found - np.round(sent_mm[np.array(book.sequence)], 4)).max(axis=1) > 1e-9).sum())
    counts = {reason: number for (kind, reason), number in book.counts.items() if kind == "Rejected"}
    repeated = counts.pop("frame repeated", 0)
    rejected = sum(counts.values())
    missing = len(sent_mm) - len(found) - rejected - book.lost
    lines = [
        f"G800 lines: {len(sent_mm):,} points measured in {took_s:.0f} s: {len(found):,} received, {rejected:,} rejected, "
        f"{book.lost:,} lost; {repeated:,} came twice and count once, {book.total('Damaged'):,} bytes damaged",
        f"  wrong points {wrong}, unaccounted for {missing}; faults that struck: {tally}",
    ]
    return lines, not (wrong or missing) and len(set(book.sequence)) == len(book.sequence)


def device(name: str, folder: Path, path_mm: Array, motion: Motion, faults: tuple[str, ...]) -> AbstractContextManager[Simulated]:
    """The simulated machine, which goes as fast as its points are taken."""
    told = ["--unpaced", f"--tip-radius-mm={RADIUS_MM}", *(f"--fault={fault}" for fault in faults)]
    count, rate_hz, speed_mm_s = motion.count or 1, motion.rate_hz, motion.speed_mm_s
    return simulated(
        name,
        "127.0.0.1:0",
        folder,
        *told,
        count=count,
        rate_hz=rate_hz,
        speed_mm_s=speed_mm_s,
        noise_mm=motion.noise_mm,
        path_mm=path_mm,
    )


def main() -> int:
    """Print what was found; 1 where anything is wrong."""
    points, well = int(float(sys.argv[1])) if len(sys.argv) > 1 else 1_000_000, True
    sys.stdout.write(machine("numpy") + "\n")
    with tempfile.TemporaryDirectory() as folder:
        for measure in (by_machine, by_lines):
            lines, is_well = measure(points, Path(folder))
            sys.stdout.write("\n".join(lines) + "\n")
            sys.stdout.flush()
            well &= is_well
    return int(not well)


if __name__ == "__main__":
    sys.exit(main())
