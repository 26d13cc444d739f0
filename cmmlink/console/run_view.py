"""What the page shows of one run: a sink that keeps the newest state and nothing else, in constant memory.

The run calls it and goes on at once; pages look whenever they are ready. Nothing is queued, so a slow page never slows a run.
"""

import math
import threading
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import datetime
from typing import Any, Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from cmmlink.console.extremes import DEVIATION, FOOT_X, NORMAL_X, STATION, VERDICT, ChangedBins, Extremes
from cmmlink.events import Arrived, Counts, Event, Judged, RunStarted
from cmmlink.result_json import number, summary
from drivers import Heartbeat, LinkDown, PointBatch, ScanClosed, ScanOpened
from inspection import LiveUpdate, NominalProfile, ToleranceZone, Verdict, coverage

Phase = Literal["preparing", "starting", "measuring", "ending", "finished"]

WORDS = {Verdict.CONFORM: "CONFORM", Verdict.UNCERTAIN: "NOT PROVEN", Verdict.NONCONFORM: "NOT CONFORM"}
_COUNTED = ("received", "judged", "rejected", "lost", "damaged_bytes", "rejected_by_reason")
_RATE_OVER_S = 1.0
_RATE_STEP_S = 0.05
_COVERAGE_EVERY_S = 0.25


class Rows(Protocol):
    """The judged points of a result: what an InspectionResult has, and what the records keep of one."""

    @property
    def station_mm(self) -> NDArray[np.float64]: ...  # noqa: D102
    @property
    def deviation_mm(self) -> NDArray[np.float64]: ...  # noqa: D102
    @property
    def foot_mm(self) -> NDArray[np.float64]: ...  # noqa: D102
    @property
    def actual_mm(self) -> NDArray[np.float64]: ...  # noqa: D102
    @property
    def verdicts(self) -> NDArray[np.int8]: ...  # noqa: D102


@dataclass(frozen=True, slots=True, eq=False)
class Ended:
    """How a run ended: its ending, why there is no result, the result's numbers as the command line gives them, and its rows."""

    ending: str
    message: str
    facts: Mapping[str, Any]
    rows: Rows | None


@dataclass(frozen=True, slots=True, eq=False)
class RunFacts:
    """What is known of a run before it begins, and what it is judged by."""

    number: str
    plan: str
    profile: NominalProfile
    zone: ToleranceZone
    coverage_min: float
    buffer_points: int
    began: datetime


