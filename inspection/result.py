"""What an inspection found: one row for every received point, and what they say about the profile as a whole.

A result keeps 18 bytes a point; where points and feet lie is worked out anew for whoever asks, so that an hour's scan can be held.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inspection.characteristics.characteristic import CharacteristicResult
from inspection.cloud import ROWS_AT_ONCE, row_blocks
from inspection.conclusion import Findings, Reason
from inspection.gaps import Gap
from inspection.judged_rows import JudgedRows
from inspection.kernels import Room
from inspection.methods import Method
from inspection.nominal import NominalProfile
from inspection.profile_uncertainty import ProfileUncertainty
from inspection.registration import Registration
from inspection.station_order import in_station_order
from inspection.tolerance import ToleranceZone
from inspection.verdict import Verdict

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Stretch:
    """A contiguous part of the profile out of tolerance; `from_mm` is above `to_mm` where it crosses the seam."""

    from_mm: float
    to_mm: float
    worst_mm: float


@dataclass(frozen=True, slots=True, eq=False)
class InspectionResult:
    """The judged profile: its rows, and what they say as a whole.

    station_mm   : (m,) arc length of the foot points, in the order of arrival; NaN where a point was rejected
    deviation_mm : (m,) positive out of material; NaN likewise
    verdicts     : (m,) codes of `Verdict`, NOT_JUDGED for rejected points
    rejection    : (m,) codes of `Rejection`
    rows_at      : gives whole rows by a slice or by indices (k,): also where surface points and feet lie, which is worked out anew
    judged       : points with a verdict
    out_of_tolerance   : points whose verdict is nonconform
    rejected_by_reason : number of points for each reason that occurred
    worst        : index of the point farthest from the middle of the zone, None when nothing was judged
    rms_mm       : root mean square deviation of the judged points; NaN when there are none
    max_deviation_mm, min_deviation_mm : largest and smallest deviation; NaN when nothing was judged
    verdict      : on the part: the worst of its characteristics
    reasons      : why it is that verdict, the most important first; none where the part conforms
    findings     : what the verdict on the whole profile rests on
    characteristics : what was found of each, in the order in which they were asked for; the profile alone where none were
    section_at   : gives where points were measured (k, 2), in section coordinates, by a slice or by indices (k,)
    coverage     : share of the nominal's length that was measured
    gap          : the longest stretch without a judged point
    gap_max_mm   : the longest gap that counted as measured
    complete     : the scan came to its end
    rule         : what decided: "minimum-zone", "best-fit", or "datum" where the pose was known
    fit          : the fit at whose pose the deviations are given
    weights      : how points counted in the best fit
    best_fit_error_mm : 2 * max |deviation - middle of the zone| at the best fit; NaN where there was none
    minimum_zone_mm   : width of the minimum zone about the middle of the tolerance zone; NaN where it was not needed
    uncertainty       : of the deviations along the profile, None where no budget was stated; the U of `zone` is nowhere smaller
    largest_by_noise_mm : how much the stated noise raises the largest |deviation| on average
    numbers           : what was found as well, without a part in the verdict, for what stands on several runs
    """

    station_mm: Array
    deviation_mm: Array
    verdicts: NDArray[np.int8]
    rejection: NDArray[np.int8]
    rows_at: Callable[[slice | NDArray[np.int64]], JudgedRows]
    judged: int
    out_of_tolerance: int
    rejected_by_reason: Mapping[str, int]
    worst: int | None
    rms_mm: float
    max_deviation_mm: float
    min_deviation_mm: float
    verdict: Verdict
    reasons: tuple[Reason, ...]
    coverage: float
    gap: Gap
    gap_max_mm: float
    complete: bool
    zone: ToleranceZone
    registration: Registration
    rule: str
    fit: str
    weights: str
    best_fit_error_mm: float
    minimum_zone_mm: float
    method: Method
    stretches: tuple[Stretch, ...]
    findings: Findings
    section_at: Callable[[slice | NDArray[np.int64]], Array]
    uncertainty: ProfileUncertainty | None = None
    largest_by_noise_mm: float = 0.0
    characteristics: tuple[CharacteristicResult, ...] = ()
    numbers: tuple[CharacteristicResult, ...] = ()

    def __post_init__(self) -> None:
        for array in (self.station_mm, self.deviation_mm, self.verdicts, self.rejection):
            array.setflags(write=False)

    def __repr__(self) -> str:
        extent = f", {self.min_deviation_mm:+.4f} .. {self.max_deviation_mm:+.4f} mm" if self.judged else ""
        return (
            f"<InspectionResult {self.verdict.word}, {self.judged} of {self.received} points judged{extent}, covered {self.coverage:.1%}>"
        )

    @property
    def received(self) -> int:
        """Points received; always judged + rejected."""
        return len(self.verdicts)

    @property
    def rejected(self) -> int:
        """Points without a verdict."""
        return self.received - self.judged

    def blocks(self, at_once: int = ROWS_AT_ONCE) -> Iterator[JudgedRows]:
        """All rows, piece by piece: what a long scan should be read by."""
        for rows in row_blocks(self.received, at_once):
            yield self.rows_at(rows)

    @property
    def worst_row(self) -> JudgedRows | None:
        """The row of the point farthest from the middle of the zone, with its places."""
        return None if self.worst is None else self.rows_at(np.array([self.worst]))

    @property
    def actual_mm(self) -> Array:
        """Actual surface points (m, 2) in nominal coordinates, NaN for rejected ones; worked out anew, and 16 bytes a point."""
        return np.concatenate([np.empty((0, 2)), *(rows.actual_mm for rows in self.blocks())])

    @property
    def foot_mm(self) -> Array:
        """The nominal points (m, 2) that they are compared with; likewise."""
        return np.concatenate([np.empty((0, 2)), *(rows.foot_mm for rows in self.blocks())])

    @property
    def profile_error_mm(self) -> float:
        """2 * max |deviation|, not the range; NaN when nothing was judged."""
        return 2 * max(abs(self.max_deviation_mm), abs(self.min_deviation_mm)) if self.judged else float("nan")

    @property
    def zone_error_mm(self) -> float:
        """2 * max |deviation - middle of the zone|: the part is inside the zone where this is at most the zone's width."""
        middle = self.zone.middle_mm
        return 2 * max(self.max_deviation_mm - middle, middle - self.min_deviation_mm) if self.judged else float("nan")


