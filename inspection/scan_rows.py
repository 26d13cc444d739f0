"""The points of a scan as growing columns, a row for every received point, with what each was found to be.

Kept of a row are 42 bytes. Where its surface point and its foot lie follows from the pose: they are kept of the newest rows only,
and worked out again for whoever asks.
"""

import math
from collections.abc import Iterator
from functools import partial
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from inspection.cloud import Cloud, row_blocks
from inspection.judged_rows import JudgedRows
from inspection.kernels import JUDGED_AS, NONE_TAKEN, TALLY, Columns, FewRows, Judgement, Places, Room, Taken, judge_rows, take_in
from inspection.rigid import RigidTransform
from inspection.section import XY_PLANE, SectionPlane
from inspection.signed_deviations import feet_on
from inspection.terms import Terms
from inspection.verdict import NOT_JUDGED, Rejection, Verdict

Array = NDArray[np.float64]
Rows = NDArray[np.int64]

BLOCK = 64  # points between two moves of the state of a live inspection; the places of the block that is being filled are kept
_GROWTH = 1.5  # of the columns, where they are full and have to be copied
_MORE = 1 << 18  # rows that they grow by where they are not copied
_REASONS = tuple(each.words for each in Rejection if each != Rejection.NONE)  # in the order of their codes, from 1 on
_USABLE = (Rejection.NONE, Rejection.BEYOND_END, Rejection.IN_HOLLOW)  # the last two depend on the pose that is still being sought


@runtime_checkable
class ResizingRoom(Protocol):
    """A room that can give an array which it gave another number of rows without copying it. None where it cannot."""

    def resize(self, array: NDArray[Any], rows: int) -> NDArray[Any] | None:
        """The array with so many rows: those that it had, and others whose values are not set."""


