"""What proves a minimum zone or a least consumption: the points that hold it, how they balance, and what is known of other placements."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inspection.rigid import RigidTransform
from inspection.zones import VaryingZone

Array = NDArray[np.float64]
Rows = NDArray[np.int64]

_BALANCED = 1e-6  # single gradients have a length near 1


@dataclass(frozen=True, slots=True, eq=False)
class ZoneCertificate:
    """The minimum zone of measured points, and what proves it.

    nominal_from_section : pose of the zone
    zone_mm, middle_mm   : its width, and the deviation in its middle
    active               : (a,) indices of the points that hold it
    active_place_mm      : (a, 2) where they were measured, in section coordinates
    active_deviation_mm  : (a,) at the pose, from the middle: half the zone, with sign
    active_station_mm    : (a,) where they are on the profile
    multipliers          : (a,) positive, with the sum 1
    imbalance            : length of the sum of gradients, weighted by multiplier and sign, a rotation counted in mm at the farthest
                           point; with 0 no small motion makes the zone smaller
    gap_mm               : the proof is of half the zone less this
    proven               : no rigid motion brings the witnesses within half the zone less the gap; False where the search ended
                           before it knew
    witnesses            : (w,) indices of the points that the proof needs, the active ones and those that had to join them
    witness_place_mm     : (w, 2) where they were measured, in section coordinates
    boxes                : of motions that were looked at
    finest_mm            : the least by which a refuted box moves the point that refutes it
    tip_radius_mm        : the points are centres of a ball of this radius
    """

    nominal_from_section: RigidTransform
    zone_mm: float
    middle_mm: float
    active: Rows
    active_place_mm: Array
    active_deviation_mm: Array
    active_station_mm: Array
    multipliers: Array
    imbalance: float
    gap_mm: float
    proven: bool
    witnesses: Rows
    witness_place_mm: Array
    boxes: int
    finest_mm: float
    tip_radius_mm: float

    @property
    def balanced(self) -> bool:
        """Whether the multipliers prove the zone smallest nearby; they do not where the fit had not converged."""
        return self.imbalance <= _BALANCED

    @property
    def words(self) -> str:
        """The certificate in three lines, as a report prints it; points have their index in deviations.csv."""
        half, turned = self.zone_mm / 2, np.degrees(self.nominal_from_section.rotation_rad)
        x, y = self.nominal_from_section.translation_mm.tolist()
        each = zip(self.active.tolist(), self.active_place_mm, self.active_deviation_mm, self.multipliers, strict=True)
        held = " | ".join(f"{row} ({at[0]:.6f}, {at[1]:.6f}) {e:+.9f} multiplier {share:.6f}" for row, at, e, share in each)
        last = (
            f"proof: no rigid motion brings {len(self.witnesses)} of the measured points within {half - self.gap_mm:.9f} mm of "
            f"{'the nominal' if not self.middle_mm else 'the middle of the zone'} "
            f"(gap {1e3 * self.gap_mm:g} um); {self.boxes:,} boxes of motions looked at, the finest {self.finest_mm:.1e} mm"
            if self.proven
            else f"no proof over every placement: the search ended after {self.boxes:,} boxes of motions"
        )
        if self.proven and half <= self.gap_mm:
            last = f"proof: half of it is no wider than the gap of the proof, {1e3 * self.gap_mm:g} um, so that none is smaller by that"
        return (
            f"minimum zone {self.zone_mm:.6f} mm (half {half:.9f}) about {self.middle_mm:g} mm, "
            f"turned {turned:.9f} deg, moved ({x:.9f}, {y:.9f}) mm\nheld by points (index) {held}\n{last}"
        )


@dataclass(frozen=True, slots=True, eq=False)
class ConsumptionFit:
    """The pose that consumes least, and why no other nearby consumes less.

    nominal_from_section : pose of the fit
    consumption          : largest share of the zone consumed; above 1 no pose nearby brings every point into the zone
    active               : (a,) indices of the points that hold it
    active_station_mm    : (a,) where they are on the profile
    multipliers          : (a,) of those points, positive, with the sum 1
    programs             : linear programs solved
    converged            : the last step moved no point by more than 1e-10 mm
    """

    nominal_from_section: RigidTransform
    consumption: float
    active: NDArray[np.int64]
    active_station_mm: Array
    multipliers: Array
    programs: int
    converged: bool


@dataclass(frozen=True, slots=True, eq=False)
class ConsumptionCertificate:
    """The least consumption of a zone by measured points, and what is proven of it.

    fit              : the pose that consumes least, the points that hold it and their multipliers
    zone             : what is consumed
    active_place_mm  : (a, 2) where those points were measured, in section coordinates
    bound            : the share of the zone that the proof is of
    proven           : no rigid motion brings the witnesses into that share; False where the search ended before it knew, or where a
                       pose consumes less than what was to be proven
    witnesses        : (w,) indices of the points that the proof needs
    witness_place_mm : (w, 2) where they were measured, in section coordinates
    boxes            : of motions that were looked at
    finest_mm        : the least by which a refuted box moves the point that refutes it
    tip_radius_mm    : the points are centres of a ball of this radius
    """

    fit: ConsumptionFit
    zone: VaryingZone
    active_place_mm: Array
    bound: float
    proven: bool
    witnesses: Rows
    witness_place_mm: Array
    boxes: int
    finest_mm: float
    tip_radius_mm: float

    @property
    def words(self) -> str:
        """The certificate in three lines, as a report prints it; points have their index in deviations.csv."""
        pose = self.fit.nominal_from_section
        x, y = pose.translation_mm.tolist()
        each = zip(self.fit.active.tolist(), self.active_place_mm, self.fit.active_station_mm, self.fit.multipliers, strict=True)
        held = " | ".join(f"{row} ({at[0]:.6f}, {at[1]:.6f}) station {s:.6f} multiplier {share:.6f}" for row, at, s, share in each)
        last = (
            f"proof: no rigid motion brings {len(self.witnesses)} of the measured points into {self.bound:.9f} of the zone; "
            f"{self.boxes:,} boxes of motions looked at, the finest {self.finest_mm:.1e} mm"
            if self.proven
            else f"no proof over every placement that more than {self.bound:.9f} of the zone is consumed ({self.boxes:,} boxes of motions)"
        )
        return (
            f"least consumption {self.fit.consumption:.9f} of the zone, turned {np.degrees(pose.rotation_rad):.9f} deg, "
            f"moved ({x:.9f}, {y:.9f}) mm\nheld by points (index) {held}\n{last}"
        )
