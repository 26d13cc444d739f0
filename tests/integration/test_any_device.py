"""What every source promises, on simulated devices, or on the hardware that --device names.

    pytest tests/integration/test_any_device.py --device=/dev/ttyUSB0 --format=ascii
    pytest tests/integration/test_any_device.py --device=192.168.1.10:502 --map=gocator --points=200

The hardware must be scanning, or begin to when it is asked. A scan that has no end is read for --points points.
"""

import threading
from collections.abc import Callable, Iterator
from itertools import takewhile
from pathlib import Path

import numpy as np
import pytest

from cmmlink.plan.own_maps import map_of
from drivers.codecs import decoder, decoders
from drivers.codecs.dme_commands import curve_density, scans_on_curve
from drivers.codecs.dme_points import PointCheck
from drivers.codecs.dme_session import DmeJob
from drivers.codecs.register_decoder import RegisterDecoder
from drivers.links.dme_machine import DmeMachine
from drivers.links.link_settings import LinkSettings
from drivers.links.modbus_scanner import ModbusScanner
from drivers.links.serial_scanner import SerialScanner
from drivers.source import Arrival, PointBatch, ScanClosed, ScanSource, WireBytes
from tests.drivers.codecs.streams import Account, account
from tests.integration.simulated import simulated

CORNERS_MM = np.array([[0.0, 0.0], [60.0, 0.0], [60.0, 20.0], [0.0, 20.0]])  # of the part that is simulated
SIDES = np.array([[0.0, -1.0], [1.0, 0.0], [0.0, 1.0], [-1.0, 0.0]])  # out of the material
COURSE = np.hstack([CORNERS_MM, np.zeros((4, 1)), SIDES, np.zeros((4, 1))])
MACHINE = DmeJob(PointCheck(0.0, 0.001, 50.0), scans_on_curve(COURSE, closed=True), preparations=(curve_density(0.01, 10.0),))
SIMULATED = {
    "dme": "dme",
    "serial": "ascii",
    "binary": "binary",
    "binary-block": "binary",
    "modbus-ring": "generic-ring",
    "modbus-fifo": "generic-fifo",
}
Open = Callable[[], ScanSource]


def opener(address: str, name: str, options: dict[str, float], settings: LinkSettings) -> Open:
    """Return what makes a source: a format's name is a stream, a map's name or file is Modbus."""
    if name == "dme":
        return lambda: DmeMachine(address, MACHINE, silence_s=30.0)
    if name in decoders():
        return lambda: SerialScanner(address, decoder(name, **options), settings)
    return lambda: ModbusScanner(address, RegisterDecoder(map_of(name)), settings)


@pytest.fixture(params=["hardware", *SIMULATED])
def open_source(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Open]:
    config = request.config
    address = config.getoption("--device")
    if (request.param == "hardware") != (address is not None):
        pytest.skip("runs with --device=ADDRESS only" if address is None else "runs without --device only")
    if address is not None:
        options = {key: float(value) for key, _, value in (text.partition("=") for text in config.getoption("--option"))}
        name = config.getoption("--map") or config.getoption("--format")
        yield opener(address, name, options, LinkSettings(config.getoption("--baud-rate"), config.getoption("--parity")))
        return
    with simulated(request.param, "127.0.0.1:0", tmp_path, count=20_000) as device:
        yield opener(device.address, SIMULATED[request.param], {}, LinkSettings(115_200, "N"))


def first_points(source: ScanSource, count: int) -> list[Arrival]:
    """Read until so many points have arrived or the scan is over."""
    seen, arrivals = 0, []
    for arrival in source.arrivals():
        arrivals.append(arrival)
        seen += len(arrival) if isinstance(arrival, PointBatch) else 0
        if seen >= count:
            source.stop()
    return arrivals


def check(book: Account, at_least: int) -> None:
    sequence = np.array(book.sequence)
    assert len(sequence) >= at_least
    assert len(set(book.sequence)) == len(sequence)
    assert np.isfinite(book.points_mm).all()
    span = sequence.max() - sequence.min() + 1
    assert span <= len(sequence) + book.lost + book.total("Rejected")


def test_points_come_once_each_and_every_gap_is_counted(open_source: Open, pytestconfig: pytest.Config) -> None:
    points = pytestconfig.getoption("--points")
    arrivals = first_points(open_source(), points)
    check(account(arrivals), at_least=1 if any(isinstance(arrival, ScanClosed) for arrival in arrivals) else points)


def test_bytes_come_before_what_was_decoded_from_them(open_source: Open) -> None:
    arrivals = first_points(open_source(), 10)
    before = list(takewhile(lambda arrival: not isinstance(arrival, PointBatch), arrivals))
    assert any(isinstance(arrival, WireBytes) and arrival.data for arrival in before)


def test_stop_ends_the_run_from_another_thread(open_source: Open) -> None:
    source = open_source()
    running = threading.Event()

    def run() -> None:
        for _ in source.arrivals():
            running.set()

    thread = threading.Thread(target=run)
    thread.start()
    assert running.wait(30.0)
    source.stop()
    thread.join(timeout=10.0)
    assert not thread.is_alive()
