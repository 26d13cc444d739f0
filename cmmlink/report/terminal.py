"""The live table of a run and its summary, in the terminal."""

import math
from collections.abc import Iterator

import numpy as np
from rich.console import Console, Group
from rich.live import Live
from rich.markup import escape
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TaskID, TextColumn
from rich.table import Table

from cmmlink.events import Arrived, Counts, Event, Judged, RunStarted
from cmmlink.words import VERDICT_WORDS
from drivers import LinkDown, LinkUp, ScanOpened
from inspection import InspectionResult, LiveUpdate, Rejection, ToleranceZone, Verdict

STYLES = {Verdict.CONFORM: "bold green", Verdict.UNCERTAIN: "bold yellow", Verdict.NONCONFORM: "bold red"}
_REPAINTS_PER_S = 8
_WHOLE = 0.95  # of the nominal's length: below it the summary says that the rest is unknown
_MOST_STRETCHES = 10


class LiveTable:
    """A sink that keeps a table of the run on the screen, for as long as it is entered as a context."""

    def __init__(self, console: Console, zone: ToleranceZone) -> None:
        self._zone = zone
        self._progress = Progress(TextColumn("{task.description}"), BarColumn(bar_width=40), MofNCompleteColumn(), console=console)
        self._bar: TaskID = self._progress.add_task("points", total=None)
        self._started: RunStarted | None = None
        self._begin_s: float | None = None
        self._now_s = 0.0
        self._counts = Counts()
        self._update: LiveUpdate | None = None
        self._worst = self._worst_station = math.nan
        self._link = "waiting for the device"
        self._live = Live(console=console, get_renderable=self._screen, refresh_per_second=_REPAINTS_PER_S, transient=True)

    def __enter__(self) -> "LiveTable":
        self._live.start()
        return self

    def __exit__(self, *_: object) -> None:
        """Clear the table, also when the run ended with an error."""
        self._live.stop()

    def __call__(self, event: Event) -> None:
        """Take one event; painting is rich's business, a few times a second."""
        if isinstance(event, RunStarted):
            self._started = event
        elif isinstance(event, Arrived):
            self._arrived(event)
        elif isinstance(event, Judged):
            self._judged(event)
        else:
            self._counts = event.counts

    def _arrived(self, event: Arrived) -> None:
        if self._begin_s is None:
            self._begin_s, self._link = event.time_s, "open"
        if isinstance(event.arrival, ScanOpened):
            self._progress.update(self._bar, total=event.arrival.expected)
            self._begin_s = event.time_s
        elif isinstance(event.arrival, LinkDown):
            self._link = f"lost: {event.arrival.reason}"
        elif isinstance(event.arrival, LinkUp):
            self._link = f"open again after {event.arrival.gap_s:.1f} s"

    def _judged(self, event: Judged) -> None:
        update = event.update
        self._counts, self._update, self._now_s = event.counts, update, event.time_s
        self._progress.update(self._bar, completed=event.counts.received)
        if update.first == 0:
            self._worst = math.nan
        off = np.abs(update.deviation_mm - self._zone.middle_mm)
        if np.isfinite(off).any():
            index = int(np.nanargmax(off))
            if not off[index] <= abs(self._worst - self._zone.middle_mm):
                self._worst, self._worst_station = float(update.deviation_mm[index]), float(update.station_mm[index])

    def _screen(self) -> Group:
        counts, started = self._counts, self._started
        elapsed_s = self._now_s - (self._begin_s or 0.0)
        rate = counts.received / elapsed_s if elapsed_s > 0 else 0.0
        rows = {
            "part": " ".join(filter(None, [started.part, started.serial_number])) if started else "",
            "device": f"{'SIMULATED, ' if started.simulated else ''}{started.device}" if started else "",
            "link": self._link,
            "points": f"{counts.received} received, {counts.judged} judged, {counts.rejected} rejected, {counts.lost} lost",
            "rate": f"{rate:.0f} points/s",
            "registration": self._registration(),
            "worst": self._worst_words(),
            "verdict": self._verdict(),
        }
        table = Table.grid(padding=(0, 3))
        for name, words in rows.items():
            table.add_row(name, words)
        return Group(table, self._progress)

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
        provisional = "" if self._update is not None and self._update.state == "settled" else ", provisional"
        return f"[{STYLES[verdict]}]{VERDICT_WORDS[verdict]}[/] so far{provisional}"


def print_summary(console: Console, result: InspectionResult | None, counts: Counts, heading: str) -> None:
    """Print the verdict, the four numbers, and what the verdict on the profile rests on."""
    verdict = Verdict.UNCERTAIN if result is None else result.verdict
    console.print(f"[{STYLES[verdict]}]{VERDICT_WORDS[verdict]}[/]   {escape(heading)}".rstrip())
    for reason in _reservations(result):
        console.print(f"  {reason}", style="yellow")
    console.print(f"received {counts.received} = judged {counts.judged} + rejected {counts.rejected}; lost {counts.lost} points")
    for reason, count in counts.rejected_by_reason.items():
        console.print(f"  rejected: {count} {reason}")
    if counts.damaged_bytes:
        console.print(f"  damaged: {counts.damaged_bytes} bytes on the line")
    if result is not None and result.worst is not None:
        _print_numbers(console, result)


def _reservations(result: InspectionResult | None) -> Iterator[str]:
    """What keeps the verdict from being the last word."""
    if result is None or result.worst is None:
        yield "nothing was judged"
        return
    near = int(np.count_nonzero(result.verdicts == Verdict.UNCERTAIN))
    outliers = result.rejected_by_reason.get(Rejection.OUTLIER.words, 0)
    if not result.complete:
        yield "the scan was cut short"
    if result.coverage < _WHOLE or (result.verdict == Verdict.UNCERTAIN and result.complete and not near and not outliers):
        yield f"only {result.coverage:.1%} of the nominal was measured: nothing is known of the rest"
    if outliers:
        yield f"{outliers} outliers were rejected, not judged: look whether they are dirt or a defect"
    if near:
        yield f"{near} points lie nearer to a limit than the uncertainty"
    if not result.registration.converged:
        yield "the registration did not settle: the last step still moved points"
    for rival in result.registration.rivals:
        yield f"the part fits as well turned {math.degrees(rival.rotation_rad):.2f} deg: the pose is ambiguous"


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
    _print_stretches(console, result)
    registration = result.registration
    pose = registration.nominal_from_section
    moved = f"({pose.translation_mm[0]:.4f}, {pose.translation_mm[1]:.4f}) mm"
    console.print(f"fit {result.fit}: turned {math.degrees(pose.rotation_rad):.4f} deg, moved {moved}, {registration.iterations} steps")
    console.print(f"method {result.method}; coverage {result.coverage:.1%}")


def _print_stretches(console: Console, result: InspectionResult) -> None:
    """List the worst stretches out of tolerance, in station order."""
    worst_first = sorted(result.stretches, key=lambda stretch: -abs(stretch.worst_mm - result.zone.middle_mm))
    shown = worst_first[:_MOST_STRETCHES]
    for stretch in result.stretches:
        if stretch in shown:
            console.print(f"  out of tolerance: station {stretch.from_mm:.2f} .. {stretch.to_mm:.2f} mm, worst {stretch.worst_mm:+.4f} mm")
    if len(worst_first) > len(shown):
        console.print(f"  out of tolerance: {len(worst_first) - len(shown)} more stretches, none of them worse")
