"""The two binary messages with what a page draws of a whole surface: the nominal once, and the voxels that changed.

Their layout stands in `protocol.py`. A point's normal is that of the nominal's nearest place.
"""

from datetime import datetime
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from cmmlink.console.drawing import header
from cmmlink.console.protocol import NOMINAL_SURFACE, SURFACE_POINTS
from cmmlink.worst_voxels import ChangedVoxels

if TYPE_CHECKING:
    from inspection.surface import NominalSurface

Array = NDArray[np.float64]

_PLACES = 60_000  # of the nominal, for drawing
_FULL = 127  # of a normal's bytes
_ROW = [("place", "<f4", 3), ("deviation", "<f4"), ("normal", "i1", 3), ("rest", "i1")]
_NUMBERED = [("slot", "<u4"), *_ROW]


class SurfaceDrawing:
    """Packs what is drawn of one nominal surface. Immutable once made, so that any thread may ask."""

    def __init__(self, nominal: "NominalSurface") -> None:
        self._places, self._normals = nominal.sample(_PLACES)
        self._spacing_mm = float(np.sqrt(nominal.area_mm2 / len(self._places)))
        self._tree = cKDTree(self._places, compact_nodes=False, balanced_tree=False)

    def nominal_message(self) -> bytes:
        """The nominal, as places spread over it."""
        rows = np.zeros(len(self._places), dtype=_ROW)
        rows["place"], rows["normal"] = self._places, _bytes_of(self._normals)
        return header(NOMINAL_SURFACE, 0, len(rows), 0, 0.0, self._spacing_mm) + rows.tobytes()

    def points_message(self, changed: ChangedVoxels, generation: int, verdict_at: datetime | None) -> bytes:
        """The voxels that changed; another generation than in the message before makes the page forget all points."""
        rows = np.zeros(len(changed.slots), dtype=_NUMBERED)
        places = changed.points[:, :3]
        rows["slot"], rows["place"], rows["deviation"] = changed.slots, places, changed.points[:, 3]
        if len(rows):
            rows["normal"] = _bytes_of(self._normals[self._tree.query(places)[1]])
        time_ms = verdict_at.timestamp() * 1e3 if verdict_at else 0.0
        return header(SURFACE_POINTS, generation, len(rows), 0, time_ms, changed.size_mm) + rows.tobytes()


def _bytes_of(normals: Array) -> NDArray[np.int8]:
    """Unit normals (n, 3) in a byte a coordinate."""
    return np.rint(_FULL * normals).astype(np.int8)
