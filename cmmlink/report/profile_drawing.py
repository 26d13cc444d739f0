"""Draws a judged profile on axes: magnified whiskers on the nominal, and the deviation against station. Pictures and reports share it.

Verdicts show by mark and place as well as by colour, and what was not measured is grey.
"""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Literal

import numpy as np
from matplotlib.collections import PathCollection, PolyCollection
from matplotlib.path import Path
from matplotlib.ticker import FuncFormatter, MaxNLocator
from matplotlib.transforms import Bbox
from numpy.typing import NDArray

from cmmlink.report.heading import fix_labels
from cmmlink.report.picture_content import ABOVE, LOOKS, Look, NamedRegion, PictureContent
from cmmlink.report.speech import Speech
from inspection import ToleranceZone

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]
Rows = NDArray[np.int64]
Side = Literal["left", "center", "right"]

_PLACE_OF: dict[Side, float] = {"left": 0.0, "center": 0.5, "right": 1.0}  # of what a label stands at, within its width

NOMINAL, BAND, OPEN, UNMEASURED, NOTES, PLACES = "#3a3f45", "#dfe7ee", "#f3e3c2", "#9aa0a6", "#5b626a", "#5b4490"
_NEAR_AN_EDGE = 0.18  # of the width: half a label
_TEXT_PT, _SMALL_PT, _FRAME_PT = 7.0, 6.0, 0.6
_BESIDE_PT, _BELOW_PT = 35.0, 15.0  # of the labels from their axes
_TICK, _TICK_TEXT, _REGION, _LEVEL = 0.012, 0.03, 0.065, 0.055  # of the part's size, beyond the magnified zone
_LETTER = 0.012  # of the part's size: the width of a letter
_STEP, _TURN_DEG = 0.0025, 2.0  # between samples that are drawn, of the part's size: a curve lies 0.02 dots beside its chord
_DOT = 0.5  # of the size of a mark: how wide matplotlib draws a dot
_BESIDE = 0.5  # a name whose line runs more upright than this stands beside it
_MOST_REGIONS = 6  # whose names are drawn


def prepare_axes(axes: "Axes", say: Speech) -> None:
    """Set sizes and numbers of axes once, and the places of their labels."""
    axes.tick_params(labelsize=_TEXT_PT, width=_FRAME_PT, length=3)
    for spine in axes.spines.values():
        spine.set_linewidth(_FRAME_PT)
    numbers = FuncFormatter(lambda value, _: say.figures(f"{value:g}".replace("-", "\u2212")))
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter(numbers)
        axis.label.set_fontsize(_TEXT_PT)
    axes.title.set_fontsize(_TEXT_PT)
    fix_labels(axes, _BESIDE_PT, _BELOW_PT)


def wipe(axes: "Axes") -> None:
    """Take everything that was drawn off the axes, and forget how far it reached."""
    for artist in (*axes.lines, *axes.collections, *axes.patches, *axes.texts):
        artist.remove()
    axes.dataLim.set(Bbox.null())
    axes.ignore_existing_data_limits = True
    axes.autoscale(True)


def draw_contour(axes: "Axes", content: PictureContent, say: Speech) -> None:
    """Draw the nominal with its band, whiskers, stations and regions, as large as its frame allows."""
    _draw_profile(axes, content, rows_that_show(content))
    _draw_stations(axes, content, say)
    for level, region in enumerate(content.regions[:_MOST_REGIONS]):
        _draw_region(axes, content, region, _beyond_zone(content) + content_size(content) * (_REGION + _LEVEL * (level % 3)))
    if len(content.places_mm):
        axes.plot(*content.places_mm.T, "x", ms=4, color=PLACES, mew=1.0)
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.04)
    axes.autoscale_view()
    axes.set(xlabel="x (mm)", ylabel="y (mm)")
    zone = content.zone
    told = say(
        "deviations magnified {factor} times; shaded: the zone, {lower} .. {upper} mm; numbers at the profile: stations in mm",
        factor=say.figures(f"{content.magnification:g}"),
        lower=say.figures(f"{zone.lower_mm:+g}"),
        upper=say.figures(f"{zone.upper_mm:+g}"),
    )
    axes.set_title(told + ("; " + say("grey: not measured") if content.unmeasured else ""), fontsize=_TEXT_PT, y=1.0, pad=3)


