"""What the points of a surface are held against, and how: everything that is told before the first point."""

from dataclasses import dataclass, replace
from typing import Literal, get_args

from inspection.conclusion import Limits
from inspection.errors import InspectionError
from inspection.surface.feet import NominalSurface
from inspection.surface.nominal_places import finest_gap_mm
from inspection.surface.rigid_motion import RigidMotion
from inspection.surface.surface_fit import SurfaceFreedom
from inspection.tolerance import ToleranceZone

SurfaceFitName = Literal["best-fit", "none"]

_GAP = 0.04  # of the size: the widest place without points that counts as measured where nobody says otherwise: two cells of 2 %
_CIRCLE = 0.01  # of the zone's width: how wide a circle may be in which a fit goes round; wider than that it has not settled
_OFF_SURFACE = 0.02  # of the size: a point farther off is dust, a fixture, or what is not nominal


@dataclass(frozen=True, slots=True, eq=False)
class SurfaceTerms:
    """The terms on which a scan of a surface is judged. Raises ValueError for terms that cannot be.

    zone            : the deviations allowed, with the U of the measuring device alone; the error of the nominal is added to it
    fit             : "best-fit" (least squares about the middle of the zone), or "none" (the points lie where `start` puts them)
    start           : the pose to begin with; None seeks it, or takes the points where they are if none is to be fitted
    locked          : shifts and turns, in the coordinates of the nominal, that stay as they are in `start`; all six make it a datum
    coverage_min    : share of the nominal's area below which conformity is not proven
    gap_max_mm      : the widest place without points (its diameter) that counts as measured, and that conformity allows, whatever
                      coverage is asked for; None for a twenty-fifth of the nominal's size
    gross_mm        : a point farther off the surface is rejected: dust or a fixture; None for a fiftieth of the nominal's size
    reject_outliers : leave out of the fit, and reject, what deviates more than six times the median and more than half the zone
    edge_allowance_mm : how far a point may lie beyond the border of an open surface; None for half the zone's width
    allow_unseen_mm : the widest place that may be unseen although points are known to be missing; None allows none
    """

    zone: ToleranceZone
    fit: SurfaceFitName = "best-fit"
    start: RigidMotion | None = None
    locked: tuple[SurfaceFreedom, ...] = ()
    coverage_min: float = 0.0
    gap_max_mm: float | None = None
    gross_mm: float | None = None
    reject_outliers: bool = False
    edge_allowance_mm: float | None = None
    allow_unseen_mm: float | None = None

    def __post_init__(self) -> None:
        if self.fit not in get_args(SurfaceFitName):
            raise ValueError(f"fit must be one of {', '.join(get_args(SurfaceFitName))}, not {self.fit!r}")
        unknown = set(self.locked) - set(get_args(SurfaceFreedom))
        if unknown:
            raise ValueError(f"a freedom must be one of {', '.join(get_args(SurfaceFreedom))}, not {', '.join(sorted(unknown))}")
        if self.locked and self.start is None:
            raise ValueError("freedoms can only be locked at a start")
        if not 0 <= self.coverage_min <= 1:
            raise ValueError(f"coverage_min must lie between 0 and 1, not {self.coverage_min:g}")
        for name in ("gap_max_mm", "gross_mm"):
            value = getattr(self, name)
            if value is not None and not value > 0:
                raise ValueError(f"{name} must be more than zero, not {value:g}")
        for name in ("edge_allowance_mm", "allow_unseen_mm"):
            value = getattr(self, name)
            if value is not None and not value >= 0:
                raise ValueError(f"{name} must be zero or more, not {value:g}")

    @property
    def known_pose(self) -> RigidMotion | None:
        """Where the points lie if that is known beforehand, snapped to a grid as every pose that is judged at; None where it is fitted."""
        if self.fit != "none" and set(self.locked) != set(get_args(SurfaceFreedom)):
            return None
        return (self.start or RigidMotion.identity()).snap_to_grid()

    @property
    def width_mm(self) -> float:
        """The width of the zone."""
        return self.zone.upper_mm - self.zone.lower_mm

    @property
    def circle_mm(self) -> float:
        """How wide a circle may be in which a fit goes round for it to count as settled. What it is wide is added to U."""
        return _CIRCLE * self.width_mm

    def zone_on(self, nominal: NominalSurface, settles_within_mm: float = 0.0) -> ToleranceZone:
        """The zone with the error of the nominal, and what the fit settles within, in its U, as results state it.

        Both count even where by its rule U itself does not.
        """
        error = nominal.nominal_error_mm + settles_within_mm
        if not error:
            return self.zone
        if self.zone.rule == "simple":
            return replace(self.zone, uncertainty_mm=error, rule="iso-14253-1", provable=False)
        return replace(self.zone, uncertainty_mm=self.zone.uncertainty_mm + error, provable=False)

    def limits_on(self, nominal: NominalSurface) -> Limits:
        """What may be missing before conformity is not proven any more. Raises InspectionError where such a gap cannot be told."""
        finest = finest_gap_mm(nominal)
        if self.gap_max_mm is not None and self.gap_max_mm < finest:
            raise InspectionError(
                f"gap_max_mm is {self.gap_max_mm:g}: on a surface of {nominal.area_mm2:.4g} mm2 no gap below {finest:.2g} mm can be told. "
                "Allow a wider one"
            )
        gap = self.gap_max_mm if self.gap_max_mm is not None else max(_GAP * nominal.size_mm, self.allow_unseen_mm or 0.0)
        edge = self.width_mm / 2 if self.edge_allowance_mm is None else self.edge_allowance_mm
        return Limits(self.coverage_min, gap, edge, self.allow_unseen_mm)

    def farthest_on(self, nominal: NominalSurface) -> float:
        """How far off the surface, in mm, a point may lie before it is taken for something else; never less than the zone reaches."""
        reach = max(abs(self.zone.lower_mm), abs(self.zone.upper_mm)) + self.width_mm
        return self.gross_mm if self.gross_mm is not None else max(_OFF_SURFACE * nominal.size_mm, reach)
