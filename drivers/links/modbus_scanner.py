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
from typing import Protocol

from pymodbus import ModbusException
from pymodbus.client import ModbusSerialClient, ModbusTcpClient
from pymodbus.client.base import ModbusBaseSyncClient
from pymodbus.exceptions import ConnectionException, ModbusIOException
from pymodbus.pdu import ModbusPDU
from pymodbus.pdu.file_message import ReadFifoQueueResponse

from drivers.codecs.register_decoder import RegisterDecoder
from drivers.codecs.register_pdus import READ_FIFO
from drivers.errors import LinkError
from drivers.links.address import HostPort, device_address, require_port
from drivers.links.link_settings import LinkSettings
from drivers.links.reconnect import keep_up
from drivers.source import Arrival, Damaged, ScanClosed, WireBytes

TRIES = 3  # of one request, before the link counts as lost
USUAL = LinkSettings(19_200, "E")  # of an RTU line, as the standard says
BUSY = (5, 6)  # exceptions that ask for patience: accepted, busy


class FifoAnswer(ReadFifoQueueResponse):
    """The answer to function 24 with its true length: the library forgets the two bytes of the count itself."""

    @classmethod
    def calculateRtuFrameSize(cls, data: bytes) -> int:  # noqa: N802 - the library's name
        """Return address, function, byte count (2), bytes counted, checksum (2)."""
        return 6 + int.from_bytes(data[2:4], "big") if len(data) >= 4 else 0


class ModbusScanner:
    """Points of one scan from registers: `host:port` speaks TCP, any other address is the port of an RTU line."""

    def __init__(
        self,
        address: str,
        decoder: RegisterDecoder,
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

    def stop(self) -> None:
        """End `arrivals` within the time-out of one request."""
        self._stopped.set()

    def arrivals(self) -> Iterator[Arrival]:
        """Open the link, yield what arrives, end after `ScanClosed`."""
        return keep_up(
            lambda: closing(self._open()), self._scan, reconnect_s=self._settings.reconnect_s, stopped=self._stopped, clock=self._clock
        )

    def _scan(self, client: ModbusBaseSyncClient) -> Iterator[Arrival]:
        last_news_s = self._clock()
        self._decoder.break_off()
        while not self._stopped.is_set():
            request = self._decoder.request()
            answer = self._ask(client, request)
            if answer is None:
                return
            yield WireBytes(self._clock(), request + answer)
            found = self._decoder.feed(request + answer)
            yield from found
            if any(isinstance(arrival, ScanClosed) for arrival in found):
                return
            if any(not isinstance(arrival, Damaged) for arrival in found):
                last_news_s = self._clock()
            elif self._clock() - last_news_s > self._settings.silence_s:
                silence = f"for {self._settings.silence_s:g} s without a new point or a moving heartbeat"
                raise LinkError(f"{self._address}: the device answers, but {silence}; is it scanning?")
            if self._decoder.idle:
                self._stopped.wait(self._poll_s)

    def _ask(self, client: ModbusBaseSyncClient, request: bytes) -> bytes | None:
        """Return the data unit of the answer, asking again where it did not come; None when told to stop."""
        failure: ModbusException | None = None
        for _ in range(TRIES):
            if self._stopped.is_set():
                return None
            try:
                response = _execute(client, request, self._device_id)
            except (ConnectionException, OSError) as error:  # the library lets a reset connection through as it is
                raise LinkError(f"{self._address}: the link was lost: {error}") from error
            except ModbusIOException as error:
                failure = error
                self._let_late_answers_pass(client)
                continue
            if response.isError() and response.exception_code in BUSY:
                self._stopped.wait(self._poll_s)
                continue
            return _unit(response)
        raise LinkError(f"{self._address}: no answer within {self._timeout_s:g} s, {TRIES} times in a row: {failure or 'always busy'}")

    def _let_late_answers_pass(self, client: ModbusBaseSyncClient) -> None:
        _close(client)
        if isinstance(client, ModbusSerialClient):  # over TCP a late answer dies with its connection
            self._stopped.wait(2 * self._timeout_s)
        if not self._stopped.is_set() and not client.connect():
            raise LinkError(f"{self._address}: the link was lost and does not open again")

    def _open(self) -> ModbusBaseSyncClient:
        if not (log := logging.getLogger("pymodbus")).handlers:
            log.addHandler(logging.NullHandler())  # what it logs reaches the operator as an error of ours, not as stray lines
        place = self._place
        client: ModbusBaseSyncClient
        if isinstance(place, HostPort):
            client = ModbusTcpClient(place.host.strip("[]"), port=place.port, timeout=self._timeout_s, retries=0)
        else:
            require_port(place)
            client = ModbusSerialClient(
                place, timeout=self._timeout_s, retries=0, baudrate=self._settings.baud_rate, parity=self._settings.parity
            )
        client.register(FifoAnswer)
        if not client.connect():
            raise LinkError(f"{self._address}: no Modbus device opens there; is it switched on, plugged in, free, and named right?")
        return client


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