class RunView:
    """The state of one run as a page shows it.

    clock : the run's clock, s; now : the time of day
    """

    def __init__(self, facts: RunFacts, clock: Callable[[], float], now: Callable[[], datetime]) -> None:
        self.facts = facts
        self._clock, self._now = clock, now
        self._lock = threading.Lock()
        self._extremes = Extremes(facts.profile.length_mm, facts.zone.middle_mm)
        self._started = RunStarted("", "", "", "", False)
        self._phase: Phase = "preparing"
        self._counts = Counts()
        self._link: Literal["connecting", "up", "down", "closed"] = "connecting"
        self._expected: int | None = None
        self._device_name = ""
        self._received: deque[tuple[float, int]] = deque()
        self._alive_s = -math.inf
        self._latency_s = math.nan
        self._verdict_at: datetime | None = None
        self._update: LiveUpdate | None = None
        self._out = 0
        self._coverage, self._coverage_s = 0.0, -math.inf
        self._ended: Ended | None = None
        self._failure = self._remark = ""

    def __call__(self, event: Event) -> None:
        """Take one event of the run."""
        with self._lock:
            if isinstance(event, RunStarted):
                self._started = event
            elif isinstance(event, Arrived):
                self._arrived(event)
            elif isinstance(event, Judged):
                self._judged(event)
            else:
                self._end(Ended(event.ending, event.message, summary(event.result, event.counts), event.result), event.counts)

    def recall(self, started: RunStarted, ended: Ended) -> None:
        """Show a run as the records hold it."""
        facts = ended.facts
        with self._lock:
            self._started = started
            self._end(ended, Counts(**{name: facts[name] for name in _COUNTED if name in facts}))

    def prepared(self) -> None:
        """Everything is ready; now the device is asked for points."""
        with self._lock:
            if self._phase == "preparing":
                self._phase = "starting"

    def fail(self, message: str) -> None:
        """The run broke off without a word of its own."""
        with self._lock:
            self._failure, self._phase, self._link = message, "finished", "closed"

    def remark(self, words: str) -> None:
        """Something the operator should read beside the verdict."""
        with self._lock:
            self._remark = words

    def end_soon(self) -> None:
        """The operator ended or aborted the run; what was received is still being judged."""
        with self._lock:
            if self._phase != "finished":
                self._phase = "ending"

    @property
    def over(self) -> bool:
        """Whether the run has come to its end."""
        return self._phase == "finished"

    def points_since(self, version: int, generation: int) -> tuple[ChangedBins, datetime | None]:
        """The bins that changed after `version`, and when the newest verdict in them was given."""
        with self._lock:
            return self._extremes.changed_since(version, generation), self._verdict_at

    def state(self) -> dict[str, Any]:
        """Everything in numbers and words, ready for JSON."""
        with self._lock:
            ended = self._ended
            counts = self._counts
            return {
                "number": self.facts.number,
                "plan": self.facts.plan,
                "part": self._started.part,
                "serial_number": self._started.serial_number,
                "operator": self._started.operator,
                "device": self._device_name or self._started.device,
                "address": self._started.device,
                "simulated": self._started.simulated,
                "began": self.facts.began.isoformat(timespec="seconds"),
                "phase": self._phase,
                "ending": "failed" if self._failure else ended.ending if ended else None,
                "message": self._failure or (ended.message if ended else ""),
                "remark": self._remark,
                "link": self._link,
                "streaming": self._streaming(),
                "received": counts.received,
                "judged": counts.judged,
                "rejected": counts.rejected,
                "pending": counts.pending,
                "lost": counts.lost,
                "damaged_bytes": counts.damaged_bytes,
                "rejected_by_reason": dict(counts.rejected_by_reason),
                "expected": self._expected,
                "rate_per_s": self._rate(),
                "buffered": counts.buffered,
                "buffer_peak": counts.buffer_peak,
                "buffer_capacity": self.facts.buffer_points,
                "stalls": counts.stalls,
                "latency_s": number(self._latency_s),
                "verdict_at_ms": self._verdict_at.timestamp() * 1e3 if self._verdict_at else None,
                "registration": self._registration(),
                "coverage": self._coverage,
                "coverage_min": self.facts.coverage_min,
                "out_of_tolerance": self._out,
                "worst": self._worst(),
                "verdict": self._verdict(),
                "length_mm": self.facts.profile.length_mm,
                "zone": {name: getattr(self.facts.zone, name) for name in ("lower_mm", "upper_mm", "uncertainty_mm")},
            }

    def _arrived(self, event: Arrived) -> None:
        arrival = event.arrival
        if isinstance(arrival, LinkDown):
            self._link = "down"
            return
        self._link = "up"
        if self._phase in ("preparing", "starting"):
            self._phase = "measuring"
        if isinstance(arrival, (PointBatch, Heartbeat)):
            self._alive_s = event.time_s
        elif isinstance(arrival, ScanOpened):
            self._expected, self._device_name = arrival.expected, " ".join(filter(None, (arrival.device, arrival.serial_number)))
        elif isinstance(arrival, ScanClosed):
            self._link = "closed"

    def _judged(self, event: Judged) -> None:
        update = event.update
        if update.first == 0:
            self._extremes.clear()
            self._out = 0
        self._extremes.add(update.station_mm, update.deviation_mm, update.foot_mm, update.actual_mm, update.verdicts)
        self._out += int(np.count_nonzero(update.verdicts == Verdict.NONCONFORM))
        self._update, self._counts, self._latency_s = update, event.counts, event.age_s
        if event.counts.judged:
            self._verdict_at = self._now()
        self._note_rate(event.time_s, event.counts.received)
        if event.time_s - self._coverage_s > _COVERAGE_EVERY_S:
            self._coverage, self._coverage_s = coverage(self._extremes.stations_mm, self.facts.profile), event.time_s

    def _end(self, ended: Ended, counts: Counts) -> None:
        """Replace everything provisional by the result."""
        self._phase, self._ended, self._counts = "finished", ended, counts
        self._link = "down" if ended.ending == "interrupted" else "closed"
        self._coverage, self._out = ended.facts["coverage"], ended.facts["out_of_tolerance"]
        rows = ended.rows
        if rows is not None:
            self._extremes.clear()
            self._extremes.add(rows.station_mm, rows.deviation_mm, rows.foot_mm, rows.actual_mm, rows.verdicts)
            self._verdict_at = self._now()

    def _note_rate(self, time_s: float, received: int) -> None:
        if self._received and time_s - self._received[-1][0] < _RATE_STEP_S:
            return
        self._received.append((time_s, received))
        while len(self._received) > 2 and time_s - self._received[0][0] > _RATE_OVER_S:
            self._received.popleft()

    def _rate(self) -> float:
        """Points per second over the last second; falls to nothing when nothing comes."""
        if self._phase == "finished" or len(self._received) < 2:
            return 0.0
        (first_s, first), (last_s, last) = self._received[0], self._received[-1]
        span_s = max(last_s - first_s, self._clock() - last_s)
        return round((last - first) / span_s, 1) if span_s > 0 else 0.0

    def _streaming(self) -> bool:
        return self._phase in ("measuring", "ending") and self._link == "up" and self._clock() - self._alive_s < _RATE_OVER_S

    def _registration(self) -> dict[str, Any]:
        """Where the registration stands, by how much values can still move, and how many other poses fit as well."""
        found = self._ended.facts["registration"] if self._ended else None
        if found is not None:
            return {"state": "settled", "can_move_mm": 0.0, "other_poses": len(found.get("other_poses", []))}
        if self._update is None:
            return {"state": "seeking", "can_move_mm": None, "other_poses": 0}
        return {"state": self._update.state, "can_move_mm": number(self._update.can_move_mm), "other_poses": 0}

    def _worst(self) -> dict[str, Any] | None:
        worst = self._extremes.worst
        if worst is None:
            return None
        x, y = worst[FOOT_X : FOOT_X + 2] + worst[DEVIATION] * worst[NORMAL_X : NORMAL_X + 2]
        return {
            "station_mm": float(worst[STATION]),
            "deviation_mm": float(worst[DEVIATION]),
            "x_mm": float(x),
            "y_mm": float(y),
            "verdict": Verdict(int(worst[VERDICT])).word,
        }

    def _verdict(self) -> dict[str, Any]:
        """The word, whether it is final, and why it is so."""
        if self._failure:
            return {"word": WORDS[Verdict.UNCERTAIN], "final": True, "why": "the run broke off"}
        if self._ended is not None:
            return _final_verdict(self._ended, self.facts.coverage_min)
        if self._phase == "preparing":
            return {"word": WORDS[Verdict.UNCERTAIN], "final": False, "why": "preparing the inspection"}
        provisional = self._update is None or self._update.state != "settled"
        if self._out:
            why = f"{_points(self._out)} out so far"
            return {"word": WORDS[Verdict.NONCONFORM], "final": False, "why": why + (", provisional" if provisional else "")}
        if not self._counts.judged:
            waiting = self._update is not None and self._update.state == "seeking"
            return {"word": WORDS[Verdict.UNCERTAIN], "final": False, "why": "seeking the part" if waiting else "waiting for points"}
        return {"word": WORDS[Verdict.UNCERTAIN], "final": False, "why": f"{self._coverage:.0%} measured, none out so far"}


