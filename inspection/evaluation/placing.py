"""The pose at which a characteristic of the profile is judged: that of the run, the datum, or one of its own fits.

Every fit begins at the datum, or at the pose of the run where there is none: a region alone could lie in many places, and what it is
is known. What is said of every placement is said of the points of the region on the whole nominal.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from inspection.certificate import certify_minimum_zone
from inspection.characteristics.characteristic import LineProfile
from inspection.conclusion import Reason
from inspection.consumption import fit_least_consumption
from inspection.consumption_proof import certify_consumption
from inspection.datum import DatumFeatures, FoundDatum
from inspection.errors import InspectionError
from inspection.evaluation.basis import Basis
from inspection.evaluation.datum import datum_of
from inspection.freedoms import Freedoms
from inspection.limited_fit import register_within
from inspection.minimum_zone import MinimumZone, fit_minimum_zone
from inspection.registration import Registration
from inspection.rigid import RigidTransform
from inspection.zone_certificate import ConsumptionCertificate, ConsumptionFit, ZoneCertificate
from inspection.zones import VaryingZone

Array = NDArray[np.float64]
Rows = NDArray[np.int64]

_GAP_SHARE = 1e-3  # of the zone's width: by so much the proof of a minimum zone may fall short of it, and by 0.01 um at least
_GAP_SHARE_REGION = 1e-2  # of a region, which fits nearly as well in many other places of the profile
_GAP_MM = 1e-5
_GAP_CONSUMPTION = 0.02  # of the zone, for the proof of a least consumption
_MOST_BOXES = 50_000  # of a proof, before it is given up: the printed zones need a third of them
_MOST_BOXES_CONSUMPTION = 8_000  # each costs more, and where the zone is far wider than the part needs they are very many
_FEWEST_POINTS = 4  # of a fit: one more than there are freedoms


@dataclass(frozen=True, slots=True, eq=False)
class Placed:
    """Where a characteristic is judged.

    pose        : nominal from section
    fit         : how it was found, in words, with what was locked or limited
    is_known    : no fit could have put the part elsewhere: the pose is the datum, or was given
    is_free     : the fit could make every motion
    converged   : the fit settled
    certificate : of a minimum zone or a least consumption over every placement; its rows are those of the run
    datum       : the features that the part was placed by, where these were measured
    begin       : where the freedoms of the fit count from, where these are locked or limited; `begin_known` whether that is the datum
    doubt       : why the pose decides nothing, where it does not: the datum that was asked for was not found, or too few points for a fit
    """

    pose: RigidTransform
    fit: str
    is_known: bool = False
    is_free: bool = False
    converged: bool = True
    certificate: ZoneCertificate | ConsumptionCertificate | None = None
    datum: FoundDatum | None = None
    begin: RigidTransform | None = None
    begin_known: bool = False
    doubt: Reason | None = None


def place(asked: LineProfile, basis: Basis, every: Rows, rows: Rows) -> Placed:
    """Find the pose of a characteristic from all rows of its region, and from those (k,) of them that tell how far they go."""
    if asked.features is not None:
        return _place_by(asked.features, basis)
    if asked.fit == "none":
        return Placed(basis.pose, "none", is_known=basis.terms.known_pose is not None)
    start = basis.pose if asked.datum is None else asked.datum
    start_known = asked.datum is not None or basis.terms.known_pose is not None
    if asked.fit == "datum":
        return Placed(start, "datum", is_known=start_known)
    if len(rows) < _FEWEST_POINTS:
        return Placed(start, "none", doubt=_too_few(len(rows)))
    drawn = basis.drawn(every)
    freedoms = asked.freedoms or _all_free(basis.result.section_at(drawn), start)
    best = register_within(
        basis.result.section_at(drawn),
        basis.nominal,
        start,
        freedoms,
        basis.terms.method,
        basis.terms.tip_radius_mm,
        target_mm=middle_of(asked.zone, basis, drawn),
        weights=basis.terms.weights,
        shares=basis.shares(drawn) if asked.region is not None else None,
    )
    points = basis.result.section_at(rows)
    free = asked.freedoms is None
    placed = Placed(start, _words(asked), is_free=free, begin=None if free else start, begin_known=start_known)
    if asked.fit == "best-fit":
        registration = best.registration
        pose = registration.nominal_from_section.snap_to_grid()
        return replace(placed, pose=pose, is_known=start_known and not free, converged=registration.converged)
    if asked.fit == "tolerance":
        least = consume_least(asked, basis, points, best.registration.nominal_from_section, None if free else start)
        proof = _certify_consumption(asked, basis, points, least, rows) if free else None
        fit = least if proof is None else proof.fit
        return replace(placed, pose=fit.nominal_from_section.snap_to_grid(), converged=fit.converged, certificate=proof)
    if not free:
        zone = shrink_zone(asked, basis, points, start)
        return replace(placed, pose=zone.nominal_from_section.snap_to_grid(), converged=zone.converged)
    gap_mm = float(asked.zone.upper_mm[0] - asked.zone.lower_mm[0]) * (_GAP_SHARE if asked.region is None else _GAP_SHARE_REGION)
    certificate = _certify(basis, points, best.registration, middle_of(asked.zone, basis, rows), gap_mm)
    settled = certificate.balanced or certificate.proven  # points all on the nominal balance nothing, and no zone is smaller
    pose = certificate.nominal_from_section.snap_to_grid()
    return replace(placed, pose=pose, converged=settled, certificate=_in_run(certificate, rows))


def _too_few(points: int) -> Reason | None:
    """Why so few points place nothing; None without a point, of which another reason tells."""
    few = f"{points} point{'s are' if points > 1 else ' is'} too few for a fit; measure this region more densely."
    return Reason("fit", few) if points else None


def _place_by(features: DatumFeatures, basis: Basis) -> Placed:
    """The pose of a datum that is measured; where there is none that of the run, at which nothing is decided."""
    words = f"datum: {features.words}"
    try:
        datum = datum_of(features, basis)
    except InspectionError as error:
        return Placed(basis.pose, words, doubt=Reason("datum", str(error)))
    return Placed(datum.pose, words, datum=datum)


def place_so_far(asked: LineProfile, basis: Basis, rows: Rows) -> Placed:
    """The same while the scan still runs: nothing is proven of other placements, so that it takes milliseconds."""
    if asked.fit in ("none", "datum", "best-fit") or len(rows) < _FEWEST_POINTS:
        return place(asked, basis, rows, rows)
    near, points = place(replace(asked, fit="best-fit"), basis, rows, rows).pose, basis.result.section_at(rows)
    limited_from = None if asked.freedoms is None else asked.datum or basis.pose
    if asked.fit == "tolerance":
        pose = consume_least(asked, basis, points, near, limited_from).nominal_from_section
    else:
        pose = shrink_zone(asked, basis, points, limited_from or near).nominal_from_section
    return Placed(pose.snap_to_grid(), _words(asked), is_free=asked.freedoms is None)


def middle_of(zone: VaryingZone, basis: Basis, rows: Rows) -> float:
    """The deviation that a best fit aims at: the middle of the zone, of one that varies its mean over the points of the region."""
    if is_constant(zone):
        return float(zone.lower_mm[0] + zone.upper_mm[0]) / 2
    lower, upper, _, _ = zone.limits(np.unique(basis.result.station_mm[rows]))
    return float(np.mean((lower + upper) / 2))


def is_constant(zone: VaryingZone) -> bool:
    """Whether a zone has the same limits everywhere."""
    return bool(np.ptp(zone.lower_mm) == 0 and np.ptp(zone.upper_mm) == 0)


def consume_least(
    asked: LineProfile, basis: Basis, points: Array, start: RigidTransform, limited_from: RigidTransform | None = None
) -> ConsumptionFit:
    """The pose near a start that consumes least of the zone; where freedoms are limited they count from another."""
    begin, freedoms = (start, None) if limited_from is None else (limited_from, asked.freedoms)
    terms = basis.terms
    return fit_least_consumption(points, basis.nominal, asked.zone, begin, terms.method, terms.tip_radius_mm, freedoms=freedoms)


def shrink_zone(asked: LineProfile, basis: Basis, points: Array, start: RigidTransform) -> MinimumZone:
    """The pose near a start with the smallest zone, within the freedoms."""
    terms, middle = basis.terms, float(asked.zone.lower_mm[0] + asked.zone.upper_mm[0]) / 2
    return fit_minimum_zone(points, basis.nominal, start, terms.method, terms.tip_radius_mm, middle, freedoms=asked.freedoms)


def certify_run(basis: Basis) -> ZoneCertificate | None:
    """The certificate of the minimum zone of a run's points, begun at its pose; None where it judged none."""
    rows, zone = basis.few(basis.rows(None)), basis.terms.zone
    if len(rows) < _FEWEST_POINTS:
        return None
    points = basis.result.section_at(rows)
    gap_mm = _GAP_SHARE * (zone.upper_mm - zone.lower_mm)
    return _in_run(_certify(basis, points, basis.result.registration, zone.middle_mm, gap_mm), rows)


