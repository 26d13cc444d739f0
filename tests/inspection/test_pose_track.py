"""The provisional pose: it comes before the scan ends, its verdicts seldom change, and it costs no more than it must."""

from typing import Any

import numpy as np
import pytest

from inspection import LiveInspection, ToleranceZone, Verdict, register_fine
from tests.inspection import profiles
from tests.inspection.live_scans import KINDS, Kind, followed, live_scan
from tests.inspection.profiles import nominal_of
from tests.inspection.scans import ZONE, surface


@pytest.mark.parametrize("name", ["P1", "P2", "P3", "NACA 2412 sharp"])
def test_verdicts_come_before_the_scan_ends(name: str) -> None:
    for seed in range(2):
        truth, _ = surface(name, 600, seed)
        points = profiles.rotated(truth, 50.0 * seed, (30.0, 10.0))
        live, provisional = LiveInspection(nominal_of(name), ZONE), []
        for k in range(0, 600, 60):
            assert live.add(points[k : k + 60]).state in ("seeking", "provisional")
            provisional += [look for look in [live.snapshot()] if look.state == "provisional"]
        assert provisional, "the pose was never found on the way"
        assert provisional[0].stop <= 480
        assert all(np.isnan(look.can_move_mm) for look in provisional), "a number that is no bound was given as one"
        assert (provisional[-1].verdicts == Verdict.CONFORM).mean() > 0.3, "a verdict that never comes says nothing"


@pytest.mark.parametrize("kind", KINDS)
def test_provisional_verdicts_seldom_change(kind: Kind) -> None:
    """Of all points at all looks on the way, of six scans: 1.3 % of a step's change at most, and none of good parts."""
    given = changed = points = 0
    for seed in range(6):
        looks, result = followed(live_scan(kind, seed), "best-fit")
        for look in looks:
            is_given = look.verdicts != Verdict.UNCERTAIN
            given, points = given + int(is_given.sum()), points + look.stop
            changed += int((look.verdicts != result.verdicts[: look.stop])[is_given].sum())
    assert changed <= {"step": 0.02, "late form": 0.01}.get(kind, 0.001) * points
    assert given >= {"step": 0.05, "dense side": 0.2, "late form": 0.1}.get(kind, 0.25) * points


@pytest.mark.parametrize("kind", KINDS)
def test_a_minimum_zone_gives_no_verdict_before_it_is_settled(kind: Kind) -> None:
    looks, result = followed(live_scan(kind, 1), "minimum-zone")
    assert looks
    assert all((look.verdicts == Verdict.UNCERTAIN).all() for look in looks)
    assert (result.verdicts != Verdict.UNCERTAIN).mean() > 0.5


def test_a_scan_that_is_mostly_unusable_is_not_fitted_anew_at_every_block(monkeypatch: pytest.MonkeyPatch) -> None:
    fits = []

    def counted(*arguments: Any, **options: Any) -> Any:
        fits.append(1)
        return register_fine(*arguments, **options)

    monkeypatch.setattr("inspection.pose_track.register_fine", counted)
    points, _ = surface("P3", 20_000, 2)
    points[np.random.default_rng(5).random(20_000) < 0.55] = np.nan
    live = LiveInspection(nominal_of("P3"), ToleranceZone(-0.1, 0.1))
    for k in range(0, len(points), 512):
        live.add(points[k : k + 512])
    assert live.state == "provisional"
    assert len(fits) <= 10
