"""The certificate of a minimum zone: which points hold it, why no small motion makes it smaller, and that no placement at all does.

The multipliers balance the active points: any small motion that lowers one raises another. The proof over every placement is branch
and bound with few points, the active ones first (see `placements`), for a zone smaller by a stated gap. A third party needs those
points, the nominal and a routine for the closest point to check it.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inspection.bands import EvenBand
from inspection.coarse import check_registrable
from inspection.freedoms import gradients
from inspection.minimum_zone import MinimumZone, fit_minimum_zone
from inspection.nominal import NominalProfile
from inspection.placements import PlacementProof, PlacementSearch
from inspection.registration import Registration
from inspection.rigid import RigidTransform
from inspection.signed_deviations import deviations

Array = NDArray[np.float64]
Rows = NDArray[np.int64]

_MOST_FITS = 8  # each from a placement that is better than the one before
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

    @property
    def balanced(self) -> bool:
        """Whether the multipliers prove the zone smallest nearby; they do not where the fit had not converged."""
        return self.imbalance <= _BALANCED

    @property
    def words(self) -> str:
        """The certificate in three lines, as a report prints it."""
        half, turned = self.zone_mm / 2, np.degrees(self.nominal_from_section.rotation_rad)
        x, y = self.nominal_from_section.translation_mm.tolist()
        each = zip(self.active.tolist(), self.active_place_mm, self.active_deviation_mm, self.multipliers, strict=True)
        held = " | ".join(f"{row + 1} ({at[0]:.6f}, {at[1]:.6f}) {e:+.9f} multiplier {share:.6f}" for row, at, e, share in each)
        last = (
            f"proof: no rigid motion brings {len(self.witnesses)} of the measured points within {half - self.gap_mm:.9f} mm of it "
            f"(gap {1e3 * self.gap_mm:g} um); {self.boxes:,} boxes of motions looked at, the finest {self.finest_mm:.1e} mm"
            if self.proven
            else f"no proof over every placement: the search ended after {self.boxes:,} boxes of motions"
        )
        return (
            f"minimum zone {self.zone_mm:.6f} mm (half {half:.9f}) about {self.middle_mm:g} mm, "
            f"turned {turned:.9f} deg, moved ({x:.9f}, {y:.9f}) mm\nheld by points {held}\n{last}"
        )


def certify_minimum_zone(
    points_mm: ArrayLike,
    nominal: NominalProfile,
    start: Registration | RigidTransform | MinimumZone | None = None,
    tip_radius_mm: float = 0.0,
    middle_mm: float = 0.0,
    gap_mm: float = 1e-5,
    most_boxes: int = 400_000,
    is_over: Callable[[], bool] = lambda: False,
) -> ZoneCertificate:
    """The minimum zone of section points (m, 2) over every placement, and its certificate. Points beyond open ends take no part.

    start      : where the fit begins, or a fit that is to be certified; None begins at the best fit. Where the proof finds a placement
                 with a smaller zone, the fit begins there again, so the result depends on no start
    gap_mm     : how much below half the zone the proof is; the search is the longer the smaller it is
    most_boxes : the search of each proof gives up after so many boxes
    is_over    : asked every few milliseconds; once it says so, the certificate is given as it stands, not proven
    """
    if not gap_mm > 0:
        raise ValueError(f"the gap of a proof must be above zero, not {gap_mm:g} mm")
    points = check_registrable(points_mm)
    zone = start if isinstance(start, MinimumZone) else None
    if zone is None:
        begin = None if isinstance(start, MinimumZone) else start
        zone = fit_minimum_zone(points, nominal, begin, "exact", tip_radius_mm, middle_mm, is_over)
    for _ in range(_MOST_FITS):
        proof, witnesses = _prove(points, nominal, zone, tip_radius_mm, gap_mm, most_boxes, is_over)
        if proof.pose is None:
            break
        zone = fit_minimum_zone(points, nominal, proof.pose, "exact", tip_radius_mm, zone.middle_mm, is_over)
    return _certificate(points, nominal, zone, tip_radius_mm, gap_mm, proof, witnesses)


def _prove(
    points: Array,
    nominal: NominalProfile,
    zone: MinimumZone,
    tip_radius_mm: float,
    gap_mm: float,
    most_boxes: int,
    is_over: Callable[[], bool],
) -> tuple[PlacementProof, Rows]:
    """Search every placement for a zone that is smaller by the gap. Gives what was found, and the points (w,) that it took."""
    half = zone.zone_mm / 2 - gap_mm
    if half <= 0 or not len(zone.active):
        return PlacementProof("refuted" if half <= 0 else "undecided", None, (), 0), zone.active
    inside = np.flatnonzero(~deviations(zone.nominal_from_section.apply(points), nominal, "exact", tip_radius_mm).beyond_end)
    search = PlacementSearch(nominal, EvenBand(half, zone.middle_mm), tip_radius_mm)
    proof, rows = search.look_with(points[inside], np.searchsorted(inside, np.sort(zone.active)), most_boxes, is_over)
    return proof, inside[rows]


def _certificate(
    points: Array, nominal: NominalProfile, zone: MinimumZone, tip_radius_mm: float, gap_mm: float, proof: PlacementProof, witnesses: Rows
) -> ZoneCertificate:
    """The certificate of a zone, and of the proof that was found for it."""
    moved = zone.nominal_from_section.apply(points)
    d = deviations(moved[zone.active], nominal, "exact", tip_radius_mm)
    e, arms = d.deviation_mm - zone.middle_mm, moved - moved.mean(axis=0)
    J = gradients(d.normal, arms[zone.active]) / (1.0, 1.0, float(np.hypot(*arms.T).max()))
    imbalance = float(np.linalg.norm((zone.multipliers * np.sign(e)) @ J)) if len(e) else np.inf
    return ZoneCertificate(
        nominal_from_section=zone.nominal_from_section,
        zone_mm=zone.zone_mm,
        middle_mm=zone.middle_mm,
        active=zone.active,
        active_place_mm=points[zone.active],
        active_deviation_mm=e,
        active_station_mm=d.station_mm,
        multipliers=zone.multipliers,
        imbalance=imbalance,
        gap_mm=gap_mm,
        proven=proof.outcome == "refuted",
        witnesses=witnesses,
        witness_place_mm=points[witnesses],
        boxes=proof.boxes,
        finest_mm=proof.finest_mm,
    )
