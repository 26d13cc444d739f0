"""The simulated scanner and the serial source on a real pseudo-terminal and a real TCP connection."""

import os
import threading
from pathlib import Path

import numpy as np
import pytest

from drivers.codecs.ascii_frames import AsciiDecoder
from drivers.errors import LinkError, ProtocolError
from drivers.links.link_settings import LinkSettings
from drivers.links.serial_scanner import SerialScanner
from drivers.source import Arrival, Heartbeat, LinkDown, LinkUp, PointBatch, ScanClosed, ScanOpened
from tests.drivers.codecs.streams import Account, account, only_sent_points
from tests.integration.simulated import Simulated, simulated

LINES = [
    pytest.param("pty", marks=pytest.mark.skipif(os.name != "posix", reason="pseudo-terminals exist on POSIX systems only")),
    "127.0.0.1:0",
]
COUNT = 1000


def scanned(device: Simulated, silence_s: float = 60.0) -> Account:
    return account(SerialScanner(device.address, AsciiDecoder(), LinkSettings(115_200, "N", silence_s=silence_s)).arrivals())


@pytest.mark.parametrize("line", LINES)
def test_every_point_arrives_as_it_was_measured(line: str, tmp_path: Path) -> None:
    with simulated("serial", line, tmp_path, "--unpaced") as device:
        book = scanned(device)
    assert book.sequence == list(range(COUNT))
    only_sent_points(book, device.sent_mm, within_mm=0.51e-6)
    assert book.others == [ScanOpened("simulated scanner", "SIM-0001", COUNT), ScanClosed(COUNT)]
    np.testing.assert_allclose(book.time_s, np.arange(COUNT) / 2000.0, atol=0.51e-6)
    assert {kind for kind, _ in book.counts} == {"WireBytes"}


@pytest.mark.parametrize("line", LINES)
def test_damage_gives_no_wrong_point_and_the_true_loss(line: str, tmp_path: Path) -> None:
    faults = ["flip:0.002@10", "lost-frames:0.02", "repeated-frames:0.02", "reordered-frames:0.02", "gap:30@500", "burst:200@700"]
    with simulated("serial", line, tmp_path, "--unpaced", *(f"--fault={fault}" for fault in faults)) as device:
        book, tally = scanned(device), device.tally()
    only_sent_points(book, device.sent_mm, within_mm=0.51e-6)
    assert len(set(book.sequence)) == len(book.sequence)
    assert book.lost == COUNT - len(book.sequence)
    assert book.lost >= tally["lost-frames"] + tally["gap"] > 40
    assert book.total("Damaged") > 0
    assert 0 < book.counts["Rejected", "frame repeated"] <= tally["repeated-frames"]


def test_points_marked_invalid_are_rejected(tmp_path: Path) -> None:
    with simulated("serial", "127.0.0.1:0", tmp_path, "--unpaced", "--fault=invalid:0.05") as device:
        book, tally = scanned(device), device.tally()
    assert book.counts["Rejected", "marked invalid by the device"] == tally["invalid"] > 0
    assert len(book.sequence) + tally["invalid"] == COUNT
    assert book.lost == 0


@pytest.mark.parametrize("line", LINES)
def test_a_device_that_dies_ends_with_a_clear_error_and_what_was_received(line: str, tmp_path: Path) -> None:
    arrivals: list[Arrival] = []
    with simulated("serial", line, tmp_path, "--fault=die@400") as device:
        with pytest.raises(LinkError, match="the link was lost"):
            arrivals.extend(SerialScanner(device.address, AsciiDecoder()).arrivals())
        device.process.join()
        assert device.process.exitcode == 9
    assert account(arrivals).sequence == list(range(len(account(arrivals).sequence)))


@pytest.mark.parametrize("line", LINES)
def test_a_killed_device_ends_with_a_clear_error(line: str, tmp_path: Path) -> None:
    with simulated("serial", line, tmp_path, "--fault=stall:60@500") as device:
        arrivals = SerialScanner(device.address, AsciiDecoder()).arrivals()
        first = next(len(arrival) for arrival in arrivals if isinstance(arrival, PointBatch))
        device.process.kill()
        with pytest.raises(LinkError, match="the link was lost"):
            list(arrivals)
    assert 0 < first < COUNT


