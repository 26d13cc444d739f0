"""Inspection of free-form profiles: nominal, registration, signed deviations, verdicts. Pure maths on arrays.

This is the front door: an application imports what `__all__` lists and none of the files behind it.
"""

TYPE_CHECKING = False  # as type checkers read it; `typing` itself takes longer to load than all of this

if TYPE_CHECKING:
    from inspection import synthetic
    from inspection.certificate import certify_minimum_zone
    from inspection.characteristics.actual import ActualSection, draw_actual_section
    from inspection.characteristics.airfoil import AirfoilValues, ComparedAirfoil, LeftOut, compare_airfoil, evaluate_airfoil
    from inspection.characteristics.camber import maximum_camber
    from inspection.characteristics.characteristic import (
        Characteristic,
        CharacteristicFit,
        CharacteristicKind,
        CharacteristicResult,
        LineProfile,
        Region,
        SectionCharacteristic,
        SectionKind,
        WholeProfile,
        WorstPlace,
    )
    from inspection.characteristics.chord import ChordAngleMethod, ChordMethod, chord, chord_angle
    from inspection.characteristics.edge_radius import EdgeRadiusMethod, edge_radius
    from inspection.characteristics.inscribed import CamberLine, InscribedCircles, find_camber_line
    from inspection.characteristics.outline import AirfoilSection, find_airfoil
    from inspection.characteristics.placement import displacement, twist_by_chord, twist_by_fit
    from inspection.characteristics.section_value import ComparedValue, SectionValue, compare_values
    from inspection.characteristics.stack import StackedSections, StackingAxis, bow, fit_stacking_axis, relative_twist, taper
    from inspection.characteristics.stack_characteristic import (
        MeasuredSection,
        SectionShare,
        StackCharacteristic,
        StackCharacteristicResult,
        StackingAxisMethod,
        numbers_of,
    )
    from inspection.characteristics.thickness import EdgeThicknessMethod, ThicknessMethod, edge_thickness, maximum_thickness
    from inspection.coarse import register_coarse
    from inspection.common_fit import CommonFit, SectionToFit, fit_together
    from inspection.compensation import Compensation
    from inspection.conclusion import Missing, Reason, reasons_of_abort
    from inspection.consumption import fit_least_consumption
    from inspection.consumption_proof import certify_consumption
    from inspection.curve import NurbsCurve
    from inspection.curve_check import CurveCheck, Hollow, check_curve
    from inspection.datum import DatumFeature, DatumFeatures, FoundDatum
    from inspection.difference import Course, Difference, difference_along
    from inspection.errors import InspectionError, NominalError, NotMeasured, RegistrationError
    from inspection.evaluation.datum import check_datum
    from inspection.evaluation.evaluate import Evaluation, doubt_part, evaluate, with_found
    from inspection.evaluation.line_profile import zone_words
    from inspection.evaluation.region import FeatureName, Features, features_of, region_between, station_near
    from inspection.evaluation.section_value import METHODS_OF_SECTIONS, Outline, with_nominal
    from inspection.evaluation.so_far import EvaluationSoFar, ScanSoFar
    from inspection.evaluation.stack_value import judge_stack
    from inspection.filters import FilteredProfile, FilterOrder, ProfileFilter, filter_profile
    from inspection.fine import register, register_fine
    from inspection.freedoms import FreedomName, Freedoms
    from inspection.gaps import Gap, coverage, default_gap_max_mm
    from inspection.judged_rows import JudgedRows
    from inspection.kernels import Room, compiled_code_folder, while_compiling
    from inspection.limited_fit import LimitedFit, register_within
    from inspection.live import LiveInspection, LiveUpdate, State, rehearse
    from inspection.methods import FitName, Material, Method, RuleName, WeightName
    from inspection.minimum_zone import MinimumZone, fit_minimum_zone
    from inspection.nominal import NominalProfile, discretize
    from inspection.placements import PlacementProof, PlacementSearch
    from inspection.prefix import Prefix, PrefixSearch
    from inspection.profile_uncertainty import Contribution, ProfileUncertainty, StatedUncertainty, uncertainty_along
    from inspection.registration import Registration
    from inspection.result import InspectionResult, Stretch
    from inspection.rigid import RigidTransform
    from inspection.section import SectionPlane
    from inspection.self_crossings import Crossing, find_crossings
    from inspection.signed_deviations import Deviations, deviations, profile_error_mm
    from inspection.telling_points import telling_rows
    from inspection.terms import Terms
    from inspection.tolerance import DecisionRule, ToleranceZone
    from inspection.uncertainty import DeviationUncertainty, PartName, UncertaintyBudget, deviation_uncertainty, largest_by_noise_mm
    from inspection.verdict import NOT_JUDGED, Rejection, Verdict
    from inspection.zone_certificate import ConsumptionCertificate, ConsumptionFit, ZoneCertificate
    from inspection.zones import Transition, VaryingZone
