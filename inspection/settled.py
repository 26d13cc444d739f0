"""The end of a scan: all points registered together, every one judged at the settled pose, and the verdict on the part.

Nothing of this copies the scan: it is gone through piece by piece, its rows are judged where they lie, and what a fit needs besides is
given back before the rows are judged.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from inspection.bands import EvenBand
from inspection.cloud import MANY, Cloud, few_of, row_blocks
from inspection.conclusion import Findings, Missing, Reason, conclude, word_points
from inspection.fine import register
from inspection.gaps import measure
from inspection.minimum_zone import fit_minimum_zone
from inspection.placements import PlacementSearch
from inspection.profile_uncertainty import uncertainty_at_fit
from inspection.registration import Registration, datum_registration
from inspection.result import InspectionResult, extent_of, stretches
from inspection.rigid import RigidTransform
from inspection.scan_rows import ScanRows
from inspection.setup_check import check_fit, check_points
from inspection.shift_words import shift_reservation
from inspection.telling_points import telling_rows
from inspection.terms import Terms
from inspection.uncertainty import largest_by_noise_mm
from inspection.verdict import NOT_JUDGED, Rejection, Verdict

Array = NDArray[np.float64]

_PLACED = 0.95  # share of the length whose points place the part, where the plan asks for no coverage
_MOST_BOXES = 200_000  # of placements, before the search for one that passes is given up
_FEWER = 1 << 14  # points of which the uncertainty after a fit is asked; fewer leave the pose less certain, never more
_SHARES = 8192  # of the length, of which the lowest and the highest point tell, where a scan has more than MANY points
_SAME_MM = 1e-9  # two zones that differ by less are the same
_NEAR, _CLASSES = 8.0, 512  # noises below the largest deviation within which others may be largest by chance, and classes of them
_ROUNDS = 6  # in which points that are out at a placement found by the telling ones join these


@dataclass(frozen=True, slots=True, eq=False)
class _Settled:
    """A pose at which the rows were judged, how it was found, and what they are there.

    points, why       : the verdict on the judged points alone, NONCONFORM only where proven, and its reason
    zone_error_mm     : 2 * max |deviation - middle of the zone| over the judged rows; NaN without any
    best_fit_error_mm : the same at the best fit; minimum_zone_mm : width of the minimum zone; NaN where there was none
    """

    registration: Registration
    fit: str
    points: Verdict
    why: Reason | None
    zone_error_mm: float
    best_fit_error_mm: float = float("nan")
    minimum_zone_mm: float = float("nan")


def settle(rows: ScanRows, terms: Terms, complete: bool, missing: Missing) -> InspectionResult:
    """Register all points of a scan together, judge every one at that pose, and conclude. The rows belong to the result afterwards.

    complete : the scan came to its end; conformity of one that was cut short is not proven
    missing  : points that are known to be missing before the inspection saw them

    Raises RegistrationError when the points cannot be brought onto the nominal, NotMeasured when the set-up contradicts them.
    """
    rows.forget_verdicts()
    usable = rows.usable()
    far = check_points(rows, usable, terms)
    points = usable.without(far)
    if terms.known_pose is not None:
        registration = datum_registration(terms.known_pose, len(points))
        check_fit(points, registration, terms)
    else:
        registration = _fit_best(points, terms)
    _reject_outliers(rows, far, registration)
    del usable, points  # and what they hold
    settled = _judge_at(rows, registration, "none", terms) if terms.known_pose is not None else _decide(rows, registration, terms, complete)
    if terms.at_best_fit and terms.uncertainty is not None and rows.judged:
        settled, terms = _judge_as_uncertain_as_fitted(rows, settled, registration, terms, complete)
    _stay_at(rows, settled, terms)
    return _result(rows, settled, terms, complete, missing)


def judge_at(rows: ScanRows, pose: RigidTransform, terms: Terms) -> InspectionResult:
    """The points of a scan that still runs, as they are at the pose of this moment. The rows belong to the result afterwards."""
    registration = datum_registration(pose, rows.count)
    return _result(rows, _judge_at(rows, registration, "best-fit", terms), terms, complete=False, missing=Missing())


def _reject_outliers(rows: ScanRows, far: NDArray[np.bool_], registration: Registration) -> None:
    """Reject the points that lie far from all others, and of the rest those that the registration left out."""
    if not far.any() and not registration.outliers.any():
        return
    at = 0
    for usable, is_far in rows.usable_rows(far):
        near = usable[~is_far]
        rows.reject(np.concatenate([usable[is_far], near[registration.outliers[at : at + len(near)]]]))
        at += len(near)


def _judge_at(rows: ScanRows, registration: Registration, fit: str, terms: Terms) -> _Settled:
    """Judge every row at a pose, and say the verdict of its points."""
    rows.settle(registration.nominal_from_section, terms)
    beyond, within = rows.count_of(Verdict.NONCONFORM), rows.count_of(Verdict.UNCERTAIN)
    worst = next((verdict for verdict in sorted(Verdict, reverse=True) if rows.count_of(verdict)), Verdict.UNCERTAIN)
    return _Settled(registration, fit, worst, word_points(terms.zone, beyond, within), _zone_error_mm(rows, terms))


def _stay_at(rows: ScanRows, settled: _Settled, terms: Terms) -> None:
    """Judge the rows at the pose that decides once more, where they were judged at another one since."""
    if rows.settled_at is not settled.registration.nominal_from_section:
        rows.settle(settled.registration.nominal_from_section, terms)


def _decide(rows: ScanRows, registration: Registration, terms: Terms, complete: bool) -> _Settled:
    """Judge at the fit that was asked for; where points are out there, let the rule decide.

    By the rule "minimum-zone" a part is out only when no placement at all passes. By the rule "best-fit" it is out when it is out at
    every best fit that the points allow: also at the rivals of a symmetric part, and by more than the pose is still free to move.
    """
    if terms.fit == "minimum-zone":
        registration = _fit_smallest(rows, registration, terms)
    settled = _judge_at(rows, _with_pose(registration, registration.nominal_from_section), terms.fit, terms)
    error = settled.zone_error_mm
    settled = replace(settled, best_fit_error_mm=error) if terms.fit == "best-fit" else replace(settled, minimum_zone_mm=error)
    if settled.points != Verdict.NONCONFORM:
        return settled
    if terms.at_best_fit:
        return _doubt_free_pose(rows, settled, terms, complete)
    return _prove_no_placement(rows, settled, terms)


def _prove_no_placement(rows: ScanRows, settled: _Settled, terms: Terms) -> _Settled:
    """Seek a placement of the judged points that passes: first the minimum zone, then every placement there is.

    Of many points the telling ones are asked. What refutes them refutes all; a placement that passes for them is looked at with all,
    and those that are out there join them.
    """
    error_mm, telling = settled.best_fit_error_mm, np.empty(0, dtype=np.int64)
    zone = terms.zone
    half_mm = (zone.upper_mm - zone.lower_mm) / 2 + zone.guard_mm
    for _ in range(_ROUNDS):
        telling = np.union1d(telling, _telling_rows(rows, terms))
        points, all_told = rows.points[telling], len(telling) == rows.judged
        points = points[np.lexsort(points.T)]  # so that the search takes the same way in whatever order they came
        smallest = fit_minimum_zone(points, terms.nominal, settled.registration, terms.method, terms.tip_radius_mm, zone.middle_mm)
        at_zone = _judge_at(rows, _with_pose(settled.registration, smallest.nominal_from_section), "minimum-zone", terms)
        width_mm = smallest.zone_mm if all_told else at_zone.zone_error_mm
        settled = replace(settled, minimum_zone_mm=width_mm)
        if at_zone.points != Verdict.NONCONFORM:
            return replace(at_zone, best_fit_error_mm=error_mm, minimum_zone_mm=width_mm)
        search = PlacementSearch(terms.nominal, EvenBand(half_mm, zone.middle_mm), terms.tip_radius_mm)
        proof = search.look(points, smallest.nominal_from_section, _MOST_BOXES)
        if proof.outcome == "refuted":
            return settled
        if proof.pose is not None:
            passing = _judge_at(rows, _with_pose(settled.registration, proof.pose), "minimum-zone", terms)
            if passing.points != Verdict.NONCONFORM:
                return replace(passing, best_fit_error_mm=error_mm, minimum_zone_mm=passing.zone_error_mm)
        if all_told or proof.pose is None:
            break
    words = "No placement of the part was found that passes, and it was not proven that there is none."
    return replace(settled, points=Verdict.UNCERTAIN, why=Reason("placement", words))


def _telling_rows(rows: ScanRows, terms: Terms) -> NDArray[np.int64]:
    """Rows of the judged points, or of those that tell how far all of them go."""
    if rows.judged <= MANY:
        return np.flatnonzero(rows.verdicts[: rows.count] != NOT_JUDGED)
    return telling_rows(rows.station[: rows.count], rows.deviation[: rows.count], terms.nominal.length_mm, _SHARES)


def _doubt_free_pose(rows: ScanRows, settled: _Settled, terms: Terms, complete: bool) -> _Settled:
    """Doubt a part that is out at the best fit, where another pose fits as well or too little was measured to fix the pose.

    The points that a scan cut short lacks would move the best fit, and a plan that asks for no coverage does not say that little is
    enough to place the part.
    """
    for rival in settled.registration.rivals:
        if _judge_at(rows, _with_pose(settled.registration, rival), terms.fit, terms).points != Verdict.NONCONFORM:
            words = "The part fits the nominal in another pose as well, and there no point is out: only a datum can tell."
            return replace(settled, points=Verdict.UNCERTAIN, why=Reason("placement", words))
    _stay_at(rows, settled, terms)
    covered = measure(rows.station[: rows.count], terms.nominal, terms.limits.gap_max_mm, rows.room).coverage
    if complete and covered >= (terms.coverage_min or _PLACED):
        return settled
    proven = _prove_no_placement(rows, settled, terms)
    if proven.points == Verdict.NONCONFORM:
        return replace(settled, minimum_zone_mm=proven.minimum_zone_mm)
    words = f"Too little of the profile was measured ({covered:.1%}) to place the part: in another placement no point is out."
    return replace(settled, points=Verdict.UNCERTAIN, why=Reason("placement", words), minimum_zone_mm=proven.minimum_zone_mm)


def _judge_as_uncertain_as_fitted(
    rows: ScanRows, settled: _Settled, registration: Registration, terms: Terms, complete: bool
) -> tuple[_Settled, Terms]:
    """Work out how uncertain the deviations are after the best fit, where it alone decides, and judge anew where that is more than U."""
    assert terms.uncertainty is not None
    _stay_at(rows, settled, terms)

    def judged() -> Iterator[Array]:
        return (rows.points[part][rows.verdicts[part] != NOT_JUDGED] for part in row_blocks(rows.count))

    points = settled.registration.nominal_from_section.apply(few_of(judged, rows.judged, _FEWER))
    found = uncertainty_at_fit(points, terms.nominal, terms.uncertainty.stated, terms.tip_radius_mm, terms.weights)
    if found.largest_mm <= terms.zone.uncertainty_mm:
        return settled, replace(terms, uncertainty=found)
    zone = replace(terms.zone, uncertainty_mm=found.largest_mm, provable=False)
    terms = replace(terms, zone=zone, uncertainty=found)
    return _decide(rows, registration, terms, complete), terms


def _with_pose(registration: Registration, pose: RigidTransform) -> Registration:
    """The same registration at another pose, rounded so that a replay on another processor judges at the very same one."""
    return replace(registration, nominal_from_section=pose.snap_to_grid())


def _zone_error_mm(rows: ScanRows, terms: Terms) -> float:
    """2 * max |deviation - middle of the zone| over the judged rows; NaN without any."""
    if not rows.judged:
        return float("nan")
    off = [np.fmax.reduce(np.abs(rows.deviation[part] - terms.target_mm), initial=0.0) for part in row_blocks(rows.count)]
    return 2 * float(max(off))


def _fit_best(points: Cloud, terms: Terms) -> Registration:
    """The best fit of points about the middle of the zone. Raises NotMeasured where they do not fit as the set-up says."""
    zone = terms.zone
    registration = register(
        points,
        terms.nominal,
        tip_radius_mm=terms.tip_radius_mm,
        robust=terms.reject_outliers,
        gross_mm=(zone.upper_mm - zone.lower_mm) / 2,  # nearer points are form, however exact the others are
        target_mm=terms.target_mm,
        weights=terms.weights,
    )
    check_fit(points, registration, terms)
    return registration


def _fit_smallest(rows: ScanRows, registration: Registration, terms: Terms) -> Registration:
    """The minimum zone from a best fit on: of many points that of the telling ones, which those join that are out of it."""
    points, telling = rows.usable(), np.empty(0, dtype=np.int64)
    registration = _with_pose(registration, registration.nominal_from_section)
    settings = (registration, terms.method, terms.tip_radius_mm, terms.zone.middle_mm)
    if len(points) <= MANY:
        smallest = fit_minimum_zone(points.few(), terms.nominal, *settings)
    else:
        rows.settle(registration.nominal_from_section, terms)
        for _ in range(_ROUNDS):
            telling = np.union1d(telling, _telling_rows(rows, terms))
            smallest = fit_minimum_zone(rows.points[telling], terms.nominal, *settings)
            if _judge_at(rows, replace(registration, nominal_from_section=smallest.nominal_from_section), "", terms).zone_error_mm <= (
                smallest.zone_mm + _SAME_MM
            ):
                break
    pose, programs, converged = smallest.nominal_from_section, smallest.programs, smallest.converged
    return replace(registration, nominal_from_section=pose, iterations=programs, converged=converged)


def _result(rows: ScanRows, settled: _Settled, terms: Terms, complete: bool, missing: Missing) -> InspectionResult:
    """What the judged rows say about the profile, and the verdict on the part."""
    nominal, limits, room, every = terms.nominal, terms.limits, rows.room, slice(0, rows.count)
    station, deviation, verdicts = rows.station[every], rows.deviation[every], rows.verdicts[every]
    measured = measure(station, nominal, limits.gap_max_mm, room)
    beyond_mm, beyond_count = _beyond_ends(rows, settled.registration, terms)
    findings = Findings(
        points=settled.points,
        why=settled.why,
        judged=rows.judged,
        rejected={reason: count for reason, count in rows.rejected_by_reason.items() if reason != Rejection.BEYOND_END.words},
        beyond_end_mm=beyond_mm,
        beyond_end_count=beyond_count,
        coverage=measured.coverage,
        gap=measured.gap,
        converged=settled.registration.converged,
    )
    conclusion = conclude(findings, missing, limits, complete)
    reasons = conclusion.reasons
    if conclusion.verdict is Verdict.NONCONFORM and (reservation := shift_reservation(_few_judged(rows), terms.zone, terms.tip_radius_mm)):
        reasons = (*reasons, Reason("shift", reservation))
    extent = extent_of(deviation, terms.zone.middle_mm, room)
    out = rows.count_of(Verdict.NONCONFORM)
    return InspectionResult(
        station_mm=station,
        deviation_mm=deviation,
        verdicts=verdicts,
        rejection=rows.rejection[every],
        rows_at=partial(rows.rows_at, pose=settled.registration.nominal_from_section, terms=terms),
        judged=rows.judged,
        out_of_tolerance=out,
        rejected_by_reason=rows.rejected_by_reason,
        worst=extent.worst,
        rms_mm=extent.rms_mm,
        max_deviation_mm=extent.max_deviation_mm,
        min_deviation_mm=extent.min_deviation_mm,
        verdict=conclusion.verdict,
        reasons=reasons,
        coverage=findings.coverage,
        gap=measured.gap,
        gap_max_mm=limits.gap_max_mm,
        complete=complete,
        zone=terms.zone,
        registration=settled.registration,
        rule="datum" if terms.known_pose is not None else terms.rule,
        fit=settled.fit,
        weights=terms.weights,
        best_fit_error_mm=settled.best_fit_error_mm,
        minimum_zone_mm=settled.minimum_zone_mm,
        method=terms.method,
        uncertainty=terms.uncertainty,
        largest_by_noise_mm=_raised_by_noise_mm(deviation, max(abs(extent.max_deviation_mm), abs(extent.min_deviation_mm)), terms),
        stretches=stretches(station, deviation, verdicts, terms.zone, nominal, limits.gap_max_mm, room) if out else (),
        findings=findings,
        section_at=rows.section_at,
    )


def _raised_by_noise_mm(deviation_mm: Array, farthest_mm: float, terms: Terms) -> float:
    """How much the stated noise raises the largest |deviation| of points (m,) on average: by how many come near to it."""
    noise = terms.uncertainty.stated.budget.repeatability_mm if terms.uncertainty is not None else 0.0
    if not noise or not np.isfinite(farthest_mm):
        return 0.0
    edges, counts = np.linspace(max(farthest_mm - _NEAR * noise, 0.0), farthest_mm, _CLASSES + 1), np.zeros(_CLASSES)
    for part in row_blocks(len(deviation_mm)):
        size = np.abs(deviation_mm[part])
        counts += np.histogram(size[size >= edges[0]], edges)[0]
    counts[-1] -= 1
    return largest_by_noise_mm(np.append((edges[1:] + edges[:-1]) / 2, farthest_mm), noise, np.append(counts, 1.0))


def _few_judged(rows: ScanRows) -> Array:
    """The deviations (k,) of the judged points, or of a choice of them."""

    def judged() -> Iterator[Array]:
        return (rows.deviation[part][rows.verdicts[part] != NOT_JUDGED] for part in row_blocks(rows.count))

    return few_of(judged, rows.judged)


def _beyond_ends(rows: ScanRows, registration: Registration, terms: Terms) -> tuple[float, int]:
    """How far the surface of the part lies off the ends of an open profile, by the points beyond them, and how many lie too far.

    A ball whose centre is nearer to an end than its radius reaches into the nominal there: by so much the part is missing.
    """
    ends = terms.nominal.curve.point(np.array(terms.nominal.curve.domain))
    farthest, count = 0.0, 0
    for part in row_blocks(rows.count):
        beyond = rows.points[part][rows.rejection[part] == Rejection.BEYOND_END]
        away = registration.nominal_from_section.apply(beyond)[:, None, :] - ends
        off = np.abs(np.hypot(away[..., 0], away[..., 1]).min(axis=1) - terms.tip_radius_mm)
        farthest = max(farthest, float(off.max(initial=0.0)))
        count += int(np.count_nonzero(off > terms.limits.end_allowance_mm))
    return farthest, count
