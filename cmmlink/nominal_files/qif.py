"""QIF 3 (ISO 23952): the splines and segments that a document holds as geometry of its product (GeometrySet, Curve13Set).

Curves of other kinds, and those that a transform places, are left out and named.
"""

from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from cmmlink.nominal_files.chains import counted_names
from cmmlink.nominal_files.drawing import Drawing
from cmmlink.nominal_files.pieces import Piece, polyline, spline
from drivers import read_bytes
from inspection import NominalError, SectionPlane

Array = NDArray[np.float64]

SUFFIXES = (".qif",)

_QIF = "{http://qifstandards.org/xsd/qif3}"
_CURVES = f"{_QIF}Product/{_QIF}GeometrySet/{_QIF}Curve13Set"
_UNIT = f"{_QIF}FileUnits/{_QIF}PrimaryUnits/{_QIF}LinearUnit"


def draw(path: Path, section: SectionPlane | None) -> Drawing:
    """The curves of a document, in its unit. Raises NominalError."""
    try:
        root = ElementTree.fromstring(read_bytes(path))
    except (ElementTree.ParseError, ValueError) as error:
        raise NominalError(f"is no XML that can be read: {error}; expected a QIF 3 document") from None
    if root.tag != f"{_QIF}QIFDocument":
        raise NominalError(f"begins with {root.tag.rpartition('}')[2]!r:.60}; expected a QIFDocument of QIF 3")
    pieces, left_out = [], []
    for curve in root.iterfind(f"{_CURVES}/*"):
        kind, name = curve.tag.removeprefix(_QIF), f"curve {curve.get('id', '?')}"
        if kind not in ("Nurbs13", "Segment13") or curve.find(f"{_QIF}Transform") is not None:
            left_out.append(kind if kind not in ("Nurbs13", "Segment13") else f"{kind} with a transform")
            continue
        try:
            pieces.append(_nurbs(curve, name) if kind == "Nurbs13" else _segment(curve))
        except NominalError as error:
            raise NominalError(f"{name}: {error}") from None
    mm_per_unit, unit = _unit(root)
    notes = [f"left out: {counted_names(left_out)}"] if left_out else []
    if any(np.ptp(piece.poles[:, 3]) for piece in pieces):  # the schema says neither
        notes.insert(0, "control points of rational splines are taken as they stand, not multiplied by their weights")
    return Drawing(tuple(pieces), "qif-3", mm_per_unit, unit, has_layers=False, notes=tuple(notes))


def _nurbs(curve: ElementTree.Element, name: str) -> Piece:
    core = _part(curve, "Nurbs13Core")
    degree = int(_numbers(core, "Order")[0]) - 1
    weights = _numbers(core, "Weights") if core.find(f"{_QIF}Weights") is not None else None
    points, knots = _points(core, "CPs"), _numbers(core, "Knots")
    low, high = _domain(core, knots, degree)
    return replace(spline(degree, points, knots, weights, (low, high)), name=name)


def _segment(curve: ElementTree.Element) -> Piece:
    core = _part(curve, "Segment13Core")
    return polyline(np.vstack([_points(core, "StartPoint"), _points(core, "EndPoint")]))


def _domain(core: ElementTree.Element, knots: Array, degree: int) -> tuple[float, float]:
    """The part of a spline that is used."""
    told = core.get("domain", "").split()
    if not told and len(knots) > 2 * degree:
        return float(knots[degree]), float(knots[-degree - 1])
    if len(told) != 2:
        raise NominalError(f"domain is {' '.join(told)!r:.60}; expected two parameters")
    return _number(told[0], "domain"), _number(told[1], "domain")


def _part(parent: ElementTree.Element, name: str) -> ElementTree.Element:
    found = parent.find(f"{_QIF}{name}")
    if found is None:
        raise NominalError(f"has no {name}")
    return found


def _points(core: ElementTree.Element, name: str) -> Array:
    if (other := _part(core, name).get("linearUnit")) is not None:
        raise NominalError(f"{name} is in a unit of its own ({other}); expected that of the document")
    numbers = _numbers(core, name)
    if len(numbers) % 3:
        raise NominalError(f"{name}: {len(numbers)} numbers; expected three for each point")
    return numbers.reshape(-1, 3)


def _numbers(core: ElementTree.Element, name: str) -> Array:
    words = (_part(core, name).text or "").split()
    if not words:
        raise NominalError(f"{name} holds no number")
    return np.array([_number(word, name) for word in words])


def _number(word: str, name: str) -> float:
    try:
        value = float(word)
    except ValueError:
        value = np.nan
    if not np.isfinite(value):
        raise NominalError(f"{name}: {word!r:.40}; expected a finite number")
    return value


def _unit(root: ElementTree.Element) -> tuple[float | None, str]:
    """The primary unit of length; a conversion says how many metres it is."""
    unit = root.find(_UNIT)
    if unit is None:
        return None, "states no unit of length"
    name = (unit.findtext(f"{_QIF}UnitName") or "").strip()
    factor = unit.findtext(f"{_QIF}UnitConversion/{_QIF}Factor")
    if factor is None and name in ("m", "meter", "metre"):
        return 1000.0, name
    if factor is None:
        return None, f"states the unit {name!r:.40} without its conversion to metres"
    mm = float(f"{1000 * _number(factor, 'UnitConversion'):.15g}")
    return (mm, name) if mm > 0 else (None, f"states the unit {name!r:.40} of {factor} m")
