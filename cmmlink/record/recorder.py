"""The recorder: a sink that keeps a run while it goes on.

The run's thread only hands over; one thread of the recorder packs and commits every tenth of a second. Acknowledged means
committed. Nothing is dropped: a full queue makes the run wait, and when the disk fails the next event or the next `check`
raises StoreError in the run's thread, which stops the scan. A run that gave no result is kept with its points and the reason,
without a verdict.
"""

import hashlib
import threading
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from datetime import datetime
from itertools import islice
from typing import TYPE_CHECKING, Any

from cmmlink.buffer import Buffer
from cmmlink.errors import StoreError
from cmmlink.events import Arrived, Event, Judged, RunFinished, RunStarted
from cmmlink.record.bodies import PlacedArrival, pack_arrivals, pack_document, pack_normals, pack_points, pack_reads
from cmmlink.record.chain import Draft, Kind, Record
from cmmlink.record.kept_result import DocumentOf, document_of_section, judged_bodies
from cmmlink.record.run_inputs import RunInputs
from cmmlink.record.seal import Seal
from cmmlink.record.signature import signature_in
from cmmlink.record.store import Store
from cmmlink.result_json import number
from cmmlink.words import utc_words
from drivers import LinkDown, PointBatch, Rejected, WireBytes

if TYPE_CHECKING:
    from inspection import InspectionResult, LiveUpdate
    from inspection.surface import SurfaceRegistration, SurfaceResult

COMMIT_S = 0.1
CHUNK_POINTS = 1000
_JUDGED_BODIES = 8  # of judged rows that are committed together: eight megabytes
QUEUE_BYTES = 64 << 20
COMMIT_BYTES = 4 << 20  # of what waits in the queue that are packed and committed together
_SMALL_BYTES = 128  # size in the queue of an event without bytes or points
_POSE_S = 0.1  # the shortest time between two notes of a pose that still moves


@dataclass(frozen=True, slots=True)
class RecordReference:
    """Ties a result file to its record: the run, the hashes, the signature, and the places outside that were told the hash of its end.

    signature : None where the run is not signed
    anchors   : each place, and the problem that kept it from being told, empty where nothing did
    """

    run: str
    chain_sha256: str
    plan_sha256: str
    nominal_sha256: str
    software: Mapping[str, str]
    signature: Mapping[str, str] | None = None
    anchors: Sequence[Mapping[str, str]] = ()


@dataclass(frozen=True, slots=True)
class Acknowledged:
    """How much of a run is on the disk by now."""

    wire_bytes: int
    points: int


@dataclass(frozen=True, slots=True)
class _Pose:
    """One entry of the registration's history."""

    document: Mapping[str, Any]


def result_sha256(document: Mapping[str, Any], bodies: Iterable[bytes]) -> str:
    """Hash of everything a result says, every deviation to the last bit: of its document, and of its rows as they are recorded."""
    digest = hashlib.sha256(pack_document(document))
    for body in bodies:
        digest.update(body)
    return digest.hexdigest()


