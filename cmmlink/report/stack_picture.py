"""The picture of a stack of sections: the map of deviations over station and height.

State is told by mark as well as by colour: a triangle up where a stretch is above the zone, one down where it is below.
"""

from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter
from numpy.typing import NDArray

from cmmlink.report.heading import draw_heading, heading_of, save_picture
from cmmlink.report.speech import Speech
from cmmlink.report.stack_input import MAP_COLUMNS, MapRow, map_row_of
from cmmlink.report.stack_panels import along_height, draw_panel, words_of
from cmmlink.stack import StackOutcome
from cmmlink.words import headline_of
from inspection import ToleranceZone

Array = NDArray[np.float64]

_EMPTY = "#d4d7da"


def write_stack_picture(stack: StackOutcome, zone: ToleranceZone, title: str, *paths: Path) -> None:
    """Draw the map to files, PNG or SVG by their names, and the characteristics of the stack beside it."""
    panels = along_height(stack.characteristics)
    figure = Figure(figsize=(12 + 2.4 * len(panels), 7), dpi=110, layout="constrained")
    axes, *beside = figure.subplots(1, 1 + len(panels), squeeze=False, sharey=True, width_ratios=[4.5, *([1.0] * len(panels))])[0]
    for panel, one in zip(beside, panels, strict=True):
        draw_panel(panel, one)
    bar = figure.colorbar(draw_map(axes, [map_row_of(section) for section in stack.sections], zone, Speech()), ax=axes, extend="both")
    draw_bar(bar.ax, zone, Speech())
    told = [f"{len(stack.sections)} sections; grey: nothing judged", *(words_of(one) for one in stack.characteristics if not one.sections)]
    axes.set_title("\n".join(told), fontsize=10, parse_math=False)
    headline = headline_of(stack.verdict, stack.ending, len(stack.sections) / stack.asked)
    draw_heading(figure, heading_of(title, headline.words))
    with mpl.rc_context({"svg.hashsalt": "cmmlink"}):  # the names inside an SVG are the same each time
        for path in paths:
            save_picture(figure, path)


def draw_map(axes: Axes, rows: Sequence[MapRow], zone: ToleranceZone, say: Speech) -> QuadMesh:
    """Draw the map. Where the nominals differ in length, the abscissa is the share of the length."""
    rows = sorted(rows, key=lambda row: row.height_mm)
    lengths = np.array([row.length_mm for row in rows])
    common = bool(np.ptp(lengths) <= 0.001 * lengths[0])
    scale = float(lengths[0]) if common else 100.0
    axes.set_facecolor(_EMPTY)
    half = 0.75 * (zone.upper_mm - zone.lower_mm)
    edges = _edges(np.array([row.height_mm for row in rows]))
    columns = np.linspace(0.0, scale, MAP_COLUMNS + 1)
    colours = Normalize(zone.middle_mm - half, zone.middle_mm + half)
    fields = np.ma.masked_invalid(np.stack([row.deviation_mm for row in rows]))
    shown: QuadMesh = axes.pcolormesh(columns, edges, fields, cmap="RdBu_r", norm=colours)
    for row in rows:
        for share, above in row.out:
            axes.plot(share * scale, row.height_mm, "^" if above else "v", ms=6, mfc="none", mec="black", mew=1.0)
    axes.set_xlabel(say("station (mm)") if common else say("station (% of the section's length)"))
    axes.set_ylabel(say("height along the normal (mm)"))
    return shown


def draw_bar(axes: Axes, zone: ToleranceZone, say: Speech) -> None:
    """Draw the limits on the bar of colours beside the map, and say what it shows."""
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: say.figures(f"{value:.4g}".replace("-", "\u2212"))))
    axes.set_ylabel(say("deviation (mm), the farthest from the zone's middle in each field"))
    for limit in (zone.lower_mm, zone.upper_mm):
        axes.axhline(limit, color="black", lw=1.2)


def _edges(heights: Array) -> Array:
    """Borders (k + 1,) of the rows: half way between neighbours."""
    if len(heights) == 1:
        return np.array([heights[0] - 0.5, heights[0] + 0.5])
    middles = (heights[:-1] + heights[1:]) / 2
    return np.concatenate([[2 * heights[0] - middles[0]], middles, [2 * heights[-1] - middles[-1]]])
