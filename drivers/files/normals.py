"""The outward directions that a table of points gives beside its coordinates."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivers.files.column_choice import are_directions
from drivers.files.plain_rows import Room

Array = NDArray[np.float64]

_NAMES = (("nx", "ny", "nz"), ("normal_x", "normal_y", "normal_z"), ("normalx", "normaly", "normalz"), ("i", "j", "k"))
_ROWS_AT_ONCE = 1 << 16


def places_of_normals(names: Sequence[str], values: NDArray[Any]) -> tuple[int, ...]:
    """The columns (from 0) of values (m, c) that hold normals; none where there are none.

    They are found by their names, or as the last three of six unnamed columns, where these all have length 1.
    """
    spelled = [name.strip().lower() for name in names]
    for wanted in _NAMES:
        if all(name in spelled for name in wanted):
            return tuple(spelled.index(name) for name in wanted)
    return (3, 4, 5) if not names and values.shape[1] == 6 and are_directions(values) else ()


def normals_at(places: Sequence[int], values: NDArray[Any], room: Room = np.empty) -> Array | None:
    """The normals (m, 3) in three columns of values (m, c), in pieces: only they are held. None where no columns are given."""
    if not places:
        return None
    normals = room((len(values), 3), np.float64)
    for first in range(0, len(values), _ROWS_AT_ONCE):
        normals[first : first + _ROWS_AT_ONCE] = values[first : first + _ROWS_AT_ONCE, list(places)]
    return normals
