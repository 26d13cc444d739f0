"""Plans of every kind: what may stand in them, and how they are read. This is the front door of the package."""

from cmmlink.plan.own_maps import map_of
from cmmlink.plan.scan import (
    Datum,
    Device,
    Discretisation,
    FileDevice,
    ModbusDevice,
    Nominal,
    Part,
    Plan,
    Registration,
    Section,
    SerialDevice,
    load_plan,
    place_of,
    with_own_maps,
)
from cmmlink.plan.surface import CtPlan, CutterName, NominalAt, load_ct_plan
from cmmlink.plan.yaml_model import Positive, Settings, line_of, read_model, words_of_allowed

__all__ = [
    "CtPlan",
    "CutterName",
    "Datum",
    "Device",
    "Discretisation",
    "FileDevice",
    "ModbusDevice",
    "Nominal",
    "NominalAt",
    "Part",
    "Plan",
    "Positive",
    "Registration",
    "Section",
    "SerialDevice",
    "Settings",
    "line_of",
    "load_ct_plan",
    "load_plan",
    "map_of",
    "place_of",
    "read_model",
    "with_own_maps",
    "words_of_allowed",
]
