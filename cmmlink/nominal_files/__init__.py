"""Nominal profiles from files: one file per format.

A format is a module of this package with two names, found by looking through the package, so that a new format is a new
file and nothing else:

    SUFFIXES : tuple[str, ...]                                                    lower case, with the dot
    def read(text: str, scale: float, closed: bool | None, unit: UnitName | None) -> NominalFile
    or, for what a CAD system writes, which may be no text and may hold many curves:
    def draw(path: Path, section: SectionPlane | None) -> Drawing                 both raise NominalError, naming line or entity
"""

import importlib
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Literal, Protocol, cast, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from cmmlink.errors import YamlError
from cmmlink.nominal_files.curve_words import notes_of, refuse_crossings
from drivers import PointFileError, UnitName, mm_per, read_bytes, read_text
from inspection import NominalError, NurbsCurve, SectionPlane, check_curve

if TYPE_CHECKING:
    from cmmlink.nominal_files.drawing import Drawing, DrawnCurve

_START = 4096  # bytes of a drawing that are looked at before it is read
_ALMOST_CLOSED = 0.05  # of the length: the widest gap, as of a blunt trailing edge, at which a curve still has an inside


@dataclass(frozen=True, slots=True)
class NominalFile:
    """A nominal profile as its file was understood.

    curve         : in mm
    source_format : the name of the format, like "uiuc-selig"
    notes         : what was assumed or left out, for the reader of the file
    layers        : the layers of a drawing that the curve is drawn on
    plane         : the plane of a curve that a drawing has in space; None for one that is drawn in x and y
    cut           : whether it is the section of a solid, and another one in another plane
    """

    curve: NurbsCurve
    source_format: str
    notes: tuple[str, ...]
    layers: tuple[str, ...] = ()
    plane: SectionPlane | None = None
    cut: bool = False


class NominalFormat(Protocol):
    """What a module of this package offers that reads text."""

    SUFFIXES: tuple[str, ...]

    def read(self, text: str, scale: float, closed: bool | None, unit: UnitName | None) -> NominalFile:
        """Understand the text of a file; `scale` is that of the `unit`, where one was given in words."""


@runtime_checkable
class DrawingFormat(Protocol):
    """What a module of this package offers that reads what CAD systems write."""

    SUFFIXES: tuple[str, ...]

    def draw(self, path: Path, section: SectionPlane | None) -> "Drawing":
        """The curves of a file; of a solid, those of its cut by the `section`."""


def load_nominal(
    path: Path,
    scale: float = 1.0,
    closed: bool | None = None,
    unit: UnitName | None = None,
    *,
    layer: str | None = None,
    curve: int | None = None,
    section: SectionPlane | None = None,
) -> NominalFile:
    """Read a nominal profile; the suffix of the file says its format.

    scale  : turns the file's unit into mm (the chord, for airfoils in chord units)
    unit   : the same in words, above whatever the file states; not beside a scale
    closed : True joins the end to the beginning, False keeps the curve open, None follows the file, which closes a blunt edge,
             and asks about a gap that may be either
    layer, curve : which curve of a drawing is the nominal, by its layer and by its number, the longest being 1
    section      : the plane of the section, if one was asked for: solids are cut there, and a curve in it has its coordinates

    The curve is checked: one that crosses itself is refused; where it changes its curvature, and its tightest hollow, are noted.

    Raises NominalError: file, line, what was found, what is expected.
    """
    if not (np.isfinite(scale) and scale > 0):
        raise NominalError(f"the scale must be a positive number, not {scale:g}")
    if unit is not None and scale != 1.0:
        raise NominalError(f"unit {unit} and scale {scale:g} are both given; expected one of them")
    reader = _format_of(path)
    try:
        with np.errstate(over="raise", divide="raise", invalid="raise"):
            if isinstance(reader, DrawingFormat):
                return _checked(_drawn(reader, path, scale, closed, unit, layer, curve, section))
            if layer is not None or curve is not None:
                raise NominalError("holds one curve; expected no layer and no number of a curve: these choose among those of a drawing")
            file = _checked(reader.read(read_text(path), mm_per(unit) if unit else scale, closed, unit))
        return replace(file, notes=(f"read in {unit}, as asked", *file.notes)) if unit else file
    except (PointFileError, YamlError, NominalError) as error:
        raise NominalError(f"{path}: {str(error).removeprefix(f'{path}: ')}") from None
    except FloatingPointError:
        raise NominalError(f"{path}: the numbers leave the range a curve can be computed in; expected a profile in mm") from None


def nominal_of_curve(curve: NurbsCurve) -> NominalFile:
    """A curve that was handed over, checked as one from a file is. Raises NominalError."""
    return _checked(NominalFile(curve, "curve", ()))


