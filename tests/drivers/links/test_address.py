"""What is an address of a device, and what is refused before any library sees it."""

import os
import sys
from pathlib import Path

import pytest

from drivers.codecs.ascii_frames import AsciiDecoder
from drivers.codecs.register_decoder import RegisterDecoder
from drivers.errors import LinkError
from drivers.links.address import HostPort, device_address
from drivers.links.modbus_scanner import ModbusScanner
from drivers.links.serial_scanner import SerialScanner
from drivers.maps import shipped_map

REFUSED = [
    "alt://COM3",
    "hwgrep://(",
    "hwgrep://0403:6001",
    "loop://",
    "loop://?logging=debug",
    "cp2110://0",
    "rfc2217://127.0.0.1:4001",
    "socket://127.0.0.1:4001",
    "SPY://COM3",
    "",
    ":502",
    "host..name:502",
    ".host:502",
    "host:0",
    "host:65536",
    "ho st:502",
    "-host:502",
    f"{'a' * 64}:502",
    "[::1:502",
    "spy://x:1",
    "../port",
    "station.sqlite/x",
    "/dev/tty\n",
]


@pytest.mark.parametrize(
    ("given", "meant"),
    [
        ("127.0.0.1:4001", HostPort("127.0.0.1", 4001)),
        ("scanner.local:23", HostPort("scanner.local", 23)),
        ("my_gateway-2:502", HostPort("my_gateway-2", 502)),
        ("[::1]:502", HostPort("[::1]", 502)),
        ("COM3", "COM3"),
        ("/dev/ttyUSB0", "/dev/ttyUSB0"),
        ("/dev/serial/by-path/pci-0:1", "/dev/serial/by-path/pci-0:1"),
    ],
)
def test_an_address_is_a_port_or_a_host_with_its_port(given: str, meant: object) -> None:
    assert device_address(given) == meant


@pytest.mark.parametrize("text", REFUSED)
def test_every_other_address_is_refused_by_every_link(text: str) -> None:
    for make in (lambda: SerialScanner(text, AsciiDecoder()), lambda: ModbusScanner(text, RegisterDecoder(shipped_map("gocator")))):
        with pytest.raises(ValueError, match=r"address .* (neither host:port nor|port [0-9]+ is none of)"):
            make()


@pytest.mark.parametrize("scheme", ["spy://loop://?file={}", "spy://x?file={}", "spy:///dev/null?file={}", "{}", "file://{}"])
def test_no_address_touches_a_file(scheme: str, tmp_path: Path) -> None:
    record = tmp_path / "station.sqlite"
    record.write_bytes(b"all records")
    with pytest.raises(ValueError, match="address"):
        list(SerialScanner(scheme.format(record), AsciiDecoder()).arrivals())
    assert record.read_bytes() == b"all records"


@pytest.mark.skipif(os.name != "posix", reason="devices are files on POSIX systems only")
def test_only_a_character_device_below_dev_is_opened(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    os.mkfifo(tmp_path / "fifo")
    (tmp_path / "word").write_bytes(b"kept")
    with pytest.raises(ValueError, match="no serial port but another file"):
        device_address(str(tmp_path / "fifo"))
    with pytest.raises(LinkError, match="cannot be opened: this computer has no such port"):
        list(SerialScanner(str(tmp_path / "absent"), AsciiDecoder()).arrivals())
    monkeypatch.chdir(tmp_path)
    with pytest.raises(LinkError, match="word: cannot be opened: this computer has no such port"):
        list(SerialScanner("word", AsciiDecoder()).arrivals())
    master, slave = os.openpty()
    (tmp_path / "port").symlink_to(os.ttyname(slave))
    try:
        assert device_address(str(tmp_path / "port")) == str(tmp_path / "port")
    finally:
        os.close(master)
        os.close(slave)


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux says what kind of device a file is")
@pytest.mark.parametrize("name", ["/dev/null", "/dev/zero", "/dev/full", "/dev/random", "/dev/urandom", "/dev/shm/../null"])
def test_a_device_that_is_no_terminal_is_no_port(name: str, tmp_path: Path) -> None:
    (tmp_path / "port").symlink_to(name)
    for address in (name, str(tmp_path / "port")):
        with pytest.raises(ValueError, match="no serial port but another file"):
            device_address(address)


SCHEMES = ("alt", "cp2110", "hwgrep", "loop", "rfc2217", "socket", "spy", "file")
SPELLINGS = ("{}", "{} ", " {}", "\t{}", "{}\n", "\u200b{}", "\ufeff{}")


@pytest.mark.parametrize("scheme", [*SCHEMES, *(scheme.upper() for scheme in SCHEMES), *(scheme.title() for scheme in SCHEMES)])
def test_every_way_to_write_a_url_is_refused(scheme: str, tmp_path: Path) -> None:
    for rest in ("://x?file={}", "://", "://{}", "://localhost:502", "/{}", ":{}", ":\\\\{}"):
        for spelling in SPELLINGS:
            with pytest.raises(ValueError, match="address"):
                device_address(spelling.format(scheme + rest.format(tmp_path / "record")))


@pytest.mark.parametrize(
    "text",
    [
        "\\\\server\\share\\x",
        "\\\\.\\PhysicalDrive0",
        "//server/share",
        "C:\\x",
        "C:/x",
        "COM\u0661",
        "COM\u00b9",
        "host:\u0665\u0660\u0662",
        "host:5\n",
        "..",
        "~/x",
    ],
)
def test_paths_of_other_systems_and_digits_of_other_scripts_are_refused(text: str) -> None:
    with pytest.raises(ValueError, match="address"):
        device_address(text)
