"""What Open CASCADE reads of a file, as a drawing: drawn curves, or the section of solids and surfaces by a plane."""

from pathlib import Path

import numpy as np

from cmmlink.nominal_files.chains import counted_names
from cmmlink.nominal_files.drawing import Drawing, words_of_plane
from cmmlink.nominal_files.pieces import Piece
from drivers import CadError
from drivers.cad import CadCurves, Kind, OcctProcess, read_cad
from inspection import NominalError, SectionPlane

_XY = ((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))


def drawing_by_kernel(
    path: Path, kind: Kind, section: SectionPlane | None, source_format: str, mm_per_unit: float | None, unit: str
) -> Drawing:
    """The curves of a file in its own unit; faces are cut by the plane that was asked for, or by that of x and y. Raises NominalError."""
    origin, normal = _XY if section is None else (tuple(section.origin_mm.tolist()), tuple(section.normal.tolist()))
    try:
        read = read_cad(path, kind, origin, normal)
    except CadError as error:
        raise NominalError(str(error)) from None
    to_unit = np.array([1 / (mm_per_unit or 1.0)] * 3 + [1.0])
    pieces = [Piece(curve.degree, curve.poles * to_unit, curve.knots, name=f"edge {i}") for i, curve in enumerate(read.curves, 1)]
    return Drawing(tuple(pieces), source_format, mm_per_unit, unit, has_layers=False, cut=read.cut, notes=tuple(_notes(read, section)))


def words_on_kernel() -> str:
    """Whether STEP and solids can be read on this computer, in a sentence; Open CASCADE is loaded to know."""
    try:
        with OcctProcess() as process:
            process.load()
    except CadError as error:
        return f"STEP and solids cannot be read: {error}"
    return "Open CASCADE: loaded; STEP files and sections of solids can be read"


def _notes(read: CadCurves, section: SectionPlane | None) -> list[str]:
    notes = [f"left out: {counted_names(read.left_out)}"] if read.left_out else []
    if not read.cut:
        return [*notes, f"the faces of the file ({read.faces}) left out beside the drawn curves"] if read.faces else notes
    faces = f"{read.faces} face{'' if read.faces == 1 else 's'}"
    if section is None:
        notes.append(f"the section of {faces} by the plane z = 0: no other section was asked for")
    else:
        notes.append(f"the section of {faces} by the plane {words_of_plane(section)}")
    if read.residual_mm:
        notes.append(f"between its points the section leaves free-form faces by {read.residual_mm:.1g} mm at most")
    return notes
