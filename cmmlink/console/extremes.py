"""What a drawing needs of a scan, in constant memory: the lowest and the highest deviation in every bin of station.

However many points arrive, a bin keeps its two extremes, so no spike is ever hidden and an hour of scanning takes no more
room than a minute. A reader asks for the bins that changed since it last looked.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

BINS = 16384  # over the whole length: finer than any screen, and still a bin for every pixel at a zoom of ten
STATION, DEVIATION, FOOT_X, FOOT_Y, NORMAL_X, NORMAL_Y, VERDICT = range(7)
_STRAIGHT_MM = 1e-7  # below this deviation the direction from foot to point is noise, and the whisker is invisible


@dataclass(frozen=True, slots=True, eq=False)
class ChangedBins:
    """Bins that changed, each with its lowest and its highest point.

    generation : another number than before says that everything sent earlier is void
    version    : what to ask from next time
    bins       : (k,) int64
    extremes   : (k, 2, 7) lowest, highest x station, deviation, foot x, y, unit normal x, y, verdict code
    """

    generation: int
    version: int
    bins: NDArray[np.int64]
    extremes: Array


class Extremes:
    """The two extreme points in each of `BINS` bins along a profile of `length_mm`."""

    def __init__(self, length_mm: float, middle_mm: float, bins: int = BINS) -> None:
        self.generation, self.version = 0, 0
        self._length, self._middle, self._count = length_mm, middle_mm, bins
        self._extremes: Array = np.full((bins, 2, 7), np.nan)
        self._stamp = np.zeros(bins, dtype=np.int64)
        self._worst: Array | None = None

    def clear(self) -> None:
        """Forget every point: what follows is told anew."""
        self.generation += 1
        self.version += 1
        self._extremes.fill(np.nan)
        self._stamp.fill(0)
        self._worst = None

    def add(self, station_mm: Array, deviation_mm: Array, foot_mm: Array, actual_mm: Array, verdicts: NDArray[np.int8]) -> None:
        """Take in m points; those without a deviation are passed over."""
        known = np.flatnonzero(np.isfinite(deviation_mm))
        if not len(known):
            return
        self.version += 1
        bins = np.clip((station_mm[known] / self._length * self._count).astype(np.int64), 0, self._count - 1)
        order = np.lexsort((deviation_mm[known], bins))
        ordered = bins[order]
        first = np.flatnonzero(np.concatenate([[True], ordered[1:] != ordered[:-1]]))
        last = np.append(first[1:], len(ordered)) - 1
        touched = ordered[first]
        for side, ends, sign in ((0, first, 1.0), (1, last, -1.0)):
            rows = known[order[ends]]
            held = self._extremes[touched, side, DEVIATION]
            better = ~(sign * deviation_mm[rows] >= sign * held)  # an empty bin holds NaN and takes whatever comes
            rows = rows[better]
            self._extremes[touched[better], side] = _described(rows, station_mm, deviation_mm, foot_mm, actual_mm, verdicts)
            self._stamp[touched[better]] = self.version
            self._keep_worst(self._extremes[touched[better], side])

    @property
    def worst(self) -> Array | None:
        """The seven numbers of the point farthest from the middle of the zone (7,), None without points."""
        return self._worst

    @property
    def stations_mm(self) -> Array:
        """Stations of all points held (k,)."""
        held = self._extremes[~np.isnan(self._extremes[:, 0, DEVIATION])]
        return np.unique(held[:, :, STATION])

    def changed_since(self, version: int, generation: int) -> ChangedBins:
        """The bins that changed after `version`; all of them for a reader of another generation."""
        asked = version if generation == self.generation else 0
        bins = np.flatnonzero(self._stamp > asked)
        return ChangedBins(self.generation, self.version, bins, self._extremes[bins])

    def _keep_worst(self, candidates: Array) -> None:
        if not len(candidates):
            return
        best = candidates[np.argmax(np.abs(candidates[:, DEVIATION] - self._middle))]
        if self._worst is None or abs(best[DEVIATION] - self._middle) > abs(self._worst[DEVIATION] - self._middle):
            self._worst = best.copy()


def _described(
    rows: NDArray[np.int64], station_mm: Array, deviation_mm: Array, foot_mm: Array, actual_mm: Array, verdicts: NDArray[np.int8]
) -> Array:
    """The seven numbers of each row (k, 7)."""
    deviation = deviation_mm[rows]
    visible = np.abs(deviation) > _STRAIGHT_MM
    normal = (actual_mm[rows] - foot_mm[rows]) / np.where(visible, deviation, np.inf)[:, None]
    return np.column_stack([station_mm[rows], deviation, foot_mm[rows], normal, verdicts[rows]])
