"""The two laws above every feature, for surfaces: what is missing never improves a verdict; order, density and batches never change it."""

from dataclasses import replace

import numpy as np
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from inspection import Missing, Verdict
from inspection.surface import LiveSurface, SurfaceResult, judge_surface
from inspection.verdict import NOT_JUDGED, Rejection
from tests.inspection.surface.surface_scans import MOTION, NEAR, NOTCHED, WHERE_IT_IS, Array, scan

BUSY = [HealthCheck.too_slow]  # a machine that is busy with other things is no fault of a case
LAW = settings(max_examples=max(4, settings().max_examples // 20), deadline=None, suppress_health_check=BUSY)  # `make laws` tries more
PLACES, NORMALS, POINTS = scan(NOTCHED, 3000)
FINE, _ = NOTCHED.sample(40_000)  # places of another pattern, to which the product does not look
GAP = 5.0
KNOWN, FITTED = replace(WHERE_IT_IS, gap_max_mm=GAP), replace(NEAR, gap_max_mm=GAP)
DEEP = st.sampled_from([0.0, 0.045, 0.3])
WHERE = st.integers(0, len(POINTS) - 1)


def with_dent(at: int, depth_mm: float, radius_mm: float = 2.0) -> tuple[Array, np.ndarray]:
    """Points of a part with a dent about one of its places, and which of them lie in it."""
    dent = (np.linalg.norm(PLACES - PLACES[at], axis=1) < radius_mm) & (NORMALS @ NORMALS[at] > 0.5)
    return POINTS - depth_mm * dent[:, None] * NORMALS, dent


def same_bits(one: SurfaceResult, other: SurfaceResult, order: np.ndarray) -> None:
    """All that two results say is the same, the rows of the second in another order."""
    assert (one.verdict, one.reasons, one.regions, one.unmeasured) == (other.verdict, other.reasons, other.regions, other.unmeasured)
    for name in ("rms_mm", "max_deviation_mm", "min_deviation_mm", "coverage", "gap_mm", "judged", "rejected_by_reason"):
        assert getattr(one, name) == getattr(other, name)
    assert np.array_equal(one.nominal_from_scan.rotation, other.nominal_from_scan.rotation)
    assert np.array_equal(one.nominal_from_scan.translation_mm, other.nominal_from_scan.translation_mm)
    assert np.array_equal(one.feet.distance_mm[order], other.feet.distance_mm, equal_nan=True)
    assert np.array_equal(one.feet.foot_mm[order], other.feet.foot_mm, equal_nan=True)
    assert np.array_equal(one.verdicts[order], other.verdicts)
    assert np.array_equal(one.rejection[order], other.rejection)
    assert one.worst is not None
    assert other.worst is not None
    assert np.array_equal(one.points_mm[one.worst], other.points_mm[other.worst])


# ---- law I: what is missing never improves a verdict


@given(at=WHERE, depth=DEEP, lost=st.integers(0, 300), damaged=st.integers(0, 3), rejected=st.integers(0, 3), complete=st.booleans())
@LAW
def test_what_is_said_to_be_missing_never_improves_a_verdict(
    at: int, depth: float, lost: int, damaged: int, rejected: int, complete: bool
) -> None:
    points, _ = with_dent(at, depth)
    missing = Missing(lost, damaged, {"marked invalid by the device": rejected} if rejected else {})
    without, with_them = judge_surface(points, NOTCHED, KNOWN), judge_surface(points, NOTCHED, KNOWN, None, complete, missing)
    assert with_them.verdict >= without.verdict
    if lost or damaged or rejected or not complete:
        assert with_them.verdict is not Verdict.CONFORM


@given(at=WHERE, share=st.floats(0, 1), how=st.sampled_from(["absent", "not finite", "far off", "turned"]), seed=st.integers(0, 99))
@LAW
def test_a_dent_wider_than_the_stated_gap_never_conforms_whatever_is_done_to_its_points(at: int, share: float, how: str, seed: int) -> None:
    points, dent = with_dent(at, 0.3, 0.6 * GAP)
    struck = dent & (np.random.default_rng(seed).random(len(points)) <= share)
    normals = NORMALS.copy()
    if how == "not finite":
        points[struck] = np.nan
    elif how == "far off":
        points[struck] += 30.0
    elif how == "turned":
        normals[struck] *= -1.0
    elif how == "absent":
        points, normals = points[~struck], normals[~struck]
    for terms in (KNOWN, FITTED):
        found = judge_surface(points, NOTCHED, terms, normals)
        assert found.verdict is not Verdict.CONFORM
        assert found.received == found.judged + found.rejected == len(points)


@given(at=WHERE, radius=st.floats(0.5, 5.0), kept=st.floats(0.02, 1.0), seed=st.integers(0, 99))
@LAW
def test_silently_absent_points_hide_at_most_the_gap_that_is_stated(at: int, radius: float, kept: float, seed: int) -> None:
    stays = (np.linalg.norm(PLACES - PLACES[at], axis=1) > radius) & (np.random.default_rng(seed).random(len(PLACES)) < kept)
    found = judge_surface(POINTS[stays], NOTCHED, KNOWN)
    away = np.asarray(cKDTree(found.feet.foot_mm[found.verdicts != NOT_JUDGED]).query(FINE)[0])
    if found.verdict is Verdict.CONFORM:
        assert 2 * away.max() <= found.gap_mm <= found.gap_max_mm == GAP
    assert found.coverage <= np.mean(2 * away <= GAP) + 0.01


# ---- law II: order, density and batches change nothing


@given(at=WHERE, depth=DEEP, seed=st.integers(0, 99), batch=st.integers(1, 900))
@LAW
def test_no_bit_depends_on_order_and_batches(at: int, depth: float, seed: int, batch: int) -> None:
    rng = np.random.default_rng(seed)
    points = MOTION.inverse().apply(with_dent(at, depth)[0])
    points[rng.integers(0, len(points), 3)] = np.nan
    expected = judge_surface(points, NOTCHED, FITTED, MOTION.inverse().turn(NORMALS))
    order = rng.permutation(len(points))
    live = LiveSurface(NOTCHED, FITTED)
    for start in range(0, len(points), batch):
        rows = order[start : start + batch]
        live.add(points[rows], MOTION.inverse().turn(NORMALS[rows]))
    same_bits(expected, live.finish(), order)


@given(at=WHERE, depth=DEEP, seed=st.integers(0, 99), dense=WHERE)
@LAW
def test_density_never_changes_the_verdict(at: int, depth: float, seed: int, dense: int) -> None:
    rng = np.random.default_rng(seed)
    points = MOTION.inverse().apply(with_dent(at, depth)[0])
    expected = judge_surface(points, NOTCHED, FITTED)
    repeated = np.concatenate([points, np.repeat(points[dense : dense + 1], 500, axis=0), points[rng.integers(0, len(points), 900)]])
    found = judge_surface(rng.permutation(repeated), NOTCHED, FITTED)
    assert found.verdict is expected.verdict
    assert found.coverage == expected.coverage
    assert (found.max_deviation_mm, found.min_deviation_mm) == (expected.max_deviation_mm, expected.min_deviation_mm)
    assert [region.worst_mm for region in found.regions] == [region.worst_mm for region in expected.regions]
    near, _ = scan(NOTCHED, 9000)[::2]  # of the same surface, on its left half only
    more = np.concatenate([points, MOTION.inverse().apply(near[near[:, 0] < 20.0])])
    denser = judge_surface(more, NOTCHED, FITTED)
    assert denser.verdict is expected.verdict
    assert denser.coverage >= expected.coverage - 0.005


@given(seed=st.integers(0, 99), batch=st.integers(1, 900))
@LAW
def test_live_verdicts_depend_on_no_batch(seed: int, batch: int) -> None:
    points = MOTION.inverse().apply(np.random.default_rng(seed).permutation(with_dent(seed, 0.3)[0]))
    at_once, in_pieces = LiveSurface(NOTCHED, FITTED), LiveSurface(NOTCHED, FITTED)
    at_once.add(points)
    for start in range(0, len(points), batch):
        update = in_pieces.add(points[start : start + batch])
        assert (update.stop, len(update.verdicts)) == (min(start + batch, len(points)), update.stop - update.first)
        assert (update.verdicts == NOT_JUDGED).all() == (update.state == "seeking")
    one, other = at_once.snapshot(), in_pieces.snapshot()
    assert np.array_equal(one.deviation_mm, other.deviation_mm, equal_nan=True)
    assert np.array_equal(one.verdicts, other.verdicts)
    assert (at_once.judged, at_once.rejected_by_reason) == (in_pieces.judged, in_pieces.rejected_by_reason)
    assert not (one.rejection != Rejection.NONE).any()
