"""The proof in mid-scan: it comes when no placement is left, never on a part that can pass, and never for points beyond an end."""

from typing import Any
from unittest.mock import patch

import numpy as np
import pytest

from inspection import LiveInspection, RigidTransform, ToleranceZone, Verdict, discretize
from inspection.cloud import MANY
from inspection.methods import FitName
from inspection.prefix import PrefixWatch
from inspection.telling_points import telling_rows
from tests.inspection import profiles
from tests.inspection.live_scans import ZONE, LiveScan, live_scan, proven_at
from tests.inspection.profiles import Array
from tests.inspection.reference_parts import nominal_of, scan
from tests.inspection.test_placements import dented


@pytest.mark.parametrize("name", ["goe404", "mh42"])
def test_the_reference_parts_are_proven_out_where_their_last_placement_goes(name: str) -> None:
    """METROLOGY's dent: a prefix of 220 points has a placement within 0.05 mm, one of 240 has none."""
    assert proven_at(LiveScan(nominal_of(name), dented(name)), ToleranceZone(-0.05, 0.05), every=20) == 240


@pytest.mark.parametrize("seed", range(5))
def test_a_good_part_is_never_proven_out(seed: int) -> None:
    assert proven_at(live_scan("good", seed), ZONE, every=50) is None
    assert proven_at(live_scan("dense side", seed), ZONE, every=50) is None


@pytest.mark.parametrize("seed", range(8))
def test_a_part_that_only_just_passes_is_never_proven_out(seed: int) -> None:
    """Its form reaches 96 % of the zone, so at the pose of a prefix points look out; in its own place the part passes."""
    rng = np.random.default_rng(seed)
    name = ("goe404", "mh42")[seed % 2]
    share = (np.arange(400) + 0.5) / 400
    waves = [rng.uniform(-1, 1) * np.cos(2 * np.pi * k * share + rng.uniform(0, 7)) for k in range(1, 9)]
    form = np.sum(waves, axis=0)
    points = scan(name, 400, 0.048 * form / np.abs(form).max(), rng.uniform(-180, 180), (20.0, -10.0))
    assert proven_at(LiveScan(nominal_of(name), points), ToleranceZone(-0.05, 0.05), every=25) is None


@pytest.mark.parametrize("fit", ["best-fit", "minimum-zone"])
def test_what_is_proven_out_is_not_conform_in_the_end(fit: FitName) -> None:
    for seed in range(4):
        given = live_scan("dent", seed)
        live = LiveInspection(given.nominal, ZONE, fit=fit)
        live.add(given.points_mm)
        prefix = live.prefix()
        assert prefix is not None
        assert live.prefix_search().refutes(prefix)
        assert live.finish().verdict == Verdict.NONCONFORM


def test_points_that_may_lie_beyond_an_open_end_take_no_part() -> None:
    nominal = discretize(profiles.p1(), samples=1000)
    u = profiles.even_in_arc_length(nominal.curve, 400)
    u[[0, -1]] = nominal.curve.domain
    points = nominal.curve.point(u)
    normal = profiles.left_normal(nominal.curve, u)
    for at, is_proof in ((0, False), (399, False), (200, True)):
        live = LiveInspection(nominal, ToleranceZone(-0.02, 0.02))
        bump = np.where(np.arange(400) == at, 0.5, 0.0)
        live.add(RigidTransform(0.7, np.array([5.0, 9.0])).apply(points + bump[:, None] * normal))
        prefix = live.prefix()
        assert (prefix is not None and live.prefix_search().refutes(prefix)) == is_proof


@pytest.mark.parametrize("many", [MANY, 300])
def test_a_prefix_costs_what_is_new_and_is_that_of_a_look_at_all(many: int) -> None:
    """Of a scan of many points no row is looked at twice, whatever its length, unless all were judged anew."""
    given, rng = live_scan("dent", 3, 3000), np.random.default_rng(1)
    looked = []

    def seen(station_mm: Array, deviation_mm: Array, *rest: Any) -> Any:
        looked.append(len(station_mm) - rest[-1])
        return telling_rows(station_mm, deviation_mm, *rest)

    with patch("inspection.live.MANY", many), patch("inspection.prefix.MANY", many), patch("inspection.prefix.telling_rows", seen):
        live, terms = LiveInspection(given.nominal, ZONE), LiveInspection(given.nominal, ZONE)._terms
        prefixes = 0
        for points in np.split(given.points_mm, np.sort(rng.integers(1, 3000, 30))):
            live.add(points)
            prefix = live.prefix()
            if live._track is None:
                continue
            looked_so_far = len(looked)
            whole = PrefixWatch(terms).prefix(live._rows, live._track.pose, live._track.slide_mm())
            del looked[looked_so_far:]
            assert (prefix is None) == (whole is None)
            if prefix is not None and whole is not None:
                prefixes += 1
                for name in ("received", "points_mm", "station_mm", "deviation_mm"):
                    assert np.array_equal(getattr(prefix, name), getattr(whole, name)), name
    assert prefixes > 5
    assert sum(looked) == (3000 if many == 300 else 0)


def test_a_long_prefix_is_asked_about_by_the_points_that_stand_for_all() -> None:
    given = live_scan("dent", 1, 60_000)
    live = LiveInspection(given.nominal, ZONE)
    live.add(given.points_mm)
    prefix = live.prefix()
    assert prefix is not None
    search = live.prefix_search()
    rows = search._telling_rows(prefix)
    assert len(rows) <= 1024
    assert np.array_equal(rows, np.unique(rows))
    assert int(np.abs(prefix.deviation_mm).argmax()) in rows
    assert search.refutes(prefix)


def test_there_is_no_prefix_to_ask_about_where_nothing_can_be_proven() -> None:
    good, bad = live_scan("noise only", 3), live_scan("dent", 3)
    for given, live in (
        (good, LiveInspection(good.nominal, ZONE)),
        (bad, LiveInspection(bad.nominal, ZONE, datum=RigidTransform.identity())),
        (bad, LiveInspection(bad.nominal, ZONE, reject_outliers=True)),
    ):
        assert live.prefix() is None
        live.add(given.points_mm)
        assert live.prefix() is None


def test_a_search_that_is_told_to_end_proves_nothing() -> None:
    given = live_scan("dent", 5)
    live = LiveInspection(given.nominal, ZONE)
    live.add(given.points_mm)
    prefix = live.prefix()
    assert prefix is not None
    assert not live.prefix_search().refutes(prefix, is_over=lambda: True)


def test_a_look_is_cut_into_slices_between_which_others_are_let_through() -> None:
    """Between two questions lies one wave of boxes or one linear program, so that none of them takes long."""
    given = live_scan("step", 1)
    live, looks = LiveInspection(given.nominal, ZONE), list[int]()
    for first in range(0, len(given.points_mm), 100):
        live.add(given.points_mm[first : first + 100])
        prefix, asked = live.prefix(), [0]

        def is_over(asked: list[int] = asked) -> bool:
            asked[0] += 1
            return False

        if prefix is not None:
            live.prefix_search().refutes(prefix, is_over)
            looks.append(asked[0])
    assert min(looks) >= 1
    assert max(looks) >= 5
