"""Simulated binary scanners and the serial source on a real TCP connection."""

from pathlib import Path

import pytest

from drivers.codecs.binary_frames import BinaryDecoder
from drivers.links.link_settings import LinkSettings
from drivers.links.serial_scanner import SerialScanner
from drivers.source import LinkDown, LinkUp, ScanClosed, ScanOpened
from tests.drivers.codecs.streams import account, only_sent_points
from tests.integration.simulated import simulated

COUNT = 1000
HALF_UNIT_MM = 0.51e-5


@pytest.mark.parametrize("device", ["binary", "binary-block"])
def test_every_point_arrives_as_it_was_measured(device: str, tmp_path: Path) -> None:
    with simulated(device, "127.0.0.1:0", tmp_path) as running:
        book = account(SerialScanner(running.address, BinaryDecoder()).arrivals())
    assert book.sequence == list(range(COUNT))
    only_sent_points(book, running.sent_mm, HALF_UNIT_MM)
    assert [type(arrival) for arrival in book.others] == [ScanOpened, ScanClosed]


@pytest.mark.parametrize("device", ["binary", "binary-block"])
def test_damage_gives_no_wrong_point_and_the_true_loss(device: str, tmp_path: Path) -> None:
    faults = [
        "flip:0.001",
        "lost-bytes:0.0005",
        "inserted-bytes:0.0005",
        "lost-frames:0.02",
        "repeated-frames:0.02",
        "reordered-frames:0.02",
    ]
    options = ["--unpaced", *(f"--fault={fault}@64" for fault in faults)]
    with simulated(device, "127.0.0.1:0", tmp_path, *options, count=20_000) as running:
        book = account(SerialScanner(running.address, BinaryDecoder()).arrivals())
    only_sent_points(book, running.sent_mm, HALF_UNIT_MM)
    assert len(set(book.sequence)) == len(book.sequence)
    assert 0 < book.lost == 20_000 - len(book.sequence)
    assert book.total("Damaged") > 0


def test_an_unplugged_line_comes_back_and_the_run_goes_on(tmp_path: Path) -> None:
    with simulated("binary", "127.0.0.1:0", tmp_path, "--fault=unplug:0.05@300") as running:
        book = account(SerialScanner(running.address, BinaryDecoder(), LinkSettings(115_200, "N", reconnect_s=20.0)).arrivals())
    assert [type(arrival) for arrival in book.others] == [ScanOpened, LinkDown, LinkUp, ScanClosed]
    only_sent_points(book, running.sent_mm, HALF_UNIT_MM)
    assert 300 <= len(book.sequence) == COUNT - book.lost
