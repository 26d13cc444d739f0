"""The characteristics of a scan that still runs: each value over the points so far, and what is proven whatever comes.

It is worked out on a copy of at most a few thousand points, the lowest and the highest of every share of the profile, and without the
searches through all placements that the end makes. What it says is for display: the verdict is reached over all points without it.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from inspection.characteristics.characteristic import Characteristic, CharacteristicResult, LineProfile, WholeProfile
from inspection.conclusion import Missing
from inspection.evaluation.basis import Basis
from inspection.evaluation.evaluate import PROFILE
from inspection.evaluation.line_profile import judge_profile_so_far, judge_whole
from inspection.evaluation.section_value import ActualOutlines, judge_value
from inspection.prefix import TellingRows
from inspection.rigid import RigidTransform
from inspection.scan_rows import ScanRows
from inspection.section import XY_PLANE
from inspection.settled import judge_at
from inspection.terms import Terms
from inspection.verdict import NOT_JUDGED, Verdict

Array = NDArray[np.float64]

_SHARES = 2048  # of the length, of which the lowest and the highest point tell
_NOT_SEEN = ("no-value", "unseen")  # kinds of reasons that leave a value without a meaning


@dataclass(frozen=True, slots=True, eq=False)
class ScanSoFar:
    """Points of a scan that tell of all so far, at the pose of this moment.

    received  : points received when this was taken
    points_mm : (m, 2) in section coordinates
    pose      : nominal from section
    """

    received: int
    points_mm: Array
    pose: RigidTransform

    def __post_init__(self) -> None:
        self.points_mm.setflags(write=False)


class ScanWatch:
    """Takes such copies of one scan as it grows; each row is looked at once, unless it is judged anew."""

    def __init__(self, terms: Terms) -> None:
        self._telling = TellingRows(terms.nominal.length_mm, _SHARES)

    def so_far(self, rows: ScanRows, pose: RigidTransform) -> ScanSoFar:
        """The scan as it is now."""
        count = rows.count
        told = self._telling.of(rows) if count > 2 * _SHARES else np.flatnonzero(rows.verdicts[:count] != NOT_JUDGED)
        return ScanSoFar(count, rows.points[told], pose)


class EvaluationSoFar:
    """Evaluates the characteristics of one scan again and again, on its terms. It may run in another thread."""

    def __init__(self, asked: Sequence[Characteristic], terms: Terms) -> None:
        self._asked, self._terms = tuple(asked) or (PROFILE,), terms
        self._no_budget = replace(terms, uncertainty=None)  # how a number depends on every error takes seconds, and nothing rests on it yet

    @property
    def nothing(self) -> ScanSoFar:
        """A scan before its first point: what is found of it is what was asked for."""
        return ScanSoFar(0, np.empty((0, 2)), self._terms.known_pose or RigidTransform.identity())

    def evaluate(self, scan: ScanSoFar, is_over: Callable[[], bool] = lambda: False) -> tuple[CharacteristicResult, ...] | None:
        """What is found of each on the points so far: NONCONFORM where that is proven, else UNCERTAIN; no reasons. None when it is over.

        is_over : asked after each of them. Who asks may sleep in it, to let others through
        """
        rows = ScanRows(max(len(scan.points_mm), 1))
        rows.take_in(scan.points_mm, XY_PLANE, np.inf)
        rows.count = len(scan.points_mm)
        basis = Basis(judge_at(rows, scan.pose, self._terms), self._terms, Missing(), complete=False)
        outlines, found = ActualOutlines(replace(basis, terms=self._no_budget)), list[CharacteristicResult]()
        for one in self._asked:
            found.append(replace(self._judge(one, basis, outlines), reasons=()))
            if is_over():
                return None
        return tuple(found)

    def _judge(self, asked: Characteristic, basis: Basis, outlines: ActualOutlines) -> CharacteristicResult:
        if isinstance(asked, WholeProfile):
            is_final = basis.terms.known_pose is not None and not basis.terms.reject_outliers
            proven = is_final and basis.result.out_of_tolerance > 0
            return replace(judge_whole(asked, basis), verdict=Verdict.NONCONFORM if proven else Verdict.UNCERTAIN)
        if isinstance(asked, LineProfile):
            return judge_profile_so_far(asked, basis)
        found = judge_value(asked, replace(basis, terms=self._no_budget), outlines)
        is_partly_fitted = asked.method == "best-fit" and basis.result.gap.length_mm > basis.terms.limits.gap_max_mm
        if is_partly_fitted or any(reason.kind in _NOT_SEEN for reason in found.reasons):
            nothing = float("nan")
            found = replace(found, value=nothing, deviation=nothing, consumption=nothing, places_mm=())
        return replace(found, verdict=Verdict.UNCERTAIN)
