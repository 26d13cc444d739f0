"""What plans may hold, as JSON Schema: editors complete and check a plan with it while it is written."""

from typing import Any

from cmmlink.plan.characteristics import ProfileZone
from cmmlink.plan.scan import Plan
from cmmlink.plan.serial_numbers import SerialNumbers
from cmmlink.plan.surface import CtPlan
from cmmlink.plan.uncertainty import Mpe
from cmmlink.plan.whole_surface import SurfacePlan

DIALECT = "https://json-schema.org/draft/2020-12/schema"


def schema_of_plans() -> dict[str, Any]:
    """One schema for plans of every kind: a plan of a CT surface has a mesh, one of a whole surface has a surface."""
    scan, stack, surface = (_as_yaml(model.model_json_schema()) for model in (Plan, CtPlan, SurfacePlan))
    definitions = scan.pop("$defs") | stack.pop("$defs") | surface.pop("$defs")
    for notation in (ProfileZone, Mpe, SerialNumbers):  # they may be spelled as text as well
        definitions[notation.__name__] = {"anyOf": [definitions[notation.__name__], {"type": "string"}]}
    return {
        "$schema": DIALECT,
        "title": "Inspection plan of cmmlink",
        "if": {"required": ["mesh"]},
        "then": {"$ref": "#/$defs/CtPlan"},
        "else": {
            "if": {"required": ["surface"]},
            "then": {"$ref": "#/$defs/SurfacePlan"},
            "else": {"$ref": "#/$defs/Plan"},
        },
        "$defs": definitions | {"Plan": scan, "CtPlan": stack, "SurfacePlan": surface},
    }


def _as_yaml(schema: Any) -> Any:
    """The same where text may look like a number, as a serial number does: an editor takes it for one, and a plan takes it as text."""
    if isinstance(schema, list):
        return [_as_yaml(inner) for inner in schema]
    if not isinstance(schema, dict):
        return schema
    inner = {key: _as_yaml(value) for key, value in schema.items()}
    is_text = schema.get("type") == "string" and not {"const", "enum", "format"} & set(schema)
    return inner | {"type": ["string", "number"]} if is_text else inner
