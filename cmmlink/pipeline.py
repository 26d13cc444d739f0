"""One run: source -> buffer -> inspection -> events.

The source is read in a thread of its own; judging and all sinks run in the caller's. A device failure ends the run with a
verdict on what was received; a sink that raises ends it too, and its error is passed on once acquisition has stopped.
"""

import threading
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Generic, Literal, Protocol, TypeVar, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cmmlink.buffer import Buffer
from cmmlink.errors import StoreError
from cmmlink.events import Arrived, Counts, Ending, Evaluated, Event, Judged, ProvenOut, RunFinished, RunStarted, Sink
from cmmlink.live_characteristics import LiveCharacteristics
from cmmlink.live_proof import LiveProof
from drivers import HARMLESS_REASONS, Arrival, Damaged, DeviceError, Lost, PointBatch, Rejected, ScanClosed, ScanOpened, ScanSource
from inspection import (
    InspectionError,
    InspectionResult,
    LiveInspection,
    LiveUpdate,
    Missing,
    Reason,
    Rejection,
    Verdict,
    doubt_part,
    reasons_of_abort,
)

if TYPE_CHECKING:
    from inspection.surface import LiveSurface, SurfaceResult, SurfaceUpdate

CutShort = Literal["never", "when failed", "as recorded"]
"""Whether a scan is ended once it is proven that the part can no longer pass; that of a record was, where it has no end."""

Refusal = Callable[[int, int | None], str]
"""Says, from the points received and those announced, why there is no room for more; nothing where there is."""

_ROOM_EVERY = 100_000  # points between two looks whether there is room for more
_LOOK_S = 0.05  # how often the run looks whether it was asked to stop
_MOST_AT_ONCE = 4096  # points judged at once when many wait; more would keep the sinks waiting for news


Result = TypeVar("Result", "InspectionResult", "SurfaceResult")
_Found_co = TypeVar("_Found_co", "InspectionResult", "SurfaceResult", covariant=True)
_BEYOND = (Rejection.BEYOND_END.words, Rejection.BEYOND_EDGE.words)  # what is said of points only where their pose is known


class Live(Protocol[_Found_co]):
    """What points are given to while a scan runs, whatever they are held against: one section, or a whole surface."""

    @property
    def received(self) -> int:
        """Points taken in so far."""

    @property
    def judged(self) -> int:
        """Points that have a verdict at this moment."""

    @property
    def rejected_by_reason(self) -> dict[str, int]:
        """Points rejected so far, by reason."""

    def add(self, points_mm: ArrayLike, /) -> "LiveUpdate | SurfaceUpdate":
        """Take in points, in scan order."""

    def finish(self, complete: bool = True, missing: Missing | None = None) -> _Found_co:
        """Judge all points together, and say the verdict on the part."""


@dataclass(frozen=True)  # with slots Python 3.11 cannot make one by a name such as RunOutcome
class Outcome(Generic[Result]):
    """How a run ended. `failure` is the device's error, or why there was no room for more; `refusal` why no result could be given."""

    ending: Ending
    result: Result | None
    counts: Counts
    failure: DeviceError | StoreError | None
    refusal: InspectionError | None

    @property
    def measured(self) -> bool:
        """Whether anything came of the run: of a device that never opened, or never gave a point, nothing is kept as a result."""
        return self.counts.received > 0


RunOutcome = Outcome[InspectionResult]


@dataclass(slots=True)
class _Tally:
    """The numbers of a run as they grow."""

    received: int = 0
    rejected_by_driver: Counter[str] = field(default_factory=Counter)
    lost: int = 0
    damaged_bytes: int = 0
    announced: int | None = None
    begun: int = 1
    closed: bool = False

    def add(self, arrival: Arrival) -> None:
        if isinstance(arrival, PointBatch):
            self.received += len(arrival)
        elif isinstance(arrival, Rejected):
            self.received += arrival.count
            self.rejected_by_driver[arrival.reason] += arrival.count
        elif isinstance(arrival, Lost):
            self.lost += arrival.count
        elif isinstance(arrival, Damaged):
            self.damaged_bytes += arrival.byte_count
        elif isinstance(arrival, ScanOpened):
            self.begun += self._arrived > 0
            self.announced = max(self.announced or 0, arrival.expected or 0) or None
        elif isinstance(arrival, ScanClosed):
            self.closed = True
            if arrival.sent is not None:
                self.announced = max(self.announced or 0, arrival.sent)

    @property
    def _arrived(self) -> int:
        """Points of the scan that came, used or not."""
        return self.received - sum(count for reason, count in self.rejected_by_driver.items() if reason in HARMLESS_REASONS)

    def missing(self) -> Missing:
        """What is known to be missing of the scan. A point that came twice, or is not of the scan, is not."""
        rejected = {reason: count for reason, count in self.rejected_by_driver.items() if count and reason not in HARMLESS_REASONS}
        return Missing(self.lost, self.damaged_bytes, rejected, self.announced, self._arrived, self.begun)

    def counts(self, judged: int, rejected_by_reason: Mapping[str, int], buffer: "Buffer[tuple[float, Arrival]]") -> Counts:
        reasons = dict(self.rejected_by_driver)
        for reason, count in rejected_by_reason.items():
            reasons[reason] = reasons.get(reason, 0) + count
        rejected = sum(reasons.values())
        return Counts(
            received=self.received,
            judged=judged,
            rejected=rejected,
            pending=self.received - judged - rejected,
            lost=self.lost,
            damaged_bytes=self.damaged_bytes,
            buffered=buffer.waiting,
            buffer_peak=buffer.peak,
            stalls=buffer.stalls,
            rejected_by_reason=reasons,
        )


