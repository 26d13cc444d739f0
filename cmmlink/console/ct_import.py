"""A CT surface inspected from the page: how far it is, and every section as it comes."""

import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from cmmlink.console.protocol import SectionRow, SurfaceState
from cmmlink.console.refused import without_folders
from cmmlink.endings import Ended
from cmmlink.errors import StoreError
from cmmlink.events import RunStarted
from cmmlink.run_context import RunContext
from cmmlink.words import NOT_MEASURED, Headline, headline_of
from drivers import DeviceError
from inspection import Verdict

_MOST_SHOWN = 1000


@dataclass(frozen=True, slots=True, eq=False)
class Section:
    """One section of a surface, judged."""

    height_mm: float
    context: RunContext
    started: RunStarted
    ended: Ended
    warnings: tuple[str, ...]


InspectSurface = Callable[[Path, threading.Event, Callable[[int], None], Callable[[Section], None]], tuple[str, Sequence[str]]]
"""Inspect the surface of a CT plan. Arguments: its file, the event that aborts it, what is called with the number of sections,
and what is called with each section. Returns a sentence on the whole, and the notes on the surface and its nominals."""


class CtImport:
    """The inspection of a surface that goes on, or the last one.

    Guarded by its own lock, which is held only while values are replaced; readers of `state` do not take it.
    """

    def __init__(self, clock: Callable[[], float]) -> None:
        self._clock = clock
        self._lock = threading.Lock()
        self._began_s = 0.0
        self._sections: list[Section] = []
        self._state = SurfaceState("", "", "none", "none", "", (), 0, 0, None, ())

    @property
    def state(self) -> SurfaceState:
        """How far it is, and the sections judged so far. Waits for nobody."""
        return self._state

    def carry_out(self, inspect: InspectSurface, file: Path, stop: threading.Event, raise_alarm: Callable[[str, str], None]) -> None:
        """Inspect a surface to its end, whatever that is.

        raise_alarm : called with what failed and its details, where it is no fault of plan, surface or nominal
        """
        try:
            self.end(*inspect(file, stop, self.expect, self.add))
        except (DeviceError, ValueError, OSError) as error:  # plan, surface or nominal cannot be used
            self.end(str(error).replace(str(file), file.name), failed=True)
        except StoreError as error:
            self.end(f"Record not kept: {error}", failed=True)
            raise_alarm("Record not kept", str(error))
        except Exception as error:  # in a thread of its own nobody else would hear of a defect
            self.end(f"defect in the program ({type(error).__name__}): {error}", failed=True)
            raise_alarm("Defect in the program", repr(error))

    def begin(self, plan: str) -> None:
        """Begin with another surface, which is read first."""
        with self._lock:
            self._sections = []
            self._state = SurfaceState(plan, "READING", "none", "reading", "", (), 0, 0, None, ())

    def expect(self, sections: int) -> None:
        """Note how many sections will come."""
        with self._lock:
            self._began_s = self._clock()
            self._state = replace(self._state, state="inspecting", word="INSPECTING", total=sections)

    def add(self, section: Section) -> None:
        """Add a section that was judged."""
        row = _row_of(section)
        with self._lock:
            self._sections.append(section)
            done, state = len(self._sections), self._state
            rows = (*state.sections, row) if done <= _MOST_SHOWN else state.sections
            remaining_s = round((self._clock() - self._began_s) / done * (state.total - done))
            self._state = replace(state, done=done, remaining_s=remaining_s, sections=rows)

    def end(self, message: str, notes: Sequence[str] = (), failed: bool = False) -> None:
        """Note that it is over, what came of it, and what was assumed."""
        with self._lock:
            headline = NOT_MEASURED if failed or not self._sections else _headline_of(self._sections, self._state.total)
            ended = replace(
                self._state,
                word=headline.words,
                shape=headline.shape,
                message=without_folders(message),
                notes=tuple(map(without_folders, notes)),
                remaining_s=None,
            )
            self._state = replace(ended, state="failed" if failed else "done")

    def section(self, index: int) -> Section | None:
        """Give the section at a place in the list, None where there is none."""
        with self._lock:
            return self._sections[index] if 0 <= index < len(self._sections) else None


def _headline_of(sections: Sequence[Section], total: int) -> Headline:
    """The verdict of the worst section; aborted, and how far it came, where sections are missing or one did not come to its end."""
    whole = len(sections) >= total and all(section.ended.ending == "complete" for section in sections)
    worst = max(Verdict[section.ended.result["verdict"].upper()] for section in sections)
    return headline_of(worst, "complete" if whole else "aborted", len(sections) / max(total, 1))


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
