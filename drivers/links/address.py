"""Which addresses are opened: a serial port of this computer, or a host and its port, and nothing else.

The libraries below know many more ways to write an address. Some of them write to files or search the network before they look
at the port, so an address reaches them only after it was checked here.
"""

import os
import re
import stat
from dataclasses import dataclass
from pathlib import Path

from drivers.errors import LinkError

MOST_PORTS = 65535
LONGEST_HOST = 253
LABEL = re.compile(r"[A-Za-z0-9_](?:[A-Za-z0-9_-]{0,61}[A-Za-z0-9_])?")
NUMBERS = re.compile(r"\[[0-9A-Fa-f:.]{2,45}\]")
WINDOWS_PORT = re.compile(r"COM[1-9][0-9]{0,2}", re.IGNORECASE)
WORD = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}")
DEVICES = Path("/dev")
KINDS = Path("/sys/dev/char")


@dataclass(frozen=True, slots=True)
class HostPort:
    """A TCP socket that stands for a line: `host` as it is written, an IPv6 address in brackets."""

    host: str
    port: int


def device_address(text: str) -> HostPort | str:
    """Take an address apart: `host:port`, or the name of a serial port. Raises ValueError for everything else.

    The name may belong to a port that is not plugged in yet; `require_port` looks whether it is there.
    """
    host, colon, port = text.rpartition(":")
    if colon and re.fullmatch(r"[0-9]{1,5}", port) and len(host) <= LONGEST_HOST and _is_host(host):
        if not 1 <= int(port) <= MOST_PORTS:
            raise ValueError(f"address {text!r:.200}: port {int(port)} is none of 1 to {MOST_PORTS}")
        return HostPort(host, int(port))
    if WORD.fullmatch(text):
        return text
    if "://" not in text and text.isprintable() and text.startswith("/") and not text.startswith("//"):  # a share of another computer
        if os.path.exists(text) and not _may_be_character_device(text):
            raise ValueError(f"address {text!r:.200} is no serial port but another file; `cmmlink ports` lists the ports")
        return text
    known = "neither host:port nor the name of a serial port like COM3 or /dev/ttyUSB0"
    raise ValueError(f"address {text!r:.200} is {known}; `cmmlink ports` lists the ports")


def require_port(name: str) -> None:
    """Raise LinkError unless `name` is a serial port that this computer has now."""
    try:
        if WINDOWS_PORT.fullmatch(name) or (name.startswith("/") and _is_character_device(name)):
            return
    except OSError as error:
        raise LinkError(f"{name}: cannot be opened: {error}") from error
    hint = "is it plugged in, and named right? `cmmlink ports` lists the ports"
    raise LinkError(f"{name}: cannot be opened: this computer has no such port; {hint}")


def _is_host(text: str) -> bool:
    """Tell whether `text` is a name whose labels are as the network wants them, or an address of numbers."""
    return NUMBERS.fullmatch(text) is not None or all(LABEL.fullmatch(label) for label in text.split("."))


def _is_character_device(name: str) -> bool:
    """Tell whether `name`, or what it is a link to, is a character device below /dev, as ports and pseudo-terminals are.

    Where the system says what kind of device it is (Linux), only terminals are: to open a watchdog restarts the computer.
    Raises OSError where it cannot be looked at.
    """
    try:
        path = Path(name).resolve()
        status = path.stat()
        if not (path.is_relative_to(DEVICES) and stat.S_ISCHR(status.st_mode)):
            return False
        kind = KINDS / f"{os.major(status.st_rdev)}:{os.minor(status.st_rdev)}" / "subsystem"
        return not kind.exists() or kind.resolve().name == "tty"
    except (FileNotFoundError, NotADirectoryError, RuntimeError, ValueError):
        return False


def _may_be_character_device(name: str) -> bool:
    """The same, and true where it cannot be looked at: `require_port` looks again and says why."""
    try:
        return _is_character_device(name)
    except OSError:
        return True