def run_inspection(
    source: ScanSource,
    live: Live[Result],
    sinks: Sequence[Sink],
    started: RunStarted,
    *,
    buffer_points: int,
    clock: Callable[[], float],
    stop: threading.Event,
    watch: Callable[[], None] = lambda: None,
    doubt: Reason | None = None,
    no_room: Refusal = lambda received, announced: "",
    shown: bool = False,
    cut_short: CutShort = "never",
) -> Outcome[Result]:
    """Carry out one run to its end and publish every event to every sink. Setting `stop` aborts the run.

    watch : called every twentieth of a second, also while no points arrive; what it raises ends the run as an error of a sink does
    doubt : a reason known beforehand why no verdict can be proven
    no_room : asked now and then whether there is room for what is still to come; where it says why not, the run ends with what it has
    shown : somebody looks on, who is told the characteristics while the scan runs
    cut_short : whether the scan is ended once the part can no longer pass; without its end such a scan is not complete
    """
    buffer: Buffer[tuple[float, Arrival]] = Buffer(buffer_points)
    failures: list[DeviceError] = []
    acquired = threading.Event()
    reader = threading.Thread(target=_acquire, args=(source, buffer, failures, acquired, clock), name="acquisition", daemon=True)
    tally = _Tally()
    with _Lookers(live if isinstance(live, LiveInspection) else None, shown) as lookers:
        try:
            _publish(sinks, started)
            _start(reader, failures, acquired)
            full = _judge_all(source, live, lookers, sinks, buffer, tally, acquired, clock, stop, watch, no_room, cut_short)
        finally:
            lookers.end_soon()
            source.stop()
            buffer.close()
            if reader.is_alive():
                reader.join()
        failure = full or (failures[0] if failures else None)
        ending: Ending = "interrupted" if failure else "aborted" if stop.is_set() else "complete"
        complete = ending == "complete" and (tally.closed or cut_short == "never")
        result, refusal = _finish(live, ending, tally.missing(), doubt, complete)
        judged, reasons = (result.judged, result.rejected_by_reason) if result else (0, _reasons_without_pose(live))
        counts = tally.counts(judged, reasons, buffer)
        _publish(sinks, RunFinished(ending, result, counts, str(failure or refusal or "")))
    return Outcome(ending, result, counts, failure, refusal)


class _Lookers:
    """Who looks at a run from beside, while it is entered: for the proof that the part fails and, where shown, at its characteristics.

    There is neither of a surface, for which `live` is None.
    """

    def __init__(self, live: LiveInspection | None, shown: bool) -> None:
        self._live, self._is_told = live, False
        self._proof = None if live is None else LiveProof(live)
        self._characteristics = LiveCharacteristics(live) if shown and live is not None else None
        self._stack = ExitStack()

    def __enter__(self) -> "_Lookers":
        for looker in (self._proof, self._characteristics):
            if looker is not None:
                self._stack.enter_context(looker)
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def end_soon(self) -> None:
        """Have them end, without waiting until they have: the result does not wait for them."""
        for looker in (self._proof, self._characteristics):
            if looker is not None:
                looker.end_soon()

    def offer(self) -> None:
        """Hand them the points so far."""
        for looker in (self._proof, self._characteristics):
            if looker is not None:
                looker.offer()

    def news(self, clock: Callable[[], float]) -> Iterator[Event]:
        """What they found since they were last asked."""
        if not self._is_told and self._proof is not None and self._proof.refuted is not None:
            self._is_told = True
            yield ProvenOut(clock(), self._proof.refuted)
        found = self._characteristics.news() if self._characteristics is not None else None
        if found is not None and self._live is not None:
            yield Evaluated(clock(), found, self._live.uncertainty)


def _start(reader: threading.Thread, failures: list[DeviceError], acquired: threading.Event) -> None:
    """Start reading the device; where the system has no thread to give, acquisition has failed and is over."""
    try:
        reader.start()
    except RuntimeError as error:
        failures.append(DeviceError(f"the device cannot be read: {error}; close other programs"))
        acquired.set()


def _acquire(
    source: ScanSource,
    buffer: "Buffer[tuple[float, Arrival]]",
    failures: list[DeviceError],
    acquired: threading.Event,
    clock: Callable[[], float],
) -> None:
    try:
        for arrival in source.arrivals():
            if not buffer.give((clock(), arrival), len(arrival) if isinstance(arrival, PointBatch) else 0):
                break
    except DeviceError as error:
        failures.append(error)
    except Exception as error:  # a defect in a driver must end the run with a message, not hang it
        failures.append(DeviceError(f"the driver failed unexpectedly: {error!r}"))
    finally:
        acquired.set()


