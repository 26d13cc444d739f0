"""The answer of `cmmlink nominal --json` as a nominal: what was understood of any other file, written so that it reads back to the bit."""

import json
from typing import Any

import numpy as np

from cmmlink.nominal_files import NominalFile
from cmmlink.nominal_files.nurbs_yaml import read as read_curve
from drivers import UnitName
from inspection import NominalError, SectionPlane

SUFFIXES = (".json",)

_KEYS = ("degree", "knots", "control_points_mm", "weights", "closed")
_AXES = ("origin_mm", "normal", "x_axis")


def read(text: str, scale: float, closed: bool | None, unit: UnitName | None) -> NominalFile:
    """Take the curve as it stands, with the plane that it lies in; what else the answer says is not needed."""
    try:
        given = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise NominalError(f"is no JSON: {error}; expected the answer of `cmmlink nominal --json`") from None
    missing = [key for key in _KEYS[:3] if not isinstance(given, dict) or key not in given]
    if missing:
        raise NominalError(f"has no {missing[0]}; expected the answer of `cmmlink nominal --json`, with {', '.join(_KEYS)}")
    found = read_curve(json.dumps({key: given[key] for key in _KEYS if given.get(key) is not None}), scale, closed, unit)
    plane = None if given.get("plane") is None else _plane_of(given["plane"], scale)
    return NominalFile(found.curve, "nominal-json", found.notes, plane=plane)


def _plane_of(given: Any, scale: float) -> SectionPlane:
    """The plane of a curve in space. Raises NominalError where it is none."""
    try:
        origin, normal, x_axis = (np.array(given[name], dtype=np.float64) for name in _AXES)
        return SectionPlane(origin * scale, x_axis, normal)
    except (KeyError, TypeError, ValueError) as error:
        raise NominalError(f"plane: expected {', '.join(_AXES)}, three numbers each ({error})") from None
