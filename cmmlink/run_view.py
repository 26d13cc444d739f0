"""The newest state of one run, for whoever shows it: a sink that keeps no history, in constant memory.

The run calls it and goes on at once: what is shown of its points is worked out when somebody looks, many batches together, and not
at every batch. What looks is given an immutable `RunState`. Nobody waits for another, so a slow reader never slows a run.
"""

import math
import threading
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from datetime import datetime
from functools import partial
from typing import TYPE_CHECKING, Any

from cmmlink.arrival_rate import ArrivalRate
from cmmlink.characteristic_rows import Characteristics, characteristics_at_end, characteristics_so_far, names_of
from cmmlink.endings import Ended, count_words
from cmmlink.events import Answered, Arrived, Counts, Evaluated, Event, Judged, ProvenOut, RunStarted
from cmmlink.extremes import ChangedBins, PointsVersion
from cmmlink.result_json import number, result_json
from cmmlink.run_context import RunContext
from cmmlink.run_state import AnswerState, LinkPhase, Phase, RunState, VerdictState, WholeSurface, ZoneLimits
from cmmlink.shown_section import ShownSection
from cmmlink.shown_verdict import registration_shown, verdict_at_end, verdict_state
from cmmlink.words import LOOKS_OUT, NOT_MEASURED, VERDICT_WORDS, headline_of, local_words
from drivers import Heartbeat, LinkDown, LinkUp, PointBatch, Rejected, ScanClosed, ScanOpened
from inspection import InspectionResult, LiveUpdate, NominalProfile, Verdict

if TYPE_CHECKING:  # who shows sections alone loads nothing of surfaces
    from cmmlink.worst_voxels import ChangedVoxels
    from inspection.surface import SurfaceResult, SurfaceUpdate

_COUNTED = ("received", "judged", "rejected", "lost", "damaged_bytes", "rejected_by_reason")
_ALIVE_S = 1.0
_COVERAGE_EVERY_S = 0.25
_ROWS_AT_ONCE = 1 << 16
_MOST_WAITING = 8192  # points; the run itself sees to them where nobody looks


