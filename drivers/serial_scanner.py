"""A scanner on a serial port, or on a TCP socket that stands for one: the only file of drivers that knows pyserial.

Parity errors and overruns do not show through pyserial, on any system: checksums and counters in the format must
tell them. What pyserial raises becomes a `LinkError` here.
"""

import os
import threading
import time
from collections.abc import Callable, Iterator

import serial
from serial.tools import list_ports

from .errors import LinkError
from .source import Arrival, Damaged, Decoder, ScanClosed, WireBytes

POLL_S = 0.05  # how long a read waits before it looks whether to stop
LARGEST_READ = 1 << 16


def ports() -> list[tuple[str, str]]:
    """Return the serial ports of this computer: name and what the system says of it."""
    return [(port.device, port.description) for port in list_ports.comports()]


class SerialScanner:
    """Points of one scan from a serial address: a port name, `host:port` or any address pyserial knows."""

    def __init__(
        self,
        address: str,
        decoder: Decoder,
        *,
        baud_rate: int = 115_200,
        parity: str = serial.PARITY_NONE,
        silence_s: float = 3.0,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """`silence_s`: without a byte for so long the device counts as gone."""
        self._address = serial_address(address)
        self._decoder = decoder
        self._baud_rate = baud_rate
        self._parity = parity
        self._silence_s = silence_s
        self._clock = clock
        self._stopped = threading.Event()

    def stop(self) -> None:
        """End `arrivals` within half a second."""
        self._stopped.set()

    def arrivals(self) -> Iterator[Arrival]:
        """Open the link, yield what arrives, end after `ScanClosed`."""
        port = self._open()
        try:
            yield from self._scan(port)
        finally:
            port.close()

    def _scan(self, port: serial.Serial) -> Iterator[Arrival]:
        self._write(port, self._decoder.request())
        last_byte_s = last_sound_s = self._clock()
        while not self._stopped.is_set():
            try:
                data = self._read(port)
            except LinkError:
                yield from self._decoder.interrupted()
                raise
            now_s = self._clock()
            if not data:
                if now_s - last_byte_s > self._silence_s:
                    yield from self._decoder.interrupted()
                    raise LinkError(f"{self._address}: silent for {self._silence_s:g} s; is the device switched on and scanning?")
                continue
            last_byte_s = now_s
            yield WireBytes(now_s, data)
            found = self._decoder.feed(data)
            yield from found
            if any(isinstance(arrival, ScanClosed) for arrival in found):
                return
            if not all(isinstance(arrival, Damaged) for arrival in found):
                last_sound_s = now_s
            elif found and now_s - last_sound_s > self._silence_s:
                raise LinkError(
                    f"{self._address}: bytes arrive but for {self._silence_s:g} s not one valid frame; "
                    f"check baud rate ({self._baud_rate}), parity ({self._parity}) and the format of the device"
                )

    def _open(self) -> serial.Serial:
        options = {"exclusive": True} if os.name == "posix" else {}
        try:
            return serial.serial_for_url(
                self._address, baudrate=self._baud_rate, parity=self._parity, timeout=POLL_S, write_timeout=1.0, **options
            )
        except (serial.SerialException, OSError, ValueError) as error:
            hint = "is it plugged in, free, and named right? `cmmlink ports` lists the ports"
            raise LinkError(f"{self._address}: cannot be opened: {error}; {hint}") from error

    def _read(self, port: serial.Serial) -> bytes:
        """Return what is there, at the latest after POLL_S."""
        try:
            if "://" not in self._address:
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


def serial_address(text: str) -> str:
    """Return pyserial's address for `host:port`, and everything else as it is."""
    host, colon, port = text.rpartition(":")
    if colon and host and "/" not in text and port.isdigit():
        return f"socket://{text}"
    return text
