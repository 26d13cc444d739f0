"""What went wrong and who has seen it: alarms of a station, each counted up instead of repeated."""

import threading
from collections.abc import Callable
from dataclasses import dataclass, replace
from datetime import datetime
from typing import Literal

from cmmlink.console.protocol import AlarmList, AlarmRow
from cmmlink.events import Arrived, Event, Judged, RunFinished, RunStarted
from drivers import Damaged, LinkDown, LinkUp, Lost, Rejected

Severity = Literal["fault", "warning"]
_MOST = 200  # alarms kept; the oldest acknowledged ones go first


@dataclass(frozen=True, slots=True)
class Alarm:
    """One thing that went wrong. `active` says that it is still so; `count` how much of it there was."""

    number: int
    severity: Severity
    what: str
    detail: str
    count: int
    since: datetime
    active: bool
    acknowledged: bool


class Alarms:
    """The list of alarms, and a sink that fills it from a run."""

    def __init__(self, now: Callable[[], datetime]) -> None:
        self._now = now
        self._alarms: dict[int, Alarm] = {}
        self._of_this_run: dict[tuple[str, str], int] = {}
        self._number = self._stalls = 0
        self._lock = threading.RLock()

    def __call__(self, event: Event) -> None:
        """Take one event of a run."""
        if isinstance(event, RunStarted):
            self._of_this_run.clear()
            self._stalls = 0
            self.clear_active()
        elif isinstance(event, Arrived):
            self._arrived(event)
        elif isinstance(event, Judged):
            if event.counts.stalls > self._stalls:
                self.raise_alarm("warning", "Buffer full", "the device was made to wait", event.counts.stalls - self._stalls)
                self._stalls = event.counts.stalls
        else:
            self._finished(event)

    def raise_alarm(self, severity: Severity, what: str, detail: str, count: int = 1, active: bool = False) -> None:
        """Raise an alarm; within one run the same again is counted up, and a fault asks to be acknowledged again."""
        with self._lock:
            known = self._of_this_run.get((what, detail))
            if known in self._alarms:
                alarm = self._alarms[known]
                seen = alarm.acknowledged and severity != "fault"
                self._alarms[known] = replace(alarm, count=alarm.count + count, active=active, acknowledged=seen)
                return
            self._number += 1
            self._of_this_run[(what, detail)] = self._number
            self._alarms[self._number] = Alarm(self._number, severity, what, detail, count, self._now(), active, False)
            self._forget_old()

    def acknowledge(self, number: int | None = None) -> int:
        """Mark one alarm, or all, as seen; gives how many were not seen before."""
        with self._lock:
            open_ones = [alarm for alarm in self._alarms.values() if not alarm.acknowledged and number in (None, alarm.number)]
            for alarm in open_ones:
                self._alarms[alarm.number] = replace(alarm, acknowledged=True)
            return len(open_ones)

    def clear_active(self) -> None:
        """Say that nothing is wrong any more, of what lasts."""
        with self._lock:
            for alarm in self._alarms.values():
                if alarm.active:
                    self._alarms[alarm.number] = replace(alarm, active=False)

    def newest_first(self) -> list[Alarm]:
        """All alarms kept."""
        with self._lock:
            return sorted(self._alarms.values(), key=lambda alarm: -alarm.number)

    def snapshot(self, most: int) -> AlarmList:
        """The newest alarms as a page shows them."""
        return AlarmList(self.fault, tuple(_row_of(alarm) for alarm in self.newest_first()[:most]))

    @property
    def fault(self) -> bool:
        """Whether a fault is there, or was and nobody has seen it."""
        return any(alarm.severity == "fault" and (alarm.active or not alarm.acknowledged) for alarm in self.newest_first())

    def _arrived(self, event: Arrived) -> None:
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

    def _finished(self, event: RunFinished) -> None:
        if event.ending == "interrupted":
            self.clear_active()
            self.raise_alarm("fault", "Device failed", event.message, active=True)
        elif event.result is None:
            self.raise_alarm("fault", "No part found", event.message)

    def _forget_old(self) -> None:
        surplus = len(self._alarms) - _MOST
        for number in sorted(self._alarms, key=lambda one: (not self._alarms[one].acknowledged, one))[: max(surplus, 0)]:
            del self._alarms[number]


def _row_of(alarm: Alarm) -> AlarmRow:
    return AlarmRow(
        number=alarm.number,
        severity=alarm.severity,
        what=alarm.what,
        detail=alarm.detail,
        count=alarm.count,
        since=alarm.since.strftime("%H:%M:%S"),
        active=alarm.active,
        acknowledged=alarm.acknowledged,
    )
