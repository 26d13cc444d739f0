"""The points of a scan as growing arrays, a row for every received point, with what each was found to be."""

import math
from functools import partial

import numpy as np
from numpy.typing import NDArray

from inspection.deviations import feet_on
from inspection.kernels import judge_rows, take_in
from inspection.result import NOT_JUDGED, Rejection
from inspection.rigid import RigidTransform
from inspection.section import XY_PLANE, SectionPlane
from inspection.terms import Terms

Array = NDArray[np.float64]

_USABLE = (Rejection.NONE, Rejection.BEYOND_END, Rejection.IN_HOLLOW)  # the last two depend on the pose that is still being sought


class ScanRows:
    """Rows of a scan; the arrays have room for more rows than `count`.

    points       : (n, 2) in section coordinates
    height       : (n,) above the plane of the section
    actual, foot, normal : (n, 2) surface point, nominal point and direction of the deviation; NaN where there is no verdict
    station, deviation   : (n,) likewise
    verdicts     : (n,) codes of `Verdict`, NOT_JUDGED where there is none
    rejection    : (n,) codes of `Rejection`
    plane        : the plane of the section
    """

    def __init__(self, capacity: int = 4096, plane: SectionPlane = XY_PLANE) -> None:
        self.count = 0
        self.points, self.actual, self.foot, self.normal = (np.full((capacity, 2), np.nan) for _ in range(4))
        self.height = np.zeros(capacity)
        self.plane = plane
        self.station, self.deviation = np.full(capacity, np.nan), np.full(capacity, np.nan)
        self.verdicts = np.full(capacity, NOT_JUDGED, dtype=np.int8)
        self.rejection = np.zeros(capacity, dtype=np.int8)

    def take_in(self, points_mm: Array, plane: SectionPlane, off_section_max_mm: float) -> None:
        """Write points (m, 2) or (m, 3) behind the rows so far, as section points. They count once `count` is raised."""
        self._reserve(self.count + len(points_mm))
        self.plane = plane
        take_in(points_mm, plane.packed, off_section_max_mm, self.points, self.rejection, self.count)
        self.height[self.count : self.count + len(points_mm)] = plane.heights(points_mm)

    def judge(self, first: int, stop: int, pose: RigidTransform, terms: Terms, reserve_mm: float = 0.0) -> None:
        """Fill in rows first .. stop - 1 as they are with the points at this pose.

        reserve_mm : how far a deviation may still move; a verdict on a point is given where that cannot change it
        """
        place = (math.cos(pose.rotation_rad), math.sin(pose.rotation_rad), *pose.translation_mm.tolist())
        outward, tip_mm, lower_mm, upper_mm, uncertainty_mm = terms.judgement
        judgement = (outward, tip_mm, lower_mm, upper_mm, uncertainty_mm + reserve_mm)
        arrays = (self.actual, self.foot, self.normal, self.station, self.deviation, self.verdicts, self.rejection)
        judge_rows(self.points, arrays, first, stop, place, partial(feet_on, nominal=terms.nominal, method=terms.method), judgement)

    def usable_rows(self) -> NDArray[np.int64]:
        """Rows (k,) of points that a registration may use."""
        return np.flatnonzero(np.isin(self.rejection[: self.count], _USABLE))

    def copy(self) -> "ScanRows":
        """The rows so far, in arrays of just their number."""
        same = ScanRows(self.count, self.plane)
        same._take_over(self, same)
        return same

    def without(self, outliers: NDArray[np.int64]) -> "ScanRows":
        """The rows so far, with these rejected as outliers; the very same where there are none."""
        if not len(outliers):
            return self
        rest = self.copy()
        rest.rejection[outliers] = Rejection.OUTLIER
        return rest

    def _reserve(self, capacity: int) -> None:
        """Make room for so many rows, at least doubling it."""
        if capacity > len(self.verdicts):
            self._take_over(self, ScanRows(max(capacity, 2 * len(self.verdicts)), self.plane))

    def _take_over(self, old: "ScanRows", larger: "ScanRows") -> None:
        """Hold the arrays of `larger`, with the rows of `old` in them."""
        count = old.count
        for name, array in vars(larger).items():
            if isinstance(array, np.ndarray):
                array[:count] = getattr(old, name)[:count]
                setattr(self, name, array)
        self.count = count
