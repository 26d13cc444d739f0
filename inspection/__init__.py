"""Inspection of free-form profiles: nominal, registration, signed deviations, verdicts. Pure maths on arrays.

This is the front door: an application imports what `__all__` lists and none of the files behind it.
"""

from inspection import synthetic
from inspection.coarse import register_coarse
from inspection.conclusion import Missing, Reason, reasons_of_abort
from inspection.curve import NurbsCurve
from inspection.curve_check import CurveCheck, Hollow, check_curve
from inspection.deviations import Deviations, deviations, profile_error_mm
from inspection.errors import InspectionError, NominalError, NotMeasured, RegistrationError
from inspection.fine import register, register_fine
from inspection.gaps import Gap, coverage, default_gap_max_mm
from inspection.kernels import Room, compiled_code_folder, while_compiling
from inspection.live import LiveInspection, LiveUpdate, State, rehearse
from inspection.methods import Method, WeightName
from inspection.minimum_zone import MinimumZone, fit_minimum_zone
from inspection.nominal import Material, NominalProfile, discretize
from inspection.placements import PlacementProof, PlacementSearch
from inspection.prefix import Prefix, PrefixSearch
from inspection.registration import Registration
from inspection.result import NOT_JUDGED, InspectionResult, JudgedRows, Rejection, Stretch
from inspection.rigid import RigidTransform
from inspection.section import SectionPlane
from inspection.self_crossings import Crossing, find_crossings
from inspection.telling_points import telling_rows
from inspection.terms import FitName, RuleName
from inspection.tolerance import ToleranceZone, Verdict

__all__ = [
    "NOT_JUDGED",
    "Crossing",
    "CurveCheck",
    "Deviations",
    "FitName",
    "Gap",
    "Hollow",
    "InspectionError",
    "InspectionResult",
    "JudgedRows",
    "LiveInspection",
    "LiveUpdate",
    "Material",
    "Method",
    "MinimumZone",
    "Missing",
    "NominalError",
    "NominalProfile",
    "NotMeasured",
    "NurbsCurve",
    "PlacementProof",
    "PlacementSearch",
    "Prefix",
    "PrefixSearch",
    "Reason",
    "Registration",
    "RegistrationError",
    "Rejection",
    "RigidTransform",
    "Room",
    "RuleName",
    "SectionPlane",
    "State",
    "Stretch",
    "ToleranceZone",
    "Verdict",
    "WeightName",
    "check_curve",
    "compiled_code_folder",
    "coverage",
    "default_gap_max_mm",
    "deviations",
    "discretize",
    "find_crossings",
    "fit_minimum_zone",
    "profile_error_mm",
    "reasons_of_abort",
    "register",
    "register_coarse",
    "register_fine",
    "rehearse",
    "synthetic",
    "telling_rows",
    "while_compiling",
]
