"""The drawing of a part's trend on one page: both control charts, the indices, the heat strip and the drift along the profile.

What is out of tolerance, what is not proven and what breaks a rule has a mark of its own, so that colour is never alone.
"""

import textwrap
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, MaxNLocator
from numpy.typing import NDArray

from cmmlink.colour_map import COLOURS, Kind
from cmmlink.part_trend import HeatStrip, PartTrend
from cmmlink.report.heading import draw_heading, save_picture, short_title
from cmmlink.report.profile_drawing import BAND, NOMINAL, NOTES, prepare_axes
from cmmlink.report.speech import Speech

if TYPE_CHECKING:
    from cmmlink.plant import CapabilityIndex, ControlChart

MOST_DRAWN = 500  # of the newest values: more are not told apart on a page
HEAT_COLOURS = (COLOURS[Kind.BELOW], "#4a90c4", "#b3d3e8", "#f7f7f7", "#fdd0a2", "#ec8a33", COLOURS[Kind.ABOVE])
"""From below the zone to above it; blue against orange is told apart by every eye, and both ends are dark."""
_LINE, _LIMIT, _BROKEN = "#14608c", "#6d8f84", "#c2410c"
_INCHES, _DOTS_PER_INCH = (7.1, 10.0), 200  # fits on A4 and on Letter
_LEFT, _WIDTH = 0.1, 0.8  # of the page, as are the lower edges and the heights
_PLACES = ((0.7, 0.19), (0.605, 0.08), (0.34, 0.2), (0.22, 0.075))
_SMALL, _LETTERS, _MOST_LINES = 6.5, 128, 14
_TICKS = 6


def write_trend_picture(found: PartTrend, path: Path, say: Speech) -> None:
    """Draw a trend to a file: pdf, png or svg by its name. Raises OSError where it cannot be written."""
    figure = trend_figure(found, say, _INCHES, _DOTS_PER_INCH)
    draw_heading(figure, short_title(f"{found.series.part}: {found.series.name}"), size=11)
    with mpl.rc_context({"svg.hashsalt": "cmmlink", "pdf.fonttype": 42}):
        if path.suffix.lower() == ".pdf":
            figure.savefig(path, metadata={"CreationDate": None})
        else:
            save_picture(figure, path)


def trend_figure(found: PartTrend, say: Speech, inches: tuple[float, float], dots_per_inch: int) -> Figure:
    """The drawing of a trend, without a heading, on a page of this width and height."""
    figure = Figure(figsize=inches, dpi=dots_per_inch)
    location, spread, heat, drift = (figure.add_axes((_LEFT, bottom, _WIDTH, height)) for bottom, height in _PLACES)
    for axes in (location, spread, heat, drift):
        prepare_axes(axes, say)
    _draw_charts(location, spread, found, say)
    _draw_strip(heat, found.strip, say)
    _draw_drift(drift, found.strip, say)
    _write_lines(figure, facts(found, say), 0.945, NOMINAL)
    _write_lines(figure, [say.sentence(told) for told in (*found.drifts, *found.notes)], 0.175, NOTES)
    return figure


def facts(found: PartTrend, say: Speech) -> list[str]:
    """Which runs these are, and the indices with their limits of confidence."""
    series, capability = found.series, found.trend.capability
    runs = say("runs: {count}", count=len(series.run))
    if series.run:
        began, ended = (datetime.fromtimestamp(at).astimezone().strftime("%Y-%m-%d %H:%M") for at in series.started_s[[0, -1]])
        runs = say("runs: {count}, from {began} to {ended}", count=len(series.run), began=began, ended=ended)
    lines = [runs + (say("; station {station}", station=found.station) if found.station else "")]
    if capability is None:
        return lines
    indices = {"Cp": capability.cp, "Cpk": capability.cpk, "Pp": capability.pp, "Ppk": capability.ppk}
    lines.append("    ".join(f"{name} {index_words(index, say)}" for name, index in indices.items()))
    unit = series.unit
    told = say(
        "mean {mean}, standard deviation {sigma} ({unit}); distribution: {distribution}; limits of confidence {confidence}",
        mean=say.number(capability.mean, ".5g"),
        sigma=say.number(capability.overall_sigma, ".3g"),
        unit=unit,
        distribution=say(capability.distribution),
        confidence=f"{capability.confidence:.0%}",
    )
    return [*lines, told]


