"""STEP, of every application protocol: drawn curves, or the section of a solid by the plan's plane."""

import re
from pathlib import Path

from cmmlink.nominal_files.drawing import Drawing
from cmmlink.nominal_files.solids import drawing_by_kernel
from drivers import read_bytes
from inspection import NominalError, SectionPlane

SUFFIXES = (".p21", ".step", ".stp")

_PREFIXES = {
    "": ("m", 1000.0),
    "MILLI": ("mm", 1.0),
    "CENTI": ("cm", 10.0),
    "DECI": ("dm", 100.0),
    "MICRO": ("um", 1e-3),
    "KILO": ("km", 1e6),
}
_NAMES = {"INCH": ("inch", 25.4), "FOOT": ("foot", 304.8), "FEET": ("foot", 304.8), "MIL": ("mil", 0.0254)}
_PROTOCOLS = {"CONFIG_CONTROL": "ap203", "AP203": "ap203", "AUTOMOTIVE_DESIGN": "ap214", "AP214": "ap214", "AP242": "ap242"}
_ENTITY = re.compile(r"=\s*\(([^;]*\bLENGTH_UNIT\b[^;]*)\)\s*;")


def draw(path: Path, section: SectionPlane | None) -> Drawing:
    """The curves of a file as Open CASCADE reads it, in the unit of the file."""
    text = read_bytes(path).decode("latin-1")
    if "ISO-10303-21" not in text[:1000]:
        raise NominalError("does not begin as STEP does (ISO-10303-21); expected a STEP file: export it again")
    if "END-ISO-10303-21" not in text[-1000:]:
        raise NominalError("has no end (END-ISO-10303-21); expected a whole STEP file: it is cut off")
    schema = re.search(r"FILE_SCHEMA\s*\(\s*\(\s*'([^']*)", text)
    protocol = next((name for words, name in _PROTOCOLS.items() if schema and words in schema[1].upper()), "")
    mm_per_unit, unit = _unit(text)
    return drawing_by_kernel(path, "step", section, f"step-{protocol}" if protocol else "step", mm_per_unit, unit)


def _unit(text: str) -> tuple[float | None, str]:
    """The unit of length of the contexts of a file. Where they have several, Open CASCADE turns each into mm."""
    found: set[tuple[str, float]] = set()
    for words in _ENTITY.findall(text.upper()):
        named = re.search(r"CONVERSION_BASED_UNIT\s*\(\s*'([^']*)'", words)
        prefixed = re.search(r"SI_UNIT\s*\(\s*(?:\.(\w+)\.|\$)?\s*,\s*\.METRE\.", words)
        if named and named[1].strip() in _NAMES:
            found.add(_NAMES[named[1].strip()])
        elif prefixed and (prefixed[1] or "") in _PREFIXES:
            found.add(_PREFIXES[prefixed[1] or ""])
    based_on = {("mm", 1.0), ("m", 1000.0)}  # what an inch is spelt by stands in the file as well
    others = found - based_on
    if len(others) == 1:
        found = others
    if not found:
        return None, "states no unit of length that is known"
    if len(found) > 1:
        return 1.0, f"mm, from {' and '.join(sorted(name for name, _ in found))} as the parts of the file have it"
    name, mm = found.pop()
    return mm, name