def draw_cut_out(axes: "Axes", content: PictureContent, stretch: tuple[float, float]) -> None:
    """Draw the nominal with its whiskers around a stretch, from station to station, and a little beyond."""
    _draw_profile(axes, content, slice(None))
    length = content.length_mm
    start, width = stretch[0], (stretch[1] - stretch[0]) % length
    around = max(0.25 * width, 0.02 * length)
    stations = np.arange(start - around, start + width + around, max(width + 2 * around, 1e-6) / 200)
    stations = stations % length if content.closed else np.clip(stations, 0, length)
    places, outward = _at(content, stations)
    ends = np.vstack([places + content.magnification * d * outward for d in _reach(content)])
    middle, reach = (ends.min(axis=0) + ends.max(axis=0)) / 2, 1.1 * np.ptp(ends, axis=0)
    frame = axes.get_window_extent()
    half = max(reach[0] / frame.width, reach[1] / frame.height) / 2  # mm to a dot, the same along both axes
    (left, right), (low, high) = ((place + half * dots * np.array([-1, 1])) for place, dots in zip(middle, frame.size, strict=True))
    axes.set(xlim=(left, right), ylim=(low, high))
    axes.tick_params(labelsize=_SMALL_PT)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MaxNLocator(4))


def draw_strip(axes: "Axes", content: PictureContent, say: Speech, basis: bool = True) -> None:
    """Draw the deviation against station, with every line that the verdict on a point depends on; `basis` says what it rests on."""
    zone = content.zone
    axes.axhspan(zone.lower_mm, zone.upper_mm, color=BAND, lw=0)
    for limit in (zone.lower_mm, zone.upper_mm) if len(content.u_mm) else ():  # what the U of each station leaves open
        station, U = content.u_mm.T
        axes.fill_between(station, limit - U, limit + U, color=OPEN, lw=0)
    for start, end in content.unmeasured:
        axes.axvspan(start, end, color=UNMEASURED, alpha=None, lw=0)
    _draw_limits(axes, zone, say)
    axes.axhline(0, color=NOMINAL, lw=_FRAME_PT)
    for look, shown in zip(LOOKS, content.shown, strict=True):
        _draw_points(axes, np.column_stack([shown.station_mm, shown.deviation_mm]), look, content.length_mm)
    if content.worst is not None:
        station, deviation = content.worst.station_mm, content.worst.deviation_mm
        text = say(
            "worst {deviation} mm at station {station} mm", deviation=say.number(deviation, "+.4f"), station=say.number(station, ".2f")
        )
        above, side = deviation >= zone.middle_mm, side_of_label(station / content.length_mm)
        axes.annotate(
            text,
            (station, deviation),
            (
                float(np.clip(station, *(np.array([0.01, 0.99]) * content.length_mm))),
                0.97 if above else 0.03,
            ),  # in the margin, which is clear of points and of limits
            textcoords=("data", "axes fraction"),
            va="top" if above else "bottom",
            ha=side,
            fontsize=_TEXT_PT,
            arrowprops={"arrowstyle": "-", "lw": 0.5, "color": NOTES, "shrinkA": 0, "shrinkB": 3, "relpos": (_PLACE_OF[side], 0.5)},
        )
        axes.plot(station, deviation, "o", ms=5, mfc="none", mec=ABOVE, mew=1.0)
    axes.margins(y=0.25)
    axes.set(xlim=(0, content.length_mm), xlabel=say("station (mm)"), ylabel=say("deviation (mm)"))
    axes.set_title(content.basis if basis else "", fontsize=_TEXT_PT, y=1.0, pad=3)


def _draw_points(axes: "Axes", places: Array, look: Look, length_mm: float) -> None:
    if look.mark != ".":
        axes.scatter(places[:, 0], places[:, 1], s=look.size / 2, c=look.colour, marker=look.mark, lw=0)
        return
    # Thousands of dots are one path of strokes without a length to speak of and with round ends: an SVG holds them in a fifth of the room.
    stroke = np.array([1e-5 * length_mm, 0.0])
    dots, width = path_of_pieces(places - stroke, places + stroke), _DOT * np.sqrt(look.size / 2)
    axes.add_collection(PathCollection([dots], facecolors="none", edgecolors=look.colour, linewidths=width, capstyle="round"))


