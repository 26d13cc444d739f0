"""What a drawing needs of a scan, in constant memory: the lowest and the highest deviation in every bin of station.

However many points arrive, a bin keeps its two extremes, so no spike is ever hidden and an hour of scanning takes no more
room than a minute. A reader asks for the bins that changed since it last looked.
"""

import threading
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

BINS = 16384  # over the whole length: finer than any screen, and still a bin for every pixel at a zoom of ten
STATION, DEVIATION, FOOT_X, FOOT_Y, NORMAL_X, NORMAL_Y, VERDICT = range(7)
COLUMNS = 7
_STRAIGHT_MM = 1e-7  # below this deviation the direction from foot to point is noise, and the whisker is invisible


class PointsVersion(NamedTuple):
    """How much a reader has seen: a version within a generation. When the generation changes, everything seen before is void."""

    generation: int
    version: int


@dataclass(frozen=True, slots=True, eq=False)
class ChangedBins:
    """Bins that changed, each with its lowest and its highest point.

    seen     : what to ask from next time
    bins     : (k,) int64
    extremes : (k, 2, 7) lowest, highest x station, deviation, foot x, y, unit normal x, y, verdict code
    """

    seen: PointsVersion
    bins: NDArray[np.int64]
    extremes: Array


class Extremes:
    """The two extreme points in each of `bins` bins along a profile of `length_mm`.

    Guarded by its own lock, which is held only while values are copied in or out. One thread adds; any thread reads.
    """

    def __init__(self, length_mm: float, middle_mm: float, generation: int = 0, bins: int = BINS) -> None:
        self.generation = generation
        self._length, self._middle, self._count = length_mm, middle_mm, bins
        self._lock = threading.Lock()
        self._version = 0
        self._extremes: Array = np.full((bins, 2, COLUMNS), np.nan)
        self._stamp = np.zeros(bins, dtype=np.int64)
        self._worst: Array | None = None

    def add(self, station_mm: Array, deviation_mm: Array, foot_mm: Array, actual_mm: Array, verdicts: NDArray[np.int8]) -> None:
        """Add m points. Points without a deviation are skipped."""
        known = np.flatnonzero(np.isfinite(deviation_mm))
        if not len(known):
            return
        bins = np.clip((station_mm[known] / self._length * self._count).astype(np.int64), 0, self._count - 1)
        order = np.lexsort((deviation_mm[known], bins))
        ordered = bins[order]
        first = np.flatnonzero(np.concatenate([[True], ordered[1:] != ordered[:-1]]))
        last = np.append(first[1:], len(ordered)) - 1
        touched = ordered[first]
        changes = []
        for side, ends, sign in ((0, first, 1.0), (1, last, -1.0)):
            rows = known[order[ends]]
            held = self._extremes[touched, side, DEVIATION]
            better = ~(sign * deviation_mm[rows] >= sign * held)  # an empty bin holds NaN, and any point is better
            points = _points_in_columns(rows[better], station_mm, deviation_mm, foot_mm, actual_mm, verdicts)
            changes.append((side, touched[better], points))
        self._take_over(changes)

    @property
    def worst(self) -> Array | None:
        """The seven numbers of the point farthest from the middle of the zone (7,), None without points."""
        return self._worst

    @property
    def stations_mm(self) -> Array:
        """Stations of all points held (k,); for the thread that adds."""
        held = self._extremes[~np.isnan(self._extremes[:, 0, DEVIATION])]
        return np.unique(held[:, :, STATION])

    @property
    def newest(self) -> PointsVersion:
        """The version of a reader that has seen everything up to now. Never blocks."""
        return PointsVersion(self.generation, self._version)

    def changed_since(self, seen: PointsVersion) -> ChangedBins:
        """The bins that changed after what was `seen`; all of them for a reader of another generation."""
        with self._lock:
            asked = seen.version if seen.generation == self.generation else 0
            bins = np.flatnonzero(self._stamp > asked)
            return ChangedBins(self.newest, bins, self._extremes[bins])

    def _take_over(self, changes: list[tuple[int, NDArray[np.int64], Array]]) -> None:
        with self._lock:
            self._version += 1
            for side, bins, points in changes:
                self._extremes[bins, side] = points
                self._stamp[bins] = self._version
        for _, _, points in changes:
            self._keep_worst(points)

    def _keep_worst(self, candidates: Array) -> None:
        if not len(candidates):
            return
        best = candidates[np.argmax(np.abs(candidates[:, DEVIATION] - self._middle))]
        if self._worst is None or abs(best[DEVIATION] - self._middle) > abs(self._worst[DEVIATION] - self._middle):
            self._worst = best.copy()


def _points_in_columns(
    rows: NDArray[np.int64], station_mm: Array, deviation_mm: Array, foot_mm: Array, actual_mm: Array, verdicts: NDArray[np.int8]
) -> Array:
    """The seven numbers of each row (k, 7)."""
    deviation = deviation_mm[rows]
    visible = np.abs(deviation) > _STRAIGHT_MM
    normal = (actual_mm[rows] - foot_mm[rows]) / np.where(visible, deviation, np.inf)[:, None]
    return np.column_stack([station_mm[rows], deviation, foot_mm[rows], normal, verdicts[rows]])
