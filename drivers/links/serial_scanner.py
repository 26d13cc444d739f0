"""A scanner on a serial port, or on a line that stands for one: the only file of drivers that knows pyserial.

Parity errors and overruns do not show through pyserial, on any system: checksums and counters in the format must
tell them. What pyserial raises becomes a `LinkError` here.
"""

import os
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import closing, suppress

import serial

from drivers.errors import DeviceError, LinkError, ProtocolError
from drivers.links.address import HostPort, device_address, require_port
from drivers.links.line import Line, Opener
from drivers.links.link_settings import LinkSettings
from drivers.links.reconnect import keep_up
from drivers.links.tcp_line import POLL_S, WRITE_S, TcpLine, open_tcp
from drivers.links.watch import Watch, explained
from drivers.source import Arrival, Decoder, ScanClosed, WireBytes

USUAL = LinkSettings(115_200, "N")


def ports() -> list[tuple[str, str]]:
    """Return the serial ports of this computer: name and what the system says of it."""
    from serial.tools import list_ports  # noqa: PLC0415 - it looks through the system's devices, for nobody but who asks

    return [(port.device, port.description) for port in list_ports.comports()]


class SerialScanner:
    """Points of one scan from the name of a port of this computer, from `host:port`, or from a place that is opened in a way of its own."""

    def __init__(
        self,
        address: str | Opener,
        decoder: Decoder,
        settings: LinkSettings = USUAL,
        *,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """Raises ValueError for an address that is none."""
        self._place = device_address(address) if isinstance(address, str) else address
        self._address = address if isinstance(address, str) else address.words
        self._decoder = decoder
        self._settings = settings
        self._clock = clock
        self._stopped = threading.Event()

    def stop(self) -> None:
        """End `arrivals` within half a second."""
        self._stopped.set()

    def arrivals(self) -> Iterator[Arrival]:
        """Open the link, yield what arrives, end with `ScanClosed`."""
        settings, stopped = self._settings, self._stopped
        kept_up = keep_up(self._open, self._scan, reconnect_s=settings.reconnect_s, stopped=stopped, clock=self._clock)
        return explained(self._address, kept_up)

    def _scan(self, port: Line, until_s: float) -> Iterator[Arrival]:
        watch = Watch(self._settings.silence_s, until_s, self._clock())
        try:
            while not self._stopped.is_set():
                self._write(port, self._decoder.request())
                if data := self._read(port):
                    yield WireBytes(self._clock(), data)
                    found = self._decoder.feed(data)
                    for arrival in found:
                        yield arrival
                        if isinstance(arrival, ScanClosed):
                            self._say_goodbye(port)
                            return
                    watch.note(found, self._clock())
                self._raise_if_over(watch)
        except DeviceError:  # whatever ends the scan, the begun frame is accounted for
            yield from self._decoder.break_off()
            raise

    def _say_goodbye(self, port: Line) -> None:
        """Send what the device has to hear at the end of the scan; a device that is gone by then need not hear it."""
        with suppress(LinkError):
            self._write(port, self._decoder.request())

    def _raise_if_over(self, watch: Watch) -> None:
        """Raise what a link without news shows."""
        now_s, silence_s = self._clock(), self._settings.silence_s
        if not watch.is_over(now_s):
            return
        if watch.garbled and (not watch.heard_sound or now_s - watch.last_byte_s < silence_s / 2):
            line = f"baud rate ({self._settings.baud_rate}), parity ({self._settings.parity}) and " if isinstance(self._place, str) else ""
            raise ProtocolError(
                f"{self._address}: bytes arrive but for {silence_s:g} s not one valid frame; check {line}the format of the device"
            )
        if watch.told and not watch.garbled:
            raise LinkError(f"{self._address}: bytes arrive, but for {silence_s:g} s no new point and no moving heartbeat; is it scanning?")
        raise LinkError(f"{self._address}: silent for {silence_s:g} s; is the device switched on and scanning?")

    def _open(self, until_s: float) -> closing[Line]:
        """Open the line for as long as the context is entered, within the silence that is borne, and not beyond `until_s`."""
        within_s = min(self._settings.silence_s, until_s - self._clock())
        try:
            if isinstance(self._place, HostPort):
                return closing(TcpLine(open_tcp(self._place, within_s, self._stopped)))
            if not isinstance(self._place, str):
                return closing(self._place.open(within_s, self._stopped))
            require_port(self._place)
            return closing(_PortLine(self._place, self._settings))
        except (serial.SerialException, OSError, ValueError) as error:
            hint = "is it plugged in, free, and named right? `cmmlink ports` lists the ports"
            if isinstance(self._place, HostPort):
                hint = "is it switched on, free and in the network, and are host and port right?"
            elif not isinstance(self._place, str):
                hint = self._place.hint
            raise LinkError(f"{self._address}: cannot be opened: {error}; {hint}") from error

    def _read(self, port: Line) -> bytes:
        """Return what is there, at the latest after POLL_S."""
        try:
            return port.read()
        except (serial.SerialException, OSError) as error:
            raise LinkError(f"{self._address}: the link was lost: {error}") from error

    def _write(self, port: Line, data: bytes) -> None:
        if not data:
            return
        try:
            port.write(data)
        except (serial.SerialException, OSError) as error:
            raise LinkError(f"{self._address}: the link was lost: {error}") from error


class _PortLine:
    """A serial port of this computer."""

    def __init__(self, name: str, settings: LinkSettings) -> None:
        options = {"exclusive": True} if os.name == "posix" else {}
        self._port = serial.serial_for_url(
            name, baudrate=settings.baud_rate, parity=settings.parity, timeout=POLL_S, write_timeout=WRITE_S, **options
        )

    def read(self) -> bytes:
        return bytes(self._port.read(max(1, self._port.in_waiting)))

    def write(self, data: bytes) -> None:
        self._port.write(data)

    def close(self) -> None:
        self._port.close()
