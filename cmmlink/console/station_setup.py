"""What a station needs from outside: plans, devices, records, clocks. The command line provides it."""

import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Protocol

from cmmlink.console.ct_import import InspectSurface
from cmmlink.console.past_runs import OpenedRun
from cmmlink.console.protocol import RunRow
from cmmlink.console.trend_look import TrendLook
from cmmlink.devices import Connect
from cmmlink.events import Sink
from cmmlink.record import RunSearch
from cmmlink.run import FinishedRun
from cmmlink.surface_run import FinishedSurface


class Records(Protocol):
    """What the station asks of its records."""

    @property
    def folder(self) -> Path:
        """Where runs are recorded."""

    def runs(self) -> Sequence[RunRow]:
        """The newest runs, newest first."""

    def find_runs(self, search: RunSearch) -> tuple[Sequence[RunRow], int]:
        """The newest of the runs that are looked for, newest first, and how many there are."""

    def measured_before(self, part: str, serial_number: str) -> str | None:
        """Give the newest run of a part with this serial number, None where there is none."""

    def open_run(self, run: str) -> OpenedRun:
        """Give one run as it was recorded."""

    def replay_run(self, run: str, sinks: Sequence[Sink], stop: threading.Event) -> str:
        """Measure a run again from its record; returns a sentence that says whether the result is identical."""

    def export_run(self, run: str, folder: Path) -> Path:
        """Write one run as a zip archive into a folder."""

    def report_run(self, run: str, folder: Path, settings: Mapping[str, str]) -> Path:
        """Write the report of one run into a folder; `settings` are those of its look that are not as its plan says."""

    def compare_runs(self, first: str, second: str, folder: Path) -> Path:
        """Draw two runs of one profile and their difference into a folder."""


@dataclass(frozen=True, slots=True)
class StationSetup:
    """Everything a station needs from outside.

    plans   : name -> file, looked up anew each time
    connect : opens the device of a plan for one scan
    devices : addresses of devices that can be seen now, with a description each
    records : None where nothing is recorded
    clock   : monotonic, s; now : date and time of day
    ct_plans, inspect_surface : plans of CT surfaces, and what inspects one; None where that is not possible
    write   : writes the results of a run where its plan wants them
    folder  : of the plans, where new ones are saved; None where the page makes none
    trends  : looks into the results of the plant; None where the station has no results database
    push_from : the folder of the records whose results are pushed to the plant's database; None: they are not
    demo    : the plan of the demonstration, whose simulated device `connect` opens as well; None where there is none
    """

    plans: Callable[[], Mapping[str, Path]]
    connect: Connect
    devices: Callable[[], Sequence[tuple[str, str]]]
    records: Records | None
    clock: Callable[[], float]
    now: Callable[[], datetime]
    ct_plans: Callable[[], Mapping[str, Path]] = dict
    inspect_surface: InspectSurface | None = None
    write: Callable[[FinishedRun | FinishedSurface], None] = lambda _: None
    folder: Path | None = None
    demo: Path | None = None
    push_from: Path | None = None
    trends: TrendLook | None = None