class Recorder:
    """Records one run in an open store.

    began : when the run began, the one moment that its record and its result tell
    """

    def __init__(
        self,
        store: Store,
        inputs: RunInputs,
        *,
        clock: Callable[[], float],
        now: Callable[[], datetime],
        commit_s: float = COMMIT_S,
        queue_bytes: int = QUEUE_BYTES,
        acknowledge: Callable[[Acknowledged], None] = lambda _: None,
        seal: Seal | None = None,
        document_of: DocumentOf = document_of_section,
    ) -> None:
        """`clock` is the run's; `now` gives date and time of day; the writer's thread calls `acknowledge` after every commit.

        seal : names the station and signs the end of the run; None: the run tells no station and is not signed
        document_of : what is told of the result
        """
        self.run = ""
        self.evidence: RecordReference | None = None
        self._started: RunStarted | None = None
        self.began = now()
        self._store, self._inputs, self._clock, self._now = store, inputs, clock, now
        self._commit_s, self._acknowledge, self._seal = commit_s, acknowledge, seal
        self._document_of = document_of
        self._queue: Buffer[Arrived | _Pose] = Buffer(queue_bytes)
        self._pack = _Packing()
        self._last_pose: tuple[str, float] = ("", float("-inf"))
        self._closing = threading.Event()
        self._has_begun = threading.Event()
        self._failure: Exception | None = None
        self._writer: threading.Thread | None = None

    def __call__(self, event: Event) -> None:
        """Take an event of the run. Raises StoreError when the record cannot be kept."""
        if isinstance(event, Arrived):
            if self._writer is None and not isinstance(event.arrival, LinkDown):  # the device is there: this is a run
                self._begin()
            self._hand(event, _size(event))
        elif isinstance(event, Judged):
            self._note_pose(event)
        elif isinstance(event, RunStarted):
            self._started = event
        elif isinstance(event, RunFinished) and self.run:
            self._end(event)

    def check(self) -> None:
        """Raise StoreError when the record cannot be kept any more, also while nothing arrives."""
        if self._failure is not None:
            raise self._no_record()

    def __enter__(self) -> "Recorder":
        return self

    def __exit__(self, _kind: object, error: BaseException | None, _trace: object) -> None:
        """Close a run that did not come to its end: what was handed over is kept, and why it ended."""
        if self._writer is None:
            return
        self._stop_writing()
        why = f"the program failed: {error!r}" if self._failure is None else f"the record could not be kept: {self._failure}"
        try:
            self._store.append([self._end_draft("interrupted", why, self._pack.counts())], self._sign)
        except StoreError:
            if self._failure is None:
                raise
            # the disk is still full: whoever reads the records finds a run without an end, which was interrupted

    def _begin(self) -> None:
        """Add the run to the records. A device that never opened gives no run: nothing was measured."""
        assert self._started is not None, "a run begins with RunStarted"
        began, started, inputs = self.began, self._started, self._inputs
        self.run = f"{began:%Y%m%d-%H%M%S}-{self._store.count_runs() + 1:04d}"
        plan = inputs.plan.encode()
        header = {
            "run": self.run,
            "started": utc_words(began),
            "clock_s": self._clock(),
            **asdict(started),
            **({"station": self._seal.station} if self._seal else {}),
            "software": dict(inputs.software),
            "plan_file": inputs.plan_file,
            "plan_sha256": hashlib.sha256(plan).hexdigest(),
            "nominal": inputs.nominal_name,
            "nominal_sha256": hashlib.sha256(inputs.nominal).hexdigest(),
            **({"stack": dict(inputs.stack)} if inputs.stack else {}),
        }
        writer = threading.Thread(target=self._write, name="record", daemon=True)
        try:
            writer.start()  # before anything is recorded: where the system has no thread to give, there is no run
        except RuntimeError as error:
            raise StoreError(f"{self._store.path}: no record can be kept: {error}; close other programs") from error
        self._writer = writer
        try:
            head = [self._draft("run", pack_document(header)), self._draft("plan", plan), self._draft("nominal", inputs.nominal)]
            self._store.append(head)
            self._has_begun.set()
        except BaseException:
            self._stop_writing()
            raise

    def _hand(self, item: "Arrived | _Pose", size: int) -> None:
        if not self._queue.give(item, size):
            raise self._no_record()

    def _note_pose(self, event: Judged) -> None:
        """Note the pose when the state of the registration changes, and every tenth of a second while it moves."""
        update, (state, noted_s) = event.update, self._last_pose
        if update.registration is None or (update.state == state and event.time_s < noted_s + _POSE_S):
            return
        self._last_pose = update.state, event.time_s
        from inspection import LiveUpdate  # noqa: PLC0415 - who reads records needs no inspection

        moment = {"time_s": event.time_s, "points": update.stop, "state": update.state}
        found = _pose_of(update) if isinstance(update, LiveUpdate) else _pose_in_space(update.registration)
        self._hand(_Pose(moment | found), _SMALL_BYTES)

    def _end(self, finished: RunFinished) -> None:
        self._stop_writing()
        self.check()
        result = self._document_of(finished.result, finished.counts)
        try:
            sha256 = self._keep_judged(result, finished.result)
            drafts = [self._draft("result", pack_document(result))] if finished.result is not None else []
            drafts.append(self._end_draft(finished.ending, finished.message, result, sha256))
            end, *signed = self._store.append(drafts, self._sign)[len(drafts) - 1 :]
        except StoreError as error:
            self._failure = error
            raise self._no_record() from error
        plan_sha256 = hashlib.sha256(self._inputs.plan.encode()).hexdigest()
        nominal_sha256 = hashlib.sha256(self._inputs.nominal).hexdigest()
        signature = signature_in(self._store, signed[0]).beside_result() if signed else None
        self.evidence = RecordReference(self.run, end.sha256.hex(), plan_sha256, nominal_sha256, self._inputs.software, signature)

    def _sign(self, end: Record) -> list[Draft]:
        """The signature of the run, which is committed together with its end: no run that was signed is ever found without it."""
        return [] if self._seal is None else self._seal.sign(end)

    def _keep_judged(self, document: Mapping[str, Any], result: "InspectionResult | SurfaceResult | None") -> str:
        """Write the judged rows, some megabytes at a time, and return the hash of the result. They count once the result follows."""
        digest = hashlib.sha256(pack_document(document))
        bodies = judged_bodies(result)
        while drafts := [self._draft("deviations", body, count) for count, body in islice(bodies, _JUDGED_BODIES)]:
            for draft in drafts:
                digest.update(draft.body)
            self._store.append(drafts)
        return digest.hexdigest()

    def _end_draft(self, state: str, message: str, result: Mapping[str, Any], sha256: str = "") -> Draft:
        return end_draft(self.run, state, message, self._now(), result, sha256)

    def _stop_writing(self) -> None:
        """Make the writer commit everything that waits, and wait until it has ended."""
        if self._writer is not None:
            self._closing.set()
            self._writer.join()
            self._writer = None

    def _no_record(self) -> StoreError:
        safe = f"{self._pack.acknowledged.points} points are safe in run {self.run}"
        return StoreError(f"the record of this run cannot be kept, so it has no result; {safe}. {self._failure}")

    def _write(self) -> None:
        try:
            while not self._has_begun.wait(self._commit_s):  # a lost link may wait already, and the head stands before everything else
                if self._closing.is_set():
                    return
            while not self._closing.wait(self._commit_s):
                self._commit_all()
            self._commit_all()
        except Exception as error:  # whatever it is, the run must hear of it
            self._failure = error
        finally:
            self._queue.close()

    def _commit_all(self) -> None:
        """Commit what waits, some megabytes at a time: of these the packed bodies are held as well."""
        while items := self._queue.take(0.0, COMMIT_BYTES):
            self._commit(items)

    def _commit(self, items: "Sequence[Arrived | _Pose]") -> None:
        drafts = [self._draft(kind, body, count) for kind, body, count in self._pack.bodies(items)]
        if drafts:
            self._store.append(drafts)
            self._pack.acknowledged = Acknowledged(self._pack.wire_bytes, self._pack.points)
            self._pack.kept = self._pack.points + self._pack.rejected
            self._acknowledge(self._pack.acknowledged)

    def _draft(self, kind: Kind, body: bytes, count: int = 1) -> Draft:
        return Draft(self.run, kind, body, count)


