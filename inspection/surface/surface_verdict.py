"""From the judged points of a surface to the verdict on the part, with the reasons in the order of their weight.

The rule is that of a profile: CONFORM only where every point is proven inside the zone and nothing is known that could hide a defect,
NONCONFORM only where it is proven, else UNCERTAIN. What a surface has besides is an error of the nominal and a pose that may slide.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from inspection.conclusion import Conclusion, Limits, Missing, Reason, of_many, reasons_of_missing, verb_of
from inspection.surface.covered_area import CoveredArea
from inspection.surface.surface_fit import SurfaceRegistration
from inspection.tolerance import ToleranceZone
from inspection.verdict import Verdict

_FINE = 0.1  # of what U leaves of the zone: a chord tolerance that hardly counts
_SLIDES = 0.25  # of the zone's width: a pose that may slide farther places the part too badly


@dataclass(frozen=True, slots=True, eq=False)
class SurfaceFindings:
    """What was found of a scan, as far as the verdict depends on it.

    points, why   : the verdict on the judged points alone, NONCONFORM only where that is proven, and its reason
    judged        : points with a verdict
    rejected      : points that the inspection itself rejected, by reason, those beyond an edge left out
    beyond_edge_mm, beyond_edge_count : how far the farthest point beyond a border lies off it, and how many lie too far
    covered       : what of the area was measured
    registration  : None where the pose was known
    nominal_error_mm : the largest error of the nominal at a point that is uncertain because of it alone; 0 where there is none
    sides_known   : it is known which side of the nominal is out of material
    """

    points: Verdict
    why: Reason | None
    judged: int
    rejected: Mapping[str, int]
    beyond_edge_mm: float
    beyond_edge_count: int
    covered: CoveredArea
    registration: SurfaceRegistration | None
    nominal_error_mm: float
    sides_known: bool


def conclude_surface(found: SurfaceFindings, zone: ToleranceZone, missing: Missing, limits: Limits, complete: bool) -> Conclusion:
    """Say the verdict on the part.

    zone     : with the U of the measuring device alone
    complete : the scan came to its end
    """
    reasons = [] if found.why is None else [found.why]
    reasons += _nominal(found, zone)
    if not found.judged:
        reasons.append(Reason("nothing-judged", "No point was judged."))
    if not complete:
        reasons.append(Reason("incomplete", "The scan did not come to its end."))
    if missing.begun > 1:
        reasons.append(Reason("begun-anew", f"The device began anew: points of {missing.begun} scans were judged together."))
    gap, allowed = found.covered.gap_mm, limits.allow_unseen_mm
    if allowed is None or gap > allowed:
        unseen = f"places of the surface up to {gap:.4g} mm wide are unseen, {'none' if allowed is None else f'{allowed:g} mm'} allowed"
        reasons += reasons_of_missing(found.rejected, missing, unseen)
    reasons += _unmeasured(found, limits)
    reasons += _pose(found.registration, zone)
    return Conclusion(max(found.points, Verdict.UNCERTAIN if reasons else Verdict.CONFORM), tuple(reasons))


def _nominal(found: SurfaceFindings, zone: ToleranceZone) -> list[Reason]:
    """What of the nominal is the reason that less is proven: its error, and a side that is not known."""
    error, width = found.nominal_error_mm, zone.upper_mm - zone.lower_mm
    if found.points is Verdict.UNCERTAIN and not found.sides_known:
        told = "It is not known which side of the nominal is out of material: what holds for one side only is not proven."
        return [Reason("nominal", f"{told} Bring a surface that has a known outside: a closed one, or a cloud with normals.")]
    if not error or found.points is Verdict.NONCONFORM:
        return []
    mend = "Bring the STEP or IGES file of the part, or a finer mesh"
    if 2 * (zone.guard_mm + error) < width:
        return [Reason("nominal", f"The nominal may lie {error:.4g} mm off the part that it stands for, which counts like U. {mend}.")]
    fine = f": one exported with a chord tolerance of {_FINE * (width - 2 * zone.guard_mm):.2g} mm"
    told = f"The nominal may lie {error:.4g} mm off the part that it stands for: nothing is proven there of a zone {width:.4g} mm wide."
    return [Reason("nominal", f"{told} {mend}{fine}.")]


def _unmeasured(found: SurfaceFindings, limits: Limits) -> list[Reason]:
    """Parts of the surface, and of the part beyond it, of which nothing is known."""
    reasons, covered = [], found.covered
    if found.beyond_edge_mm > limits.end_allowance_mm:
        number = found.beyond_edge_count
        lie = f"{verb_of(number, 'lies', 'lie')} up to {found.beyond_edge_mm:.4g} mm off it; {limits.end_allowance_mm:.4g} mm are allowed."
        reasons.append(Reason("ends", f"{of_many(number, 'point')} beyond an edge of the open surface {lie}"))
    if covered.coverage < limits.coverage_min:
        told = f"{covered.coverage:.1%} of the surface was measured; {limits.coverage_min:.1%} are needed."
        reasons.append(Reason("coverage", told))
    if covered.gap_mm > limits.gap_max_mm * (1 + 1e-9):
        widest = max(covered.unmeasured, key=lambda part: part.width_mm, default=None)
        where = "" if widest is None else f", around ({', '.join(f'{value:.4g}' for value in widest.centre_mm)}) on face {widest.face + 1}"
        told = f"The widest place without points is {covered.gap_mm:.4g} mm across{where}; {limits.gap_max_mm:.4g} mm are allowed."
        reasons.append(Reason("gap", told))
    return reasons


def _pose(registration: SurfaceRegistration | None, zone: ToleranceZone) -> list[Reason]:
    """A pose that did not settle, or that may slide."""
    if registration is None:
        return []
    reasons, weakest = [], registration.weakest
    if not registration.converged:
        reasons.append(Reason("fit", _unsettled(registration.settles_within_mm)))
    mend = "Give a datum, scan another side as well, or start at a known pose with that freedom locked"
    if weakest.slides:
        reasons.append(Reason("pose", f"The points do not determine where the part lies {weakest.words}: it slides there. {mend}."))
    elif not weakest.undetermined and weakest.shift_95_mm > _SLIDES * (zone.upper_mm - zone.lower_mm):
        told = f"The part may lie {weakest.shift_95_mm:.3g} mm off (95 %) {weakest.words}, more than a quarter of the zone."
        reasons.append(Reason("pose", f"{told} {mend}."))
    return reasons


def _unsettled(within_mm: float) -> str:
    """Why a pose is not the best one: the fit goes round in a circle so wide, or on."""
    if within_mm == float("inf"):
        return "The fit did not settle: the pose is not the best one."
    told = f"The fit did not settle: it goes round in circles {within_mm:.2g} mm wide, more than a hundredth of the zone."
    return f"{told} Bring the STEP or IGES file of the part, or a finer mesh."
