"""The proof of a least consumption over every placement: that no rigid motion brings points into a smaller share of a varying zone.

The fit that consumes least is a local one. Branch and bound over all motions with few points (see `placements`) shows that no
placement consumes less than a bound; stations move with the motions, and with them the limits (see `reach`). A part whose points
consume more than a whole zone, widened by the uncertainty, under every placement is out of tolerance whatever fit is used.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inspection.bands import VaryingBand
from inspection.coarse import check_registrable
from inspection.consumption import ConsumptionFit, fit_least_consumption
from inspection.nominal import NominalProfile
from inspection.placements import PlacementProof, PlacementSearch
from inspection.registration import Registration
from inspection.rigid import RigidTransform
from inspection.signed_deviations import deviations
from inspection.zones import VaryingZone

Array = NDArray[np.float64]
Rows = NDArray[np.int64]

_MOST_FITS = 8  # each from a placement that consumes less than the one before


@dataclass(frozen=True, slots=True, eq=False)
class ConsumptionCertificate:
    """The least consumption of a zone by measured points, and what is proven of it.

    fit              : the pose that consumes least, the points that hold it and their multipliers
    active_place_mm  : (a, 2) where those points were measured, in section coordinates
    bound            : the share of the zone that the proof is of
    proven           : no rigid motion brings the witnesses into that share; False where the search ended before it knew, or where a
                       pose consumes less than what was to be proven
    witnesses        : (w,) indices of the points that the proof needs
    witness_place_mm : (w, 2) where they were measured, in section coordinates
    boxes            : of motions that were looked at
    finest_mm        : the least by which a refuted box moves the point that refutes it
    """

    fit: ConsumptionFit
    active_place_mm: Array
    bound: float
    proven: bool
    witnesses: Rows
    witness_place_mm: Array
    boxes: int
    finest_mm: float

    @property
    def words(self) -> str:
        """The certificate in three lines, as a report prints it."""
        pose = self.fit.nominal_from_section
        x, y = pose.translation_mm.tolist()
        each = zip(self.fit.active.tolist(), self.active_place_mm, self.fit.active_station_mm, self.fit.multipliers, strict=True)
        held = " | ".join(f"{row + 1} ({at[0]:.6f}, {at[1]:.6f}) station {s:.6f} multiplier {share:.6f}" for row, at, s, share in each)
        last = (
            f"proof: no rigid motion brings {len(self.witnesses)} of the measured points into {self.bound:.9f} of the zone; "
            f"{self.boxes:,} boxes of motions looked at, the finest {self.finest_mm:.1e} mm"
            if self.proven
            else f"no proof over every placement that more than {self.bound:.9f} of the zone is consumed ({self.boxes:,} boxes of motions)"
        )
        return (
            f"least consumption {self.fit.consumption:.9f} of the zone, turned {np.degrees(pose.rotation_rad):.9f} deg, "
            f"moved ({x:.9f}, {y:.9f}) mm\nheld by points {held}\n{last}"
        )


def certify_consumption(
    points_mm: ArrayLike,
    nominal: NominalProfile,
    zone: VaryingZone,
    start: Registration | RigidTransform | ConsumptionFit | None = None,
    tip_radius_mm: float = 0.0,
    bound: float | None = None,
    gap: float = 0.002,
    most_boxes: int = 200_000,
    is_over: Callable[[], bool] = lambda: False,
) -> ConsumptionCertificate:
    """The least consumption of section points (m, 2) over every placement, and its proof. Points beyond open ends take no part.

    start      : where the fit begins, or a fit that is to be certified; None begins at the best fit. Where the proof finds a placement
                 that consumes less, the fit begins there again
    bound      : what is to be proven: that every placement consumes more than this share. 1, with a zone widened by the uncertainty,
                 is what a verdict asks. None asks for the least consumption less the gap
    most_boxes : the search of each proof gives up after so many boxes
    is_over    : asked every few milliseconds; once it says so, the certificate is given as it stands, not proven
    """
    if not gap > 0 or (bound is not None and not bound > 0):
        raise ValueError(f"the gap and the bound of a proof must be above zero, not {gap:g} and {bound}")
    points = check_registrable(points_mm)
    fit = start if isinstance(start, ConsumptionFit) else None
    if fit is None:
        begin = None if isinstance(start, ConsumptionFit) else start
        fit = fit_least_consumption(points, nominal, zone, begin, "exact", tip_radius_mm, is_over)
    for _ in range(_MOST_FITS):
        asked = fit.consumption - gap if bound is None else bound
        proof, witnesses = _prove(points, nominal, zone, fit, asked, tip_radius_mm, most_boxes, is_over)
        better = None if proof.pose is None else fit_least_consumption(points, nominal, zone, proof.pose, "exact", tip_radius_mm, is_over)
        if better is None or better.consumption >= fit.consumption:
            break
        fit = better
    place = points[fit.active], points[witnesses]
    return ConsumptionCertificate(fit, place[0], asked, proof.outcome == "refuted", witnesses, place[1], proof.boxes, proof.finest_mm)


def _prove(
    points: Array,
    nominal: NominalProfile,
    zone: VaryingZone,
    fit: ConsumptionFit,
    asked: float,
    tip_radius_mm: float,
    most_boxes: int,
    is_over: Callable[[], bool],
) -> tuple[PlacementProof, Rows]:
    """Search every placement for one that consumes no more than is asked. Gives what was found, and the points (w,) that it took."""
    if fit.consumption <= asked or not len(fit.active):
        return PlacementProof("fits" if len(fit.active) else "undecided", None, (), 0), fit.active
    if asked <= 0:
        return PlacementProof("refuted", None, (), 0), fit.active
    inside = np.flatnonzero(~deviations(fit.nominal_from_section.apply(points), nominal, "exact", tip_radius_mm).beyond_end)
    search = PlacementSearch(nominal, VaryingBand(nominal, zone, asked), tip_radius_mm)
    proof, rows = search.look_with(points[inside], np.searchsorted(inside, np.sort(fit.active)), most_boxes, is_over)
    return proof, inside[rows]
