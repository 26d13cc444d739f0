"""The picture of a judged profile: magnified deviation whiskers on the nominal, and deviation against station.

Verdicts are those of the result, and they show by mark as well as by colour: a triangle up is out of tolerance above the zone,
one down is out below it, a diamond is not proven either way.
"""

import pathlib
from dataclasses import dataclass
from typing import Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PathCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.path import Path
from matplotlib.transforms import Bbox
from numpy.typing import NDArray

from cmmlink.report.heading import draw_heading, fix_labels, heading_of, save_picture
from cmmlink.words import headline_of
from inspection import InspectionResult, JudgedRows, NominalProfile, ToleranceZone, Verdict, telling_rows

Array = NDArray[np.float64]
Rows = NDArray[np.int64]

# Everything has its place beforehand: to find places for labels of unknown size takes longer than to draw the picture.
_PLACES = {"height_ratios": (3, 2), "left": 0.09, "right": 0.905, "bottom": 0.08, "top": 0.92, "hspace": 0.32}
_NOMINAL, _BAND, _GOOD, _UNPROVEN, _ABOVE, _BELOW = "#3a3f45", "#dfe7ee", "#2a7fa5", "#a16207", "#c2410c", "#6d28d9"
_BAND_SHARE = 0.06  # of the part's size: how wide the magnified tolerance band is drawn
_NEAR_AN_EDGE = 0.18  # of the width: half a label
_MOST_WHISKERS = 1500
_MOST_POINTS = 65536  # in the strip: more would take minutes and show no more


@dataclass(frozen=True, slots=True)
class _Look:
    """How points of a verdict are drawn; `side` is where they lie, seen from the middle of the zone."""

    verdict: Verdict
    side: Literal["both", "above", "below"]
    colour: str
    mark: str
    size: float


_LOOKS = (
    _Look(Verdict.CONFORM, "both", _GOOD, ".", 4.0),
    _Look(Verdict.UNCERTAIN, "both", _UNPROVEN, "D", 10.0),
    _Look(Verdict.NONCONFORM, "above", _ABOVE, "^", 16.0),
    _Look(Verdict.NONCONFORM, "below", _BELOW, "v", 16.0),
)


class ProfilePictures:
    """Draws pictures one after the other on one figure, whose axes with their numbers are made once: they take as long as the rest."""

    def __init__(self) -> None:
        self._figure = Figure(figsize=(12, 8), dpi=110)
        self._profile, self._strip = self._figure.subplots(2, 1, gridspec_kw=_PLACES)
        self._foot = self._figure.text(0.99, 0.01, "", ha="right", va="bottom", fontsize=9, parse_math=False)
        for axes in (self._profile, self._strip):
            fix_labels(axes)

    def write(
        self, result: InspectionResult, nominal: NominalProfile, title: str, path: pathlib.Path, ending: str = "complete", said: str = ""
    ) -> None:
        """Draw the profile and the strip of deviations to a PNG file.

        ending : how the run ended
        said   : what stands small at the foot, like which run it was and when it was measured
        """
        telling = _telling(result, nominal)
        for axes, draw in ((self._profile, _draw_profile), (self._strip, _draw_strip)):
            _wipe(axes)
            draw(axes, result, nominal, telling)
        draw_heading(self._figure, headline_on_picture(result, title, ending))
        self._foot.set_text(said)
        save_picture(self._figure, path)


def write_picture(
    result: InspectionResult, nominal: NominalProfile, title: str, path: pathlib.Path, ending: str = "complete", said: str = ""
) -> None:
    """Draw one picture: see `ProfilePictures.write`."""
    ProfilePictures().write(result, nominal, title, path, ending, said)


def _wipe(axes: Axes) -> None:
    """Take everything that was drawn off the axes, and forget how far it reached."""
    for artist in (*axes.lines, *axes.collections, *axes.patches, *axes.texts):
        artist.remove()
    axes.dataLim.set(Bbox.null())
    axes.ignore_existing_data_limits = True


def headline_on_picture(result: InspectionResult, title: str, ending: str) -> str:
    """What stands above the picture: the part, and the verdict or how early the run ended."""
    return heading_of(title, headline_of(result.verdict, ending, result.coverage).words)


def magnification(result: InspectionResult, nominal: NominalProfile) -> float:
    """A round factor (1, 2 or 5 times a power of ten) that draws the tolerance band about 6 % of the part wide."""
    width = result.zone.upper_mm - result.zone.lower_mm
    wanted = _BAND_SHARE * float(np.hypot(*np.ptp(nominal.points_mm, axis=0))) / width
    power = 10.0 ** np.floor(np.log10(wanted))
    return float(max(step * power for step in (1, 2, 5) if step * power <= wanted))


def _draw_profile(axes: Axes, result: InspectionResult, nominal: NominalProfile, telling: Rows) -> None:
    factor = magnification(result, nominal)
    outward = nominal.outward * nominal.normal
    points = _loop(nominal.points_mm, nominal)
    zone = result.zone
    edges = [_loop(nominal.points_mm + factor * limit * outward, nominal) for limit in (zone.lower_mm, zone.upper_mm)]
    # A collection finds its limits by numpy; `fill` goes through every corner of its polygon in Python.
    axes.add_collection(PolyCollection([np.vstack([edges[0], edges[1][::-1]])], facecolors=_BAND, linewidths=0))
    axes.plot(*points.T, color=_NOMINAL, lw=1.0)
    shown = result.rows_at(_rows_to_draw(result, telling))
    tips = shown.foot_mm + factor * (shown.actual_mm - shown.foot_mm)
    for look in _LOOKS:
        chosen = _has_look(shown, look, zone.middle_mm)
        whiskers = path_of_pieces(shown.foot_mm[chosen], tips[chosen])
        axes.add_collection(PathCollection([whiskers], facecolors="none", edgecolors=look.colour, linewidths=0.7))
    _mark_worst(axes, result, factor)
    axes.set_aspect("equal")
    axes.autoscale_view()
    axes.set(xlabel="x (mm)", ylabel="y (mm)")
    axes.set_title(f"deviations magnified {factor:g} times, tolerance band shaded", y=1.0)


