"""The summary of a run of a whole surface in the terminal, from what result.json says of it."""

from collections.abc import Mapping, Sequence
from typing import Any

from rich.console import Console
from rich.markup import escape

from cmmlink.report.terminal import STYLE_OF
from cmmlink.words import headline_of
from inspection import Verdict

_MOST_LISTED = 5


def print_surface_summary(console: Console, found: Mapping[str, Any], heading: str, notes: Sequence[str] = ()) -> None:
    """Print the verdict, or how early the run ended; the four numbers, and what the verdict on the surface rests on.

    found : with the keys of result.json
    """
    received, ending = found["received"], found.get("ending", "complete")
    is_found = bool(received and found["registration"])
    verdict, share = (Verdict[found["verdict"].upper()], found["coverage"]) if is_found else (None, None)
    headline = headline_of(verdict, ending if received else "complete", share)
    console.print(f"[{STYLE_OF[headline.shape]}]{headline.words}[/]   {escape(heading)}".rstrip())
    for reason in found["reasons"] if is_found else [{"words": "No point was judged."}]:
        console.print(f"  {reason['words']}", style="yellow", markup=False)
    for note in notes:
        console.print(f"  note: {note}", markup=False)
    console.print(f"received {received} = judged {found['judged']} + rejected {found['rejected']}; lost {found['lost']} points")
    for reason, count in found["rejected_by_reason"].items():
        console.print(f"  rejected: {count} {reason}", markup=False)
    if found["damaged_bytes"]:
        console.print(f"  damaged: {found['damaged_bytes']} bytes on the line")
    if is_found and found["worst"] is not None:
        for line in _numbers(found):
            console.print(line, markup=False)


def _numbers(found: Mapping[str, Any]) -> list[str]:
    zone, worst = found["tolerance"], found["worst"]
    place = f"({worst['x_mm']:.3f}, {worst['y_mm']:.3f}, {worst['z_mm']:.3f})"
    return [
        f"deviation {found['min_deviation_mm']:+.4f} .. {found['max_deviation_mm']:+.4f} mm, zone {zone['lower_mm']:+g} .. "
        f"{zone['upper_mm']:+g} mm, rms {found['rms_mm']:.4f} mm, {found['out_of_tolerance']} points out",
        f"decision rule: {zone['decision_rule']}",
        f"surface error {found['profile_error_mm']:.4f} mm (2 x largest), zone error {found['zone_error_mm']:.4f} mm (2 x farthest from "
        "the zone's middle)",
        f"worst {worst['deviation_mm']:+.4f} mm at {place}, face {worst['face']}",
        *_regions(found["regions"]),
        _nominal(found["nominal"]),
        *_pose(found),
        f"coverage {found['coverage']:.1%} of {found['nominal']['area_mm2']:.6g} mm2; widest place without points "
        f"{found['widest_gap_mm'] or 0.0:.3g} mm ({found['gap_max_mm']:.3g} mm count as measured)",
        *_unmeasured(found["unmeasured"]),
    ]


def _regions(regions: Sequence[Mapping[str, Any]]) -> list[str]:
    told = [
        f"  out of tolerance: {region['area_mm2']:.3g} mm2 around {_place(region['centre_mm'])}, worst {region['worst_mm']:+.4f} mm at "
        f"{_place(region['worst_at_mm'])}, face {region['face']}, {region['points']} points"
        for region in regions[:_MOST_LISTED]
    ]
    more = regions[_MOST_LISTED:]
    return told + ([f"  out of tolerance: {len(more)} more regions, none of them worse"] if more else [])


def _unmeasured(places: Sequence[Mapping[str, Any]]) -> list[str]:
    told = [
        f"  not measured: {place['area_mm2']:.3g} mm2 around {_place(place['centre_mm'])}, up to {place['width_mm']:.3g} mm wide, "
        f"face {place['face']}"
        for place in places[:_MOST_LISTED]
    ]
    more = places[_MOST_LISTED:]
    area_mm2 = sum(place["area_mm2"] for place in more)
    return told + ([f"  not measured: {len(more)} more places, none of them larger, of {area_mm2:.3g} mm2 together"] if more else [])


def _place(place: Sequence[float]) -> str:
    return f"({', '.join(f'{value:.2f}' for value in place)})"


def _nominal(nominal: Mapping[str, Any]) -> str:
    pieces = ", ".join(f"{nominal[key]} {key}" for key in ("faces", "triangles") if nominal[key] is not None)
    exact = f"may lie up to {nominal['error_mm']:.2g} mm off what it stands for" if nominal["error_mm"] else "exact"
    return f"nominal: {', '.join(filter(None, [nominal['source_format'], nominal['kind'], pieces]))}, {exact}"


def _pose(found: Mapping[str, Any]) -> list[str]:
    pose = found["registration"]
    moved = ", ".join(f"{value:.4f}" for value in pose["translation_mm"])
    steps = "1 step" if pose["steps"] == 1 else f"{pose['steps']} steps"
    lines = [f"fit {found['fit']}, rule {found['rule']}: turned {pose['rotation_deg']:.4f} deg, moved ({moved}) mm, {steps}"]
    if pose["rivals"]:
        lines.append(f"  the part fits as well in {pose['rivals']} other poses: its pose is ambiguous")
    if pose["undetermined"]:
        lines.append(f"  the points leave it free {pose['weakest_direction']}")
    elif pose["weakest_95_mm"] is not None:
        lines.append(f"  weakest direction: {pose['weakest_direction']}, known to {pose['weakest_95_mm']:.2g} mm (95 %)")
    return lines
