"""One case of the reference set, judged as `cmmlink run` judges its plan, and how far that is from what is true of it."""

import logging
import math
import threading
import time
from collections.abc import Iterator, Mapping
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cmmlink.devices import connect
from cmmlink.from_plan import profile_of
from cmmlink.plan import Plan, load_plan
from cmmlink.qualification.budget import (
    ANGLES,
    BENDS,
    CONSUMPTION,
    DEVIATION,
    EDGE_VERDICTS,
    FILTERED,
    LENGTHS,
    MINIMUM_ZONE,
    PART_VERDICTS,
    POINT_VERDICTS,
    POSE,
    RMS,
    FoundError,
    Quantity,
)
from cmmlink.reference import CaseKind, KnownPose, ReferenceCase
from cmmlink.run import FinishedRun, carry_out
from inspection import (
    CharacteristicResult,
    InspectionResult,
    NominalProfile,
    ProfileFilter,
    Registration,
    RigidTransform,
    Verdict,
    filter_profile,
)

Array = NDArray[np.float64]

_EDGE_MM = 1e-8  # how far inside and outside of the largest deviation a limit is laid: ten picometres
_AT_A_LIMIT_MM = 1e-9  # of a point so near a limit no verdict is known
_ABOUT: Mapping[CaseKind, Quantity] = {
    "deviation": DEVIATION,
    "best-fit": POSE,
    "minimum-zone": MINIMUM_ZONE,
    "consumption": CONSUMPTION,
    "filter": FILTERED,
    "section": LENGTHS,
    "placement": LENGTHS,
    "disturbed": PART_VERDICTS,
}
_log = logging.getLogger(__name__)


def errors_of_case(case: ReferenceCase, folder: Path) -> Iterator[FoundError]:
    """Judge a case, which was written into a folder, and yield the error of everything that is known of it.

    Where that raises, the case is one without a number: whatever a broken installation raises, it is what a qualification has to find.
    """
    try:
        yield from _errors(case, load_plan(folder / case.name / "plan.yaml"))
    except Exception as error:  # a broken library may raise anything
        _log.exception("the case %s of the qualification", case.name)
        yield FoundError(_ABOUT[case.kind], math.inf, case.name, 1, f"{case.name}: {error}")


def _errors(case: ReferenceCase, plan: Plan) -> Iterator[FoundError]:
    profile = profile_of(plan)
    run = _judged(plan, profile)
    if run.outcome.result is None:
        raise run.outcome.failure or run.refusal or ValueError("no point was judged")
    yield FoundError(PART_VERDICTS, float(run.verdict is not Verdict[case.truth.verdict.upper()]), case.name)
    yield from _errors_of_points(case, plan, run.outcome.result)
    yield from _errors_of_zones(case, run)
    yield from _errors_behind_filters(case, plan, profile, run.outcome.result)
    yield from _errors_of_values(case, run)
    if case.kind == "deviation" and case.truth.verdict != "uncertain":
        yield FoundError(EDGE_VERDICTS, float(sum(_wrong_at_edges(case, plan, profile))), case.name, 2)


def _judged(plan: Plan, profile: NominalProfile) -> FinishedRun:
    with connect(plan) as device:
        return carry_out(plan, profile, device, records=None, clock=time.monotonic, now=lambda: datetime.now(UTC), stop=threading.Event())


def _errors_of_points(case: ReferenceCase, plan: Plan, result: InspectionResult) -> Iterator[FoundError]:
    """Where the pose is known, the error of every deviation and verdict; at a best fit how far the farthest point is off."""
    truth, scale = case.truth, case.mm_per_unit
    if plan.registration.datum is None:
        if truth.pose is not None and case.kind in ("best-fit", "disturbed"):
            yield FoundError(POSE, _farthest_from(truth.pose, case, result.registration), case.name, len(case.points))
        return
    if truth.deviation is None or case.kind == "placement":  # which has its truth where the part was moved to
        return
    known_mm = truth.deviation * scale
    part = np.isfinite(known_mm)  # an outlier is no point of the part
    yield FoundError(DEVIATION, float(np.abs(result.deviation_mm - known_mm)[part].max()), case.name, int(part.sum()))
    if truth.rms is not None and part.all():
        yield FoundError(RMS, abs(result.rms_mm - truth.rms * scale), case.name)
    lower, upper = case.limits_mm
    clear = part & (np.minimum(np.abs(known_mm - lower), np.abs(known_mm - upper)) > _AT_A_LIMIT_MM)
    out = (known_mm < lower) | (known_mm > upper)
    wrong = clear & (result.verdicts != np.where(out, Verdict.NONCONFORM, Verdict.CONFORM))
    yield FoundError(POINT_VERDICTS, float(wrong.sum()), case.name, int(clear.sum()))


