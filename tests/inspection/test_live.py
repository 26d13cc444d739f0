"""Live inspection: the same points in any batches, honest counts, and what provisional means."""

from operator import attrgetter
from typing import Any

import numpy as np
import pytest

from inspection import (
    LiveInspection,
    NominalProfile,
    RegistrationError,
    Rejection,
    RigidTransform,
    SectionPlane,
    Verdict,
    deviations,
)
from inspection.kernels import few_rows, rows
from tests.inspection import profiles
from tests.inspection.profiles import Array, curve_of, nominal_of
from tests.inspection.scans import ZONE, inspect_in_batches, surface

PLANE = SectionPlane(np.array([5.0, 6.0, 7.0]), np.array([1.0, 1.0, 0.0]), np.array([0.0, 0.3, 1.0]))


CASES: dict[str, tuple[str, dict[str, Any]]] = {
    "best fit": ("P3", {}),
    "best fit of an open profile": ("P1", {"coverage_min": 0.5}),
    "minimum zone": ("P2", {"fit": "minimum-zone"}),
    "datum": ("NACA 2412 sharp", {"datum": RigidTransform(np.deg2rad(-30.0), profiles.rotated(np.array([[-4.0, -9.0]]), -30.0)[0])}),
    "ball centres in space": ("P3", {"tip_radius_mm": 0.5, "section": PLANE, "off_section_max_mm": 0.5}),
    "outliers": ("P3", {"reject_outliers": True}),
    "veaw": ("P3", {"method": "veaw"}),
    "pcp": ("P3", {"method": "pcp"}),
    "inversion": ("P1", {"method": "inversion"}),
    "chord": ("P2", {"method": "chord"}),
    "circle": ("NACA 2412 sharp", {"method": "circle"}),
}


def recorded(case: str) -> tuple[NominalProfile, Array, dict[str, Any]]:
    """A scan as it would arrive, some of it damaged: not numbers, off the section, far off, beyond the ends."""
    name, options = CASES[case]
    rng = np.random.default_rng(1)
    points, _ = surface(name, 448, 2, defect_mm=0.12)
    if options.get("tip_radius_mm"):
        u = profiles.even_in_arc_length(curve_of(name), 448)
        points = points - options["tip_radius_mm"] * profiles.left_normal(curve_of(name), u)
    if not curve_of(name).closed:
        start, end = nominal_of(name).tangent[0], nominal_of(name).tangent[-1]
        points = np.vstack([points[0] - 1.0 * start, points[1:-1], points[-1] + 1.0 * end])
    if options.get("reject_outliers"):
        points[rng.choice(448, 30, replace=False)] += rng.choice([-1, 1], (30, 2)) * rng.uniform(1, 3, (30, 2))
    points = profiles.rotated(points, 30.0, (4.0, 9.0))
    if "section" in options:
        points = PLANE.to_machine(points)
        points[100:104] += 2.0 * np.array(PLANE.normal)
    points[[50, 333]] = np.nan
    points[120, 0] = np.inf
    return nominal_of(name), points, options


@pytest.mark.parametrize("case", CASES)
def test_any_batches_give_identical_verdicts_and_bit_identical_deviations(case: str) -> None:
    nominal, points, options = recorded(case)
    _, whole = inspect_in_batches(nominal, points, len(points), **options)
    for size in (1, 64):
        live, cut = inspect_in_batches(nominal, points, size, **options)
        assert live.received == whole.received == len(points)
        for field in ("verdicts", "rejection", "deviation_mm", "foot_mm", "station_mm", "actual_mm"):
            assert np.array_equal(getattr(cut, field), getattr(whole, field), equal_nan=getattr(cut, field).dtype.kind == "f"), (
                size,
                field,
            )
        assert cut.verdict is whole.verdict
        assert cut.coverage == whole.coverage
        assert cut.stretches == whole.stretches
        a, b = cut.registration.nominal_from_section, whole.registration.nominal_from_section
        assert a.rotation_rad == b.rotation_rad
        assert np.array_equal(a.translation_mm, b.translation_mm)


@pytest.mark.parametrize("case", ["best fit", "best fit of an open profile", "datum", "ball centres in space"])
def test_what_is_said_on_the_way_does_not_depend_on_the_batches_either(case: str) -> None:
    nominal, points, options = recorded(case)
    lives = {size: LiveInspection(nominal, ZONE, **options) for size in (1, 7, 64, 192)}
    for stop in (64, 128, 192, 320, 448):
        seen = {}
        for size, live in lives.items():
            while live.received < stop:
                live.add(points[live.received : min(stop, live.received + size)])
            seen[size] = live.snapshot()
        for size, now in seen.items():
            assert now.state == seen[1].state, (stop, size)
            assert now.stop == stop
            assert np.array_equal(now.verdicts, seen[1].verdicts), (stop, size)
            assert np.array_equal(now.deviation_mm, seen[1].deviation_mm, equal_nan=True), (stop, size)
            assert np.array_equal([now.can_move_mm], [seen[1].can_move_mm], equal_nan=True), (stop, size)