def _judge_all(
    source: ScanSource,
    live: Live[Result],
    lookers: _Lookers,
    sinks: Sequence[Sink],
    buffer: "Buffer[tuple[float, Arrival]]",
    tally: _Tally,
    acquired: threading.Event,
    clock: Callable[[], float],
    stop: threading.Event,
    watch: Callable[[], None],
    no_room: Refusal,
    cut_short: CutShort,
) -> StoreError | None:
    """Take what arrives and judge it until acquisition has ended and the buffer is empty. Returns why, where there was no room for more."""
    full, next_look, failed = None, 0, False
    while True:
        ended = acquired.is_set()  # read before the buffer is emptied: after it is set, nothing more is handed over
        taken = buffer.take(0.0 if ended else _LOOK_S)
        watch()
        if stop.is_set():
            source.stop()
        if not taken and ended:
            return full
        batches: list[tuple[float, PointBatch]] = []
        for time_s, arrival in taken:
            tally.add(arrival)
            _publish(sinks, Arrived(time_s, arrival))
            if isinstance(arrival, PointBatch):
                batches.append((time_s, arrival))
                if sum(len(batch) for _, batch in batches) >= _MOST_AT_ONCE:
                    failed |= _judge(live, sinks, buffer, tally, batches, clock)
                    batches = []
            if tally.received >= next_look or isinstance(arrival, ScanOpened):
                next_look = tally.received + _ROOM_EVERY
                if full is None and (why := no_room(tally.received, tally.announced)):
                    full = StoreError(why)
                    source.stop()
        if batches:
            failed |= _judge(live, sinks, buffer, tally, batches, clock)
            lookers.offer()
        for event in lookers.news(clock):
            _publish(sinks, event)
            failed |= isinstance(event, ProvenOut)
        if failed and cut_short == "when failed":
            source.stop()


def _judge(
    live: Live[Result],
    sinks: Sequence[Sink],
    buffer: "Buffer[tuple[float, Arrival]]",
    tally: _Tally,
    batches: list[tuple[float, PointBatch]],
    clock: Callable[[], float],
) -> bool:
    """Judge points and tell the sinks. Returns whether one is out of tolerance for good: that is known at once where the pose is."""
    update = _add(live, [batch for _, batch in batches])
    now = clock()
    counts = tally.counts(live.judged, live.rejected_by_reason, buffer)
    _publish(sinks, Judged(now, now - batches[-1][0], update, counts))
    return update.state == "settled" and bool((update.verdicts == Verdict.NONCONFORM).any())


def _add(live: Live[Result], batches: Sequence[PointBatch]) -> "LiveUpdate | SurfaceUpdate":
    """Give points to the inspection. Normals tell the sides of a wall apart; a section has no use for them."""
    points = np.concatenate([batch.points_mm for batch in batches])
    if isinstance(live, LiveInspection) or all(batch.normals is None for batch in batches):
        return live.add(points)
    return cast("LiveSurface", live).add(points, np.concatenate([_normals_of(batch) for batch in batches]))


def _normals_of(batch: PointBatch) -> NDArray[np.float64]:
    return np.full((len(batch), 3), np.nan) if batch.normals is None else batch.normals


def _reasons_without_pose(live: Live[Result]) -> dict[str, int]:
    """Reasons when no registration was found. Without a pose to lie beyond an end means nothing: those points are "not registered"."""
    reasons = {reason: count for reason, count in live.rejected_by_reason.items() if reason not in _BEYOND}
    left = live.received - sum(reasons.values())
    return reasons | ({"not registered": left} if left else {})


def _finish(
    live: Live[Result], ending: Ending, missing: Missing, doubt: Reason | None, complete: bool
) -> tuple[Result | None, InspectionError | None]:
    """The result of a run. What the operator aborted has no verdict, whatever was out by then: the part may have slipped.

    Whether the part was proven out is asked of all points, not of the proof in mid-scan: when that comes depends on how busy the
    machine is, and a replay has to find the same.
    """
    try:
        result = live.finish(complete=complete, missing=missing)
    except InspectionError as error:
        return None, error
    if doubt is not None:
        result = _doubted(result, (doubt,))
    if ending != "aborted":
        return result, None
    return _doubted(result, reasons_of_abort(proven_out=result.verdict == Verdict.NONCONFORM)), None


def _doubted(result: Result, reasons: tuple[Reason, ...]) -> Result:
    """The result where nothing of the part is proven, whatever was found, for reasons that stand before all others."""
    if isinstance(result, InspectionResult):
        return doubt_part(result, reasons)
    return replace(result, verdict=Verdict.UNCERTAIN, reasons=(*reasons, *result.reasons))


def _publish(sinks: Sequence[Sink], event: Event) -> None:
    for sink in sinks:
        sink(event)
