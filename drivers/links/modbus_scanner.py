"""A scanner behind Modbus TCP or RTU, described by a register map: the only file of drivers that knows pymodbus.

One synchronous client, one request in flight, no retries inside the library. An answer that does not come in time may
still come later, and over RTU nothing tells it from the answer to the next request: so the link is closed, left alone
for twice as long as an answer may take, and opened again, which forgets what came meanwhile, before anything is asked.
"""

import logging
import struct
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import closing
from math import inf
from typing import Protocol

from pymodbus.client import ModbusSerialClient, ModbusTcpClient
from pymodbus.client.base import ModbusBaseSyncClient
from pymodbus.exceptions import ConnectionException, ModbusIOException
from pymodbus.pdu import ModbusPDU
from pymodbus.pdu.file_message import ReadFifoQueueResponse

from drivers.codecs.register_pdus import EXCEPTIONS, PASSING, READ_FIFO
from drivers.errors import DeviceError, LinkError
from drivers.links.address import HostPort, device_address, require_port
from drivers.links.link_settings import LinkSettings
from drivers.links.reconnect import keep_up
from drivers.links.tcp_line import open_tcp
from drivers.links.watch import Watch, explained
from drivers.source import Arrival, Decoder, PointBatch, ScanClosed, WireBytes

TRIES = 3  # of one request, before the link counts as lost
USUAL = LinkSettings(19_200, "E")  # of an RTU line, as the standard says
LONGEST_PAUSE_S = 0.05  # between two requests of a device that asks for patience
LEAST_PATIENCE_S = 0.05  # with the answer to one request, however little the scan has left
FAILURE = 4  # an exception that is a refusal only while no point has come


class FifoAnswer(ReadFifoQueueResponse):
    """The answer to function 24 with its true length: the library forgets the two bytes of the count itself."""

    @classmethod
    def calculateRtuFrameSize(cls, data: bytes) -> int:  # noqa: N802 - the library's name
        """Return address, function, byte count (2), bytes counted, checksum (2)."""
        return 6 + int.from_bytes(data[2:4], "big") if len(data) >= 4 else 0


class Asker(Decoder, Protocol):
    """What decides which registers are read next."""

    @property
    def idle(self) -> bool:
        """Whether nothing new was there, so that the next request may wait a little."""