def _final_verdict(ended: Ended, coverage_min: float) -> dict[str, Any]:
    verdict = Verdict[ended.facts["verdict"].upper()]
    return {"word": WORDS[verdict], "final": True, "why": _why(ended, verdict, coverage_min)}


def _why(ended: Ended, verdict: Verdict, coverage_min: float) -> str:
    """One line under the verdict."""
    facts = ended.facts
    if facts["registration"] is None:
        if ended.ending == "interrupted" and facts["received"]:
            return "cut short; Replay judges what was received"
        return "no part found" if facts["received"] else "no point was received"
    if verdict is Verdict.NONCONFORM:
        places = f", {len(facts['stretches'])} places" if len(facts["stretches"]) > 1 else ""
        return f"{_points(facts['out_of_tolerance'])} out of tolerance{places}"
    if verdict is Verdict.CONFORM:
        return f"all {_points(facts['judged'])} within tolerance"
    if ended.ending != "complete":
        return "the scan was aborted" if ended.ending == "aborted" else "the scan was cut short"
    if not facts["judged"]:
        return "no point could be judged"
    if facts["coverage"] < coverage_min:
        return f"only {facts['coverage']:.1%} measured, {coverage_min:.1%} needed"
    if outliers := facts["rejected_by_reason"].get("outlier"):
        return f"{_points(outliers)} rejected as outliers, not judged"
    return "too close to a limit for the uncertainty"


def _points(count: int) -> str:
    return f"{count:,} point{'s' if count != 1 else ''}"
