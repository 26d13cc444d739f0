"""Points that lie away from all others: far off, or at a place that marks samples which mean no point. They are no part of the part."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inspection.cloud import Cloud, row_blocks
from inspection.coarse import FEWEST_POINTS
from inspection.errors import NotMeasured
from inspection.nominal import NominalProfile
from inspection.registration import no_outliers
from inspection.scan_rows import ScanRows
from inspection.signed_deviations import KILOMETRE_MM

Array = NDArray[np.float64]

_FAR_SIZES = 2.0  # of the nominal's size from the middle of the points: no point of the part lies there
_FAR_SPREADS = 4.0  # and so many times the distance within which nine of ten points lie
_FEW = 0.1  # of the points: more than these are not a few
_NAMED_ROWS = 5
_MARK_SIZES, _MARK_STEPS = 0.03, 5.0  # of the nominal's size, and of the steps between points: nothing measured lies so alone
_MOST_MARKS = 5  # different values: a device has one or two
_MOST_OF_ALL = 0.9
_TYPICAL = 1000  # points that show how near to each other they lie


def space_of(rows: ScanRows, points: Cloud, far: NDArray[np.bool_] | None = None) -> Iterator[Array]:
    """The usable points with their heights (k, 3), piece by piece, without those (m,) that lie far from all others."""
    at = 0
    for part in row_blocks(rows.count):
        space = np.column_stack([rows.points[part], rows.height[part]])
        space = space[points.left_out[part] == 0] if len(points.left_out) else space
        yield space if far is None else space[~far[at : at + len(space)]]
        at += len(space)


def refuse_beyond_a_kilometre(space_mm: Array, count: int) -> None:
    """Raise NotMeasured where more than a few of the points, of which (m, 3) stand for all `count`, lie where no part can be."""
    beyond = int(np.count_nonzero((np.abs(space_mm) > KILOMETRE_MM).any(axis=1)))
    if beyond > _FEW * len(space_mm):
        told = f"{beyond} of {count} points" if count == len(space_mm) else f"{beyond / len(space_mm):.0%} of {count} points"
        raise NotMeasured(
            f"{told} have coordinates that no part can have, beyond {KILOMETRE_MM:g} mm: are the unit and the columns right, or the order "
            "of the words in a register map (word_order)?"
        )


@dataclass(frozen=True, slots=True, eq=False)
class Away:
    """What shows that a point lies away from all others: how far it is from their middle (3,), or that it is a mark (k, 3)."""

    middle_mm: Array
    reach_mm: float
    marks_mm: Array

    @classmethod
    def of(cls, space_mm: Array, nominal: NominalProfile) -> "Away":
        """The middle and the reach of points (m, 3), farther off than which no point of the part can be, and the marks among them."""
        middle = np.median(space_mm, axis=0)
        away = np.linalg.norm(space_mm - middle, axis=1)
        reach = max(_FAR_SIZES * nominal.size_mm, _FAR_SPREADS * float(np.quantile(away, 1 - _FEW)))
        return cls(middle, reach, _marks(space_mm, nominal))

    def are_far(self, space_mm: Array) -> NDArray[np.bool_]:
        """Which of points (m, 3) are beyond the reach."""
        return np.asarray(np.linalg.norm(space_mm - self.middle_mm, axis=1) > self.reach_mm)

    def are_marks(self, space_mm: Array) -> NDArray[np.bool_]:
        """Which of points (m, 3) are marks."""
        found = np.zeros(len(space_mm), dtype=bool)
        for mark in self.marks_mm:
            found |= (space_mm == mark).all(axis=1)
        return found


def _marks(space_mm: Array, nominal: NominalProfile) -> Array:
    """Places (k, 3) that stand for no point, of points (m, 3): at zero, or where several have the very same place, apart from all others.

    A measured point repeats its digits at most where others lie beside it. The order of the points says nothing here.
    """
    x = np.sort(space_mm[:, 0])
    several = np.append(np.unique(x[1:][x[1:] == x[:-1]]), np.inf)
    is_one_of_several = several[np.searchsorted(several, space_mm[:, 0])] == space_mm[:, 0]
    seen = np.flatnonzero(is_one_of_several | ~space_mm[:, :2].any(axis=1))
    if not len(seen):
        return np.empty((0, 3))
    same, counts = np.unique(space_mm[seen], axis=0, return_counts=True)
    candidates = same[(counts > 1) | ~same[:, :2].any(axis=1)]
    if not len(candidates):
        return np.empty((0, 3))
    others = np.unique(space_mm, axis=0)
    if len(others) < FEWEST_POINTS:
        return np.empty((0, 3))
    from scipy.spatial import KDTree  # noqa: PLC0415 - it takes a third of a second, and few scans have such candidates

    tree = KDTree(others)
    away = np.asarray(tree.query(candidates, k=2)[0])[:, 1]
    typical = float(np.quantile(np.asarray(tree.query(others[:: max(1, len(others) // _TYPICAL)], k=2)[0])[:, 1], 0.95))
    return np.asarray(candidates[away > max(_MARK_SIZES * nominal.size_mm, _MARK_STEPS * typical)][:_MOST_MARKS])


def far_points(rows: ScanRows, points: Cloud, away: Away) -> NDArray[np.bool_]:
    """Which of the points (m,) are a few that lie farther off than any point of the part can, or marks."""
    counts = np.zeros(2, dtype=np.int64)
    for block in space_of(rows, points):
        counts += (np.count_nonzero(away.are_far(block)), np.count_nonzero(away.are_marks(block)))
    is_few, is_marked = 0 < counts[0] <= _FEW * len(points), 0 < counts[1] <= _MOST_OF_ALL * len(points)
    if not is_few and not is_marked:
        return no_outliers(len(points))
    far, at = points.room((len(points),), np.bool_), 0
    for block in space_of(rows, points):
        far[at : at + len(block)] = is_few & away.are_far(block) | is_marked & away.are_marks(block)
        at += len(block)
    return far


def words_of_far(rows: ScanRows, points: Cloud, far: NDArray[np.bool_]) -> str:
    """Which points lie far from all others, and what to do about them."""
    which = np.concatenate([usable[is_far] for usable, is_far in rows.usable_rows(far)])
    named = ", ".join(str(row + 1) for row in which[:_NAMED_ROWS]) + (" ..." if len(which) > _NAMED_ROWS else "")
    x, y = rows.points[which[0]]
    few = f"{len(which)} of {len(points)} points lie" if len(which) > 1 else f"1 of {len(points)} points lies"
    return (
        f"{few} far from all others (row{'s' if len(which) > 1 else ''} {named}; the first at x {x:g}, y {y:g} mm): are these samples "
        "that mean no point? Give the value that marks them (invalid: --invalid V for a file, in the register map for a device), or fit "
        "without them (--reject-outliers)"
    )