def index_words(index: "CapabilityIndex", say: Speech) -> str:
    """An index with its limits of confidence; a dash where there is none."""
    if index.value is None or index.lower is None or index.upper is None:
        return say.number(index.value, ".2f")
    return f"{say.number(index.value, '.2f')} ({say.number(index.lower, '.2f')} .. {say.number(index.upper, '.2f')})"


def _write_lines(figure: Figure, told: list[str], top: float, colour: str) -> None:
    lines = [line for text in told for line in textwrap.wrap(text, _LETTERS)]
    lines = lines if len(lines) <= _MOST_LINES else [*lines[: _MOST_LINES - 1], "..."]
    for row, line in enumerate(lines):
        figure.text(_LEFT - 0.04, top - 0.0115 * row, line, fontsize=_SMALL, color=colour, va="top", parse_math=False)


def _draw_charts(location: Axes, spread: Axes, found: PartTrend, say: Speech) -> None:
    """The values with their tolerance and limits of control, and the ranges below."""
    trend, unit = found.trend, found.series.unit
    location.set_ylabel(f"{say('mean of the subgroup') if trend.subgroup > 1 else say('value')} ({unit})")
    spread.set_ylabel(f"{say('range') if trend.subgroup > 1 else say('moving range')} ({unit})")
    if trend.charts is None:
        for axes in (location, spread):
            axes.text(0.5, 0.5, say("too few values"), transform=axes.transAxes, ha="center", va="center", color=NOTES, fontsize=8)
        return
    size, plotted = trend.subgroup, len(trend.charts.location.plotted)
    newest = found.last_rows
    first = max(plotted - MOST_DRAWN, 0)
    _draw_tolerance(location, found, newest, first)
    if size == 1:
        _draw_verdicts(location, found, first)
    for axes, chart in ((location, trend.charts.location), (spread, trend.charts.spread)):
        _draw_chart(axes, chart, first, say)
        axes.set_xlim(first - 0.5, plotted - 0.5)
        axes.xaxis.set_major_locator(MaxNLocator(_TICKS, integer=True))
    location.tick_params(labelbottom=False)
    spread.xaxis.set_major_formatter(FuncFormatter(lambda place, _: _day_of(found, newest, place)))
    beyond = say("; the newest {drawn} of {plotted} are drawn", drawn=MOST_DRAWN, plotted=plotted) if first else ""
    told = say(
        "shaded: the tolerance; broken lines: limits of control; rings: a rule is broken; triangles: NOT CONFORM; diamonds: NOT PROVEN"
    )
    location.set_title(told + beyond, fontsize=_SMALL, y=1.0, pad=3)


def _day_of(found: PartTrend, newest: NDArray[np.int64], place: float) -> str:
    at = round(place)
    if not 0 <= at < len(newest):
        return ""
    return datetime.fromtimestamp(found.series.started_s[newest[at]]).astimezone().strftime("%Y-%m-%d\n%H:%M")


def _draw_tolerance(axes: Axes, found: PartTrend, newest: NDArray[np.int64], first: int) -> None:
    """The tolerance of each run; of one that has one side alone from there to the edge, form from zero on."""
    trend = found.trend
    low, high = trend.lower[newest][first:], trend.upper[newest][first:]
    if np.isnan(high).all() and np.isnan(low).all():
        return
    bottom = 0.0 if trend.is_form else float(np.nanmin(trend.values)) if np.isfinite(trend.values).any() else 0.0
    top = float(np.nanmax(trend.values)) if np.isfinite(trend.values).any() else 1.0
    low, high = np.where(np.isnan(low), bottom, low), np.where(np.isnan(high), top, high)
    places = np.arange(first, first + len(low))
    edges = np.append(places - 0.5, places[-1] + 0.5)
    axes.stairs(high, edges, baseline=low, fill=True, color=BAND, lw=0)
    for limit, source in ((high, trend.upper), (low, trend.lower)):
        if np.isfinite(source).any():
            axes.stairs(limit, edges, baseline=None, color=NOMINAL, lw=0.7)


