"""Simulated Modbus devices and the Modbus source over real TCP connections and real RTU lines."""

import os
import shutil
import subprocess
import threading
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from drivers.codecs.register_decoder import RegisterDecoder
from drivers.errors import DeviceRefused, LinkError, ProtocolError
from drivers.links.link_settings import LinkSettings
from drivers.links.modbus_scanner import ModbusScanner
from drivers.maps import shipped_map
from drivers.source import Arrival, Heartbeat, LinkDown, LinkUp, PointBatch, ScanClosed, ScanOpened
from tests.drivers.codecs.streams import Account, account, only_sent_points
from tests.integration.simulated import Simulated, simulated

COUNT = 1000
HALF_UNIT_MM = 0.51e-5
TCP = "127.0.0.1:0"
RTU = pytest.param("pty", marks=pytest.mark.skipif(os.name != "posix", reason="pseudo-terminals exist on POSIX systems only"))
MAPS = {"modbus-ring": "generic-ring", "modbus-fifo": "generic-fifo", "gocator": "gocator"}


def source(
    device: Simulated,
    map_name: str,
    *,
    count: int | None = None,
    silence_s: float = 60.0,
    reconnect_s: float = 0.0,
    timeout_s: float = 20.0,
    poll_s: float = 0.002,
    clock: Callable[[], float] = time.monotonic,
) -> ModbusScanner:
    """With patience where a test does not ask for less: an answer may come late on a busy machine."""
    settings = LinkSettings(115_200, "N", silence_s, reconnect_s)
    decoder = RegisterDecoder(shipped_map(map_name), count=count)
    return ModbusScanner(device.address, decoder, settings, timeout_s=timeout_s, poll_s=poll_s, clock=clock)


def kinds(book: Account) -> list[type[Arrival]]:
    """The kinds of arrivals besides points, counts and heartbeats."""
    return [type(arrival) for arrival in book.others if not isinstance(arrival, Heartbeat)]


@pytest.mark.parametrize("line", [TCP, RTU])
@pytest.mark.parametrize("name", ["modbus-ring", "modbus-fifo"])
def test_every_point_arrives_as_it_was_measured(name: str, line: str, tmp_path: Path) -> None:
    with simulated(name, line, tmp_path, "--unpaced") as device:
        book = account(source(device, MAPS[name]).arrivals())
    assert book.sequence == list(range(COUNT))
    only_sent_points(book, device.sent_mm, HALF_UNIT_MM)
    np.testing.assert_allclose(book.time_s, np.arange(COUNT) / 2000.0, atol=0.51e-6)
    assert kinds(book) == [ScanOpened, ScanClosed]
    assert book.lost == book.total("Rejected") == book.total("Damaged") == 0


def test_a_gocator_gives_encoder_and_measurement(tmp_path: Path) -> None:
    with simulated("gocator", TCP, tmp_path, "--unpaced", "--fault=sentinel:0.02", "--fault=lost-frames:0.02") as device:
        book, tally = account(source(device, "gocator").arrivals()), device.tally()
    index = np.array(book.sequence) - 17
    np.testing.assert_allclose(np.array(book.points_mm)[:, 0], device.sent_mm[index, 0], atol=0.51e-3)
    np.testing.assert_allclose(np.array(book.points_mm)[:, 2], device.sent_mm[index, 1], atol=0.51e-3)
    assert book.counts["Rejected", "z holds no value"] == tally["sentinel"] > 0
    assert tally["lost-frames"] > 0
    assert len(index) + book.total("Rejected") + book.lost <= COUNT  # a loss before the first or after the last shows in no frame index
    assert np.diff(index).sum() + 1 <= len(index) + book.total("Rejected") + book.lost


@pytest.mark.parametrize("line", [TCP, RTU])
def test_a_riftek_sensor_is_read_through_its_map(line: str, tmp_path: Path) -> None:
    path_mm = np.array([[0.0, 10.0], [100.0, 40.0]])
    with simulated("riftek-modbus", line, tmp_path, "--unpaced", path_mm=path_mm, count=200, speed_mm_s=1000.0, noise_mm=0.0) as device:
        book = account(source(device, "riftek-rf60x", count=200, poll_s=0.0).arrivals())
    z_mm = [z for _, _, z in book.points_mm]
    assert len(z_mm) == 200
    np.testing.assert_allclose(z_mm, 10.0 + 0.3 * 0.5 * np.arange(200), atol=0.51 * 50 / 16384)


