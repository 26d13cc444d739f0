"""The picture of a judged profile: magnified deviation whiskers on the nominal, and deviation against station."""

import pathlib
from typing import TYPE_CHECKING, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PathCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.path import Path
from matplotlib.transforms import Bbox
from numpy.typing import NDArray

from cmmlink.report.heading import draw_heading, fix_labels, save_picture
from cmmlink.report.picture_content import ABOVE, LOOKS, DrawnRegion, PictureContent, content_of
from inspection import ToleranceZone

if TYPE_CHECKING:  # a process that only draws loads nothing of what judges
    from inspection import InspectionResult, NominalProfile

Array = NDArray[np.float64]

# Everything has its place beforehand: to find places for labels of unknown size takes longer than to draw the picture.
_PLACES = {"height_ratios": (3, 2), "left": 0.09, "right": 0.905, "bottom": 0.08, "top": 0.92, "hspace": 0.32}
_NOMINAL, _BAND, _OPEN = "#3a3f45", "#dfe7ee", "#f3e3c2"
_REGION, _MOST_LETTERS = "#5b4490", 40  # of the name of a region
_NEAR_AN_EDGE = 0.18  # of the width: half a label


class ProfilePictures:
    """Draws pictures one after the other on one figure, whose axes with their numbers are made once: they take as long as the rest."""

    def __init__(self) -> None:
        self._figure = Figure(figsize=(12, 8), dpi=110)
        self._profile, self._strip = self._figure.subplots(2, 1, gridspec_kw=_PLACES)
        self._foot = self._figure.text(0.99, 0.01, "", ha="right", va="bottom", fontsize=9, parse_math=False)
        for axes in (self._profile, self._strip):
            fix_labels(axes)

    def write(self, content: PictureContent, path: pathlib.Path) -> None:
        """Draw the profile and the strip of deviations to a PNG file."""
        for axes, draw in ((self._profile, _draw_profile), (self._strip, _draw_strip)):
            _wipe(axes)
            draw(axes, content)
        draw_heading(self._figure, content.heading)
        self._foot.set_text(content.foot)
        save_picture(self._figure, path)


def write_picture(
    result: "InspectionResult", nominal: "NominalProfile", title: str, path: pathlib.Path, ending: str = "complete", said: str = ""
) -> None:
    """Draw one picture: see `content_of` and `ProfilePictures.write`."""
    ProfilePictures().write(content_of(result, nominal, title, ending, said), path)


def _wipe(axes: Axes) -> None:
    """Take everything that was drawn off the axes, and forget how far it reached."""
    for artist in (*axes.lines, *axes.collections, *axes.patches, *axes.texts):
        artist.remove()
    axes.dataLim.set(Bbox.null())
    axes.ignore_existing_data_limits = True


def _draw_profile(axes: Axes, content: PictureContent) -> None:
    factor, zone = content.magnification, content.zone
    edges = [_loop(content.nominal_mm + factor * limit * content.outward, content) for limit in (zone.lower_mm, zone.upper_mm)]
    # A collection finds its limits by numpy; `fill` goes through every corner of its polygon in Python.
    axes.add_collection(PolyCollection([np.vstack([edges[0], edges[1][::-1]])], facecolors=_BAND, linewidths=0))
    axes.plot(*_loop(content.nominal_mm, content).T, color=_NOMINAL, lw=1.0)
    for look, shown in zip(LOOKS, content.shown, strict=True):
        whiskers = path_of_pieces(shown.foot_mm, shown.tip_mm)
        axes.add_collection(PathCollection([whiskers], facecolors="none", edgecolors=look.colour, linewidths=0.7))
    if content.worst is not None:
        axes.plot(*content.worst.tip_mm, "o", ms=9, mfc="none", mec=ABOVE, mew=1.5)
    for region in content.regions:
        _draw_region(axes, region, content)
    if len(content.places_mm):
        axes.plot(*content.places_mm.T, "x", ms=6, color=_REGION, mew=1.2)
    axes.set_aspect("equal")
    axes.autoscale_view()
    axes.set(xlabel="x (mm)", ylabel="y (mm)")
    axes.set_title(f"deviations magnified {factor:g} times, tolerance band shaded", y=1.0)