def _draw_verdicts(axes: Axes, found: PartTrend, first: int) -> None:
    """Marks on the values of runs that do not conform, or are not proven to."""
    verdict, values = np.array(found.series.verdict), found.trend.values
    for name, mark in (("nonconform", "^"), ("uncertain", "D")):
        at = np.flatnonzero(verdict == name)
        at = at[at >= first]
        axes.plot(at, values[at], mark, ms=3.6, color=_BROKEN if name == "nonconform" else "#b37400", mew=0, zorder=4)


def _draw_chart(axes: Axes, chart: "ControlChart", first: int, say: Speech) -> None:
    places = np.arange(first, len(chart.plotted))
    axes.plot(places, chart.plotted[first:], color=_LINE, lw=0.7, marker="o", ms=1.6)
    for limit, kind, width in ((chart.limits.upper, "--", 0.9), (chart.limits.centre, "-", 0.6), (chart.limits.lower, "--", 0.9)):
        axes.axhline(limit, color=_LIMIT, ls=kind, lw=width)
        axes.annotate(
            say.number(limit, ".4g"), (1.0, limit), (3, 0), xycoords=("axes fraction", "data"), textcoords="offset points",
            fontsize=6, color=NOTES, va="center",
        )  # fmt: skip
    broken = sorted({violation.at for violation in chart.violations if violation.at >= first})
    axes.plot(broken, chart.plotted[broken], "o", ms=6.5, mfc="none", mec=_BROKEN, mew=0.9, zorder=5)
    axes.margins(y=0.12)


def _draw_strip(axes: Axes, strip: HeatStrip | None, say: Speech) -> None:
    """A row a run, the newest below, coloured by how far the worst deviation lies from the middle of the zone."""
    if strip is None:
        axes.text(0.5, 0.5, say("no profile on record"), transform=axes.transAxes, ha="center", va="center", color=NOTES, fontsize=8)
        return
    rows, places = strip.levels.shape
    colours = ListedColormap(HEAT_COLOURS).with_extremes(bad=COLOURS[Kind.NOT_JUDGED])
    norm = BoundaryNorm(np.arange(-3.5, 4), len(HEAT_COLOURS))
    stations = np.linspace(0, strip.length_mm, places + 1)
    axes.pcolormesh(stations, np.arange(rows + 1), np.ma.masked_invalid(strip.levels), cmap=colours, norm=norm)
    for side, mark in ((3, "^"), (-3, "v")):
        row, place = np.nonzero(strip.levels == side)
        axes.plot((stations[place] + stations[place + 1]) / 2, row + 0.5, mark, ms=2.2, color="white", mew=0)
    axes.invert_yaxis()
    axes.yaxis.set_major_locator(MaxNLocator(_TICKS, integer=True))
    names = [serial or run for serial, run in zip(strip.strips.serial_number, strip.strips.run, strict=True)]
    axes.yaxis.set_major_formatter(FuncFormatter(lambda at, _: names[int(at)][-10:] if 0 <= at < rows else ""))
    axes.set(xlim=(0, strip.length_mm))
    told = say("worst deviation along the profile, a row a run, the newest below: blue below, orange above the middle of the zone;")
    axes.set_title(f"{told}\n{say('darkest, with a triangle: out of tolerance; grey: not measured')}", fontsize=_SMALL, y=1.0, pad=3)


def _draw_drift(axes: Axes, strip: HeatStrip | None, say: Speech) -> None:
    """The slope at every place, and the stretches where it is no chance."""
    axes.set(xlabel=say("station (mm)"), ylabel=say("\u00b5m a run"))
    if strip is None:
        return
    places = (np.arange(len(strip.drift.slope)) + 0.5) / len(strip.drift.slope) * strip.length_mm
    axes.axhline(0, color=NOMINAL, lw=0.6)
    axes.plot(places, 1e3 * strip.drift.slope, color=_LINE, lw=0.9)
    for one in strip.drift.stretches:
        axes.axvspan(one.from_share * strip.length_mm, one.to_share * strip.length_mm, color="#f3e3c2", lw=0, zorder=0)
    axes.margins(y=0.2)
    axes.set(xlim=(0, strip.length_mm))
    axes.set_title(say("drift of the mean deviation; shaded: significant"), fontsize=_SMALL, y=1.0, pad=3)