class RunView:
    """The newest state of one run, as immutable snapshots.

    One thread hands over the events of the run, and any thread may read. Guarded by its own lock, which is held only while
    fields are set and a snapshot is put together. What was judged waits until somebody reads; whoever reads meanwhile is given what
    was known before.

    clock : the run's clock, s; now : the time of day
    """

    def __init__(self, context: RunContext, clock: Callable[[], float], now: Callable[[], datetime]) -> None:
        self.context = context
        self._clock, self._now = clock, now
        self._lock, self._catching_up = threading.Lock(), threading.Lock()
        self._waiting: list[Judged] = []
        self._waiting_points, self._waiting_at = 0, now()
        self._shown = context.shown()
        self._started = RunStarted("", "", "", "", False)
        self._phase: Phase = "preparing"
        self._counts = Counts()
        self._link: LinkPhase = "connecting"
        self._link_detail = ""
        self._expected: int | None = None
        self._device_name = ""
        self._arrived = 0
        self._rate = ArrivalRate()
        self._alive_s = -math.inf
        self._latency_s = math.nan
        self._verdict_at: datetime | None = None
        self._update: LiveUpdate | SurfaceUpdate | None = None
        self._out = 0
        self._proven_at: int | None = None
        self._evaluated, self._characteristics = Evaluated(0.0, (), None), Characteristics()
        self._coverage, self._coverage_s = 0.0, -math.inf
        self._ended: Ended | None = None
        self._notes: tuple[str, ...] = ()
        self._failure = self._remark = self._run = ""
        self._answer = AnswerState("awaited") if context.answers else None
        self._published = self._state()

    def __call__(self, event: Event) -> None:
        """Take one event of the run."""
        if isinstance(event, RunStarted):
            self._set_started(event)
        elif isinstance(event, Arrived):
            self._take_arrival(event)
        elif isinstance(event, Judged):
            self._take_verdicts(event)
        elif isinstance(event, ProvenOut):
            self._take_proof(event)
        elif isinstance(event, Evaluated):
            self._take_characteristics(event)
        elif isinstance(event, Answered):
            self._take_answer(event)
        else:
            self._end(Ended(event.ending, event.message, *self._told(event.result, event.counts)), event.counts)

    def recall(self, started: RunStarted, ended: Ended) -> None:
        """Show a run as the records hold it."""
        self._set_started(started)
        self._end(ended, Counts(**{name: ended.result[name] for name in _COUNTED if name in ended.result}))

    def await_device(self) -> None:
        """Note that everything is ready, and that the device is asked for points from now on."""
        with self._lock:
            if self._phase == "preparing":
                self._phase = "starting"
            self._publish()

    def fail(self, message: str) -> None:
        """Note that the run broke off before it could give a result; what arrived without a verdict by then has none."""
        self._catch_up(wait=True)
        covered = self._shown.coverage()
        with self._lock:
            self._failure, self._phase, self._link, self._coverage = message, "finished", "closed", covered
            if self._answer is not None:
                self._answer = AnswerState("not sent", problem="the run broke off")
            self._counts = self._counts.broken_off(self._arrived)
            self._publish()

    def remark(self, words: str) -> None:
        """Set what the operator should read beside the verdict."""
        with self._lock:
            self._remark = words
            self._publish()

    def name_record(self, run: str) -> None:
        """Note under which id the records keep the run, now that it is over."""
        with self._lock:
            self._run = run
            self._publish()

    def end_soon(self) -> None:
        """Note that the operator ended or aborted the run; what was received is still being judged."""
        with self._lock:
            if self._phase != "finished":
                self._phase = "ending"
            self._publish()

    @property
    def over(self) -> bool:
        """Whether the run has come to its end."""
        return self._published.phase == "finished"

    def state(self) -> RunState:
        """The newest state. Never waits. Only the rate and `streaming` depend on the moment of the call."""
        self._catch_up()
        state, now_s = self._published, self._clock()
        streaming = state.streaming and now_s - self._alive_s < _ALIVE_S
        return replace(state, streaming=streaming, rate_per_s=0.0 if state.phase == "finished" else self._rate.per_s(now_s))

    @property
    def characteristics(self) -> Characteristics:
        """The newest of the characteristics. Never waits."""
        return self._characteristics

    @property
    def newest_points(self) -> PointsVersion:
        """The version of a reader that has seen all points up to now. Never waits."""
        self._catch_up()
        return self._shown.newest

    def points_since(self, seen: PointsVersion) -> tuple[ChangedBins, datetime | None]:
        """The bins of a section that changed after what was `seen`, and when the newest verdict in them was given."""
        self._catch_up()
        verdict_at, shown = self._verdict_at, self._shown
        assert isinstance(shown, ShownSection)
        return shown.changed_since(seen), verdict_at

    def voxels_since(self, seen: PointsVersion) -> "tuple[ChangedVoxels, datetime | None]":
        """The voxels of a surface that changed after what was `seen`, and when the newest verdict in them was given."""
        self._catch_up()
        verdict_at, shown = self._verdict_at, self._shown
        assert not isinstance(shown, ShownSection)
        return shown.changed_since(seen), verdict_at

    def _set_started(self, started: RunStarted) -> None:
        with self._lock:
            self._started = started
            self._publish()

    def _take_arrival(self, event: Arrived) -> None:
        arrival = event.arrival
        if isinstance(arrival, (PointBatch, Heartbeat)):
            self._alive_s = event.time_s
        if isinstance(arrival, (PointBatch, Rejected)):
            self._arrived += len(arrival) if isinstance(arrival, PointBatch) else arrival.count
        link: LinkPhase = "down" if isinstance(arrival, LinkDown) else "closed" if isinstance(arrival, ScanClosed) else "up"
        begins = link != "down" and self._phase in ("preparing", "starting")
        if link == self._link and not begins and not isinstance(arrival, (ScanOpened, LinkUp)):
            return  # most arrivals do not change what is shown
        with self._lock:
            self._link = link
            if isinstance(arrival, (LinkDown, LinkUp)):
                self._link_detail = arrival.reason if isinstance(arrival, LinkDown) else f"back after {arrival.gap_s:.1f} s"
            if begins and self._phase != "ending":
                self._phase = "measuring"
            if isinstance(arrival, ScanOpened):
                self._expected, self._device_name = arrival.expected, " ".join(filter(None, (arrival.device, arrival.serial_number)))
            self._publish()

    def _take_verdicts(self, event: Judged) -> None:
        self._rate.note(event.time_s, event.counts.received)
        with self._lock:
            if event.update.first == 0:  # all points were judged once more: what was judged before is void
                self._waiting, self._waiting_points = [], 0
            self._waiting.append(event)
            self._waiting_points += len(event.update.deviation_mm)
            self._waiting_at = self._now()
            is_full = self._waiting_points > _MOST_WAITING
        if is_full:
            self._catch_up(wait=True)

    def _catch_up(self, wait: bool = False) -> None:
        """See to all that was judged since somebody looked last; not where another thread is at it, unless told to wait for it."""
        if not (self._waiting or wait) or not self._catching_up.acquire(blocking=wait):
            return
        try:
            with self._lock:
                events, at = self._waiting, self._waiting_at
                self._waiting, self._waiting_points = [], 0
            if events:
                self._show_verdicts(events, at)
        finally:
            self._catching_up.release()

    def _show_verdicts(self, events: Sequence[Judged], at: datetime) -> None:
        updates, newest = [event.update for event in events], events[-1]
        anew = updates[0].first == 0
        shown = self._shown.emptied() if anew else self._shown
        out = shown.add(updates) + (0 if anew else self._out)  # type: ignore[arg-type]  # those of its own kind
        covered, covered_s = self._coverage, self._coverage_s
        if newest.time_s - covered_s > _COVERAGE_EVERY_S:
            covered, covered_s = shown.coverage(), newest.time_s
        with self._lock:
            self._shown, self._out, self._coverage, self._coverage_s = shown, out, covered, covered_s
            self._update, self._counts, self._latency_s = newest.update, newest.counts, newest.age_s
            if newest.counts.judged:
                self._verdict_at = at
            self._publish()

    def _take_proof(self, event: ProvenOut) -> None:
        with self._lock:
            self._proven_at = event.points
            self._characteristics = self._characteristics_so_far()
            self._publish()

    def _take_characteristics(self, event: Evaluated) -> None:
        with self._lock:
            self._evaluated = event
            self._characteristics = self._characteristics_so_far()
            self._publish()

    def _take_answer(self, event: Answered) -> None:
        if event.state == "not withdrawn":
            return  # an alarm says so; the answer to this run is still awaited
        with self._lock:
            told = VERDICT_WORDS[event.verdict] if event.verdict is not None else ""
            self._answer = AnswerState(event.state, event.at.timestamp() * 1e3, event.request, event.problem, told)
            self._publish()

    def _characteristics_so_far(self) -> Characteristics:
        return characteristics_so_far(self._evaluated, None if self._proven_at is None else self.context.base)

    def _end(self, ended: Ended, counts: Counts) -> None:
        """Replace everything provisional by the result."""
        self._catch_up(wait=True)
        shown = self._shown
        if ended.blocks is not None:
            shown = shown.emptied()
            for rows in ended.blocks():
                shown.add_rows(rows)  # type: ignore[arg-type]  # those of its own kind
        with self._lock:
            self._phase, self._ended, self._counts, self._shown = "finished", ended, counts, shown
            self._characteristics = characteristics_at_end(ended.result)
            self._link = "down" if ended.ending == "interrupted" else "closed"
            self._coverage, self._out = ended.result["coverage"], ended.result["out_of_tolerance"]
            self._notes = (*self._started.notes, *ended.result.get("assumed", ()), *(shown.notes if ended.blocks is not None else ()))
            if ended.blocks is not None:
                self._verdict_at = self._now()
            self._publish()

    def _told(
        self, result: "InspectionResult | SurfaceResult | None", counts: Counts
    ) -> tuple[Mapping[str, Any], Callable[[], Iterable[Any]] | None]:
        """What is told of a result as JSON has it, and what gives its rows."""
        document_of = self.context.document_of
        if document_of is None:
            assert result is None or isinstance(result, InspectionResult)
            return result_json(result, counts), result.blocks if result is not None else None
        assert not isinstance(result, InspectionResult)
        from cmmlink.surface_rows import surface_blocks  # noqa: PLC0415 - who shows sections alone loads nothing of surfaces

        return document_of(result, counts), None if result is None else partial(surface_blocks, result, _ROWS_AT_ONCE)

    def _publish(self) -> None:
        """Replace the snapshot; called with the lock held."""
        self._published = self._state()

    def _state(self) -> RunState:
        context, started, counts, ended, zone = self.context, self._started, self._counts, self._ended, self.context.zone
        return RunState(
            number=context.number,
            run=self._run,
            kind=context.kind,
            plan=context.plan,
            part=started.part,
            serial_number=started.serial_number,
            notes=self._notes or started.notes,
            operator=started.operator,
            device=self._device_name or started.device,
            address=started.device,
            simulated=started.simulated,
            began=local_words(context.began),
            phase=self._phase,
            ending="failed" if self._failure else ended.ending if ended else None,
            message=self._failure or (ended.message if ended else ""),
            remark=self._remark,
            link=self._link,
            link_detail=self._link_detail,
            streaming=self._phase in ("measuring", "ending") and self._link == "up",
            received=counts.received,
            judged=counts.judged,
            rejected=counts.rejected,
            pending=counts.pending,
            lost=counts.lost,
            damaged_bytes=counts.damaged_bytes,
            rejected_by_reason=dict(counts.rejected_by_reason),
            expected=self._expected,
            rate_per_s=0.0,
            buffered=counts.buffered,
            buffer_peak=counts.buffer_peak,
            buffer_capacity=context.buffer_points,
            stalls=counts.stalls,
            latency_s=number(self._latency_s),
            verdict_at_ms=self._verdict_at.timestamp() * 1e3 if self._verdict_at else None,
            registration=registration_shown(self._ended, self._update),
            coverage=self._coverage,
            coverage_min=context.coverage_min,
            out_of_tolerance=self._out,
            worst=self._shown.worst,
            verdict=self._verdict(),
            answer=self._answer,
            length_mm=context.length_mm,
            zone=ZoneLimits(zone.lower_mm, zone.upper_mm, zone.guard_mm, zone.decision_rule),
            surface=self._surface(),
        )

    def _surface(self) -> WholeSurface | None:
        if isinstance(self.context.nominal, NominalProfile):
            return None
        if self._ended is None:
            return WholeSurface(self.context.gap_max_mm)
        from cmmlink.shown_surface import whole_surface_in  # noqa: PLC0415 - likewise

        return whole_surface_in(self._ended.result, self.context.gap_max_mm)

    def _verdict(self) -> VerdictState:
        ended = self._ended
        if self._failure:
            headline = headline_of(None, "interrupted", self._coverage) if self._counts.received else NOT_MEASURED
            return verdict_state(headline, True, self._failure)
        return self._verdict_so_far() if ended is None else verdict_at_end(ended, self._characteristics.rows)

    def _verdict_so_far(self) -> VerdictState:
        unproven, out = headline_of(Verdict.UNCERTAIN), headline_of(Verdict.NONCONFORM)
        if self._phase == "preparing":
            return verdict_state(unproven, False, "preparing the inspection")
        proven, looks_out = (names_of(self._characteristics.rows, shape) for shape in (out.shape, LOOKS_OUT.shape))
        if self._proven_at is not None and self.context.base is not None:
            return verdict_state(out, False, f"no placement of the first {count_words(self._proven_at)} passes", of=proven)
        if proven:
            return verdict_state(out, False, "proven, whatever comes", of=proven)
        if self._out:
            is_proof = self.context.base is not None and registration_shown(None, self._update).state == "settled"
            headline, how = (out, "out so far") if is_proof else (LOOKS_OUT, "so far, not proven")
            return verdict_state(headline, False, f"{count_words(self._out)} {how}", of=looks_out)
        if looks_out:
            return verdict_state(LOOKS_OUT, False, "so far, not proven", of=looks_out)
        if not self._counts.judged:
            is_sought = self._update is not None and self._update.state == "seeking"
            return verdict_state(unproven, False, "seeking the part" if is_sought else "waiting for points")
        return verdict_state(unproven, False, f"{math.floor(100 * self._coverage)} % measured, none out so far")
