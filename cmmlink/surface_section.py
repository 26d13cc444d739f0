"""A plane section of a scan of a surface, handed to the inspection of sections: the result is that of any section, and recorded so.

The whole scan is brought onto the whole nominal first. Then the points near the plane are moved along the surface into it, and judged
against the curve in which the plane cuts the nominal. What both may be off by counts like the uncertainty of the measurement.
"""

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from cmmlink.devices import Connected, scan_of
from cmmlink.errors import PlanError
from cmmlink.from_plan import plane_of
from cmmlink.from_surface_plan import held_against, notes_on_surface, surface_of, terms_of
from cmmlink.nominal_files.nurbs_yaml import save_nurbs_yaml
from cmmlink.plan import FileDevice, Plan, Section, SurfacePlan
from cmmlink.scratch import scratch_in
from drivers import PointArraySource, points_in
from inspection import NotMeasured, NurbsCurve, SectionPlane

if TYPE_CHECKING:
    from inspection.surface import SectionCourse, SurfaceResult

Array = NDArray[np.float64]

_WITHIN = 0.005  # of the nominal's size: points no farther from the plane are taken
_FEWEST = 10
_FINE = 1e-3  # of the zone's width: how far the lines of the course may lie off the surface
_FINEST_MM = 1e-4
_BY_DISTANCE = "points are moved into the section by distance alone: the normals of the scan have no part in it"


@dataclass(frozen=True, slots=True, eq=False)
class SectionOfScan:
    """What the inspection of a section needs: its plan, with the curve as its nominal, and the points as a source with notes."""

    plan: Plan
    device: Connected


@contextmanager
def section_of_scan(plan: SurfacePlan, section: Section, within_mm: float | None) -> Iterator[SectionOfScan]:
    """Cut the scan and the nominal of a plan of a surface. The file of the nominal curve is there while this is entered.

    section   : the plane in the coordinates of the nominal
    within_mm : how far from the plane points are taken; None for a two-hundredth of the nominal's size

    Raises PlanError and whatever the files or the fit of the scan raise.
    """
    from inspection.surface import course_of_section, into_plane, judge_surface  # noqa: PLC0415 - for those who cut one

    device = plan.device
    assert isinstance(device, FileDevice)
    file, terms, plane = surface_of(plan), terms_of(plan), plane_of(section)
    read = scan_of(device, scratch_in(plan.records.folder))
    nominal, radius_mm = file.nominal, plan.probe.tip_radius_mm
    whole = judge_surface(read.points_mm, held_against(plan, file), terms)
    within_pose_mm = _settled_within(whole)
    within = _WITHIN * nominal.size_mm if within_mm is None else within_mm
    placed = whole.nominal_from_scan.apply(read.points_mm[np.isfinite(read.points_mm).all(axis=1)])
    if radius_mm:  # where the ball touched: in the plane alone its radius would be another
        placed = placed - radius_mm * nominal.project(placed).normal
    moved, shift_mm = into_plane(placed, nominal, plane.origin_mm, plane.normal, within)
    if len(moved) < _FEWEST:
        raise PlanError(
            f"{device.file}: {len(moved)} points lie within {within:.3g} mm of the section, too few for one; expected another plane, or a "
            "larger --slab"
        )
    fine = max(_FINE * (plan.tolerance.upper_mm - plan.tolerance.lower_mm), _FINEST_MM)
    course = course_of_section(nominal, plane.origin_mm, plane.normal, fine)
    error_mm = shift_mm + course.error_mm + nominal.nominal_error_mm + within_pose_mm
    notes = (
        *notes_on_surface(plan, file),
        *(f"{device.file.name}: {note}" for note in read.notes),
        *([_BY_DISTANCE] if read.normals is not None else []),
        _words_of_pose(whole),
        f"{len(moved)} of {len(read.points_mm)} points lie within {within:.3g} mm of the section; they were moved "
        "along the surface into it, each with its deviation",
        f"U holds {error_mm:.2g} mm for that, for what the fit leaves open, for the lines that the nominal is cut into, and for the error "
        "of the nominal",
    )
    source = PointArraySource(device.file.name, replace(points_in(moved), notes=()))
    with tempfile.TemporaryDirectory() as folder:
        curve = Path(folder) / f"{plan.surface.file.stem}-section.yaml"
        save_nurbs_yaml(_curve_of(course, plane), curve)
        yield SectionOfScan(_plan_of(plan, section, curve, error_mm), Connected(source, f"file {device.file.name}", False, notes))


def _curve_of(course: "SectionCourse", plane: SectionPlane) -> NurbsCurve:
    """The course as straight lines in the plane of the section."""
    off = course.places_mm - plane.origin_mm
    places = np.column_stack([off @ plane.x_axis, off @ np.cross(plane.normal, plane.x_axis)])
    points = np.vstack([places, places[:1]]) if course.closed else places
    knots = np.concatenate([[0.0], np.linspace(0.0, 1.0, len(points)), [1.0]])
    return NurbsCurve(1, points, knots, closed=course.closed)


def _plan_of(plan: SurfacePlan, section: Section, curve: Path, error_mm: float) -> Plan:
    """The plan of the section; the course runs with the material on its left."""
    tolerance, placing = plan.tolerance, plan.registration
    u_mm = tolerance.uncertainty_mm + error_mm
    if 2 * u_mm >= tolerance.upper_mm - tolerance.lower_mm:
        raise PlanError(
            f"U would be {u_mm:.2g} mm with what the section itself is off by, which leaves nothing provable of the zone; expected a "
            "smaller --slab, or a finer nominal"
        )
    return Plan.model_validate(
        {
            "part": plan.part.model_dump(),
            "nominal": {"file": curve, "material": "left"},
            "tolerance": {**tolerance.model_dump(), "uncertainty_mm": u_mm},
            "device": plan.device.model_dump(),
            "section": section.model_dump(),
            "registration": {"fit": placing.fit, "coverage_min": placing.coverage_min, "reject_outliers": placing.reject_outliers},
            "gap_max_mm": plan.gap_max_mm,
            "decision_rule": plan.decision_rule,
            "out": None,
            "records": plan.records.model_dump(),
        }
    )


def _settled_within(whole: "SurfaceResult") -> float:
    """How far, in mm, the fit of the whole scan leaves open where a point lies. Raises NotMeasured where it did not settle."""
    fit = whole.registration
    if fit is None:
        return 0.0
    if not fit.converged:
        raise NotMeasured(
            "the fit of the whole scan did not settle, so that it is not known where to cut it: bring the STEP or IGES file of the part or "
            "a finer mesh, or give a datum"
        )
    return fit.settles_within_mm


def _words_of_pose(whole: "SurfaceResult") -> str:
    pose = whole.nominal_from_scan
    moved = ", ".join(f"{value:.4f}" for value in pose.translation_mm)
    placed = f"turned {np.degrees(pose.angle_rad):.4f} deg, moved ({moved}) mm"
    if whole.registration is None:
        return f"the section was cut where the scan lies on the nominal: {placed}"
    weak = whole.registration.weakest
    free = f"; its points leave it free {weak.words}" if weak.undetermined else ""
    return f"the whole scan was fitted to the whole nominal before it was cut: {placed}{free}"
