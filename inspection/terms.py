"""What the points of a scan are held against, and how: everything that an inspection is told before the first point."""

from dataclasses import dataclass, field
from typing import get_args

from inspection.conclusion import Limits
from inspection.gaps import default_gap_max_mm
from inspection.kernels import Judgement
from inspection.methods import FitName, Method, RuleName, WeightName
from inspection.nominal import NominalProfile
from inspection.profile_uncertainty import ProfileUncertainty
from inspection.rigid import RigidTransform
from inspection.signed_deviations import check_method, check_tip_radius
from inspection.tolerance import ToleranceZone


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
    rule               : what decides where there is no datum: "minimum-zone" (a part conforms when any placement passes, ISO 1101),
                         or "best-fit" (when it passes at the best fit)
    weights            : how points count in the best fit
    gap_max_mm         : the longest gap that counts as measured, and that conformity allows, whatever coverage is asked for; None for
                         `default_gap_max_mm`, infinite for no limit
    end_allowance_mm   : how far a point may lie beyond an open end; None for half the zone's width, the circle about the end in which
                         the zone ends
    uncertainty        : of the deviations along the profile where a budget was stated; the zone's own U is its largest
    allow_unseen_mm    : the longest stretch that may be unseen although points are known to be missing; None allows none
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
    rule: RuleName = "minimum-zone"
    weights: WeightName = "arc-length"
    gap_max_mm: float | None = None
    end_allowance_mm: float | None = None
    allow_unseen_mm: float | None = None
    uncertainty: ProfileUncertainty | None = None
    judgement: Judgement = field(init=False)

    def __post_init__(self) -> None:
        check_tip_radius(self.tip_radius_mm, self.nominal)
        if self.fit not in get_args(FitName):
            raise ValueError(f"fit must be one of {', '.join(get_args(FitName))}, not {self.fit!r}")
        check_method(self.method)
        if self.rule not in get_args(RuleName):
            raise ValueError(f"rule must be one of {', '.join(get_args(RuleName))}, not {self.rule!r}")
        if self.weights not in get_args(WeightName):
            raise ValueError(f"weights must be one of {', '.join(get_args(WeightName))}, not {self.weights!r}")
        for name in ("gap_max_mm", "end_allowance_mm", "allow_unseen_mm"):
            value = getattr(self, name)
            if value is not None and not value >= 0:
                raise ValueError(f"{name} must be zero or more, not {value:g}")
        _ = self.nominal.table_for(self.method), self.nominal.grid_for(self.method)  # made now, not when the first points wait for them
        zone = self.zone
        limits = (float(self.tip_radius_mm), float(zone.lower_mm), float(zone.upper_mm), float(zone.guard_mm))
        object.__setattr__(self, "judgement", (self.nominal.outward, *limits))

    @property
    def known_pose(self) -> RigidTransform | None:
        """Where the points lie if that is known beforehand: by the datum, or because none is to be fitted."""
        return RigidTransform.identity() if self.datum is None and self.fit == "none" else self.datum

    @property
    def at_best_fit(self) -> bool:
        """Whether the best fit alone decides, and no other placement of the part counts."""
        return self.known_pose is None and self.rule == "best-fit" and self.fit == "best-fit"

    @property
    def target_mm(self) -> float:
        """The deviation that every fit aims at: the middle of the zone."""
        return self.zone.middle_mm

    @property
    def limits(self) -> Limits:
        """What may be missing before conformity is not proven any more."""
        gap = self.gap_max_mm if self.gap_max_mm is not None else max(default_gap_max_mm(self.nominal), self.allow_unseen_mm or 0.0)
        end = (self.zone.upper_mm - self.zone.lower_mm) / 2 if self.end_allowance_mm is None else self.end_allowance_mm
        return Limits(self.coverage_min, gap, end, self.allow_unseen_mm)
