"""A coordinate measuring machine that is reached over I++ DME: a TCP connection on which one session measures one part.

However the run ends, the machine is told: a scan that is stopped is given up by AbortE, and the session is ended, so that the machine
stands and the next client finds it free. A lost link ends the run: what the machine does then nobody knows, so nothing is repeated.
"""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import closing, suppress

from drivers.codecs.dme_session import DmeJob, DmeSession
from drivers.errors import DeviceError, LinkError
from drivers.links.address import HostPort, device_address
from drivers.links.tcp_line import TcpLine, open_tcp
from drivers.links.watch import Watch, explained
from drivers.source import Arrival, WireBytes

_OPENS_WITHIN_S = 5.0
_FAREWELL_S = 0.4  # `arrivals` ends within half a second after `stop`


class DmeMachine:
    """Points of one part from the server at `host:port`.

    silence_s : how long the machine may say nothing, be it because it moves
    """

    def __init__(self, address: str, job: DmeJob, silence_s: float, *, clock: Callable[[], float] = time.monotonic) -> None:
        """Raises ValueError for an address that is none of a server."""
        place = device_address(address)
        if not isinstance(place, HostPort):
            raise ValueError(f"address {address!r} is that of a serial port; an I++ DME server has host:port, like 192.168.1.10:1294")
        self._place, self._address, self._job = place, address, job
        self._silence_s, self._clock = silence_s, clock
        self._stopped = threading.Event()

    def stop(self) -> None:
        """Have the machine give up its scan, and end `arrivals` within half a second."""
        self._stopped.set()

    def arrivals(self) -> Iterator[Arrival]:
        """Open a session, yield what arrives, end with `ScanClosed`."""
        return explained(self._address, self._session())

    def _session(self) -> Iterator[Arrival]:
        try:
            connection = open_tcp(self._place, min(_OPENS_WITHIN_S, self._silence_s), self._stopped)
        except OSError as error:
            hint = "is the server of the machine running, and are host and port right?"
            raise LinkError(f"{self._address}: cannot be opened: {error}; {hint}") from error
        except LinkError:
            if self._stopped.is_set():
                return
            raise
        with closing(TcpLine(connection)) as line:
            session = DmeSession(self._job)
            try:
                yield from self._measure(line, session)
            except LinkError:
                yield from session.break_off()
                raise
            except DeviceError as error:
                yield from session.break_off()
                raise type(error)(f"{self._address}: {error}") from error
            finally:  # also where nobody wants to hear more
                session.call_off()
                self._take_leave(line, session)

    def _measure(self, line: TcpLine, session: DmeSession) -> Iterator[Arrival]:
        """Yield what arrives until the session is over, or the run is stopped."""
        watch = Watch(self._silence_s, float("inf"), self._clock())
        while not (self._stopped.is_set() or session.is_over):
            if data := self._exchange(line, session):
                yield WireBytes(self._clock(), data)
                found = session.feed(data)
                yield from found
                watch.note(found, self._clock())
            if watch.is_over(self._clock()):
                raise LinkError(
                    f"{self._address}: for {self._silence_s:g} s the machine said nothing that leads on; does it wait for somebody? "
                    "Where it only moves for so long, give device.silence_s more"
                )

    def _exchange(self, line: TcpLine, session: DmeSession) -> bytes:
        """Send what is due, and return what is there, at the latest after a twentieth of a second."""
        try:
            if outgoing := session.request():
                line.write(outgoing)
            return line.read()
        except OSError as error:
            raise LinkError(f"{self._address}: the link was lost: {error}; the scan is not complete") from error

    def _take_leave(self, line: TcpLine, session: DmeSession) -> None:
        """Let the machine stop and end the session, for as long as that may take; nothing of it is measured any more."""
        end_s = self._clock() + _FAREWELL_S
        with suppress(DeviceError):  # a machine that is gone by then need not hear it
            while not session.is_over and self._clock() < end_s:
                session.feed(self._exchange(line, session))