def _certify(basis: Basis, points: Array, start: Registration, middle_mm: float, gap_mm: float) -> ZoneCertificate:
    """The minimum zone of points (k, 2) near a start, and what is proven of every other placement."""
    return certify_minimum_zone(points, basis.nominal, start, basis.terms.tip_radius_mm, middle_mm, max(gap_mm, _GAP_MM), _MOST_BOXES)


def _certify_consumption(asked: LineProfile, basis: Basis, points: Array, least: ConsumptionFit, rows: Rows) -> ConsumptionCertificate:
    """The least consumption of points (k, 2) near a fit, and what is proven of every other placement; its rows are those of the run."""
    tip = basis.terms.tip_radius_mm
    proof = certify_consumption(points, basis.nominal, asked.zone, least, tip, gap=_GAP_CONSUMPTION, most_boxes=_MOST_BOXES_CONSUMPTION)
    order = np.argsort(rows[proof.fit.active])
    active, station = rows[proof.fit.active][order], proof.fit.active_station_mm[order]
    fit = replace(proof.fit, active=active, active_station_mm=station, multipliers=proof.fit.multipliers[order])
    return replace(proof, fit=fit, active_place_mm=proof.active_place_mm[order], witnesses=rows[proof.witnesses])


def _in_run(certificate: ZoneCertificate, rows: Rows) -> ZoneCertificate:
    """A certificate whose points have the numbers of their rows in the run, and stand in the order of these."""
    order = np.argsort(rows[certificate.active])
    held = ("active_place_mm", "active_deviation_mm", "active_station_mm", "multipliers")
    sorted_ = {name: getattr(certificate, name)[order] for name in held}
    return replace(certificate, active=rows[certificate.active][order], witnesses=rows[certificate.witnesses], **sorted_)


def _all_free(points: Array, start: RigidTransform) -> Freedoms:
    """Every motion, about the middle of the points."""
    return Freedoms.about(start.apply(points).mean(axis=0))


def _words(asked: LineProfile) -> str:
    """How a pose was fitted, with what was locked or limited."""
    if asked.freedoms is None:
        return asked.fit
    free = asked.freedoms
    each = []
    for name, low, high in zip(free.names, free.lower.tolist(), free.upper.tolist(), strict=True):
        unit, turn = ("deg", float(np.degrees(1.0))) if name == "rotation" else ("mm", 1.0)
        each.append(name if np.isinf(low) and np.isinf(high) else f"{name} {low * turn:g} .. {high * turn:g} {unit}")
    pivot = free.pivot_mm.tolist()
    return f"{asked.fit}, free: {', '.join(each) or 'none'} about ({pivot[0]:g}, {pivot[1]:g}) mm"
