"""What an inspection found: one row for every received point, and what they say about the profile as a whole."""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from inspection.conclusion import Reason
from inspection.gaps import Gap, gap_lengths
from inspection.kernels import layout
from inspection.methods import Method
from inspection.nominal import NominalProfile
from inspection.registration import Registration
from inspection.tolerance import ToleranceZone, Verdict

Array = NDArray[np.float64]

NOT_JUDGED = layout.NOT_JUDGED  # in place of a verdict where a point was rejected, or is not judged yet


class Rejection(IntEnum):
    """Why a received point was not judged."""

    NONE = layout.NOT_REJECTED
    NOT_FINITE = layout.NOT_FINITE
    OFF_SECTION = layout.OFF_SECTION
    BEYOND_END = layout.BEYOND_END
    OUTLIER = layout.OUTLIER
    IN_HOLLOW = layout.IN_HOLLOW

    @property
    def words(self) -> str:
        """The reason as results spell it."""
        return self.name.lower().replace("_", " ")


@dataclass(frozen=True, slots=True)
class Stretch:
    """A contiguous part of the profile out of tolerance; `from_mm` is above `to_mm` where it crosses the seam."""

    from_mm: float
    to_mm: float
    worst_mm: float


@dataclass(frozen=True, slots=True, eq=False)
class JudgedRows:
    """A row for every received point, in the order of arrival; those of rejected points are NaN, their verdict NOT_JUDGED.

    actual_mm    : (m, 2) actual surface points in nominal coordinates (ball centres are already compensated)
    foot_mm      : (m, 2) the nominal points they are compared with
    station_mm   : (m,) arc length of the foot points
    deviation_mm : (m,) positive out of material
    verdicts     : (m,) codes of `Verdict`
    rejection    : (m,) codes of `Rejection`
    """

    actual_mm: Array
    foot_mm: Array
    station_mm: Array
    deviation_mm: Array
    verdicts: NDArray[np.int8]
    rejection: NDArray[np.int8]

    def __post_init__(self) -> None:
        pairs, columns = (self.actual_mm, self.foot_mm), (self.station_mm, self.deviation_mm, self.verdicts, self.rejection)
        m = len(self.verdicts)
        if any(array.shape != (m, 2) for array in pairs) or any(array.shape != (m,) for array in columns):
            raise ValueError(f"expected ({m}, 2) twice and ({m},), got {[array.shape for array in (*pairs, *columns)]}")
        for array in (*pairs, *columns):
            array.setflags(write=False)

    @property
    def received(self) -> int:
        """Points received; always judged + rejected."""
        return len(self.verdicts)


@dataclass(frozen=True, slots=True, eq=False)
class InspectionResult(JudgedRows):
    """The judged profile: its rows, and what they say as a whole.

    verdict      : on the part
    reasons      : why it is that verdict, the most important first; none where the part conforms
    coverage     : share of the nominal's length that was measured
    gap          : the longest stretch without a judged point
    gap_max_mm   : the longest gap that counted as measured
    complete     : the scan came to its end
    rule         : what decided: "minimum-zone", "best-fit", or "datum" where the pose was known
    fit          : the fit at whose pose the deviations are given
    weights      : how points counted in the best fit
    best_fit_error_mm : 2 * max |deviation - middle of the zone| at the best fit; NaN where there was none
    minimum_zone_mm   : width of the minimum zone about the middle of the tolerance zone; NaN where it was not needed
    """

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

    @property
    def judged(self) -> int:
        """Points with a verdict."""
        return int(np.count_nonzero(self.verdicts != NOT_JUDGED))

    @property
    def rejected(self) -> int:
        """Points without a verdict."""
        return self.received - self.judged

    @property
    def rejected_by_reason(self) -> dict[str, int]:
        """Number of points for each reason that occurred."""
        return rejections_by_reason(self.rejection)

    @property
    def out_of_tolerance(self) -> int:
        """Points whose verdict is nonconform."""
        return int(np.count_nonzero(self.verdicts == Verdict.NONCONFORM))

    @property
    def worst(self) -> int | None:
        """Index of the point farthest from the middle of the zone, None when nothing was judged."""
        if not self.judged:
            return None
        return int(np.nanargmax(np.abs(self.deviation_mm - self.zone.middle_mm)))

    @property
    def rms_mm(self) -> float:
        """Root mean square deviation of the judged points; NaN when there are none."""
        return float(np.sqrt(np.nanmean(self.deviation_mm**2))) if self.judged else float("nan")

    @property
    def max_deviation_mm(self) -> float:
        """Largest deviation; NaN when nothing was judged."""
        return float(np.nanmax(self.deviation_mm)) if self.judged else float("nan")

    @property
    def min_deviation_mm(self) -> float:
        """Smallest deviation; NaN when nothing was judged."""
        return float(np.nanmin(self.deviation_mm)) if self.judged else float("nan")

    @property
    def profile_error_mm(self) -> float:
        """2 * max |deviation|, not the range; NaN when nothing was judged."""
        return 2 * max(abs(self.max_deviation_mm), abs(self.min_deviation_mm)) if self.judged else float("nan")

    @property
    def zone_error_mm(self) -> float:
        """2 * max |deviation - middle of the zone|: the part is inside the zone where this is at most the zone's width."""
        middle = self.zone.middle_mm
        return 2 * max(self.max_deviation_mm - middle, middle - self.min_deviation_mm) if self.judged else float("nan")


def rejections_by_reason(rejection: NDArray[np.int8]) -> dict[str, int]:
    """Number of points for each reason among the codes of `Rejection` (m,)."""
    counts = np.bincount(rejection, minlength=len(Rejection))
    return {reason.words: int(counts[reason]) for reason in Rejection if reason != Rejection.NONE and counts[reason]}


def stretches(
    station_mm: Array, deviation_mm: Array, verdicts: NDArray[np.int8], zone: ToleranceZone, nominal: NominalProfile, gap_max_mm: float
) -> tuple[Stretch, ...]:
    """Contiguous stretches out of tolerance, in station order, from the stations, deviations and verdicts (j,) of judged points.

    A point within the tolerance or a gap ends a stretch; a stretch that crosses the seam is not cut there.
    """
    order = np.argsort(station_mm, kind="stable")
    out = verdicts[order] == Verdict.NONCONFORM
    if not out.any():
        return ()
    closed = nominal.curve.closed
    gaps = gap_lengths(station_mm[order], nominal)
    joined = (gaps if closed else gaps[1:]) <= gap_max_mm  # each with the next; the last of a closed profile with the first
    starts = np.flatnonzero(out & ~np.concatenate([[False], out[:-1] & joined[: len(out) - 1]]))
    ends = np.flatnonzero(out & ~np.concatenate([out[1:] & joined[: len(out) - 1], [False]]))
    runs = [order[first : last + 1] for first, last in zip(starts, ends, strict=True)]
    if closed and len(runs) > 1 and out[0] and out[-1] and joined[-1]:
        runs = [np.concatenate([runs[-1], runs[0]]), *runs[1:-1]]
    return tuple(_stretch(run, station_mm, deviation_mm, zone) for run in runs)


def _stretch(run: NDArray[np.int64], station_mm: Array, deviation_mm: Array, zone: ToleranceZone) -> Stretch:
    """The stretch that a run of points makes, given by their indices in station order."""
    worst = run[np.argmax(np.abs(deviation_mm[run] - zone.middle_mm))]
    return Stretch(float(station_mm[run[0]]), float(station_mm[run[-1]]), float(deviation_mm[worst]))
