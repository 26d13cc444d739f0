"""What the log says of a run: how it begins and ends, and what happens to its link."""

import logging

from cmmlink.events import Answered, Arrived, Event, RunFinished, RunStarted
from drivers import LinkDown, LinkUp, ScanClosed, ScanOpened

_TOLD = ScanOpened | ScanClosed | LinkDown | LinkUp  # of what arrives: a few lines a run, never one a point or a frame
_log = logging.getLogger(__name__)
logging.getLogger("cmmlink").addHandler(logging.NullHandler())  # as in any library: a script that keeps no log is not spoken to


def log_event(event: Event) -> None:
    """A sink that notes how a run begins and ends and what happens to its link."""
    if isinstance(event, RunStarted):
        _log.info("run of %s", event)
    elif isinstance(event, Arrived):
        if isinstance(event.arrival, _TOLD):
            _log.log(logging.WARNING if isinstance(event.arrival, LinkDown) else logging.INFO, "link: %s", event.arrival)
    elif isinstance(event, Answered):
        _log.log(logging.INFO if event.state == "sent" and not event.unrecorded else logging.ERROR, "answer to the machine: %s", event)
    elif isinstance(event, RunFinished):
        _log.info(
            "run %s, %s: %s. %s", event.ending, event.result.verdict.word if event.result else "no result", event.counts, event.message
        )
