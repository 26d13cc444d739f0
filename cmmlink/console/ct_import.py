"""A CT surface inspected from the page: how far it is, and every section as it comes."""

import threading
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from cmmlink.console.protocol import SectionRow, SurfaceState
from cmmlink.events import RunStarted
from cmmlink.run_view import Ended, RunContext

_MOST_SHOWN = 1000


@dataclass(frozen=True, slots=True, eq=False)
class Section:
    """One section of a surface, judged."""

    height_mm: float
    context: RunContext
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

    def snapshot(self) -> SurfaceState:
        """Everything in numbers and words."""
        done = len(self.sections)
        rows = tuple(_row_of(section) for section in self.sections[:_MOST_SHOWN])
        return SurfaceState(self.plan, self.state, self._message, done, self._total, self._remaining_s(done), rows)

    def _remaining_s(self, done: int) -> float | None:
        if self.state != "inspecting" or not done:
            return None
        return round((self._clock() - self._began_s) / done * (self._total - done))


def _row_of(section: Section) -> SectionRow:
    result, zone = section.ended.result, section.context.zone
    worst = result["worst"] or {}
    return SectionRow(
        height_mm=section.height_mm,
        verdict=result["verdict"],
        received=result["received"],
        coverage=result["coverage"],
        worst_mm=worst.get("deviation_mm"),
        worst_station_mm=worst.get("station_mm"),
        lower_mm=zone.lower_mm,
        upper_mm=zone.upper_mm,
        warnings=section.warnings,
    )
