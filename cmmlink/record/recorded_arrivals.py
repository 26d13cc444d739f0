"""The arrivals of a recorded run in their order, and what kept them from being read."""

import threading
from collections.abc import Callable, Iterator

from cmmlink.errors import StoreError
from cmmlink.record.bodies import PlacedArrival
from cmmlink.record.reader import RecordedRun, arrivals_of, points_of, reads_of
from cmmlink.record.store import Store
from drivers import Arrival, Decoder, LinkDown, LinkUp, PointBatch


class Reading:
    """The arrivals of a record, and what kept them from being read: that is no failure of the recorded scan."""

    def __init__(self, arrivals: Iterator[Arrival]) -> None:
        self._arrivals = arrivals
        self._has_begun = False
        self._failure: StoreError | None = None

    def __iter__(self) -> Iterator[Arrival]:
        self._has_begun = True
        try:
            yield from self._arrivals
        except StoreError as error:
            self._failure = error
            raise

    def raise_failure(self, run: str, failure: Exception | None) -> None:
        """Raise StoreError where not all of the record was read."""
        if self._failure is not None:
            raise self._failure
        if failure is not None and not self._has_begun:
            raise StoreError(f"run {run} cannot be judged again: {failure}")


def failure_of(recorded: RecordedRun) -> str:
    """What ended a recorded run that was interrupted; nothing where it came to its end."""
    end = recorded.end or {"state": "interrupted", "message": ""}
    return str(end["message"] or "the record ends here") if end["state"] == "interrupted" else ""


def arrivals_in(store: Store, recorded: RecordedRun, decoder: Decoder | None, stop: threading.Event) -> Iterator[Arrival]:
    """Recorded arrivals in their order: reads and link events where there is a decoder, else points and all other arrivals."""
    moments = arrivals_of(store, recorded.run)
    if decoder is not None:
        links = (moment for moment in moments if isinstance(moment.arrival, LinkDown | LinkUp))
        yield from _merge(reads_of(store, recorded.run), lambda _: 1, links, lambda moment: moment.reads)
    else:
        yield from _merge_points(points_of(store, recorded.run), moments)
    if recorded.end is not None and recorded.end["state"] == "aborted":
        stop.set()  # at the point where the operator aborted the recorded run


def _merge(
    items: Iterator[Arrival], size: Callable[[Arrival], int], moments: Iterator[PlacedArrival], place: Callable[[PlacedArrival], int]
) -> Iterator[Arrival]:
    """Merge counted arrivals with others, each of which has its place after a number of them."""
    done, moment = 0, next(moments, None)
    for item in items:
        while moment is not None and place(moment) <= done:
            yield moment.arrival
            moment = next(moments, None)
        yield item
        done += size(item)
    while moment is not None:
        yield moment.arrival
        moment = next(moments, None)


def _merge_points(batches: Iterator[PointBatch], moments: Iterator[PlacedArrival]) -> Iterator[Arrival]:
    """Merge points with other arrivals. An arrival between two points of one record splits that record."""
    done, moment = 0, next(moments, None)
    for batch in batches:
        begin = 0
        while moment is not None and moment.points < done + len(batch):
            cut = moment.points - done
            if cut > begin:
                yield _rows(batch, begin, cut)
            yield moment.arrival
            begin, moment = max(begin, cut), next(moments, None)
        yield _rows(batch, begin, len(batch))
        done += len(batch)
    while moment is not None:
        yield moment.arrival
        moment = next(moments, None)


def _rows(batch: PointBatch, begin: int, end: int) -> PointBatch:
    normals = None if batch.normals is None else batch.normals[begin:end]
    return PointBatch(batch.sequence[begin:end], batch.time_s[begin:end], batch.points_mm[begin:end], normals)
