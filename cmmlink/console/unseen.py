"""Nobody looks on: a machine that moves is told to stop once the last page has been gone for some seconds."""

from collections.abc import Callable

from cmmlink.console.station import Station

GONE_S = 5.0  # a page that is loaded anew is away for a moment only


class Onlooker:
    """Looks now and then whether a page is open while a machine moves."""

    def __init__(self, station: Station, clock: Callable[[], float]) -> None:
        self._station, self._clock = station, clock
        self._unseen_since_s: float | None = None

    def look(self, pages: int) -> None:
        """Abort what moves a machine where none of the pages has been open for a while."""
        job = self._station.job
        if pages or job is None or job.over or not job.moves:
            self._unseen_since_s = None
            return
        now_s = self._clock()
        if self._unseen_since_s is None:
            self._unseen_since_s = now_s
        if now_s - self._unseen_since_s >= GONE_S and not job.stop.is_set():
            job.abort()
            self._station.alarms.raise_alarm("fault", "Run aborted", "No page was open any more while the machine moved, so it was stopped")
