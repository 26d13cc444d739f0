"""Simulated distance sensors, fed at constant speed, through the serial source to points."""

from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path

import numpy as np
import pytest

from drivers.codecs.optoncdt_frames import OptoncdtDecoder
from drivers.codecs.riftek_frames import RiftekAsciiDecoder, RiftekDecoder
from drivers.links.axis import Beam, ConstantFeed
from drivers.links.serial_scanner import SerialScanner
from drivers.source import Decoder, ScanClosed
from simulators.motion import Motion, feed_under
from tests.drivers.codecs.streams import account
from tests.integration.simulated import Simulated, simulated

COUNT, RATE_HZ, SPEED_MM_S = 300, 1000.0, 100.0
SURFACE_MM = np.array([[0.0, 10.0], [20.0, 20.0], [40.0, 15.0]])
BEAM = Beam(origin_mm=(0.0, 0.0, 0.0), distance_direction=(0.0, 1.0, 0.0), axis_direction=(1.0, 0.0, 0.0))
SENSORS: dict[str, tuple[Callable[[], Decoder], float]] = {
    "riftek": (lambda: RiftekDecoder(50.0, RATE_HZ, count=COUNT), 0.51 * 50 / 16384),
    "riftek-ascii": (lambda: RiftekAsciiDecoder(RATE_HZ, count=COUNT), 0.51e-3),
    "optoncdt": (lambda: OptoncdtDecoder(50.0, rate_hz=RATE_HZ, count=COUNT), 0.51 * 0.5 * 102 / 65520),
}


def running_sensor(sensor: str, folder: Path, *options: str, count: int) -> AbstractContextManager[Simulated]:
    moved = {"rate_hz": RATE_HZ, "speed_mm_s": SPEED_MM_S, "noise_mm": 0.0}
    return simulated(sensor, "127.0.0.1:0", folder, *options, path_mm=SURFACE_MM, count=count, **moved)


@pytest.mark.parametrize("sensor", SENSORS)
def test_a_fed_sensor_gives_the_surface(sensor: str, tmp_path: Path) -> None:
    make, within_mm = SENSORS[sensor]
    truth_mm = feed_under(SURFACE_MM, Motion(SPEED_MM_S, RATE_HZ, count=COUNT)).points_mm
    with running_sensor(sensor, tmp_path, count=COUNT) as running:
        source = ConstantFeed(SerialScanner(running.address, make()), BEAM, SPEED_MM_S)
        book = account(source.arrivals())
    assert book.sequence == list(range(COUNT))
    np.testing.assert_allclose(np.array(book.points_mm)[:, 1:], truth_mm[:, 1:], atol=within_mm)
    np.testing.assert_allclose(np.array(book.points_mm)[:, 0], truth_mm[:, 0], atol=1e-9)
    assert book.others[-1] == ScanClosed(None)


def test_lost_values_keep_the_others_in_their_place(tmp_path: Path) -> None:
    faults = ["--fault=lost-frames:0.05", "--fault=invalid:0.05"]
    truth_mm = feed_under(SURFACE_MM, Motion(SPEED_MM_S, RATE_HZ, count=COUNT)).points_mm
    with running_sensor("optoncdt", tmp_path, *faults, count=COUNT + 50) as running:
        decoder = OptoncdtDecoder(50.0, rate_hz=RATE_HZ, count=COUNT)
        book = account(ConstantFeed(SerialScanner(running.address, decoder), BEAM, SPEED_MM_S).arrivals())
    assert book.lost > 0
    assert book.counts["Rejected", "no peak"] > 0
    assert len(book.sequence) + book.total("Rejected") + book.lost == COUNT
    first_mm = truth_mm[book.sequence[0]] - [book.points_mm[0][0], truth_mm[book.sequence[0]][1], 0.0]
    np.testing.assert_allclose(np.array(book.points_mm), truth_mm[book.sequence] - first_mm, atol=0.51 * 0.5 * 102 / 65520)
