"""A recording process that is killed at a random moment, again and again, and what its record holds afterwards.

`python -m tests.integration.killed soak KILLS` kills so many processes and checks every acknowledged point.
"""

import itertools
import multiprocessing
import random
import sys
import tempfile
import time
from collections.abc import Iterator
from multiprocessing.connection import Connection
from pathlib import Path

import numpy as np

from cmmlink.record.reader import check_chain, list_runs, open_to_read, points_of, reads_of
from cmmlink.record.recorder import Acknowledged
from drivers.codecs.ascii_frames import AsciiDecoder
from drivers.codecs.dme_session import DmeJob
from drivers.links.dme_machine import DmeMachine
from drivers.links.serial_scanner import SerialScanner
from drivers.source import PointBatch
from tests.cmmlink.recorded import plan_with_known_pose, record, today
from tests.integration.simulated import Simulated, simulated
from tests.integration.split_off import split_off

RATE_HZ, LONGEST_SCAN = 10_000.0, 60_000
ROOT = Path(__file__).resolve().parents[2]


def record_scan(folder: Path, address: str, say: Connection) -> None:
    """Record the scan of a device and say what is acknowledged: bytes of the wire, and points."""

    def acknowledge(acknowledged: Acknowledged) -> None:
        say.send((acknowledged.wire_bytes, acknowledged.points))

    record(folder, SerialScanner(address, AsciiDecoder()), plan=plan_with_known_pose(), acknowledge=acknowledge)


def record_machine(folder: Path, address: str, job: DmeJob, say: Connection) -> None:
    """Record what a measuring machine scans, and say how many points are acknowledged."""
    source = DmeMachine(address, job, silence_s=60.0)
    record(folder, source, plan=plan_with_known_pose(), acknowledge=lambda acknowledged: say.send(acknowledged.points))


def _said(listen: Connection) -> Iterator[tuple[int, int]]:
    """What the recorder said, until its process is gone; a last message may be cut short by that."""
    while True:
        try:
            yield listen.recv()
        except (EOFError, OSError):
            return


def kill_one(folder: Path, rng: random.Random) -> tuple[str, int]:
    """Kill a recording process at a random moment and check its record; gives the run and the points acknowledged."""
    known = len(list_runs(folder, today))
    with (
        tempfile.TemporaryDirectory() as place,
        simulated("serial", "127.0.0.1:0", Path(place), count=LONGEST_SCAN, rate_hz=RATE_HZ) as device,
    ):
        listen, say = multiprocessing.Pipe(duplex=False)
        process = split_off(record_scan, folder, device.address, say)
        say.close()
        with listen:
            said = [(0, 0), *itertools.islice(_said(listen), rng.randint(0, 4))]
            time.sleep(rng.uniform(0.0, 0.2))  # not to wait for anything: the moment of the kill is what is random
            process.kill()
            said += _said(listen)
        process.join()
        return _checked(folder, known, device, *said[-1])


def _checked(folder: Path, known: int, device: Simulated, wire_bytes: int, points: int) -> tuple[str, int]:
    runs = list_runs(folder, today)
    if len(runs) == known:
        assert points == 0  # killed before the run began
        return "", 0
    assert runs[-1]["state"] == "interrupted"
    run = runs[-1]["run"]
    with open_to_read(folder, today) as store:
        assert not check_chain(store, None)["altered"]
        data = b"".join(read.data for read in reads_of(store, run))
        batches = list(points_of(store, run))
    kept = np.vstack([np.empty((0, 3)), *(batch.points_mm for batch in batches)])
    sequence = np.concatenate([np.empty(0, np.int64), *(batch.sequence for batch in batches)])
    assert len(data) >= wire_bytes
    assert len(kept) == runs[-1]["received"] >= points
    np.testing.assert_array_equal(sequence, np.arange(len(kept)))
    as_sent = [[float(f"{value:.6f}") for value in point] for point in device.sent_mm[: len(kept)]]  # the line carries six decimals
    np.testing.assert_array_equal(kept, np.array(as_sent).reshape(-1, 3))
    decoded = [arrival for arrival in AsciiDecoder().feed(data) if isinstance(arrival, PointBatch)]
    assert sum(map(len, decoded)) >= points
    return run, points


def soak(kills: int, seed: int) -> None:
    """Kill so many recording processes at one station; any lost point raises."""
    rng, total = random.Random(seed), 0
    with tempfile.TemporaryDirectory() as folder:
        for number in range(1, kills + 1):
            run, points = kill_one(Path(folder), rng)
            total += points
            print(f"kill {number}/{kills}: {run or 'before the run began'}, {points} points acknowledged, all there", flush=True)
    print(f"{kills} kills, {total} points acknowledged, none lost, every file opened")


if __name__ == "__main__":
    soak(int(sys.argv[2]), seed=1)
