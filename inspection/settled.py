"""The end of a scan: all points registered together, every one judged at the settled pose, and the verdict on the part."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from inspection.conclusion import Findings, Missing, Reason, conclude, word_points
from inspection.fine import register
from inspection.gaps import coverage, largest_gap
from inspection.minimum_zone import fit_minimum_zone
from inspection.placements import PlacementSearch
from inspection.registration import Registration, datum_registration
from inspection.result import NOT_JUDGED, InspectionResult, Rejection, rejections_by_reason, stretches
from inspection.rigid import RigidTransform
from inspection.scan_rows import ScanRows
from inspection.setup_check import check_fit, check_points, shift_reservation
from inspection.terms import Terms
from inspection.tolerance import Verdict

Array = NDArray[np.float64]

_PLACED = 0.95  # share of the length whose points place the part, where the plan asks for no coverage
_MOST_BOXES = 200_000  # of placements, before the search for one that passes is given up


@dataclass(frozen=True, slots=True, eq=False)
class _Settled:
    """The rows judged at the pose that decides, and how that pose was found.

    points, why       : the verdict on the judged points alone, NONCONFORM only where proven, and its reason
    best_fit_error_mm : zone error at the best fit; minimum_zone_mm : width of the minimum zone; NaN where there was none
    """

    rows: ScanRows
    registration: Registration
    fit: str
    points: Verdict
    why: Reason | None
    best_fit_error_mm: float = float("nan")
    minimum_zone_mm: float = float("nan")


def settle(rows: ScanRows, terms: Terms, complete: bool, missing: Missing) -> InspectionResult:
    """Register all points of a scan together, judge every one at that pose, and conclude; the rows stay as they are.

    complete : the scan came to its end; conformity of one that was cut short is not proven
    missing  : points that are known to be missing before the inspection saw them

    Raises RegistrationError when the points cannot be brought onto the nominal, NotMeasured when the set-up contradicts them.
    """
    rows = rows.without(check_points(rows, terms))
    usable = rows.usable_rows()
    if terms.known_pose is not None:
        registration = datum_registration(terms.known_pose, len(usable))
        check_fit(rows.points[usable], registration, terms)
        settled = _judge_at(rows, registration, usable, "none", terms)
    else:
        settled = _decide(rows, _register_points(rows.points[usable], terms), usable, terms, complete)
    return _result(settled, terms, complete, missing)


def _judge_at(rows: ScanRows, registration: Registration, usable: NDArray[np.int64], fit: str, terms: Terms) -> _Settled:
    """Every row judged at a pose, and the verdict of its points."""
    judged = rows.copy()
    judged.rejection[usable[registration.outliers]] = Rejection.OUTLIER
    judged.judge(0, judged.count, registration.nominal_from_section, terms)
    verdicts = judged.verdicts[judged.verdicts != NOT_JUDGED]
    beyond, within = int(np.count_nonzero(verdicts == Verdict.NONCONFORM)), int(np.count_nonzero(verdicts == Verdict.UNCERTAIN))
    points = Verdict(int(verdicts.max())) if len(verdicts) else Verdict.UNCERTAIN
    return _Settled(judged, registration, fit, points, word_points(terms.zone, beyond, within))


def _decide(rows: ScanRows, registration: Registration, usable: NDArray[np.int64], terms: Terms, complete: bool) -> _Settled:
    """Judge at the fit that was asked for; where points are out there, let the rule decide.

    By the rule "minimum-zone" a part is out only when no placement at all passes. By the rule "best-fit" it is out when it is out at
    every best fit that the points allow: also at the rivals of a symmetric part, and by more than the pose is still free to move.
    """
    settled = _judge_at(rows, registration, usable, terms.fit, terms)
    error = _zone_error_mm(settled.rows, terms)
    settled = replace(settled, best_fit_error_mm=error) if terms.fit == "best-fit" else replace(settled, minimum_zone_mm=error)
    if settled.points != Verdict.NONCONFORM:
        return settled
    if terms.rule == "best-fit" and terms.fit == "best-fit":
        return _doubt_free_pose(rows, settled, usable, terms, complete)
    return _prove_no_placement(rows, settled, usable, terms)


def _prove_no_placement(rows: ScanRows, settled: _Settled, usable: NDArray[np.int64], terms: Terms) -> _Settled:
    """Seek a placement of the judged points that passes: first the minimum zone, then every placement there is."""
    points = rows.points[np.flatnonzero(settled.rows.verdicts != NOT_JUDGED)]
    zone = terms.zone
    smallest = fit_minimum_zone(points, terms.nominal, settled.registration, terms.method, terms.tip_radius_mm, zone.middle_mm)
    at_zone = _judge_at(rows, _with_pose(settled.registration, smallest.nominal_from_section), usable, "minimum-zone", terms)
    settled = replace(settled, minimum_zone_mm=smallest.zone_mm)
    if at_zone.points != Verdict.NONCONFORM:
        return replace(at_zone, best_fit_error_mm=settled.best_fit_error_mm, minimum_zone_mm=smallest.zone_mm)
    half = (zone.upper_mm - zone.lower_mm) / 2 + zone.uncertainty_mm
    proof = PlacementSearch(terms.nominal, half, zone.middle_mm, terms.tip_radius_mm).look(
        points, smallest.nominal_from_section, _MOST_BOXES
    )
    if proof.outcome == "refuted":
        return settled
    if proof.pose is not None:
        passing = _judge_at(rows, _with_pose(settled.registration, proof.pose), usable, "minimum-zone", terms)
        if passing.points != Verdict.NONCONFORM:
            return replace(passing, best_fit_error_mm=settled.best_fit_error_mm, minimum_zone_mm=_zone_error_mm(passing.rows, terms))
    words = "No placement of the part was found that passes, and it was not proven that there is none."
    return replace(settled, points=Verdict.UNCERTAIN, why=Reason("placement", words))


def _doubt_free_pose(rows: ScanRows, settled: _Settled, usable: NDArray[np.int64], terms: Terms, complete: bool) -> _Settled:
    """Doubt a part that is out at the best fit, where another pose fits as well or too little was measured to fix the pose.

    The points that a scan cut short lacks would move the best fit, and a plan that asks for no coverage does not say that little is
    enough to place the part.
    """
    for rival in settled.registration.rivals:
        if _judge_at(rows, _with_pose(settled.registration, rival), usable, terms.fit, terms).points != Verdict.NONCONFORM:
            words = "The part fits the nominal in another pose as well, and there no point is out: only a datum can tell."
            return replace(settled, points=Verdict.UNCERTAIN, why=Reason("placement", words))
    judged = settled.rows.verdicts != NOT_JUDGED
    covered = coverage(settled.rows.station[judged], terms.nominal, terms.limits.gap_max_mm)
    if complete and covered >= (terms.coverage_min or _PLACED):
        return settled
    proven = _prove_no_placement(rows, settled, usable, terms)
    if proven.points == Verdict.NONCONFORM:
        return replace(settled, minimum_zone_mm=proven.minimum_zone_mm)
    words = f"Too little of the profile was measured ({covered:.1%}) to place the part: in another placement no point is out."
    return replace(settled, points=Verdict.UNCERTAIN, why=Reason("placement", words), minimum_zone_mm=proven.minimum_zone_mm)


def _with_pose(registration: Registration, pose: RigidTransform) -> Registration:
    """The same registration at another pose, rounded so that a replay on another processor judges at the very same one."""
    return replace(registration, nominal_from_section=pose.snap_to_grid())


def _zone_error_mm(rows: ScanRows, terms: Terms) -> float:
    """2 * max |deviation - middle of the zone| over the judged rows; NaN without any."""
    judged = rows.verdicts != NOT_JUDGED
    return 2 * float(np.abs(rows.deviation[judged] - terms.target_mm).max()) if judged.any() else float("nan")


def _register_points(points_mm: Array, terms: Terms) -> Registration:
    """The pose of points (m, 2) by the fit that the terms name, about the middle of the zone."""
    nominal, zone, tip_radius_mm = terms.nominal, terms.zone, terms.tip_radius_mm
    gross_mm = (zone.upper_mm - zone.lower_mm) / 2  # nearer points are form, however exact the others are
    registration = register(
        points_mm,
        nominal,
        tip_radius_mm=tip_radius_mm,
        robust=terms.reject_outliers,
        gross_mm=gross_mm,
        target_mm=terms.target_mm,
        weights=terms.weights,
    )
    check_fit(points_mm, registration, terms)
    if terms.fit == "minimum-zone":
        kept = points_mm[~registration.outliers]
        smallest = fit_minimum_zone(kept, nominal, registration, terms.method, tip_radius_mm, zone.middle_mm)
        pose, programs, converged = smallest.nominal_from_section, smallest.programs, smallest.converged
        registration = replace(registration, nominal_from_section=pose, iterations=programs, converged=converged)
    return _with_pose(registration, registration.nominal_from_section)


def _result(settled: _Settled, terms: Terms, complete: bool, missing: Missing) -> InspectionResult:
    """What the judged rows say about the profile, and the verdict on the part."""
    rows, nominal, limits = settled.rows, terms.nominal, terms.limits
    judged = rows.verdicts != NOT_JUDGED
    station, deviation, verdicts = rows.station[judged], rows.deviation[judged], rows.verdicts[judged]
    gap = largest_gap(station, nominal)
    beyond = _beyond_ends_mm(settled, terms)
    findings = Findings(
        points=settled.points,
        why=settled.why,
        judged=len(station),
        rejected={reason: count for reason, count in rejections_by_reason(rows.rejection).items() if reason != Rejection.BEYOND_END.words},
        beyond_end_mm=float(beyond.max(initial=0.0)),
        beyond_end_count=int(np.count_nonzero(beyond > limits.end_allowance_mm)),
        coverage=coverage(station, nominal, limits.gap_max_mm),
        gap=gap,
        converged=settled.registration.converged,
    )
    conclusion = conclude(findings, missing, limits, complete)
    reasons = conclusion.reasons
    if conclusion.verdict is Verdict.NONCONFORM and (reservation := shift_reservation(deviation, terms)):
        reasons = (*reasons, Reason("shift", reservation))
    known = terms.known_pose is not None
    return InspectionResult(
        actual_mm=rows.actual,
        foot_mm=rows.foot,
        station_mm=rows.station,
        deviation_mm=rows.deviation,
        verdicts=rows.verdicts,
        rejection=rows.rejection,
        verdict=conclusion.verdict,
        reasons=reasons,
        coverage=findings.coverage,
        gap=gap,
        gap_max_mm=limits.gap_max_mm,
        complete=complete,
        zone=terms.zone,
        registration=settled.registration,
        rule="datum" if known else terms.rule,
        fit=settled.fit,
        weights=terms.weights,
        best_fit_error_mm=settled.best_fit_error_mm,
        minimum_zone_mm=settled.minimum_zone_mm,
        method=terms.method,
        stretches=stretches(station, deviation, verdicts, terms.zone, nominal, limits.gap_max_mm),
    )


def _beyond_ends_mm(settled: _Settled, terms: Terms) -> Array:
    """How far (k,) the surface of the part lies beyond the ends of an open profile, for the points that were rejected for it."""
    rows = settled.rows
    beyond = rows.points[np.flatnonzero(rows.rejection == Rejection.BEYOND_END)]
    if not len(beyond):
        return np.empty(0)
    ends = terms.nominal.curve.point(np.array(terms.nominal.curve.domain))
    away = settled.registration.nominal_from_section.apply(beyond)[:, None, :] - ends
    nearest: Array = np.hypot(away[..., 0], away[..., 1]).min(axis=1)
    return np.maximum(nearest - terms.tip_radius_mm, 0.0)
