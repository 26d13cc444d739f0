"""What was found of a whole surface: a row for every received point, and what they say together."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from inspection.conclusion import Reason
from inspection.surface.feet import SurfaceFeet
from inspection.surface.rigid_motion import RigidMotion
from inspection.surface.surface_fit import SurfaceRegistration
from inspection.tolerance import ToleranceZone
from inspection.verdict import Verdict

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Defect:
    """A part of the surface that hangs together and is out of tolerance.

    area_mm2    : of the nominal that its points stand for
    worst_mm    : the deviation farthest from the middle of the zone
    worst_at_mm : the place (x, y, z) on the nominal where it is
    centre_mm   : the place (x, y, z) of a foot of its points that is nearest to the middle of them
    face        : number of the face, from 0, on which the worst place lies
    points      : how many points lie out of tolerance there
    """

    area_mm2: float
    worst_mm: float
    worst_at_mm: tuple[float, float, float]
    centre_mm: tuple[float, float, float]
    face: int
    points: int


@dataclass(frozen=True, slots=True)
class Unmeasured:
    """A part of the surface that hangs together and was not measured.

    area_mm2  : its area
    centre_mm : the place (x, y, z) on the nominal that is farthest from what was measured
    face      : number of the face, from 0, on which that place lies
    width_mm  : the diameter of the widest place without points in it
    """

    area_mm2: float
    centre_mm: tuple[float, float, float]
    face: int
    width_mm: float


@dataclass(frozen=True, slots=True, eq=False)
class SurfaceResult:
    """The judged surface: its rows, in the order of arrival, and what they say as a whole.

    verdict, reasons : on the part, and why it is that verdict, the most important first; none where the part conforms
    notes        : what was assumed, in sentences
    points_mm    : (m, 3) as scanned
    feet         : where they lie on the nominal, at the final pose, in its coordinates
    verdicts     : (m,) codes of `Verdict`, NOT_JUDGED for rejected points
    rejection    : (m,) codes of `Rejection`
    judged       : points with a verdict
    out_of_tolerance   : points whose verdict is nonconform
    rejected_by_reason : number of points for each reason that occurred
    worst        : index of the judged point farthest from the middle of the zone, None when nothing was judged
    rms_mm       : root mean square deviation of the judged points; NaN when there are none
    max_deviation_mm, min_deviation_mm : largest and smallest deviation; NaN when nothing was judged
    beyond_edge_mm : how far the farthest of the points beyond the border of an open surface lies off it; 0 where there is none
    regions      : parts of the surface out of tolerance, the largest excess first
    coverage     : share of the area that was measured
    area_mm2     : of the whole nominal
    unmeasured   : parts of the surface that were not measured, the largest first
    gap_mm       : the diameter of the widest place without points; gap_max_mm : up to which it counted as measured
    zone         : with the error of the nominal, and what the fit settles within, in its U
    nominal_error_mm : bound of how far the nominal may lie off what it stands for
    registration : how the pose was fitted; None where it was known
    nominal_from_scan : the pose at which every point was judged
    rule         : what decided: "best-fit", or "datum" where the pose was known
    fit          : "best-fit" or "none"
    complete     : the scan came to its end
    """

    verdict: Verdict
    reasons: tuple[Reason, ...]
    notes: tuple[str, ...]
    points_mm: Array
    feet: SurfaceFeet
    verdicts: NDArray[np.int8]
    rejection: NDArray[np.int8]
    judged: int
    out_of_tolerance: int
    rejected_by_reason: Mapping[str, int]
    worst: int | None
    rms_mm: float
    max_deviation_mm: float
    min_deviation_mm: float
    beyond_edge_mm: float
    regions: tuple[Defect, ...]
    coverage: float
    area_mm2: float
    unmeasured: tuple[Unmeasured, ...]
    gap_mm: float
    gap_max_mm: float
    zone: ToleranceZone
    nominal_error_mm: float
    registration: SurfaceRegistration | None
    nominal_from_scan: RigidMotion
    rule: str
    fit: str
    complete: bool

    def __post_init__(self) -> None:
        m = len(self.verdicts)
        if self.points_mm.shape != (m, 3) or len(self.feet) != m or self.rejection.shape != (m,):
            raise ValueError(f"expected {m} rows, got {self.points_mm.shape}, {len(self.feet)} and {self.rejection.shape}")
        arrays: tuple[NDArray[Any], ...] = (self.points_mm, self.verdicts, self.rejection)
        for array in arrays:
            array.setflags(write=False)

    def __repr__(self) -> str:
        extent = f", {self.min_deviation_mm:+.4f} .. {self.max_deviation_mm:+.4f} mm" if self.judged else ""
        return f"<SurfaceResult {self.verdict.word}, {self.judged} of {self.received} points judged{extent}, covered {self.coverage:.1%}>"

    @property
    def received(self) -> int:
        """Points received; always judged + rejected."""
        return len(self.verdicts)

    @property
    def rejected(self) -> int:
        """Points without a verdict."""
        return self.received - self.judged

    @property
    def profile_error_mm(self) -> float:
        """2 * max |deviation|, not the range; NaN when nothing was judged."""
        return 2 * max(abs(self.max_deviation_mm), abs(self.min_deviation_mm)) if self.judged else float("nan")

    @property
    def zone_error_mm(self) -> float:
        """2 * max |deviation - middle of the zone|: the part is inside the zone where this is at most the zone's width."""
        middle = self.zone.middle_mm
        return 2 * max(self.max_deviation_mm - middle, middle - self.min_deviation_mm) if self.judged else float("nan")
