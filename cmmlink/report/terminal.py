"""The summary of a run in the terminal."""

import math
from collections.abc import Iterator, Mapping, Sequence

from rich.console import Console
from rich.markup import escape

from cmmlink.characteristics import is_short_form
from cmmlink.events import Counts, Ending
from cmmlink.uncertainty_tables import uncertainty_lines
from cmmlink.words import VERDICT_WORDS, Shape, headline_of
from inspection import CharacteristicResult, InspectionResult, Rejection, Verdict

STYLES = {Verdict.CONFORM: "bold green", Verdict.UNCERTAIN: "bold yellow", Verdict.NONCONFORM: "bold red"}
STYLE_OF: Mapping[Shape, str] = {
    "conform": STYLES[Verdict.CONFORM],
    "not-proven": STYLES[Verdict.UNCERTAIN],
    "not-conform": STYLES[Verdict.NONCONFORM],
    "ended-early": STYLES[Verdict.UNCERTAIN],
    "none": "bold",
}
_WHOLE = 0.95  # coverage below which the summary says that nothing is known of the rest
_MOST_STRETCHES = 10


def print_summary(
    console: Console,
    result: InspectionResult | None,
    counts: Counts,
    heading: str,
    ending: Ending = "complete",
    notes: Sequence[str] = (),
) -> None:
    """Print the verdict, or how early the run ended; the four numbers, and what the verdict on the profile rests on."""
    verdict, share = (None, None) if result is None or not counts.received else (result.verdict, result.coverage)
    headline = headline_of(verdict, ending if counts.received else "complete", share)
    console.print(f"[{STYLE_OF[headline.shape]}]{headline.words}[/]   {escape(heading)}".rstrip())
    for reason in _reservations(result):
        console.print(f"  {reason}", style="yellow", markup=False)
    for note in notes:
        console.print(f"  note: {escape(note)}")
    console.print(f"received {counts.received} = judged {counts.judged} + rejected {counts.rejected}; lost {counts.lost} points")
    for reason, count in counts.rejected_by_reason.items():
        console.print(f"  rejected: {count} {reason}", markup=False)
    if counts.damaged_bytes:
        console.print(f"  damaged: {counts.damaged_bytes} bytes on the line")
    if result is not None and result.worst is not None:
        _print_numbers(console, result)


def _reservations(result: InspectionResult | None) -> Iterator[str]:
    """Why the verdict is what it is, and what else the reader has to know, a sentence each."""
    if result is None:
        yield "No point was judged."
        return
    yield from (reason.words for reason in result.reasons)
    if result.rejected_by_reason.get(Rejection.OUTLIER.words, 0):
        yield "Look whether the outliers are dirt or a defect: they were rejected, not judged."
    for rival in result.registration.rivals:
        yield f"The part fits as well turned by {math.degrees(rival.rotation_rad):.2f} deg: the pose is ambiguous."


def _print_numbers(console: Console, result: InspectionResult) -> None:
    worst = result.worst_row
    assert worst is not None
    zone = result.zone
    console.print(
        f"deviation {result.min_deviation_mm:+.4f} .. {result.max_deviation_mm:+.4f} mm, zone {zone.lower_mm:+g} .. {zone.upper_mm:+g} mm"
    )
    console.print(f"decision rule: {zone.decision_rule}")
    for line in uncertainty_lines(result):
        console.print(line, markup=False)
    console.print(
        f"profile error {result.profile_error_mm:.4f} mm (2 x largest), zone error {result.zone_error_mm:.4f} mm (2 x farthest from the "
        f"zone's middle), rms {result.rms_mm:.4f} mm, {result.out_of_tolerance} points out"
    )
    _print_rule(console, result)
    console.print(
        f"worst {worst.deviation_mm[0]:+.4f} mm at station {worst.station_mm[0]:.2f} mm "
        f"(x {worst.actual_mm[0, 0]:.3f}, y {worst.actual_mm[0, 1]:.3f})"
    )
    _print_stretches(console, result)
    if not is_short_form(result.characteristics):
        print_characteristics(console, result.characteristics)
    registration = result.registration
    pose = registration.nominal_from_section
    moved = f"({pose.translation_mm[0]:.4f}, {pose.translation_mm[1]:.4f}) mm"
    console.print(f"fit {result.fit}: turned {math.degrees(pose.rotation_rad):.4f} deg, moved {moved}, {registration.iterations} steps")
    gap = result.gap
    console.print(
        f"method {result.method}; coverage {result.coverage:.1%}; largest gap {gap.length_mm:.3f} mm at station {gap.from_mm:.2f} .. "
        f"{gap.to_mm:.2f} mm ({result.gap_max_mm:.3f} mm count as measured)"
    )


def print_characteristics(console: Console, found: Sequence[CharacteristicResult]) -> None:
    """A line for every characteristic, with its verdict, its value and how it was found, and the reasons of those that do not conform."""
    for one in found:
        unit = "" if one.unit == "1" else f" {one.unit}"
        digits = 4 if unit else 7  # of what has no unit, a slope
        value = "no value" if math.isnan(one.value) else f"{one.value:.{digits}f}{unit}"
        deviation = "" if math.isnan(one.deviation) else f", deviation {one.deviation:+.{digits}f}"
        u = f", U {one.uncertainty:.4g}{unit}" if one.uncertainty else ""
        limits = " .. ".join(f"{limit:+g}" if math.isfinite(limit) else "any" for limit in (one.lower, one.upper))
        how = "; ".join(part for part in (one.method, _of_profile(one), f"filter {one.filter}" if one.filter != "none" else "") if part)
        console.print(
            f"  [{STYLES[one.verdict]}]{VERDICT_WORDS[one.verdict]:11}[/] {escape(one.name)}: {one.type} {value}{deviation} "
            f"(limits {limits}{unit}{u}) {escape(how)}"
        )
        if one.certificate is not None:
            for line in one.certificate.words.splitlines():
                console.print(f"      {line}", markup=False)


def _of_profile(one: CharacteristicResult) -> str:
    """Of a profile its region, its zone as drawings have it, and its fit."""
    if one.type != "line-profile":
        return f"fit {one.fit}" if one.fit != "none" else ""
    return f"{one.region_words}; zone {one.zone_words}; fit {one.fit}"


def _print_rule(console: Console, result: InspectionResult) -> None:
    """Say what decided, and what the part would be by the other fit."""
    if result.rule == "datum":
        return
    errors = {"best fit": result.best_fit_error_mm, "minimum zone": result.minimum_zone_mm}
    told = ", ".join(f"{name} {error:.4f} mm" for name, error in errors.items() if math.isfinite(error))
    console.print(f"rule {result.rule}: zone error at {told}; fits aim at {result.zone.middle_mm:g} mm with {result.weights} weights")


def _print_stretches(console: Console, result: InspectionResult) -> None:
    """List the worst stretches out of tolerance, in station order."""
    worst_first = sorted(result.stretches, key=lambda stretch: -abs(stretch.worst_mm - result.zone.middle_mm))
    shown = worst_first[:_MOST_STRETCHES]
    for stretch in result.stretches:
        if stretch in shown:
            console.print(f"  out of tolerance: station {stretch.from_mm:.2f} .. {stretch.to_mm:.2f} mm, worst {stretch.worst_mm:+.4f} mm")
    if len(worst_first) > len(shown):
        console.print(f"  out of tolerance: {len(worst_first) - len(shown)} more stretches, none of them worse")
