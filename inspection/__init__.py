"""Inspection of free-form profiles: nominal, registration, signed deviations, verdicts. Pure maths on arrays."""

from inspection.coarse import register_coarse
from inspection.curve import NurbsCurve
from inspection.deviations import Deviations, profile_error_mm
from inspection.errors import InspectionError, NominalError, RegistrationError
from inspection.fine import register, register_fine
from inspection.live import InspectionResult, LiveInspection, LiveUpdate, Rejection, rehearse
from inspection.minimum_zone import MinimumZone, fit_minimum_zone
from inspection.nominal import NominalProfile, discretize
from inspection.profile_error import deviations
from inspection.registration import Registration
from inspection.rigid import RigidTransform
from inspection.section import SectionPlane
from inspection.tolerance import ToleranceZone, Verdict

__all__ = [
    "Deviations",
    "InspectionError",
    "InspectionResult",
    "LiveInspection",
    "LiveUpdate",
    "MinimumZone",
    "NominalError",
    "NominalProfile",
    "NurbsCurve",
    "Registration",
    "RegistrationError",
    "Rejection",
    "RigidTransform",
    "SectionPlane",
    "ToleranceZone",
    "Verdict",
    "deviations",
    "discretize",
    "fit_minimum_zone",
    "profile_error_mm",
    "register",
    "register_coarse",
    "register_fine",
    "rehearse",
]
