"""The engine of simulated devices behind Modbus TCP or RTU: the only file of simulators that knows pymodbus.

A device keeps registers that are computed when they are read; the server, the pace, the line and its faults are here.
`pty` serves RTU over a pair of pseudo-terminals with a relay between them, which is where bytes are damaged.
"""

import asyncio
import contextlib
import json
import logging
import os
import sys
import threading
import time
from collections.abc import Awaitable, Callable
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from pymodbus.constants import ExcCodes
from pymodbus.datastore import ModbusServerContext
from pymodbus.pdu import ModbusPDU
from pymodbus.pdu.file_message import ReadFifoQueueRequest, ReadFifoQueueResponse
from pymodbus.server import ModbusSerialServer, ModbusTcpServer
from pymodbus.server.base import ModbusBaseServer
from pymodbus.simulator import DataType, SimData, SimDevice

from simulators.faults import Injector, refuse_others
from simulators.line import PtyLine, host_and_port
from simulators.motion import Walk, walk
from simulators.settings import Announce, SimulatorSettings, refuse_answer

if sys.platform != "win32":
    import tty

DEVICE_ID = 1
FAREWELL_S = 10.0
LOOK_S = 0.01
READ_FIFO = 24

Words = NDArray[np.uint16]


class RegisterDevice:
    """Registers of a device whose points appear one after the other; what is behind an address, a subclass says."""

    size = 65536

    def __init__(self, scan: Walk, injector: Injector, *, swapped: bool) -> None:
        self.scan = scan
        self.count = len(scan.time_s)
        self.injector = injector
        self.swapped = swapped  # the halves of 32-bit numbers, as some gateways do
        self.taken = 0
        self.heartbeat = 0
        self.overflow = 0
        self.done = False

    def take(self, taken: int) -> None:
        """Let the points up to `taken` happen."""
        self.taken = taken

    def points_appearing(self, function: int, address: int, count: int) -> int:
        """Return how many points appear at this access when the scan is not paced: as many as the client will fetch."""
        return 1

    def read(self, table: int, address: int, count: int) -> Words:
        """Return the registers; reading may change the device."""
        raise NotImplementedError

    def take_fifo(self, address: int) -> Words:
        """Return and forget up to 31 registers."""
        raise NotImplementedError

    def numbers(self, values: NDArray[np.integer], dtype: str) -> Words:
        """Return (m, k) registers of (m,) numbers, high word first unless swapped."""
        words = np.ascontiguousarray(values.astype(dtype)).view(">u2").reshape(len(values), -1).astype(np.uint16)
        return words[:, ::-1] if self.swapped else words


Maker = Callable[[Walk, Injector, bool], RegisterDevice]


def serve_registers(settings: SimulatorSettings, announce: Announce, make: Maker, move: Callable[..., Walk] = walk) -> None:
    """Serve one scan of a device made by `make(walk, injector, swapped)`."""
    refuse_others(settings.faults, "registers")
    refuse_answer(settings)
    logging.getLogger("pymodbus").addHandler(logging.NullHandler())
    asyncio.run(RegisterService(settings, announce, make, move(settings.path_mm, settings.motion)).run())