@pytest.mark.parametrize("case", CASES)
def test_received_is_judged_plus_rejected_and_every_rejection_has_its_reason(case: str) -> None:
    nominal, points, options = recorded(case)
    _, result = inspect_in_batches(nominal, points, 100, **options)
    assert result.received == len(points) == result.judged + result.rejected
    assert sum(result.rejected_by_reason.values()) == result.rejected
    assert np.flatnonzero(result.rejection == Rejection.NOT_FINITE).tolist() == [50, 120, 333]
    rejected = result.rejection != Rejection.NONE
    assert np.isnan(result.deviation_mm[rejected]).all()
    assert np.isfinite(result.deviation_mm[~rejected]).all()
    assert np.array_equal(result.verdicts[~rejected], ZONE.verdicts(result.deviation_mm[~rejected]))
    assert not np.isin(result.verdicts[rejected], list(Verdict)).any()
    if "section" in options:
        assert (result.rejection[100:104] == Rejection.OFF_SECTION).all()
        assert (result.rejection == Rejection.OFF_SECTION).sum() == 4
    if not nominal.curve.closed:
        assert (result.rejection[[0, -1]] == Rejection.BEYOND_END).all()


def test_without_a_fit_points_are_taken_where_they_are() -> None:
    points, deviation = surface("P3", 300, 5)
    live = LiveInspection(nominal_of("P3"), ZONE, fit="none")
    update = live.add(points)
    assert update.state == "settled"
    assert update.can_move_mm == 0
    assert np.abs(update.deviation_mm - deviation).max() < 1e-11
    result = live.finish()
    assert np.array_equal(result.deviation_mm, update.deviation_mm)


def test_with_a_datum_the_live_verdict_is_the_final_one() -> None:
    nominal, points, options = recorded("datum")
    live = LiveInspection(nominal, ZONE, **options)
    seen, verdicts = [], []
    for k in range(0, len(points), 33):
        update = live.add(points[k : k + 33])
        assert update.state == "settled"
        assert (update.first, update.stop) == (k, min(k + 33, len(points)))
        seen.append(update.deviation_mm)
        verdicts.append(update.verdicts)
    result = live.finish()
    assert np.array_equal(np.concatenate(seen), result.deviation_mm, equal_nan=True)
    assert np.array_equal(np.concatenate(verdicts), result.verdicts)
    assert result.out_of_tolerance > 0


def test_too_few_points_are_an_error_and_an_empty_batch_is_none() -> None:
    live = LiveInspection(nominal_of("P3"), ZONE)
    update = live.add(np.empty((0, 2)))
    assert (update.first, update.stop) == (0, 0)
    assert live.state == "seeking"
    live.add(surface("P3", 600, 9)[0][:5])
    with pytest.raises(RegistrationError):
        live.finish()


def test_live_deviations_use_the_chosen_method() -> None:
    points, _ = surface("P3", 300, 10)
    for method in ("chord", "pcp", "veaw", "circle"):
        live = LiveInspection(nominal_of("P3"), ZONE, fit="none", method=method)
        assert np.array_equal(live.add(points).deviation_mm, deviations(points, nominal_of("P3"), method).deviation_mm)


def compiled() -> list[int]:
    """For how many kinds of arguments the loops that every batch goes through are compiled."""
    return [len(attrgetter("signatures")(loop)) for loop in (few_rows._judge_few, rows.enter_points)]


def test_arrays_of_any_make_are_taken_in_by_the_loops_that_are_compiled_already() -> None:
    nominal = nominal_of("P3")
    points = nominal.points_mm[:256].copy()
    plain = LiveInspection(nominal, ZONE, datum=RigidTransform.identity())
    plain.add(points[:8])
    before, frozen = compiled(), points.copy()
    frozen.setflags(write=False)
    for made in (frozen, np.asfortranarray(points), np.column_stack([points, points])[:, :2], points.astype(np.float32), points[::-1]):
        live = LiveInspection(nominal, ZONE, datum=RigidTransform.identity())
        live.add(made[:8])
        assert np.abs(live.add(made[8:200]).deviation_mm).max() < 1e-4
    assert compiled() == before
