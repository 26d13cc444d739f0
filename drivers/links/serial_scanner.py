"""A scanner on a serial port, or on a TCP socket that stands for one: the only file of drivers that knows pyserial.

Parity errors and overruns do not show through pyserial, on any system: checksums and counters in the format must
tell them. What pyserial raises becomes a `LinkError` here.
"""

import os
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import closing

import serial

from drivers.errors import DeviceError, LinkError, ProtocolError
from drivers.links.address import HostPort, device_address, require_port
from drivers.links.link_settings import LinkSettings
from drivers.links.reconnect import keep_up
from drivers.source import Arrival, Damaged, Decoder, ScanClosed, WireBytes

POLL_S = 0.05  # how long a read waits before it looks whether to stop
LARGEST_READ = 1 << 16
USUAL = LinkSettings(115_200, "N")


def ports() -> list[tuple[str, str]]:
    """Return the serial ports of this computer: name and what the system says of it."""
    from serial.tools import list_ports  # noqa: PLC0415 - it looks through the system's devices, for nobody but who asks

    return [(port.device, port.description) for port in list_ports.comports()]


class SerialScanner:
    """Points of one scan from a serial address: the name of a port of this computer, or `host:port`."""

    def __init__(
        self,
        address: str,
        decoder: Decoder,
        settings: LinkSettings = USUAL,
        *,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """Raises ValueError for an address that is none."""
        self._place = device_address(address)
        self._address = address
        self._decoder = decoder
        self._settings = settings
        self._clock = clock
        self._stopped = threading.Event()

    def stop(self) -> None:
        """End `arrivals` within half a second."""
        self._stopped.set()

    def arrivals(self) -> Iterator[Arrival]:
        """Open the link, yield what arrives, end after `ScanClosed`."""
        return keep_up(
            lambda: closing(self._open()), self._scan, reconnect_s=self._settings.reconnect_s, stopped=self._stopped, clock=self._clock
        )

    def _scan(self, port: serial.Serial) -> Iterator[Arrival]:
        watch = _Watch(self._settings.silence_s, self._clock())
        try:
            while not self._stopped.is_set():
                self._write(port, self._decoder.request())
                data = self._read(port)
                found: list[Arrival] = []
                if data:
                    yield WireBytes(self._clock(), data)
                    found = self._decoder.feed(data)
                    yield from found
                if any(isinstance(arrival, ScanClosed) for arrival in found):
                    self._write(port, self._decoder.request())
                    return
                self._raise_if_dead(watch.note_read(data, found, self._clock()))
        except DeviceError:  # whatever ends the scan, the begun frame is accounted for
            yield from self._decoder.break_off()
            raise

    def _raise_if_dead(self, state: str) -> None:
        """Raise what the watch found."""
        if state == "silent":
            raise LinkError(f"{self._address}: silent for {self._settings.silence_s:g} s; is the device switched on and scanning?")
        if state == "garbled":
            raise ProtocolError(
                f"{self._address}: bytes arrive but for {self._settings.silence_s:g} s not one valid frame; "
                f"check baud rate ({self._settings.baud_rate}), parity ({self._settings.parity}) and the format of the device"
            )

    def _open(self) -> serial.Serial:
        options = {"exclusive": True} if os.name == "posix" else {}
        if isinstance(self._place, HostPort):
            name = f"socket://{self._place.host}:{self._place.port}"
        else:
            name = self._place
            require_port(name)
        try:
            return serial.serial_for_url(
                name, baudrate=self._settings.baud_rate, parity=self._settings.parity, timeout=POLL_S, write_timeout=1.0, **options
            )
        except (serial.SerialException, OSError, ValueError) as error:
            hint = "is it plugged in, free, and named right? `cmmlink ports` lists the ports"
            raise LinkError(f"{self._address}: cannot be opened: {error}; {hint}") from error

    def _read(self, port: serial.Serial) -> bytes:
        """Return what is there, at the latest after POLL_S."""
        try:
            if not isinstance(self._place, HostPort):
                return bytes(port.read(max(1, port.in_waiting)))
            data = port.read(1)  # a socket does not tell how much is there: wait for the first byte, then take the rest
            if data:
                port.timeout = 0
                data += port.read(LARGEST_READ)
                port.timeout = POLL_S
            return bytes(data)
        except (serial.SerialException, OSError) as error:
            raise LinkError(f"{self._address}: the link was lost: {error}") from error

    def _write(self, port: serial.Serial, data: bytes) -> None:
        if not data:
            return
        try:
            port.write(data)
        except (serial.SerialException, OSError) as error:
            raise LinkError(f"{self._address}: the link was lost: {error}") from error


class _Watch:
    """Tells a device that is silent, or sends nothing sound, from one that is only slow."""

    def __init__(self, patience_s: float, now_s: float) -> None:
        self._patience_s = patience_s
        self._last_byte_s = self._last_sound_s = now_s

    def note_read(self, data: bytes, found: list[Arrival], now_s: float) -> str:
        """Take note of one read; return "silent", "garbled" or "" if all is well."""
        if not data:
            return "silent" if now_s - self._last_byte_s > self._patience_s else ""
        self._last_byte_s = now_s
        damaged = [isinstance(arrival, Damaged) for arrival in found]
        if not all(damaged):
            self._last_sound_s = now_s
        return "garbled" if any(damaged) and now_s - self._last_sound_s > self._patience_s else ""
