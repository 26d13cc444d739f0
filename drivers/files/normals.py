"""The outward directions that a file of points gives beside its coordinates."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from drivers.files.column_choice import are_directions
from drivers.files.text_table import parse_columns, read_plain, read_text

Array = NDArray[np.float64]

_NAMES = (("nx", "ny", "nz"), ("normal_x", "normal_y", "normal_z"), ("normalx", "normaly", "normalz"), ("i", "j", "k"))


def read_normals(path: Path) -> Array | None:
    """The normals (m, 3) of a file that `read_points` takes, row by row as its points are; None where it has none.

    They are found by their names, or as the last three of six unnamed columns, where these all have length 1. An npy array has
    none. Raises PointFileError for a file that is no table.
    """
    if path.suffix.lower() == ".npy":
        return None
    table = read_plain(path) or parse_columns(read_text(path))
    values, names = table.values, tuple(name.strip().lower() for name in table.names)
    for wanted in _NAMES:
        if all(name in names for name in wanted):
            return np.asarray(values[:, [names.index(name) for name in wanted]], dtype=np.float64)
    if not names and values.shape[1] == 6 and are_directions(values):
        return np.asarray(values[:, 3:], dtype=np.float64)
    return None