def side_of_label(share: float) -> Side:
    """How a label is set beside a point at a share of the width, from 0 to 1, so that it stays inside the drawing."""
    return "left" if share < _NEAR_AN_EDGE else "right" if share > 1 - _NEAR_AN_EDGE else "center"


def names_of_limits(zone: ToleranceZone, say: Speech | None = None) -> list[tuple[float, str]]:
    """Each line that the verdict on a point depends on, with its name: the limits, and those within U of them.

    Between a limit and the line a U to each side nothing is proven, so both are drawn.
    """
    say = say or Speech()
    limits = [
        (zone.upper_mm, say("upper {limit}", limit=say.figures(f"{zone.upper_mm:+g}"))),
        (zone.lower_mm, say("lower {limit}", limit=say.figures(f"{zone.lower_mm:+g}"))),
    ]
    if not zone.guard_mm:
        return limits
    names = {1: say("limit + U"), -1: say("limit - U")}
    return limits + [(limit + sign * zone.guard_mm, names[sign]) for limit, _ in limits for sign in (1, -1)]


def path_of_pieces(starts: Array, ends: Array) -> Path:
    """One path of separate straight pieces, from starts (m, 2) to ends (m, 2): it is drawn in a tenth of the time of m lines."""
    return Path(np.stack([starts, ends], axis=1).reshape(-1, 2), np.tile([Path.MOVETO, Path.LINETO], len(starts)).astype(np.uint8))


def content_size(content: PictureContent) -> float:
    """The diagonal of the nominal's box."""
    return float(np.hypot(*np.ptp(content.nominal_mm, axis=0)))


def rows_that_show(content: PictureContent) -> Rows:
    """Samples (k,) of the nominal that show all of it: no two neighbours are farther apart, nor turned more, than can be seen."""
    turned = np.unwrap(np.arctan2(*content.outward.T[::-1]))
    steps = np.floor(content.station_mm / (_STEP * content_size(content))), np.floor(turned / np.radians(_TURN_DEG))
    differ = (np.diff(steps) != 0).any(axis=0)
    shown = np.concatenate([[True], differ | np.append(differ[1:], True)])  # the last before a step and the first after it
    return np.flatnonzero(shown)


def _draw_profile(axes: "Axes", content: PictureContent, rows: Rows | slice) -> None:
    """Draw band, nominal and whiskers; `rows` are the samples that band and nominal are drawn through."""
    factor, zone = content.magnification, content.zone
    nominal, outward = content.nominal_mm[rows], content.outward[rows]
    edges = [_loop(nominal + factor * limit * outward, content) for limit in (zone.lower_mm, zone.upper_mm)]
    # A collection finds its limits by numpy; `fill` goes through every corner of its polygon in Python.
    axes.add_collection(PolyCollection([np.vstack([edges[0], edges[1][::-1]])], facecolors=BAND, linewidths=0))
    for start, end in content.unmeasured:
        axes.plot(*_at(content, np.linspace(start, end, 200))[0].T, color=UNMEASURED, lw=3.0, solid_capstyle="butt")
    axes.plot(*_loop(nominal, content).T, color=NOMINAL, lw=0.8)
    for look, shown in zip(LOOKS, content.shown, strict=True):
        whiskers = path_of_pieces(shown.foot_mm, shown.tip_mm)
        axes.add_collection(PathCollection([whiskers], facecolors="none", edgecolors=look.colour, linewidths=0.5))
    if content.worst is not None:
        axes.plot(*content.worst.tip_mm, "o", ms=6, mfc="none", mec=ABOVE, mew=1.0)


def _draw_limits(axes: "Axes", zone: ToleranceZone, say: Speech) -> None:
    for number, (limit, words) in enumerate(names_of_limits(zone, say)):
        own, above = number < 2, number % 2 == 0
        axes.axhline(limit, color=NOMINAL, lw=_FRAME_PT, ls="--" if own else ":")
        place, shift = ((1, limit), (3, 0)) if own else ((0, limit), (3, 1 if above else -1))
        along = "center" if own else "bottom" if above else "top"
        axes.annotate(words, place, shift, xycoords=("axes fraction", "data"), textcoords="offset points", va=along, fontsize=_SMALL_PT)