def _draw_region(axes: Axes, region: DrawnRegion, content: PictureContent) -> None:
    axes.plot(*region.line_mm.T, color=_REGION, lw=1.2)
    if not len(region.line_mm):
        return
    name = region.name if len(region.name) <= _MOST_LETTERS else f"{region.name[: _MOST_LETTERS - 3]}..."
    middle, left, width = region.line_mm[len(region.line_mm) // 2], content.nominal_mm[:, 0].min(), np.ptp(content.nominal_mm[:, 0])
    side = side_of_label(float((middle[0] - left) / width))
    axes.annotate(name, middle, (0, 4), textcoords="offset points", ha=side, fontsize=8, color=_REGION, parse_math=False)


def _draw_strip(axes: Axes, content: PictureContent) -> None:
    zone = content.zone
    axes.axhspan(zone.lower_mm, zone.upper_mm, color=_BAND, lw=0)
    for limit, words in names_of_limits(zone):
        own, above = limit in (zone.lower_mm, zone.upper_mm), "+" in words
        axes.axhline(limit, color=_NOMINAL, lw=0.8, ls="--" if own else ":")
        place, shift = ((1, limit), (4, 0)) if own else ((0, limit), (4, 1 if above else -1))
        along = "center" if own else "bottom" if above else "top"
        axes.annotate(words, place, shift, xycoords=("axes fraction", "data"), textcoords="offset points", va=along, fontsize=8)
    for limit in (zone.lower_mm, zone.upper_mm) if len(content.u_mm) else ():  # what the U of each station leaves open
        station, U = content.u_mm.T
        axes.fill_between(station, limit - U, limit + U, color=_OPEN, lw=0)
    axes.axhline(0, color=_NOMINAL, lw=0.8)
    for look, shown in zip(LOOKS, content.shown, strict=True):
        axes.scatter(shown.station_mm, shown.deviation_mm, s=look.size, c=look.colour, marker=look.mark, lw=0)
    if content.worst is not None:
        station, deviation = content.worst.station_mm, content.worst.deviation_mm
        text = f"worst {deviation:+.4f} mm at station {station:.2f} mm"
        outside = 8 if deviation >= 0 else -16
        side = side_of_label(station / content.length_mm)
        axes.annotate(text, (station, deviation), (0, outside), textcoords="offset points", ha=side)  # clear of the neighbouring points
    axes.margins(y=0.2)
    axes.set(xlim=(0, content.length_mm), xlabel="station (mm)", ylabel="deviation (mm)")
    axes.set_title(content.basis, fontsize=10, y=1.0)


def side_of_label(share: float) -> Literal["left", "center", "right"]:
    """How a label is set beside a point at a share of the width, from 0 to 1, so that it stays inside the drawing."""
    return "left" if share < _NEAR_AN_EDGE else "right" if share > 1 - _NEAR_AN_EDGE else "center"


def names_of_limits(zone: ToleranceZone) -> list[tuple[float, str]]:
    """Each line that the verdict on a point depends on, with its name: the limits, and those within U of them.

    Between a limit and the line a U to each side nothing is proven, so both are drawn.
    """
    limits = [(zone.upper_mm, f"upper {zone.upper_mm:+g}"), (zone.lower_mm, f"lower {zone.lower_mm:+g}")]
    if not zone.guard_mm:
        return limits
    around = [(limit + sign * zone.guard_mm, "limit + U" if sign > 0 else "limit - U") for limit, _ in limits for sign in (1, -1)]
    return limits + around


def path_of_pieces(starts: Array, ends: Array) -> Path:
    """One path of separate straight pieces, from starts (m, 2) to ends (m, 2): it is drawn in a tenth of the time of m lines."""
    return Path(np.stack([starts, ends], axis=1).reshape(-1, 2), np.tile([Path.MOVETO, Path.LINETO], len(starts)).astype(np.uint8))


def _loop(points: Array, content: PictureContent) -> Array:
    return np.vstack([points, points[:1]]) if content.closed else points
