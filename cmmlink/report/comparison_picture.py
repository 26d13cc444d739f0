"""The drawing of a comparison: both scans magnified on the nominal, both over the station, and their difference. PNG, SVG or PDF.

The two are told apart by the kind of their line as well as by its colour.
"""

from pathlib import Path
from typing import NamedTuple

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from numpy.typing import NDArray

from cmmlink.comparison import Comparison
from cmmlink.report.heading import draw_heading, save_picture, short_title
from cmmlink.report.profile_drawing import BAND, NOMINAL, NOTES, UNMEASURED, prepare_axes, round_stations, side_of_label
from cmmlink.report.speech import Speech
from inspection import NominalProfile, telling_rows

Array = NDArray[np.float64]

_FIRST, _SECOND, _DIFFERENCE = "#14608c", "#c2410c", "#5b4490"
_LINES = ((_FIRST, "-", 0.9), (_SECOND, (0, (4, 1.5)), 0.9))  # colour, kind and width
_INCHES, _DOTS_PER_INCH = (7.1, 9.6), 200  # fits on A4 and on Letter
_SHARES = 4096  # of the profile, of which the lowest and the highest point are drawn: three to a dot of the width
_MAGNIFIED = 0.12  # of the part's size: how far the largest deviation is drawn off the nominal
_LONGEST_LINE = 120


class _Line(NamedTuple):
    """Values (k,) over rising stations (k,), with NaN between two pieces."""

    station_mm: Array
    value_mm: Array


def write_comparison_picture(comparison: Comparison, title: str, path: Path) -> None:
    """Draw a comparison to a file, of the kind that its name says. Raises OSError where it cannot be written."""
    say, found = Speech(), comparison.difference
    figure = Figure(figsize=_INCHES, dpi=_DOTS_PER_INCH)
    places = {"height_ratios": (5, 3, 3), "left": 0.1, "right": 0.9, "bottom": 0.05, "top": 0.86, "hspace": 0.28}
    contour, strip, difference = figure.subplots(3, 1, gridspec_kw=places)
    for axes in (contour, strip, difference):
        prepare_axes(axes, say)
    courses = [_thinned(found.station_mm, values, comparison) for values in (found.first_mm, found.second_mm)]
    _draw_contour(contour, comparison, courses, say)
    _draw_courses(strip, comparison, courses)
    _draw_difference(difference, comparison, say)
    draw_heading(figure, short_title(title), size=10)
    for line, (scan, (colour, *_)) in enumerate(zip((comparison.first, comparison.second), _LINES, strict=True)):
        told = _shortened(f"{('first', 'second')[line]}: {scan.words}; {scan.pose_words}")
        figure.text(0.1, 0.935 - 0.016 * line, told, fontsize=6.5, color=colour, parse_math=False)
    figure.text(0.1, 0.903, _shortened(comparison.notes[0]), fontsize=6.5, color=NOTES, parse_math=False)
    with mpl.rc_context({"svg.hashsalt": "cmmlink", "pdf.fonttype": 42}):  # the same names inside each time, and letters to search for
        if path.suffix.lower() == ".pdf":
            figure.savefig(path, metadata={"CreationDate": None})
        else:
            save_picture(figure, path)


def _shortened(told: str) -> str:
    return told if len(told) <= _LONGEST_LINE else f"{told[:_LONGEST_LINE]} ..."


def _thinned(station: Array, value: Array, comparison: Comparison) -> _Line:
    """A course with few points that look like all of it."""
    gaps = np.flatnonzero(np.diff(np.isnan(value).astype(np.int8)))  # the ends of every piece stay, and the NaN between two
    rows = telling_rows(station, value, comparison.profile.length_mm, _SHARES)
    kept = np.unique(np.concatenate([rows, gaps, gaps + 1]).astype(np.int64))
    return _Line(station[kept], value[kept])


def _draw_contour(axes: Axes, comparison: Comparison, courses: list[_Line], say: Speech) -> None:
    """The nominal with both scans magnified on it, and the place of the largest difference."""
    profile = comparison.profile
    size = float(np.hypot(*np.ptp(profile.points_mm, axis=0)))
    largest = max(float(np.nanmax(np.abs(line.value_mm), initial=0.0)) for line in courses)
    factor = _magnification(_MAGNIFIED * size, largest)
    axes.add_collection(PolyCollection([profile.points_mm], facecolors="#f4f6f8", linewidths=0, closed=True))
    places, _ = _on_nominal(profile, np.linspace(0, profile.length_mm, 4000))
    axes.plot(*places.T, color=NOMINAL, lw=0.7)
    for line, (colour, kind, width) in zip(courses, _LINES, strict=True):
        places, outward = _on_nominal(profile, line.station_mm)
        axes.plot(*(places + factor * line.value_mm[:, None] * outward).T, color=colour, ls=kind, lw=width)
    _draw_stations(axes, profile, factor * largest + 0.03 * size, say)
    found = comparison.place(comparison.difference.largest)
    assert found is not None
    at, outward = _on_nominal(profile, np.array([found["station_mm"]], dtype=np.float64))
    for value in (found["first_mm"], found["second_mm"]):
        axes.plot(*(at + factor * (value or 0.0) * outward)[0], "o", ms=6, mfc="none", mec=_DIFFERENCE, mew=1.1)
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.04)
    axes.autoscale_view()
    axes.set(xlabel="x (mm)", ylabel="y (mm)")
    axes.set_title(
        f"deviations magnified {factor:g} times; numbers at the profile: stations in mm; rings: the largest difference",
        fontsize=7,
        y=1.0,
        pad=3,
    )