def _farthest_from(pose: KnownPose, case: ReferenceCase, found: Registration) -> float:
    """How far any point lies from where the known pose brings it; of a symmetric part at the nearest of the poses that fit as well."""
    known = RigidTransform(math.radians(pose.rotation_deg), np.array(pose.translation) * case.mm_per_unit)
    points = case.points * case.mm_per_unit
    there = known.apply(points)
    return min(float(np.linalg.norm(one.apply(points) - there, axis=1).max()) for one in (found.nominal_from_section, *found.rivals))


def _errors_of_zones(case: ReferenceCase, run: FinishedRun) -> Iterator[FoundError]:
    """The error of the width of the minimum zone, and of the least consumption of the tolerance."""
    result, truth = run.outcome.result, case.truth
    assert result is not None
    if truth.zone is not None:
        widths = [one.value for one in run.characteristics if one.type == "line-profile" and one.fit == "minimum-zone"]
        found = [*widths, result.minimum_zone_mm]
        yield FoundError(MINIMUM_ZONE, _farthest(found, truth.zone.value * case.mm_per_unit), case.name)
    if truth.consumption is not None:
        found = [one.consumption for one in run.characteristics if one.type == "line-profile"]
        yield FoundError(CONSUMPTION, _farthest(found, truth.consumption.value), case.name)


def _farthest(found: list[float], known: float) -> float:
    """The largest error of values of one number; infinite where there is none."""
    return max((abs(value - known) for value in found if math.isfinite(value)), default=math.inf)


def _errors_behind_filters(case: ReferenceCase, plan: Plan, profile: NominalProfile, result: InspectionResult) -> Iterator[FoundError]:
    """The error of every deviation behind the filters that the plan asks for."""
    known_mm = {one.name: one.deviation * case.mm_per_unit for one in case.truth.filtered}
    corners = profile.curve.station_mm(profile.curve.corners)
    for asked in plan.characteristics:
        if asked.type == "line-profile" and asked.filter is not None:
            wanted = ProfileFilter(asked.filter.cutoff_mm, asked.filter.order, asked.filter.robust)
            along = (result.station_mm, result.deviation_mm, profile.length_mm, profile.curve.closed)
            away = (
                filter_profile(*along, wanted, corners).waviness_mm
                - known_mm[f"{'robust ' if wanted.robust else ''}Gaussian regression of order {wanted.order}"]
            )
            yield FoundError(FILTERED, float(np.abs(away).max()), case.name, len(away))


def _errors_of_values(case: ReferenceCase, run: FinishedRun) -> Iterator[FoundError]:
    """The error of every number of the section."""
    found = {one.name: one for one in run.characteristics}
    for known in case.truth.values:
        scale = {"mm": 1.0, "inch": 25.4, "deg": 1.0}[known.unit]
        one = found[known.name]
        yield FoundError(_quantity_of(one), abs(one.value - known.value * scale), case.name)


def _quantity_of(found: CharacteristicResult) -> Quantity:
    """What a number of the section is held against."""
    if found.type == "line-profile":
        return FILTERED
    if found.unit == "deg":
        return ANGLES
    return BENDS if found.type == "thickness" or found.method.startswith("curvature") else LENGTHS


def _wrong_at_edges(case: ReferenceCase, plan: Plan, profile: NominalProfile) -> Iterator[bool]:
    """Judge a part by limits just outside of its largest deviation, and just inside, and tell each time whether the verdict is wrong."""
    assert plan.tolerance is not None
    assert case.truth.deviation is not None
    largest_mm = float(np.nanmax(np.abs(case.truth.deviation))) * case.mm_per_unit
    for limit_mm, verdict in ((largest_mm + _EDGE_MM, Verdict.CONFORM), (largest_mm - _EDGE_MM, Verdict.NONCONFORM)):
        zone = plan.tolerance.model_copy(update={"lower_mm": -limit_mm, "upper_mm": limit_mm})
        yield _judged(plan.model_copy(update={"tolerance": zone}), profile).verdict is not verdict