@pytest.mark.parametrize("line", [TCP, RTU])
def test_damage_gives_no_wrong_point_and_the_true_loss(line: str, tmp_path: Path) -> None:
    faults = ["flip:2e-4@40", "lost-frames:0.02", "repeated-frames:0.02", "reordered-frames:0.02", "sentinel:0.02", "invalid:0.02"]
    faults += ["gap:30@500", "overflow:15@700", "burst:5@200"]
    options = ["--unpaced", *(f"--fault={fault}" for fault in faults)]
    with simulated("modbus-ring", line, tmp_path, *options) as device:
        book = account(source(device, "generic-ring", timeout_s=0.2, reconnect_s=20.0).arrivals())
    only_sent_points(book, device.sent_mm, HALF_UNIT_MM)
    assert len(set(book.sequence)) == len(book.sequence)
    marked = book.counts["Rejected", "marked invalid by the device"] + book.counts["Rejected", "y holds no value"]
    assert marked > 0
    assert book.counts["Rejected", "point repeated"] > 0
    assert len(book.sequence) + marked + book.lost == COUNT
    assert book.lost >= 45
    assert ("Lost", "the device says that its buffer overflowed; its counter shows how many") in book.counts


def test_a_ring_that_is_faster_than_its_reader_loses_and_counts(tmp_path: Path) -> None:
    with simulated("modbus-ring", TCP, tmp_path, rate_hz=1e6, count=5000) as device:
        book = account(source(device, "generic-ring").arrivals())
    only_sent_points(book, device.sent_mm, HALF_UNIT_MM)
    assert len(set(book.sequence)) == len(book.sequence) == 5000 - book.lost
    assert book.lost > 0


@pytest.mark.parametrize("line", [TCP, RTU])
def test_an_unplugged_device_comes_back_and_the_run_goes_on(line: str, tmp_path: Path) -> None:
    with simulated("modbus-ring", line, tmp_path, "--unpaced", "--fault=unplug:0.1@400") as device:
        book = account(source(device, "generic-ring", reconnect_s=20.0).arrivals())
    assert kinds(book) == [ScanOpened, LinkDown, LinkUp, ScanClosed]
    assert (book.sequence, book.lost) == (list(range(COUNT)), 0)
    only_sent_points(book, device.sent_mm, HALF_UNIT_MM)


@pytest.mark.parametrize("line", [TCP, RTU])
def test_a_restarted_device_begins_a_new_scan(line: str, tmp_path: Path) -> None:
    with simulated("modbus-ring", line, tmp_path, "--unpaced", "--fault=restart:0.1@400") as device:
        arrivals = list(source(device, "generic-ring", reconnect_s=20.0).arrivals())
    book = account(arrivals)
    assert kinds(book) == [ScanOpened, LinkDown, LinkUp, ScanOpened, ScanClosed]
    second = max(place for place, arrival in enumerate(arrivals) if isinstance(arrival, ScanOpened))
    again = account(arrivals[second:])
    assert (again.sequence, again.lost) == (list(range(COUNT)), 0)
    only_sent_points(again, device.sent_mm, HALF_UNIT_MM)


@pytest.mark.parametrize("line", [TCP, RTU])
def test_answers_slower_than_the_time_out_never_become_wrong_points(line: str, tmp_path: Path) -> None:
    """The library would hand the late answer to the next request over RTU; the link is left alone and opened again instead."""
    arrivals: list[Arrival] = []
    slow = simulated("modbus-ring", line, tmp_path, "--unpaced", "--fault=slow:0.25@80")
    with slow as device, pytest.raises(LinkError, match="no answer within"):
        arrivals.extend(source(device, "generic-ring", timeout_s=0.1).arrivals())
    book = account(arrivals)
    only_sent_points(book, device.sent_mm, HALF_UNIT_MM)
    assert len(book.sequence) > 0


def test_slow_answers_within_the_time_out_are_waited_for(tmp_path: Path) -> None:
    with simulated("modbus-ring", TCP, tmp_path, "--unpaced", "--fault=slow:0.05@80", count=120) as device:
        book = account(source(device, "generic-ring").arrivals())
    assert (book.sequence, book.lost) == (list(range(120)), 0)


def test_a_stalled_scan_is_told_from_a_dead_device_by_its_heartbeat(tmp_path: Path) -> None:
    """Here time passes with heartbeats alone, two of which are longer than the silence that is borne."""
    now_s, arrivals = [0.0], list[Arrival]()
    with simulated("modbus-ring", TCP, tmp_path, "--unpaced", "--fault=stall:0.8@200", count=400) as device:
        for arrival in source(device, "generic-ring", silence_s=10.0, clock=lambda: now_s[0]).arrivals():
            arrivals.append(arrival)
            now_s[0] += 6.0 * isinstance(arrival, Heartbeat)
    assert account(arrivals).sequence == list(range(400))
    assert now_s[0] >= 12.0
    stalled = simulated("gocator", TCP, tmp_path, "--unpaced", "--fault=stall:60@20", count=400)
    with stalled as device, pytest.raises(LinkError, match=r"the device answers, but for 2 s without a new point or a moving heartbeat"):
        list(source(device, "gocator", silence_s=2.0).arrivals())


