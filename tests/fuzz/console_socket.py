"""A console as it stands in a workshop, with a run that goes on, for messages that no page of ours would send.

The messages go over the socket of a real server. It answers them or closes the socket; it never dies, raises no alarm of a defect, and
the run goes on, unless a message was the command to end it.
"""

import atexit
import json
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache
from itertools import count
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from time import monotonic, sleep

import numpy as np
from websockets import Origin
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect

from cmmlink.console.commands import receive
from cmmlink.console.refused import Refused
from cmmlink.console.server import ConsoleServer
from cmmlink.console.station import Station
from drivers.source import PointBatch
from tests.cmmlink.console.played import UNREAD, Device, opened, setup_of, write_plan

TOKEN = "a-token-for-fuzzing-of-32-letters"
PATIENCE_S = 120.0  # for a busy machine: nothing is asserted of the time
ENDING = ("end", "abort")
PROBE = 987_654_321


STRANGE: tuple[object, ...] = (
    None,
    True,
    -1,
    2**63,
    1e308,
    "",
    "x" * 9000,
    "\ud800",
    "\0",
    "../../x",
    "<b>",
    [],
    {},
    [[]] * 50,
    "end",
    "start",
    "blade.yaml",
    "last",
)


def change_command(data: bytes, rng: Random) -> bytes:
    """Another value, one value less, or one more, in one of the messages; the rest stays as it is."""
    lines = data.split(b"\n")
    at = rng.randrange(len(lines))
    try:
        message = json.loads(lines[at])
    except ValueError:
        return data
    if not isinstance(message, dict) or not message:
        return data
    key = rng.choice([*message, *("plan", "run", "alarm", "section", "serial_number", "token", "once", "")])
    message[key] = rng.choice(STRANGE)
    if rng.random() < 0.2:
        del message[rng.choice(list(message))]
    lines[at] = json.dumps(message).encode()
    return b"\n".join([*lines, *rng.choices(lines, k=rng.choice([0, 0, 1, 3]))])


class Workshop:
    """A server of a station, and the device that it scans until the workshop is closed."""

    def __init__(self) -> None:
        self._folder = folder = TemporaryDirectory()
        self._device, self._numbers = Device(), count()
        self._station = Station(setup_of({"blade.yaml": write_plan(Path(folder.name))}, self._device.connect))
        self._server = ConsoleServer(self._station, "fuzzed", token=TOKEN)
        self._server.start()
        atexit.register(self._server.stop)

    def close(self) -> None:
        """End the run that goes on, and the server."""
        self._end()
        self._server.stop()
        self._folder.cleanup()

    def hear(self, data: bytes) -> None:
        """Take an input, each line as a message of its own, and look whether everything goes on. Raises AssertionError."""
        self._begin()
        lines = data.split(b"\n")[:20]
        with self._page() as page, suppress(ConnectionClosed):
            for line in lines:
                page.send(line if len(data) % 3 == 0 else line.decode("utf-8", "replace"))
            self._probe(page)
        with self._page() as page:
            assert self._probe(page), "a page of ours gets no answer any more"
        defects = [row.detail for row in self._station.alarms.newest_first() if row.what == "Defect in the program"]
        assert not defects, defects
        if any(receive(line.decode("utf-8", "replace")).do in ENDING for line in lines):
            self._end()
        else:
            self._measure()

    @contextmanager
    def _page(self) -> Iterator[ClientConnection]:
        """A page in control."""
        place, origin = f"ws://127.0.0.1:{self._server.port}/live", Origin(f"http://127.0.0.1:{self._server.port}")
        with connect(place, origin=origin, max_queue=UNREAD) as page:
            page.send(json.dumps({"token": TOKEN}))
            page.send(json.dumps({"do": "take control", "number": 0}))
            yield page

    @staticmethod
    def _probe(page: ClientConnection) -> bool:
        """Ask for something that is always answered; tell whether it was."""
        page.send(json.dumps({"do": "live", "number": PROBE}))
        until_s = monotonic() + PATIENCE_S
        while monotonic() < until_s:
            said = page.recv(timeout=PATIENCE_S)
            if isinstance(said, str) and json.loads(said).get("number") == PROBE:
                return True
        return False

    def _begin(self) -> None:
        """Let a run be going on."""
        if self._station.running:
            return
        self._device.renew()
        self._station.choose("blade.yaml")
        self._station.enter("B-0041", "Ada", "")
        self._station.start()
        self._device.source.put(opened(10**6))
        self._measure()

    def _end(self) -> None:
        """See to it that no job is on."""
        with suppress(Refused):
            self._station.abort()
        assert self._station.wait(PATIENCE_S), "a job does not end"

    def _measure(self) -> None:
        """Let the device send two points more, and see them arrive."""
        view = self._station.view
        assert view is not None, "no run is shown"
        before = view.state().received
        number = np.array([next(self._numbers), next(self._numbers)])
        self._device.source.put(PointBatch(number, number * 1e-3, np.column_stack([number * 0.01, number * 0.0, number * 0.0])))
        until_s = monotonic() + PATIENCE_S
        while view.state().received < before + 2:
            assert monotonic() < until_s, "the run does not go on"
            sleep(0.005)


@cache
def workshop() -> Workshop:
    """The one of this process, until it is closed."""
    return Workshop()


def close_workshop() -> None:
    """Leave nothing of it running, if there is one."""
    if workshop.cache_info().currsize:
        workshop().close()
        workshop.cache_clear()
