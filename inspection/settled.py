"""The end of a scan: all points registered together, and every one judged at that settled pose."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from inspection.fine import register
from inspection.minimum_zone import fit_minimum_zone
from inspection.registration import Registration, datum_registration
from inspection.result import NOT_JUDGED, InspectionResult, Rejection, coverage, stretches
from inspection.scan_rows import ScanRows
from inspection.setup_check import check_fit, check_points
from inspection.terms import Terms
from inspection.tolerance import Verdict

Array = NDArray[np.float64]


def settle(rows: ScanRows, terms: Terms, complete: bool) -> InspectionResult:
    """Register all points of a scan together and judge every one at that pose; the rows stay as they are.

    complete : the scan came to its end; conformity of one that was cut short is not proven

    Raises RegistrationError when the points cannot be brought onto the nominal, NotMeasured when the set-up contradicts them.
    """
    rows = rows.without(check_points(rows, terms))
    usable = rows.usable_rows()
    if terms.known_pose is None:
        registration = _register_points(rows.points[usable], terms)
        # rounded, so that a replay on another processor judges at the very same pose
        registration = replace(registration, nominal_from_section=registration.nominal_from_section.snap_to_grid())
    else:
        registration = datum_registration(terms.known_pose, len(usable))
        check_fit(rows.points[usable], registration, terms)
    judged = rows.copy()
    judged.rejection[usable[registration.outliers]] = Rejection.OUTLIER
    judged.judge(0, judged.count, registration.nominal_from_section, terms)
    return _result(judged, registration, terms, complete)


def _register_points(points_mm: Array, terms: Terms) -> Registration:
    """The pose of points (m, 2) by the fit that the terms name."""
    nominal, zone, tip_radius_mm = terms.nominal, terms.zone, terms.tip_radius_mm
    gross_mm = (zone.upper_mm - zone.lower_mm) / 2  # nearer points are form, however exact the others are
    registration = register(points_mm, nominal, tip_radius_mm=tip_radius_mm, robust=terms.reject_outliers, gross_mm=gross_mm)
    check_fit(points_mm, registration, terms)
    if terms.fit != "minimum-zone":
        return registration
    kept = points_mm[~registration.outliers]
    smallest = fit_minimum_zone(kept, nominal, registration, terms.method, tip_radius_mm, zone.middle_mm)
    pose, programs, converged = smallest.nominal_from_section, smallest.programs, smallest.converged
    return replace(registration, nominal_from_section=pose, iterations=programs, converged=converged)


def _result(rows: ScanRows, registration: Registration, terms: Terms, complete: bool) -> InspectionResult:
    """What the judged rows say about the profile."""
    judged = rows.verdicts != NOT_JUDGED
    station, deviation, verdicts = rows.station[judged], rows.deviation[judged], rows.verdicts[judged]
    covered = coverage(station, terms.nominal)
    verdict = terms.zone.verdict(deviation)
    proven = complete and covered >= terms.coverage_min and not (rows.rejection == Rejection.OUTLIER).any()
    return InspectionResult(
        actual_mm=rows.actual,
        foot_mm=rows.foot,
        station_mm=rows.station,
        deviation_mm=rows.deviation,
        verdicts=rows.verdicts,
        rejection=rows.rejection,
        verdict=verdict if proven else max(verdict, Verdict.UNCERTAIN),
        coverage=covered,
        complete=complete,
        zone=terms.zone,
        registration=registration,
        fit="none" if terms.known_pose is not None else terms.fit,
        method=terms.method,
        stretches=stretches(station, deviation, verdicts, terms.zone, terms.nominal),
    )
