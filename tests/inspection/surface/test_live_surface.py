"""A surface inspected while its points come in: what is known when, and that the end does not depend on the way."""

from dataclasses import replace

import numpy as np
import pytest

from inspection import Verdict
from inspection.surface import LiveSurface, PatchSurface, RigidMotion, SurfaceTerms, judge_surface
from inspection.verdict import NOT_JUDGED
from tests.inspection.surface import faces
from tests.inspection.surface.surface_scans import MOTION, NEAR, NOTCHED, WHERE_IT_IS, ZONE, scan


def test_a_known_pose_is_settled_at_once_and_every_verdict_is_final() -> None:
    places, normals, points = scan(NOTCHED, 1000)
    points = points - 0.3 * (np.linalg.norm(places - (20, 5, 20), axis=1) < 3)[:, None] * normals
    points[5] = np.nan
    live = LiveSurface(NOTCHED, WHERE_IT_IS)
    assert (live.state, live.received, live.judged) == ("settled", 0, 0)
    first, second = live.add(points[:300]), live.add(points[300:], normals[300:])
    assert (first.first, first.stop, first.whole, second.first, second.stop) == (0, 300, True, 300, 1000)
    assert first.points_mm == pytest.approx(points[:300], nan_ok=True)
    assert (first.verdicts[5], np.isnan(first.deviation_mm[5])) == (NOT_JUDGED, True)
    result = live.finish()
    assert np.array_equal(np.concatenate([first.verdicts, second.verdicts]), result.verdicts)
    assert (live.received, live.judged, live.rejected_by_reason) == (1000, 999, {"not finite": 1})
    assert result.verdict is Verdict.NONCONFORM


def test_the_pose_is_sought_refined_and_judged_anew_at_the_end() -> None:
    _, _, points = scan(NOTCHED, 2000)
    scanned = MOTION.inverse().apply(points)[np.random.default_rng(1).permutation(len(points))]
    live = LiveSurface(NOTCHED, replace(NEAR, start=None, gap_max_mm=6.0))
    states, anew, verdicts = [], [], []
    for start in range(0, len(scanned), 200):
        update = live.add(scanned[start : start + 200])
        states.append(update.state)
        anew.append(update.whole)
        if update.state == "provisional":
            assert update.registration is not None
            verdicts.append(update.verdicts)
    assert (verdicts[0] == Verdict.UNCERTAIN).all()  # of the first pose nothing is known
    assert np.mean(verdicts[-1] == Verdict.CONFORM) > 0.9
    assert states == sorted(states, key=["seeking", "provisional"].index)
    assert set(states) == {"seeking", "provisional"}
    assert 2 <= sum(anew[states.index("provisional") :]) < 15
    assert live.snapshot().deviation_mm == pytest.approx(live.finish().feet.distance_mm, abs=0.02)
    assert live.finish().verdict is Verdict.CONFORM
    late = LiveSurface(NOTCHED, replace(NEAR, start=None, gap_max_mm=6.0), provisional=False)
    assert late.add(scanned).state == "seeking"
    assert late.finish().verdict is Verdict.CONFORM


def test_a_scan_that_does_not_fix_the_pose_yet_shows_no_verdicts() -> None:
    """One flat side lies on the nominal in any place: the first points of a scan are often no more than that."""
    _, normals, points = scan(NOTCHED, 2000)
    top = points[normals[:, 2] > 0.9]
    live = LiveSurface(NOTCHED, SurfaceTerms(ZONE))
    assert live.add(top).state == "seeking"
    assert live.judged == 0


def test_a_scan_goes_on_after_a_result() -> None:
    _, _, points = scan(NOTCHED, 4000)
    live = LiveSurface(NOTCHED, NEAR)
    live.add(points[:3000])
    before = live.finish()
    live.add(points[3000:])
    assert before.received == 3000
    assert live.finish().received == 4000
    assert np.array_equal(live.finish().feet.distance_mm, judge_surface(points, NOTCHED, NEAR).feet.distance_mm)


def test_a_blade_is_judged_by_its_faces_as_they_are() -> None:
    blade = PatchSurface([faces.blade(40, 5)])
    motion = RigidMotion.about((0, 0, 70), np.radians((0.3, -0.2, 0.2)), (0.2, -0.3, 0.2))
    _, _, points = scan(blade, 8000)
    live = LiveSurface(blade, SurfaceTerms(ZONE, start=RigidMotion.identity(), gap_max_mm=8.0, edge_allowance_mm=0.5))
    live.add(motion.inverse().apply(points))
    result = live.finish()
    assert (result.verdict, result.reasons) == (Verdict.CONFORM, ())
    assert result.nominal_from_scan.apply(motion.inverse().apply(points)) == pytest.approx(points, abs=0.03)
    with pytest.raises(ValueError, match="normals must have the shape of the points"):
        live.add(points, points[:5])
