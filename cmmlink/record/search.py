"""Which of the recorded runs are looked for: by part, serial number, operator, plan, verdict and date."""

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import date, datetime
from typing import Any, Literal

VerdictSought = Literal["", "conform", "nonconform", "uncertain", "none"]

_KEYS = {"part": "part", "serial_number": "serial_number", "operator": "operator", "plan": "plan_file"}  # of a line of the list


@dataclass(frozen=True, slots=True)
class RunSearch:
    """What a run has to have; what is empty asks for nothing.

    part, serial_number, operator, plan : a piece of the text, large and small letters alike
    verdict      : of a run that came to its end; none: of those that ended early, go on, or gave no verdict
    since, until : days at this place, both included, on which the run began
    """

    part: str = ""
    serial_number: str = ""
    operator: str = ""
    plan: str = ""
    verdict: VerdictSought = ""
    since: date | None = None
    until: date | None = None

    def finds(self, entry: Mapping[str, Any]) -> bool:
        """Whether a line of the list of runs has it all."""
        if any(getattr(self, name).strip().casefold() not in str(entry[key] or "").casefold() for name, key in _KEYS.items()):
            return False
        verdict = entry["verdict"] if entry["state"] == "complete" and entry["verdict"] else "none"
        return self.verdict in ("", verdict) and self._finds_day(entry["started"])

    def _finds_day(self, started: str | None) -> bool:
        if self.since is None and self.until is None:
            return True
        if not started:
            return False
        day = datetime.fromisoformat(started).astimezone().date()
        return (self.since is None or self.since <= day) and (self.until is None or day <= self.until)
