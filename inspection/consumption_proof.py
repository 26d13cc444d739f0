"""The proof of a least consumption over every placement: that no rigid motion brings points into a smaller share of a varying zone.

The fit that consumes least is a local one. Branch and bound over all motions with few points (see `placements`) shows that no
placement consumes less than a bound; stations move with the motions, and with them the limits (see `reach`). A part whose points
consume more than a whole zone, widened by the uncertainty, under every placement is out of tolerance whatever fit is used.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inspection.bands import VaryingBand
from inspection.coarse import check_registrable
from inspection.consumption import fit_least_consumption
from inspection.nominal import NominalProfile
from inspection.placements import PlacementProof, PlacementSearch
from inspection.registration import Registration
from inspection.rigid import RigidTransform
from inspection.signed_deviations import deviations
from inspection.zone_certificate import ConsumptionCertificate, ConsumptionFit
from inspection.zones import VaryingZone

Array = NDArray[np.float64]
Rows = NDArray[np.int64]

_MOST_FITS = 8  # each from a placement that consumes less than the one before


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
    return ConsumptionCertificate(
        fit=fit,
        zone=zone,
        active_place_mm=points[fit.active],
        bound=asked,
        proven=proof.outcome == "refuted",
        witnesses=witnesses,
        witness_place_mm=points[witnesses],
        boxes=proof.boxes,
        finest_mm=proof.finest_mm,
        tip_radius_mm=tip_radius_mm,
    )


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