else:
    from inspection.front_door import load_on_use

    _PLACES = {
        "inspection.synthetic": ("synthetic",),
        "inspection.certificate": ("certify_minimum_zone",),
        "inspection.characteristics.actual": ("ActualSection", "draw_actual_section"),
        "inspection.characteristics.airfoil": ("AirfoilValues", "ComparedAirfoil", "LeftOut", "compare_airfoil", "evaluate_airfoil"),
        "inspection.characteristics.camber": ("maximum_camber",),
        "inspection.characteristics.chord": ("ChordAngleMethod", "ChordMethod", "chord", "chord_angle"),
        "inspection.characteristics.edge_radius": ("EdgeRadiusMethod", "edge_radius"),
        "inspection.characteristics.inscribed": ("CamberLine", "InscribedCircles", "find_camber_line"),
        "inspection.characteristics.outline": ("AirfoilSection", "find_airfoil"),
        "inspection.characteristics.placement": ("displacement", "twist_by_chord", "twist_by_fit"),
        "inspection.characteristics.section_value": ("ComparedValue", "SectionValue", "compare_values"),
        "inspection.characteristics.stack": ("StackedSections", "StackingAxis", "bow", "fit_stacking_axis", "relative_twist", "taper"),
        "inspection.characteristics.stack_characteristic": (
            "MeasuredSection",
            "SectionShare",
            "StackCharacteristic",
            "StackCharacteristicResult",
            "StackingAxisMethod",
            "numbers_of",
        ),
        "inspection.characteristics.thickness": ("EdgeThicknessMethod", "ThicknessMethod", "edge_thickness", "maximum_thickness"),
        "inspection.coarse": ("register_coarse",),
        "inspection.compensation": ("Compensation",),
        "inspection.conclusion": ("Missing", "Reason", "reasons_of_abort"),
        "inspection.common_fit": ("CommonFit", "SectionToFit", "fit_together"),
        "inspection.consumption": ("fit_least_consumption",),
        "inspection.consumption_proof": ("certify_consumption",),
        "inspection.datum": ("DatumFeature", "DatumFeatures", "FoundDatum"),
        "inspection.curve": ("NurbsCurve",),
        "inspection.curve_check": ("CurveCheck", "Hollow", "check_curve"),
        "inspection.difference": ("Course", "Difference", "difference_along"),
        "inspection.errors": ("InspectionError", "NominalError", "NotMeasured", "RegistrationError"),
        "inspection.filters": ("FilteredProfile", "FilterOrder", "ProfileFilter", "filter_profile"),
        "inspection.fine": ("register", "register_fine"),
        "inspection.freedoms": ("FreedomName", "Freedoms"),
        "inspection.gaps": ("Gap", "coverage", "default_gap_max_mm"),
        "inspection.judged_rows": ("JudgedRows",),
        "inspection.kernels": ("Room", "compiled_code_folder", "while_compiling"),
        "inspection.limited_fit": ("LimitedFit", "register_within"),
        "inspection.live": ("LiveInspection", "LiveUpdate", "State", "rehearse"),
        "inspection.methods": ("FitName", "Material", "Method", "RuleName", "WeightName"),
        "inspection.minimum_zone": ("MinimumZone", "fit_minimum_zone"),
        "inspection.nominal": ("NominalProfile", "discretize"),
        "inspection.placements": ("PlacementProof", "PlacementSearch"),
        "inspection.prefix": ("Prefix", "PrefixSearch"),
        "inspection.profile_uncertainty": ("Contribution", "ProfileUncertainty", "StatedUncertainty", "uncertainty_along"),
        "inspection.registration": ("Registration",),
        "inspection.result": ("InspectionResult", "Stretch"),
        "inspection.rigid": ("RigidTransform",),
        "inspection.section": ("SectionPlane",),
        "inspection.self_crossings": ("Crossing", "find_crossings"),
        "inspection.signed_deviations": ("Deviations", "deviations", "profile_error_mm"),
        "inspection.telling_points": ("telling_rows",),
        "inspection.terms": ("Terms",),
        "inspection.tolerance": ("DecisionRule", "ToleranceZone"),
        "inspection.uncertainty": ("DeviationUncertainty", "PartName", "UncertaintyBudget", "deviation_uncertainty", "largest_by_noise_mm"),
        "inspection.verdict": ("NOT_JUDGED", "Rejection", "Verdict"),
        "inspection.characteristics.characteristic": (
            "Characteristic",
            "CharacteristicFit",
            "CharacteristicKind",
            "CharacteristicResult",
            "LineProfile",
            "Region",
            "SectionCharacteristic",
            "SectionKind",
            "WholeProfile",
            "WorstPlace",
        ),
        "inspection.evaluation.evaluate": (
            "Evaluation",
            "doubt_part",
            "evaluate",
            "with_found",
        ),
        "inspection.evaluation.datum": ("check_datum",),
        "inspection.evaluation.line_profile": ("zone_words",),
        "inspection.evaluation.region": (
            "FeatureName",
            "Features",
            "features_of",
            "region_between",
            "station_near",
        ),
        "inspection.evaluation.section_value": (
            "METHODS_OF_SECTIONS",
            "Outline",
            "with_nominal",
        ),
        "inspection.evaluation.so_far": ("EvaluationSoFar", "ScanSoFar"),
        "inspection.evaluation.stack_value": ("judge_stack",),
        "inspection.zone_certificate": ("ConsumptionCertificate", "ConsumptionFit", "ZoneCertificate"),
        "inspection.zones": ("Transition", "VaryingZone"),
    }

    __getattr__ = load_on_use(__name__, _PLACES)


