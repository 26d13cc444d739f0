"""The parts of a run that a plan describes and that need no device: its nominal and its inspection."""

import math
from pathlib import Path

import numpy as np

from cmmlink.errors import PlanError
from cmmlink.nominal_files import NominalFile, load_nominal, material_side
from cmmlink.plan.scan import Datum, Plan
from inspection import LiveInspection, Material, NominalProfile, RigidTransform, SectionPlane, discretize


def profile_of(file: NominalFile, path: Path, material: Material | None) -> NominalProfile:
    """The discretised nominal; material inside a closed profile unless it is told otherwise."""
    side = material or material_side(file.curve)
    if side is None:
        raise PlanError(f"{path}: an open profile does not show on which side its material lies; say --material left or --material right")
    return discretize(file.curve, material=side)


def planned_profile(plan: Plan) -> NominalProfile:
    """The nominal that a plan names, discretised as it says."""
    nominal, finely = plan.nominal, plan.discretisation
    file = load_nominal(nominal.file, nominal.scale, nominal.closed)
    side = nominal.material or material_side(file.curve)
    if side is None:
        raise PlanError(
            f"{nominal.file}: an open profile does not show on which side its material lies; set nominal.material to left or right"
        )
    return discretize(file.curve, finely.samples, finely.pole_angle_min_deg, finely.step_min, side)


def pose_of(datum: Datum | None) -> RigidTransform | None:
    """The known pose that a plan gives, if it gives one."""
    return None if datum is None else RigidTransform(math.radians(datum.rotation_deg), np.array(datum.translation_mm))


def planned_inspection(plan: Plan, profile: NominalProfile) -> LiveInspection:
    """A fresh inspection as a plan describes it."""
    registration, section = plan.registration, plan.section
    return LiveInspection(
        profile,
        plan.tolerance.zone,
        datum=pose_of(registration.datum),
        fit=registration.fit,
        method=registration.method,
        tip_radius_mm=plan.probe.tip_radius_mm,
        section=SectionPlane(np.array(section.origin_mm), np.array(section.x_axis), np.array(section.normal)),
        off_section_max_mm=section.off_plane_max_mm,
        coverage_min=registration.coverage_min,
        reject_outliers=registration.reject_outliers,
    )
