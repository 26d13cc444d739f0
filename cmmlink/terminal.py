"""The live table of a run and its summary, in the terminal."""

import math

from rich.console import Console, Group
from rich.live import Live
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TaskID, TextColumn
from rich.table import Table

from cmmlink.events import Arrived, Counts, Event, Judged, RunFinished, RunStarted
from drivers.source import LinkDown, LinkUp, ScanOpened
from inspection import InspectionResult, LiveUpdate, ToleranceZone, Verdict

WORDS = {Verdict.CONFORM: "CONFORM", Verdict.UNCERTAIN: "NOT PROVEN", Verdict.NONCONFORM: "NOT CONFORM"}
_STYLES = {Verdict.CONFORM: "bold green", Verdict.UNCERTAIN: "bold yellow", Verdict.NONCONFORM: "bold red"}
_REPAINTS_PER_S = 8


class LiveTable:
    """A sink that keeps a table of the run on the screen until the run is over."""

    def __init__(self, console: Console, zone: ToleranceZone, length_mm: float) -> None:
        self._zone, self._length = zone, length_mm
        self._progress = Progress(TextColumn("{task.description}"), BarColumn(bar_width=40), MofNCompleteColumn(), console=console)
        self._bar: TaskID = self._progress.add_task("points", total=None)
        self._live = Live(console=console, refresh_per_second=_REPAINTS_PER_S, transient=True)
        self._started: RunStarted | None = None
        self._begin_s = self._now_s = 0.0
        self._counts = Counts()
        self._update: LiveUpdate | None = None
        self._worst = self._worst_station = math.nan
        self._link = "open"

    def __call__(self, event: Event) -> None:
        """Take one event; repainting is rich's business, a few times a second."""
        if isinstance(event, RunStarted):
            self._started = event
            self._live.start()
        elif isinstance(event, Arrived):
            self._arrived(event)
        elif isinstance(event, Judged):
            self._judged(event)
        else:
            self._counts = event.counts
            self._live.stop()
        if not isinstance(event, RunFinished):
            self._live.update(Group(self._table(), self._progress))

    def _arrived(self, event: Arrived) -> None:
        if isinstance(event.arrival, ScanOpened):
            self._progress.update(self._bar, total=event.arrival.expected)
            self._begin_s = event.time_s
        elif isinstance(event.arrival, LinkDown):
            self._link = f"lost: {event.arrival.reason}"
        elif isinstance(event.arrival, LinkUp):
            self._link = f"open again after {event.arrival.gap_s:.1f} s"

    def _judged(self, event: Judged) -> None:
        self._counts, self._update, self._now_s = event.counts, event.update, event.time_s
        self._progress.update(self._bar, completed=event.counts.received)
        off = [math.nan if math.isnan(d) else abs(d - self._zone.middle_mm) for d in event.update.deviation_mm]
        if event.update.first == 0:
            self._worst = math.nan
        for index, value in enumerate(off):
            if not math.isnan(value) and not value <= abs(self._worst - self._zone.middle_mm):
                self._worst, self._worst_station = float(event.update.deviation_mm[index]), float(event.update.station_mm[index])

    def _table(self) -> Table:
        table = Table.grid(padding=(0, 3))
        part = self._started
        counts = self._counts
        elapsed = self._now_s - self._begin_s
        rate = counts.received / elapsed if elapsed > 0 else 0.0
        if part is not None:
            table.add_row("part", " ".join(filter(None, [part.part, part.serial_number])), "device", part.device)
        table.add_row("received", f"{counts.received}", "judged", f"{counts.judged}")
        table.add_row("rejected", f"{counts.rejected}", "lost", f"{counts.lost}")
        table.add_row("rate", f"{rate:.0f} points/s", "link", self._link)
        table.add_row("registration", self._registration(), "worst", self._worst_words())
        table.add_row("verdict", self._verdict())
        return table

    def _registration(self) -> str:
        update = self._update
        if update is None or update.state == "seeking":
            return "seeking"
        return update.state if update.state == "settled" else f"provisional, can move {update.can_move_mm:.4f} mm"

    def _worst_words(self) -> str:
        return "" if math.isnan(self._worst) else f"{self._worst:+.4f} mm at station {self._worst_station:.1f} mm"

    def _verdict(self) -> str:
        if math.isnan(self._worst):
            return "not yet"
        verdict = self._zone.verdict(self._worst)
        return f"[{_STYLES[verdict]}]{WORDS[verdict]}[/] so far"


def print_summary(console: Console, result: InspectionResult | None, counts: Counts, message: str) -> None:
    """Print the four numbers, and what the profile's verdict rests on."""
    if result is not None:
        console.print(f"[{_STYLES[result.verdict]}]{WORDS[result.verdict]}[/]" + ("" if result.complete else "  (the scan was cut short)"))
    console.print(f"received {counts.received} = judged {counts.judged} + rejected {counts.rejected}; lost {counts.lost}")
    for reason, count in counts.rejected_by_reason.items():
        console.print(f"  rejected: {count} {reason}")
    if counts.damaged_bytes:
        console.print(f"  damaged: {counts.damaged_bytes} bytes on the line")
    if result is not None and result.worst is not None:
        _print_numbers(console, result)
    if message:
        console.print(message, style="bold")


def _print_numbers(console: Console, result: InspectionResult) -> None:
    worst = result.worst
    assert worst is not None
    zone = result.zone
    console.print(
        f"deviation {result.min_deviation_mm:+.4f} .. {result.max_deviation_mm:+.4f} mm, zone {zone.lower_mm:+g} .. {zone.upper_mm:+g} mm"
        + (f", uncertainty {zone.uncertainty_mm:g} mm" if zone.uncertainty_mm else "")
    )
    console.print(
        f"profile error {result.profile_error_mm:.4f} mm (2 x largest), rms {result.rms_mm:.4f} mm, {result.out_of_tolerance} points out"
    )
    console.print(
        f"worst {result.deviation_mm[worst]:+.4f} mm at station {result.station_mm[worst]:.2f} mm "
        f"(x {result.actual_mm[worst, 0]:.3f}, y {result.actual_mm[worst, 1]:.3f})"
    )
    for stretch in result.stretches:
        console.print(f"  out of tolerance: station {stretch.from_mm:.2f} .. {stretch.to_mm:.2f} mm, worst {stretch.worst_mm:+.4f} mm")
    registration = result.registration
    pose = registration.nominal_from_section
    console.print(
        f"fit {result.fit}: turned {math.degrees(pose.rotation_rad):.4f} deg, moved ({pose.translation_mm[0]:.4f}, "
        f"{pose.translation_mm[1]:.4f}) mm, {registration.iterations} steps; method {result.method}; coverage {result.coverage:.1%}"
    )
    if not registration.converged:
        console.print("  the registration did not settle: the last step still moved points", style="yellow")
    for rival in registration.rivals:
        console.print(f"  the part fits as well turned {math.degrees(rival.rotation_rad):.2f} deg: the pose is ambiguous", style="yellow")
