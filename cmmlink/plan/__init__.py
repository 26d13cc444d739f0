"""Plans of every kind: what may stand in them, and how they are read. This is the front door of the package."""

TYPE_CHECKING = False  # as type checkers read it; `typing` itself takes longer to load than all of this

if TYPE_CHECKING:
    from cmmlink.plan.answer import Answer
    from cmmlink.plan.characteristics import AskedCharacteristic, AskedDatum, AskedFilter, AskedProfile, Place
    from cmmlink.plan.cutters import CutterName
    from cmmlink.plan.datum import Datum
    from cmmlink.plan.deciding import PROFILE, Deciding
    from cmmlink.plan.dme import AskedScan, CircleScan, CurveScan, LineScan, PointsScan, UnknownScan
    from cmmlink.plan.formats import FormatName
    from cmmlink.plan.given import plan_given_by
    from cmmlink.plan.key_search import KeyEntry, all_keys, keys_named
    from cmmlink.plan.mistakes import PlanMistake, find_mistakes, kind_of, kind_of_plan
    from cmmlink.plan.own_maps import map_of
    from cmmlink.plan.papers import LanguageName, PaperName, SectionPages
    from cmmlink.plan.report import ReportSettings
    from cmmlink.plan.results import NO_RESULTS, Results
    from cmmlink.plan.scan import (
        Discretisation,
        Nominal,
        Part,
        Plan,
        Registration,
        Section,
        load_plan,
        place_of,
    )
    from cmmlink.plan.scan_devices import Device, DmeDevice, FileDevice, LinesDevice, ModbusDevice, SerialDevice, with_own_maps
    from cmmlink.plan.schema import schema_of_plans
    from cmmlink.plan.serial_numbers import SerialNumbers, next_serial_number
    from cmmlink.plan.stack_characteristics import AskedOfStack
    from cmmlink.plan.surface import CtPlan, NominalAt, load_ct_plan
    from cmmlink.plan.surface_fits import SurfaceFit
    from cmmlink.plan.whole_surface import SurfacePlan, load_surface_plan
    from cmmlink.plan.yaml_model import Positive, Settings, line_of, read_model, texts_of, value_of, words_of_allowed
else:
    from cmmlink.front_door import load_on_use

    _PLACES = {
        "cmmlink.plan.answer": ("Answer",),
        "cmmlink.plan.deciding": ("PROFILE", "Deciding"),
        "cmmlink.plan.given": ("plan_given_by",),
        "cmmlink.plan.key_search": ("KeyEntry", "all_keys", "keys_named"),
        "cmmlink.plan.serial_numbers": ("SerialNumbers", "next_serial_number"),
        "cmmlink.plan.schema": ("schema_of_plans",),
        "cmmlink.plan.mistakes": ("PlanMistake", "find_mistakes", "kind_of", "kind_of_plan"),
        "cmmlink.plan.formats": ("FormatName",),
        "cmmlink.plan.own_maps": ("map_of",),
        "cmmlink.plan.papers": ("LanguageName", "PaperName", "SectionPages"),
        "cmmlink.plan.report": ("ReportSettings",),
        "cmmlink.plan.results": ("NO_RESULTS", "Results"),
        "cmmlink.plan.datum": ("Datum",),
        "cmmlink.plan.scan_devices": ("Device", "DmeDevice", "FileDevice", "LinesDevice", "ModbusDevice", "SerialDevice", "with_own_maps"),
        "cmmlink.plan.scan": (
            "Discretisation",
            "Nominal",
            "Part",
            "Plan",
            "Registration",
            "Section",
            "load_plan",
            "load_surface_plan",
            "place_of",
        ),
        "cmmlink.plan.characteristics": ("AskedCharacteristic", "AskedDatum", "AskedFilter", "AskedProfile", "Place"),
        "cmmlink.plan.cutters": ("CutterName",),
        "cmmlink.plan.dme": ("AskedScan", "CircleScan", "CurveScan", "LineScan", "PointsScan", "UnknownScan"),
        "cmmlink.plan.stack_characteristics": ("AskedOfStack",),
        "cmmlink.plan.surface": ("CtPlan", "NominalAt", "load_ct_plan"),
        "cmmlink.plan.surface_fits": ("SurfaceFit",),
        "cmmlink.plan.whole_surface": ("SurfacePlan", "load_surface_plan"),
        "cmmlink.plan.yaml_model": ("Positive", "Settings", "line_of", "read_model", "texts_of", "value_of", "words_of_allowed"),
    }

    __getattr__ = load_on_use(__name__, _PLACES)


__all__ = [
    "NO_RESULTS",
    "PROFILE",
    "Answer",
    "AskedCharacteristic",
    "AskedDatum",
    "AskedFilter",
    "AskedOfStack",
    "AskedProfile",
    "AskedScan",
    "CircleScan",
    "CtPlan",
    "CurveScan",
    "CutterName",
    "Datum",
    "Deciding",
    "Device",
    "Discretisation",
    "DmeDevice",
    "FileDevice",
    "FormatName",
    "KeyEntry",
    "LanguageName",
    "LineScan",
    "LinesDevice",
    "ModbusDevice",
    "Nominal",
    "NominalAt",
    "PaperName",
    "Part",
    "Place",
    "Plan",
    "PlanMistake",
    "PointsScan",
    "Positive",
    "Registration",
    "ReportSettings",
    "Results",
    "Section",
    "SectionPages",
    "SerialDevice",
    "SerialNumbers",
    "Settings",
    "SurfaceFit",
    "SurfacePlan",
    "UnknownScan",
    "all_keys",
    "find_mistakes",
    "keys_named",
    "kind_of",
    "kind_of_plan",
    "line_of",
    "load_ct_plan",
    "load_plan",
    "load_surface_plan",
    "map_of",
    "next_serial_number",
    "place_of",
    "plan_given_by",
    "read_model",
    "schema_of_plans",
    "texts_of",
    "value_of",
    "with_own_maps",
    "words_of_allowed",
]
