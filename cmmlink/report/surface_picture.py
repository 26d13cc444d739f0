"""The picture of a judged surface: the part from four sides, its worst place from near, the legend of its colours, and its regions.

State is told by place and by mark as well as by colour: every region out of tolerance has a number, with its value beside it.
"""

import io
import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from cmmlink.colour_map import COLOURS, Kind, within_zone
from cmmlink.report.heading import draw_heading, save_picture
from cmmlink.report.speech import Speech
from cmmlink.report.surface_content import CLOSE_PX, SIDE_PX, Panel, SurfaceContent
from inspection import ToleranceZone

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_DOTS_PER_INCH = 200
_WIDTH_PX = 1420  # as wide as a printed page allows
_GAP_PX, _HEAD_PX, _FOOT_PX = 12, 74, 30
_TEXT_PT, _SMALL_PT = 6.5, 5.5
_INK, _SOFT, _FRAME = "#1f2328", "#5b626a", "#d5dade"
_MARK_PT = 9.0
_AXIS_PX, _AXIS_AT_PX = 42.0, 62.0  # length of the arrows of x, y and z, and how far from the corner they begin
_RULER_SHARE = 0.2  # of an image's width, that its ruler has at most
_BAR = (("above", 0.15), ("unproven", 0.1), ("within", 0.5), ("unproven", 0.1), ("below", 0.15))


def write_surface_picture(content: SurfaceContent, *paths: Path, say: Speech | None = None) -> None:
    """Draw the picture to PNG files."""
    figure = draw_surface(content, say or Speech())
    for path in paths:
        save_picture(figure, path)


def surface_png(content: SurfaceContent, say: Speech) -> bytes:
    """The picture as a PNG file, for a page that has a heading and a foot of its own."""
    file = io.BytesIO()
    save_picture(draw_surface(content, say, is_alone=False), file)
    return file.getvalue()


def draw_surface(content: SurfaceContent, say: Speech, is_alone: bool = True) -> Figure:
    """Draw the picture; one that stands alone has a heading and a foot."""
    head, foot = (_HEAD_PX, _FOOT_PX) if is_alone else (0, 0)
    height = head + 2 * SIDE_PX[1] + 3 * _GAP_PX + CLOSE_PX[1] + foot
    figure = Figure(figsize=(_WIDTH_PX / _DOTS_PER_INCH, height / _DOTS_PER_INCH), dpi=_DOTS_PER_INCH, facecolor="white")
    left = (_WIDTH_PX - 2 * SIDE_PX[0] - _GAP_PX) // 2
    for number, panel in enumerate(content.sides):
        column, row = number % 2, number // 2
        _draw_panel(_axes_at(figure, left + column * (SIDE_PX[0] + _GAP_PX), head + row * (SIDE_PX[1] + _GAP_PX), *SIDE_PX), panel, say)
    below = head + 2 * (SIDE_PX[1] + _GAP_PX)
    if content.nearby is not None:
        _draw_nearby(_axes_at(figure, left, below, *CLOSE_PX), content, content.nearby, say)
    _draw_legend(_axes_at(figure, left + CLOSE_PX[0] + 40, below + 10, 420, CLOSE_PX[1] - 20), content.zone, say)
    _draw_regions(_axes_at(figure, left + CLOSE_PX[0] + 480, below + 10, 470, CLOSE_PX[1] - 20), content, say)
    if is_alone:
        draw_heading(figure, content.heading, size=10)
        figure.text(0.99, 0.005, content.foot, ha="right", va="bottom", fontsize=_SMALL_PT, parse_math=False)
    return figure


def _axes_at(figure: Figure, left: float, top: float, width: float, height: float) -> "Axes":
    """Axes whose coordinates are pixels from the upper left corner of their own."""
    wide, high = _WIDTH_PX, figure.get_figheight() * _DOTS_PER_INCH
    axes = figure.add_axes((left / wide, 1 - (top + height) / high, width / wide, height / high))
    axes.set_xlim(0, width)
    axes.set_ylim(height, 0)
    axes.set_axis_off()
    return axes


def _draw_panel(axes: "Axes", panel: Panel, say: Speech) -> None:
    height, width = panel.image.shape[:2]
    axes.imshow(panel.image, extent=(0, width, height, 0), interpolation="nearest", aspect="auto")
    axes.add_patch(Rectangle((0.5, 0.5), width - 1, height - 1, fill=False, edgecolor=_FRAME, linewidth=0.6))
    _draw_axes_of_part(axes, panel, height)
    length = _round_length(_RULER_SHARE * width * panel.mm_per_px)
    right, base = width - 16.0, height - 16.0
    axes.plot([right - length / panel.mm_per_px, right], [base, base], color=_SOFT, lw=1.0)
    axes.text(right, base - 7, say.figures(f"{length:g} mm"), ha="right", va="bottom", fontsize=_SMALL_PT, color=_SOFT)
    for mark in panel.marks:
        _draw_number(axes, mark.number, mark.column, mark.row, mark.hidden)


def _round_length(most_mm: float) -> float:
    """The largest length of 1, 2 or 5 times a power of ten that is no longer than that."""
    power = 10.0 ** math.floor(math.log10(most_mm))
    return max(step * power for step in (1, 2, 5) if step * power <= most_mm)


