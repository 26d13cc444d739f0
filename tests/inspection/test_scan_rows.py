"""Rows of a scan: what is taken in, what is kept when they grow, and that judging touches nothing else."""

import numpy as np

from inspection import NOT_JUDGED, Rejection, RigidTransform, SectionPlane, ToleranceZone
from inspection.scan_rows import ScanRows
from inspection.terms import Terms
from tests.inspection.profiles import Array, curve_of, even_in_arc_length, nominal_of, offset_points

PLANE = SectionPlane(np.zeros(3), np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]))
FIELDS = ("points", "actual", "foot", "normal", "station", "deviation", "verdicts", "rejection")


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


def test_a_copy_has_just_the_rows_so_far_and_lives_on_its_own() -> None:
    rows = rows_of(scan_of(50))
    rows.judge(0, 50, RigidTransform.identity(), terms())
    before = {field: getattr(rows, field)[:50].copy() for field in FIELDS}
    same = rows.copy()
    for field in FIELDS:
        assert np.array_equal(getattr(same, field), before[field]), field
    same.judge(0, 50, RigidTransform(0.1, np.zeros(2)), terms())
    for field in FIELDS:
        assert np.array_equal(getattr(rows, field)[:50], before[field]), field
    assert not np.array_equal(same.deviation, before["deviation"])


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
    assert rows.usable_rows().tolist() == [0, 3, 5]