@pytest.mark.parametrize("line", LINES)
def test_an_unplugged_line_comes_back_and_the_run_goes_on(line: str, tmp_path: Path) -> None:
    with simulated("serial", line, tmp_path, "--fault=unplug:0.05@300") as device:
        arrivals = list(SerialScanner(device.address, AsciiDecoder(), LinkSettings(115_200, "N", reconnect_s=20.0)).arrivals())
    book = account(arrivals)
    kinds = [type(arrival) for arrival in book.others]
    assert kinds == [ScanOpened, LinkDown, LinkUp, ScanClosed]
    only_sent_points(book, device.sent_mm, within_mm=0.51e-6)
    assert 300 <= len(book.sequence) == COUNT - book.lost


def test_a_silent_device_is_told_from_a_slow_one(tmp_path: Path) -> None:
    """Here time passes with heartbeats alone, two of which are longer than the silence that is borne."""
    now_s, arrivals = [0.0], list[Arrival]()
    with simulated("serial", "127.0.0.1:0", tmp_path, "--fault=stall:1.2@200") as device:
        settings = LinkSettings(115_200, "N", silence_s=10.0)
        for arrival in SerialScanner(device.address, AsciiDecoder(), settings, clock=lambda: now_s[0]).arrivals():
            arrivals.append(arrival)
            now_s[0] += 6.0 * isinstance(arrival, Heartbeat)
    assert account(arrivals).sequence == list(range(COUNT))
    assert now_s[0] >= 12.0
    with (
        simulated("serial", "127.0.0.1:0", tmp_path, "--fault=silence@200") as device,
        pytest.raises(LinkError, match=r"silent for 0\.3 s"),
    ):
        scanned(device, silence_s=0.3)


def test_bytes_of_another_format_are_called_so(tmp_path: Path) -> None:
    garbled = simulated("serial", "127.0.0.1:0", tmp_path, "--fault=flip:0.5", "--fault=stall:30@900")
    with garbled as device, pytest.raises(ProtocolError, match="not one valid frame; check the format"):
        scanned(device, silence_s=0.2)


def test_stop_ends_the_scan_from_another_thread(tmp_path: Path) -> None:
    with simulated("serial", "127.0.0.1:0", tmp_path, "--fault=silence@100") as device:
        source = SerialScanner(device.address, AsciiDecoder(), LinkSettings(115_200, "N", silence_s=60.0))
        ended = threading.Thread(target=lambda: list(source.arrivals()))
        ended.start()
        source.stop()
        ended.join(timeout=10.0)
        assert not ended.is_alive()


def test_a_port_that_is_not_there_is_named() -> None:
    with pytest.raises(LinkError, match="no-such-port: cannot be opened"):
        list(SerialScanner("no-such-port", AsciiDecoder()).arrivals())


@pytest.mark.skipif(os.name != "posix", reason="ports are shared out on POSIX systems only when asked for")
def test_a_port_in_use_is_refused(tmp_path: Path) -> None:
    with simulated("serial", "pty", tmp_path) as device:
        first = SerialScanner(device.address, AsciiDecoder()).arrivals()
        next(first)
        with pytest.raises(LinkError, match="cannot be opened"):
            next(iter(SerialScanner(device.address, AsciiDecoder()).arrivals()))


@pytest.mark.parametrize("line", LINES)
def test_a_restarted_device_begins_a_new_scan(line: str, tmp_path: Path) -> None:
    with simulated("serial", line, tmp_path, "--fault=restart:0.05@300") as device:
        arrivals = list(SerialScanner(device.address, AsciiDecoder(), LinkSettings(115_200, "N", reconnect_s=20.0)).arrivals())
    assert [type(arrival) for arrival in account(arrivals).others] == [ScanOpened, LinkDown, LinkUp, ScanOpened, ScanClosed]
    again = account(arrivals[max(place for place, arrival in enumerate(arrivals) if isinstance(arrival, ScanOpened)) :])
    assert (again.sequence, again.lost) == (list(range(COUNT)), 0)
    only_sent_points(again, device.sent_mm, within_mm=0.51e-6)


def test_a_fault_that_makes_no_sense_on_a_stream_is_refused(tmp_path: Path) -> None:
    with pytest.raises(AssertionError, match="said no address"), simulated("serial", "127.0.0.1:0", tmp_path, "--fault=word-swap"):
        pass
