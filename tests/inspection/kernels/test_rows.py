"""Rows of a scan: which points are rejected and why, and that the compiled verdict is the rule of the tolerance zone."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray

from inspection import Method, Rejection, SectionPlane, ToleranceZone
from inspection.kernels import JUDGED_AS, TALLY, Columns, Feet, FewRows, Judgement, judge_rows, take_in
from inspection.signed_deviations import feet_on
from inspection.verdict import NOT_JUDGED
from tests.inspection.profiles import Array, nominal_of

Codes = NDArray[np.int8]
PLANE = SectionPlane(np.array([10.0, -4.0, 7.0]), np.array([0.0, 1.0, 0.0]), np.array([1.0, 0.0, 0.0]))  # y is the machine's z


def test_points_are_taken_into_the_plane_and_rejected_for_what_they_are() -> None:
    points = np.array([(10.0, -4.0, 7.0), (10.2, -3.0, 9.0), (10.6, 0.0, 0.0), (9.4, 0.0, 0.0), (np.nan, 0.0, 0.0), (10.0, 0.0, np.inf)])
    section, rejection = np.full((8, 2), -1.0), np.full(8, 77, dtype=np.int8)
    columns, places = columns_of(rejection), (np.zeros((9, 2)), np.zeros((9, 2)), np.zeros((9, 2)))
    take_in(points, PLANE.packed, 0.5, section, columns, places, -1, 1)
    station, deviation, verdicts, _, tally, height = columns
    assert np.isnan(station).tolist() == np.isnan(deviation).tolist() == (verdicts == NOT_JUDGED).tolist() == [False, *[True] * 6, False]
    assert [np.isnan(place[:, 0]).tolist() for place in places] == [[False, False, *[True] * 6, False]] * 3
    assert tally.tolist() == [2, 2, 2, *[0] * (TALLY - 3)]
    assert rejection.tolist() == [77, 0, 0, Rejection.OFF_SECTION, Rejection.OFF_SECTION, Rejection.NOT_FINITE, Rejection.NOT_FINITE, 77]
    assert np.array_equal(section[[1, 2]], [(0.0, 0.0), (1.0, 2.0)])
    assert height[1:5] == pytest.approx([0.0, 0.2, 0.6, -0.6], abs=1e-14)
    assert np.array_equal(section[[0, 7]], np.full((2, 2), -1.0))


def judged(deviation: Array, zone: ToleranceZone, rejection: ArrayLike, vertex: ArrayLike) -> tuple[Array, Codes, Codes]:
    """Deviations, verdicts and rejections of feet on the x axis, left of which is out of material, for a tip of 0.25 mm."""
    m = len(deviation)
    x = np.arange(float(m))
    zero = np.zeros(m)
    foot, gradient = np.column_stack([x, zero]), np.column_stack([zero, zero + 1.0])
    feet = Feet(x, foot, deviation + 0.25, gradient, zero, x, np.asarray(vertex, dtype=np.uint8))
    codes = np.array(rejection, dtype=np.int8)
    columns, places = columns_of(codes), (np.zeros((m, 2)), np.zeros((m, 2)), np.zeros((m, 2)))
    tally = columns[4]
    tally[:JUDGED_AS] = np.bincount(codes, minlength=JUDGED_AS)
    tally[JUDGED_AS] = m  # the verdict 0, until they are judged
    limits: Judgement = (1.0, 0.25, zone.lower_mm, zone.upper_mm, zone.uncertainty_mm)
    judge_rows(foot, columns, places, 0, 0, m, (1.0, 0.0, 0.0, 0.0), lambda _: feet, limits)
    _, found, verdicts, rejections, _, _ = columns
    assert tally[:JUDGED_AS].tolist() == np.bincount(rejections, minlength=JUDGED_AS).tolist()
    assert tally[JUDGED_AS:].tolist() == np.bincount(verdicts[verdicts != NOT_JUDGED], minlength=TALLY - JUDGED_AS).tolist()
    return found, verdicts, rejections


def columns_of(rejection: Codes) -> Columns:
    """Columns of rows that are not judged yet, and an empty tally."""
    m = len(rejection)
    return np.zeros(m), np.zeros(m), np.zeros(m, dtype=np.int8), rejection, np.zeros(TALLY, dtype=np.int64), np.zeros(m)


@pytest.mark.parametrize("uncertainty", [0.0, 0.125])
def test_the_compiled_verdict_is_that_of_the_tolerance_zone(uncertainty: float) -> None:
    zone = ToleranceZone(-0.5, 1.0, uncertainty)
    edges = np.array([limit + step for limit in (-0.5, 1.0) for step in (-0.125, 0.0, 0.125)])
    deviation = np.concatenate([edges, np.nextafter(edges, -9), np.nextafter(edges, 9), np.linspace(-2, 2, 401)])
    # limits and steps are binary fractions, and so is the tip: adding and taking off a quarter may still round, hence the found values
    found, verdicts, rejections = judged(deviation, zone, np.zeros(len(deviation)), np.zeros(len(deviation)))
    assert np.abs(found - deviation).max() < 1e-15
    assert np.array_equal(verdicts, zone.verdicts(found))
    assert set(verdicts.tolist()) == ({0, 1, 2} if uncertainty else {0, 2})
    assert not rejections.any()


def test_rejected_rows_and_those_beyond_an_end_have_no_verdict() -> None:
    zone = ToleranceZone(-0.5, 1.0)
    rejection = np.array([Rejection.NONE, Rejection.OUTLIER, Rejection.BEYOND_END, Rejection.BEYOND_END, Rejection.NONE, Rejection.NONE])
    deviation = np.array([0.0, 0.0, 0.0, 0.0, 0.0, np.nan])
    found, verdicts, rejections = judged(deviation, zone, rejection, np.array([0, 0, 0, 2, 2, 0]))
    assert rejections.tolist() == [0, Rejection.OUTLIER, 0, Rejection.BEYOND_END, Rejection.BEYOND_END, Rejection.BEYOND_END]
    assert verdicts.tolist() == [0, NOT_JUDGED, 0, NOT_JUDGED, NOT_JUDGED, NOT_JUDGED]
    assert np.isnan(found[[1, 3, 4, 5]]).all()
    assert (found[[0, 2]] == 0).all()


def test_rows_are_placed_by_the_pose_and_those_that_cannot_be_used_come_as_nan() -> None:
    seen: list[Array] = []

    def project(moved: Array) -> Feet:
        seen.append(moved.copy())
        m = len(moved)
        return Feet(np.zeros(m), np.zeros((m, 2)), np.zeros(m), np.zeros((m, 2)), np.zeros(m), np.zeros(m), np.zeros(m, dtype=np.uint8))

    section = np.array([(1.0, 0.0), (2.0, 1.0), (3.0, 0.0), (4.0, 0.0), (5.0, 0.0)])
    rejection = np.array([0, 0, Rejection.NOT_FINITE, Rejection.OFF_SECTION, Rejection.BEYOND_END], dtype=np.int8)
    columns, places = columns_of(rejection), (np.zeros((4, 2)), np.zeros((4, 2)), np.zeros((4, 2)))
    columns[2][0] = NOT_JUDGED
    turned = (0.0, 1.0, 10.0, 20.0)  # a quarter turn, then a shift
    judge_rows(section, columns, places, 1, 1, 5, turned, project, (1.0, 0.0, -1.0, 1.0, 0.0))
    assert np.array_equal(seen[0], [(9.0, 22.0), (np.nan, np.nan), (np.nan, np.nan), (10.0, 25.0)], equal_nan=True)
    assert columns[2].tolist() == [NOT_JUDGED, 0, NOT_JUDGED, NOT_JUDGED, 0]


@pytest.mark.parametrize("method", ["exact", "pcp"])
def test_few_rows_are_judged_as_many_are(method: Method) -> None:
    nominal, rng = nominal_of("NACA 2412 sharp"), np.random.default_rng(6)
    section = nominal.curve.point(rng.uniform(0, 1, 64)) + rng.normal(0, 0.4, (64, 2))
    section[5] = np.nan
    rejection = np.zeros(64, dtype=np.int8)
    rejection[5], rejection[6] = Rejection.NOT_FINITE, Rejection.OUTLIER
    pose, limits = (np.cos(0.01), np.sin(0.01), 0.1, -0.2), (nominal.outward, 0.25, -0.5, 0.4, 0.01)
    together, in_threes = ((columns_of(rejection.copy()), (np.zeros((64, 2)), np.zeros((64, 2)), np.zeros((64, 2)))) for _ in range(2))
    judge_rows(section, *together, 0, 0, 64, pose, lambda moved: feet_on(moved, nominal, method), limits)
    few = FewRows(section, in_threes[0], nominal.grid, nominal.table_for(method), method)
    few.keep_places(in_threes[1])
    for first in range(0, 64, 3):
        few.judge(0, first, min(first + 3, 64), pose, limits)
    for first, stop in ((62, 65), (-1, 2), (5, 4)):
        with pytest.raises(IndexError):
            few.judge(0, first, stop, pose, limits)
    wanted: list[NDArray[Any]] = [*together[0], *together[1]]
    found: list[NDArray[Any]] = [*in_threes[0], *in_threes[1]]
    for one, other in zip(wanted, found, strict=True):
        assert np.array_equal(one, other, equal_nan=True)
    assert (together[0][2] >= 0).sum() > 50
