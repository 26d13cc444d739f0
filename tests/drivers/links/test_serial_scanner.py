"""What pyserial raises and returns, and what becomes of it: a port of our own plays the library's."""

from binascii import crc_hqx
from collections.abc import Iterator

import pytest
import serial

from drivers.codecs.ascii_frames import AsciiDecoder
from drivers.errors import DeviceError, LinkError, ProtocolError
from drivers.links.link_settings import LinkSettings
from drivers.links.serial_scanner import SerialScanner
from drivers.source import Arrival, Damaged, PointBatch, ScanClosed, WireBytes


class Port:
    """Reads what it is told, then nothing."""

    def __init__(self, reads: list[bytes | Exception]) -> None:
        self.reads = reads
        self.timeout = 0.0
        self.closed = False

    @property
    def in_waiting(self) -> int:
        if self.reads and isinstance(self.reads[0], OSError) and not isinstance(self.reads[0], serial.SerialException):
            raise self.reads.pop(0)  # type: ignore[misc]
        return 0

    def read(self, size: int) -> bytes:
        found = self.reads.pop(0) if self.reads else b""
        if isinstance(found, Exception):
            raise found
        return found

    def write(self, data: bytes) -> int:
        return len(data)

    def close(self) -> None:
        self.closed = True


class Clock:
    """Half a second at each look."""

    def __init__(self) -> None:
        self.now_s = 0.0

    def __call__(self) -> float:
        self.now_s += 0.5
        return self.now_s


def run(monkeypatch: pytest.MonkeyPatch, port: Port) -> Iterator[Arrival]:
    monkeypatch.setattr(serial, "serial_for_url", lambda *_, **__: port)
    return SerialScanner("COM1", AsciiDecoder(), LinkSettings(115_200, "N", silence_s=3.0), clock=Clock()).arrivals()


FAILURES = [
    serial.SerialException("device reports readiness to read but returned no data"),
    serial.SerialTimeoutException("Write timeout"),
    serial.PortNotOpenError(),
    OSError(5, "Input/output error"),  # what in_waiting raises when the other end is gone
    PermissionError(13, "Access is denied"),  # what Windows raises when a USB adapter is pulled out
]


@pytest.mark.parametrize("failure", FAILURES, ids=lambda failure: type(failure).__name__)
def test_whatever_the_library_raises_is_a_lost_link(monkeypatch: pytest.MonkeyPatch, failure: Exception) -> None:
    port = Port([b"P,0", failure])
    arrivals = run(monkeypatch, port)
    assert isinstance(next(arrivals), WireBytes)
    assert next(arrivals) == Damaged(3, "line cut off where the link ended")
    with pytest.raises(LinkError, match="COM1: the link was lost"):
        next(arrivals)
    assert port.closed


@pytest.mark.parametrize("failure", [*FAILURES, ValueError("Not a valid baudrate: -1")], ids=lambda failure: type(failure).__name__)
def test_whatever_opening_raises_is_a_link_that_cannot_be_opened(monkeypatch: pytest.MonkeyPatch, failure: Exception) -> None:
    def refuse(*_: object, **__: object) -> Port:
        raise failure

    monkeypatch.setattr(serial, "serial_for_url", refuse)
    with pytest.raises(LinkError, match=r"COM1: cannot be opened: .*is it plugged in, free, and named right"):
        list(SerialScanner("COM1", AsciiDecoder()).arrivals())


def test_silence_is_a_lost_link(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(LinkError, match="silent for 3 s; is the device switched on"):
        list(run(monkeypatch, Port([])))


def test_nothing_but_garbage_is_a_wrong_protocol(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(ProtocolError, match="not one valid frame; check baud rate"):
        list(run(monkeypatch, Port([b"\x00\xff\n"] * 100)))


def sealed(text: bytes) -> bytes:
    return b"%b*%04X\r\n" % (text, crc_hqx(text, 0xFFFF))


POINTS = [sealed(b"P,%d,%d,1,2,3,0" % (number, number)) for number in range(30)]


def test_a_scan_without_one_usable_point_says_what_became_of_its_points(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(ProtocolError, match=r"COM1: not one point of the scan can be used: 30 points rejected \(no scan header arrived"):
        list(run(monkeypatch, Port([*POINTS, sealed(b"E,30")])))


def test_bytes_of_which_none_is_sound_are_not_called_silence(monkeypatch: pytest.MonkeyPatch) -> None:
    lines = b"".join(POINTS).replace(b"\r\n", b"\n")
    complaint = rf"not one valid frame; check baud rate.*{len(lines)} bytes damaged \(line that ends with line feed alone"
    with pytest.raises(ProtocolError, match=complaint):
        list(run(monkeypatch, Port([lines])))


def test_a_device_that_only_says_the_same_again_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    opening = sealed(b"S,d,1,mm,3")
    with pytest.raises(LinkError, match="for 3 s no new point and no moving heartbeat"):
        list(run(monkeypatch, Port([opening, *POINTS[:3], *(1000 * [POINTS[2] + opening])])))


def test_nothing_behind_the_end_is_handed_on(monkeypatch: pytest.MonkeyPatch) -> None:
    one = sealed(b"S,d,1,mm,3") + b"".join(POINTS[:3]) + sealed(b"E,3")
    arrivals = list(run(monkeypatch, Port([one + sealed(b"S,d,2,mm,30") + b"".join(POINTS)])))
    assert isinstance(arrivals[-1], ScanClosed)
    assert sum(len(arrival) for arrival in arrivals if isinstance(arrival, PointBatch)) == 3


def test_every_error_is_a_device_error() -> None:
    assert issubclass(LinkError, DeviceError)
    assert issubclass(ProtocolError, DeviceError)