__all__ = [
    "METHODS_OF_SECTIONS",
    "NOT_JUDGED",
    "ActualSection",
    "AirfoilSection",
    "AirfoilValues",
    "CamberLine",
    "Characteristic",
    "CharacteristicFit",
    "CharacteristicKind",
    "CharacteristicResult",
    "ChordAngleMethod",
    "ChordMethod",
    "CommonFit",
    "ComparedAirfoil",
    "ComparedValue",
    "Compensation",
    "ConsumptionCertificate",
    "ConsumptionFit",
    "Contribution",
    "Course",
    "Crossing",
    "CurveCheck",
    "DatumFeature",
    "DatumFeatures",
    "DecisionRule",
    "DeviationUncertainty",
    "Deviations",
    "Difference",
    "EdgeRadiusMethod",
    "EdgeThicknessMethod",
    "Evaluation",
    "EvaluationSoFar",
    "FeatureName",
    "Features",
    "FilterOrder",
    "FilteredProfile",
    "FitName",
    "FoundDatum",
    "FreedomName",
    "Freedoms",
    "Gap",
    "Hollow",
    "InscribedCircles",
    "InspectionError",
    "InspectionResult",
    "JudgedRows",
    "LeftOut",
    "LimitedFit",
    "LineProfile",
    "LiveInspection",
    "LiveUpdate",
    "Material",
    "MeasuredSection",
    "Method",
    "MinimumZone",
    "Missing",
    "NominalError",
    "NominalProfile",
    "NotMeasured",
    "NurbsCurve",
    "Outline",
    "PartName",
    "PlacementProof",
    "PlacementSearch",
    "Prefix",
    "PrefixSearch",
    "ProfileFilter",
    "ProfileUncertainty",
    "Reason",
    "Region",
    "Registration",
    "RegistrationError",
    "Rejection",
    "RigidTransform",
    "Room",
    "RuleName",
    "ScanSoFar",
    "SectionCharacteristic",
    "SectionKind",
    "SectionPlane",
    "SectionShare",
    "SectionToFit",
    "SectionValue",
    "StackCharacteristic",
    "StackCharacteristicResult",
    "StackedSections",
    "StackingAxis",
    "StackingAxisMethod",
    "State",
    "StatedUncertainty",
    "Stretch",
    "Terms",
    "ThicknessMethod",
    "ToleranceZone",
    "Transition",
    "UncertaintyBudget",
    "VaryingZone",
    "Verdict",
    "WeightName",
    "WholeProfile",
    "WorstPlace",
    "ZoneCertificate",
    "bow",
    "certify_consumption",
    "certify_minimum_zone",
    "check_curve",
    "check_datum",
    "chord",
    "chord_angle",
    "compare_airfoil",
    "compare_values",
    "compiled_code_folder",
    "coverage",
    "default_gap_max_mm",
    "deviation_uncertainty",
    "deviations",
    "difference_along",
    "discretize",
    "displacement",
    "doubt_part",
    "draw_actual_section",
    "edge_radius",
    "edge_thickness",
    "evaluate",
    "evaluate_airfoil",
    "features_of",
    "filter_profile",
    "find_airfoil",
    "find_camber_line",
    "find_crossings",
    "fit_least_consumption",
    "fit_minimum_zone",
    "fit_stacking_axis",
    "fit_together",
    "judge_stack",
    "largest_by_noise_mm",
    "maximum_camber",
    "maximum_thickness",
    "numbers_of",
    "profile_error_mm",
    "reasons_of_abort",
    "region_between",
    "register",
    "register_coarse",
    "register_fine",
    "register_within",
    "rehearse",
    "relative_twist",
    "station_near",
    "synthetic",
    "taper",
    "telling_rows",
    "twist_by_chord",
    "twist_by_fit",
    "uncertainty_along",
    "while_compiling",
    "with_found",
    "with_nominal",
    "zone_words",
]
