"""Waits for a machine that connects to this computer, as controls do that are TCP clients: one connection at a time."""

import socket
import threading
import time
from collections.abc import Callable

from drivers.links.address import HostPort, device_address
from drivers.links.tcp_line import POLL_S, TcpLine


class Listener:
    """An address of this computer at which a machine is awaited."""

    def __init__(self, address: str, clock: Callable[[], float] = time.monotonic) -> None:
        """Raises ValueError for an address that is not host:port."""
        place = device_address(address)
        if not isinstance(place, HostPort):
            raise ValueError(f"address {address!r:.200} is no host:port; a machine is awaited at an address of this computer")
        self._place, self._clock = place, clock
        self.words = address
        self.hint = "is the host one of this computer, the port free, and the machine set to connect to it?"

    def open(self, within_s: float, stopped: threading.Event) -> TcpLine:
        """Wait for the machine to connect. Raises OSError where it does not come in time; others are refused while it is connected."""
        host = self._place.host.strip("[]")
        family = socket.AF_INET6 if ":" in host else socket.AF_INET
        end_s = self._clock() + within_s
        with socket.create_server((host, self._place.port), family=family, backlog=1) as server:
            server.settimeout(POLL_S)
            while not stopped.is_set():
                try:
                    return TcpLine(server.accept()[0])
                except TimeoutError:
                    if self._clock() > end_s:
                        raise TimeoutError(f"no machine connected within {within_s:g} s") from None
        raise InterruptedError("stopped while waiting for the machine")
