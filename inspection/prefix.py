"""What a scan that still runs can prove: that no placement of the points so far passes, so that no more points can save the part.

The largest deviation over more points is never smaller. A prefix without a placement inside half the zone + U is therefore a part
that fails under any fit and any datum, and no model of form or noise enters. The same holds for any choice of its points, which
is how a long prefix stays quick to ask about.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inspection.bands import EvenBand
from inspection.cloud import MANY, row_blocks
from inspection.errors import RegistrationError
from inspection.placements import PlacementSearch
from inspection.rigid import RigidTransform
from inspection.scan_rows import ScanRows
from inspection.telling_points import SHARES, telling_rows
from inspection.terms import Terms
from inspection.verdict import NOT_JUDGED

Array = NDArray[np.float64]

_SURELY = 3.0  # of what the pose can slide along an open end (95 %): points nearer to the end may lie beyond it at the last pose


@dataclass(frozen=True, slots=True, eq=False)
class Prefix:
    """The points of a scan so far that the last pose will judge, where they look out of tolerance at the pose of this moment.

    received     : points received when this was taken
    points_mm    : (m, 2) in section coordinates
    station_mm   : (m,) at that pose
    deviation_mm : (m,) likewise
    pose         : nominal from section
    """

    received: int
    points_mm: Array
    station_mm: Array
    deviation_mm: Array
    pose: RigidTransform

    def __post_init__(self) -> None:
        for array in (self.points_mm, self.station_mm, self.deviation_mm):
            array.setflags(write=False)


class PrefixSearch:
    """The search for a placement that passes, over the prefixes of one scan. It remembers what refuted most."""

    def __init__(self, terms: Terms) -> None:
        zone = terms.zone
        self._length, self._middle = terms.nominal.length_mm, zone.middle_mm
        self._search = PlacementSearch(terms.nominal, EvenBand(_half_mm(terms), zone.middle_mm), terms.tip_radius_mm)

    def refutes(self, prefix: Prefix, is_over: Callable[[], bool] = lambda: False) -> bool:
        """Whether it is proven that no placement of a prefix passes, and so that the part will fail. False says nothing.

        is_over : asked every few milliseconds; the search is given up once it says so. Who asks may sleep in it, to let others through
        """
        rows = self._telling_rows(prefix)
        try:
            return self._search.look(prefix.points_mm[rows], prefix.pose, is_over=is_over).outcome == "refuted"
        except RegistrationError:  # too few points, or all in one place
            return False

    def _telling_rows(self, prefix: Prefix) -> NDArray[np.int64]:
        """Rows, in their order, of points that stand for all."""
        count = len(prefix.points_mm)
        return np.arange(count) if count <= 2 * SHARES else telling_rows(prefix.station_mm, prefix.deviation_mm, self._length)


class TellingRows:
    """The rows of one scan that tell how far all of them go, as it grows. Each is looked at once, unless it is judged anew."""

    def __init__(self, length_mm: float, shares: int) -> None:
        self._length, self._shares = length_mm, shares
        self._seen: tuple[ScanRows | None, int] = (None, 0)  # the rows looked at, and how often they had been judged anew
        self._stop = 0  # rows that were looked at
        self._telling = np.empty(0, dtype=np.int64)

    def of(self, rows: ScanRows) -> NDArray[np.int64]:
        """Rows (k,) of the lowest and the highest deviation in each share of the length."""
        if self._seen != (rows, rows.times_anew):
            self._seen, self._stop, self._telling = (rows, rows.times_anew), 0, self._telling[:0]
        count = rows.count
        told = self._telling, self._stop
        self._telling = telling_rows(rows.station[:count], rows.deviation[:count], self._length, self._shares, *told)
        self._stop = count
        return self._telling


class PrefixWatch:
    """Takes prefixes of one scan as it grows. Rows are looked at once, unless they are judged anew: what it costs does not grow."""

    def __init__(self, terms: Terms) -> None:
        self._terms = terms
        self._seen: tuple[ScanRows | None, int] = (None, 0)  # the rows looked at, and how often they had been judged anew
        self._stop = 0  # rows that were looked at
        self._farthest_mm = 0.0
        self._telling, self._told = TellingRows(terms.nominal.length_mm, MANY // 64), np.empty(0, dtype=np.int64)

    def prefix(self, rows: ScanRows, pose: RigidTransform, slide_mm: float) -> Prefix | None:
        """The prefix at a provisional pose, None where no point looks out there: that pose is then a placement that passes.

        slide_mm : how far the pose may still slide along the profile at its open ends (95 %)
        """
        self._look(rows)
        terms, count = self._terms, rows.count
        if self._farthest_mm <= _half_mm(terms):
            return None
        judged = self._told if count > MANY else np.flatnonzero(rows.verdicts[:count] != NOT_JUDGED)
        if not terms.nominal.curve.closed:
            reserve = _SURELY * slide_mm + terms.zone.upper_mm - terms.zone.lower_mm
            station = rows.station[judged]
            judged = judged[(station > reserve) & (station < terms.nominal.length_mm - reserve)]
        deviation = rows.deviation[judged]
        if np.abs(deviation - terms.target_mm).max(initial=0.0) <= _half_mm(terms):
            return None
        return Prefix(count, rows.points[judged], rows.station[judged], deviation, pose)

    def _look(self, rows: ScanRows) -> None:
        """Look at the rows that were not looked at yet."""
        if self._seen != (rows, rows.times_anew):
            self._seen, self._stop, self._farthest_mm = (rows, rows.times_anew), 0, 0.0
        for part in row_blocks(rows.count - self._stop):
            off = np.abs(rows.deviation[self._stop + part.start : self._stop + part.stop] - self._terms.target_mm)
            self._farthest_mm = float(np.fmax.reduce(off, initial=self._farthest_mm))
        if rows.count > MANY:  # of fewer points all are asked
            self._told = self._telling.of(rows)
        self._stop = rows.count


def _half_mm(terms: Terms) -> float:
    """How far from the middle of the zone a point may lie before it is proven to be out."""
    return (terms.zone.upper_mm - terms.zone.lower_mm) / 2 + terms.zone.guard_mm
