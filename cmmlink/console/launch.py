"""The page brought to the operator: its address, and how long to stay."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from cmmlink.console.listening import Access
from cmmlink.console.results_push import pushing
from cmmlink.console.station import Station
from cmmlink.console.station_setup import StationSetup
from cmmlink.errors import PlanError

if TYPE_CHECKING:
    from cmmlink.console.server import ConsoleServer

_LOOK_S = 0.25
_GONE_S = 5.0  # a page that is loaded anew is away for a moment only


@contextmanager
def serve(setup: StationSetup, version: str, access: Access | None = None) -> Iterator["ConsoleServer"]:
    """Serve a station's page. Raises PlanError where the address cannot be had or needs more than was given."""
    from cmmlink.console.server import ConsoleServer  # noqa: PLC0415 - the web server takes a while that only a page need pay

    station, access = Station(setup), access or Access()
    try:
        server = ConsoleServer(station, version, access)
    except OSError as error:
        place = f"{access.host}:{access.port}"
        raise PlanError(f"the console cannot be served at {place} ({error.strerror}); choose another with --host and --port") from None
    server.start()
    try:
        with pushing(setup.push_from, station.pushed):
            yield server
    finally:
        if station.job is not None:
            station.job.abort()
            station.job.wait(_GONE_S)
        server.stop()


def stay_while_seen(server: "ConsoleServer", ended: threading.Event) -> None:
    """Return once the last page has been closed and nothing is measured any more, or once `ended` is set."""
    unseen_s = 0.0
    while unseen_s < _GONE_S and not ended.wait(_LOOK_S):
        unseen_s = 0.0 if server.pages or server.station.running else unseen_s + _LOOK_S