def _draw_axes_of_part(axes: "Axes", panel: Panel, height: int) -> None:
    """The directions of x, y and z."""
    x, y = _AXIS_AT_PX, height - _AXIS_AT_PX
    for name, (right, down) in zip("xyz", panel.axes, strict=True):
        axes.plot([x, x + _AXIS_PX * right], [y, y + _AXIS_PX * down], color=_SOFT, lw=0.9)
        axes.text(x + 1.3 * _AXIS_PX * right, y + 1.3 * _AXIS_PX * down, name, ha="center", va="center", fontsize=_SMALL_PT, color=_SOFT)


def _draw_number(axes: "Axes", number: int, column: float, row: float, hidden: bool) -> None:
    """The number of a region beside its place, with a line to it and a ring around it; dashed where the part hides it."""
    style = (0, (2, 1.5)) if hidden else "solid"
    axes.plot([column], [row], "o", ms=7, mfc="none", mec=_INK, mew=0.8)
    aside = 34.0 if column < 0.5 * axes.get_xlim()[1] else -34.0
    up = -30.0 if row > 0.25 * axes.get_ylim()[0] else 30.0
    axes.plot([column + 0.28 * aside, column + aside], [row + 0.28 * up, row + up], color=_INK, lw=0.7, ls=style)
    box = {"boxstyle": "circle,pad=0.22", "fc": "white", "ec": _INK, "lw": 0.7, "ls": style}
    axes.text(column + aside, row + up, str(number), ha="center", va="center", fontsize=_TEXT_PT, fontweight="bold", bbox=box)


def _draw_nearby(axes: "Axes", content: SurfaceContent, panel: Panel, say: Speech) -> None:
    _draw_panel(axes, panel, say)
    told = say("worst point {deviation} mm", deviation=say.number(content.worst_mm, "+.4f"))
    box = {"boxstyle": "square,pad=0.3", "fc": "white", "ec": "none"}
    axes.text(10, 10, told, ha="left", va="top", fontsize=_TEXT_PT, fontweight="bold", bbox=box)


def _draw_legend(axes: "Axes", zone: ToleranceZone, say: Speech) -> None:
    """The colours with the limits in figures; the parts of the bar are as high as reads well, not as the deviations are far apart."""
    height, top, left, wide = axes.get_ylim()[0] - 90, 30.0, 0.0, 34.0
    axes.text(left, 0, say("deviation (mm)"), va="top", fontsize=_TEXT_PT, fontweight="bold")
    parts = [(name, share) for name, share in _BAR if name != "unproven" or zone.guard_mm > 0]
    words = {
        "above": say("above: out of tolerance"),
        "unproven": say("not proven"),
        "within": say("within"),
        "below": say("below: out of tolerance"),
    }
    scale = height / sum(share for _, share in parts)
    borders = [zone.upper_mm + zone.guard_mm, zone.upper_mm - zone.guard_mm, zone.lower_mm + zone.guard_mm, zone.lower_mm - zone.guard_mm]
    borders = borders if zone.guard_mm > 0 else [zone.upper_mm, zone.lower_mm]
    for number, (name, share) in enumerate(parts):
        _draw_colour(axes, name, zone, (left, left + wide, top + share * scale, top))
        axes.text(left + wide + 130, top + share * scale / 2, words[name], va="center", fontsize=_TEXT_PT, color=_INK)
        top += share * scale
        if number < len(borders):
            axes.plot([left, left + wide + 8], [top, top], color=_INK, lw=0.8)
            axes.text(left + wide + 14, top, say.number(borders[number], "+.4f"), va="center", fontsize=_TEXT_PT)
    axes.add_patch(Rectangle((left, top + 18), wide, 30, facecolor=COLOURS[Kind.NOT_JUDGED], edgecolor=_SOFT, linewidth=0.5))
    axes.text(left + wide + 14, top + 33, say("not measured"), va="center", fontsize=_TEXT_PT)


def _draw_colour(axes: "Axes", name: str, zone: ToleranceZone, extent: tuple[float, float, float, float]) -> None:
    left, right, bottom, top = extent
    if name == "within":
        shades = within_zone(np.linspace(zone.upper_mm, zone.lower_mm, 64), zone)[:, None, :]
        axes.imshow(shades, extent=extent, interpolation="nearest", aspect="auto")
    else:
        kind = {"above": Kind.ABOVE, "below": Kind.BELOW, "unproven": Kind.UNCERTAIN}[name]
        axes.add_patch(Rectangle((left, top), right - left, bottom - top, facecolor=COLOURS[kind], linewidth=0))
    axes.add_patch(Rectangle((left, top), right - left, bottom - top, fill=False, edgecolor=_SOFT, linewidth=0.5))


def _draw_regions(axes: "Axes", content: SurfaceContent, say: Speech) -> None:
    """The regions with their numbers, and what the verdict rests on."""
    lines = [say("Regions out of tolerance") if content.regions else say("No region is out of tolerance")]
    for number, region in enumerate(content.regions, start=1):
        values = {"worst": say.number(region.worst_mm, "+.4f"), "area": say.number(region.area_mm2, ".2f")}
        lines.append(f"{number}   " + say("{worst} mm over {area} mm\u00b2", **values))
    if content.more:
        lines.append(say("{count} more", count=content.more))
    for number, line in enumerate(lines):
        axes.text(0, 30 * number, line, va="top", fontsize=_TEXT_PT, fontweight="bold" if number == 0 else "normal", parse_math=False)
    axes.text(0, axes.get_ylim()[0], content.basis, va="bottom", fontsize=_SMALL_PT, color=_SOFT, parse_math=False)