class ModbusScanner:
    """Points of one scan from registers: `host:port` speaks TCP, any other address is the port of an RTU line."""

    def __init__(
        self,
        address: str,
        decoder: Asker,
        settings: LinkSettings = USUAL,
        *,
        device_id: int = 1,
        timeout_s: float = 1.0,
        poll_s: float = 0.002,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """`timeout_s` must exceed the slowest answer; `poll_s` is the pause when nothing new was there.

        Raises ValueError for an address that is none.
        A device that answers, but with no new point and no moving heartbeat, is as silent as one that does not.
        """
        self._place = device_address(address)
        self._address = address
        self._decoder = decoder
        self._settings = settings
        self._device_id = device_id
        self._timeout_s = timeout_s
        self._poll_s = poll_s
        self._clock = clock
        self._stopped = threading.Event()
        self._late_s = 0.0 if isinstance(self._place, HostPort) else 2 * timeout_s  # over TCP a late answer dies with its connection
        self._quiet_until_s = -inf
        self._has_points = False

    def stop(self) -> None:
        """End `arrivals` within the time-out of one request."""
        self._stopped.set()

    def arrivals(self) -> Iterator[Arrival]:
        """Open the link, yield what arrives, end after `ScanClosed`."""
        settings, stopped = self._settings, self._stopped
        kept_up = keep_up(self._open, self._scan, reconnect_s=settings.reconnect_s, stopped=stopped, clock=self._clock)
        return explained(self._address, kept_up)

    def _scan(self, client: "_TimedClient", until_s: float) -> Iterator[Arrival]:
        watch = Watch(self._settings.silence_s, until_s, self._clock())
        try:
            yield from self._decoder.break_off()
            while not self._stopped.is_set():
                request = self._decoder.request()
                answer = self._ask(client, request, watch)
                if answer is None:
                    return
                yield WireBytes(self._clock(), request + answer)
                found = self._decoder.feed(request + answer)
                for arrival in found:
                    yield arrival
                    if isinstance(arrival, ScanClosed):
                        return
                    self._has_points |= isinstance(arrival, PointBatch)
                watch.note(found, self._clock())
                if watch.is_over(self._clock()):
                    silence = f"for {self._settings.silence_s:g} s without a new point or a moving heartbeat"
                    raise LinkError(f"{self._address}: the device answers, but {silence}; is it scanning?")
                if self._decoder.idle:
                    self._stopped.wait(self._poll_s)
        except DeviceError:  # whatever ends the scan, what was decoded before is handed over
            yield from self._decoder.break_off()
            raise

    def _ask(self, client: "_TimedClient", request: bytes, watch: Watch) -> bytes | None:
        """Return the data unit of the answer, asking again where it did not come; None when told to stop."""
        began_s, missing, busy = self._clock(), 0, 0
        while not self._stopped.is_set():
            client.within(max(LEAST_PATIENCE_S, min(self._timeout_s, watch.left_s(self._clock()))))
            try:
                response = _execute(client, request, self._device_id)
            except (ConnectionException, OSError) as error:  # the library lets a reset connection through as it is
                raise LinkError(f"{self._address}: the link was lost: {error}") from error
            except ModbusIOException as error:
                missing += 1
                if missing >= TRIES or watch.is_over(self._clock() + self._late_s):
                    self._quiet_until_s = self._clock() + self._late_s
                    raise LinkError(self._words_of_no_answer(missing, client.heard)) from error
                self._let_late_answers_pass(client)
                continue
            if not self._may_pass(response):
                return _unit(response)
            busy, asked_s = busy + 1, self._clock() - began_s
            if busy >= TRIES and (asked_s >= self._timeout_s or watch.is_over(self._clock())):
                what = f"exception {response.exception_code} ({EXCEPTIONS[response.exception_code]})"
                raise LinkError(f"{self._address}: answers {what} for {asked_s:.1f} s, {busy} times in a row; is it free and connected?")
            self._stopped.wait(min(self._poll_s * 2 ** min(busy, 10), LONGEST_PAUSE_S))
        return None

    def _may_pass(self, response: ModbusPDU) -> bool:
        """Tell whether an answer is an exception that may be gone when the same is asked again."""
        return response.isError() and (response.exception_code in PASSING or (response.exception_code == FAILURE and self._has_points))

    def _words_of_no_answer(self, missing: int, heard: int) -> str:
        times = f"{missing} times in a row" if missing > 1 else "once, and there was no time left to ask again"
        if heard:
            line = f"RTU at {self._settings.baud_rate} baud, parity {self._settings.parity}"
            speaks = "TCP" if isinstance(self._place, HostPort) else line
            return f"{self._address}: {heard} bytes arrived, but no answer to the request, {times}; does the device speak Modbus {speaks}?"
        waited_s = min(self._timeout_s, self._settings.silence_s)
        return f"{self._address}: no answer within {waited_s:g} s, {times}; is the device switched on, and its device id {self._device_id}?"

    def _let_late_answers_pass(self, client: "_TimedClient") -> None:
        _close(client)
        self._stopped.wait(self._late_s)
        client.within(self._timeout_s)
        if not self._stopped.is_set() and not client.connect() and not self._stopped.is_set():
            raise LinkError(f"{self._address}: the link was lost and does not open again")

    def _open(self, until_s: float) -> "closing[_TimedClient]":
        """Open the link for as long as the context is entered, within the silence that is borne, and not beyond `until_s`."""
        if not (log := logging.getLogger("pymodbus")).handlers:
            log.addHandler(logging.NullHandler())  # what it logs reaches the operator as an error of ours, not as stray lines
        self._stopped.wait(max(0.0, min(self._quiet_until_s, until_s) - self._clock()))
        place, timeout_s = self._place, self._timeout_s
        client: _TimedClient
        if isinstance(place, HostPort):
            client = _TcpClient(place, timeout_s, self._stopped)
            client.within(min(timeout_s, self._settings.silence_s, until_s - self._clock()))
        else:
            require_port(place)
            client = _PortClient(place, timeout=timeout_s, retries=0, baudrate=self._settings.baud_rate, parity=self._settings.parity)
        client.register(FifoAnswer)
        if not client.connect():
            why = f": {client.failure}" if client.failure else ""
            raise LinkError(f"{self._address}: no Modbus device opens there{why}; is it switched on, plugged in, free, and named right?")
        return closing(client)


class _TimedClient(ModbusBaseSyncClient):
    """A client of the library whose answers may trickle in without stretching the time for them."""

    _end_s = inf
    heard = 0
    failure = ""  # why the link did not open, where that is known

    def within(self, seconds: float) -> None:
        """Set the time for opening the link, or for the whole of the next answer; `heard` counts the bytes that come in it."""
        self._end_s = time.monotonic() + seconds
        self.heard = 0

    @property
    def _left_s(self) -> float:
        return max(0.0, self._end_s - time.monotonic())

    def _noted(self, data: bytes) -> bytes:
        self.heard += len(data)
        return data


class _TcpClient(_TimedClient, ModbusTcpClient):
    def __init__(self, place: HostPort, timeout_s: float, stopped: threading.Event) -> None:
        super().__init__(place.host.strip("[]"), port=place.port, timeout=timeout_s, retries=0)
        self._place = place
        self._stopped = stopped

    def connect(self) -> bool:
        """Open the connection, if there is none."""
        if self.socket is None:
            try:
                self.socket = open_tcp(self._place, self._left_s, self._stopped)
            except (OSError, LinkError) as error:
                self.failure = str(error)
        return self.socket is not None

    def recv(self, size: int | None) -> bytes:
        """Return what arrives while there is time; nothing at all afterwards."""
        self.comm_params.timeout_connect = self._left_s
        return self._noted(super().recv(size))


class _PortClient(_TimedClient, ModbusSerialClient):
    def recv(self, size: int | None) -> bytes:
        """Return what arrives while there is time; nothing at all afterwards."""
        self.comm_params.timeout_connect = self._left_s
        return self._noted(super().recv(size))


class _Closable(Protocol):
    def close(self) -> object: ...


def _close(client: _Closable) -> None:
    client.close()


def _execute(client: ModbusBaseSyncClient, request: bytes, device_id: int) -> ModbusPDU:
    """Send one request and wait for its answer."""
    address, count = struct.unpack(">H", request[1:3])[0], int.from_bytes(request[3:], "big")
    if request[0] == READ_FIFO:
        return client.read_fifo_queue(address=address, device_id=device_id)
    if request[0] == 3:
        return client.read_holding_registers(address, count=count, device_id=device_id)
    return client.read_input_registers(address, count=count, device_id=device_id)


def _unit(response: ModbusPDU) -> bytes:
    """Return the data unit as it passed over the wire: function and data."""
    if response.isError():
        return bytes([response.function_code | 0x80, response.exception_code])
    return bytes([response.function_code]) + response.encode()