@dataclass(slots=True)
class _Packing:
    """Turns what was handed over into bodies of records, and knows how far the run has come."""

    reads: int = 0
    wire_bytes: int = 0
    points: int = 0
    rejected: int = 0
    kept: int = 0  # points and rejected ones that are on record
    acknowledged: Acknowledged = field(default_factory=lambda: Acknowledged(0, 0))

    def bodies(self, items: "Sequence[Arrived | _Pose]") -> list[tuple[Kind, bytes, int]]:
        reads: list[WireBytes] = []
        batches: list[PointBatch] = []
        moments: list[PlacedArrival] = []
        poses: list[Mapping[str, Any]] = []
        for item in items:
            if isinstance(item, _Pose):
                poses.append(item.document)
            elif isinstance(item.arrival, WireBytes):
                reads.append(item.arrival)
                self.reads += 1
                self.wire_bytes += len(item.arrival.data)
            elif isinstance(item.arrival, PointBatch):
                batches.append(item.arrival)
                self.points += len(item.arrival)
            else:
                moments.append(PlacedArrival(item.time_s, self.reads, self.points, item.arrival))
                self.rejected += item.arrival.count if isinstance(item.arrival, Rejected) else 0
        found: list[tuple[Kind, bytes, int]] = [("wire", pack_reads(reads), len(reads))] if reads else []
        found += _bodies_of_points(batches) if batches else []
        found += [("events", pack_arrivals(moments), len(moments))] if moments else []
        found += [("registration", pack_document(poses), len(poses))] if poses else []
        return found

    def counts(self) -> dict[str, int]:
        """What is on record: a batch that the full disk refused is not, though the end of its run may still have found room."""
        return {"received": self.kept}


