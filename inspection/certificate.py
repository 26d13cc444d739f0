"""The certificate of a minimum zone: which points hold it, why no small motion makes it smaller, and that no placement at all does.

The multipliers balance the active points: any small motion that lowers one raises another. The proof over every placement is branch
and bound with few points, the active ones first (see `placements`), for a zone smaller by a stated gap. A third party needs those
points, the nominal and a routine for the closest point to check it.
"""

import math
from collections.abc import Callable

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
from inspection.zone_certificate import ZoneCertificate

Array = NDArray[np.float64]
Rows = NDArray[np.int64]

_MOST_FITS = 8  # each from a placement that is better than the one before


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
    left = ((zone.multipliers * np.sign(e))[:, None] * J).sum(axis=0)  # in the order of the points, on every processor
    imbalance = math.hypot(*left.tolist()) if len(e) else np.inf
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
        tip_radius_mm=tip_radius_mm,
    )
