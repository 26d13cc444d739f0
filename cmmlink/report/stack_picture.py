"""The picture of a stack of sections: the map of deviations over station and height.

State is told by mark as well as by colour: a triangle up where a stretch is above the zone, one down where it is below.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from numpy.typing import NDArray

from cmmlink.report.heading import draw_heading, heading_of, save_picture
from cmmlink.report.speech import Speech
from cmmlink.report.stack_panels import along_height, draw_panel, words_of
from cmmlink.stack import SectionOutcome, StackOutcome
from cmmlink.words import headline_of
from inspection import ToleranceZone

Array = NDArray[np.float64]

_COLUMNS = 600
_EMPTY = "#d4d7da"


def write_stack_picture(stack: StackOutcome, zone: ToleranceZone, title: str, path: Path) -> None:
    """Draw the map to a PNG file, and the characteristics of the stack beside it."""
    panels = along_height(stack.characteristics)
    figure = Figure(figsize=(12 + 2.4 * len(panels), 7), dpi=110, layout="constrained")
    axes, *beside = figure.subplots(1, 1 + len(panels), squeeze=False, sharey=True, width_ratios=[4.5, *([1.0] * len(panels))])[0]
    for panel, one in zip(beside, panels, strict=True):
        draw_panel(panel, one)
    bar = figure.colorbar(draw_map(axes, stack, zone, Speech()), ax=axes, extend="both")
    draw_bar(bar.ax, zone, Speech())
    told = [f"{len(stack.sections)} sections; grey: nothing judged", *(words_of(one) for one in stack.characteristics if not one.sections)]
    axes.set_title("\n".join(told), fontsize=10, parse_math=False)
    headline = headline_of(stack.verdict, stack.ending, len(stack.sections) / stack.asked)
    draw_heading(figure, heading_of(title, headline.words))
    save_picture(figure, path)


def draw_map(axes: Axes, stack: StackOutcome, zone: ToleranceZone, say: Speech) -> QuadMesh:
    """Draw the map. Where the nominals differ in length, the abscissa is the share of the length."""
    sections = sorted(stack.sections, key=lambda section: section.slice.height_mm)
    lengths = np.array([section.profile.length_mm for section in sections])
    common = bool(np.ptp(lengths) <= 0.001 * lengths[0])
    scale = float(lengths[0]) if common else 100.0
    axes.set_facecolor(_EMPTY)
    half = 0.75 * (zone.upper_mm - zone.lower_mm)
    edges = _edges(np.array([section.slice.height_mm for section in sections]))
    rows = np.stack([_row(section) for section in sections])
    columns = np.linspace(0.0, scale, _COLUMNS + 1)
    colours = Normalize(zone.middle_mm - half, zone.middle_mm + half)
    shown: QuadMesh = axes.pcolormesh(columns, edges, np.ma.masked_invalid(rows), cmap="RdBu_r", norm=colours)
    _mark(axes, sections, scale)
    axes.set_xlabel(say("station (mm)") if common else say("station (% of the section's length)"))
    axes.set_ylabel(say("height along the normal (mm)"))
    return shown


def draw_bar(axes: Axes, zone: ToleranceZone, say: Speech) -> None:
    """Draw the limits on the bar of colours beside the map, and say what it shows."""
    axes.set_ylabel(say("deviation (mm), the farthest from the zone's middle in each field"))
    for limit in (zone.lower_mm, zone.upper_mm):
        axes.axhline(limit, color="black", lw=1.2)


def _row(section: SectionOutcome) -> Array:
    """(c,) deviation farthest from the middle of the zone in each column; NaN where nothing was judged."""
    row = np.full(_COLUMNS, np.nan)
    result = section.run.result
    if result is None:
        return row
    judged = np.flatnonzero(np.isfinite(result.deviation_mm))
    judged = judged[np.argsort(np.abs(result.deviation_mm[judged] - result.zone.middle_mm))]
    column = np.clip((result.station_mm[judged] / section.profile.length_mm * _COLUMNS).astype(int), 0, _COLUMNS - 1)
    row[column] = result.deviation_mm[judged]  # where several share a column, the last one is kept, which is the farthest
    return row


def _edges(heights: Array) -> Array:
    """Borders (k + 1,) of the rows: half way between neighbours."""
    if len(heights) == 1:
        return np.array([heights[0] - 0.5, heights[0] + 0.5])
    middles = (heights[:-1] + heights[1:]) / 2
    return np.concatenate([[2 * heights[0] - middles[0]], middles, [2 * heights[-1] - middles[-1]]])


def _mark(axes: Axes, sections: Sequence[SectionOutcome], scale: float) -> None:
    """A triangle in the middle of every stretch out of tolerance."""
    for section in sections:
        result, length = section.run.result, section.profile.length_mm
        if result is None:
            continue
        for stretch in result.stretches:
            width = (stretch.to_mm - stretch.from_mm) % length
            station = (stretch.from_mm + width / 2) % length / length * scale
            above = stretch.worst_mm > result.zone.middle_mm
            axes.plot(station, section.slice.height_mm, "^" if above else "v", ms=6, mfc="none", mec="black", mew=1.0)