@dataclass(frozen=True, slots=True)
class Extent:
    """How far deviations go: see the fields of `InspectionResult`."""

    worst: int | None
    rms_mm: float
    max_deviation_mm: float
    min_deviation_mm: float


def extent_of(deviation_mm: Array, middle_mm: float, room: Room = np.empty) -> Extent:
    """How far deviations (m,) go, seen from the middle of the zone; NaN where a point was not judged."""
    squares = room((len(deviation_mm),), np.float64)  # one after the other, for their sum depends on its order
    count, worst, off, low, high = 0, None, -1.0, np.inf, -np.inf
    for rows in row_blocks(len(deviation_mm)):
        deviation = deviation_mm[rows]
        known = ~np.isnan(deviation)
        squares[rows] = np.where(known, deviation, 0.0) ** 2
        count += int(np.count_nonzero(known))
        away = np.where(known, np.abs(deviation - middle_mm), -1.0)
        at = int(away.argmax())
        if away[at] > off:
            worst, off = rows.start + at, float(away[at])
        low, high = float(np.fmin.reduce(deviation, initial=low)), float(np.fmax.reduce(deviation, initial=high))
    if worst is None:
        return Extent(None, float("nan"), float("nan"), float("nan"))
    return Extent(worst, float(np.sqrt(squares.sum() / count)), high, low)


def stretches(
    station_mm: Array,
    deviation_mm: Array,
    verdicts: NDArray[np.int8],
    zone: ToleranceZone,
    nominal: NominalProfile,
    gap_max_mm: float,
    room: Room = np.empty,
) -> tuple[Stretch, ...]:
    """Contiguous stretches out of tolerance, in station order, from stations, deviations and verdicts (m,), NaN where a point was rejected.

    A point within the tolerance or a gap ends a stretch; a stretch that crosses the seam is not cut there.
    """
    found: list[Stretch] = []
    first = last = None  # whether the first and the last point in station order are out
    place, low = np.nan, np.nan
    for rows in in_station_order(station_mm, room):
        station, deviation, out = station_mm[rows], deviation_mm[rows], verdicts[rows] == Verdict.NONCONFORM
        if first is None:
            first, low = bool(out[0]), float(station[0])
        joined = np.diff(station, prepend=place) <= gap_max_mm  # each with the one before
        goes_on = out & joined & np.concatenate([[bool(last)], out[:-1]])
        starts = np.flatnonzero(out & ~goes_on)
        if goes_on[0]:
            starts = np.concatenate([[0], starts])
        ends = np.flatnonzero(out & ~np.concatenate([goes_on[1:], [False]]))
        for start, end in zip(starts.tolist(), ends.tolist(), strict=True):
            run = slice(start, end + 1)
            worst = int(np.argmax(np.abs(deviation[run] - zone.middle_mm)))
            one = Stretch(float(station[start]), float(station[end]), float(deviation[run][worst]))
            found.append(_joined(found.pop(), one, zone) if start == 0 and goes_on[0] else one)
        last, place = bool(out[-1]), float(station[-1])
    over_the_seam = nominal.curve.closed and (low + nominal.length_mm) - place <= gap_max_mm
    if over_the_seam and len(found) > 1 and first and last:
        found = [_joined(found[-1], found[0], zone), *found[1:-1]]
    return tuple(found)


def _joined(one: Stretch, other: Stretch, zone: ToleranceZone) -> Stretch:
    """The stretch that two make that follow one another."""
    farther = abs(other.worst_mm - zone.middle_mm) > abs(one.worst_mm - zone.middle_mm)
    return Stretch(one.from_mm, other.to_mm, other.worst_mm if farther else one.worst_mm)
