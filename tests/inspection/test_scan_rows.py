"""Rows of a scan: what is taken in, what is kept when they grow, and that judging touches nothing else."""

from typing import Any
from unittest.mock import patch

import numpy as np
import pytest

from inspection import NOT_JUDGED, Rejection, RigidTransform, SectionPlane, ToleranceZone, Verdict
from inspection.kernels import FewRows
from inspection.methods import Method
from inspection.scan_rows import ScanRows
from inspection.terms import Terms
from tests.inspection.profiles import Array, curve_of, even_in_arc_length, nominal_of, offset_points

PLANE = SectionPlane(np.zeros(3), np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]))
FIELDS = ("points", "height", "station", "deviation", "verdicts", "rejection")
PLACES = ("actual", "foot", "normal")


def rows_of(points: Array, capacity: int = 4096) -> ScanRows:
    rows = ScanRows(capacity)
    rows.take_in(points, PLANE, np.inf)
    rows.count = len(points)
    return rows


def terms() -> Terms:
    return Terms(nominal_of("P3"), ToleranceZone(-0.05, 0.05), None, "none", "exact", 0.0, np.inf, 0.0, False)


def scan_of(count: int) -> Array:
    return offset_points(curve_of("P3"), even_in_arc_length(curve_of("P3"), count), np.linspace(-0.1, 0.1, count))


def test_rows_survive_growing() -> None:
    points = scan_of(300)
    grown, roomy = ScanRows(4), rows_of(points)
    for k in range(0, 300, 7):
        part = points[k : k + 7]
        grown.take_in(part, PLANE, np.inf)
        grown.count += len(part)
        grown.judge(k, grown.count, RigidTransform.identity(), terms())
    roomy.judge(0, 300, RigidTransform.identity(), terms())
    for field in FIELDS:
        a, b = getattr(grown, field)[:300], getattr(roomy, field)[:300]
        assert np.array_equal(a, b), field
    assert np.isfinite(grown.deviation[:300]).all()


def test_places_are_kept_of_the_newest_rows_and_worked_out_again_for_the_others() -> None:
    points = scan_of(300)
    grown, whole = ScanRows(4), rows_of(points)
    whole.judge(0, 300, RigidTransform.identity(), terms())
    for k in range(0, 300, 7):
        part = points[k : k + 7]
        grown.take_in(part, PLANE, np.inf)
        grown.count += len(part)
        grown.judge(k, grown.count, RigidTransform.identity(), terms())
        assert grown.base == k - k % 64, "the block that is being filled, and what came last"
        for name in PLACES:
            kept = getattr(grown, name)[: grown.count - grown.base]
            assert np.array_equal(kept, getattr(whole, name)[grown.base : grown.count]), name
    grown.judge(0, 300, RigidTransform.identity(), terms())
    for name in PLACES:
        assert np.array_equal(getattr(grown, name), getattr(whole, name)), name
    for which in (slice(17, 250), np.array([299, 3, 3, 150])):
        rows = whole.rows_at(which, RigidTransform.identity(), terms())
        assert np.array_equal(rows.actual_mm, whole.actual[which])
        assert np.array_equal(rows.foot_mm, whole.foot[which])
        assert np.array_equal(rows.deviation_mm, whole.deviation[which])
        assert np.array_equal(rows.verdicts, whole.verdicts[which])


def test_a_copy_is_as_the_rows_were_taken_in_and_lives_on_its_own() -> None:
    points = scan_of(50)
    points[[3, 4]] = np.nan
    rows = rows_of(points)
    rows.reject(np.array([7, 8]))
    rows.settle(RigidTransform.identity(), terms())
    before = {field: getattr(rows, field)[:50].copy() for field in FIELDS}
    same = rows.copy()
    assert np.array_equal(same.points, before["points"], equal_nan=True)
    assert not same.judged
    assert np.isnan(same.deviation).all()
    assert same.rejected_by_reason == {"not finite": 2}
    assert rows.rejected_by_reason == {"not finite": 2, "outlier": 2}
    assert rows.judged == 46
    same.settle(RigidTransform(0.1, np.zeros(2)), terms())
    for field in FIELDS:
        assert np.array_equal(getattr(rows, field)[:50], before[field], equal_nan=True), field
    assert not np.array_equal(same.deviation, before["deviation"])