def _draw_strip(axes: Axes, result: InspectionResult, nominal: NominalProfile, telling: Rows) -> None:
    zone = result.zone
    axes.axhspan(zone.lower_mm, zone.upper_mm, color=_BAND, lw=0)
    for limit, words in names_of_limits(zone):
        own, above = limit in (zone.lower_mm, zone.upper_mm), "+" in words
        axes.axhline(limit, color=_NOMINAL, lw=0.8, ls="--" if own else ":")
        place, shift = ((1, limit), (4, 0)) if own else ((0, limit), (4, 1 if above else -1))
        along = "center" if own else "bottom" if above else "top"
        axes.annotate(words, place, shift, xycoords=("axes fraction", "data"), textcoords="offset points", va=along, fontsize=8)
    axes.axhline(0, color=_NOMINAL, lw=0.8)
    shown = result.rows_at(telling)
    for look in _LOOKS:
        chosen = _has_look(shown, look, zone.middle_mm)
        axes.scatter(shown.station_mm[chosen], shown.deviation_mm[chosen], s=look.size, c=look.colour, marker=look.mark, lw=0)
    worst = result.worst_row
    if worst is not None:
        station, deviation = float(worst.station_mm[0]), float(worst.deviation_mm[0])
        text = f"worst {deviation:+.4f} mm at station {station:.2f} mm"
        outside = 8 if deviation >= 0 else -16
        side = side_of_label(station / nominal.length_mm)
        axes.annotate(text, (station, deviation), (0, outside), textcoords="offset points", ha=side)  # clear of the neighbouring points
    axes.margins(y=0.2)
    axes.set(xlim=(0, nominal.length_mm), xlabel="station (mm)", ylabel="deviation (mm)")
    basis = f"coverage {result.coverage:.1%}   fit {result.fit}   method {result.method}   out of tolerance {result.out_of_tolerance}"
    axes.set_title(f"{basis}\n{zone.decision_rule}", fontsize=10, y=1.0)


def side_of_label(share: float) -> Literal["left", "center", "right"]:
    """How a label is set beside a point at a share of the width, from 0 to 1, so that it stays inside the drawing."""
    return "left" if share < _NEAR_AN_EDGE else "right" if share > 1 - _NEAR_AN_EDGE else "center"


def names_of_limits(zone: ToleranceZone) -> list[tuple[float, str]]:
    """Each line that the verdict on a point depends on, with its name: the limits, and those within U of them.

    Between a limit and the line a U to each side nothing is proven, so both are drawn.
    """
    limits = [(zone.upper_mm, f"upper {zone.upper_mm:+g}"), (zone.lower_mm, f"lower {zone.lower_mm:+g}")]
    if not zone.uncertainty_mm:
        return limits
    around = [(limit + sign * zone.uncertainty_mm, "limit + U" if sign > 0 else "limit - U") for limit, _ in limits for sign in (1, -1)]
    return limits + around


def _mark_worst(axes: Axes, result: InspectionResult, factor: float) -> None:
    worst = result.worst_row
    if worst is not None:
        tip = worst.foot_mm[0] + factor * (worst.actual_mm[0] - worst.foot_mm[0])
        axes.plot(*tip, "o", ms=9, mfc="none", mec=_ABOVE, mew=1.5)


def path_of_pieces(starts: Array, ends: Array) -> Path:
    """One path of separate straight pieces, from starts (m, 2) to ends (m, 2): it is drawn in a tenth of the time of m lines."""
    return Path(np.stack([starts, ends], axis=1).reshape(-1, 2), np.tile([Path.MOVETO, Path.LINETO], len(starts)).astype(np.uint8))


def _telling(result: InspectionResult, nominal: NominalProfile) -> Rows:
    """Rows (k,) of the points: of a long scan the lowest and the highest in every few hundredths of a pixel, which hide the others."""
    return telling_rows(result.station_mm, result.deviation_mm, nominal.length_mm, _MOST_POINTS // 2)


def _rows_to_draw(result: InspectionResult, telling: Rows) -> Rows:
    """Rows (k,) of the points to draw: thinned, but with every point out of tolerance and the worst one."""
    kept = telling[:: max(1, len(telling) // _MOST_WHISKERS)]
    out = telling[result.verdicts[telling] == Verdict.NONCONFORM]
    worst = [] if result.worst is None else [result.worst]
    return np.unique(np.concatenate([kept, out, worst]).astype(np.int64))


def _has_look(rows: JudgedRows, look: _Look, middle_mm: float) -> NDArray[np.bool_]:
    """Which of the rows (m,) are drawn so: those of a verdict, above or below the middle of the zone."""
    of_verdict = np.equal(rows.verdicts, look.verdict)
    above = np.greater(rows.deviation_mm, middle_mm)
    if look.side == "both":
        return of_verdict
    return of_verdict & above if look.side == "above" else of_verdict & ~above


def _loop(points: Array, nominal: NominalProfile) -> Array:
    return np.vstack([points, points[:1]]) if nominal.curve.closed else points