def test_a_hanging_device_ends_the_run(tmp_path: Path) -> None:
    hanging = simulated("modbus-ring", TCP, tmp_path, "--unpaced", "--fault=silence@200")
    with hanging as device, pytest.raises(LinkError, match=r"no answer within 0\.1 s, 3 times in a row"):
        list(source(device, "generic-ring", timeout_s=0.1).arrivals())


@pytest.mark.parametrize("end", ["die", "kill"])
def test_a_device_that_dies_ends_with_a_clear_error(end: str, tmp_path: Path) -> None:
    options = ["--fault=die@400" if end == "die" else "--fault=stall:60@400"]
    with simulated("modbus-ring", TCP, tmp_path, *options) as device:
        arrivals = source(device, "generic-ring").arrivals()
        first = next(len(arrival) for arrival in arrivals if isinstance(arrival, PointBatch))
        if end == "kill":
            device.process.kill()
        with pytest.raises(LinkError, match=r"the link was lost|does not open again"):
            list(arrivals)
    assert first > 0


def test_stop_ends_a_run_that_hangs(tmp_path: Path) -> None:
    with simulated("modbus-ring", TCP, tmp_path, "--unpaced", "--fault=silence@40") as device:
        scanner = source(device, "generic-ring", timeout_s=1.0)
        opened = threading.Event()

        def run() -> None:
            for _ in scanner.arrivals():
                opened.set()

        thread = threading.Thread(target=run)
        thread.start()
        assert opened.wait(10.0)
        scanner.stop()
        thread.join(timeout=10.0)
        assert not thread.is_alive()


def test_a_device_that_is_not_there_yet_is_waited_for(tmp_path: Path) -> None:
    """The library never tries again after a failed first connection; the source does."""
    with simulated("modbus-ring", TCP, tmp_path) as device:
        address = device.address
    with pytest.raises(LinkError, match="no Modbus device opens there"):
        list(ModbusScanner(address, RegisterDecoder(shipped_map("generic-ring"))).arrivals())
    waiting = ModbusScanner(address, RegisterDecoder(shipped_map("generic-ring")), LinkSettings(19_200, "E", reconnect_s=20.0)).arrivals()
    assert isinstance(next(waiting), LinkDown)
    with simulated("modbus-ring", address, tmp_path, "--unpaced"):
        book = account(waiting)
    assert kinds(book) == [LinkUp, ScanOpened, ScanClosed]
    assert book.sequence == list(range(COUNT))


def test_swapped_words_are_called_so(tmp_path: Path) -> None:
    swapped = simulated("modbus-ring", TCP, tmp_path, "--fault=word-swap")
    with swapped as device, pytest.raises(ProtocolError, match="set word_order: low-first"):
        list(source(device, "generic-ring").arrivals())


def test_registers_that_do_not_exist_are_refused_by_name(tmp_path: Path) -> None:
    with simulated("riftek-modbus", TCP, tmp_path) as device, pytest.raises(DeviceRefused, match=r"exception 2 .*at register 300"):
        list(source(device, "gocator").arrivals())


FOREIGN: list[tuple[str, str, list[str], Callable[[str], bool]]] = [
    ("modbus-ring", TCP, ["-t", "4:hex", "-r", "1", "-c", "2"], lambda text: "0x434D" in text and "0x4D31" in text),
    ("modbus-ring", "pty", ["-t", "4:hex", "-r", "1", "-c", "2"], lambda text: "0x434D" in text and "0x4D31" in text),
    ("modbus-fifo", TCP, ["-t", "4:hex", "-r", "1", "-c", "2"], lambda text: "0x4D32" in text),
    ("gocator", TCP, ["-t", "4", "-r", "301", "-c", "1"], lambda text: "[301]: \t1" in text),
    ("riftek-modbus", "pty", ["-t", "3", "-r", "2", "-c", "5"], lambda text: "\t603" in text and "\t50" in text),
]


@pytest.mark.skipif(shutil.which("mbpoll") is None, reason="mbpoll is not installed (apt install mbpoll)")
@pytest.mark.parametrize(("name", "line", "request_options", "right"), FOREIGN)
def test_a_foreign_client_reads_the_simulated_devices(
    name: str, line: str, request_options: list[str], right: Callable[[str], bool], tmp_path: Path
) -> None:
    path_mm = np.array([[0.0, 10.0], [100.0, 40.0], [50.0, 60.0]])
    with simulated(name, line, tmp_path, path_mm=path_mm, count=50) as device:
        host, _, port = device.address.rpartition(":")
        where = ["-m", "tcp", "-p", port, host] if line == TCP else ["-m", "rtu", "-b", "115200", "-P", "none", device.address]
        done = subprocess.run(
            ["mbpoll", "-1", "-a", "1", *request_options, *where], capture_output=True, text=True, timeout=20, check=False
        )
    assert done.returncode == 0, done.stderr
    assert right(done.stdout), done.stdout