def _bodies_of_points(batches: Sequence[PointBatch]) -> list[tuple[Kind, bytes, int]]:
    """The points, and behind each body of them that of their normals, where the device gives any."""
    normals = pack_normals(batches, CHUNK_POINTS)
    found: list[tuple[Kind, bytes, int]] = []
    for count, body in pack_points(batches, CHUNK_POINTS):
        found.append(("points", body, count))
        found += [("normals", directions, rows) for rows, directions in islice(normals, 1)]
    return found


def _pose_of(update: "LiveUpdate") -> dict[str, Any]:
    """The pose of a section, as its history tells it."""
    registration = update.registration
    assert registration is not None
    pose = registration.nominal_from_section
    return {
        "rotation_rad": pose.rotation_rad,
        "translation_mm": pose.translation_mm.tolist(),
        "rms_mm": number(registration.rms_mm),
        "can_move_mm": number(update.can_move_mm),
        "iterations": registration.iterations,
        "converged": registration.converged,
    }


def _pose_in_space(registration: "SurfaceRegistration | None") -> dict[str, Any]:
    """The pose of a surface, likewise."""
    assert registration is not None
    pose = registration.nominal_from_scan
    return {
        "rotation": pose.rotation.tolist(),
        "translation_mm": pose.translation_mm.tolist(),
        "rms_mm": number(registration.rms_mm),
        "steps": registration.steps,
        "converged": registration.converged,
        "settles_within_mm": number(registration.settles_within_mm),
    }


def end_draft(run: str, state: str, message: str, now: datetime, result: Mapping[str, Any], sha256: str = "") -> Draft:
    """The record that closes a run: its state, the number of points received, and verdict and coverage where the part was found."""
    found = bool(result.get("received") and result.get("registration"))
    document = {
        "state": state,
        "message": message,
        "ended": utc_words(now),
        "received": result.get("received", 0),
        "verdict": result.get("verdict") if found else None,
        "coverage": result.get("coverage") if found else None,
        "result_sha256": sha256,
    }
    return Draft(run, "end", pack_document(document))


def _size(event: Arrived) -> int:
    arrival = event.arrival
    if isinstance(arrival, WireBytes):
        return len(arrival.data) + _SMALL_BYTES
    if isinstance(arrival, PointBatch):
        normals = 0 if arrival.normals is None else arrival.normals.nbytes
        return arrival.sequence.nbytes + arrival.time_s.nbytes + arrival.points_mm.nbytes + normals + _SMALL_BYTES
    return _SMALL_BYTES
