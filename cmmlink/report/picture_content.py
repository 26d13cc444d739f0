"""What the picture of a judged profile shows, worked out before anything is drawn: another process can draw it.

Verdicts are those of the result, and they show by mark as well as by colour: a triangle up is out of tolerance above the zone,
one down is out below it, a diamond is not proven either way.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from cmmlink.report.heading import heading_of
from cmmlink.words import headline_of
from inspection import ToleranceZone, Verdict, telling_rows

if TYPE_CHECKING:  # a process that only draws loads nothing of what judges
    from inspection import InspectionResult, JudgedRows, NominalProfile

Array = NDArray[np.float64]
Rows = NDArray[np.int64]

GOOD, UNPROVEN, ABOVE, BELOW = "#2a7fa5", "#a16207", "#c2410c", "#6d28d9"
_BAND_SHARE = 0.06  # of the part's size: how wide the magnified tolerance band is drawn
_LANE_SHARE = 0.015  # of the part's size: how far the lines of regions are apart
_MOST_WHISKERS = 1500
_MOST_POINTS = 65536  # in the strip: more would take minutes and show no more


@dataclass(frozen=True, slots=True)
class Look:
    """How points of a verdict are drawn; `side` is where they lie, seen from the middle of the zone."""

    verdict: Verdict
    side: Literal["both", "above", "below"]
    colour: str
    mark: str
    size: float


LOOKS = (
    Look(Verdict.CONFORM, "both", GOOD, ".", 4.0),
    Look(Verdict.UNCERTAIN, "both", UNPROVEN, "D", 10.0),
    Look(Verdict.NONCONFORM, "above", ABOVE, "^", 16.0),
    Look(Verdict.NONCONFORM, "below", BELOW, "v", 16.0),
)


@dataclass(frozen=True, slots=True, eq=False)
class Shown:
    """The points of one look: whiskers from foot_mm to tip_mm (w, 2), and station_mm and deviation_mm (p,) in the strip."""

    foot_mm: Array
    tip_mm: Array
    station_mm: Array
    deviation_mm: Array


@dataclass(frozen=True, slots=True)
class Worst:
    """The point farthest from the middle of the zone: its place in the strip, and the tip of its whisker (x, y)."""

    station_mm: float
    deviation_mm: float
    tip_mm: tuple[float, float]


@dataclass(frozen=True, slots=True, eq=False)
class DrawnRegion:
    """The region of a characteristic, as a line (r, 2) beside the band."""

    name: str
    line_mm: Array


@dataclass(frozen=True, slots=True, eq=False)
class PictureContent:
    """Everything that the picture of a profile shows.

    nominal_mm    : (n, 2) samples of the nominal
    outward       : (n, 2) unit normals there, out of the material
    closed        : the nominal ends where it begins
    length_mm     : its length
    zone          : the tolerance zone
    u_mm          : (k, 2) stations and the expanded uncertainty there, where a budget was stated; (0, 2) without one
    magnification : how many times as large deviations are drawn on the profile
    shown         : the points of each of `LOOKS`
    worst         : None where nothing was judged
    regions       : of the characteristics that are of a part of the profile
    places_mm     : (p, 2) places that values of characteristics were found at
    heading, basis, foot : what stands above the picture, above the strip, and small at the foot
    """

    nominal_mm: Array
    outward: Array
    closed: bool
    length_mm: float
    zone: ToleranceZone
    u_mm: Array
    magnification: float
    shown: tuple[Shown, ...]
    worst: Worst | None
    regions: tuple[DrawnRegion, ...]
    places_mm: Array
    heading: str
    basis: str
    foot: str


def content_of(
    result: "InspectionResult", nominal: "NominalProfile", title: str, ending: str = "complete", said: str = ""
) -> PictureContent:
    """What the picture of a result shows.

    ending : how the run ended
    said   : what stands small at the foot, like which run it was and when it was measured
    """
    factor = magnification(result, nominal)
    telling = telling_rows(result.station_mm, result.deviation_mm, nominal.length_mm, _MOST_POINTS // 2)  # the others lie hidden
    basis = f"coverage {result.coverage:.1%}   fit {result.fit}   method {result.method}   out of tolerance {result.out_of_tolerance}"
    along = _uncertainty_along(result)
    shaded = "; shaded around the limits: the U of each station" if len(along) else ""
    return PictureContent(
        nominal.points_mm,
        nominal.outward * nominal.normal,
        nominal.curve.closed,
        nominal.length_mm,
        result.zone,
        along,
        factor,
        _shown(result, telling, factor),
        _worst(result, factor),
        _regions(result, nominal, factor),
        np.array([place[1:] for found in result.characteristics for place in found.places_mm]).reshape(-1, 2),
        headline_on_picture(result, title, ending),
        f"{basis}\n{result.zone.decision_rule}{shaded}",
        said,
    )


def headline_on_picture(result: "InspectionResult", title: str, ending: str) -> str:
    """What stands above the picture: the part, and the verdict or how early the run ended."""
    return heading_of(title, headline_of(result.verdict, ending, result.coverage).words)


def magnification(result: "InspectionResult", nominal: "NominalProfile") -> float:
    """A round factor (1, 2 or 5 times a power of ten) that draws the tolerance band about 6 % of the part wide."""
    width = result.zone.upper_mm - result.zone.lower_mm
    wanted = _BAND_SHARE * float(np.hypot(*np.ptp(nominal.points_mm, axis=0))) / width
    power = 10.0 ** np.floor(np.log10(wanted))
    return float(max(step * power for step in (1, 2, 5) if step * power <= wanted))


def _uncertainty_along(result: "InspectionResult") -> Array:
    found = result.uncertainty
    if found is None or not result.zone.guard_mm:
        return np.empty((0, 2))
    rows = found.telling_places()
    return np.column_stack([found.station_mm[rows], found.expanded_mm[rows]])


def _regions(result: "InspectionResult", nominal: "NominalProfile", factor: float) -> tuple[DrawnRegion, ...]:
    """The regions of the characteristics, each in a lane of its own outside the magnified band."""
    found = [(one.name, one.region) for one in result.characteristics if one.region is not None]
    lane_mm, drawn = _LANE_SHARE * float(np.hypot(*np.ptp(nominal.points_mm, axis=0))), []
    for lane, (name, region) in enumerate(found, 1):
        along = np.mod(nominal.station_mm - region.from_mm, nominal.length_mm)
        order = np.argsort(along, kind="stable")
        rows = order[along[order] <= np.mod(region.to_mm - region.from_mm, nominal.length_mm)]
        away = factor * result.zone.upper_mm + lane * lane_mm
        drawn.append(DrawnRegion(name, (nominal.points_mm + away * nominal.outward * nominal.normal)[rows]))
    return tuple(drawn)


def _shown(result: "InspectionResult", telling: Rows, factor: float) -> tuple[Shown, ...]:
    strip, drawn, middle = result.rows_at(telling), result.rows_at(_rows_to_draw(result, telling)), result.zone.middle_mm
    tips = drawn.foot_mm + factor * (drawn.actual_mm - drawn.foot_mm)
    looks = [(_has_look(drawn, look, middle), _has_look(strip, look, middle)) for look in LOOKS]
    return tuple(
        Shown(drawn.foot_mm[whiskers], tips[whiskers], strip.station_mm[points], strip.deviation_mm[points]) for whiskers, points in looks
    )


def _rows_to_draw(result: "InspectionResult", telling: Rows) -> Rows:
    """Rows (k,) of the points to draw: thinned, but with every point out of tolerance and the worst one."""
    kept = telling[:: max(1, len(telling) // _MOST_WHISKERS)]
    out = telling[result.verdicts[telling] == Verdict.NONCONFORM]
    worst = [] if result.worst is None else [result.worst]
    return np.unique(np.concatenate([kept, out, worst]).astype(np.int64))


def _has_look(rows: "JudgedRows", look: Look, middle_mm: float) -> NDArray[np.bool_]:
    """Which of the rows (m,) are drawn so: those of a verdict, above or below the middle of the zone."""
    of_verdict = np.equal(rows.verdicts, look.verdict)
    above = np.greater(rows.deviation_mm, middle_mm)
    if look.side == "both":
        return of_verdict
    return of_verdict & above if look.side == "above" else of_verdict & ~above


def _worst(result: "InspectionResult", factor: float) -> Worst | None:
    row = result.worst_row
    if row is None:
        return None
    x, y = row.foot_mm[0] + factor * (row.actual_mm[0] - row.foot_mm[0])
    return Worst(float(row.station_mm[0]), float(row.deviation_mm[0]), (float(x), float(y)))
