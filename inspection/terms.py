"""What the points of a scan are held against, and how: everything that an inspection is told before the first point."""

from dataclasses import dataclass, field
from typing import Literal, get_args

from inspection.deviations import check_method, check_tip_radius
from inspection.kernels import Judgement
from inspection.methods import Method
from inspection.nominal import NominalProfile
from inspection.rigid import RigidTransform
from inspection.tolerance import ToleranceZone

FitName = Literal["best-fit", "minimum-zone", "none"]


@dataclass(frozen=True, slots=True, eq=False)
class Terms:
    """The terms of one inspection. Raises ValueError for terms that cannot be.

    nominal, zone      : what the points are held against
    datum              : pose known beforehand, or None
    fit                : how the pose is found where there is no datum; "none" takes the points where they are
    method             : projection that gives the deviations
    tip_radius_mm      : points are centres of a ball of this radius
    off_section_max_mm : points farther from the plane of the section are rejected; infinite for no limit
    coverage_min       : share of the nominal's length below which conformity is not proven
    reject_outliers    : leave gross outliers out of the fit, and reject them
    judgement          : what of this turns a foot into a verdict, as the compiled loops take it
    """

    nominal: NominalProfile
    zone: ToleranceZone
    datum: RigidTransform | None
    fit: FitName
    method: Method
    tip_radius_mm: float
    off_section_max_mm: float
    coverage_min: float
    reject_outliers: bool
    judgement: Judgement = field(init=False)

    def __post_init__(self) -> None:
        check_tip_radius(self.tip_radius_mm, self.nominal)
        if self.fit not in get_args(FitName):
            raise ValueError(f"fit must be one of {', '.join(get_args(FitName))}, not {self.fit!r}")
        check_method(self.method)
        zone = self.zone
        limits = (float(self.tip_radius_mm), float(zone.lower_mm), float(zone.upper_mm), float(zone.uncertainty_mm))
        object.__setattr__(self, "judgement", (self.nominal.outward, *limits))

    @property
    def known_pose(self) -> RigidTransform | None:
        """Where the points lie if that is known beforehand: by the datum, or because none is to be fitted."""
        return RigidTransform.identity() if self.datum is None and self.fit == "none" else self.datum
