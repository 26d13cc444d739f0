"""Points of a nominal profile as columns of text: x and y, with a constant z left out."""

import numpy as np

from cmmlink.nominal_files import NominalFile
from cmmlink.nominal_files.through_points import through_points
from drivers import UnitName, parse_columns, points_of
from inspection import NominalError

SUFFIXES = (".asc", ".csv", ".txt", ".xyz")

_FLAT = 1e-6  # of the size: z may vary by less


def read(text: str, scale: float, closed: bool | None, unit: UnitName | None) -> NominalFile:
    """Interpolate the points, in the order of the file."""
    columns = parse_columns(text)
    points, notes = points_of(columns, scale, unit)
    size, height = float(np.ptp(points[:, :2], axis=0).max()), points[:, 2]
    if float(np.ptp(height)) > _FLAT * size:
        line = columns.line_numbers[int(np.argmax(np.abs(height - height[0]) > _FLAT * size))]
        raise NominalError(f"line {line}: z runs from {height.min():g} to {height.max():g} mm; expected a plane profile, all at one z")
    if height.any():
        notes = (*notes, f"z = {height[0]:g} mm left out")
    return through_points(points[:, :2], columns.line_numbers, closed, "points", notes)