class ScanRows:
    """Rows of a scan; the columns have room for more rows than `count`.

    points    : (n, 2) in section coordinates
    height    : (n,) above the plane of the section
    station, deviation : (n,) NaN where there is no verdict
    verdicts  : (n,) codes of `Verdict`, NOT_JUDGED where there is none
    rejection : (n,) codes of `Rejection`
    actual, foot, normal : (w, 2) surface point, nominal point and direction of the deviation of the rows from `base` on; NaN where there
                is no verdict
    plane     : the plane of the section
    settled_at : the pose at which all rows were settled last, None where rows were taken in or judged otherwise since
    times_anew : how often rows that had been judged were judged again
    room      : gives the columns, like numpy.empty; a ResizingRoom spares the copies as they grow
    """

    def __init__(self, capacity: int = 4096, plane: SectionPlane = XY_PLANE, room: Room = np.empty) -> None:
        self.count = 0
        self.plane, self.room = plane, room
        self.points, self.height = room((capacity, 2), np.float64), room((capacity,), np.float64)
        self.station, self.deviation = room((capacity,), np.float64), room((capacity,), np.float64)
        self.verdicts, self.rejection = room((capacity,), np.int8), room((capacity,), np.int8)
        self.base = 0
        self.actual, self.foot, self.normal = _places(0)
        self._tally = np.zeros(TALLY, dtype=np.int64)
        self.settled_at: RigidTransform | None = None
        self.times_anew = 0
        self._few: tuple[FewRows, Terms] | None = None  # where the arrays are in memory, until others take their place
        self._judged_to = 0  # rows that were judged once
        self._end = 0  # rows taken in, whether they count yet or not

    def take_in(self, points_mm: Array, plane: SectionPlane, off_section_max_mm: float) -> None:
        """Write points (m, 2) or (m, 3) behind the rows so far, as section points. They count once `count` is raised."""
        first = self._make_room(len(points_mm), plane)
        take_in(points_mm, plane.packed, off_section_max_mm, self.points, self._columns, self._places, self.base, first)

    def take_in_judged(
        self, points_mm: Array, plane: SectionPlane, off_section_max_mm: float, pose: RigidTransform, terms: Terms, reserve_mm: float
    ) -> None:
        """The same for points that all belong to the block being filled: they count and are judged at once, by one compiled call."""
        if terms.method == "inversion":
            self.take_in(points_mm, plane, off_section_max_mm)
            self.judge(self.count, self._end, pose, terms, reserve_mm)
        else:
            first = self._make_room(len(points_mm), plane)
            self._judged_to = self._end
            taken = (points_mm, plane.packed, off_section_max_mm)
            self._judge_few(first, self._end, pose, terms, reserve_mm, taken)
        self.count = self._end

    def _make_room(self, more: int, plane: SectionPlane) -> int:
        """Make room for more points behind the rows so far, and return the row of the first."""
        first, self._end, self.settled_at = self.count, self.count + more, None
        self._reserve(self._end)
        self.plane = plane
        self._keep_places(first - first % BLOCK, first)
        return first

    def judge(self, first: int, stop: int, pose: RigidTransform, terms: Terms, reserve_mm: float = 0.0) -> None:
        """Fill in rows first .. stop - 1 as they are with the points at this pose, and keep their places.

        reserve_mm : how far a deviation may still move; a verdict on a point is given where that cannot change it
        """
        self.settled_at = None
        self.times_anew += first < self._judged_to
        self._judged_to = stop
        if first < self.base:
            self._keep_places(first, first)
        for rows in row_blocks(stop - first):
            self._judge(first + rows.start, first + rows.stop, self._places, self.base, pose, terms, reserve_mm)

    def settle(self, pose: RigidTransform, terms: Terms, reserve_mm: float = 0.0, stop: int | None = None) -> None:
        """Fill in all rows, or those before `stop`, as they are with the points at this pose. No places are kept."""
        if not len(self.station):
            self._few = None
            self.station, self.deviation = (self.room((len(self.verdicts),), np.float64) for _ in range(2))
        self.settled_at = pose if stop is None else None
        self.times_anew += 1
        for rows in row_blocks(self.count if stop is None else stop):
            self._judge(rows.start, rows.stop, _places(rows.stop - rows.start), rows.start, pose, terms, reserve_mm)

    def forget_verdicts(self) -> None:
        """Give back what the rows were found to be, and the room for more rows; they can only be settled or copied from now on."""
        self.station = self.deviation = np.empty(0)
        self.base, (self.actual, self.foot, self.normal) = self.count, _places(0)
        self._resize(self.count)
        self.verdicts[:] = NOT_JUDGED
        self._tally[JUDGED_AS:] = 0

    def rows_at(self, which: slice | Rows, pose: RigidTransform, terms: Terms) -> JudgedRows:
        """Rows that were settled at this pose, with their places."""
        points, rejection = np.array(self.points[: self.count][which]), np.array(self.rejection[: self.count][which])
        m = len(points)
        some = ScanRows(0, self.plane)
        some.points, some.rejection, some.count = points, rejection, m
        some.station, some.deviation, some.verdicts = np.full(m, np.nan), np.full(m, np.nan), np.full(m, NOT_JUDGED, dtype=np.int8)
        some.actual, some.foot, some.normal = _places(m)
        some.judge(0, m, pose, terms)
        return JudgedRows(some.actual, some.foot, some.station, some.deviation, some.verdicts, some.rejection)

    def section_at(self, which: slice | Rows) -> Array:
        """Where points (k, 2) were measured, in section coordinates."""
        return np.array(self.points[: self.count][which])

    def reject(self, outliers: Rows) -> None:
        """Reject rows as outliers, until all rows are taken up again."""
        for code, count in zip(*np.unique(self.rejection[outliers], return_counts=True), strict=True):
            self._tally[code] -= count
        self.rejection[outliers] = Rejection.OUTLIER
        self._tally[Rejection.OUTLIER] += len(outliers)

    @property
    def judged(self) -> int:
        """Rows that have a verdict."""
        return sum(self._tally.tolist()[JUDGED_AS:])

    def count_of(self, verdict: Verdict) -> int:
        """Rows that have this verdict."""
        return int(self._tally[JUDGED_AS + verdict])

    @property
    def rejected_by_reason(self) -> dict[str, int]:
        """Number of rejected rows for each reason that occurred."""
        return {words: count for words, count in zip(_REASONS, self._tally[1:JUDGED_AS].tolist(), strict=False) if count}

    def usable(self) -> Cloud:
        """The points that a registration may use, where they lie."""
        if sum(int(self._tally[each]) for each in _USABLE) == self._end:  # the tally knows rows that do not count yet
            return Cloud(self.points[: self.count], room=self.room)
        left_out = self.room((self.count,), np.uint8)
        for rows in row_blocks(self.count):
            left_out[rows] = ~np.isin(self.rejection[rows], _USABLE)
        return Cloud(self.points[: self.count], left_out, self.room)

    def usable_rows(self, marked: NDArray[np.bool_]) -> Iterator[tuple[Rows, NDArray[np.bool_]]]:
        """Rows (k,) of points that a registration may use, piece by piece, with the marks (k,) of what is marked of all of them (m,)."""
        at = 0
        for part in row_blocks(self.count):
            usable = part.start + np.flatnonzero(np.isin(self.rejection[part], _USABLE))
            yield usable, marked[at : at + len(usable)]
            at += len(usable)

    def copy(self) -> "ScanRows":
        """The rows so far in columns of their own, as they were when they were taken in: none is judged, and no outlier is rejected."""
        same = ScanRows(max(self.count, 1), self.plane, self.room)
        same.count = same._end = self.count
        for rows in row_blocks(self.count):
            same.points[rows], same.height[rows] = self.points[rows], self.height[rows]
            same.station[rows] = same.deviation[rows] = np.nan
            same.verdicts[rows] = NOT_JUDGED
            kept = self.rejection[rows]
            kept = np.where(np.isin(kept, (*_USABLE, Rejection.OUTLIER)), np.int8(Rejection.NONE), kept)
            same.rejection[rows] = kept
            same._tally[:JUDGED_AS] += np.bincount(kept, minlength=JUDGED_AS)
        same.base = same.count - same.count % BLOCK
        same.actual, same.foot, same.normal = _places(same.count - same.base)
        return same

    @property
    def _columns(self) -> Columns:
        return self.station, self.deviation, self.verdicts, self.rejection, self._tally, self.height

    @property
    def _places(self) -> Places:
        return self.actual, self.foot, self.normal

    def _judge(self, first: int, stop: int, places: Places, base: int, pose: RigidTransform, terms: Terms, reserve_mm: float = 0.0) -> None:
        if stop - first <= BLOCK and base == self.base and places[0] is self.actual and terms.method != "inversion":
            self._judge_few(first, stop, pose, terms, reserve_mm)
        else:
            project = partial(feet_on, nominal=terms.nominal, method=terms.method)
            rows = (self.points, self._columns, places, base, first, stop, _numbers_of(pose))
            judge_rows(*rows, project, _with_reserve(terms.judgement, reserve_mm))

    def _judge_few(self, first: int, stop: int, pose: RigidTransform, terms: Terms, reserve_mm: float, taken: Taken = NONE_TAKEN) -> None:
        if self._few is None or self._few[1] is not terms:
            few = FewRows(
                self.points, self._columns, terms.nominal.grid_for(terms.method), terms.nominal.table_for(terms.method), terms.method
            )
            few.keep_places(self._places)
            self._few = few, terms
        self._few[0].judge(self.base, first, stop, _numbers_of(pose), _with_reserve(terms.judgement, reserve_mm), taken)

    def _keep_places(self, base: int, held: int) -> None:
        """Hold the places of the rows from `base` on: of those up to `held` as they are known, of the others as not judged yet."""
        if base == held > self.base and self._end - base <= len(self.actual) == BLOCK:  # what is taken in is entered as not judged
            self.base = base
            return
        if base == self.base and self._end - base <= len(self.actual):
            return
        known = [array[base - self.base : held - self.base] for array in self._places] if base >= self.base else []
        self.actual, self.foot, self.normal = _places(max(self._end - base, BLOCK))
        for array, before in zip(self._places, known, strict=False):
            array[: len(before)] = before
        self.base = base
        if self._few is not None:
            self._few[0].keep_places(self._places)

    def _reserve(self, capacity: int) -> None:
        """Make room for so many rows, in larger columns where there is none."""
        if capacity <= len(self.verdicts):
            return
        grown = int(_GROWTH * len(self.verdicts))
        if isinstance(self.room, ResizingRoom):
            grown = min(grown, len(self.verdicts) + _MORE)
        self._resize(max(capacity, grown))

    def _resize(self, capacity: int) -> None:
        """Hold the columns in arrays of so many rows, one after the other."""
        self._few = None
        for name in ("points", "height", "station", "deviation", "verdicts", "rejection"):
            old = getattr(self, name)
            if 0 < len(old) != capacity:
                setattr(self, name, self._resized(old, capacity))

    def _resized(self, old: NDArray[Any], capacity: int) -> NDArray[Any]:
        new = self.room.resize(old, capacity) if isinstance(self.room, ResizingRoom) else None
        if new is None:
            new = self.room((capacity, *old.shape[1:]), old.dtype.type)
            for rows in row_blocks(self.count):
                new[rows] = old[rows]
        return new


def _numbers_of(pose: RigidTransform) -> tuple[float, float, float, float]:
    """Cosine and sine of the rotation, then the shift in mm."""
    x, y = pose.translation_mm.tolist()
    return math.cos(pose.rotation_rad), math.sin(pose.rotation_rad), x, y


def _with_reserve(judgement: Judgement, reserve_mm: float) -> Judgement:
    """The judgement, uncertain as well by how far a deviation may still move."""
    outward, tip_mm, lower_mm, upper_mm, uncertainty_mm = judgement
    return outward, tip_mm, lower_mm, upper_mm, uncertainty_mm + reserve_mm


def _places(count: int) -> tuple[Array, Array, Array]:
    """Room for the places of so many rows that are not judged yet."""
    actual, foot, normal = np.full((3, count, 2), np.nan)
    return actual, foot, normal
