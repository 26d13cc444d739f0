"""One-dimensional sensors: a distance becomes a point where an axis says the sensor was.

The axis is a constant feed by the sensor's own clock, or a second source whose points tell the position. Directions
are unit vectors in machine coordinates; the sensor's points are (0, 0, distance).
"""

import queue
import threading
from collections import deque
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.codecs.outbox import sifted
from drivers.errors import LinkError, ProtocolError
from drivers.source import Arrival, Damaged, LinkDown, LinkUp, PointBatch, Rejected, ScanClosed, ScanSource, WireBytes

Vector = tuple[float, float, float]
WAIT_S = 0.05


@dataclass(frozen=True, slots=True)
class Beam:
    """Where distance zero lies at axis position zero, which way the distance counts, and which way the axis moves the sensor."""

    origin_mm: Vector
    distance_direction: Vector
    axis_direction: Vector

    def __post_init__(self) -> None:
        for name, vector in (("distance", self.distance_direction), ("axis", self.axis_direction)):
            if abs(float(np.linalg.norm(vector)) - 1.0) > 1e-6:
                raise ValueError(f"{name} direction {vector} is no unit vector")

    def points_mm(self, position_mm: NDArray[np.float64], distance_mm: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (m, 3) points from (m,) axis positions and (m,) distances."""
        with np.errstate(over="ignore", invalid="ignore"):  # what no part can have is rejected where it leaves
            moved = np.outer(position_mm, self.axis_direction) + np.outer(distance_mm, self.distance_direction)
        return np.asarray(np.array(self.origin_mm) + moved)


class ConstantFeed:
    """A source whose sensor moves at constant speed; the axis stands at zero when the first point that arrives was taken."""

    def __init__(self, sensor: ScanSource, beam: Beam, speed_mm_s: float) -> None:
        self._sensor = sensor
        self._beam = beam
        self._speed_mm_s = speed_mm_s

    def stop(self) -> None:
        """End `arrivals` soon."""
        self._sensor.stop()

    def arrivals(self) -> Iterator[Arrival]:
        """Yield the sensor's arrivals with its points in machine coordinates."""
        start_s: float | None = None
        last_s: float | None = None
        for arrival in self._sensor.arrivals():
            if isinstance(arrival, PointBatch):
                start_s = float(arrival.time_s[0]) if start_s is None else start_s
                times_s = arrival.time_s if last_s is None else np.append(last_s, arrival.time_s)
                if np.any(np.diff(times_s) == 0):
                    raise ProtocolError("the sensor's clock stands still: a constant feed needs one; follow a second device instead")
                last_s = float(arrival.time_s[-1])
                with np.errstate(over="ignore"):
                    position_mm = (arrival.time_s - start_s) * self._speed_mm_s
                points_mm = self._beam.points_mm(position_mm, arrival.points_mm[:, 2])
                yield from sifted(PointBatch(arrival.sequence, arrival.time_s, points_mm))
            else:
                yield arrival


class FollowedAxis:
    """A source whose sensor's position comes from a second source, as the x of its points.

    Both are put on the clock of this computer: the last point of a batch at the arrival of its bytes, those before it
    by the device's own clock. The delay of the two links must differ by less than the position may be wrong divided
    by the speed. Positions are interpolated, never extrapolated: points before the first position are rejected,
    points after the newest one wait for the next. Of the axis only damage and link events are passed on: its bytes
    and counts are not the sensor's.
    """

    def __init__(self, sensor: ScanSource, axis: ScanSource, beam: Beam) -> None:
        self._sensor = sensor
        self._axis = axis
        self._beam = beam

    def stop(self) -> None:
        """End `arrivals` soon."""
        self._sensor.stop()
        self._axis.stop()

    def arrivals(self) -> Iterator[Arrival]:
        """Yield the sensor's arrivals with its points in machine coordinates, and what goes wrong with the axis."""
        inbox: queue.Queue[Delivery] = queue.Queue(maxsize=10_000)
        sources = {"sensor": self._sensor, "axis": self._axis}
        threads = [
            threading.Thread(target=_deliver, args=(source, name == "axis", inbox), name=name, daemon=True)
            for name, source in sources.items()
        ]
        for thread in threads:
            thread.start()
        try:
            yield from merge(iter(inbox.get, None), self._beam)
        finally:
            self.stop()
            while any(thread.is_alive() for thread in threads):
                _take_one(inbox)


@dataclass(frozen=True, slots=True)
class Delivery:
    """What one of the two sources said, or how it ended: None in good order, else with the exception."""

    from_axis: bool
    said: Arrival | Exception | None


def merge(deliveries: Iterable[Delivery], beam: Beam) -> Iterator[Arrival]:
    """Merge what a sensor and its axis say, in the order in which it is delivered; see `FollowedAxis`."""
    last_s = {True: 0.0, False: 0.0}  # when bytes last came from the axis, and from the sensor
    path = _Path(beam)
    for delivery in deliveries:
        said, from_axis = delivery.said, delivery.from_axis
        if said is None or isinstance(said, Exception | ScanClosed):
            yield from path.reject_left_over()
            yield from _end(delivery)
            return
        if isinstance(said, WireBytes):
            last_s[from_axis] = said.time_s
        if isinstance(said, PointBatch):
            at_s = last_s[from_axis] + (said.time_s - said.time_s[-1])
            if from_axis:
                path.add_positions(at_s, said)
            else:
                path.add_distances(at_s, said)
            yield from path.place()
        elif not from_axis or isinstance(said, Damaged | LinkDown | LinkUp):
            yield said


def _end(delivery: Delivery) -> Iterator[Arrival]:
    """End as the source did: a closed scan is the end of both, an axis that ends before it is a lost link."""
    if isinstance(delivery.said, Exception):
        raise delivery.said
    if delivery.said is not None:
        yield delivery.said
    elif delivery.from_axis:
        raise LinkError("the axis ended before the sensor's scan did")


class _Path:
    """Where the axis was, and the distances that wait to be placed on it."""

    def __init__(self, beam: Beam) -> None:
        self._beam = beam
        self._times_s: list[float] = []
        self._positions_mm: list[float] = []
        self._waiting: deque[tuple[PointBatch, NDArray[np.float64]]] = deque()

    def add_positions(self, at_s: NDArray[np.float64], batch: PointBatch) -> None:
        """Take positions of the axis, which are the x of its points, at the times `at_s`, (m,)."""
        self._times_s += at_s.tolist()
        self._positions_mm += batch.points_mm[:, 0].tolist()

    def add_distances(self, at_s: NDArray[np.float64], batch: PointBatch) -> None:
        """Take distances of the sensor, which are the z of its points, at the times `at_s`, (m,)."""
        self._waiting.append((batch, at_s))

    def place(self) -> Iterator[Arrival]:
        """Yield what lies between known positions; forget positions that are no longer needed."""
        while self._waiting and self._times_s and self._waiting[0][1][-1] <= self._times_s[-1]:
            batch, at_s = self._waiting.popleft()
            known = at_s >= self._times_s[0]
            if not known.all():
                yield Rejected(int((~known).sum()), "taken before the axis told its position")
            if known.any():
                position_mm = np.interp(at_s[known], self._times_s, self._positions_mm)
                points_mm = self._beam.points_mm(position_mm, batch.points_mm[known, 2])
                yield from sifted(PointBatch(batch.sequence[known], batch.time_s[known], points_mm))
            oldest = int(np.searchsorted(self._times_s, at_s[-1])) - 1
            del self._times_s[: max(0, oldest)], self._positions_mm[: max(0, oldest)]

    def reject_left_over(self) -> Iterator[Arrival]:
        """Reject the distances for which no position came any more."""
        yield from self.place()
        count = sum(len(batch) for batch, _ in self._waiting)
        self._waiting.clear()
        if count:
            yield Rejected(count, "taken after the axis last told its position")


def _deliver(source: ScanSource, from_axis: bool, inbox: "queue.Queue[Delivery]") -> None:
    """Pass on everything that a source says, and how it ended; whatever it raises is raised again by `merge`."""
    try:
        for arrival in source.arrivals():
            inbox.put(Delivery(from_axis, arrival))
        inbox.put(Delivery(from_axis, None))
    except Exception as error:
        inbox.put(Delivery(from_axis, error))


def _take_one(inbox: "queue.Queue[Delivery]") -> None:
    """Make room for a thread that still delivers, so that it can come to its end."""
    with suppress(queue.Empty):
        inbox.get(timeout=WAIT_S)