def nominal_of_points(points_mm: ArrayLike, closed: bool | None = None) -> NominalFile:
    """The nominal through points (k, 2), in their order, as if they stood in a file. Raises NominalError, naming rows from 0."""
    from cmmlink.nominal_files.through_points import through_points  # noqa: PLC0415 - it stands on this file

    try:
        points = np.ma.filled(np.ma.asarray(points_mm, dtype=np.float64), np.nan)  # what a mask hides is no number
    except (TypeError, ValueError):
        raise NominalError("no array of numbers; expected points of shape (k, 2)") from None
    if points.ndim != 2 or points.shape[1] != 2:
        raise NominalError(f"an array of shape {points.shape}; expected points of shape (k, 2)")
    unusable = ~np.isfinite(points).all(axis=1)
    if unusable.any():
        raise NominalError(f"row {int(unusable.argmax())}: not a finite number; expected coordinates in mm")
    return _checked(through_points(points, np.arange(len(points)), closed, "points", (), "row"))


def _drawn(
    reader: DrawingFormat,
    path: Path,
    scale: float,
    closed: bool | None,
    unit: UnitName | None,
    layer: str | None,
    curve: int | None,
    section: SectionPlane | None,
) -> NominalFile:
    """The chosen curve of a drawing. A scale of 1 leaves the unit to the file."""
    from cmmlink.nominal_files.drawing import Choice, nominal_of  # noqa: PLC0415 - only drawings need it

    if not read_bytes(path, _START).strip():
        raise NominalError("the file is empty")
    drawing = reader.draw(path, section)
    asked = mm_per(unit) if unit else None if scale == 1.0 else scale
    found = nominal_of(drawing, Choice(layer, curve), asked, closed, section)
    return NominalFile(found.curve, drawing.source_format, found.notes, found.layers, found.plane, drawing.cut)


def curves_in(
    path: Path, scale: float = 1.0, unit: UnitName | None = None, layer: str | None = None, section: SectionPlane | None = None
) -> "list[DrawnCurve]":
    """All curves of a drawing, or of a layer of it, longest first; none of a file that is no drawing, or cannot be read."""
    from cmmlink.nominal_files.drawing import curves_of  # noqa: PLC0415 - only drawings need it

    with suppress(NominalError, PointFileError):
        reader = _format_of(path)
        if isinstance(reader, DrawingFormat):
            asked = mm_per(unit) if unit else None if scale == 1.0 else scale
            return curves_of(reader.draw(path, section), asked, layer)
    return []


def known_suffixes() -> list[str]:
    """Suffixes of all formats, sorted."""
    return sorted(suffix for reader in _formats() for suffix in reader.SUFFIXES)


def goes_round(curve: NurbsCurve) -> bool:
    """True when the ends meet or leave a gap no wider than a blunt trailing edge. Such a curve has an inside and an outside."""
    start, end = curve.point(np.array(curve.domain))
    return curve.closed or float(np.hypot(*(end - start))) <= _ALMOST_CLOSED * curve.length_mm


def material_side(curve: NurbsCurve) -> Literal["left", "right"] | None:
    """Side of the direction of travel on which the inside of the profile lies; None for a curve too open to have one."""
    start, end = curve.domain
    points = curve.point(np.linspace(start, end, 2001))
    if not goes_round(curve):
        return None
    x, y = (points - points[0]).T
    return "left" if float((x[:-1] * y[1:] - x[1:] * y[:-1]).sum()) > 0 else "right"


def _checked(file: NominalFile) -> NominalFile:
    """The file with notes of what its curve was checked for. Raises NominalError when the curve crosses itself."""
    check = check_curve(file.curve, material_side(file.curve))
    refuse_crossings(check)
    return replace(file, notes=(*file.notes, *notes_of(check)))


def _formats() -> Iterator[NominalFormat | DrawingFormat]:
    """The modules of formats. Raises OSError where the folder cannot be read, which `pkgutil.iter_modules` takes for an empty one."""
    for name in sorted(file.name for file in resources.files(__name__).iterdir()):
        if name.endswith(".py") and name != "__init__.py":
            module = importlib.import_module(f"{__name__}.{name.removesuffix('.py')}")
            if hasattr(module, "SUFFIXES"):
                yield cast(NominalFormat, module)


def _format_of(path: Path) -> NominalFormat | DrawingFormat:
    suffix = path.suffix.lower()
    for reader in _formats():
        if suffix in reader.SUFFIXES:
            return reader
    raise NominalError(f"{path}: no nominal file is known by the suffix '{suffix}'; expected one of {', '.join(known_suffixes())}")
