"""What the picture of a judged profile shows, worked out before anything is drawn: another process can draw it.

Verdicts are those of the result, and they show by mark as well as by colour: a triangle up is out of tolerance above the zone,
one down is out below it, a diamond is not proven either way.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from cmmlink.report.heading import heading_of
from cmmlink.report.judged_scan import JudgedScan, unmeasured_stretches
from cmmlink.report.speech import Speech
from cmmlink.words import headline_of
from inspection import ToleranceZone, Verdict, telling_rows

if TYPE_CHECKING:  # a process that only draws loads nothing of what judges
    from inspection import JudgedRows, NominalProfile

Array = NDArray[np.float64]
Rows = NDArray[np.int64]

GOOD, UNPROVEN, ABOVE, BELOW = "#2a7fa5", "#a16207", "#c2410c", "#6d28d9"
_BAND_SHARE = 0.06  # of the part's size: how wide the magnified tolerance band is drawn
_MOST_WHISKERS = 1500
_MOST_POINTS = 8192  # in the strip: three to a dot of its width, more show no more


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
class NamedRegion:
    """A stretch of the profile that a characteristic judges; `from_mm` is above `to_mm` where it crosses the seam."""

    name: str
    from_mm: float
    to_mm: float


@dataclass(frozen=True, slots=True)
class Worst:
    """The point farthest from the middle of the zone: its place in the strip, and the tip of its whisker (x, y)."""

    station_mm: float
    deviation_mm: float
    tip_mm: tuple[float, float]


@dataclass(frozen=True, slots=True, eq=False)
class PictureContent:
    """Everything that the picture of a profile shows.

    nominal_mm    : (n, 2) samples of the nominal
    outward       : (n, 2) unit normals there, out of the material
    station_mm    : (n,) arc length there
    closed        : the nominal ends where it begins
    length_mm     : its length
    zone          : the tolerance zone
    u_mm          : (k, 2) stations and the expanded uncertainty there, where a budget was stated; (0, 2) without one
    magnification : how many times as large deviations are drawn on the profile
    shown         : the points of each of `LOOKS`
    worst         : None where nothing was judged
    unmeasured    : stretches without points, from station to station, each longer than what counts as measured
    regions       : the named regions of its characteristics
    places_mm     : (p, 2) places that values of characteristics were found at
    heading, basis, foot : what stands above the picture, above the strip, and small at the foot
    """

    nominal_mm: Array
    outward: Array
    station_mm: Array
    closed: bool
    length_mm: float
    zone: ToleranceZone
    u_mm: Array
    magnification: float
    shown: tuple[Shown, ...]
    worst: Worst | None
    unmeasured: tuple[tuple[float, float], ...]
    regions: tuple[NamedRegion, ...]
    places_mm: Array
    heading: str
    basis: str
    foot: str


def content_of(
    scan: JudgedScan,
    nominal: "NominalProfile",
    title: str,
    ending: str = "complete",
    said: str = "",
    regions: tuple[NamedRegion, ...] = (),
    places_mm: Sequence[tuple[float, float]] = (),
    say: Speech | None = None,
) -> PictureContent:
    """What the picture of a judged scan shows.

    ending : how the run ended
    said   : what stands small at the foot, like which run it was and when it was measured
    """
    say = say or Speech()
    factor, closed, length_mm = magnification(scan.zone, nominal), nominal.curve.closed, nominal.length_mm
    telling = telling_rows(scan.station_mm, scan.deviation_mm, length_mm, _MOST_POINTS // 2)  # the others lie hidden
    return PictureContent(
        nominal.points_mm,
        nominal.outward * nominal.normal,
        nominal.station_mm,
        closed,
        length_mm,
        scan.zone,
        scan.u_mm,
        factor,
        _shown(scan, telling, factor),
        _worst(scan, factor),
        tuple(unmeasured_stretches(scan.station_mm, length_mm, closed, scan.gap_max_mm)),
        regions,
        np.array(places_mm, dtype=np.float64).reshape(-1, 2),
        headline_on_picture(scan, title, ending),
        _basis(scan, say),
        said,
    )


def _basis(scan: JudgedScan, say: Speech) -> str:
    told = say(
        "coverage {share}   fit {fit}   method {method}   out of tolerance {points}",
        share=say.number(scan.coverage, ".1%"),
        fit=say.sentence(scan.fit),
        method=say.sentence(scan.method),
        points=scan.out_of_tolerance,
    )
    shaded = "; " + say("shaded around the limits: the U of each station") if len(scan.u_mm) else ""
    return f"{told}\n{say.sentence(scan.zone.decision_rule)}{shaded}"


def headline_on_picture(scan: JudgedScan, title: str, ending: str) -> str:
    """What stands above the picture: the part, and the verdict or how early the run ended."""
    return heading_of(title, headline_of(scan.verdict, ending, scan.coverage).words)


def magnification(zone: ToleranceZone, nominal: "NominalProfile") -> float:
    """A round factor (1, 2 or 5 times a power of ten) that draws the tolerance band about 6 % of the part wide."""
    width = zone.upper_mm - zone.lower_mm
    wanted = _BAND_SHARE * float(np.hypot(*np.ptp(nominal.points_mm, axis=0))) / width
    power = 10.0 ** np.floor(np.log10(wanted))
    return float(max(step * power for step in (1, 2, 5) if step * power <= wanted))


def _shown(scan: JudgedScan, telling: Rows, factor: float) -> tuple[Shown, ...]:
    strip, drawn, middle = scan.rows_at(telling), scan.rows_at(_rows_to_draw(scan, telling)), scan.zone.middle_mm
    tips = drawn.foot_mm + factor * (drawn.actual_mm - drawn.foot_mm)
    looks = [(_has_look(drawn, look, middle), _has_look(strip, look, middle)) for look in LOOKS]
    return tuple(
        Shown(drawn.foot_mm[whiskers], tips[whiskers], strip.station_mm[points], strip.deviation_mm[points]) for whiskers, points in looks
    )


def _rows_to_draw(scan: JudgedScan, telling: Rows) -> Rows:
    """Rows (k,) of the points to draw: thinned, but with every point out of tolerance and the worst one."""
    kept = telling[:: max(1, len(telling) // _MOST_WHISKERS)]
    out = telling[scan.verdicts[telling] == Verdict.NONCONFORM]
    worst = [] if scan.worst is None else [scan.worst]
    return np.unique(np.concatenate([kept, out, worst]).astype(np.int64))


def _has_look(rows: "JudgedRows", look: Look, middle_mm: float) -> NDArray[np.bool_]:
    """Which of the rows (m,) are drawn so: those of a verdict, above or below the middle of the zone."""
    of_verdict = np.equal(rows.verdicts, look.verdict)
    above = np.greater(rows.deviation_mm, middle_mm)
    if look.side == "both":
        return of_verdict
    return of_verdict & above if look.side == "above" else of_verdict & ~above


def _worst(scan: JudgedScan, factor: float) -> Worst | None:
    if scan.worst is None:
        return None
    row = scan.rows_at(np.array([scan.worst]))
    x, y = row.foot_mm[0] + factor * (row.actual_mm[0] - row.foot_mm[0])
    return Worst(float(row.station_mm[0]), float(row.deviation_mm[0]), (float(x), float(y)))
