"""What a view of a surface needs of a scan, in constant memory: the worst point in every voxel of space.

However many points arrive, a voxel keeps the point farthest from the middle of the zone, so that no defect is hidden by thinning: what is
shown is what was measured, and the worst of it. Where too many voxels hold points, they double their size. Neither the order of the
points nor their batches change what is held at the end. A reader asks for the voxels that changed since it last looked.
"""

import threading
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cmmlink.extremes import PointsVersion

Array = NDArray[np.float64]
Index = NDArray[np.int64]

MOST_VOXELS = 300_000  # as many points as a screen can turn thirty times a second
_MOST_CELLS = 1 << 20  # along each axis, on both sides of zero together: what is farther off counts as lying at the end
_X, _Y, _Z, _DEVIATION = range(4)
COLUMNS = 4


@dataclass(frozen=True, slots=True, eq=False)
class ChangedVoxels:
    """Voxels that changed, each with its worst point.

    seen    : what to ask from next time
    size_mm : of a voxel
    slots   : (k,) int64 the number of each voxel, from 0, in the order in which they were first reached
    points  : (k, 4) x, y, z and deviation
    """

    seen: PointsVersion
    size_mm: float
    slots: Index
    points: Array


class WorstVoxels:
    """The worst point in each voxel of `size_mm`.

    Guarded by its own lock, which is held only while values are copied in or out. One thread adds; any thread reads.
    """

    def __init__(self, size_mm: float, middle_mm: float, generation: int = 0, most: int = MOST_VOXELS) -> None:
        self._size, self._middle, self._most = size_mm, middle_mm, most
        self._lock = threading.Lock()
        self._generation, self._version = generation, 0
        self._keys: Index = np.empty(0, dtype=np.int64)  # in ascending order,
        self._slot_of: Index = np.empty(0, dtype=np.int64)  # and the slot of each
        self._held: Array = np.empty((0, COLUMNS))
        self._stamp: Index = np.empty(0, dtype=np.int64)
        self._worst: Array | None = None

    def __len__(self) -> int:
        return len(self._held)

    @property
    def generation(self) -> int:
        """Changes when everything held before is void."""
        return self._generation

    @property
    def newest(self) -> PointsVersion:
        """The version of a reader that has seen everything up to now. Never blocks."""
        return PointsVersion(self._generation, self._version)

    @property
    def worst(self) -> Array | None:
        """The point farthest from the middle of the zone: x, y, z and deviation (4,). None without points."""
        return self._worst

    def add(self, points_mm: Array, deviation_mm: Array) -> Array:
        """Add points (m, 3). Points without a deviation (m,) are skipped. Gives the places (k, 3) of those that are now held."""
        known = np.flatnonzero(np.isfinite(deviation_mm) & np.isfinite(points_mm).all(axis=1))
        if not len(known):
            return np.empty((0, 3))
        rows = np.column_stack([points_mm[known], deviation_mm[known]])
        keys, rows = self._worst_of_each(self._keys_of(rows), rows)
        with self._lock:
            self._version += 1
            held = self._take_over(keys, rows)
            while len(self._held) > self._most:
                self._coarsen()
        self._keep_worst(rows)
        return held

    def changed_since(self, seen: PointsVersion) -> ChangedVoxels:
        """The voxels that changed after what was `seen`; all of them for a reader of another generation."""
        with self._lock:
            asked = seen.version if seen.generation == self._generation else 0
            slots = np.flatnonzero(self._stamp > asked)
            return ChangedVoxels(self.newest, self._size, slots, self._held[slots])

    def _keys_of(self, rows: Array) -> Index:
        """The number (m,) of the voxel that each row lies in."""
        cells = np.clip(np.floor(rows[:, :_DEVIATION] / self._size) + _MOST_CELLS // 2, 0, _MOST_CELLS - 1).astype(np.int64)
        return np.asarray((cells[:, _X] * _MOST_CELLS + cells[:, _Y]) * _MOST_CELLS + cells[:, _Z])

    def _worst_of_each(self, keys: Index, rows: Array) -> tuple[Index, Array]:
        """The keys that occur (k,), in ascending order, and the worst row (k, 4) of each; of equal ones that with the largest place."""
        order = np.lexsort((*rows.T[::-1], self._badness(rows), keys))
        ordered = keys[order]
        last = np.flatnonzero(np.append(ordered[1:] != ordered[:-1], True))
        return ordered[last], rows[order[last]]

    def _badness(self, rows: Array) -> Array:
        return np.abs(rows[:, _DEVIATION] - self._middle)

    def _take_over(self, keys: Index, rows: Array) -> Array:
        """Put the worst rows (k, 4) of voxels (k,) in their places; gives the places (c, 3) of those that changed what is held."""
        at = np.searchsorted(self._keys, keys)
        known = np.append(self._keys, -1)[at] == keys
        slots, candidates = self._slot_of[at[known]], rows[known]
        better = self._is_worse(candidates, self._held[slots])
        self._held[slots[better]], self._stamp[slots[better]] = candidates[better], self._version
        fresh = ~known
        count = int(np.count_nonzero(fresh))
        self._keys = np.insert(self._keys, at[fresh], keys[fresh])
        self._slot_of = np.insert(self._slot_of, at[fresh], len(self._held) + np.arange(count))
        self._held = np.concatenate([self._held, rows[fresh]])
        self._stamp = np.append(self._stamp, np.full(count, self._version))
        return np.concatenate([candidates[better], rows[fresh]])[:, :_DEVIATION]

    def _is_worse(self, rows: Array, held: Array) -> NDArray[np.bool_]:
        """Which rows (k, 4) are worse than what is held (k, 4); of equally bad ones the place decides, as among those of one batch."""
        bad, held_bad = self._badness(rows), self._badness(held)
        later = np.zeros(len(rows), dtype=np.bool_)
        for column in range(COLUMNS - 1, -1, -1):
            later = (rows[:, column] > held[:, column]) | ((rows[:, column] == held[:, column]) & later)
        return np.asarray((bad > held_bad) | ((bad == held_bad) & later))

    def _coarsen(self) -> None:
        """Double the size of the voxels: every slot has another meaning then."""
        self._size *= 2
        keys, rows = self._worst_of_each(self._keys_of(self._held), self._held)
        self._generation += 1
        self._keys, self._slot_of, self._held = keys, np.arange(len(keys)), rows
        self._stamp = np.full(len(keys), self._version)

    def _keep_worst(self, rows: Array) -> None:
        worst = rows[np.argmax(self._badness(rows))]
        if self._worst is None or self._is_worse(worst[None, :], self._worst[None, :])[0]:
            self._worst = worst.copy()
