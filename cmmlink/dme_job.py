"""What a plan asks of a coordinate measuring machine: the course along its nominal, or the scan that its numbers describe.

The course lies in the coordinates in which the machine measures: in the plane of the plan's section, where the plan's datum puts the
nominal. Without a datum the nominal's own coordinates are those of the section, as they are in a part coordinate system that was
aligned at the machine.
"""

import numpy as np
from numpy.typing import NDArray

from cmmlink.characteristics import pose_of
from cmmlink.errors import PlanError
from cmmlink.from_plan import nominal_of, plane_of, with_section
from cmmlink.plan import AskedScan, CircleScan, CurveScan, DmeDevice, LineScan, Plan, PointsScan, SurfacePlan, UnknownScan
from drivers import (
    DmeJob,
    PointCheck,
    curve_density,
    move_to,
    point_measurement,
    scan_on_circle,
    scan_on_line,
    scan_unknown,
    scans_on_curve,
)
from inspection import NurbsCurve

_LONGEST_STEP_MM = 5.0  # between two points of a course, however straight it is
_LOOKED_AT = 20_001
_SURFACE_DEG = {"outside": 0.0, "inside": 180.0, "plane": 90.0}


def job_of(plan: Plan | SurfacePlan, device: DmeDevice) -> DmeJob:
    """What the machine of a plan is asked to do. Raises NominalError and PlanError where the nominal gives no course."""
    first = device.asked_scans[0]
    block = "PtMeasPar" if isinstance(first, PointsScan) else "ScanPar"
    speed = () if device.speed_mm_s is None else (f"Tool.{block}.Speed({device.speed_mm_s:g})",)
    preparations = (curve_density(first.step_mm, first.angle_deg),) if isinstance(first, CurveScan) else ()
    return DmeJob(
        PointCheck(plan.probe.tip_radius_mm, device.radius_tolerance_mm, device.quality_max),
        tuple(command for scan in device.asked_scans for command in _commands(plan, scan)),
        tool=device.tool,
        home=device.home,
        coordinate_system=device.coordinate_system,
        settings=speed,
        preparations=preparations,
        single_points=isinstance(first, PointsScan),
    )


def questions_of(plan: Plan | SurfacePlan, device: DmeDevice) -> DmeJob:
    """What the machine can be asked without anything moving."""
    return DmeJob(PointCheck(plan.probe.tip_radius_mm, device.radius_tolerance_mm, device.quality_max), ())


def _commands(plan: Plan | SurfacePlan, scan: AskedScan) -> tuple[str, ...]:
    if isinstance(scan, CurveScan | PointsScan):
        if isinstance(plan, SurfacePlan):
            raise PlanError("device.scan: a surface has no curve that a machine could follow; expected a circle, a line or unknown")
        return _along_nominal(plan, scan)
    return (*map(move_to, scan.via_mm), _along_own_path(scan))


def _along_own_path(scan: CircleScan | LineScan | UnknownScan) -> str:
    if isinstance(scan, CircleScan):
        surface_deg = _SURFACE_DEG[scan.surface]
        return scan_on_circle(scan.centre_mm, scan.start_mm, scan.axis, scan.sweep_deg, surface_deg, scan.step_deg)
    if isinstance(scan, LineScan):
        return scan_on_line(scan.start_mm, scan.end_mm, scan.normal, scan.step_mm)
    return scan_unknown(
        scan.start_mm,
        scan.start_direction,
        scan.plane_normal,
        scan.towards_mm,
        scan.step_mm,
        scan.end_mm,
        scan.end_diameter_mm,
        scan.end_count,
        scan.end_direction,
        scan.dialect,
    )


def _along_nominal(plan: Plan, scan: CurveScan | PointsScan) -> tuple[str, ...]:
    longest_mm = _LONGEST_STEP_MM if isinstance(scan, CurveScan) else scan.step_mm
    path, closed = course_along_nominal(plan, scan.chord_error_mm, longest_mm)
    if isinstance(scan, CurveScan):
        return scans_on_curve(path, closed=closed)
    return tuple(point_measurement((x, y, z), (i, j, k)) for x, y, z, i, j, k in path.tolist())


def course_along_nominal(plan: Plan, chord_error_mm: float, longest_step_mm: float) -> tuple[NDArray[np.float64], bool]:
    """Points (k, 6) of the nominal on the machine with the directions out of the material, and whether the course closes.

    Points lie at most a step apart, and closer where the nominal bends, so that it leaves the straight line between two of them by no
    more than the chord error. Of a closed course the last point is not the first.
    """
    plan = with_section(plan)
    curve, material = nominal_of(plan)
    u = _parameters(curve, chord_error_mm, longest_step_mm)
    point, tangent = curve.derivatives(u, 1)
    left = np.column_stack([-tangent[:, 1], tangent[:, 0]]) / np.hypot(*tangent.T)[:, None]
    outward = left if material == "right" else -left
    datum, plane = pose_of(plan.registration.datum), plane_of(plan.section)
    if datum is not None:
        section_from_nominal = datum.inverse()
        tips = section_from_nominal.apply(point + outward)
        point = section_from_nominal.apply(point)
        outward = tips - point
    on_machine = plane.to_machine(point)
    return np.hstack([on_machine, plane.to_machine(point + outward) - on_machine]), curve.closed


def _parameters(curve: NurbsCurve, chord_error_mm: float, longest_step_mm: float) -> NDArray[np.float64]:
    """Parameters of the points of a course: the sag of a chord h is h^2 curvature / 8."""
    u = np.linspace(*curve.domain, _LOOKED_AT)
    station = curve.station_mm(u)
    station[-1] = curve.length_mm  # a closed curve's end is its beginning, at station 0
    bent = np.nan_to_num(np.abs(curve.curvature(u)), nan=0.0, posinf=0.0)  # at a corner there is none
    density = np.maximum(1.0 / longest_step_mm, np.minimum(np.sqrt(bent / (8.0 * chord_error_mm)), 1.0 / chord_error_mm))
    count = np.concatenate([[0.0], np.cumsum((density[1:] + density[:-1]) / 2 * np.diff(station))])
    found = np.interp(np.linspace(0.0, count[-1], int(np.ceil(count[-1])) + 1), count, u)
    return np.asarray(found[:-1] if curve.closed else found)
