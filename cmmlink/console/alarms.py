"""What went wrong and who has seen it: alarms of a station, each counted up instead of repeated."""

import logging
import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from datetime import datetime
from itertools import islice

from cmmlink.console.protocol import AlarmList, AlarmRow, Severity
from cmmlink.console.refused import without_folders
from cmmlink.events import Answered, Arrived, Event, Judged, RunFinished, RunStarted
from cmmlink.words import anchor_words
from drivers import Damaged, LinkDown, LinkUp, Lost, Rejected

_log = logging.getLogger(__name__)

_MOST_KEPT = 200  # the oldest acknowledged ones go first
_MOST_SHOWN = 50
_NOT_ANSWERED = {"not sent": "Not sent to the machine", "not withdrawn": "Earlier answer to the machine not withdrawn"}


class Alarms:
    """The list of alarms, and a sink that fills it from a run. Guarded by its own lock; readers of `shown` do not take it."""

    def __init__(self, now: Callable[[], datetime]) -> None:
        self._now = now
        self._alarms: dict[int, AlarmRow] = {}  # in the order of their numbers
        self._of_this_run: dict[tuple[str, str], int] = {}
        self._run = ""
        self._number = self._stalls = 0
        self._lock = threading.RLock()
        self._shown = AlarmList(False, ())

    def __call__(self, event: Event) -> None:
        """Take one event of a run."""
        if isinstance(event, RunStarted):
            self._begin_run(event.serial_number or event.part)
        elif isinstance(event, Arrived):
            self._take_arrival(event)
        elif isinstance(event, Judged):
            if event.counts.stalls > self._stalls:
                self.raise_alarm("warning", "Buffer full", "the device was made to wait", event.counts.stalls - self._stalls)
                self._stalls = event.counts.stalls
        elif isinstance(event, RunFinished):
            self._take_end(event)
        elif isinstance(event, Answered):
            if event.problem:
                self.raise_alarm("fault", _NOT_ANSWERED[event.state], event.problem)
            if event.unrecorded:
                self.raise_alarm("fault", "What the machine was told is not on record", event.unrecorded)

    @property
    def shown(self) -> AlarmList:
        """The newest alarms as a page shows them. Waits for nobody."""
        return self._shown

    @property
    def fault(self) -> bool:
        """Whether a fault is active, or was and nobody has seen it."""
        return self._shown.fault

    def raise_alarm(self, severity: Severity, what: str, detail: str, count: int = 1, active: bool = False) -> None:
        """Raise an alarm; within one run the same again is counted up, and a fault asks to be acknowledged again."""
        with self._lock:
            known = self._of_this_run.get((what, detail))
            if known in self._alarms:
                alarm = self._alarms[known]
                seen = alarm.acknowledged and severity != "fault"
                self._alarms[known] = replace(alarm, count=alarm.count + count, active=active, acknowledged=seen)
            else:
                self._number += 1
                _log.log(logging.ERROR if severity == "fault" else logging.WARNING, "alarm %d: %s: %s", self._number, what, detail)
                self._of_this_run[(what, detail)] = self._number
                since = self._now().strftime("%Y-%m-%d %H:%M:%S")
                self._alarms[self._number] = AlarmRow(
                    self._number, severity, what, without_folders(detail), count, since, self._run, True, active, False
                )
                self._drop_oldest()
            self._publish()

    def take_anchors(self, anchors: Sequence[Mapping[str, str]]) -> None:
        """Warn of the places outside that were not told how the run ended; its verdict stands."""
        for told in anchors:
            if told["problem"]:
                self.raise_alarm("warning", "An anchor was not told", anchor_words(told["place"], told["problem"]))

    def acknowledge(self, number: int | None = None) -> int:
        """Mark one alarm, or all, as seen; returns how many were not seen before."""
        with self._lock:
            unseen = [alarm for alarm in self._alarms.values() if not alarm.acknowledged and number in (None, alarm.number)]
            for alarm in unseen:
                self._alarms[alarm.number] = replace(alarm, acknowledged=True)
            self._publish()
            return len(unseen)

    def clear_active(self) -> None:
        """Mark every lasting alarm as over."""
        with self._lock:
            for alarm in [alarm for alarm in self._alarms.values() if alarm.active]:
                self._alarms[alarm.number] = replace(alarm, active=False)
            self._publish()

    def newest_first(self) -> list[AlarmRow]:
        """All alarms kept."""
        with self._lock:
            return list(reversed(self._alarms.values()))

    def _begin_run(self, run: str) -> None:
        """Alarms from here on are those of another run; those before are an earlier run's, and none of them lasts."""
        with self._lock:
            self._run = run
            self._alarms = {number: replace(alarm, current=False) for number, alarm in self._alarms.items()}
            self._of_this_run.clear()
            self._stalls = 0
            self.clear_active()

    def _take_arrival(self, event: Arrived) -> None:
        arrival = event.arrival
        if isinstance(arrival, LinkDown):
            self.raise_alarm("fault", "Link lost", arrival.reason, active=True)
        elif isinstance(arrival, LinkUp):
            self.clear_active()
        elif isinstance(arrival, Lost):
            self.raise_alarm("warning", "Data lost", arrival.reason, arrival.count)
        elif isinstance(arrival, Damaged):
            self.raise_alarm("warning", "Damaged bytes", arrival.reason, arrival.byte_count)
        elif isinstance(arrival, Rejected):
            self.raise_alarm("warning", "Points rejected", arrival.reason, arrival.count)

    def _take_end(self, event: RunFinished) -> None:
        if event.ending == "interrupted":
            self.clear_active()
            self.raise_alarm("fault", "Device failed", event.message, active=True)
        elif event.result is None:
            self.raise_alarm("fault", "Not measured", event.message)

    def _drop_oldest(self) -> None:
        surplus = len(self._alarms) - _MOST_KEPT
        for number in sorted(self._alarms, key=lambda one: (not self._alarms[one].acknowledged, one))[: max(surplus, 0)]:
            del self._alarms[number]

    def _publish(self) -> None:
        """Replace what pages are shown; called with the lock held."""
        fault = any(_is_fault_now(alarm) for alarm in self._alarms.values())
        self._shown = AlarmList(fault, tuple(islice(reversed(self._alarms.values()), _MOST_SHOWN)))


def _is_fault_now(alarm: AlarmRow) -> bool:
    """Whether a fault is there: of the current run, and active or unseen."""
    return alarm.severity == "fault" and alarm.current and (alarm.active or not alarm.acknowledged)
