"""What is shown of the points of a whole surface while they come in and at their end: the worst point of every voxel.

How much of the area is measured is an estimate while the scan runs, by places spread over the nominal; the result knows it exactly.
"""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from cmmlink.extremes import PointsVersion
from cmmlink.run_state import SurfaceRegion, WholeSurface, WorstPoint
from cmmlink.words import VERDICT_NAMES
from cmmlink.worst_voxels import MOST_VOXELS, ChangedVoxels, WorstVoxels
from inspection import ToleranceZone, Verdict

if TYPE_CHECKING:
    from cmmlink.surface_rows import SurfaceRows
    from inspection.surface import NominalSurface, SurfaceUpdate

Array = NDArray[np.float64]

_CROSSED = 2.0  # times the area of the surface by that of a voxel's side: so many voxels it passes through, and a few more
_PER_GAP = 2.0  # places in the widest gap that counts as measured
_FEWEST, _MOST = 500, 20_000  # places
_NEAR = 4  # places that one point may measure
_MOST_REGIONS = 100


class ShownSurface:
    """The points of one surface. One thread adds; any thread reads `newest`, `worst` and what changed.

    gap_max_mm : the diameter of the widest place without a point that counts as measured
    """

    def __init__(self, nominal: "NominalSurface", zone: ToleranceZone, gap_max_mm: float) -> None:
        wanted = nominal.area_mm2 * (_PER_GAP / gap_max_mm) ** 2
        places, _ = nominal.sample(int(np.clip(wanted, _FEWEST, _MOST)))
        self._tree = cKDTree(places)
        self._reach_mm = max(gap_max_mm / 2, float(np.sqrt(nominal.area_mm2 / len(places))))
        self._size_mm = float(np.sqrt(_CROSSED * nominal.area_mm2 / MOST_VOXELS))
        self._zone = zone
        self._empty(0)

    def _empty(self, generation: int) -> None:
        self._voxels = WorstVoxels(self._size_mm, self._zone.middle_mm, generation)
        self._measured = np.zeros(self._tree.n, dtype=np.bool_)

    def emptied(self) -> "ShownSurface":
        """The same without any point; to a reader everything before is void."""
        fresh = object.__new__(ShownSurface)
        fresh._tree, fresh._reach_mm, fresh._size_mm, fresh._zone = self._tree, self._reach_mm, self._size_mm, self._zone
        fresh._empty(self._voxels.generation + 1)
        return fresh

    def add(self, updates: "Sequence[SurfaceUpdate]") -> int:
        """Add what updates judged; gives how many of it look out now, whatever the pose can still move."""
        for update in updates:
            self._add(update.points_mm, update.deviation_mm)
        return sum(int(np.count_nonzero(update.verdicts == Verdict.NONCONFORM)) for update in updates)

    def add_rows(self, rows: "SurfaceRows") -> None:
        """Add rows of a result."""
        self._add(rows.actual_mm, rows.deviation_mm)

    def _add(self, points_mm: Array, deviation_mm: Array) -> None:
        held = self._voxels.add(points_mm, deviation_mm)
        near, places = self._tree.query(held, k=_NEAR, distance_upper_bound=self._reach_mm)
        self._measured[np.asarray(places)[np.isfinite(near)]] = True

    def coverage(self) -> float:
        """About the share of the area that was measured."""
        return float(self._measured.mean())

    @property
    def notes(self) -> tuple[str, ...]:
        """What the rows of the result are to be told beside: nothing, since a fit does not follow where points lie dense."""
        return ()

    @property
    def worst(self) -> WorstPoint | None:
        """The point farthest from the middle of the zone, None without points."""
        worst = self._voxels.worst
        if worst is None:
            return None
        x, y, z, deviation = worst.tolist()
        return WorstPoint(0.0, deviation, x, y, VERDICT_NAMES[self._zone.verdict([deviation])], z)

    @property
    def newest(self) -> PointsVersion:
        """The version of a reader that has seen all points up to now. Never waits."""
        return self._voxels.newest

    def changed_since(self, seen: PointsVersion) -> ChangedVoxels:
        """The voxels that changed after what was `seen`."""
        return self._voxels.changed_since(seen)


def whole_surface_in(result: Mapping[str, Any], gap_max_mm: float) -> WholeSurface:
    """What a result tells of a surface beside its points."""
    regions, unmeasured = result.get("regions", ()), result.get("unmeasured", ())
    rows = [
        SurfaceRegion(number, region["worst_mm"], region["area_mm2"], region["points"], *region["worst_at_mm"])
        for number, region in enumerate(regions[:_MOST_REGIONS], start=1)
    ]
    area = sum(place["area_mm2"] for place in unmeasured)
    return WholeSurface(gap_max_mm, tuple(rows), len(regions) - len(rows), len(unmeasured), area)