def _draw_courses(axes: Axes, comparison: Comparison, courses: list[_Line]) -> None:
    """Both scans over the station, with the limits where any are known."""
    if comparison.limits_mm is not None:
        axes.axhspan(*comparison.limits_mm, color=BAND, lw=0)
        for limit in comparison.limits_mm:
            axes.axhline(limit, color=NOMINAL, lw=0.6, ls="--")
    axes.axhline(0, color=NOMINAL, lw=0.6)
    for line, (colour, kind, width), name in zip(courses, _LINES, ("first", "second"), strict=True):
        axes.plot(line.station_mm, line.value_mm, color=colour, ls=kind, lw=width, label=name)
    axes.legend(loc="upper right", fontsize=6, ncols=2, frameon=False, borderaxespad=0.2)
    axes.margins(y=0.15)
    axes.set(xlim=(0, comparison.profile.length_mm), ylabel="deviation (mm)")


def _draw_difference(axes: Axes, comparison: Comparison, say: Speech) -> None:
    """The second less the first; grey where one of them was not measured."""
    found, length = comparison.difference, comparison.profile.length_mm
    line = _thinned(found.station_mm, found.difference_mm, comparison)
    for start, end in _unknown(line, length):
        axes.axvspan(start, end, color=UNMEASURED, lw=0)
    axes.axhline(0, color=NOMINAL, lw=0.6)
    axes.plot(line.station_mm, line.value_mm, color=_DIFFERENCE, lw=0.9)
    at = comparison.place(found.largest)
    assert at is not None
    station, value = at["station_mm"] or 0.0, at["difference_mm"] or 0.0
    axes.plot(station, value, "o", ms=6, mfc="none", mec=_DIFFERENCE, mew=1.1)
    told = f"largest {say.number(value, '+.4f')} mm at station {say.number(station, '.2f')} mm"
    beside = 6 if value >= 0 else -12
    axes.annotate(told, (station, value), (0, beside), textcoords="offset points", ha=side_of_label(station / length), fontsize=7)
    axes.margins(y=0.25)
    axes.set(xlim=(0, length), xlabel="station (mm)", ylabel="second - first (mm)")
    beside_it = f"compared along {found.compared:.1%} of the profile; mean {found.mean_mm:+.4f} mm, rms {found.rms_mm:.4f} mm"
    axes.set_title(beside_it + ("; grey: not measured by both" if found.compared < 1 else ""), fontsize=7, y=1.0, pad=3)


def _unknown(line: _Line, length_mm: float) -> list[tuple[float, float]]:
    """Stretches from station to station in which the line is not known, such as can be seen on a drawing."""
    known = np.isfinite(line.value_mm)
    stations = line.station_mm[known]
    ends = np.concatenate([[0.0], stations, [length_mm]])
    wide = np.diff(ends) > length_mm / 500
    broken = np.concatenate([[True], np.diff(np.flatnonzero(known)) > 1, [True]])
    return [(float(ends[k]), float(ends[k + 1])) for k in np.flatnonzero(wide & broken)]


def _draw_stations(axes: Axes, profile: NominalProfile, away_mm: float, say: Speech) -> None:
    stations = np.array(list(round_stations(profile.length_mm, profile.curve.closed)))
    places, outward = _on_nominal(profile, stations)
    for station, place in zip(stations.tolist(), places + away_mm * outward, strict=True):
        axes.text(place[0], place[1], say.figures(f"{station:g}"), fontsize=6, color=NOTES, ha="center", va="center", clip_on=True)
    axes.update_datalim(places + 1.2 * away_mm * outward)


def _on_nominal(profile: NominalProfile, station_mm: Array) -> tuple[Array, Array]:
    """Places (k, 2) on the nominal, and directions (k, 2) out of the material there."""
    columns = np.column_stack([profile.points_mm, profile.outward * profile.normal])
    stations = profile.station_mm
    if profile.curve.closed:
        columns, stations = np.vstack([columns, columns[:1]]), np.append(stations, profile.length_mm)
    found = np.column_stack([np.interp(station_mm, stations, column) for column in columns.T])
    direction = found[:, 2:]
    return found[:, :2], direction / np.maximum(np.hypot(*direction.T), 1e-12)[:, None]


def _magnification(wanted_mm: float, largest_mm: float) -> float:
    """A round factor (1, 2 or 5 times a power of ten) that draws the largest deviation about so far off the nominal."""
    ratio = wanted_mm / max(largest_mm, 1e-6)
    power = 10.0 ** np.floor(np.log10(ratio))
    return float(max(step * power for step in (1, 2, 5) if step * power <= ratio * (1 + 1e-12)))
