"""A CT surface inspected from the page: how far it is, and every section as it comes."""

import threading
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from cmmlink.console.run_view import Ended, RunFacts
from cmmlink.events import RunStarted

_MOST_SHOWN = 1000


@dataclass(frozen=True, slots=True, eq=False)
class Section:
    """One section of a surface, judged."""

    height_mm: float
    facts: RunFacts
    started: RunStarted
    ended: Ended
    warnings: tuple[str, ...]


InspectSurface = Callable[[Path, threading.Event, Callable[[int], None], Callable[[Section], None]], str]
"""Inspect the surface of a CT plan: file, stop, hears the number of sections, hears each section; gives a sentence on the whole."""


class CtImport:
    """The import that goes on, or the last one; `version` rises with every change."""

    def __init__(self, clock: Callable[[], float]) -> None:
        self._clock = clock
        self._began_s = 0.0
        self.plan = self._message = ""
        self.state: Literal["none", "reading", "inspecting", "done", "failed"] = "none"
        self.sections: list[Section] = []
        self._total = self.version = 0

    def begin(self, plan: str) -> None:
        """A new import begins: the surface is read."""
        self.plan, self.state, self._message, self._total = plan, "reading", "", 0
        self.sections = []
        self.version += 1

    def expect(self, sections: int) -> None:
        """So many sections will come."""
        self._total, self.state, self._began_s = sections, "inspecting", self._clock()
        self.version += 1

    def add(self, section: Section) -> None:
        """One more section was judged."""
        self.sections.append(section)
        self.version += 1

    def end(self, message: str, failed: bool = False) -> None:
        """The import is over."""
        self._message, self.state = message, "failed" if failed else "done"
        self.version += 1

    def described(self) -> dict[str, Any]:
        """Everything in numbers and words, ready for JSON."""
        done = len(self.sections)
        rows = [_row(section) for section in self.sections[:_MOST_SHOWN]]
        told = {"plan": self.plan, "state": self.state, "message": self._message, "done": done, "total": self._total}
        return {**told, "remaining_s": self._remaining_s(done), "sections": rows}

    def _remaining_s(self, done: int) -> float | None:
        if self.state != "inspecting" or not done:
            return None
        return round((self._clock() - self._began_s) / done * (self._total - done))


def _row(section: Section) -> dict[str, Any]:
    facts, zone = section.ended.facts, section.facts.zone
    worst = facts["worst"] or {}
    return {
        "height_mm": section.height_mm,
        "verdict": facts["verdict"],
        "received": facts["received"],
        "coverage": facts["coverage"],
        "worst_mm": worst.get("deviation_mm"),
        "worst_station_mm": worst.get("station_mm"),
        "lower_mm": zone.lower_mm,
        "upper_mm": zone.upper_mm,
        "warnings": list(section.warnings),
    }