def test_the_rows_know_how_many_have_which_verdict_and_why_the_others_have_none() -> None:
    points = scan_of(200)
    points[::50] = np.nan
    rows = rows_of(points)
    for pose in (RigidTransform.identity(), RigidTransform(0.02, np.array([0.03, 0.0])), RigidTransform.identity()):
        rows.settle(pose, terms())
        found = rows.verdicts[:200]
        assert [rows.count_of(verdict) for verdict in Verdict] == [int((found == verdict).sum()) for verdict in Verdict]
        assert rows.judged == int((found != NOT_JUDGED).sum()) == 196
        assert rows.rejected_by_reason == {"not finite": 4}
    rows.forget_verdicts()
    assert rows.judged == 0
    rows.settle(RigidTransform.identity(), terms())
    assert np.array_equal(rows.verdicts, found)


def test_rows_outside_the_range_are_not_judged() -> None:
    rows = rows_of(scan_of(50))
    rows.judge(10, 20, RigidTransform.identity(), terms())
    judged = rows.verdicts[:50] != NOT_JUDGED
    assert np.flatnonzero(judged).tolist() == list(range(10, 20))
    assert np.isnan(rows.deviation[:50][~judged]).all()


def test_usable_rows_are_those_a_pose_may_still_bring_onto_the_profile() -> None:
    points = scan_of(6)
    points[1] = np.nan
    rows = rows_of(points)
    rows.rejection[2:5] = (Rejection.OFF_SECTION, Rejection.BEYOND_END, Rejection.OUTLIER)
    marked = np.array([True, False, True])
    (found,) = rows.usable_rows(marked)
    assert [each.tolist() for each in found] == [[0, 3, 5], marked.tolist()]
    with patch("inspection.cloud.ROWS_AT_ONCE", 4):
        pieces = [(usable.tolist(), are.tolist()) for usable, are in rows.usable_rows(marked)]
    assert pieces == [([0, 3], [True, False]), ([5], [True])]


@pytest.mark.parametrize("method", ["exact", "pcp", "inversion"])
@pytest.mark.parametrize("columns", [2, 3])
def test_points_taken_in_and_judged_at_once_are_as_those_judged_afterwards(method: Method, columns: int) -> None:
    pose = RigidTransform(0.002, np.array([0.03, -0.01]))
    plane = SectionPlane(np.zeros(3), np.array([1.0, 0.001, 0.0]), np.array([0.0, 0.0, 1.0]))
    points, rng = np.column_stack([scan_of(300), np.linspace(-0.3, 0.3, 300)])[:, :columns].copy(), np.random.default_rng(8)
    points[[5, 130]] = np.nan
    points[[70, 131]] += 300.0
    asked = Terms(nominal_of("P3"), ToleranceZone(-0.05, 0.05), None, "none", method, 0.1, 0.2, 0.0, False)
    once, twice, first = ScanRows(4), ScanRows(4), 0
    while first < 300:
        stop = min(first + int(rng.integers(0, 30)), first - first % 64 + 64, 300)
        once.take_in_judged(points[first:stop], plane, 0.2, pose, asked, 0.003)
        twice.take_in(points[first:stop], plane, 0.2)
        twice.count = stop
        twice.judge(first, stop, pose, asked, 0.003)
        for name in PLACES:
            assert np.array_equal(getattr(once, name)[: stop - once.base], getattr(twice, name)[: stop - twice.base], equal_nan=True), name
        first = stop
    for field in FIELDS:
        assert np.array_equal(getattr(once, field)[:300], getattr(twice, field)[:300], equal_nan=True), field
    assert once.rejected_by_reason == twice.rejected_by_reason
    assert once.judged == twice.judged > 180
    assert (once.count, once.times_anew) == (twice.count, twice.times_anew) == (300, 0)


def test_the_places_of_arrays_are_packed_when_the_arrays_change_and_not_for_every_batch() -> None:
    rows, points, packed = ScanRows(100), scan_of(1000), list[int]()

    def counted(section_mm: Array, *others: Any) -> FewRows:
        packed.append(len(section_mm))
        return FewRows(section_mm, *others)

    asked = terms()
    with patch("inspection.scan_rows.FewRows", counted):
        for first in range(0, 1000, 8):
            rows.take_in_judged(points[first : first + 8], PLANE, np.inf, RigidTransform.identity(), asked, 0.0)
    assert packed == [100, 150, 225, 337, 505, 757, 1135]
    assert rows.judged == 1000
