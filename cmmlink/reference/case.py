"""What a case of the reference set is: a nominal, measured points, how they are to be judged, and what is true of them.

Lengths of a case are in its unit, mm or inch, unless the name of a field says mm. Numbers have 15 digits, those of the files.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Rows = NDArray[np.int64]
CaseKind = Literal["deviation", "best-fit", "minimum-zone", "consumption", "filter", "section", "placement", "disturbed"]
CaseUnit = Literal["mm", "inch"]
KnownVerdict = Literal["conform", "nonconform", "uncertain"]
MM_PER_UNIT: Mapping[CaseUnit, float] = {"mm": 1.0, "inch": 25.4}


def _freeze(*arrays: Array | Rows | None) -> None:
    for array in arrays:
        if array is not None:
            array.setflags(write=False)


@dataclass(frozen=True, slots=True, eq=False)
class ReferenceNominal:
    """The nominal curve as its files hold it.

    knots          : (k + degree + 1,) clamped
    control_points : (k, 2)
    weights        : (k,); None where all are 1
    material       : the side of the material, seen along the curve
    """

    degree: int
    knots: Array
    control_points: Array
    weights: Array | None
    closed: bool
    material: Literal["left", "right"]

    def __post_init__(self) -> None:
        count = len(self.control_points)
        if self.control_points.shape != (count, 2) or self.knots.shape != (count + self.degree + 1,):
            raise ValueError(f"{count} control points of degree {self.degree} do not go with {len(self.knots)} knots")
        _freeze(self.knots, self.control_points, self.weights)


@dataclass(frozen=True, slots=True)
class KnownPose:
    """The motion from the measured points to the nominal: a rotation about the origin, counterclockwise, then a translation."""

    rotation_deg: float
    translation: tuple[float, float]


@dataclass(frozen=True, slots=True)
class KnownWorst:
    """The point with the largest |deviation|: its row from 0, where it lies at the known pose, and its deviation."""

    row: int
    x: float
    y: float
    deviation: float


@dataclass(frozen=True, slots=True, eq=False)
class KnownHold:
    """An optimum over all placements, and what proves it: no small motion lowers the points that hold it all at once.

    value       : width of the minimum zone, 2 * max |deviation - middle|, or the least share of the tolerance zone that is consumed
    held_by     : (a,) rows of the points that hold it; none where more than four do
    multipliers : (a,) positive, with the sum 1: the gradients, weighted by them and by the signs of the deviations, cancel
    """

    value: float
    held_by: Rows
    multipliers: Array

    def __post_init__(self) -> None:
        _freeze(self.held_by, self.multipliers)


@dataclass(frozen=True, slots=True, eq=False)
class KnownFilter:
    """Deviations behind a filter along the arc length.

    name, cutoff : the filter, and the wavelength of which half the amplitude passes
    deviation    : (m,) of the points, behind it
    """

    name: str
    cutoff: float
    deviation: Array

    def __post_init__(self) -> None:
        _freeze(self.deviation)


@dataclass(frozen=True, slots=True)
class KnownValue:
    """A number of the section: the value of the characteristic of the plan that has this name."""

    name: str
    unit: Literal["mm", "inch", "deg"]
    value: float


@dataclass(frozen=True, slots=True, eq=False)
class Truth:
    """What is true of the written points against the written nominal. What a case is not about is None or empty.

    pose        : from the points to the nominal: the known one, that of the best fit or of the minimum zone; None also where any
                  rotation is as good, as of a circle
    equal_poses : those that are as good because the nominal is symmetric
    deviation   : (m,) at the pose, positive out of material; of a ball centre less the radius of the ball. NaN for an outlier
    worst       : the point that deviates most; None where several do by construction
    rms         : of the deviations at the pose
    zone        : the minimum zone
    consumption : the least consumption of the tolerance zone
    filtered    : the deviations behind filters
    values      : numbers of the section
    outliers    : (k,) rows that are no points of the part
    verdict     : what the plan of the case must say
    """

    verdict: KnownVerdict
    pose: KnownPose | None = None
    equal_poses: tuple[KnownPose, ...] = ()
    deviation: Array | None = None
    worst: KnownWorst | None = None
    rms: float | None = None
    zone: KnownHold | None = None
    consumption: KnownHold | None = None
    filtered: tuple[KnownFilter, ...] = ()
    values: tuple[KnownValue, ...] = ()
    outliers: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        _freeze(self.deviation)


@dataclass(frozen=True, slots=True, eq=False)
class ReferenceCase:
    """One case.

    name       : of its folder
    kind       : what it is about
    about      : that in a sentence or two
    points     : (m, 2) as measured, in the unit of the case
    tip_radius : above 0 the points are centres of a ball of this radius
    limits_mm  : the lowest and the highest deviation allowed
    settings   : what the plan says beside part, nominal, device, probe and tolerance
    """

    name: str
    kind: CaseKind
    about: str
    unit: CaseUnit
    nominal: ReferenceNominal
    points: Array
    tip_radius: float
    limits_mm: tuple[float, float]
    settings: Mapping[str, Any]
    truth: Truth

    def __post_init__(self) -> None:
        m = len(self.points)
        for given in (self.truth.deviation, *(each.deviation for each in self.truth.filtered)):
            if self.points.shape != (m, 2) or (given is not None and given.shape != (m,)):
                raise ValueError(f"{self.name}: expected points ({m}, 2) and as many deviations")
        _freeze(self.points)

    @property
    def mm_per_unit(self) -> float:
        """How many mm the unit is."""
        return MM_PER_UNIT[self.unit]
