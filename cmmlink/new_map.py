"""A register map made of what was seen in a device's registers: where its coordinates and its counter lie. For page and command line.

The map is one of the pattern `latest`: the device holds one point, and a new one takes its place.
"""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass

import yaml

from cmmlink.errors import PlanError, YamlError
from cmmlink.plan import read_model
from drivers import RegisterMap, Table, WordOrder, registers_of

FIELDS = ("x", "y", "z", "sequence")
_PLACE = re.compile(r"\s*([0-9]{1,5})\s*:\s*(u?int(?:16|32|64)|float(?:32|64))\s*")


@dataclass(frozen=True, slots=True)
class FieldPlace:
    """Where a number lies: its first register, counted from 0 as on the wire, and its type."""

    at: int
    kind: str


@dataclass(frozen=True, slots=True)
class MapAnswers:
    """What a map is made of.

    fields   : x, y, z and sequence, as far as the device has them
    mm_per_unit : of coordinates that are stored as whole numbers; numbers with a point are mm
    """

    device: str
    table: Table
    word_order: WordOrder
    fields: Mapping[str, FieldPlace]
    mm_per_unit: float = 1.0


def place_from(text: str, field: str) -> FieldPlace:
    """The place of a field from an answer like 41:float32. Raises PlanError."""
    found = _PLACE.fullmatch(text)
    if not found or int(found[1]) > 65535:
        raise PlanError(f"{field}: '{text}': expected the first register and the type, like 41:float32")
    return FieldPlace(int(found[1]), found[2])


def mm_per_unit_from(text: str) -> float:
    """The factor to mm from an answer like 0.001; 1 where there is none. Raises PlanError."""
    if not text.strip():
        return 1.0
    try:
        factor = float(text)
    except ValueError:
        factor = math.nan
    if not math.isfinite(factor) or factor == 0:
        raise PlanError(f"mm per unit: '{text}': expected a number that is not 0, like 0.001")
    return factor


def map_text(answers: MapAnswers) -> str:
    """The map, a short text with comments. Raises PlanError where the answers make no map that can be used."""
    fields = {name: answers.fields[name] for name in ("sequence", "x", "y", "z") if name in answers.fields}
    if not fields:
        raise PlanError("choose the registers of x and y first")
    _refuse_overlaps(fields)
    first = min(place.at for place in fields.values())
    lines = [
        "# The registers of a device, chosen by looking at their values. `cmmlink check` checks it; a plan names it as its map.",
        f"device: {_spelled(answers.device)}",
        f"table: {answers.table}",
        f"word_order: {answers.word_order}",
        "pattern: latest                # one point, and a new one takes its place",
        "points:",
        f"  at: {first}",
        "  fields:",
        *(f"    {name}: {_spelled(_field(name, place, first, answers.mm_per_unit))}" for name, place in fields.items()),
    ]
    if "sequence" not in fields:
        lines.append("# sequence: {at: ..., type: uint16} would count the points; without it what lay between two readings is not seen")
    text = "\n".join([*lines, ""])
    try:
        read_model(text, RegisterMap)
    except YamlError as error:
        raise PlanError(str(error)) from None
    return text


def _field(name: str, place: FieldPlace, first: int, mm_per_unit: float) -> dict[str, object]:
    scaled = name != "sequence" and not place.kind.startswith("float") and mm_per_unit != 1.0
    return {"at": place.at - first, "type": place.kind} | ({"scale": mm_per_unit} if scaled else {})


def _refuse_overlaps(fields: Mapping[str, FieldPlace]) -> None:
    """Raise PlanError where two fields share a register, which no device means."""
    owners: dict[int, str] = {}
    for name, place in fields.items():
        for register in range(place.at, place.at + registers_of(place.kind)):
            if register in owners:
                raise PlanError(
                    f"{owners[register]} and {name} both take register {register}; choose another register or type for one of them"
                )
            owners[register] = name


def _spelled(value: object) -> str:
    """A value on one line, as YAML spells it."""
    return yaml.safe_dump(value, default_flow_style=True, sort_keys=False, width=10_000, allow_unicode=True).removesuffix("...\n").strip()
