"""All points of a scan judged together: registered, every one judged at that pose, and the verdict on the part.

The points are taken in an order of their own, by their coordinates, so that no bit of the result depends on the order in which they
came; its rows stand in the order of arrival.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inspection.conclusion import Missing, Reason, word_points
from inspection.errors import NotMeasured, RegistrationError
from inspection.shift_words import shift_reservation
from inspection.surface.ball_centres import BallCentres
from inspection.surface.covered_area import measure_area
from inspection.surface.defect_regions import find_defects
from inspection.surface.feet import NominalSurface, SurfaceFeet, points_in_space, rejections
from inspection.surface.likely_mend import refuse_mirrored, refuse_other_unit
from inspection.surface.nominal_places import nearest_of, spread_places
from inspection.surface.own_face import feet_on_own_face
from inspection.surface.rigid_motion import RigidMotion
from inspection.surface.surface_fit import SurfaceRegistration, register_surface
from inspection.surface.surface_result import SurfaceResult
from inspection.surface.surface_terms import SurfaceTerms
from inspection.surface.surface_verdict import SurfaceFindings, conclude_surface
from inspection.tolerance import ToleranceZone
from inspection.verdict import NOT_JUDGED, Rejection, Verdict

Array = NDArray[np.float64]
Codes = NDArray[np.int8]
Index = NDArray[np.int64]

_PLACED = 0.95  # share of the area whose points place the part, where no coverage is asked for
_FAR_OFF = 0.5  # share of the points off the surface, or on the wrong side of it, beyond which the set-up is wrong


@dataclass(frozen=True, slots=True, eq=False)
class JudgedPoints:
    """Points at a pose: where they lie on the nominal, their verdicts (m,), NOT_JUDGED for rejected ones, and why (m,) they were."""

    feet: SurfaceFeet
    verdicts: Codes
    rejection: Codes

    def count_of(self, verdict: Verdict) -> int:
        """Points that have this verdict."""
        return int(np.count_nonzero(self.verdicts == verdict))


def judge_points(
    points_mm: Array,
    normals: Array | None,
    nominal: NominalSurface,
    pose: RigidMotion,
    zone: ToleranceZone,
    farthest_mm: float,
    reserve_mm: float = 0.0,
) -> JudgedPoints:
    """Points (m, 3) as they are at a pose; a point's result depends on nothing but itself.

    normals    : (m, 3) outward directions of the measured surface, or None
    zone       : with the U of the measuring device alone; the error of the nominal counts where it is
    reserve_mm : how far a deviation may still move; a verdict on a point is given where that cannot change it
    """
    moved, seen = pose.apply(points_mm), None if normals is None else pose.turn(normals)
    feet = nominal.project(moved)
    if seen is not None:
        feet = feet_on_own_face(moved, seen, nominal, feet, farthest_mm)
    rejection = rejections(feet, farthest_mm, seen)
    error = feet.error_mm + reserve_mm
    judged = zone.verdicts(feet.distance_mm, error)
    if not nominal.sides_known:  # what holds for one side only is not proven
        judged = np.where(judged == zone.verdicts(-feet.distance_mm, error), judged, np.int8(Verdict.UNCERTAIN))
    verdicts = np.where(rejection == Rejection.NONE, judged, np.int8(NOT_JUDGED)).astype(np.int8)
    return JudgedPoints(feet, verdicts, rejection)


def judge_surface(
    points_mm: ArrayLike,
    nominal: NominalSurface,
    terms: SurfaceTerms,
    normals: ArrayLike | None = None,
    complete: bool = True,
    missing: Missing | None = None,
) -> SurfaceResult:
    """Register all points (m, 3) of a scan together, judge every one at that pose, and conclude.

    normals  : (m, 3) outward directions of the measured surface, of any length, where the scanner gives them; zero or NaN where not
    complete : the scan came to its end; conformity of one that was cut short is not proven
    missing  : points that are known to be missing before they came here; None for none

    Raises RegistrationError when the points cannot be brought onto the nominal, NotMeasured when the set-up contradicts them.
    """
    points, directions = points_in_space(points_mm), directions_of(normals, points_mm)
    order = np.lexsort(np.column_stack([points, *([] if directions is None else [directions])]).T[::-1])
    scan = _Scan(points[order], None if directions is None else directions[order], nominal, terms, complete, missing or Missing())
    return _in_order_of_arrival(scan.settle(), np.asarray(points_mm, dtype=np.float64), order)


def directions_of(normals: ArrayLike | None, points_mm: ArrayLike) -> Array | None:
    """Normals as a float array of the shape of the points, or None."""
    if normals is None:
        return None
    directions = np.asarray(normals, dtype=np.float64)
    if directions.shape != np.shape(points_mm):
        raise ValueError(f"normals must have the shape of the points, {np.shape(points_mm)}, got {directions.shape}")
    return directions


@dataclass(frozen=True, slots=True, eq=False)
class _Scan:
    """Points (m, 3) in the order of their coordinates with their normals, and what they are judged by."""

    points: Array
    normals: Array | None
    nominal: NominalSurface
    terms: SurfaceTerms
    complete: bool
    missing: Missing

    def at(self, pose: RigidMotion, settles_within_mm: float) -> JudgedPoints:
        """All points judged at a pose that is known but for so much."""
        farthest = self.terms.farthest_on(self.nominal)
        return judge_points(self.points, self.normals, self.nominal, pose, self.terms.zone, farthest, settles_within_mm)

    def settle(self) -> SurfaceResult:
        """The result, its rows in the order of the points here."""
        pose, registration = self.terms.known_pose, None
        if pose is None:
            registration = self._fit()
            pose = registration.nominal_from_scan
        found = self.at(pose, _counted(registration))
        if registration is not None and registration.outlier.any():
            found = _without_outliers(found, registration.outlier)
        self._refuse_far(found)
        return self._conclude(found, pose, registration)

    def _fit(self) -> SurfaceRegistration:
        """The best fit about the middle of the zone, snapped to the grid of poses."""
        terms = self.terms
        gross = terms.width_mm / 2 if terms.reject_outliers else None
        farthest = terms.farthest_on(self.nominal)
        aim = terms.zone.middle_mm, gross, farthest, terms.circle_mm
        refuse_other_unit(self.points, self.nominal, terms.zone.middle_mm)
        try:
            found = register_surface(self.points, self.nominal, terms.start, terms.locked, *aim)
        except RegistrationError:
            refuse_mirrored(self.points, self.nominal, terms.zone.middle_mm)
            raise
        if found.rms_mm > terms.width_mm / 2:
            refuse_mirrored(self.points, self.nominal, terms.zone.middle_mm)
        return replace(found, nominal_from_scan=found.nominal_from_scan.snap_to_grid())

    def _refuse_far(self, found: JudgedPoints) -> None:
        """Raise NotMeasured where most points lie off the surface, or off its edge by more than is allowed there as well."""
        there = np.count_nonzero(found.rejection != Rejection.NOT_FINITE)
        away = self.terms.farthest_on(self.nominal)
        far = np.abs(found.feet.distance_mm) > max(away, self.terms.limits_on(self.nominal).end_allowance_mm)
        beyond = np.count_nonzero((found.rejection == Rejection.BEYOND_EDGE) & far)
        off = np.count_nonzero(found.rejection == Rejection.OFF_SURFACE) + beyond
        if off > _FAR_OFF * there:
            refuse_other_unit(self.points, self.nominal, self.terms.zone.middle_mm)
            raise NotMeasured(
                f"{off} of {there} points lie more than {away:.4g} mm off the surface: is it the right part, the right unit, and do the "
                "points lie in the coordinates of the nominal? Else let the pose be fitted, or give a start nearer to it"
            )
        turned = np.count_nonzero(found.rejection == Rejection.OPPOSITE_FACE)
        if turned > _FAR_OFF * there:
            raise NotMeasured(
                f"{turned} of {there} points were seen from another side than that of the surface on which they lie: do the normals of the "
                "scan, or the corners of its triangles, turn out of the material, and is it the right part and unit? Else bring the scan "
                "without normals"
            )

    def _conclude(self, found: JudgedPoints, pose: RigidMotion, registration: SurfaceRegistration | None) -> SurfaceResult:
        """What the judged points say about the surface, and the verdict on the part."""
        nominal, terms, feet, within = self.nominal, self.terms, found.feet, _counted(registration)
        zone = terms.zone_on(nominal, within)
        limits = terms.limits_on(nominal)
        judged = np.flatnonzero(found.verdicts != NOT_JUDGED)
        places = spread_places(nominal, limits.gap_max_mm)
        distance, nearest = nearest_of(places, feet.foot_mm[judged], feet.normal[judged])
        covered = measure_area(nominal, places, distance, limits.gap_max_mm)
        is_out = found.verdicts[judged] == Verdict.NONCONFORM
        regions = find_defects(places, feet, judged, is_out, nearest, 2 * distance <= limits.gap_max_mm, zone.middle_mm)
        points = max((verdict for verdict in Verdict if found.count_of(verdict)), default=Verdict.UNCERTAIN)
        why = word_points(zone, found.count_of(Verdict.NONCONFORM), found.count_of(Verdict.UNCERTAIN))
        if points is Verdict.NONCONFORM and registration is not None:
            points, why = self._doubt_free_pose(why, registration, found, covered.coverage)
        by_reason = _by_reason(found.rejection)
        beyond = np.abs(feet.distance_mm[found.rejection == Rejection.BEYOND_EDGE])
        findings = SurfaceFindings(
            points=points,
            why=why,
            judged=len(judged),
            rejected={reason: count for reason, count in by_reason.items() if reason != Rejection.BEYOND_EDGE.words},
            beyond_edge_mm=float(beyond.max(initial=0.0)),
            beyond_edge_count=int(np.count_nonzero(beyond > limits.end_allowance_mm)),
            covered=covered,
            registration=registration,
            nominal_error_mm=_error_that_counts(found, terms.zone, within),
            sides_known=nominal.sides_known,
        )
        conclusion = conclude_surface(findings, terms.zone, self.missing, limits, self.complete)
        deviation, reasons = feet.distance_mm[judged], conclusion.reasons
        if conclusion.verdict is Verdict.NONCONFORM and nominal.sides_known:
            radius = nominal.tip_radius_mm if isinstance(nominal, BallCentres) else 0.0
            shift = shift_reservation(deviation, terms.zone, radius, option="")
            reasons = (*reasons, Reason("shift", shift)) if shift else reasons
        away = np.abs(deviation - zone.middle_mm)
        return SurfaceResult(
            verdict=conclusion.verdict,
            reasons=reasons,
            notes=self._notes(within),
            points_mm=self.points,
            feet=feet,
            verdicts=found.verdicts,
            rejection=found.rejection,
            judged=len(judged),
            out_of_tolerance=int(np.count_nonzero(is_out)),
            rejected_by_reason=by_reason,
            worst=int(judged[away.argmax()]) if len(judged) else None,
            rms_mm=float(np.sqrt((deviation**2).mean())) if len(judged) else float("nan"),
            max_deviation_mm=float(deviation.max()) if len(judged) else float("nan"),
            min_deviation_mm=float(deviation.min()) if len(judged) else float("nan"),
            beyond_edge_mm=findings.beyond_edge_mm,
            regions=regions,
            coverage=covered.coverage,
            area_mm2=nominal.area_mm2,
            unmeasured=covered.unmeasured,
            gap_mm=covered.gap_mm,
            gap_max_mm=limits.gap_max_mm,
            zone=zone,
            nominal_error_mm=nominal.nominal_error_mm,
            registration=registration,
            nominal_from_scan=pose,
            rule="datum" if registration is None else "best-fit",
            fit=terms.fit,
            complete=self.complete,
        )

    def _doubt_free_pose(
        self, why: Reason | None, registration: SurfaceRegistration, found: JudgedPoints, coverage: float
    ) -> tuple[Verdict, Reason | None]:
        """Doubt a part that is out at the best fit, where another pose fits as well or too little was measured to fix the pose.

        By the rule "best-fit" a part is out when it is out at every best fit that the points allow, and by more than the pose is still
        free to move.
        """
        within = _counted(registration)
        for rival in registration.rival_poses:
            if not self.at(rival.snap_to_grid(), within).count_of(Verdict.NONCONFORM):
                words = "The part fits the nominal in another pose as well, and there no point is out: only a datum can tell."
                return Verdict.UNCERTAIN, Reason("placement", words)
        if not registration.converged or registration.weakest.slides:
            words = "The points do not place the part at one best fit: elsewhere less may be out."
            return Verdict.UNCERTAIN, Reason("placement", words)
        enough = self.terms.coverage_min or _PLACED
        if not self.complete or coverage < enough:
            words = f"Too little of the surface was measured ({coverage:.1%}) to place the part: in another placement less may be out."
            return Verdict.UNCERTAIN, Reason("placement", words)
        out = np.flatnonzero(found.verdicts == Verdict.NONCONFORM)
        few = replace(self, points=self.points[out], normals=None if self.normals is None else self.normals[out])
        for slid in registration.slid_poses():
            if not few.at(slid, within).count_of(Verdict.NONCONFORM):
                words = f"The part may lie so far off {registration.weakest.words} that no point is out: only a datum can tell."
                return Verdict.UNCERTAIN, Reason("placement", words)
        return Verdict.NONCONFORM, why

    def _notes(self, within_mm: float) -> tuple[str, ...]:
        """What was assumed."""
        notes, error = list(self.nominal.notes), self.nominal.nominal_error_mm
        if error:
            notes.append(f"the nominal may lie {error:.4g} mm off the part that it stands for: that was added to U")
            if self.terms.zone.rule == "simple":
                notes.append("by simple acceptance U does not count, but the error of the nominal does")
        if within_mm:
            told = np.format_float_positional(within_mm, precision=2, fractional=False)
            notes.append(f"the fit settles within {told} mm, which counts as uncertainty: that was added to U")
        return tuple(notes)


def _without_outliers(found: JudgedPoints, outlier: NDArray[np.bool_]) -> JudgedPoints:
    """The same with the points that the fit left out rejected, unless they are for another reason."""
    which = outlier & (found.rejection == Rejection.NONE)
    rejection = np.where(which, np.int8(Rejection.OUTLIER), found.rejection)
    return JudgedPoints(found.feet, np.where(which, np.int8(NOT_JUDGED), found.verdicts), rejection)


def _counted(registration: SurfaceRegistration | None) -> float:
    """What a fit that goes round in circles settles within, in mm: it counts like U. One that did not settle proves nothing anyway."""
    return registration.settles_within_mm if registration is not None and registration.converged else 0.0


def _error_that_counts(found: JudgedPoints, zone: ToleranceZone, within_mm: float) -> float:
    """The largest error of the nominal at a point that is uncertain because of it alone; 0 where there is none."""
    because = (found.verdicts == Verdict.UNCERTAIN) & (zone.verdicts(found.feet.distance_mm, within_mm) == Verdict.CONFORM)
    return float(found.feet.error_mm[because].max(initial=0.0))


def _by_reason(rejection: Codes) -> dict[str, int]:
    """Number of rejected points for each reason that occurred."""
    counts = np.bincount(rejection, minlength=max(Rejection) + 1)
    return {each.words: int(counts[each]) for each in Rejection if each != Rejection.NONE and counts[each]}


def _in_order_of_arrival(result: SurfaceResult, points_mm: Array, order: Index) -> SurfaceResult:
    """A result whose rows were in another order (m,), in that of arrival."""
    at = np.empty_like(order)
    at[order] = np.arange(len(order))
    feet, fit = result.feet, result.registration
    if fit is not None:
        fit = replace(fit, used=fit.used[at], outlier=fit.outlier[at])
    return replace(
        result,
        points_mm=points_mm.copy(),
        feet=SurfaceFeet(
            feet.foot_mm[at], feet.distance_mm[at], feet.normal[at], feet.face[at], feet.parameter[at], feet.kind[at], feet.error_mm[at]
        ),
        verdicts=result.verdicts[at],
        rejection=result.rejection[at],
        worst=None if result.worst is None else int(order[result.worst]),
        registration=fit,
    )
