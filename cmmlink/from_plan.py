"""Builds what a plan describes, except its device: the nominal profile and the inspection. Errors name file, line and key."""

import math
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TypedDict

import numpy as np

from cmmlink.errors import PlanError
from cmmlink.events import RunStarted
from cmmlink.nominal_files import NominalFile, load_nominal, material_side
from cmmlink.plan import CtPlan, Datum, Discretisation, Nominal, Plan, place_of
from inspection import FitName, LiveInspection, Method, NominalProfile, RigidTransform, Room, RuleName, SectionPlane, WeightName, discretize


def check_plan(plan: Plan, plan_file: Path) -> NominalProfile:
    """Build the profile of a plan and check the values that depend on it. Raises PlanError with file, line and key."""
    with name_place(plan_file, "nominal.file"):
        profile = profile_of(plan)
    with name_place(plan_file, "probe.tip_radius_mm"):
        inspection_of(plan, profile)
    return profile


@contextmanager
def name_place(plan_file: Path, key: str) -> Iterator[None]:
    """Prefix a value's error with file, line and key."""
    try:
        yield
    except ValueError as error:
        problem = str(error).removeprefix(f"{key}: ")  # what names its key already needs only the place
        raise PlanError(f"{place_of(plan_file, key)}: {problem}") from None


def profile_of(plan: Plan) -> NominalProfile:
    """The nominal that a plan names, discretised as it says."""
    nominal = plan.nominal
    return discretize_file(load_from(nominal, nominal.file), nominal.file, nominal, plan.discretisation)


def load_from(nominal: Nominal, path: Path) -> NominalFile:
    """The nominal in the file `path`, read as a plan says."""
    return load_nominal(path, nominal.scale, nominal.closed, nominal.unit)


def notes_on_nominal(plan: Plan) -> tuple[str, ...]:
    """What was assumed or mended when the nominal of a plan was read, each with the name of its file."""
    nominal = plan.nominal
    return tuple(f"{nominal.file.name}: {note}" for note in load_from(nominal, nominal.file).notes)


def discretize_file(file: NominalFile, path: Path, nominal: Nominal, finely: Discretisation) -> NominalProfile:
    """Discretise a nominal that was read from `path`. The material lies inside a closed profile unless the plan says otherwise."""
    side = nominal.material or material_side(file.curve)
    if side is None:
        raise PlanError(
            f"{path}: an open profile does not show on which side its material lies; "
            "set nominal.material to left or right in the plan, or give --material left or --material right"
        )
    return discretize(file.curve, finely.samples, finely.pole_angle_min_deg, finely.step_min, side)


def pose_of(datum: Datum | None) -> RigidTransform | None:
    """The known pose that a plan gives, if it gives one."""
    return None if datum is None else RigidTransform(math.radians(datum.rotation_deg), np.array(datum.translation_mm))


def inspection_of(plan: Plan, profile: NominalProfile, room: Room = np.empty, *, provisional: bool = True) -> LiveInspection:
    """A fresh inspection as a plan describes it. Points that are all there from the start need no provisional verdicts.

    room : gives the arrays that grow with the scan, like numpy.empty
    """
    section = plan.section
    return LiveInspection(
        profile,
        plan.tolerance.zone,
        **_fitting(plan),
        tip_radius_mm=plan.probe.tip_radius_mm,
        section=SectionPlane(np.array(section.origin_mm), np.array(section.x_axis), np.array(section.normal)),
        off_section_max_mm=section.off_plane_max_mm,
        provisional=provisional,
        room=room,
    )


class _Fitting(TypedDict):
    """What a plan says of the registration and of the verdict, as LiveInspection takes it."""

    datum: RigidTransform | None
    fit: FitName
    method: Method
    coverage_min: float
    reject_outliers: bool
    rule: RuleName
    weights: WeightName
    gap_max_mm: float | None
    end_allowance_mm: float | None
    allow_unseen_mm: float | None


def _fitting(plan: Plan) -> _Fitting:
    registration = plan.registration
    return {
        "datum": pose_of(registration.datum),
        "fit": registration.fit,
        "method": registration.method,
        "coverage_min": registration.coverage_min,
        "reject_outliers": registration.reject_outliers,
        "rule": plan.rule,
        "weights": plan.weights,
        "gap_max_mm": plan.gap_max_mm,
        "end_allowance_mm": plan.end_allowance_mm,
        "allow_unseen_mm": plan.allow.unseen_mm,
    }


def run_started(plan: Plan | CtPlan, device: str, simulated: bool, notes: tuple[str, ...] = ()) -> RunStarted:
    """The event that begins a run of a plan."""
    operator = plan.operator if isinstance(plan, Plan) else None
    return RunStarted(plan.part.name, plan.part.serial_number or "", operator or "", device, simulated, notes)