class RegisterService:
    """One device being served: what its registers hold at every access, whatever link brings it there."""

    def __init__(
        self, settings: SimulatorSettings, announce: Announce, make: Maker, scan: Walk, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._settings = settings
        self._clock = clock
        self._announce = announce
        self._make = make
        self._scan = scan
        self._injector = Injector(settings.faults, settings.motion.seed)
        self._swapped = self._injector.expects("word-swap")
        self.device = make(scan, self._injector, self._swapped)
        self._began_s: float | None = None
        self._stalled_until_s = 0.0
        self._silent_until_s = 0.0
        self._away_s: float | None = None
        self._relay: _Relay | None = None
        self._address = settings.address

    async def run(self) -> None:
        """Serve the scan over the link of the settings, and some seconds longer."""
        server = await self._listen()
        self._announce(self._address)
        finished_s: float | None = None
        while finished_s is None or self._clock() < finished_s + FAREWELL_S:
            await asyncio.sleep(LOOK_S)
            if self._away_s is not None:
                server = await self._go_away(server, self._away_s)
            if self.device.done and finished_s is None:
                finished_s = self._clock()
                self._announce(json.dumps({"points": self.device.count, **self._injector.tally}))
        await _shut_down(server)
        if self._relay is not None:
            self._relay.close()

    async def _go_away(self, server: ModbusBaseServer, seconds: float) -> ModbusBaseServer:
        """Take the server away and bring it back under the same address."""
        self._away_s = None
        await _shut_down(server)
        if self._relay is not None:
            self._relay.plugged = False
        await asyncio.sleep(seconds)
        if self._relay is not None:
            self._relay.plugged = True
        return await self._listen()

    async def _listen(self) -> ModbusBaseServer:
        context = SimDevice(id=0, simdata=[SimData(0, count=self.device.size, values=0, datatype=DataType.REGISTERS)], action=self._access)
        request = _fifo_request(self.take_fifo)
        if self._settings.address == "pty":
            self._relay = self._relay or _Relay(self._injector)
            self._address = self._relay.line.address
            serial = ModbusSerialServer(context, port=self._relay.inner, baudrate=115_200, custom_pdu=[request])
            await serial.serve_forever(background=True)
            return serial
        host, port = host_and_port(self._address)
        server = ModbusTcpServer(context, address=(host, port), custom_pdu=[request], trace_packet=self._damage)
        try:
            await server.serve_forever(background=True)
        except RuntimeError as error:  # what pymodbus makes of a host that is none of this computer, or of a port in use
            raise OSError(str(error)) from None
        if not port:
            transport = server.transport
            assert isinstance(transport, asyncio.Server)
            self._address = f"{host}:{transport.sockets[0].getsockname()[1]}"
        return server

    def _damage(self, sending: bool, data: bytes) -> bytes:
        return self._injector.damage(data) if sending else data

    async def _access(
        self, function: int, start: int, address: int, count: int, registers: list[int], values: list[int] | list[bool] | None
    ) -> ExcCodes | None:
        """Let time pass, then compute the registers asked for."""
        if values is None:
            registers[address - start : address - start + count] = await self.read(function, address, count)
        return None

    async def read(self, function: int, address: int, count: int) -> list[int]:
        """Return registers as they are when time has passed."""
        await self._let_time_pass(function, address, count)
        return [int(register) for register in self.device.read(function, address, count)]

    async def take_fifo(self, address: int) -> list[int]:
        """Return, and take out, what waits in a queue when time has passed."""
        await self._let_time_pass(READ_FIFO, address, 0)
        return [int(register) for register in self.device.take_fifo(address)]

    def is_going_away(self) -> bool:
        """Tell whether a fault takes the device off the line now; it is back when this is asked."""
        away, self._away_s = self._away_s is not None, None
        return away

    async def _let_time_pass(self, function: int, address: int, count: int) -> None:
        if self._away_s is not None:
            await asyncio.sleep(1e6)  # about to go: no answer any more
        now_s = self._clock()
        self._began_s = now_s if self._began_s is None else self._began_s
        if now_s < self._silent_until_s:
            await asyncio.sleep(self._silent_until_s - now_s)
        slow_s = self._injector.lasting_value("slow", self.device.taken)
        if slow_s:
            await asyncio.sleep(slow_s)
        self.device.heartbeat = (self.device.heartbeat + 1) % 65536
        if self._clock() >= self._stalled_until_s:
            self._advance(self.device.points_appearing(function, address, count))

    def _advance(self, appearing: int) -> None:
        assert self._began_s is not None
        device, elapsed_s = self.device, self._clock() - self._began_s
        due = int(np.searchsorted(self._scan.time_s, elapsed_s, side="right")) if self._settings.paced else device.taken + appearing
        due = self._injector.next_stop(device.taken, min(due, device.count))
        device.take(max(due, device.taken))
        self._injector.note_progress(device.taken)
        self._strike(device.taken)

    def _strike(self, index: int) -> None:
        """Let the faults of this point happen."""
        status = self._injector.strike("die", index)
        if status is not None:
            os._exit(int(status))
        stall_s = self._injector.strike("stall", index)
        if stall_s is not None:
            self._stalled_until_s = self._clock() + stall_s
            self._began_s = (self._began_s or 0.0) + stall_s
        silence_s = self._injector.strike("silence", index)
        if silence_s is not None:
            self._silent_until_s = self._clock() + min(silence_s, 1e6)
        away_s = self._injector.strike("unplug", index)
        if away_s is not None:
            self._away_s = away_s
        restart_s = self._injector.strike("restart", index)
        if restart_s is not None:
            self._away_s = restart_s
            self.device = self._make(self._scan, self._injector, self._swapped)
            self._began_s = None


class _Server(Protocol):
    async def shutdown(self) -> object: ...


async def _shut_down(server: _Server) -> None:
    await server.shutdown()


def _fifo_request(read: Callable[[int], Awaitable[list[int]]]) -> type[ModbusPDU]:
    """Make a request of function 24 whose answer comes from `read`; the library's own answers a constant."""

    class Request(ReadFifoQueueRequest):
        async def datastore_update(self, context: ModbusServerContext, device_id: int) -> ModbusPDU:
            return ReadFifoQueueResponse(values=await read(self.address), dev_id=device_id, transaction_id=self.transaction_id)

    return Request


class _Relay:
    """Carries bytes between the client's pseudo-terminal and the server's, damaging what the server sends."""

    def __init__(self, injector: Injector) -> None:
        self.line = PtyLine()
        self._injector = injector
        self._master, slave = os.openpty()
        if sys.platform != "win32":
            tty.setraw(slave)
        self.inner = os.ttyname(slave)
        self._slave = slave
        os.set_blocking(self._master, False)
        self._running = self.plugged = True
        self._thread = threading.Thread(target=self._carry, daemon=True)
        self._thread.start()

    def close(self) -> None:
        self._running = False
        self._thread.join()
        self.line.close()
        os.close(self._master)
        os.close(self._slave)

    def _carry(self) -> None:
        there = True
        while self._running:
            if self.plugged != there:
                there = self.plugged
                (self.line.plug if there else self.line.unplug)()
            asked = self.line.receive(0.0005)
            if asked:
                os.write(self._master, asked)
            with contextlib.suppress(BlockingIOError):
                self.line.send(self._injector.damage(os.read(self._master, 4096)))