def _draw_stations(axes: "Axes", content: PictureContent, say: Speech) -> None:
    """Number the stations along the nominal, outside of the zone."""
    length, size, beyond = content.length_mm, content_size(content), _beyond_zone(content)
    stations = np.array(list(round_stations(length, content.closed)))
    places, outward = _at(content, stations)
    starts, ends = places + beyond * outward, places + (beyond + _TICK * size) * outward
    axes.add_collection(PathCollection([path_of_pieces(starts, ends)], facecolors="none", edgecolors=NOTES, linewidths=_FRAME_PT))
    for station, place in zip(stations.tolist(), places + (beyond + _TICK_TEXT * size) * outward, strict=True):
        axes.text(place[0], place[1], say.figures(f"{station:g}"), fontsize=_SMALL_PT, color=NOTES, ha="center", va="center", clip_on=True)
    axes.update_datalim(places + (beyond + 1.5 * _TICK_TEXT * size) * outward)


def _draw_region(axes: "Axes", content: PictureContent, region: NamedRegion, away_mm: float) -> None:
    """Draw a line along a region, outside of everything else, with its name at its middle."""
    width = (region.to_mm - region.from_mm) % content.length_mm or content.length_mm
    places, outward = _at(content, (region.from_mm + np.linspace(0, width, 200)) % content.length_mm)
    line = places + away_mm * outward
    axes.plot(*line.T, color=PLACES, lw=1.2)
    name = region.name if len(region.name) <= 24 else region.name[:22] + "..."
    at = line[100] + 0.025 * content_size(content) * outward[100]
    side: Side = "left" if outward[100, 0] > _BESIDE else "right" if outward[100, 0] < -_BESIDE else "center"  # clear of its line
    axes.text(at[0], at[1], name, fontsize=_SMALL_PT, color=NOTES, ha=side, va="center", clip_on=True, parse_math=False)
    room = np.array([_LETTER * len(name) * content_size(content), 0.0])
    left = at - _PLACE_OF[side] * room
    axes.update_datalim([left, left + room])  # the name as well, which else would stand over the frame


def round_stations(length_mm: float, closed: bool) -> Iterator[float]:
    """Round stations, about a dozen; of a closed profile the seam has the number 0 only."""
    power = 10.0 ** np.floor(np.log10(length_mm / 10))
    step = float(min((width * power for width in (1, 2, 5, 10)), key=lambda width: abs(length_mm / width - 10)))
    last = int(np.floor(length_mm / step * (1 + 1e-12)))
    for number in range(last + 1):
        if not (closed and number and length_mm - number * step < 0.4 * step):
            yield round(number * step, 12)


def _beyond_zone(content: PictureContent) -> float:
    """How far outside of the nominal the drawing of zone and whiskers ends."""
    return max(0.0, content.magnification * _reach(content)[1]) + 0.01 * content_size(content)


def _reach(content: PictureContent) -> tuple[float, float]:
    """The lowest and the highest of the limits and of the deviations drawn."""
    shown = [d for part in content.shown if len(part.deviation_mm) for d in (part.deviation_mm.min(), part.deviation_mm.max())]
    return min(content.zone.lower_mm, *shown, 0.0), max(content.zone.upper_mm, *shown, 0.0)


def _at(content: PictureContent, station_mm: Array) -> tuple[Array, Array]:
    """Places (k, 2) on the nominal, and the directions (k, 2) out of the material there."""
    stations, points, outward = content.station_mm, content.nominal_mm, content.outward
    if content.closed:
        stations, points, outward = (
            np.append(stations, content.length_mm),
            np.vstack([points, points[:1]]),
            np.vstack([outward, outward[:1]]),
        )
    columns = [np.interp(station_mm, stations, column) for column in (*points.T, *outward.T)]
    direction = np.column_stack(columns[2:])
    return np.column_stack(columns[:2]), direction / np.maximum(np.hypot(*direction.T), 1e-12)[:, None]


def _loop(points: Array, content: PictureContent) -> Array:
    return np.vstack([points, points[:1]]) if content.closed else points
